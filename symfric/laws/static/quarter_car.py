"""Friction of a quarter-car test rig, whose normal force follows from the linkage of the strut."""

from dataclasses import dataclass
from math import pi
from typing import final

from symfric.foundation.numeric import Scalar, asin, cos, equals, exp, sin, sqrt, tan
from symfric.foundation.parameters import option, param
from symfric.laws.base import fields, smooth
from symfric.laws.base.curve import Curve, Fall
from symfric.laws.base.law import Facts, Input, StaticLaw, one_sided


def tilt(x_rel: Scalar, theta: Scalar, L_d: Scalar) -> Scalar:
    """Change d_theta of the strut's angle [rad], positive for a shortened spring.

        sin d_theta = x_rel cos(theta) / (L_d - x_rel sin(theta))

    for a strut of length L_d [m] at the angle theta [rad] whose wheel rose by x_rel [m] relative
    to the body. The paper writes sin(theta) for cos(theta), which is the same at its 45 degrees.
    """
    return asin(x_rel * cos(theta) / (L_d - x_rel * sin(theta)))


@final
@dataclass(frozen=True, eq=False)
class QuarterCarGeneral(StaticLaw):
    """Quarter-car friction with the load of the linkage, in newton.

        f_sd = k_s x_rel + b_d v_rel                              force of spring and damper
        sin d_theta = x_rel cos(theta) / (L_d - x_rel sin(theta))
        slip   = [C_e exp(-|v|/e_1) + mu |f_sd| / tan(theta - d_theta)] sign(v) + sigma_v v
        F      = (1 - w) hold(f_sd, F_brk) + w slip,   w = S(|v| / v_eps),   smooth
        F      = f_sd at v = 0, else C_e exp(-|v|/e_1) sign(v) + mu f_sd / tan(theta - d_theta)
                 + sigma_v v,                                                as printed

    S is the quintic step of `Karnopp`, hold its rounded clip. `N` has no effect: the load is
    |f_sd| / tan. `v` is the velocity of the body, x_rel the wheel's position minus the body's.
    As printed, the Coulomb term has the sign of the spring force and may drive the body, the branch
    at rest is not limited, and exp(|v|/e_1) needs e_1 < 0: here e_1 is its magnitude.
    C_e, e_1, mu, sigma_v and L_d are not given in the paper; their defaults are invented, sigma_v
    so that friction lessens the overshoot of the body, as the paper says.
    Limits: holds |f_sd| <= F_brk - F_eps at rest; within v_eps friction may drive, F v >= -0.274
    F_brk v_eps (as printed at any speed); mu = 0 leaves the simple law beyond v_eps;
    x_rel < L_d / (2 sin(theta)).
    Source: Al-Zughaibi, quarter-car friction, equations 7-12 and 24, corrected as said.
    """

    facts = Facts(
        phenomena=("D", "S", "St", "V"),
        smoothness="C2 at 0, |v| = v_eps, |f_sd| = F_brk -+ F_eps (as printed: jump at 0)",
        confidence="one source",
        checked="the paper, corrected as said",
        source="Al-Zughaibi, quarter-car friction, corrected",
        odd=False,
        load="independent",
    )

    k_s: Scalar = fields.STIFFNESS(28900.0, doc="spring stiffness", lower=0.0)
    b_d: Scalar = param(260.0, unit="N s/m", role="damping", doc="damper coefficient", lower=0.0)
    theta: Scalar = param(
        pi / 4, unit="rad", role="geometry", doc="angle of the strut", lower=0.01, upper=1.56
    )
    L_d: Scalar = param(0.4, unit="m", role="geometry", doc="length of the strut", lower=1e-12)
    F_brk: Scalar = fields.LEVEL(193.8, doc="break-away force")
    C_e: Scalar = fields.LEVEL(180.0, doc="static excess at rest")
    e_1: Scalar = fields.VELOCITY(0.01, doc="velocity of the decay")
    mu: Scalar = fields.COEFFICIENT(0.05, doc="friction coefficient of the guide")
    sigma_v: Scalar = fields.SIGMA_2(1500.0)
    v_eps: Scalar = param(
        1e-3, unit="m/s", role="width", width=1, doc="half width of the stick window", lower=1e-12
    )
    F_eps: Scalar = param(
        1.0, unit="N", role="width", doc="rounding of the break-away and of |f_sd|", lower=1e-12
    )
    form: str = option("smooth", choices=("smooth", "as_printed"), doc="corrected or as printed")

    @property
    def inputs(self) -> tuple[Input, ...]:
        """Position and velocity of the wheel relative to the body."""
        return (
            Input("x_rel", "m", "position of the wheel minus that of the body", 0.01, 5e-3),
            Input("v_rel", "m/s", "velocity of the wheel minus that of the body", 0.1),
        )

    def outside(
        self, speed: Scalar, N: Scalar, *, x_rel: Scalar = 0.0, v_rel: Scalar = 0.0
    ) -> Scalar:
        """Sliding force [N] at a speed >= 0 as the widths vanish; not of the form as printed."""
        self._refuse_as_printed()
        f_sd = self.k_s * x_rel + self.b_d * v_rel
        load = sqrt(f_sd * f_sd + self.F_eps * self.F_eps)
        dry = self.C_e * smooth.fall(speed, self.e_1, 1.0)
        return dry + self._leverage(x_rel) * load + self.sigma_v * speed

    def sliding(
        self, v: Scalar, N: Scalar, side: int, *, x_rel: Scalar = 0.0, v_rel: Scalar = 0.0
    ) -> Scalar:
        """Sliding force [N] on one side of v = 0."""
        return side * self.outside(side * v, N, x_rel=x_rel, v_rel=v_rel)

    def static_level(
        self, N: Scalar, side: int = 1, *, x_rel: Scalar = 0.0, v_rel: Scalar = 0.0
    ) -> Scalar:
        """The force [N] of break-away."""
        self._refuse_as_printed()
        return self.F_brk

    def _refuse_as_printed(self) -> None:
        if self.form == "as_printed":
            raise one_sided(self, "as printed, it holds any force at rest and may drive the body")

    def _leverage(self, x_rel: Scalar) -> Scalar:
        if equals(self.mu, 0.0):
            return 0.0
        return self.mu / tan(self.theta - tilt(x_rel, self.theta, self.L_d))

    def force(
        self, v: Scalar, N: Scalar, z: Scalar = (), *, x_rel: Scalar = 0.0, v_rel: Scalar = 0.0
    ) -> Scalar:
        """Friction force [N]."""
        f_sd = self.k_s * x_rel + self.b_d * v_rel
        leverage = self._leverage(x_rel)
        speed = smooth.magnitude(v, 0.0)
        dry = self.C_e * exp(-speed / self.e_1)
        if self.form == "as_printed":
            slip = dry * smooth.sign(v, 0.0) + leverage * f_sd + self.sigma_v * v
            return smooth.choose(speed <= 0, f_sd, slip)
        load = sqrt(f_sd * f_sd + self.F_eps * self.F_eps)
        slip = (dry + leverage * load) * smooth.sign(v, 0.0) + self.sigma_v * v
        w = smooth.step5(speed / self.v_eps)
        return (1 - w) * smooth.hold(f_sd, self.F_brk, self.F_eps) + w * slip


