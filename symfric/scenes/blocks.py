"""Sliding blocks: a positioning drive, Rabinowicz's block on a belt, two coupled blocks."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import ClassVar, final

import casadi as ca

from symfric.foundation import checks
from symfric.foundation.numeric import Scalar, equals, smallest
from symfric.foundation.parameters import Variable, param, with_values
from symfric.laws import BrownMcPhee, Law, LeineSwitch, LuGre
from symfric.model import Model, Output, Variables
from symfric.model.kinds import FRICTION
from symfric.model.sketch import Sketch
from symfric.scenes import fields, jing_mi
from symfric.scenes.base import (
    Block,
    GivenInput,
    Scene,
    around,
    contact,
    drawn,
    in_turning,
    other_law,
    structure,
)
from symfric.scenes.presets import Numbers, Preset


def sine(t: ca.SX) -> ca.SX:
    """Force 2 sin(pi t) N: beyond the default break-away force of 1.18 N in both directions."""
    return 2 * ca.sin(ca.pi * t)


@final
@dataclass(frozen=True, eq=False)
class Drive(Scene):
    """Mass driven by a force, with friction and a constant offset force.

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
        """Return the mass on its guide, or a hand that turns."""
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


@final
@dataclass(frozen=True, eq=False)
class Rabinowicz(Scene):
    """Block on a belt that moves at constant speed, held to the ground by a spring.

        x' = v,   m v' = -k x - F(v - v_belt, N),   N = m g

    x is the spring elongation, positive in the direction of the belt. The sliding velocity is that
    of the block relative to the belt, so while the belt carries the block the friction force F is
    negative: it opposes the block's motion relative to the belt.

    Defaults: Jing and Mi, Selection Mechanism of Friction Models, tables 2 and 3 (m = 0.8 kg,
    k = 2.1 N/m, belt 0.1 m/s); the block starts at x = 0 at rest.
    """

    t_end: ClassVar[float] = 20.0
    presets: ClassVar[Mapping[str, Preset]] = {
        "jing_mi_table_3": Preset(
            "block of table 2, every law with its own numbers of table 3",
            jing_mi.SOURCE + "2 and 3",
            {"m": 0.8, "k": 2.1, "v_belt": 0.1, "g": 9.81},
            {"law": jing_mi.BELT},
        ),
        "canudas_de_wit": Preset(
            "stick-slip of the LuGre paper: F_C = 1 N and F_S = 1.5 N as coefficients under 10 N",
            "Canudas de Wit, Olsson, Astrom, Lischinsky, A New Model for Control of Systems with "
            "Friction",
            {"m": 1.0, "k": 2.0, "v_belt": 0.1, "g": 10.0},
            {
                "law": Numbers(
                    {"mu_s": 0.15, "mu_d": 0.1, "sigma_2": 0.4},
                    {LuGre: {"sigma_0": 1e5, "sigma_1": 1e5**0.5, "v_s": 1e-3}},
                )
            },
        ),
        "nikravesh": Preset(
            "block on a belt with Brown-McPhee friction",
            "Nikravesh, Planar Multibody Dynamics, 2nd edition, example 14.3",
            {"m": 1.0, "k": 10.0, "v_belt": 0.1, "g": 9.81},
            {"law": Numbers({"mu_s": 0.2, "mu_d": 0.15}, {BrownMcPhee: {"v_t": 1e-3}})},
        ),
    }

    m: Scalar = fields.MASS(0.8, doc="mass of the block")
    k: Scalar = fields.SPRING(2.1, doc="spring stiffness")
    v_belt: Scalar = fields.VELOCITY(0.1, doc="belt velocity")
    g: Scalar = fields.GRAVITY(9.81)

    def equations(self, p: Variables) -> Model:
        """States x, v and those of the law; outputs v_rel, friction, power."""
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
                "friction": Output(slip.force, "N", "friction force opposing v_rel"),
                "power": Output(slip.force * v_rel, "W", "power taken by the contact"),
            },
            t=t,
            sketch=partial(self._sketch, x.symbol, t),
        )

    def _sketch(self, x: ca.SX, t: ca.SX) -> Sketch:
        """Return the block on the belt, whose marks move with it, and its spring."""
        way = 0.15 * self.m * self.g / self.k if not equals(self.k, 0.0) else 1.0
        marks = [(around(self.v_belt * t + i * way / 3, -way, 2 * way), 0.0) for i in range(9)]
        return drawn(
            {"block": Block(x, 0.0, "x", "v_rel", self.law)},
            {"wall": (-way, 0.0)},
            [("spring", "wall", "block")],
            ticks=marks,
        )


def rabinowicz(law: Law, *, free: Iterable[str] = (), **parameters: Scalar) -> Model:
    """Model of a block on a belt with friction `law`.

    `parameters` are m, k, v_belt, g and those of the law, by name. Those named in
    `free` become symbols in `Model.p`.
    """
    return with_values(Rabinowicz(law), parameters).model(free)


