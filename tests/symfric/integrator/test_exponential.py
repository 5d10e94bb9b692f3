"""phi1 and phi2 against their integral definitions."""

import casadi as ca
import numpy as np
import pytest

from symfric.integrator.exponential import SMALL, phi1_phi2

x = ca.SX.sym("x")
VALUES = ca.Function("values", [x], phi1_phi2(x))
SLOPES = ca.Function("slopes", [x], [ca.jacobian(phi, x) for phi in phi1_phi2(x)])
NODES, WEIGHTS = (0.5 * part for part in np.polynomial.legendre.leggauss(40))
S = NODES + 0.5


@pytest.mark.parametrize(
    "at", [0.0, 1e-9, -1e-4, -0.999 * SMALL, -1.001 * SMALL, 0.5, -1.0, 2.0, -5.0, -20.0]
)
def test_values_are_the_integrals(at):
    phi1, phi2 = VALUES(at)
    assert float(phi1) == pytest.approx(WEIGHTS @ np.exp(at * S), rel=1e-13)
    assert float(phi2) == pytest.approx(WEIGHTS @ ((1 - S) * np.exp(at * S)), rel=3e-14 / SMALL)


@pytest.mark.parametrize("at", [-1e4, -1e12, -1e300])
def test_far_below_zero_they_tend_to_the_reciprocal(at):
    phi1, phi2 = VALUES(at)
    assert float(phi1) == -1 / at
    assert float(phi2) == pytest.approx(-1 / at, rel=2e-4)


def test_slopes_at_zero_are_those_of_the_series():
    assert [float(slope) for slope in SLOPES(0.0)] == pytest.approx([1 / 2, 1 / 6], rel=1e-14)
