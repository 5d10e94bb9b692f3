"""Two-dimensional bristle friction: elastic inside a disc of forces."""

from dataclasses import dataclass
from typing import ClassVar, final

from symfric.foundation.numeric import Scalar, column, equals, exp
from symfric.foundation.parameters import param
from symfric.laws.base import smooth
from symfric.laws.base.law import Facts, Law, State
from symfric.laws.dynamic.element import deflection

ROOT_STEPS = 40
"""Steps of Newton's method that reach a cubic root of 1e-15 of its start."""


@final
@dataclass(frozen=True, eq=False)
class Bristle2D(Law):
    """Bristle friction that slides where a disc ends (one state, in a plane a vector).

        g     = N [mu_d + (mu_s - mu_d) exp(-|v|^2/v_s^2)]
        F_tr  = sigma_0 z + sigma_1 v
        F     = F_tr sat(|F_tr|, g) / |F_tr|
        dz/dt = (F - sigma_0 z) / sigma_1

    Made for slip in a plane, with vectors v, z and F: `PlanarSlip(Bristle2D())`. sat is the
    identity up to (1 - kappa) g, so that the bristle returns exactly and does not drift, and g
    beyond (1 + kappa) g; kappa = 0 is the projection on the disc of radius g, with its kink.
    Limits: isotropic; steady state g v/|v| for |v| > kappa g / sigma_1, down to (1 - kappa) g in
    creep; one bristle and damper in parallel below g. sigma_1 -> 0 tends to Coulomb friction.
    Source: Kikuuwe, Takesue, Sano, Mochiyama, Fujimoto, IEEE T-RO 22(6), 2006 (elastoplastic
    form); the use for contact of Liang, Fillmore, Ma, J. Comput. Nonlinear Dynam. 7(4), 2012.
    """

    facts: ClassVar[Facts] = Facts(
        phenomena=("D", "S", "St", "P", "N"),
        smoothness="C2 (C0 as kappa -> 0)",
        confidence="one source",
        checked="JuliaRobotics/RigidBodyDynamics.jl contact.jl (viscoelastic Coulomb friction)",
        source="Kikuuwe et al., IEEE T-RO 22(6), 2006; Liang, Fillmore, Ma 2012",
        load="proportional in steady sliding",
    )
    ordered: ClassVar[tuple[tuple[str, str], ...]] = (("mu_d", "mu_s"),)

    mu_s: Scalar = param(0.15, unit="1", role="level", doc="static friction coefficient", lower=0.0)
    mu_d: Scalar = param(
        0.1, unit="1", role="level", doc="dynamic friction coefficient", lower=1e-12
    )
    v_s: Scalar = param(
        1e-3, unit="m/s", role="velocity scale", doc="Stribeck velocity", lower=1e-12
    )
    sigma_0: Scalar = param(1e5, unit="N/m", role="stiffness", doc="bristle stiffness", lower=1e-12)
    sigma_1: Scalar = param(190.0, unit="N s/m", role="damping", doc="bristle damping", lower=1e-12)
    kappa: Scalar = param(
        0.02, unit="1", role="width", doc="rounding of the saturation", lower=0.0, upper=1.0
    )

    @property
    def states(self) -> tuple[State, ...]:
        """z: deflection of the bristle [m], a vector in a plane."""
        return (State("z", "m", deflection(self.sigma_0), doc="bristle deflection"),)

    @property
    def velocity_scale(self) -> Scalar:
        """The Stribeck velocity [m/s]."""
        return self.v_s

    def _level(self, v: Scalar, N: Scalar) -> Scalar:
        falling = exp(-((v / self.v_s) ** 2))
        return N * (self.mu_d + (self.mu_s - self.mu_d) * falling)

    def outside(self, speed: Scalar, N: Scalar) -> Scalar:
        """Steady sliding force [N] at a speed >= 0."""
        return self._level(speed, N)

    def force(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Friction force [N]."""
        g = self._level(v, N)
        corner = 0.0 if equals(self.kappa, 0.0) else self.kappa * g
        return smooth.hold(self.sigma_0 * z[0] + self.sigma_1 * v, g, corner)

    def rate(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Rate of the deflection [m/s], shape (1, 1)."""
        return column((self.force(v, N, z) - self.sigma_0 * z[0]) / self.sigma_1)

    def steady_state(self, v: Scalar, N: Scalar) -> Scalar:
        """Deflection in steady sliding [m], exact to rounding of g.

        Its force F solves F = sat(F + sigma_1 v). With t = (F + sigma_1 v - g) / (2 kappa g) + 1/2,
        the place in the corner of sat, it is the root of t^3 (2 - t) = sigma_1 |v| / (kappa g) in
        [0, 1], convex, by Newton's method from t = 1.
        """
        g, drawn = self._level(v, N), self.sigma_1 * smooth.magnitude(v, 0.0)
        held = g
        if not equals(self.kappa, 0.0):
            t, corner = 1.0 + 0.0 * v, self.kappa * g
            target = smooth.clip(drawn / corner, 0.0, 1.0)
            for _ in range(ROOT_STEPS):
                t = t - (t * (2 - t) - target / (t * t)) / (6 - 4 * t)
            held = smooth.choose(drawn >= corner, g, g + corner * (2 * t - 1) - drawn)
        return column(held / self.sigma_0 * smooth.sign(v, 0.0))
