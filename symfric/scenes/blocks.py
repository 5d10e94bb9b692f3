"""Sliding blocks: a positioning drive, Rabinowicz's block on a belt, two coupled blocks."""

from collections.abc import Iterable, Mapping
from dataclasses import replace
from functools import partial
from typing import ClassVar

import casadi as ca

from symfric.foundation import checks
from symfric.foundation.numeric import Scalar, equals, smallest
from symfric.foundation.parameters import Variable, param, parametric, with_values
from symfric.foundation.units import turned
from symfric.laws import Law
from symfric.model import Model, Output, Variables
from symfric.model.kinds import FRICTION
from symfric.model.sketch import Sketch
from symfric.scenes import fields
from symfric.scenes.base import GivenInput, Scene, contact, friction_outputs, other_law, structure
from symfric.scenes.drawing import RailBody, around, drawn


def sine(t: ca.SX) -> ca.SX:
    """Return 2 sin(pi t) N, which exceeds the default break-away force of 1.18 N."""
    return 2 * ca.sin(ca.pi * t)


@parametric
class Drive(Scene):
    """Mass driven by a force, with friction and a constant offset force.

        x' = v,   m v' = force - F(v, N) - offset

    `force` is the input. For N = 1 N the coefficients mu of a law are force levels in newton; this
    is used to identify the friction of a drive with unknown load. turning = True is a rotary axis,
    with the same equations in rad, rad/s, N m and kg m^2.
    Defaults: mass and load of the block of `Rabinowicz` (N = m g).
    """

    t_end: ClassVar[float] = 4.0
    inputs: ClassVar[Mapping[str, GivenInput]] = {"force": GivenInput("2 sin(pi t)", sine)}

    m: Scalar = fields.MASS(0.8, doc="moving mass")
    N: Scalar = fields.LOAD(0.8 * 9.81, doc="normal force")
    offset: Scalar = param(0.0, unit="N", role="offset", doc="constant force opposing the input")

    turning: bool = structure(default=False, doc="True for an axis that turns")

    def __post_init__(self) -> None:
        checks.flag("Drive: turning", self.turning)
        super().__post_init__()

    def equations(self, p: Variables) -> Model:
        """Return the model: states x, v and those of the law; input force; friction, power."""
        unit = turned if self.turning else str
        x = Variable("x", unit("m"), nominal=0.1, doc="position")
        v = Variable("v", unit("m/s"), nominal=0.1, doc="velocity")
        force = Variable("force", unit("N"), nominal=1.0, doc="driving force")
        applied = force.symbol - self.offset
        slip = contact(
            "guide", self.law, v.symbol, self.N, {"v": 0.0}, turning=self.turning, F_e=applied
        )
        return Model(
            name="drive",
            x=(x, v),
            u=(force,),
            p=tuple(replace(q, unit=unit(q.unit)) for q in p),
            ode=ca.vertcat(v.symbol, (applied - slip.force) / self.m),
            contacts=(slip,),
            outputs=friction_outputs(slip, "v"),
            sketch=partial(self._sketch, x.symbol),
        )

    def _sketch(self, x: ca.SX) -> Sketch:
        """Return the mass on its guide, or a rotating hand."""
        if self.turning:
            hub = RailBody(0.0, 0.0, "", "v", self.law, contact="guide")
            arrows = [("x v", (0.0, 0.0), "turn y"), ("force", (0.0, 0.0), "turn y")]
            return drawn({}, hands={"axis": (x, 1.0)}, hub=hub, arrows=arrows)
        return drawn(
            {"mass": RailBody(x, 0.0, "x", "v", self.law, "m", "guide")},
            arrows=[("x v", "mass", "x"), ("force", "mass", "x")],
        )


def drive(
    law: Law, *, turning: bool = False, free: Iterable[str] = (), **parameters: Scalar
) -> Model:
    """Return the model of a `Drive` with friction `law`.

    `parameters` are m, N, offset and those of the law, by name. Those named in `free` become
    symbols in `Model.p`.
    """
    return with_values(Drive(law, turning=turning), parameters).model(free)


