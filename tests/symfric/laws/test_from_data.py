"""Friction curves from data: splines against SciPy, hull, passivity, limits, C, optimal moves."""

from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from scipy.interpolate import BSpline

import symfric as sf
from ocp import Phase, Problem, integral, solve
from symfric.codegen import generate, verify


def spline(c: list[float], shape: str = "free", low: float = 2e-3, high: float = 0.7) -> sf.Spline:
    return sf.Spline(tuple(sf.Level(x) for x in c), low, high, shape=shape)


def coordinate(v: np.ndarray, low: float, high: float, count: int) -> np.ndarray:
    return (count - 1) * np.log1p((v / low) ** 2) / np.log1p((high / low) ** 2)


def test_curve_is_the_spline_of_scipy_and_constant_beyond() -> None:
    rng = np.random.default_rng(1)
    v = np.geomspace(1e-9, 1e6, 400)
    for count in (3, 4, 7, 15):
        for low, high in ((2e-3, 0.7), (1e-9, 1e-6), (3.0, 5.0)):
            c = rng.uniform(0.0, 1.0, count)
            x = coordinate(v, low, high, count)
            control = np.concatenate([[c[0]] * 3, c, [c[-1]] * 60])
            curve = BSpline(np.arange(-5, control.size - 1), control, 3)
            expected = np.where(x < count, curve(np.minimum(x, count)), c[-1])
            found = spline(c.tolist(), low=low, high=high).coefficient(v)
            assert found == pytest.approx(expected, rel=1e-10)
            falls = np.append(c[:-1] - c[1:], c[-1])
            if (falls >= 0).all():
                assert spline(falls.tolist(), "falling", low, high).coefficient(v) == found


def test_curve_lies_between_its_coefficients_and_never_drives() -> None:
    """Exactly, also with coefficients at their bound zero and of very different sizes."""
    rng = np.random.default_rng(2)
    v = np.concatenate([[0.0], np.geomspace(1e-12, 1e3, 3000)])
    for _ in range(60):
        c = rng.choice([0.0, 1.0], 8) * 10 ** rng.uniform(-9, 3, 8)
        mu = np.asarray(spline(c.tolist()).coefficient(v))
        assert (mu >= c.min() * (1 - 1e-12)).all()
        assert (mu <= c.max() * (1 + 1e-12)).all()
        falling = np.asarray(spline(c.tolist(), "falling").coefficient(v))
        assert (falling >= 0).all()
        assert (np.diff(falling) <= 1e-12 * c.sum()).all()


def test_equal_coefficients_are_coulomb_and_the_force_is_linear_in_them() -> None:
    v = np.linspace(-2.0, 2.0, 501)
    coulomb = sf.Coulomb(0.3, v_eps=1e-4).force(v, 5.0)
    assert spline([0.3] * 6).force(v, 5.0) == pytest.approx(coulomb, rel=1e-13, abs=1e-15)
    for shape in ("free", "falling"):
        assert sf.Spline.over(1e-3, 1.0, 9, shape=shape).static_level(2.0) == pytest.approx(
            0.2 if shape == "free" else 0.2 * (1 - 1 / 54)
        )
    law, variables = sf.symbolise(sf.Spline(), *(f"c_{i}" for i in range(1, 7)))
    F = ca.SX(law.force(0.03, 1.0))
    symbols = ca.vertcat(*(x.symbol for x in variables))
    assert not ca.symvar(ca.jacobian(F, symbols))
    assert sf.Spline().static_level(7.0) == pytest.approx(7.0 * (5 * 0.15 + 0.14) / 6)


def test_network_never_drives_and_saturates() -> None:
    """For any weights within the bounds; mu is between b and b + sum of w_k."""
    rng = np.random.default_rng(3)
    v = np.concatenate([[0.0], np.geomspace(1e-12, 1e9, 2000)])
    for _ in range(60):
        w = rng.choice([0.0, 1.0], 4) * 10 ** rng.uniform(-9, 3, 4)
        a, s, b = rng.uniform(-30, 30, 4), rng.uniform(-0.2, 1.2, 4), rng.choice([0.0, 0.1])
        neurons = tuple(sf.Neuron(*row) for row in np.column_stack([w, a, s]).tolist())
        mu = np.asarray(sf.Network(neurons, b).coefficient(v))
        assert (mu >= 0).all()
        assert (mu >= b * (1 - 1e-12)).all()
        assert (mu <= (b + w.sum()) * (1 + 1e-12)).all()
    one = sf.Network.over(2e-3, 0.5, 1)
    assert one.coefficient(0.5) == pytest.approx(0.1 + 0.01)  # a pair of opposite steps
    assert one.weights == ("a_1", "s_1", "a_2", "s_2")


@pytest.mark.heavy
def test_c_of_a_curve_is_the_same(tmp_path: Path) -> None:
    for law in (sf.Spline(), sf.Network()):
        made = generate(law, tmp_path / type(law).__name__, real="double")
        assert verify(made).status == "verified"


def test_an_optimal_move_with_a_fitted_curve_is_verified() -> None:
    stage = sf.drive(spline([3.0, 2.4, 1.8, 1.6, 1.7, 2.2], high=2.0), m=1.0, N=1.0)
    phase = Phase(stage, 1.0, start={"x": 0.0, "v": 0.0}, end={"x": 0.5, "v": 0.0})
    move = solve(Problem(phase, integral(lambda s: s.force**2)))
    assert move.verified
