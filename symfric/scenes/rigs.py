"""Test rigs: a tribometer with a prescribed motion, and a quarter car."""

from collections.abc import Mapping
from functools import partial
from math import pi
from typing import Any, ClassVar

import casadi as ca

from symfric.foundation.numeric import Scalar, sqrt, tan
from symfric.foundation.parameters import (
    Variable,
    option,
    param,
    parameters,
    parametric,
    with_values,
)
from symfric.laws.base import smooth
from symfric.laws.base.law import FORCE
from symfric.laws.static.machines import tilt
from symfric.model import Model, Monitor, Output, Variables
from symfric.model.sketch import Sketch
from symfric.scenes import fields
from symfric.scenes.base import GivenInput, Scene, contact, friction_outputs
from symfric.scenes.drawing import RailBody, drawn


def strokes(t: ca.SX) -> ca.SX:
    """Return 0.005 sin(2 pi t) m/s, up to five times the default Stribeck velocity of most laws."""
    return 5e-3 * ca.sin(2 * ca.pi * t)


@parametric
class Prescribed(Scene):
    """Contact with a prescribed or measured motion: the input is velocity, the output friction.

        x' = v,   z' = rate(v, N, z),   friction = F(v, N, z)

    The input `v` is a constant, a function of time or samples (`Hold`, `Linear`). For a measured
    position use `rate_of(Linear(t, x))`, which is linear between the samples, or
    `--input x=FILE.csv:COLUMN` on the command line. With load = "input" the normal force is the
    input `load`, by default N. It is limited to `N_least` and above, so that noise of an open
    contact gives no negative load. Further inputs of a law, such as an acceleration or a
    temperature, are inputs with the same name.

    Limits: laws with the applied force F_e (`Karnopp`, `ExactCoulomb`, ...) are rejected, since the
    motion does not determine it. The internal states start as after a long rest, for any initial
    velocity.
    """

    t_end: ClassVar[float] = 2.0
    inputs: ClassVar[Mapping[str, GivenInput]] = {
        "v": GivenInput("0.005 sin(2 pi t)", strokes),
    }
    integrals: ClassVar[Mapping[str, str]] = {"x": "v"}

    N: Scalar = fields.LOAD(1.0, doc="normal force")
    N_least: Scalar = fields.LOAD(1e-3, doc="least normal force of the input `load`")
    load: str = option(
        "parameter", choices=("parameter", "input"), doc="N as a parameter or an input"
    )

    def equations(self, p: Variables) -> Model:
        """Return the model: states x and those of the law; inputs v, load and those of the law."""
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
            outputs=friction_outputs(slip, "v")
            | ({"N": Output(N, "N", "normal force")} if varying else {}),
            sketch=lambda: drawn(
                {"sample": RailBody(x.symbol, 0.0, "x", "v", self.law, contact="sample")},
                arrows=[("x", "sample", "x"), ("v", "sample", "x")],
            ),
        )


ANY = 1e100
"""Scale [N] that is so large that error control only checks whether a load is finite."""
LINKAGE = ("k_s", "b_d", "theta", "L_d")
"""Parameters that the rig assigns to laws of its guide that have them."""