@final
@dataclass(frozen=True, eq=False)
class CoupledBlocks(Scene):
    """Two blocks on a belt, each held to the ground by a spring, with a spring between them.

        m_1 v_1' = -k_1 x_1 + k_c (x_2 - x_1) - F(v_1 - v_belt, m_1 g)
        m_2 v_2' = -k_2 x_2 - k_c (x_2 - x_1) - F_2(v_2 - v_belt, m_2 g)
        x_1' = v_1,   x_2' = v_2

    x_1 and x_2 are the elongations of the springs, signs as in `Rabinowicz`. A block that breaks
    away pushes the other one: the smallest model of earthquakes, which slides in turns, together,
    or without a rule. `block_2` is the law of the second block.

    Defaults: two blocks of `Rabinowicz` of which one starts displaced.
    Limits: motions without a rule agree between tolerances for a few break-aways only.
    Source: Galvanetto and Bishop, Int. J. Mech. Sci. 36, 1994 (two-block model; not read).
    """

    t_end: ClassVar[float] = 20.0
    presets: ClassVar[Mapping[str, Preset]] = {
        "galvanetto": Preset(
            "two-block model without units: the second block breaks away at 1.3 times the force of "
            "the first, both fall as 1/(1 + 3 |v|); mu_d of laws that have one is ours",
            "Galvanetto and Bishop 1994, as quoted: alpha = 1.2, beta = 1.3, gamma = 3",
            {"m_1": 1.0, "m_2": 1.0, "k_1": 1.0, "k_2": 1.0, "k_c": 1.2, "v_belt": 0.1, "g": 1.0},
            {
                "law": Numbers({"mu_s": 1.0, "mu_d": 0.7}, {LeineSwitch: {"delta": 3.0}}),
                "block_2": Numbers({"mu_s": 1.3, "mu_d": 0.9}, {LeineSwitch: {"delta": 3.0}}),
            },
        )
    }

    block_2: Law | None = other_law("second block; `law` without")
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
        """States x_1, x_2, v_1, v_2 and those of the laws; friction and power of both."""
        x_1, x_2 = (
            Variable(f"x_{i}", "m", start=start, nominal=0.1, doc=f"elongation of spring {i}")
            for i, start in ((1, self.start_1), (2, self.start_2))
        )
        v_1, v_2 = (
            Variable(f"v_{i}", "m/s", nominal=0.1, doc=f"velocity of block {i}") for i in (1, 2)
        )
        between = self.k_c * (x_2.symbol - x_1.symbol)
        pulls = (-self.k_1 * x_1.symbol + between, -self.k_2 * x_2.symbol - between)
        sliding = tuple(v.symbol - self.v_belt for v in (v_1, v_2))
        one, two = (
            contact(
                f"block_{i + 1}", law, sliding[i], mass * self.g,
                rest={f"v_{i + 1}": self.v_belt}, bare=False, F_e=pulls[i],
            )
            for i, (law, mass) in enumerate(
                ((self.law, self.m_1), (self.law_of("block_2"), self.m_2))
            )
        )  # fmt: skip
        t = ca.SX.sym("t")
        return Model(
            name="coupled_blocks",
            x=(x_1, x_2, v_1, v_2),
            p=p,
            ode=ca.vertcat(
                v_1.symbol,
                v_2.symbol,
                (pulls[0] - one.force) / self.m_1,
                (pulls[1] - two.force) / self.m_2,
            ),
            contacts=(one, two),
            outputs={
                "v_rel_1": Output(sliding[0], "m/s", "velocity of block 1 relative to the belt"),
                "v_rel_2": Output(sliding[1], "m/s", "velocity of block 2 relative to the belt"),
                "friction_1": Output(
                    one.force, "N", "friction force opposing v_rel_1", kind=FRICTION
                ),
                "friction_2": Output(
                    two.force, "N", "friction force opposing v_rel_2", kind=FRICTION
                ),
                "power_1": Output(one.force * sliding[0], "W", "power taken by contact 1"),
                "power_2": Output(two.force * sliding[1], "W", "power taken by contact 2"),
            },
            t=t,
            sketch=partial(self._sketch, x_1.symbol, x_2.symbol, t),
        )

    def _sketch(self, x_1: ca.SX, x_2: ca.SX, t: ca.SX) -> Sketch:
        """Return the blocks on the belt, whose marks move with it; each hangs on a spring of
        its own.
        """
        stiff = smallest(self.k_1, self.k_2)
        way = 0.15 * self.m_1 * self.g / stiff if not equals(stiff, 0.0) else 1.0
        marks = [(around(self.v_belt * t + i * way / 3, -way, 4 * way), 0.0) for i in range(15)]
        return drawn(
            {
                "block_1": Block(x_1, 0.0, "x", "v_rel_1", self.law),
                "block_2": Block(x_2 + 2 * way, 0.0, "x", "v_rel_2", self.law_of("block_2")),
            },
            {"wall_1": (-way, 0.5 * way), "wall_2": (way, 0.5 * way)},
            [
                ("spring", "wall_1", "block_1"),
                ("spring", "wall_2", "block_2"),
                ("spring", "block_1", "block_2"),
            ],
            ticks=marks,
        )
