"""Coulomb friction as a set-valued law: projections and complementarity, without regularisation.

The force F of a contact with the level F_C and the sliding velocity v satisfies any of

    F = project(F + r v, F_C)   for one, and then every, r > 0
    v = v_p - v_n,  0 <= v_p  perp  F_C - F >= 0,  0 <= v_n  perp  F_C + F >= 0

Time stepping solves the first for F together with the motion; optimal control takes the second
with a relaxation. For static levels above the dynamic one split the law into a part with constant
level and a smooth falling rest, F = F_S Sgn(v) - smooth(v): only then is the inclusion monotone.

Source: Moreau 1966; Leine, van Campen, de Kraker, van den Steen, Nonlinear Dyn. 16, 1998;
Fischer, Optimization 24, 1992.
"""

from symfric.foundation.numeric import Scalar, column, sqrt
from symfric.laws.base import smooth


def project(F: Scalar, F_C: Scalar) -> Scalar:
    """The nearest force in [-F_C, F_C], the proximal map of the friction level."""
    return smooth.clip(F, -F_C, F_C)


def project_disc(F: Scalar, F_C: Scalar) -> Scalar:
    """The nearest force in the disc of radius F_C, for F of shape (2, 1)."""
    size = sqrt(F[0] ** 2 + F[1] ** 2)
    outside = size > F_C
    share = smooth.choose(outside, F_C / smooth.choose(outside, size, 1.0), 1.0)
    return column(share * F[0], share * F[1])


def residual(F: Scalar, v: Scalar, F_C: Scalar, r: Scalar) -> Scalar:
    """F - project(F + r v, F_C): zero exactly where F and v satisfy Coulomb's law.

    `r` > 0 [N s/m] changes the way to the solution, not the solution; the effective mass over the
    time step makes Newton's method converge in a few steps.
    """
    return F - project(F + r * v, F_C)


def implicit_step(
    v: Scalar, F_e: Scalar, F_C: Scalar, m: Scalar, h: Scalar
) -> tuple[Scalar, Scalar]:
    """Velocity and friction force after one implicit Euler step of m dv/dt = F_e - F.

        F = project(m v / h + F_e, F_C),   v+ = v + h (F_e - F) / m

    Exact stick: the velocity after the step is zero wherever |F| < F_C.
    """
    F = project(m * v / h + F_e, F_C)
    return v + h * (F_e - F) / m, F


def complementarity(v_p: Scalar, v_n: Scalar, F: Scalar, F_C: Scalar) -> Scalar:
    """The products that vanish, (2, 1), for v = v_p - v_n with v_p, v_n >= 0 and |F| <= F_C.

    In a program put them <= eps and let eps fall; equal to zero they violate every constraint
    qualification.
    """
    return column(v_p * (F_C - F), v_n * (F_C + F))


def fischer_burmeister(a: Scalar, b: Scalar, eps: Scalar) -> Scalar:
    """sqrt(a^2 + b^2 + 2 eps) - a - b: zero where a, b >= 0 and a b = eps."""
    return sqrt(a * a + b * b + 2 * eps) - a - b
