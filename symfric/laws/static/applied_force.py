"""Laws that depend on the applied force or the acceleration; most of them stick exactly."""

from dataclasses import replace
from math import inf, pi

from symfric.foundation.numeric import Scalar, atan, column, exp, is_number
from symfric.foundation.parameters import option, parametric
from symfric.laws.base import fields, smooth
from symfric.laws.base.families import Levels, Sticking, carried, rests
from symfric.laws.base.law import APPLIED_FORCE, Facts, Input, State, StaticLaw, Switch, one_sided

FORMS = ("smooth", "original")
WITH_MODES = (*FORMS, "event")


@parametric
class Karnopp(Sticking):
    """Karnopp friction: inside a band around rest the contact carries the applied force.

        F = clip(F_e, -mu_s N, mu_s N)        for |v| < D_v, original
        F = mu_d N sign(v) + sigma_2 v        for |v| >= D_v, original
        F = (1 - w) hold(F_e, mu_s N) + w (mu_d N sign(v) + sigma_2 v)    smooth
        w = S(|v| / D_v),   S(t) = t^3 (10 - 15t + 6t^2) for 0 <= t <= 1

    hold is the clip with corners rounded over +-F_eps; below the corners F(0) = F_e exactly.
    form = "event" (two states: the mode, and whether the body is leaving the band) is the original
    with the band treated as rest: a sliding body that enters the band stops. A body that is pulled
    by more than mu_s N leaves the band, against the force mu_s N up to |v| = D_v. This form
    requires a scene with events.
    Limits: at rest dv/dt = 0 for |F_e| <= mu_s N - F_eps. In the smooth form a moving body comes to
    rest only asymptotically, v ~ t^(-1/2) inside the band. In the original form v keeps the value
    at which it entered the band, unless the integrator sets it to zero. In the event form the body
    stops immediately and loses the energy m D_v^2/2. D_v -> 0 is Coulomb friction with stiction
    (`ExactCoulomb`). Inside the band friction may drive: F v >= -0.274 mu_s N D_v in the smooth
    form, F v >= -mu_s N D_v in the original form, but F v >= 0 in the event form. In the event form
    sigma_2 D_v must be below (mu_s - mu_d) N; otherwise a body that leaves the band reenters it.
    Source: Karnopp, ASME J. Dyn. Syst. Meas. Control 107, 1985 (not read), as in public code.
    Checked: fellipegm/valve_estimation and other public code.
    """

    facts = Facts(
        ("D", "S", "V"),
        "C2 at 0, |v| = D_v, |F_e| = mu_s N -+ F_eps (original: jump at |v| = D_v)",
        "two sources",
    )
    ordered = (("mu_d", "mu_s"),)

    mu_d: Scalar = fields.MU_D(0.1)
    D_v: Scalar = fields.BAND(1e-3, doc="half width of the band around rest")
    sigma_2: Scalar = fields.SIGMA_2(0.0)
    F_eps: Scalar = fields.F_EPS(1e-3)
    form: str = option("smooth", choices=WITH_MODES, doc="window, hard switch, or exact with mode")

    @property
    def states(self) -> tuple[State, ...]:
        """Mode, and a state that is 1 while the body leaves the band; none without modes."""
        leaving = State("leaving", "1", 1.0, True, "1 while it leaves the band", whole=True)
        return (*super().states, leaving) if self.has_mode else ()

    def rate(
        self, v: Scalar, N: Scalar, z: Scalar = (), *, F_e: Scalar = 0.0, **inputs: Scalar
    ) -> Scalar:
        """Return the rate of the mode [1/s], and zero for the second state."""
        rate = super().rate(v, N, z, F_e=F_e, **inputs)
        return column(rate[0], 0.0 * v) if self.has_mode else rate

    def steady_state(self, v: Scalar, N: Scalar) -> Scalar:
        """Return the direction of sliding; a body that moves within the band is leaving it."""
        mode = super().steady_state(v, N)
        if not self.has_mode:
            return mode
        inside = smooth.choose(smooth.magnitude(v, 0.0) < self.D_v, 1.0, 0.0)
        return column(mode[0], inside * smooth.magnitude(mode[0], 0.0))

    @property
    def velocity_scale(self) -> Scalar:
        """Half width of the band [m/s]; inf in the event form, where its edge is an event."""
        return inf if self.has_mode else self.D_v

    def outside(self, speed: Scalar, N: Scalar) -> Scalar:
        """Return the sliding force [N] at a speed >= 0 for zero widths."""
        return self.mu_d * N + self.sigma_2 * speed

    def force(self, v: Scalar, N: Scalar, z: Scalar = (), *, F_e: Scalar = 0.0) -> Scalar:
        """Return the friction force [N]."""
        if self.has_mode:
            level = self.mu_d * N + self.sigma_2 * z[0] * v
            against = smooth.choose(z[1] > 0.5, self.mu_s * N, level)
            return carried(z[0], F_e, z[0] * against)
        slip = self.mu_d * N * smooth.sign(v, 0.0) + self.sigma_2 * v
        speed, static = smooth.magnitude(v, 0.0), self.mu_s * N
        if self.form == "original":
            return smooth.choose(speed < self.D_v, smooth.hold(F_e, static, 0.0), slip)
        w = smooth.step5(speed / self.D_v)
        return (1 - w) * smooth.hold(F_e, static, self.F_eps) + w * slip

    def switches(
        self, v: Scalar, N: Scalar, z: Scalar = (), *, F_e: Scalar = 0.0, **inputs: Scalar
    ) -> tuple[Switch, ...]:
        """Return the switches to stick and slip, and those of entering and leaving the band."""
        stuck = [
            replace(s, reset={**s.reset, "leaving": smooth.magnitude(s.reset["mode"], 0.0)})
            for s in super().switches(v, N, z, F_e=F_e, **inputs)
        ]
        if not stuck:
            return ()
        edge = smooth.choose(rests(z[0]), -1.0, z[0] * v - self.D_v)
        stop = Switch("stop", edge, -1, stuck[0].reset, halts=True)
        return *stuck, stop, Switch("leave", edge, 1, {"leaving": 0.0})


