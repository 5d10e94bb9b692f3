"""The functions of exponential integrators, with the right value and derivatives at zero."""

import casadi as ca

SMALL = 1e-2
"""Below this |x| the series replaces the quotient; its next term is 4e-14 of the sum."""


def phi1_phi2(x: ca.SX) -> tuple[ca.SX, ca.SX]:
    """phi1 = (exp(x) - 1) / x and phi2 = (phi1 - 1) / x, element by element.

    They are the weights of rate and of its effect in the end value and in the mean of a solution of
    dz/dt = a + b z over a step: z(h) = z + h phi1(b h) dz/dt, mean z = z + h phi2(b h) dz/dt.
    One series serves both: phi1 = 1 + x phi2.
    """
    near = ca.fabs(x) < SMALL
    divisor = ca.if_else(near, 1.0, x)
    quotient = ca.expm1(x) / divisor
    series = 1 / 2 + x * (1 / 6 + x * (1 / 24 + x * (1 / 120 + x * (1 / 720))))
    phi2 = ca.if_else(near, series, (quotient - 1) / divisor)
    return ca.if_else(near, 1 + x * phi2, quotient), phi2
