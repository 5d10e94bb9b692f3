"""Friction by a table, against SciPy's interpolation."""

import casadi as ca
import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline, PchipInterpolator

from symfric.laws import Table

SPEEDS = (0.0, 1e-3, 3e-3, 4e-3, 0.01, 0.1)
MU = (0.15, 0.16, 0.12, 0.1, 0.1, 0.2)


def test_table_is_the_monotone_cubic_of_its_points() -> None:
    slopes = PchipInterpolator(SPEEDS, MU).derivative()(SPEEDS)
    slopes[[0, -1]] = 0.0
    expected = CubicHermiteSpline(SPEEDS, MU, slopes)
    v = np.linspace(1e-3, 0.1, 1001)
    force = Table(SPEEDS, MU, v_eps=1e-6).force(v, 2.0)
    np.testing.assert_allclose(force, 2.0 * expected(v), rtol=1e-12)


def test_table_meets_its_points_and_is_constant_beyond() -> None:
    law = Table(SPEEDS, MU, v_eps=1e-6)
    np.testing.assert_allclose(law.force(-np.array(SPEEDS[1:]), 5.0), -5.0 * np.array(MU[1:]))
    assert law.force(7.0, 5.0) == pytest.approx(1.0, rel=1e-14)
    assert law.force(0.0, 5.0) == 0.0


def test_table_never_leaves_the_range_of_neighbouring_points() -> None:
    v = np.linspace(4e-3, 0.01, 101)
    np.testing.assert_allclose(Table(SPEEDS, MU, v_eps=1e-6).force(v, 1.0), 0.1, rtol=1e-12)
    falling = Table(SPEEDS, MU, v_eps=1e-6).force(np.linspace(1e-3, 4e-3, 1001), 1.0)
    assert np.diff(falling).max() <= 1e-15


@pytest.mark.parametrize("knot", SPEEDS[1:])
def test_table_has_one_continuous_derivative(knot: float) -> None:
    v = ca.SX.sym("v")
    slope = ca.Function("slope", [v], [ca.gradient(Table(SPEEDS, MU).force(v, 1.0), v)])
    sides = [float(slope(knot * (1 + s))) for s in (-1e-9, 0.0, 1e-9)]
    assert sides == pytest.approx([sides[1]] * 3, abs=1e-4)


@pytest.mark.parametrize(
    ("speeds", "coefficients", "message"),
    [
        ((0.0, 1.0), (0.1,), "got 2 speeds and 1 coefficients"),
        ((0.0,), (0.1,), "two or more, got 1 speeds"),
        ((0.0, 0.0), (0.1, 0.1), r"speeds: expected 0 <= rising numbers, got \(0.0, 0.0\)"),
        ((-1.0, 1.0), (0.1, 0.1), "speeds: expected 0 <= rising"),
        ((0.0, 1.0), (0.1, -0.1), "coefficients: expected numbers >= 0"),
        ((0.0, 1.0), (0.1, float("nan")), "coefficients: expected finite numbers, got nan at 1"),
    ],
)
def test_bad_table_is_refused(
    speeds: tuple[float, ...], coefficients: tuple[float, ...], message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        Table(speeds, coefficients)
