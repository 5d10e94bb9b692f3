"""Laws based on the magic formula, the sine of an arctangent, and on rules for its factors."""

import math
from math import pi

from symfric.foundation.numeric import Scalar, asin, atan, equals, exp, is_casadi, sin, tan
from symfric.foundation.parameters import parametric
from symfric.laws.base import fields, smooth
from symfric.laws.base.families import TwoLevels
from symfric.laws.base.law import Facts, StaticLaw


@parametric
class RuiWang(StaticLaw):
    """Rui-Wang static friction, reconstructed: the magic formula with a constant level.

        y = B v,   phi = (1 - E) y + E atan(y)
        F = D sin(C atan(phi))

    The original is known only from descriptions: it is continuously differentiable in v, it does
    not depend on mu_d, N or a transition velocity, and `SelfTuning` is a modification of it with
    the same sine and arctangent. The equation is an assumption.
    Limits: `SelfTuning` with D = mu_s N and its C; F -> D sin(C pi/2). `N` has no effect. C <= 1 is
    monotone, C > 1 has a peak. Creeps under load.
    Source: reconstruction; the equation of Wang and Rui 2000 was not available.
    """

    facts = Facts(("D", "S", "St"), "C∞", "rebuilt", load="independent")

    D: Scalar = fields.LEVEL(1.5, doc="peak")
    C: Scalar = fields.SHAPE(1.5, doc="shape factor", lower=0.0, upper=2.0)
    B: Scalar = fields.STEEPNESS(1000.0, width=-1, doc="stiffness factor")
    E: Scalar = fields.CURVATURE(0.0)

    def outside(self, speed: Scalar, N: Scalar) -> Scalar:
        """Return the sliding force [N] at a speed >= 0 for zero widths."""
        return self.D * sin(self.C * pi / 2)

    def static_level(self, N: Scalar, side: int = 1, **inputs: Scalar) -> Scalar:
        """Return the peak [N], or the limit of a curve without a peak."""
        return self.D * sin(smooth.clip(self.C, 0.0, 1.0) * pi / 2)

    def force(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Return the friction force [N]."""
        return magic_formula(v, self.D, self.C, self.B, self.E)


@parametric
class SelfTuning(TwoLevels, StaticLaw):
    """Self-tuning friction (Pacejka-like), reconstructed.

        y = B v,   phi = (1 - E) y + E atan(y)
        F = mu_s N sin(C atan(phi)),   C = 2 - (2/pi) asin(mu_d / mu_s)

    C determines the magnitudes: the peak is exactly mu_s N, and F -> mu_d N as v -> inf. B
    determines only the velocity scale: the peak is at phi = tan(pi/(2C)), for E = 0 at
    v = tan(pi/(2C)) / B. `from_peak_velocity` and `from_slope` choose B; in `BrittleSelfTuning` it
    depends on the load.
    Limits: mu_s = mu_d gives C = 1, monotone without a peak, but the gradient of C with respect
    to mu_s and mu_d is infinite there. Creeps under load. The slope at rest is mu_s N B C.
    Source: reconstruction of doi 10.1177/14644193231169325, whose printed equations were not
    available; the bracket with E and the function for B are interpretations.
    """

    facts = Facts(("D", "S", "St"), "C∞", "rebuilt")

    mu_s: Scalar = fields.MU_S(0.15, lower=1e-12)
    B: Scalar = fields.STEEPNESS(1000.0, width=-1, doc="stiffness factor")
    E: Scalar = fields.CURVATURE(0.0)

    @property
    def C(self) -> Scalar:
        """Shape factor [1], between 1 and 2, in closed form."""
        return shape_factor(self.mu_d / self.mu_s)

    def force(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Return the friction force [N]."""
        return magic_formula(v, self.mu_s * N, self.C, self.B, self.E)

    @classmethod
    def from_peak_velocity(
        cls, v_p: Scalar, mu_s: Scalar = 0.15, mu_d: Scalar = 0.1, E: float = 0.0
    ) -> "SelfTuning":
        """Return the law with its peak mu_s N at the velocity `v_p` [m/s].

        The problem is ill-posed as mu_d -> mu_s, where the peak moves to infinity.

        Raises:
            ValueError: E != 0 with symbols for mu_s or mu_d, since phi is inverted numerically.
        """
        peak = tan(pi / (2 * shape_factor(mu_d / mu_s)))
        if not equals(E, 0.0):
            peak = _inverse_phi(peak, E)
        return cls(mu_s=mu_s, mu_d=mu_d, B=peak / v_p, E=E)

    @classmethod
    def from_slope(
        cls, k: Scalar, N: Scalar, mu_s: Scalar = 0.15, mu_d: Scalar = 0.1, E: Scalar = 0.0
    ) -> "SelfTuning":
        """Return the law with the slope `k` [N s/m] at rest at the normal force `N`, for any E."""
        return cls(mu_s=mu_s, mu_d=mu_d, B=k / (mu_s * N * shape_factor(mu_d / mu_s)), E=E)


@parametric
class BrittleSelfTuning(TwoLevels, StaticLaw):
    """Self-tuning friction whose stiffness factor depends on load and brittleness.

        B = B_0 + (B_max - B_0) [1 - exp(-(mu_s - mu_d)/difference_ref N/N_ref)]
        F = SelfTuning(mu_s, mu_d, B, E)

    A large mu_s - mu_d means brittle bristles and a faster transition, as does a large load.
    Limits: N -> 0 or mu_s = mu_d gives B_0, a large load B_max. The levels mu_s N and mu_d N are
    those of `SelfTuning` for any B. If N is a multiplier of a mechanism, dF/dN contains the
    derivative of B.
    Source: reconstruction of doi 10.1177/14644193231169325, which states the trends of B; its
    formula was not available, and this one is a candidate.
    """

    facts = Facts(
        ("D", "S", "St"),
        "C∞",
        "rebuilt",
        load="more than proportional below the peak, since B grows",
    )
    ordered = (("mu_d", "mu_s"), ("B_0", "B_max"))

    mu_s: Scalar = fields.MU_S(0.15, lower=1e-12)
    B_0: Scalar = fields.STEEPNESS(100.0, width=-1, doc="stiffness factor without load")
    B_max: Scalar = fields.STEEPNESS(1000.0, width=-1, doc="stiffness factor under heavy load")
    difference_ref: Scalar = fields.SHAPE(0.05, doc="reference of mu_s - mu_d", lower=1e-12)
    N_ref: Scalar = fields.LOAD(50.0, doc="reference of the load", lower=1e-12)
    E: Scalar = fields.CURVATURE(0.0)

    @property
    def velocity_scale(self) -> Scalar:
        """Smallest velocity scale, 1/B_max [m/s]."""
        return 1 / self.B_max

    def force(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Return the friction force [N]."""
        difference = self.mu_s - self.mu_d
        B = brittleness(N, difference, self.B_0, self.B_max, self.difference_ref, self.N_ref)
        C = shape_factor(self.mu_d / self.mu_s)
        return magic_formula(v, self.mu_s * N, C, B, self.E)


def magic_formula(v: Scalar, D: Scalar, C: Scalar, B: Scalar, E: Scalar) -> Scalar:
    """Return D sin(C atan((1 - E) y + E atan(y))) with y = B v."""
    y = B * v
    phi = y if equals(E, 0.0) else (1 - E) * y + E * atan(y)
    return D * sin(C * atan(phi))


def shape_factor(ratio: Scalar) -> Scalar:
    """Return C = 2 - (2/pi) asin(mu_d / mu_s), the shape factor whose asymptote is mu_d N."""
    return 2 - (2 / pi) * asin(ratio)


def _inverse_phi(target: Scalar, E: float) -> float:
    """Return the root y >= 0 of (1 - E) y + E atan(y) = target by bisection, for E < 1."""
    if is_casadi(target, E):
        raise ValueError(
            "SelfTuning.from_peak_velocity: expected numbers for mu_s, mu_d and E, got symbols; "
            "take E = 0 or choose B yourself"
        )
    if not E < 1:
        raise ValueError(f"SelfTuning.from_peak_velocity: E: expected E < 1, got {E:g}")
    low, high = 0.0, (float(target) + abs(E) * pi / 2) / (1 - E)
    for _ in range(80):
        y = (low + high) / 2
        low, high = (y, high) if (1 - E) * y + E * math.atan(y) < target else (low, y)
    return high


def brittleness(
    N: Scalar,
    difference: Scalar,
    B_0: Scalar = 100.0,
    B_max: Scalar = 1000.0,
    difference_ref: Scalar = 0.05,
    N_ref: Scalar = 50.0,
) -> Scalar:
    """Return the stiffness factor B [s/m], which grows with mu_s - mu_d and the normal force.

        B = B_0 + (B_max - B_0) [1 - exp(-(difference/difference_ref) (N/N_ref))]

    A large mu_s - mu_d means brittle bristles and a faster transition. The formula of the paper was
    not available; this one is a candidate with the trends that the paper states.
    """
    return B_0 + (B_max - B_0) * (1 - exp(-(difference / difference_ref) * (N / N_ref)))