@parametric
class Rabinowicz(Scene):
    """Block on a belt that moves at constant speed, held to the ground by a spring.

        x' = v,   m v' = -k x - F(v - v_belt, N),   N = m g

    x is the spring elongation, positive in the direction of the belt. The sliding velocity is that
    of the block relative to the belt. Therefore the friction force F is negative while the belt
    pulls the block forward.

    Defaults: Jing and Mi, Selection Mechanism of Friction Models, tables 2 and 3 (m = 0.8 kg,
    k = 2.1 N/m, belt 0.1 m/s); the block starts at x = 0 at rest.
    """

    t_end: ClassVar[float] = 20.0

    m: Scalar = fields.MASS(0.8, doc="mass of the block")
    k: Scalar = fields.SPRING(2.1, doc="spring stiffness")
    v_belt: Scalar = fields.VELOCITY(0.1, doc="belt velocity")
    g: Scalar = fields.GRAVITY(9.81)

    def equations(self, p: Variables) -> Model:
        """Return the model: states x, v and those of the law; outputs v_rel, friction, power."""
        x = Variable("x", "m", nominal=0.1, doc="spring elongation")
        v = Variable("v", "m/s", nominal=0.1, doc="velocity of the block")
        N, v_rel = self.m * self.g, v.symbol - self.v_belt
        pull = -self.k * x.symbol
        slip = contact("belt", self.law, v_rel, N, rest={"v": self.v_belt}, F_e=pull)
        t = ca.SX.sym("t")
        return Model(
            name="rabinowicz",
            x=(x, v),
            p=p,
            ode=ca.vertcat(v.symbol, (pull - slip.force) / self.m),
            contacts=(slip,),
            outputs={
                "v_rel": Output(v_rel, "m/s", "velocity of the block relative to the belt"),
                **friction_outputs(slip, "v_rel"),
            },
            t=t,
            sketch=partial(self._sketch, x.symbol, t),
        )

    def _sketch(self, x: ca.SX, t: ca.SX) -> Sketch:
        """Return the block with its spring, and the belt with marks that move with it."""
        way = 0.15 * self.m * self.g / self.k if not equals(self.k, 0.0) else 1.0
        marks = [(around(self.v_belt * t + i * way / 3, -way, 2 * way), 0.0) for i in range(9)]
        return drawn(
            {"block": RailBody(x, 0.0, "x", "v_rel", self.law, "m", "belt")},
            {"wall": (-way, 0.0)},
            [("spring", "wall", "block", "k")],
            ticks=marks,
            arrows=[("x v", "block", "x"), ("v_belt", (way, 0.0), "x")],
        )


def rabinowicz(law: Law, *, free: Iterable[str] = (), **parameters: Scalar) -> Model:
    """Return the model of a block on a belt, `Rabinowicz`, with friction `law`.

    `parameters` are m, k, v_belt, g and those of the law, by name. Those named in `free` become
    symbols in `Model.p`.
    """
    return with_values(Rabinowicz(law), parameters).model(free)


