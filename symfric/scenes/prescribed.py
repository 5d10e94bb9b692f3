"""A tribometer: any law under a motion and a load that are given."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, final

import casadi as ca

from symfric.foundation.numeric import Scalar
from symfric.foundation.parameters import Variable, option, param
from symfric.laws import GMS, Dahl, ElastoPlastic, Leuven, LuGre, SteadyStateLuGre, Stribeck
from symfric.laws.base import smooth
from symfric.laws.base.law import FORCE
from symfric.model import Model, Output, Variables
from symfric.scenes.base import GivenInput, Scene, contact
from symfric.scenes.drawn import Block, drawn
from symfric.scenes.presets import Numbers, Preset


def strokes(t: ca.SX) -> ca.SX:
    """Velocity 0.005 sin(2 pi t) m/s: through rest and five Stribeck velocities of most laws."""
    return 5e-3 * ca.sin(2 * ca.pi * t)


_CURVE = {"v_s": 98e-6, "delta": 0.78}
_BRISTLE = _CURVE | {"sigma_0": 0.16e6, "sigma_1": 0.08}
_LEVELS = {"mu_s": 1.05, "mu_d": 0.2, "sigma_2": 0.0}


def _sled(
    study: str, slowest: int, F_S: float, F_C: float, v_s: float, sigma_2: float, delta: float
) -> Preset:
    """Carton pulled over rubber from `slowest` [mm/min] on: forces as coefficients under 1 N."""
    curve = {"v_s": v_s, "delta": delta}
    levels = {"mu_s": F_S, "mu_d": F_C, "sigma_2": sigma_2}
    measured = {"F_S": F_S, "F_C": F_C, "sigma_2": sigma_2, **curve}
    return Preset(
        f"sled of the {study} study, forces as coefficients under 1 N (its weight is not given); "
        f"measured from {slowest} to 500 mm/min, smooth above 140; the machine runs up to 650",
        f"A Friction Model for Laminator Nips, MSc thesis TFRT-5968, Lund 2015, {study} study",
        {"N": 1.0},
        {"law": Numbers(levels, {SteadyStateLuGre: measured, Stribeck: curve, LuGre: curve})},
    )


@final
@dataclass(frozen=True, eq=False)
class Prescribed(Scene):
    """A law under measured or imagined motion: velocity in, friction out.

        x' = v,   z' = rate(v, N, z),   friction = F(v, N, z)

    `v` is the input, constant, a function of time or samples (`Hold`, `Linear`). A position that
    was measured becomes one by `rate_of(Linear(t, x))`, straight between its samples; on the
    command line write `--input x=FILE.csv:COLUMN`. With load = "input" the normal force is the
    input `load`, N where nothing is given, and not below `N_least`, so that noise around an open
    contact does not press backwards. What else a law needs, such as an acceleration or a
    temperature, is an input of its name.

    Limits: no laws that need the force F_e which rest must carry (`Karnopp`, `ExactCoulomb`, ...):
    a given motion does not say it. Internal states start as after long
    rest, whatever the first velocity is.
    """

    t_end: ClassVar[float] = 2.0
    inputs: ClassVar[Mapping[str, GivenInput]] = {
        "v": GivenInput("0.005 sin(2 pi t)", strokes),
    }
    integrals: ClassVar[Mapping[str, str]] = {"x": "v"}
    presets: ClassVar[Mapping[str, Preset]] = {
        "lampaert_table_1": Preset(
            "levels as coefficients under 1 N; the stiffnesses of the elements are not given",
            "Lampaert, Al-Bender, Swevers, A Generalized Maxwell-Slip Friction Model appropriate "
            "for Control Purposes, table 1",
            {"N": 1.0},
            {
                "law": Numbers(
                    _LEVELS,
                    {
                        LuGre: _BRISTLE,
                        ElastoPlastic: _BRISTLE | {"z_ba": 0.61e-6},
                        Leuven: _CURVE | {"delta_l": 7.0, "sigma_1": 0.08},
                        Dahl: {"sigma_0": 0.16e6},
                        GMS: _CURVE | {"C": 24.0},
                        Stribeck: _CURVE,
                    },
                )
            },
        ),
        "laminator_pilot": _sled("pilot", 10, 4.4861, 2.5498, 0.0012, 230.0, 2.0),
        "laminator_main": _sled("main", 100, 4.2672, 2.6063, 0.0049, 5.0, 3.2),
    }

    N: Scalar = param(1.0, unit="N", role="load", doc="normal force", lower=0.0)
    N_least: Scalar = param(
        1e-3, unit="N", role="load", doc="least normal force of the input `load`", lower=0.0
    )
    load: str = option("parameter", choices=("parameter", "input"), doc="where N comes from")

    def equations(self, p: Variables) -> Model:
        """States x and those of the law; inputs v, load and what else the law takes."""
        x = Variable("x", "m", nominal=0.01, doc="path")
        v = Variable("v", "m/s", nominal=0.01, doc="sliding velocity")
        load = Variable("load", "N", start=self.N, nominal=1.0, doc="normal force")
        varying = self.load == "input"
        N = smooth.positive(load.symbol - self.N_least, 0.0) + self.N_least if varying else self.N
        if any(i.name == FORCE for i in self.law.inputs):
            raise ValueError(
                f"Prescribed: expected a law of motion and load, got {type(self.law).__name__}, "
                "which needs the force that rest must carry; a given motion does not say it, a "
                "`Drive` does"
            )
        further = tuple(
            Variable(i.name, i.unit, start=i.steady, nominal=i.nominal, doc=i.doc)
            for i in self.law.inputs
        )
        given: dict[str, Any] = {u.name: u.symbol for u in further}
        least = self.N_least if varying else None
        slip = contact("sample", self.law, v.symbol, N, rest={}, least=least, **given)
        return Model(
            name="prescribed",
            x=(x,),
            u=(v, *([load] if varying else []), *further),
            p=p,
            ode=v.symbol,
            contacts=(slip,),
            outputs={
                "friction": Output(slip.force, "N", "friction force opposing v"),
                "power": Output(slip.force * v.symbol, "W", "power taken by friction"),
                **({"N": Output(N, "N", "normal force")} if varying else {}),
            },
            sketch=lambda: drawn({"sample": Block(x.symbol, 0.0, "x", "v", self.law)}),
        )