@parametric
class QuarterCar(Scene):
    """Quarter car on a road that rises in two ramps and then falls by twice the second ramp.

        M_b X_b'' = f_sd - F(X_b', N),   f_sd = k_s (X_w - X_b) + b_d (X_w' - X_b')
        M_w X_w'' = -f_sd + k_t (X_r - X_w) + b_t (X_r' - X_w')
        N = N_0 + |f_sd| / tan(theta - d_theta)

    X_b, X_w and X_r are the displacements of body, wheel and road from the equilibrium under the
    weight. The strut is inclined by theta, so that its force, with the vertical component f_sd,
    presses the body against its guide. If the strut shortens, its inclination changes by d_theta
    (`tilt`). Laws that need these inputs get x_rel = X_w - X_b, its rate v_rel, and F_e = f_sd. The
    parameters k_s, b_d, theta and L_d of a law are set to those of the rig.

    The scene uses the coordinates of the paper and is not a `Mechanism`, since its friction depends
    on x_rel and v_rel, which joints do not provide, and the side force of the strut is not the
    reaction of a joint. A test compares it with a mechanism with the force of a strut on two
    guides.

    Defaults: section 3 of the paper, with its road of 50 mm (other runs have 30 and 70 mm). The
    paper does not give L_d and the times of the road. According to its text the first ramp has the
    smallest slope, which requires t_first > 1.7 s (the presets have 2.4 s). The paper has no N_0,
    which its law does not need; it is chosen such that a law with mu_s = 0.15 breaks away at the
    193.8 N of the paper.
    Source: Al-Zughaibi, quarter-car friction, equations 1-13.
    """

    t_end: ClassVar[float] = 10.0

    M_b: Scalar = fields.MASS(240.0, doc="mass of the body")
    M_w: Scalar = fields.MASS(40.0, doc="mass of the wheel")
    k_s: Scalar = fields.SPRING(28900.0, doc="suspension stiffness")
    b_d: Scalar = fields.DAMPER(260.0, doc="suspension damping")
    k_t: Scalar = fields.SPRING(920000.0, doc="tyre stiffness")
    b_t: Scalar = fields.DAMPER(3886.0, doc="tyre damping")
    theta: Scalar = fields.PLACE(
        pi / 4, unit="rad", doc="angle of the strut", lower=0.01, upper=1.56
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
        known = parameters(self.law)
        shared = {name: getattr(self, name) for name in LINKAGE if name in known}
        object.__setattr__(self, "law", with_values(self.law, shared))

    def road(self, t: Scalar) -> Scalar:
        """Return the height X_r of the road [m] at time t [s]: three ramps with level parts."""
        heights = (self.middle, self.amplitude, -2 * self.amplitude)
        second = self.t_0 + self.t_first + self.t_hold
        starts = (self.t_0, second, second + self.t_ramp + self.t_hold)
        lengths = (self.t_first, self.t_ramp, self.t_ramp)
        return sum(
            height * smooth.clip((t - start) / length, 0.0, 1.0)
            for height, start, length in zip(heights, starts, lengths, strict=True)
        )

    def equations(self, p: Variables) -> Model:
        """Return the model: states X_b, X_w, v_b, v_w and those of the law."""
        X_b, X_w, v_b, v_w = (
            Variable(f"{letter}_{body[0]}", unit, nominal=0.1, doc=f"{what} of the {body}")
            for letter, unit, what in (("X", "m", "displacement"), ("v", "m/s", "velocity"))
            for body in ("body", "wheel")
        )
        t = ca.SX.sym("t")
        X_r = ca.SX(self.road(t))
        x_rel, v_rel = X_w.symbol - X_b.symbol, v_w.symbol - v_b.symbol
        x_tyre, v_tyre = X_r - X_w.symbol, ca.jtimes(X_r, t, ca.SX(1)) - v_w.symbol
        f_sd = self.k_s * x_rel + self.b_d * v_rel
        N = self.normal_force(f_sd, x_rel)
        given: dict[str, Any] = {"x_rel": x_rel, "v_rel": v_rel, "F_e": f_sd}
        slip = contact("guide", self.law, v_b.symbol, N, rest={"v_b": 0.0}, **given)
        # N is NaN where the strut is too short; a run must stop there for every law
        load = ca.SX.sym("N")
        probe = contact("guide", self.law, v_b.symbol, load, rest={"v_b": 0.0}, **given)
        loaded = ca.depends_on(ca.vertcat(probe.friction, probe.rate), load)
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
                **friction_outputs(slip, "v_b"),
            },
            sketch=partial(self._sketch, X_b.symbol, X_w.symbol, X_r),
        )

    def _sketch(self, X_b: ca.SX, X_w: ca.SX, X_r: ca.SX) -> Sketch:
        """Return the body on its guide, the strut, the wheel, and the road below the tyre."""
        wheel, body = 0.5 * self.L_d, 1.5 * self.L_d
        return drawn(
            {
                "wheel": RailBody(0.0, X_w + wheel, label="M_w"),
                "body": RailBody(0.0, X_b + body, "z", "v_b", self.law, "M_b", "guide"),
            },
            {"road": (0.0, X_r)},
            [("strut", "road", "wheel", "k_t, b_t"), ("strut", "wheel", "body", "k_s, b_d")],
            arrows=[("X_b v_b", "body", "z"), ("X_w v_w", "wheel", "z"), ("X_r", "road", "z")],
        )

    def normal_force(self, f_sd: Scalar, x_rel: Scalar) -> Scalar:
        """Return the force N [N] between guide and body under the vertical force f_sd [N]."""
        side = f_sd / tan(self.theta - tilt(x_rel, self.theta, self.L_d))
        return self.N_0 + sqrt(side * side + self.eps * self.eps) - self.eps