@parametric
class Awrejcewicz(Levels, StaticLaw):
    """Awrejcewicz-Grzelczyk-Pyryev friction: four continuous branches in one expression.

        u = |v| / epsilon
        F = (1 - A) clip(F_e, -mu_s N, mu_s N) + A g sign(v)
        g = N {mu_d + (mu_s - mu_d) exp(-[max(|v| - epsilon, 0) / v_s]^2)}
        A = u^2 (3 - 2u) original,   u^3 (10 - 15u + 6u^2) smooth,   0 <= u <= 1

    For |v| <= epsilon, g = mu_s N and the expression equals the four branches of the paper. In the
    smooth form the corners of the clip are rounded over +-F_eps. The paper does not specify the
    fall beyond epsilon; its form is a choice.
    Limits: F(0) = F_e for |F_e| <= mu_s N - F_eps; F(epsilon) = mu_s N. Inside the window friction
    may drive: F v >= -0.204 mu_s N epsilon. As with `Karnopp`, a moving body comes to rest only
    asymptotically.
    Source: Awrejcewicz, Grzelczyk, Pyryev 2008 (not read).
    Checked: the four branches join continuously.
    """

    facts = Facts(
        ("D", "S", "St"),
        "C1 at |v| = epsilon, C2 at 0, |F_e| = mu_s N -+ F_eps (original: C0 in F_e)",
        "unverified",
    )

    epsilon: Scalar = fields.BAND(1e-3, doc="half width of the window")
    v_s: Scalar = fields.V_S(1e-2)
    F_eps: Scalar = fields.F_EPS(1e-3)
    form: str = option("smooth", choices=FORMS, doc="quintic or cubic window")

    @property
    def inputs(self) -> tuple[Input, ...]:
        """Applied force F_e [N], which the contact carries in stick."""
        return (APPLIED_FORCE,)

    def outside(self, speed: Scalar, N: Scalar) -> Scalar:
        """Return the sliding force [N] at a speed >= 0 for zero widths."""
        return N * self.coefficient(smooth.fall(speed, self.v_s, 2.0))

    def force(self, v: Scalar, N: Scalar, z: Scalar = (), *, F_e: Scalar = 0.0) -> Scalar:
        """Return the friction force [N]."""
        soft = self.form == "smooth"
        speed, static = smooth.magnitude(v, 0.0), self.mu_s * N
        beyond = smooth.positive(speed - self.epsilon, 0.0) / self.v_s
        slip = N * self.coefficient(exp(-beyond * beyond))
        A = (smooth.step5 if soft else smooth.step3)(speed / self.epsilon)
        stick = smooth.hold(F_e, static, self.F_eps if soft else 0.0)
        return (1 - A) * stick + A * slip * smooth.sign(v, 0.0)


