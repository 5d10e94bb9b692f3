"""A laminator nip: a web that a chill roll carries, rubbed by a slower rubber roller."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, final

import casadi as ca

from symfric.foundation.numeric import Scalar
from symfric.foundation.parameters import Variable, param
from symfric.laws.base import smooth
from symfric.model import Model, Output, Variables
from symfric.scenes.base import GivenInput, Scene, contact


def machine_start(t: ca.SX) -> ca.SX:
    """The line accelerates to 0.5 m/s within 4 s."""
    return 0.5 * smooth.clip(t / 4, 0.0, 1.0)


def pressing(t: ca.SX) -> ca.SX:
    """500 N, 5 % more and less with every turn of an eccentric roller at full speed."""
    return 500 + 25 * ca.sin(5 * t)


@final
@dataclass(frozen=True, eq=False)
class Nip(Scene):
    """Carton between a steel chill roll, which carries it, and a rubber roller that lags behind.

        J w' = R F(v, N) + k twist + d (w_0 - w),   twist' = w_0 - w
        v = v_line - R w,   w_0 = (1 - lag) v_line / R,   N = N_0 + max(load, 0)
        tau v_line' = v_set - v_line

    The web has the speed v_line of the line, which follows the input v_set, and slips by v over the
    nip roller, whose drive turns by `lag` slower, 1 to 2 % in practice. Friction drags the roller
    forward against its shaft (stiffness k, damping d), as the belt does the block of `Rabinowicz`:
    where the curve falls, the slip swings. The input `load` [N] presses the roller; below zero the
    nip is open. The contact is taken as flat under even pressure, friction as the law makes it of
    the load. -F is what the web feels, the step of its tension across the nip.

    Defaults: slip and its range of at most 650 mm/min from the thesis; it has no numbers of the
    machine: roller, shaft and load are made up. Its measured laws are presets of `Prescribed`.
    Limits: where friction falls, even slip and stick-slip are both motions of one nip, and start
    and law decide between them: under the defaults dry friction that was at rest swings for ever,
    the soft bristles of `LuGre` (1e5 N/m) find even slip. The web does not slip on the chill roll
    and does not stretch; no edge effects of the cylinder.
    Source: A Friction Model for Laminator Nips, MSc thesis TFRT-5968, Lund 2015, section 2.9.
    """

    t_end: ClassVar[float] = 8.0
    inputs: ClassVar[Mapping[str, GivenInput]] = {
        "v_set": GivenInput("0.5 min(t / 4, 1)", machine_start),
        "load": GivenInput("500 + 25 sin(5 t)", pressing),
    }

    J: Scalar = param(0.2, unit="kg m^2", role="inertia", doc="inertia of the roller", lower=1e-12)
    R: Scalar = param(0.1, unit="m", role="geometry", doc="radius of the roller", lower=1e-12)
    k: Scalar = param(
        200.0, unit="N m/rad", role="stiffness", doc="stiffness of its shaft", lower=0.0
    )
    d: Scalar = param(0.5, unit="N m s/rad", role="damping", doc="damping of its shaft", lower=0.0)
    tau: Scalar = param(
        0.1, unit="s", role="time", doc="time constant of the line's drive", lower=1e-9
    )
    lag: Scalar = param(
        0.015,
        unit="1",
        role="motion",
        doc="share by which its drive lags",
        lower=0.0,
        upper=1.0,
    )
    N_0: Scalar = param(1.0, unit="N", role="load", doc="load of the open nip", lower=0.0)

    def equations(self, p: Variables) -> Model:
        """States v_line, v_rel, twist and those of the law; inputs v_set, load; friction."""
        twist = Variable("twist", "rad", nominal=0.01, doc="twist of the shaft")
        v_rel = Variable("v_rel", "m/s", nominal=0.01, doc="slip of the web over the nip roller")
        line = Variable("v_line", "m/s", nominal=0.1, doc="speed of the web")
        target = Variable("v_set", "m/s", nominal=0.1, doc="speed that the line is set to")
        load = Variable("load", "N", nominal=100.0, doc="force that presses the nip roller")
        N = self.N_0 + smooth.positive(load.symbol, 0.0)
        v, twisting = v_rel.symbol, (v_rel.symbol - self.lag * line.symbol) / self.R
        shaft = self.k * twist.symbol + self.d * twisting
        gain = (target.symbol - line.symbol) / self.tau
        mass = self.J / (self.R * self.R)
        pull = mass * gain - shaft / self.R
        web = contact("web", self.law, v, N, rest={"v_rel": 0.0}, least=self.N_0, F_e=pull)
        return Model(
            name="nip",
            x=(line, v_rel, twist),
            u=(target, load),
            p=p,
            ode=ca.vertcat(gain, (pull - web.force) / mass, twisting),
            contacts=(web,),
            outputs={
                "w_roller": Output((line.symbol - v) / self.R, "rad/s", "speed of the nip roller"),
                "N": Output(N, "N", "normal force of the nip"),
                "torque": Output(shaft, "N m", "torque of the shaft on the roller"),
                "friction": Output(web.force, "N", "friction force on the roller, along v_rel"),
                "power": Output(web.force * v, "W", "power taken by friction"),
            },
        )