@parametric
class CoupledBlocks(Scene):
    """Two blocks on a belt, each held to the ground by a spring, with a spring between them.

        m_1 v_1' = -k_1 x_1 + k_c (x_2 - x_1) - F(v_1 - v_belt, m_1 g)
        m_2 v_2' = -k_2 x_2 - k_c (x_2 - x_1) - F_2(v_2 - v_belt, m_2 g)
        x_1' = v_1,   x_2' = v_2

    x_1 and x_2 are the elongations of the springs, with the signs of `Rabinowicz`. A block that
    breaks away pushes the other block. This is the smallest model of earthquakes, in which the
    blocks slide alternately, together, or irregularly. `block_2` is the law of the second block.

    Defaults: two blocks of `Rabinowicz`, one of which starts displaced.
    Limits: runs of an irregular motion at different tolerances agree for a few break-aways only.
    Source: Galvanetto and Bishop, Int. J. Mech. Sci. 36, 1994 (two-block model; not read).
    """

    t_end: ClassVar[float] = 20.0

    block_2: Law | None = other_law("second block; `law` by default")
    m_1: Scalar = fields.MASS(0.8, doc="mass of the first block")
    m_2: Scalar = fields.MASS(0.8, doc="mass of the second block")
    k_1: Scalar = fields.SPRING(2.1, doc="its spring to the ground")
    k_2: Scalar = fields.SPRING(2.1, doc="that of the second block")
    k_c: Scalar = fields.SPRING(2.5, doc="spring between them")
    v_belt: Scalar = fields.VELOCITY(0.1, doc="belt velocity")
    start_1: Scalar = fields.START(0.0, doc="x_1 at the start")
    start_2: Scalar = fields.START(0.2, doc="x_2 at the start")
    g: Scalar = fields.GRAVITY(9.81)

    def equations(self, p: Variables) -> Model:
        """Return the model: states x_1, x_2, v_1, v_2 and those of the laws; friction, power."""
        starts = {1: self.start_1, 2: self.start_2}
        x_1, x_2 = (
            Variable(f"x_{i}", "m", start=start, nominal=0.1, doc=f"elongation of spring {i}")
            for i, start in starts.items()
        )
        v_1, v_2 = (
            Variable(f"v_{i}", "m/s", nominal=0.1, doc=f"velocity of block {i}") for i in starts
        )
        between = self.k_c * (x_2.symbol - x_1.symbol)
        pulls = (-self.k_1 * x_1.symbol + between, -self.k_2 * x_2.symbol - between)
        laws, masses = (self.law, self.law_of("block_2")), (self.m_1, self.m_2)
        slips = tuple(
            contact(
                f"block_{i}", law, v.symbol - self.v_belt, m * self.g, {f"v_{i}": self.v_belt},
                bare=False, F_e=pull,
            )
            for i, law, v, m, pull in zip(starts, laws, (v_1, v_2), masses, pulls, strict=True)
        )  # fmt: skip
        rates = ((F - c.force) / m for F, c, m in zip(pulls, slips, masses, strict=True))
        t, outputs = ca.SX.sym("t"), dict[str, Output]()
        for i, slip in enumerate(slips, start=1):
            doc = f"velocity of block {i} relative to the belt"
            outputs[f"v_rel_{i}"] = Output(slip.slip, "m/s", doc)
        for what in ("friction", "power"):
            for i, slip in enumerate(slips, start=1):
                output = friction_outputs(slip, f"v_rel_{i}")[what]
                kind = FRICTION if what == "friction" else ""
                outputs[f"{what}_{i}"] = replace(output, kind=kind)
        return Model(
            name="coupled_blocks",
            x=(x_1, x_2, v_1, v_2),
            p=p,
            ode=ca.vertcat(v_1.symbol, v_2.symbol, *rates),
            contacts=slips,
            outputs=outputs,
            t=t,
            sketch=partial(self._sketch, x_1.symbol, x_2.symbol, t),
        )

    def _sketch(self, x_1: ca.SX, x_2: ca.SX, t: ca.SX) -> Sketch:
        """Return the blocks with their springs, and the belt with marks that move with it."""
        stiff = smallest(self.k_1, self.k_2)
        way = 0.15 * self.m_1 * self.g / stiff if not equals(stiff, 0.0) else 1.0
        marks = [(around(self.v_belt * t + i * way / 3, -way, 4 * way), 0.0) for i in range(15)]
        return drawn(
            {
                "block_1": RailBody(x_1, 0.0, "x", "v_rel_1", self.law, "m_1", "block_1"),
                "block_2": RailBody(
                    x_2 + 2 * way, 0.0, "x", "v_rel_2", self.law_of("block_2"), "m_2", "block_2"
                ),
            },
            {"wall_1": (-way, 0.5 * way), "wall_2": (way, 0.5 * way)},
            [("spring", f"wall_{i}", f"block_{i}", f"k_{i}") for i in (1, 2)]
            + [("spring", "block_1", "block_2", "k_c")],
            ticks=marks,
            arrows=[(f"x_{i} v_{i}", f"block_{i}", "x") for i in (1, 2)]
            + [("v_belt", (3.5 * way, 0.0), "x")],
        )