@parametric
class LeineSwitch(Sticking):
    """Switch model of Leine et al., and its smooth approximation.

        smooth:    F = mu_s N (2/pi) atan(v / v_eps) / (1 + delta |v|)
        original:  F = mu_s N sign(v) / (1 + delta |v|)          for |v| > eta, slip
                   F = clip(F_e + c v, -mu_s N, mu_s N)          for |v| <= eta, stick

    The term c v moves a sticking body to v = 0: with c = m alpha, dv/dt = -alpha v. In the smooth
    form |v| is rounded over 1e-4 v_eps.
    form = "event" (one state, the mode) has no band: sliding ends where v passes through zero, and
    stick ends where |F_e| reaches mu_s N. It requires a scene with events. In the band of the
    original form friction may drive: F v >= -mu_s N eta.
    Limits: the level decreases from mu_s N to zero; there is no dynamic level. The smooth form
    creeps under load and is 6 % below the original at 10 v_eps, since atan converges slowly.
    Source: Leine et al., Nonlinear Dynam. 16, 1998 (not read); smooth form and slip law as in the
    author's public code.
    Checked: rleine's stickslipsmooth.m (slip law, smooth form); switching unverified.
    """

    facts = Facts(("D", "S", "St"), "C∞ (original: jump at |v| = eta)", "one source")

    delta: Scalar = fields.STEEPNESS(3.0, doc="steepness of the fall", lower=0.0)
    v_eps: Scalar = fields.V_EPS(1e-4, lower=1e-12)
    eta: Scalar = fields.BAND(1e-6, doc="half width of the band of rest", lower=1e-15)
    c: Scalar = fields.SIGMA_1(10.0, doc="pull to the middle, original form")
    form: str = option("smooth", choices=WITH_MODES, doc="arctangent, switch, or exact with mode")

    @property
    def inputs(self) -> tuple[Input, ...]:
        """Applied force, except in the smooth form."""
        return () if self.form == "smooth" else (APPLIED_FORCE,)

    @property
    def velocity_scale(self) -> Scalar:
        """Smoothing velocity, or half width of the band [m/s]; inf in the event form."""
        return {"smooth": self.v_eps, "original": self.eta, "event": inf}[self.form]

    def outside(self, speed: Scalar, N: Scalar) -> Scalar:
        """Return the sliding force [N] at a speed >= 0 for zero widths."""
        return self.mu_s * N / (1 + smooth.onward(self.delta * speed))

    def force(self, v: Scalar, N: Scalar, z: Scalar = (), *, F_e: Scalar = 0.0) -> Scalar:
        """Return the friction force [N]."""
        static = self.mu_s * N
        if self.form == "smooth":
            falling = static / (1 + self.delta * smooth.magnitude(v, smooth.CORNER * self.v_eps))
            return falling * (2 / pi * atan(v / self.v_eps))
        speed = smooth.magnitude(v, 0.0)
        if self.has_mode:
            return carried(z[0], F_e, static * z[0] / (1 + self.delta * speed))
        slip = static * smooth.sign(v, 0.0) / (1 + self.delta * speed)
        stick = smooth.hold(F_e + self.c * v, static, 0.0)
        return smooth.choose(speed <= self.eta, stick, slip)


@parametric
class Wojewoda(Levels, StaticLaw):
    """Hysteretic friction of Wojewoda et al., with branches for acceleration and deceleration.

        F = N [mu_d + (mu_s - mu_d) h sign(v dv/dt)] sign(v)
        h = exp(-a_1 |v| / (|dv/dt| + a_2))

    sign(v) is smooth over v_eps, |v| over 1e-4 v_eps, |dv/dt| over a_eps, sign(v dv/dt) over
    v_eps a_eps. The stick branch clip(F_e) of the paper is omitted.
    Limits: F -> mu_d N for fast sliding; Coulomb friction at dv/dt = 0. Needs mu_s <= 2 mu_d,
    otherwise friction drives a decelerating body. The acceleration of the body on which the force
    acts would close an algebraic loop; use a measured or filtered acceleration.
    Source: after Wojewoda, Stefanski, Wiercigroch, Kapitaniak 2008 (abstract only).
    Checked: only the abstract of the paper was read.
    """

    facts = Facts(("D", "S", "St", "L"), "C∞", "rebuilt")

    a_1: Scalar = fields.SHAPE(100.0, unit="1/s", doc="decay of the hysteresis", lower=0.0)
    a_2: Scalar = fields.SHAPE(0.1, unit="m/s^2", doc="acceleration of half the decay", lower=1e-12)
    v_eps: Scalar = fields.V_EPS(1e-4, lower=1e-12)
    a_eps: Scalar = fields.WIDTH(1e-2, unit="m/s^2", doc="smoothing acceleration")

    def __post_init__(self) -> None:
        super().__post_init__()
        if is_number(self.mu_s) and is_number(self.mu_d) and self.mu_s > 2 * self.mu_d:
            raise ValueError(
                f"Wojewoda: mu_s: expected mu_s <= 2 mu_d = {2 * self.mu_d:g}, got {self.mu_s:g}; "
                "otherwise friction drives a body that slows down"
            )

    @property
    def inputs(self) -> tuple[Input, ...]:
        """Sliding acceleration dv/dt [m/s^2]."""
        return (Input("dv", "m/s^2", "sliding acceleration"),)

    def outside(self, speed: Scalar, N: Scalar, *, dv: Scalar = 0.0) -> Scalar:
        """Raise an error, since the branch near rest depends on dv."""
        raise one_sided(self, "its branches change with the sign of v dv/dt")

    def force(self, v: Scalar, N: Scalar, z: Scalar = (), *, dv: Scalar = 0.0) -> Scalar:
        """Return the friction force [N]."""
        speed = smooth.magnitude(v, smooth.CORNER * self.v_eps)
        h = exp(-self.a_1 * speed / (smooth.magnitude(dv, self.a_eps) + self.a_2))
        phase = smooth.sign(v * dv, self.v_eps * self.a_eps)
        mu = self.mu_d + (self.mu_s - self.mu_d) * h * phase
        return mu * N * smooth.sign(v, self.v_eps)
