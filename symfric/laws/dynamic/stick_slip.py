"""Laws that stick up to a static level: by modes, by blending, by a reset, and in a plane."""

from math import inf

from symfric.foundation.numeric import Scalar, column, equals, exp
from symfric.foundation.parameters import option, parametric
from symfric.laws.base import fields, smooth
from symfric.laws.base.families import Levels, Sticking, TwoLevels, carried
from symfric.laws.base.law import Facts, State, Switch
from symfric.laws.dynamic.element import ConstantStep, deflection, yielding


@parametric
class ExactCoulomb(Sticking):
    """Set-valued Coulomb friction with a static level, by modes (one state).

        F = mu N mode + sigma_2 v    slip, mode = sign(v), until v passes through zero
        F = F_e                      stick, mode = 0, until |F_e| = mu_s N
        mu = mu_d                                           form = "jump"
        mu = mu_d + (mu_s - mu_d) exp(-(v / v_s)^2)         form = "stribeck"

    F_e is the applied force, which the contact must carry for zero acceleration. Sliding ends where
    v passes through zero. There the contact sticks if it can hold F_e; otherwise it slides in the
    other direction. The law is the reference for regularised laws, and requires a scene with
    events. If |F_e| exceeds mu_s N at the start of a run, the contact breaks away immediately. In
    joints of a mechanism F_e follows from the constraints, see `JointFriction`.
    Limits: `Coulomb`, `Stribeck` and others tend to it as their smoothing width tends to zero.
    Between the switches the mode is constant. The relative tolerance of a run is at most 1e-7, even
    if a larger one is requested: then the block of `Rabinowicz` is exact to 1e-7 m over 20 s.
    Source: Coulomb 1785; as a hybrid system Olsson et al., Eur. J. Control 4, 1998.
    Checked: Modelica Standard Library; rleine/Keynote_Nonsmooth_Dynamics_ENOC2024.
    """

    facts = Facts(("D", "S", "St", "V"), "set-valued at v = 0, exact by modes", "two sources")
    ordered = (("mu_d", "mu_s"),)

    mu_d: Scalar = fields.MU_D(0.1)

    v_s: Scalar = fields.V_S(1e-2)
    sigma_2: Scalar = fields.SIGMA_2(0.0)
    form: str = option("jump", choices=("jump", "stribeck"), doc="fall at once, or over v_s")

    @property
    def has_mode(self) -> bool:
        """True, since stick and slip are modes in both forms."""
        return True

    @property
    def velocity_scale(self) -> Scalar:
        """Stribeck velocity [m/s]; inf in the form "jump", where an event replaces it."""
        return self.v_s if self.form == "stribeck" else inf

    def outside(self, speed: Scalar, N: Scalar) -> Scalar:
        """Return the sliding force [N] at a speed >= 0."""
        return self._coefficient(smooth.fall(speed, self.v_s, 2.0)) * N + self.sigma_2 * speed

    def _coefficient(self, falling: Scalar) -> Scalar:
        """Return mu for the Stribeck weight `falling`."""
        if self.form == "jump":
            return self.mu_d
        return self.mu_d + (self.mu_s - self.mu_d) * falling

    def force(self, v: Scalar, N: Scalar, z: Scalar = (), *, F_e: Scalar = 0.0) -> Scalar:
        """Return the friction force [N]."""
        mu = self._coefficient(smooth.stribeck(v, self.v_s, 2.0, 0.0))
        return carried(z[0], F_e, mu * N * z[0] + self.sigma_2 * v)


ROOT_STEPS = 10
"""Number of Newton steps that find the root to rounding for every allowed sharpness."""


