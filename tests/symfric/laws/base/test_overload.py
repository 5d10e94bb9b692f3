"""The power of a load share far above 1: that of the law where it can be told, bounded beyond."""

import casadi as ca
import numpy as np
import pytest

from symfric import HaessigFriedland, Law, MaxwellSlip, StickSlip
from symfric.laws.base import smooth

SHARES = np.concatenate([np.linspace(-3.0, 3.0, 8001), np.logspace(0.0, 18.0, 200)])
SHARP = [1.0, 3.0, 20.0, 50.0, 1000.0]


@pytest.mark.parametrize("n", SHARP)
def test_it_is_the_power_to_the_bit_up_to_its_bound(n: float) -> None:
    with np.errstate(over="ignore"):
        exact = smooth.power(SHARES, n, 1e-8)
    found = smooth.overload(SHARES, n, 1e-8)
    below = (1 + smooth.BACK ** (2 / n)) / 2 >= SHARES**2
    assert below.sum() > 1000
    assert (found[below] == exact[below]).all()
    assert found.max() < smooth.BACK * (1 + n / 2) * 1.01
    assert n == 1.0 or found[-1] == pytest.approx(smooth.BACK * (1 + n / 2))


@pytest.mark.parametrize("n", [3.0, 20.0, 50.0, 1000.0])
def test_its_slopes_are_numbers_everywhere(n: float) -> None:
    x = ca.SX.sym("x")
    value = smooth.overload(x, n, 1e-8)
    slopes = ca.Function("slopes", [x], [ca.jacobian(value, x), ca.hessian(value, x)[0]])
    edge = smooth.BACK ** (1 / n)
    for share in (0.0, 1.0, 0.9 * edge, edge, 1.1 * edge, 6.0, 1e6, 1e100):
        assert all(np.isfinite(float(slope)) for slope in slopes(share))
    assert float(slopes(1.0)[0]) == pytest.approx(n)
    near = edge * np.linspace(0.8, 1.2, 2001)  # a falling one would be a spring that explodes
    assert (slopes(near.reshape(1, -1))[0].full() >= 0.0).all()


LAWS = {"reset integrator": HaessigFriedland(), "maxwell": MaxwellSlip(), "stick-slip": StickSlip()}


@pytest.mark.parametrize("law", LAWS.values(), ids=list(LAWS))
def test_rates_are_numbers_in_float_after_a_load_has_fallen(law: Law) -> None:
    """|r|^50 at a sixth of the load is 8e38, beyond float."""
    one = np.float32
    for fallen in (2.0, 6.0, 100.0, 1e4):
        z = np.array([s for s in law.steady_state(1.0, 60.0)], np.float32).reshape(-1, 1)
        rates = law.rate(one(0.01), one(60.0 / fallen), z)
        assert np.isfinite(np.asarray(rates, np.float32)).all()
        assert (np.sign(rates) <= 0.0).all() or isinstance(law, StickSlip)
