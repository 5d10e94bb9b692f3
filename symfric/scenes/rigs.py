"""Test rigs: a tribometer, whose motion is given, and a quarter car."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from math import pi
from typing import Any, ClassVar, final

import casadi as ca

from symfric.foundation.numeric import Scalar, sqrt, tan
from symfric.foundation.parameters import Variable, option, param, parameters, with_values
from symfric.laws import GMS, Dahl, ElastoPlastic, Leuven, LuGre, SteadyStateLuGre, Stribeck
from symfric.laws.base import smooth
from symfric.laws.base.law import FORCE
from symfric.laws.static.machines import QuarterCarGeneral, tilt
from symfric.model import Model, Monitor, Output, Variables
from symfric.model.sketch import Sketch
from symfric.scenes import fields
from symfric.scenes.base import Block, GivenInput, Scene, contact, drawn
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
    """Law under measured or imagined motion: velocity in, friction out.

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

    N: Scalar = fields.LOAD(1.0, doc="normal force")
    N_least: Scalar = fields.LOAD(1e-3, doc="least normal force of the input `load`")
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


ANY = 1e100
"""Scale [N] of a load that error control does not resolve, but looks at for being a number."""
LINKAGE = ("k_s", "b_d", "theta", "L_d")
"""Numbers of the rig that a law of its guide may contain, too."""


def _road(millimetres: int) -> Preset:
    """Return the rig of section 3 on the road with this amplitude."""
    return Preset(
        f"rig of section 3, road of {millimetres} mm, whose first ramp begins at 0.3 s and makes "
        "X_w - X_b = 6.9 mm at 0.5 s, as the text says; the other times, C_e, e_1, mu, sigma_v and "
        "L_d are not given; 193.8 N are taken, not the 199 N of 6.9 mm of the spring; equation 12 "
        "with a falling exponent and all of its friction against the velocity, as its text asks",
        "Al-Zughaibi, quarter-car friction, sections 3 and 8.1",
        {"M_b": 240.0, "M_w": 40.0, "k_s": 28900.0, "b_d": 260.0, "k_t": 920000.0, "b_t": 3886.0}
        | {"theta": pi / 4, "amplitude": millimetres / 1000, "t_0": 0.3, "t_first": 2.4},
        {"law": Numbers({}, {QuarterCarGeneral: {"F_brk": 193.8}})},
    )


