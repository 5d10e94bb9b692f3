"""Rabinowicz's stick-slip test: a block on a moving belt, held by a spring."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import ClassVar, final

import casadi as ca

from symfric.foundation.numeric import Scalar, equals
from symfric.foundation.parameters import Variable, param, with_values
from symfric.laws import BrownMcPhee, Law, LuGre
from symfric.model import Model, Output, Variables
from symfric.model.sketch import Sketch
from symfric.scenes import jing_mi
from symfric.scenes.base import Scene, contact
from symfric.scenes.drawn import Block, around, drawn
from symfric.scenes.presets import Numbers, Preset


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

    m: Scalar = param(0.8, unit="kg", role="mass", doc="mass of the block", lower=1e-12)
    k: Scalar = param(2.1, unit="N/m", role="stiffness", doc="spring stiffness", lower=0.0)
    v_belt: Scalar = param(0.1, unit="m/s", role="motion", doc="belt velocity")
    g: Scalar = param(9.81, unit="m/s^2", role="gravity", doc="gravity", lower=0.0)

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
        """The block on the belt, whose marks move with it, and its spring."""
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
