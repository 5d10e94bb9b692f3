"""A positioning drive: one mass, a force input, friction and a constant offset."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import ClassVar, final

import casadi as ca

from symfric.foundation import checks
from symfric.foundation.numeric import Scalar
from symfric.foundation.parameters import Variable, param, with_values
from symfric.laws import Law
from symfric.model import Model, Output, Variables
from symfric.model.sketch import Sketch
from symfric.scenes import fields
from symfric.scenes.base import GivenInput, Scene, contact, in_turning, structure
from symfric.scenes.drawn import Block, drawn


def sine(t: ca.SX) -> ca.SX:
    """Force 2 sin(pi t) N: beyond the default break-away force of 1.18 N in both directions."""
    return 2 * ca.sin(ca.pi * t)


@final
@dataclass(frozen=True, eq=False)
class Drive(Scene):
    """A mass driven by a force, with friction and a constant offset force.

        x' = v,   m v' = force - F(v, N) - offset

    `force` is the input. With the normal force N = 1 N the coefficients mu of a law read as force
    levels in newton, which is how the friction of a drive of unknown load is identified. With
    turning = True the axis turns: the same equations in rad, rad/s, N m and kg m^2.
    Defaults: mass and load of the block of `Rabinowicz` (N = m g).
    """

    t_end: ClassVar[float] = 4.0
    inputs: ClassVar[Mapping[str, GivenInput]] = {"force": GivenInput("2 sin(pi t)", sine)}

    m: Scalar = fields.MASS(0.8, doc="moving mass")
    N: Scalar = fields.LOAD(0.8 * 9.81, doc="normal force")
    offset: Scalar = param(0.0, unit="N", role="offset", doc="constant force opposing the input")

    turning: bool = structure(default=False, doc="whether the axis turns")

    def __post_init__(self) -> None:
        checks.flag("Drive: turning", self.turning)
        super().__post_init__()

    def equations(self, p: Variables) -> Model:
        """States x, v and those of the law; input force; outputs friction, power."""
        x = Variable("x", "m", nominal=0.1, doc="position")
        v = Variable("v", "m/s", nominal=0.1, doc="velocity")
        force = Variable("force", "N", nominal=1.0, doc="driving force")
        applied = force.symbol - self.offset
        slip = contact("guide", self.law, v.symbol, self.N, rest={"v": 0.0}, F_e=applied)
        model = Model(
            name="drive",
            x=(x, v),
            u=(force,),
            p=p,
            ode=ca.vertcat(v.symbol, (applied - slip.force) / self.m),
            contacts=(slip,),
            outputs={
                "friction": Output(slip.force, "N", "friction force opposing v"),
                "power": Output(slip.force * v.symbol, "W", "power taken by friction"),
            },
            sketch=partial(self._sketch, x.symbol),
        )
        return in_turning(model) if self.turning else model

    def _sketch(self, x: ca.SX) -> Sketch:
        """The mass on its guide, or a hand that turns."""
        if self.turning:
            return drawn({}, hands={"axis": (x, 1.0)})
        return drawn({"mass": Block(x, 0.0, "x", "v", self.law)})


def drive(
    law: Law, *, turning: bool = False, free: Iterable[str] = (), **parameters: Scalar
) -> Model:
    """Model of a mass with force input and friction `law`; `turning`: of an axis that turns.

    `parameters` are m, N, offset and those of the law, by name. Those named in
    `free` become symbols in `Model.p`.
    """
    return with_values(Drive(law, turning=turning), parameters).model(free)