@parametric
class StickSlip(Levels):
    """Stick-slip friction with stiction deformation (one state).

        beta  = 1 - step(|v|/v_s)                     1 in stick, 0 in slip
        mu_v  = sign(v) [mu_s - (mu_s - mu_d) step((|v| - v_s)/(v_d - v_s))]
        mu_D  = mu_s (2 step((D/D_max + 1)/2) - 1)
        F     = N [(1 - beta) mu_v + beta mu_D]
        dD/dt = beta v [1 - |D/D_max|^n (1 + sign(v D))/2] - (1 - beta) |v| D/D_max

    D [m] is the stiction deformation, which decays in slip over the path D_max. The step is the
    quintic one. With branch = "published", mu_v decreases to zero within v_s, as in
    `VelocityBased`. The blended coefficient is then below mu_s within v_s, which allows a second
    equilibrium under load in which the contact creeps. "plateau" keeps mu_v = mu_s within v_s.
    Limits: mu_v N for |v| >= v_s; holds any load below mu_s N at rest. The stiffness at rest,
    15/8 mu_s N / D_max, is large, and the contact is undamped. An interpretation: the structure is
    published, but the formulas of the blend and of D were not available.
    Source: Cha, Choi, Ryu, Choi, J. Mech. Sci. Technol. 25, 2011 (abstract).
    Checked: the structure is that of the abstract; the formulas are constructed.
    """

    facts = Facts(("D", "S", "St", "P"), "C2", "rebuilt")
    strictly_ordered = (("v_s", "v_d"),)

    v_s: Scalar = fields.VELOCITY(1e-3, doc="velocity of full slip")
    v_d: Scalar = fields.VELOCITY(1.5e-3, doc="velocity of the dynamic level")
    D_max: Scalar = fields.LENGTH(1e-6, doc="largest stiction deformation")
    n: Scalar = fields.SHARPNESS(20.0)
    v_eps: Scalar = fields.REST_EPS(1e-15)
    r_eps: Scalar = fields.WIDTH(1e-8, doc="smoothing of the deformation")
    branch: str = option("plateau", choices=("plateau", "published"), doc="mu_v within v_s")

    @property
    def states(self) -> tuple[State, ...]:
        """Deformation D [m] of the contact in stick."""
        return (State("D", "m", 1e-6, doc="stiction deformation"),)

    def _slipping(self, v: Scalar) -> Scalar:
        return smooth.step5(smooth.magnitude(v, self.v_eps) / self.v_s)

    def outside(self, speed: Scalar, N: Scalar) -> Scalar:
        """Return the steady sliding force [N] at a speed >= 0, the plateau mu_s N within v_s."""
        fallen = smooth.step5((speed - self.v_s) / (self.v_d - self.v_s))
        return N * (self.mu_s - (self.mu_s - self.mu_d) * fallen)

    def force(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Return the friction force [N]."""
        slip, speed = self._slipping(v), smooth.magnitude(v, self.v_eps)
        fallen = smooth.step5((speed - self.v_s) / (self.v_d - self.v_s))
        mu = self.mu_s - (self.mu_s - self.mu_d) * fallen
        direction = smooth.sign(v, self.v_eps)
        if self.branch == "published":
            direction = direction * slip
        u = smooth.clip(z[0] / self.D_max, -1.0, 1.0)
        stiction = self.mu_s * u * (15 - u * u * (10 - 3 * (u * u))) / 8  # 2 step((u + 1)/2) - 1
        return N * (slip * mu * direction + (1 - slip) * stiction)

    def rate(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Return the rate of the stiction deformation [m/s], shape (1, 1)."""
        slip, r = self._slipping(v), z[0] / self.D_max
        stretch = yielding(v, r, self.n, self.v_eps, self.r_eps)
        forgotten = smooth.magnitude(v, self.v_eps) * r
        return column((1 - slip) * stretch - slip * forgotten)

    def steady_state(self, v: Scalar, N: Scalar) -> Scalar:
        """Return the deformation at which growth equals loss, shape (1, 1); zero beyond v_s.

        It is the root of the convex function slip r + (1 - slip) (r^n - 1), by Newton's method from
        r = 1.
        """
        slip, r = self._slipping(v), 1.0 + 0.0 * v
        for _ in range(ROOT_STEPS):
            spent = (1 - slip) * smooth.power(r, self.n, self.r_eps)
            r = r - (slip * r + spent - (1 - slip)) / (slip + self.n * spent / (r + self.r_eps))
        return column(self.D_max * r * smooth.sign(v, self.v_eps))


@parametric
class HaessigFriedland(TwoLevels):
    """Reset-integrator friction (one state, with a mode in the event form).

        r     = sigma_0 z / (mu_d N)
        stick: dz/dt = v until |r| = 1
        slip:  dz/dt = 0 until v changes sign
        F = sigma_0 z mu_s/mu_d + sigma_1 dz/dt  in stick,  sigma_0 z  in slip

    The stiction gradient of the paper is a = (mu_s - mu_d) / mu_d. form = "event" is this law for
    constant N, in which the force jumps from mu_s N to mu_d N. form = "smooth" yields with the
    sharpness n, and the excess decreases in a smooth step as |r| rises from 1 - knee to 1:

        smooth: dz/dt = v [1 - |r|^n (1 + sign(v r)) / 2]

    Limits: steady state mu_d N sign(v); rate-independent for sigma_1 = 0; drifts as little as
    `MaxwellSlip` with one element. F v < 0 while the bristle unloads: it returns its stored energy,
    at most mu_s mu_d N^2 / (2 sigma_0). |v| is smooth over v_eps. Not valid for N = 0.
    Source: Haessig and Friedland, ASME J. Dyn. Syst. Meas. Control 113(3), 1991.
    Checked: the smooth form is constructed.
    """

    facts = Facts(
        ("D", "S", "P", "N"),
        "C2 (jumps as knee -> 0)",
        "unverified",
        load="proportional in steady sliding",
    )

    mu_d: Scalar = fields.MU_D(0.1, lower=1e-12)
    sigma_0: Scalar = fields.STIFFNESS(1e5, doc="bristle stiffness in slip")
    sigma_1: Scalar = fields.SIGMA_1(190.0, doc="bristle damping in stick")
    n: Scalar = fields.SHARPNESS(50.0)
    knee: Scalar = fields.SHAPE(0.05, doc="share over which excess is lost", lower=1e-6, upper=1)
    v_eps: Scalar = fields.REST_EPS(1e-15)
    r_eps: Scalar = fields.R_EPS(1e-8)
    form: str = option("smooth", choices=("smooth", "event"), doc="rounded, or exact with modes")

    @property
    def states(self) -> tuple[State, ...]:
        """Bristle deflection [m], followed by the mode in the event form."""
        slip = State("slip", "1", 1.0, even=True, doc="1 in slip", whole=True)
        bristle = State("z", "m", deflection(self.sigma_0), doc="bristle deflection")
        return (bristle, slip) if self.form == "event" else (bristle,)

    def _share(self, N: Scalar, z: Scalar) -> Scalar:
        return self.sigma_0 * z[0] / (self.mu_d * N)

    def rate(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Return the rate of the deflection [m/s], and zero for the mode."""
        if self.form == "event":
            return column((1 - z[1]) * v, 0.0 * v)
        return column(yielding(v, self._share(N, z), self.n, self.v_eps, self.r_eps))

    def force(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Return the friction force [N]."""
        if self.form == "event":
            excess = 1 - z[1]
        else:
            r = smooth.magnitude(self._share(N, z), self.r_eps)
            excess = 1 - smooth.step5((r - 1) / self.knee + 1)
        stiffness = self.sigma_0 * (1 + (self.mu_s / self.mu_d - 1) * excess)
        return stiffness * z[0] + self.sigma_1 * self.rate(v, N, z)[0]

    def steady_state(self, v: Scalar, N: Scalar) -> Scalar:
        """Return the deflection at its limit [m], and the mode of slip in the event form."""
        direction = smooth.sign(v, 0.0 if self.form == "event" else self.v_eps)
        z = self.mu_d * N / self.sigma_0 * direction
        return column(z, direction**2) if self.form == "event" else column(z)

    def held_step(self, v: Scalar, N: Scalar, z: Scalar, h: Scalar) -> tuple[Scalar, Scalar] | None:
        """Return the exact step in the event form, and None in the smooth form.

        The mean of the mode is its value at the end of the step.
        """
        if self.form == "smooth":
            return None
        held = ConstantStep.over(v, h)
        end, mean, slip = held.yielded(z[0], z[1], 1.0, self.mu_d * N / self.sigma_0)
        return column(end, slip), column(mean, slip)

    def switches(self, v: Scalar, N: Scalar, z: Scalar = ()) -> tuple[Switch, ...]:
        """Return the switches to slip at the limit and to stick when v changes sign."""
        if self.form == "smooth":
            return ()
        direction = smooth.sign(v, 0.0)
        reached = smooth.choose(z[1] > 0.5, -1.0, direction * self._share(N, z) - 1)
        limit = direction * self.mu_d * N / self.sigma_0
        return (
            Switch("slip_begins", reached, 1, {"z": limit, "slip": 1.0}),
            Switch("reversal", v, 0, {"slip": 0.0}),
        )


CUBIC_STEPS = 40
"""Number of Newton steps that find a root as small as 1e-5, the cube root of 1e-15."""


@parametric
class Bristle2D(Levels):
    """Bristle friction that slides at the edge of a friction disc (one state, a vector in a plane).

        g     = N [mu_d + (mu_s - mu_d) exp(-|v|^2/v_s^2)]
        F_tr  = sigma_0 z + sigma_1 v
        F     = F_tr sat(|F_tr|, g) / |F_tr|
        dz/dt = (F - sigma_0 z) / sigma_1

    For slip in a plane with vectors v, z and F use `PlanarSlip(Bristle2D())`. sat is the identity
    up to (1 - kappa) g, so that the bristle returns exactly and does not drift, and g beyond
    (1 + kappa) g. kappa = 0 is the projection onto the disc of radius g, with a kink at its edge.
    Limits: isotropic; steady state g v/|v| for |v| > kappa g / sigma_1, down to (1 - kappa) g in
    creep; a bristle and a damper in parallel below g. sigma_1 -> 0 tends to Coulomb friction.
    Source: Kikuuwe, Takesue, Sano, Mochiyama, Fujimoto, IEEE T-RO 22(6), 2006 (elastoplastic
    form); contact as in Liang, Fillmore, Ma, J. Comput. Nonlinear Dynam. 7(4), 2012.
    Checked: JuliaRobotics/RigidBodyDynamics.jl contact.jl (viscoelastic Coulomb friction).
    """

    facts = Facts(
        ("D", "S", "St", "P", "N"),
        "C2 (C0 as kappa -> 0)",
        "one source",
        load="proportional in steady sliding",
    )

    mu_d: Scalar = fields.MU_D(0.1, lower=1e-12)
    v_s: Scalar = fields.V_S(1e-3)
    sigma_0: Scalar = fields.SIGMA_0(1e5)
    sigma_1: Scalar = fields.SIGMA_1(190.0, lower=1e-12)
    kappa: Scalar = fields.WIDTH(0.02, doc="rounding of the saturation", lower=0.0, upper=1.0)

    @property
    def states(self) -> tuple[State, ...]:
        """Deflection z of the bristle [m], which is a vector for slip in a plane."""
        return (State("z", "m", deflection(self.sigma_0), doc="bristle deflection"),)

    def _level(self, v: Scalar, N: Scalar) -> Scalar:
        return N * self.coefficient(exp(-((v / self.v_s) ** 2)))

    def outside(self, speed: Scalar, N: Scalar) -> Scalar:
        """Return the steady sliding force [N] at a speed >= 0."""
        return self._level(speed, N)

    def force(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Return the friction force [N]."""
        g = self._level(v, N)
        corner = 0.0 if equals(self.kappa, 0.0) else self.kappa * g
        return smooth.hold(self.sigma_0 * z[0] + self.sigma_1 * v, g, corner)

    def rate(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Return the rate of the deflection [m/s], shape (1, 1)."""
        return column((self.force(v, N, z) - self.sigma_0 * z[0]) / self.sigma_1)

    def steady_state(self, v: Scalar, N: Scalar) -> Scalar:
        """Return the deflection in steady sliding [m], exact to rounding of g.

        The force F satisfies F = sat(F + sigma_1 v). The position in the corner of sat,
        t = (F + sigma_1 v - g) / (2 kappa g) + 1/2, is the root of t^3 (2 - t) =
        sigma_1 |v| / (kappa g) in [0, 1]. The function is convex, and Newton's method starts at
        t = 1.
        """
        g, drawn = self._level(v, N), self.sigma_1 * smooth.magnitude(v, 0.0)
        held = g
        if not equals(self.kappa, 0.0):
            t, corner = 1.0 + 0.0 * v, self.kappa * g
            target = smooth.clip(drawn / corner, 0.0, 1.0)
            for _ in range(CUBIC_STEPS):
                t = t - (t * (2 - t) - target / (t * t)) / (6 - 4 * t)
            held = smooth.choose(drawn >= corner, g, g + corner * (2 * t - 1) - drawn)
        return column(held / self.sigma_0 * smooth.sign(v, 0.0))
