"""A position controller as they stand in drives, as a block of its own."""

from dataclasses import dataclass
from typing import final

import casadi as ca

from symfric.codegen import Block
from symfric.foundation.parameters import Parametric, Variable, param
from symfric.laws.base import smooth
from symfric.model import Output


@final
@dataclass(frozen=True, eq=False)
class Cascade(Parametric):
    """A cascade of position (P) and velocity (PI) with an encoder, at a fixed sample time.

        x_m = count round(x / count)                     what the encoder says
        v_m = v_m + share [(x_m - x_m before) / h - v_m]    filtered difference
        v_s = v_ref + kp (r - x_m)                       set velocity
        u   = kv (v_s - v_m) + I + inertia a_ref,   I+ = I + ki kv h (v_s - v_m)

    I and u are held within +-limit; I does not go on where u has reached it, nor on `hold`.
    """

    h: float = param(1e-3, unit="s", role="time", doc="sample time", lower=1e-9)
    kp: float = param(60.0, unit="1/s", doc="position gain", lower=0.0)
    kv: float = param(200.0, unit="N s/m", doc="velocity gain", lower=0.0)
    ki: float = param(20.0, unit="1/s", doc="integral gain of the velocity loop", lower=0.0)
    inertia: float = param(1.0, unit="kg", doc="mass that a_ref is times", lower=0.0)
    limit: float = param(100.0, unit="N", doc="largest force", lower=0.0)
    count: float = param(1e-6, unit="m", doc="one count of the encoder", lower=1e-15)
    share: float = param(
        0.5, unit="1", doc="of a new difference in the velocity", lower=1e-6, upper=1.0
    )

    def block(self) -> Block:
        """(x, r, v_ref, a_ref, hold) -> u, and what it measures: x_m, v_m, e, v_s."""
        x, r, v_ref, a_ref, hold = inputs = (
            Variable("x", "m", nominal=0.1, doc="position"),
            Variable("r", "m", nominal=0.1, doc="reference position"),
            Variable("v_ref", "m/s", nominal=0.1, doc="reference velocity"),
            Variable("a_ref", "m/s^2", nominal=1.0, doc="reference acceleration"),
            Variable("hold", "1", lower=0.0, upper=1.0, doc="above 0.5: no integration"),
        )
        before, v_before, integral = states = (
            Variable("before", "m", doc="position before"),
            Variable("v_before", "m/s", doc="velocity before"),
            Variable("integral", "N", doc="integral force"),
        )
        x_m = self.count * ca.floor(x.symbol / self.count + 0.5)
        v_m = v_before.symbol + self.share * ((x_m - before.symbol) / self.h - v_before.symbol)
        e = r.symbol - x_m
        v_s = v_ref.symbol + self.kp * e
        wanted = self.kv * (v_s - v_m) + integral.symbol + self.inertia * a_ref.symbol
        u = smooth.clip(wanted, -self.limit, self.limit)
        more = integral.symbol + self.ki * self.kv * self.h * (v_s - v_m)
        more = smooth.clip(more, -self.limit, self.limit)
        free = ca.logic_or(wanted == u, (v_s - v_m) * u < 0)
        free = ca.logic_and(free, hold.symbol <= 0.5)
        return Block(
            "cascade",
            doc="Position controller: P in position, PI in velocity.",
            states=states,
            inputs=inputs,
            next=ca.vertcat(x_m, v_m, ca.if_else(free, more, integral.symbol)),
            outputs={
                "u": Output(u, "N", "commanded force"),
                "x_m": Output(x_m, "m", "measured position"),
                "v_m": Output(v_m, "m/s", "measured velocity"),
                "e": Output(e, "m", "position error"),
                "v_s": Output(v_s, "m/s", "set velocity"),
            },
        )
