"""Laws of specific machines: robot joints, servo drives, belts, tyres, and a quarter-car rig."""

from math import inf, pi

from symfric.foundation.numeric import (
    Scalar,
    asin,
    cos,
    equals,
    exp,
    expm1,
    is_number,
    sin,
    sqrt,
    tan,
    tanh,
)
from symfric.foundation.parameters import option, param, parametric
from symfric.laws.base import fields, smooth
from symfric.laws.base.families import CurveLaw, Fall
from symfric.laws.base.law import Facts, Input, StaticLaw, one_sided


@parametric
class Bittencourt(CurveLaw):
    """Friction torque of a robot joint at load N and temperature T, after Bittencourt.

        static(T)  = max(F_s0 + F_sT T, 0),   v_s(T) = v_s0 + v_sT T
        F = {F_c0 + F_cl N + F_sl N exp(-|v/v_sl|^delta)
             + static(T) exp(-|v/v_s(T)|^delta)} sign(v) + (F_v0 + F_vT exp(-T/T_v)) v

    N is the magnitude of the load torque [N m], v in rad/s, F in N m. sign(v) is smooth over v_eps,
    |v| over 1e-4 v_eps, the maximum over F_eps. The temperature is a parameter, so that it may be a
    symbol. The default levels, velocities and viscous coefficients are those of an industrial robot
    in the paper, quoted from memory and unverified. The torques of the paper are normalised, and
    the robot was identified at 30 degC and above. v_s(T) is positive above 25 degC only.
    Limits: at fixed N and T a `Stribeck` law with two falls; not valid outside the temperatures of
    the identification. Creeps under load.
    Source: Bittencourt and Gunnarsson, J. Dyn. Syst. Meas. Control 134(5), 2012 (abstract only).
    Checked: formula and defaults are from memory.
    """

    facts = Facts(("D", "S", "St", "V"), "C∞", "unverified", load="affine")

    T: Scalar = fields.TEMPERATURE(30.0, unit="degC", doc="temperature", lower=-60.0, upper=200.0)
    F_c0: Scalar = fields.TORQUE(0.031, doc="dynamic level without load")
    F_cl: Scalar = fields.COEFFICIENT(0.023, doc="dynamic level by load")
    F_sl: Scalar = fields.COEFFICIENT(0.126, doc="static excess by load")
    F_s0: Scalar = fields.TORQUE(-0.025, doc="static excess at 0 degC", lower=-inf)
    F_sT: Scalar = param(1.6e-3, unit="N m/K", role="level", doc="static excess by temperature")
    v_sl: Scalar = fields.VELOCITY(9.2, unit="rad/s", doc="Stribeck velocity of the load part")
    v_s0: Scalar = fields.V_S(-25.0, unit="rad/s", doc="Stribeck velocity at 0 degC", lower=-inf)
    v_sT: Scalar = fields.V_S(
        1.0, unit="rad/(s K)", doc="Stribeck velocity by temperature", lower=-inf
    )
    F_v0: Scalar = fields.DRAG(1.3e-3, doc="viscous coefficient, hot")
    F_vT: Scalar = fields.DRAG(1.3e-3, doc="viscous coefficient, rise to 0 degC")
    T_v: Scalar = fields.TEMPERATURE(20.7, doc="temperature scale of the viscous part", lower=1e-12)
    delta: Scalar = fields.DELTA(1.3)
    v_eps: Scalar = fields.V_EPS(0.1, unit="rad/s", lower=1e-12)
    F_eps: Scalar = fields.WIDTH(1e-4, unit="N m", doc="smoothing of the maximum", lower=0.0)

    def __post_init__(self) -> None:
        super().__post_init__()
        v_s = self.v_s0 + self.v_sT * self.T
        if is_number(v_s) and v_s <= 0:
            raise ValueError(
                f"Bittencourt: expected v_s0 + v_sT T > 0, got {v_s:g} rad/s at T = {self.T:g}; "
                "the law is not valid at this temperature"
            )

    def formula(self, v: Scalar, N: Scalar, s: Scalar, fall: Fall) -> Scalar:
        """Return the friction force [N] in the direction `s`."""
        v_s = self.v_s0 + self.v_sT * self.T
        loaded = self.F_sl * N * fall(v, self.v_sl, self.delta)
        static = smooth.positive(self.F_s0 + self.F_sT * self.T, self.F_eps)
        level = self.F_c0 + self.F_cl * N + loaded + static * fall(v, v_s, self.delta)
        return level * s + (self.F_v0 + self.F_vT * exp(-self.T / self.T_v)) * v


