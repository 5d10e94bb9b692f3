"""A positioning drive: one mass, a force input, friction and a constant offset."""

from dataclasses import dataclass
from typing import final

import casadi as ca

from symfric.foundation.numeric import Scalar
from symfric.foundation.parameters import Variable, param
from symfric.model import Model, Output, Variables
from symfric.scenes.base import Scene, contact


@final
@dataclass(frozen=True, eq=False)
class Drive(Scene):
    """A mass driven by a force, with friction and a constant offset force.

        x' = v,   m v' = force - F(v, N) - offset

    `force` is the input. With the normal force N = 1 N the coefficients mu of a law read as force
    levels in newton, which is how the friction of a drive of unknown load is identified.
    Defaults: mass and load of the block of seed table 2 (N = m g).
    """

    m: Scalar = param(0.8, unit="kg", doc="moving mass", lower=1e-12)
    N: Scalar = param(0.8 * 9.81, unit="N", doc="normal force", lower=0.0)
    offset: Scalar = param(0.0, unit="N", doc="constant force opposing the input")

    def equations(self, p: Variables) -> Model:
        """States x, v and those of the law; input force; outputs friction, power."""
        x = Variable("x", "m", nominal=0.1, doc="position")
        v = Variable("v", "m/s", nominal=0.1, doc="velocity")
        force = Variable("force", "N", nominal=1.0, doc="driving force")
        applied = force.symbol - self.offset
        slip = contact(self.law, v.symbol, self.N, p, rest={"v": 0.0}, F_e=applied)
        return Model(
            name="drive",
            x=(x, v, *slip.states),
            u=(force,),
            p=p,
            ode=ca.vertcat(v.symbol, (applied - slip.force) / self.m, slip.rate),
            monitors=slip.monitors,
            events=slip.events,
            outputs={
                "friction": Output(slip.force, "N", "friction force opposing v"),
                "power": Output(slip.force * v.symbol, "W", "power taken by friction"),
            },
        )