@final
@dataclass(frozen=True, eq=False)
class QuarterCar(Scene):
    """Quarter car over a road that rises to its middle, then by an amplitude, and falls by two.

        M_b X_b'' = f_sd - F(X_b', N),   f_sd = k_s (X_w - X_b) + b_d (X_w' - X_b')
        M_w X_w'' = -f_sd + k_t (X_r - X_w) + b_t (X_r' - X_w')
        N = N_0 + |f_sd| / tan(theta - d_theta)

    Displacements of body, wheel and road from rest under the weight. The strut leans by theta, so
    that the force whose vertical part is f_sd presses the body against its guide; as the strut
    shortens it leans by d_theta more (`tilt`). Laws that need them get x_rel = X_w - X_b, v_rel
    its rate and F_e = f_sd; a law that has k_s, b_d, theta or L_d of its own gets those of the rig.

    Written in the paper's coordinates and not as a `Mechanism`: its friction depends on x_rel and
    v_rel, which joints do not offer, and its side force of the strut is no reaction of a joint
    (a mechanism with the strut's force on two guides is the test's second opinion).

    Defaults: section 3 of the paper, and its road of 50 mm (30 and 70 mm in its other runs). It
    does not give L_d and the times of the road; by its text the first ramp is the gentlest, which
    takes a t_first above 1.7 s (its presets have 2.4 s). N_0 is chosen so that a law with mu_s =
    0.15 breaks away at the paper's 193.8 N; the paper has none, and its own law needs none.
    Source: Al-Zughaibi, quarter-car friction, equations 1-13.
    """

    t_end: ClassVar[float] = 10.0
    presets: ClassVar[Mapping[str, Preset]] = {
        f"al_zughaibi_{a}_mm": _road(a) for a in (30, 50, 70)
    }

    M_b: Scalar = fields.MASS(240.0, doc="mass of the body")
    M_w: Scalar = fields.MASS(40.0, doc="mass of the wheel")
    k_s: Scalar = fields.SPRING(28900.0, doc="suspension stiffness")
    b_d: Scalar = fields.DAMPER(260.0, doc="suspension damping")
    k_t: Scalar = fields.SPRING(920000.0, doc="tyre stiffness")
    b_t: Scalar = fields.DAMPER(3886.0, doc="tyre damping")
    theta: Scalar = param(
        pi / 4, unit="rad", role="geometry", doc="angle of the strut", lower=0.01, upper=1.56
    )
    L_d: Scalar = fields.SIZE(0.4, doc="length of the strut")
    N_0: Scalar = fields.LOAD(1093.0, doc="preload of the guide")
    eps: Scalar = param(
        1.0, unit="N", role="width", doc="rounding of the strut's side force", lower=1e-12
    )
    middle: Scalar = fields.START(0.085, doc="height of the road after its first ramp")
    amplitude: Scalar = fields.START(0.05, doc="rise of the second ramp, half fall of the third")
    t_0: Scalar = fields.DURATION(0.5, doc="start of the first ramp", lower=0.0)
    t_first: Scalar = fields.DURATION(1.0, doc="duration of the first ramp")
    t_ramp: Scalar = fields.DURATION(1.0, doc="duration of the other ramps")
    t_hold: Scalar = fields.DURATION(2.0, doc="rest after a ramp", lower=0.0)

    def __post_init__(self) -> None:
        super().__post_init__()
        own = parameters(self.law)
        shared = {name: getattr(self, name) for name in LINKAGE if name in own}
        object.__setattr__(self, "law", with_values(self.law, shared))

    def road(self, t: Scalar) -> Scalar:
        """Height X_r of the road [m] at time t [s]: three ramps, a rest after each."""
        heights = (self.middle, self.amplitude, -2 * self.amplitude)
        second = self.t_0 + self.t_first + self.t_hold
        starts = (self.t_0, second, second + self.t_ramp + self.t_hold)
        lengths = (self.t_first, self.t_ramp, self.t_ramp)
        return sum(
            height * smooth.clip((t - start) / length, 0.0, 1.0)
            for height, start, length in zip(heights, starts, lengths, strict=True)
        )

    def equations(self, p: Variables) -> Model:
        """States X_b, X_w, v_b, v_w and those of the law; results of road, suspension, guide."""
        X_b = Variable("X_b", "m", nominal=0.1, doc="displacement of the body")
        X_w = Variable("X_w", "m", nominal=0.1, doc="displacement of the wheel")
        v_b = Variable("v_b", "m/s", nominal=0.1, doc="velocity of the body")
        v_w = Variable("v_w", "m/s", nominal=0.1, doc="velocity of the wheel")
        t = ca.SX.sym("t")
        X_r = ca.SX(self.road(t))
        x_rel, v_rel = X_w.symbol - X_b.symbol, v_w.symbol - v_b.symbol
        x_tyre, v_tyre = X_r - X_w.symbol, ca.jtimes(X_r, t, ca.SX(1)) - v_w.symbol
        f_sd = self.k_s * x_rel + self.b_d * v_rel
        N = self.normal_force(f_sd, x_rel)
        given: dict[str, Any] = {"x_rel": x_rel, "v_rel": v_rel, "F_e": f_sd}
        slip = contact("guide", self.law, v_b.symbol, N, rest={"v_b": 0.0}, **given)
        # beyond the strut's reach N is not a number: a run must stop there under any law
        load = ca.SX.sym("N")
        told = contact("guide", self.law, v_b.symbol, load, rest={"v_b": 0.0}, **given)
        loaded = ca.depends_on(ca.vertcat(told.friction, told.rate), load)
        reach = () if loaded else (Monitor(N, ANY),)
        a_b = (f_sd - slip.force) / self.M_b
        a_w = (-f_sd + self.k_t * x_tyre + self.b_t * v_tyre) / self.M_w
        return Model(
            name="quarter_car",
            x=(X_b, X_w, v_b, v_w),
            p=p,
            ode=ca.vertcat(v_b.symbol, v_w.symbol, a_b, a_w),
            monitors=reach,
            contacts=(slip,),
            t=t,
            outputs={
                "X_r": Output(X_r, "m", "height of the road"),
                "x_rel": Output(x_rel, "m", "suspension displacement X_w - X_b"),
                "x_tyre": Output(x_tyre, "m", "tyre deflection X_r - X_w"),
                "a_b": Output(a_b, "m/s^2", "acceleration of the body"),
                "N": Output(N, "N", "normal force of the guide"),
                "friction": Output(slip.force, "N", "friction force opposing v_b"),
                "power": Output(slip.force * v_b.symbol, "W", "power taken by friction"),
            },
            sketch=partial(self._sketch, X_b.symbol, X_w.symbol, X_r),
        )

    def _sketch(self, X_b: ca.SX, X_w: ca.SX, X_r: ca.SX) -> Sketch:
        """Body on its guide, strut, wheel, and the road below the tyre."""
        wheel, body = 0.5 * self.L_d, 1.5 * self.L_d
        return drawn(
            {
                "wheel": Block(0.0, X_w + wheel),
                "body": Block(0.0, X_b + body, "z", "v_b", self.law),
            },
            {"road": (0.0, X_r)},
            [("spring", "road", "wheel"), ("spring", "wheel", "body")],
        )

    def normal_force(self, f_sd: Scalar, x_rel: Scalar) -> Scalar:
        """Force N [N] between guide and body under the strut's vertical force f_sd [N]."""
        side = f_sd / tan(self.theta - tilt(x_rel, self.theta, self.L_d))
        return self.N_0 + sqrt(side * side + self.eps * self.eps) - self.eps