@final
@dataclass(frozen=True, eq=False)
class QuarterCarSimple(Curve):
    """Quarter-car friction without the Coulomb term, in newton.

        F = C_e exp(-|v|/e_1) sign(v) + sigma_v v

    sign(v) is smooth over v_eps, |v| over 1e-4 v_eps; the float v_eps = 0 is the original. As
    printed the exponent grows: here e_1 is the magnitude of the paper's. `N` has no effect. C_e,
    e_1 and sigma_v are not given in the paper; their defaults are invented, as for
    `QuarterCarGeneral`.
    Limits: `Tustin` with a dynamic level of zero. Creeps under load; `QuarterCarGeneral` with
    mu = 0 holds at rest.
    Source: Al-Zughaibi, quarter-car friction, equation 21, with the sign of e_1 corrected.
    """

    facts = Facts(
        phenomena=("S", "St", "V"),
        smoothness="C∞",
        confidence="one source",
        checked="the paper, corrected as said",
        source="Al-Zughaibi, quarter-car friction, corrected",
        load="independent",
    )

    C_e: Scalar = fields.LEVEL(180.0, doc="static level")
    e_1: Scalar = fields.VELOCITY(0.01, doc="velocity of the decay")
    sigma_v: Scalar = fields.SIGMA_2(1500.0)
    v_eps: Scalar = fields.V_EPS(1e-3)

    def formula(self, v: Scalar, N: Scalar, s: Scalar, fall: Fall) -> Scalar:
        """Friction force [N] in the direction `s`."""
        return self.C_e * fall(v, self.e_1, 1.0) * s + self.sigma_v * v
