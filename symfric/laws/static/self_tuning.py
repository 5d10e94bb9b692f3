"""The self-tuning law: a sine of an arctangent whose shape factor follows from mu_d / mu_s."""

from dataclasses import dataclass
from math import asin as asin_of_float
from math import cos as cos_of_float
from math import inf, pi
from math import sin as sin_of_float
from typing import ClassVar, final

from symfric.laws.base import Facts, StaticLaw
from symfric.numeric import Scalar, asin, atan, equals, exp, sin, tan
from symfric.parameters import param


@final
@dataclass(frozen=True, eq=False)
class SelfTuning(StaticLaw):
    """Self-tuning friction (Pacejka-like), reconstructed.

        y = B v,   phi = (1 - E) y + E atan(y)
        F = mu_s N sin(C atan(phi)),   C = 2 - (2/pi) asin(mu_d / mu_s)

    C fixes the magnitudes: the peak is mu_s N exactly and F -> mu_d N as v -> inf. B fixes only
    the velocity scale; the peak lies at phi = tan(pi / (2C)), for E = 0 at v = tan(pi/(2C)) / B.
    `from_peak_velocity` places it, `brittleness` gives the paper's kind of B(N, mu_s - mu_d).
    Limits: mu_s = mu_d gives C = 1, monotone without a peak, but the gradient of C with respect
    to mu_s and mu_d is infinite there. Creeps under load. Slope at rest mu_s N B C.
    Source: reconstruction of doi 10.1177/14644193231169325, whose printed equations are lost; the
    bracket with E and the function for B are interpretations.
    """

    facts: ClassVar[Facts] = Facts(
        phenomena=("D", "S", "St"),
        smoothness="C∞",
        confidence="reconstruction",
        source="after doi 10.1177/14644193231169325 (equations reconstructed)",
    )
    ordered: ClassVar[tuple[tuple[str, str], ...]] = (("mu_d", "mu_s"),)

    mu_s: Scalar = param(0.15, unit="1", doc="static friction coefficient", lower=1e-12)
    mu_d: Scalar = param(0.1, unit="1", doc="dynamic friction coefficient", lower=0.0)
    B: Scalar = param(1000.0, unit="s/m", doc="stiffness factor", lower=1e-12)
    E: Scalar = param(0.0, unit="1", doc="curvature factor", upper=0.999)

    @property
    def C(self) -> Scalar:
        """Shape factor [1], between 1 and 2, in closed form."""
        return shape_factor(self.mu_d / self.mu_s)

    @property
    def velocity_scale(self) -> Scalar:
        """The velocity 1/B [m/s]."""
        return 1 / self.B

    def force(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Friction force [N]."""
        y = self.B * v
        phi = y if equals(self.E, 0.0) else (1 - self.E) * y + self.E * atan(y)
        return self.mu_s * N * sin(self.C * atan(phi))

    @classmethod
    def from_peak_velocity(
        cls, v_p: Scalar, mu_s: Scalar = 0.15, mu_d: Scalar = 0.1
    ) -> "SelfTuning":
        """The law with E = 0 whose peak mu_s N lies at the velocity `v_p` [m/s].

        Ill-posed as mu_d -> mu_s, where the peak moves to infinity.
        """
        return cls(mu_s=mu_s, mu_d=mu_d, B=tan(pi / (2 * shape_factor(mu_d / mu_s))) / v_p)


def shape_factor(ratio: Scalar) -> Scalar:
    """C = 2 - (2/pi) asin(mu_d / mu_s): the shape factor whose asymptote is mu_d N."""
    return 2 - (2 / pi) * asin(ratio)


def corrected_shape_factor(
    ratio: float, theta: float = pi / 2, tolerance: float = 1e-12, max_iterations: int = 200
) -> tuple[float, int]:
    """The same C by the paper's kind of iterative correction, here Newton's method.

    Solves sin(C theta) = mu_d / mu_s from the right end C = pi/theta, from where convergence is
    monotone. `theta` = atan(phi(B v_d)) refers the dynamic level to a finite velocity v_d.

    Returns:
        C and the number of iterations used. As the ratio tends to 1 the root becomes double and
        convergence linear; the closed form has no such limit.

    Raises:
        ValueError: ratio outside 0 ... 1, or no convergence within `max_iterations`.
    """
    if not 0.0 <= ratio <= 1.0:
        raise ValueError(
            f"corrected_shape_factor: expected 0 <= mu_d/mu_s <= 1, got {ratio:g}; "
            "the dynamic level cannot exceed the static one"
        )
    shape, error = pi / theta, inf
    for iteration in range(max_iterations):
        error = sin_of_float(shape * theta) - ratio
        if abs(error) < tolerance:
            return shape, iteration
        shape -= error / (theta * cos_of_float(shape * theta))
    raise ValueError(
        f"corrected_shape_factor: expected convergence within {max_iterations} iterations, "
        f"got residual {error:.1e} at ratio {ratio:g}; use the closed form "
        f"C = {(pi - asin_of_float(ratio)) / theta:.6g}"
    )


def brittleness(
    N: Scalar,
    difference: Scalar,
    B_0: Scalar = 100.0,
    B_max: Scalar = 1000.0,
    difference_ref: Scalar = 0.05,
    N_ref: Scalar = 50.0,
) -> Scalar:
    """Stiffness factor B [s/m] that grows with mu_s - mu_d and with the normal force.

        B = B_0 + (B_max - B_0) [1 - exp(-(difference/difference_ref) (N/N_ref))]

    Large mu_s - mu_d means brittle bristles and a faster transition. The paper's own formula is
    lost; this one is a candidate with its stated trends.
    """
    return B_0 + (B_max - B_0) * (1 - exp(-(difference / difference_ref) * (N / N_ref)))