@parametric
class BAM(StaticLaw):
    """Servo friction of the BAM family, models M1 to M6, torques in N m.

        s = exp(-|v/v_s|^alpha)
        K = K_b + |K_e tau_e - K_m tau_m| + s [K_s + |K_es tau_e - K_ms tau_m| + quadratic]
        quadratic = Q_e tau_e^2 where the motor drives, Q_m tau_m^2 where it is driven,
                    only while tau_e and tau_m oppose each other
        F = K sign(v) + K_v v

    tau_m is the torque of the motor and tau_e the external torque. M6 is the complete law. M5 has
    no quadratic terms, and M4 in addition has K_e = K_m and K_es = K_ms. M3 is M4 without the
    Stribeck terms, M2 is M4 without the terms of the load, and M1 is M4 without both. The motor
    drives where |tau_m| > |tau_e|. sign(v) is smooth over v_eps, |v| over 1e-4 v_eps, and the
    magnitudes and cases of the torques over tau_eps.
    Limits: M1 is Coulomb + viscous, M2 is `Stribeck`. `N` has no effect. Creeps under load; the
    BAM code limits friction to the torque that stops the motor within a step.
    Source: Duclusaud et al. 2025, as in their public code.
    Checked: Rhoban/bam.
    """

    facts = Facts(("D", "S", "St", "V"), "C∞", "one source", load="independent")

    K_b: Scalar = fields.TORQUE(0.05, doc="dynamic level without load")
    K_s: Scalar = fields.TORQUE(0.05, doc="static excess without load")
    K_e: Scalar = fields.COEFFICIENT(0.05, doc="dynamic level by external torque")
    K_m: Scalar = fields.COEFFICIENT(0.05, doc="dynamic level by motor torque")
    K_es: Scalar = fields.COEFFICIENT(0.05, doc="static excess by external torque")
    K_ms: Scalar = fields.COEFFICIENT(0.05, doc="static excess by motor torque")
    Q_e: Scalar = fields.LEVEL(0.0, unit="1/(N m)", doc="excess by external torque squared")
    Q_m: Scalar = fields.LEVEL(0.0, unit="1/(N m)", doc="excess by motor torque squared")
    v_s: Scalar = fields.V_S(0.2, unit="rad/s")
    alpha: Scalar = fields.DELTA(1.35)
    K_v: Scalar = fields.DRAG(0.1)
    v_eps: Scalar = fields.V_EPS(0.01, unit="rad/s", lower=1e-12)
    tau_eps: Scalar = fields.WIDTH(1e-3, unit="N m", doc="smoothing torque")

    @property
    def inputs(self) -> tuple[Input, ...]:
        """Torques on both sides of the gear; empty if all their coefficients are zero."""
        of_load = (self.K_e, self.K_m, self.K_es, self.K_ms, self.Q_e, self.Q_m)
        if all(equals(coefficient, 0.0) for coefficient in of_load):
            return ()
        return (
            Input("tau_m", "N m", "torque of the motor", steady=1.0),
            Input("tau_e", "N m", "external torque", steady=0.5),
        )

    def force(
        self, v: Scalar, N: Scalar, z: Scalar = (), *, tau_m: Scalar = 0.0, tau_e: Scalar = 0.0
    ) -> Scalar:
        """Return the friction torque [N m]."""
        falling = smooth.stribeck(v, self.v_s, self.alpha, smooth.CORNER * self.v_eps)
        return self._level(falling, tau_m, tau_e) * smooth.sign(v, self.v_eps) + self.K_v * v

    def outside(
        self, speed: Scalar, N: Scalar, *, tau_m: Scalar = 0.0, tau_e: Scalar = 0.0
    ) -> Scalar:
        """Return the sliding torque [N m] at a speed >= 0 for zero widths."""
        falling = smooth.fall(speed, self.v_s, self.alpha)
        return self._level(falling, tau_m, tau_e) + self.K_v * speed

    def _level(self, falling: Scalar, tau_m: Scalar, tau_e: Scalar) -> Scalar:
        """Return K [N m] for the Stribeck weight `falling` and the torques."""
        dynamic = smooth.magnitude(self.K_e * tau_e - self.K_m * tau_m, self.tau_eps)
        static = smooth.magnitude(self.K_es * tau_e - self.K_ms * tau_m, self.tau_eps)
        if not (equals(self.Q_e, 0.0) and equals(self.Q_m, 0.0)):
            width = self.tau_eps * self.tau_eps
            opposed = (1 - tanh(tau_m * tau_e / width)) / 2
            drives = (1 + tanh((tau_m * tau_m - tau_e * tau_e) / width)) / 2
            driven = (1 - drives) * self.Q_m * tau_m * tau_m
            static += opposed * (drives * self.Q_e * tau_e * tau_e + driven)
        return self.K_b + dynamic + falling * (self.K_s + static)


@parametric
class Capstan(StaticLaw):
    """Capstan (belt) friction of Euler and Eytelwein.

        F = T_1 - T_2 = N [exp(mu_d beta sign(v)) - 1]

    N is the tension T_2 on one side of the belt. The tension T_1 on the other side is larger than
    T_2 while the belt slides towards it (v > 0) and smaller otherwise. sign(v) is smooth over
    v_eps.
    Limits: mu_d beta -> 0 gives `Coulomb` with the coefficient mu_d beta. Not odd: for v < 0 |F| is
    smaller by the factor exp(-mu_d beta). Creeps under load.
    Source: Euler 1769, Eytelwein 1808; textbook.
    """

    facts = Facts(("D",), "C∞", "textbook", odd=False)

    mu_d: Scalar = fields.MU_D(0.1)
    beta: Scalar = fields.ANGLE(3.141592653589793, doc="wrap angle", lower=0.0)
    v_eps: Scalar = fields.V_EPS(1e-3)

    def sliding(self, v: Scalar, N: Scalar, side: int, **inputs: Scalar) -> Scalar:
        """Return the sliding force [N] to one `side` for zero widths."""
        return N * expm1(self.mu_d * self.beta * side)

    def static_level(self, N: Scalar, side: int = 1, **inputs: Scalar) -> Scalar:
        """Return the break-away force [N], which is larger towards the tension T_1."""
        return side * self.sliding(0.0, N, side)

    def force(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Return the friction force [N]."""
        return N * expm1(self.mu_d * self.beta * smooth.sign(v, self.v_eps))


@parametric
class BrushTyre(StaticLaw):
    """Brush tyre with parabolic pressure: force over the slip, in steady rolling.

        s = C v / (3 mu_d N w),   w = sqrt(v_r^2 + v_eps^2)
        F = mu_d N [1 - (1 - |s|)^3] sign(v) for |s| < 1, else mu_d N sign(v)

    v is the slip velocity of the tyre at the contact, and the input v_r = r omega the rolling speed
    of the wheel. v / v_r is the theoretical slip: tan(alpha) of the slip angle alpha in free
    rolling. Like other laws, it opposes v and is odd. `PlanarSlip` of this law is the brush tyre
    with equal stiffnesses in combined slip; its v_r is a vector.
    Limits: F = C tan(alpha) for small alpha; the whole contact slides from tan(alpha) =
    3 mu_d N / C on. v_r = 0 is Coulomb friction that is smooth over 3 mu_d N v_eps / C; it creeps
    at rest. No relaxation length, aligning moment or camber. Not valid for N = 0.
    Source: Pacejka, Tire and Vehicle Dynamics, 3.2.1 and 3.2.3 (from memory).
    Checked: integration of the bristles over the contact.
    """

    facts = Facts(
        ("D",), "C1 at v = 0, C2 where the whole contact slides", "unverified", load="by the slip"
    )

    mu_d: Scalar = fields.MU_D(1.0, lower=1e-9)
    C: Scalar = fields.SHAPE(8e4, unit="N", doc="cornering stiffness", lower=1e-9)
    v_eps: Scalar = fields.REST_EPS(0.1, doc="smallest rolling speed", lower=1e-9)

    @property
    def inputs(self) -> tuple[Input, ...]:
        """Rolling speed v_r [m/s]."""
        return (Input("v_r", "m/s", "rolling speed of the wheel", nominal=10.0),)

    @property
    def velocity_scale(self) -> Scalar:
        """Slip velocity at which the whole contact slides at rest under 1 N [m/s]."""
        return 3 * self.mu_d * self.v_eps / self.C

    def outside(self, speed: Scalar, N: Scalar, *, v_r: Scalar = 0.0) -> Scalar:
        """Return the force of the law [N], since it does not jump at rest."""
        return self.force(speed, N, v_r=v_r)

    def force(self, v: Scalar, N: Scalar, z: Scalar = (), *, v_r: Scalar = 0.0) -> Scalar:
        """Return the friction force [N]."""
        most = self.mu_d * N
        s = self.C * v / (3 * most * sqrt(v_r * v_r + self.v_eps * self.v_eps))
        s = smooth.hold(s, 1.0, 0.0)
        return most * s * (3 - 3 * smooth.magnitude(s, 0.0) + s * s)


def tilt(x_rel: Scalar, theta: Scalar, L_d: Scalar) -> Scalar:
    """Return the change d_theta of the strut's angle [rad], positive for a compressed spring.

        sin d_theta = x_rel cos(theta) / (L_d - x_rel sin(theta))

    The strut has the length L_d [m] and the angle theta [rad], and the wheel has moved up by x_rel
    [m] relative to the body. The paper prints sin(theta) in place of cos(theta), which is equal at
    its angle of 45 degrees.
    """
    return asin(x_rel * cos(theta) / (L_d - x_rel * sin(theta)))


@parametric
class QuarterCarGeneral(StaticLaw):
    """Quarter-car friction with the load of the linkage, in newton.

        f_sd = k_s x_rel + b_d v_rel                              force of spring and damper
        sin d_theta = x_rel cos(theta) / (L_d - x_rel sin(theta))
        slip   = [C_e exp(-|v|/e_1) + mu |f_sd| / tan(theta - d_theta)] sign(v) + sigma_v v
        F      = (1 - w) hold(f_sd, F_brk) + w slip,   w = S(|v| / v_eps),   smooth
        F      = f_sd at v = 0, else C_e exp(-|v|/e_1) sign(v) + mu f_sd / tan(theta - d_theta)
                 + sigma_v v,                                                as printed

    S is the quintic step and hold the rounded clip of `Karnopp`. `N` has no effect: the load is
    |f_sd| / tan. `v` is the velocity of the body, and x_rel the position of the wheel minus that of
    the body. As printed, the Coulomb term has the sign of the spring force and may drive the body,
    the force at rest is not limited, and exp(|v|/e_1) requires e_1 < 0; here e_1 is its magnitude.
    The paper does not give C_e, e_1, mu, sigma_v and L_d. Their defaults are assumptions; sigma_v
    is chosen such that friction reduces the overshoot of the body, as stated in the paper.
    Limits: holds |f_sd| <= F_brk - F_eps at rest. Within v_eps friction may drive,
    F v >= -0.274 F_brk v_eps; as printed it may drive at any speed. mu = 0 gives
    `QuarterCarSimple` beyond v_eps. Requires x_rel < L_d / (2 sin(theta)).
    Source: Al-Zughaibi, quarter-car friction, equations 7-12 and 24, corrected as described.
    Checked: the paper, corrected as described.
    """

    facts = Facts(
        ("D", "S", "St", "V"),
        "C2 at 0, |v| = v_eps, |f_sd| = F_brk -+ F_eps (as printed: jump at 0)",
        "one source",
        odd=False,
        load="independent",
    )

    k_s: Scalar = fields.STIFFNESS(28900.0, doc="spring stiffness", lower=0.0)
    b_d: Scalar = fields.SIGMA_1(260.0, doc="damper coefficient")
    theta: Scalar = fields.ANGLE(pi / 4, doc="angle of the strut", lower=0.01, upper=1.56)
    L_d: Scalar = fields.ANGLE(0.4, unit="m", doc="length of the strut", lower=1e-12)
    F_brk: Scalar = fields.LEVEL(193.8, doc="break-away force")
    C_e: Scalar = fields.LEVEL(180.0, doc="static excess at rest")
    e_1: Scalar = fields.VELOCITY(0.01, doc="velocity of the decay")
    mu: Scalar = fields.COEFFICIENT(0.05, doc="friction coefficient of the guide")
    sigma_v: Scalar = fields.SIGMA_2(1500.0)
    v_eps: Scalar = fields.BAND(1e-3, doc="half width of the stick window")
    F_eps: Scalar = fields.F_EPS(1.0, doc="rounding of the break-away and of |f_sd|")
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
        """Return the sliding force [N] at a speed >= 0; raise an error for form = "as_printed"."""
        if self.form == "as_printed":
            raise one_sided(self, "as printed, it holds any force at rest and may drive the body")
        f_sd = self.k_s * x_rel + self.b_d * v_rel
        load = sqrt(f_sd * f_sd + self.F_eps * self.F_eps)
        dry = self.C_e * smooth.fall(speed, self.e_1, 1.0)
        return dry + self._leverage(x_rel) * load + self.sigma_v * speed

    def static_level(self, N: Scalar, side: int = 1, **inputs: Scalar) -> Scalar:
        """Return the break-away force [N]; raise an error for form = "as_printed"."""
        self.outside(0.0, N)
        return self.F_brk

    def _leverage(self, x_rel: Scalar) -> Scalar:
        """Return the ratio of Coulomb friction to |f_sd|."""
        if equals(self.mu, 0.0):
            return 0.0
        return self.mu / tan(self.theta - tilt(x_rel, self.theta, self.L_d))

    def force(
        self, v: Scalar, N: Scalar, z: Scalar = (), *, x_rel: Scalar = 0.0, v_rel: Scalar = 0.0
    ) -> Scalar:
        """Return the friction force [N]."""
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


@parametric
class QuarterCarSimple(CurveLaw):
    """Quarter-car friction without the Coulomb term, in newton.

        F = C_e exp(-|v|/e_1) sign(v) + sigma_v v

    sign(v) is smooth over v_eps, |v| over 1e-4 v_eps; the float v_eps = 0 is the original. The
    paper prints exp(|v|/e_1) with e_1 < 0; here e_1 is its magnitude. `N` has no effect. The paper
    does not give C_e, e_1 and sigma_v; their defaults are assumptions, as in `QuarterCarGeneral`.
    Limits: `Tustin` with a dynamic level of zero. Creeps under load; `QuarterCarGeneral` with
    mu = 0 holds at rest.
    Source: Al-Zughaibi, quarter-car friction, equation 21, with the sign of e_1 corrected.
    Checked: the paper, corrected as described.
    """

    facts = Facts(("S", "St", "V"), "C∞", "one source", load="independent")

    C_e: Scalar = fields.LEVEL(180.0, doc="static level")
    e_1: Scalar = fields.VELOCITY(0.01, doc="velocity of the decay")
    sigma_v: Scalar = fields.SIGMA_2(1500.0)
    v_eps: Scalar = fields.V_EPS(1e-3)

    def formula(self, v: Scalar, N: Scalar, s: Scalar, fall: Fall) -> Scalar:
        """Return the friction force [N] in the direction `s`."""
        return self.C_e * fall(v, self.e_1, 1.0) * s + self.sigma_v * v
