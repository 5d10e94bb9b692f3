"""Smooth approximations: values and two derivatives at zero, and the originals as eps -> 0."""

from collections.abc import Callable
from math import e

import casadi as ca
import numpy as np
import pytest

from symfric import HaessigFriedland, Law, MaxwellSlip, StickSlip
from symfric.foundation.numeric import Scalar
from symfric.laws.base import smooth

EPS = 1e-3
AT_ZERO: dict[str, tuple[Callable[[ca.SX], ca.SX], float, float, float]] = {
    "sign": (lambda x: smooth.sign(x, EPS), 0.0, 1 / EPS, 0.0),
    "magnitude": (lambda x: smooth.magnitude(x, EPS), 0.0, 0.0, 2 / EPS),
    "power 2": (lambda x: smooth.power(x, 2.0, EPS), 0.0, 0.0, 2.0),
    "power 1": (lambda x: smooth.power(x, 1.0, EPS), 0.0, 0.0, 1 / EPS),
    "power 0.5": (lambda x: smooth.power(x, 0.5, EPS), 0.0, 0.0, 0.5 * EPS**-1.5),
    "signed_power 0.5": (lambda x: smooth.signed_power(x, 0.5, EPS), 0.0, EPS**-0.5, 0.0),
    "signed_power 2": (lambda x: smooth.signed_power(x, 2.0, EPS), 0.0, EPS, 0.0),
    "positive": (lambda x: smooth.positive(x, EPS), EPS / 2, 0.5, 0.5 / EPS),
    "stribeck 2": (lambda x: smooth.stribeck(x, 1.0, 2.0, EPS), 1.0, 0.0, -2.0),
    "stribeck 1": (lambda x: smooth.stribeck(x, 1.0, 1.0, EPS), 1.0, 0.0, -2 / EPS),
    "phi1": (smooth.phi1, 1.0, 1 / 2, 1 / 3),
}
TINY = [0.0, 1e-300, -1e-300, 1e-12, -1e-12, 1e-3, -1e-3, 1.0, -1.0, 1e3, -1e3]

each_block = pytest.mark.parametrize("name", AT_ZERO)


def with_derivatives(block: Callable[[ca.SX], ca.SX]) -> ca.Function:
    x = ca.SX.sym("x")
    second, first = ca.hessian(block(x), x)
    return ca.Function("block", [x], [block(x), first, second])


@each_block
def test_value_slope_and_curvature_at_zero(name: str) -> None:
    block, *expected = AT_ZERO[name]
    found = [float(result) for result in with_derivatives(block)(0.0)]
    assert found == pytest.approx(expected, rel=1e-12, abs=1e-15)


@each_block
@pytest.mark.parametrize("x", TINY)
def test_derivatives_are_finite_everywhere(name: str, x: float) -> None:
    if name == "phi1" and x == 1e3:
        x = 700.0  # beyond, exp itself overflows
    results = with_derivatives(AT_ZERO[name][0])(x)
    assert all(np.isfinite(float(result)) for result in results)


ORIGINALS: dict[str, tuple[Callable[[float, float], float], Callable[[float], float]]] = {
    "sign": (smooth.sign, lambda x: 1.0 if x > 0 else -1.0),
    "magnitude": (smooth.magnitude, abs),
    "power": (lambda x, eps: smooth.power(x, 1.5, eps), lambda x: abs(x) ** 1.5),
    "signed_power": (
        lambda x, eps: smooth.signed_power(x, 0.5, eps),
        lambda x: np.copysign(abs(x) ** 0.5, x),
    ),
    "positive": (smooth.positive, lambda x: max(x, 0.0)),
}


@pytest.mark.parametrize("name", ORIGINALS)
@pytest.mark.parametrize("x", [-0.3, -0.1, 0.1, 0.3])
def test_original_is_the_limit_of_small_widths(name: str, x: float) -> None:
    block, original = ORIGINALS[name]
    errors = [abs(block(x, eps) - original(x)) for eps in (1e-1, 1e-3, 1e-5)]
    assert errors[0] > errors[1] >= errors[2]
    assert errors[2] < 1e-7


@pytest.mark.parametrize("name", ["sign", "magnitude", "power", "positive"])
@pytest.mark.parametrize("x", [-2.0, 0.1])
def test_width_zero_is_the_original(name: str, x: float) -> None:
    block, original = ORIGINALS[name]
    assert block(x, 0.0) == original(x)
    assert float(block(ca.DM(x), 0.0)) == original(x)


@pytest.mark.parametrize(("width", "short"), [(2.65, 0.01), (20.0, 1e-15)])
def test_sign_and_magnitude_reach_the_original_at_the_stated_widths(
    width: float, short: float
) -> None:
    assert smooth.sign(width * EPS, EPS) == pytest.approx(1.0, abs=short)
    assert smooth.magnitude(width * EPS, EPS) == pytest.approx(width * EPS, rel=short)


@pytest.mark.parametrize("exponent", [0.5, 1.0, 2.0, 3.2])
def test_power_has_a_gradient_in_its_exponent_at_zero(exponent: float) -> None:
    n = ca.SX.sym("n")
    slope = ca.Function("slope", [n], [ca.gradient(smooth.power(0.0, n, EPS), n)])
    assert float(slope(exponent)) == pytest.approx(0.0, abs=1e-14)


@pytest.mark.parametrize("delta", [0.5, 1.0, 2.0, 3.2])
def test_stribeck_weight_falls_to_one_over_e_at_the_stribeck_velocity(delta: float) -> None:
    assert smooth.stribeck(3e-3, 3e-3, delta, 1e-12) == pytest.approx(1 / e, rel=1e-4)


def exact_phi1(x: float) -> float:
    """Extended precision: the power series near zero, (exp(x) - 1)/x elsewhere."""
    wide = np.longdouble(x)
    if abs(x) > 0.5:
        return float(np.expm1(wide) / wide)
    term = total = np.longdouble(1)
    for k in range(2, 30):
        term *= wide / k
        total += term
    return float(total)


@pytest.mark.parametrize(
    "x", [s * m for m in (1e-9, 9.9e-3, 1.01e-2, 0.3, 5.0, 50.0) for s in (1, -1)]
)
def test_phi1_is_accurate_on_both_sides_of_its_seam(x: float) -> None:
    assert smooth.phi1(x) == pytest.approx(exact_phi1(x), rel=3e-13)
    assert float(smooth.phi1(ca.DM(x))) == pytest.approx(exact_phi1(x), rel=3e-13)


def test_phi1_takes_arrays() -> None:
    x = np.array([-1.0, 0.0, 1.0])
    np.testing.assert_allclose(smooth.phi1(x), [1 - 1 / e, 1.0, e - 1], rtol=1e-15)


def test_positive_keeps_a_load_above_zero_down_to_the_stated_depth() -> None:
    assert smooth.positive(-1e7 * EPS, EPS) > 0
    assert smooth.positive(-1e9 * EPS, EPS) == 0


@pytest.mark.parametrize(("step", "order"), [(smooth.step3, 1), (smooth.step5, 2)])
@pytest.mark.parametrize("knot", [0.0, 1.0])
def test_step_is_as_smooth_at_its_knots_as_stated(
    step: Callable[[ca.SX], ca.SX], order: int, knot: float
) -> None:
    x = ca.SX.sym("x")
    derivatives = [step(x)]
    for _ in range(order + 1):
        derivatives.append(ca.gradient(derivatives[-1], x))
    f = ca.Function("f", [x], [ca.vertcat(*derivatives)])
    left, right = f(knot - 1e-9).full().ravel(), f(knot + 1e-9).full().ravel()
    assert right[: order + 1] == pytest.approx(left[: order + 1], abs=1e-6)
    assert abs(right[order + 1] - left[order + 1]) > 1


@pytest.mark.parametrize("step", [smooth.step3, smooth.step5])
def test_step_is_flat_outside_and_passes_the_middle(step: Callable[[Scalar], Scalar]) -> None:
    x = np.array([-2.0, 0.0, 0.5, 1.0, 3.0])
    np.testing.assert_allclose(step(x), [0.0, 0.0, 0.5, 1.0, 1.0], atol=1e-15)
    np.testing.assert_allclose(np.ravel(step(ca.DM(x)).full()), [0, 0, 0.5, 1, 1], atol=1e-15)


def test_choose_and_clip_take_numbers_arrays_and_matrices() -> None:
    assert smooth.choose(True, 1.0, 2.0) == 1.0
    assert float(smooth.choose(ca.DM(0), 1.0, 2.0)) == 2.0
    np.testing.assert_array_equal(smooth.clip(np.array([-3.0, 0.2, 3.0]), -1, 1), [-1, 0.2, 1])
    assert float(smooth.clip(ca.DM(3), -1, 1)) == 1.0


@pytest.mark.parametrize("x", [-1.79, -0.3, 0.0, 1e-300, 1.0, 1.8])
def test_hold_is_the_identity_below_its_corner(x: float) -> None:
    assert smooth.hold(x, 2.0, 0.2) == x


@pytest.mark.parametrize(("x", "top"), [(2.2, 2.0), (7.0, 2.0), (1e9, 2.0), (0.3, 0.1), (1.0, 0.0)])
def test_hold_is_constant_beyond_its_corner(x: float, top: float) -> None:
    assert smooth.hold(x, top, 0.2) == pytest.approx(top, abs=1e-15)
    assert smooth.hold(-x, top, 0.2) == pytest.approx(-top, abs=1e-15)


@pytest.mark.parametrize("knot", [1.8, 2.2, -1.8, -2.2])
def test_hold_has_two_continuous_derivatives(knot: float) -> None:
    block = with_derivatives(lambda x: smooth.hold(x, 2.0, 0.2))
    left, right = ([float(r) for r in block(knot + s)] for s in (-1e-9, 1e-9))
    assert left == pytest.approx(right, abs=1e-6)


def test_hold_never_leaves_its_limits_and_never_falls() -> None:
    x = np.linspace(-4.0, 4.0, 100_001)
    for top in (2.0, 0.1, 0.0):
        held = smooth.hold(x, top, 0.2)
        assert np.abs(held).max() <= top + 1e-15
        assert np.diff(held).min() >= -1e-15


@pytest.mark.parametrize("exponent", [0.78, 1.0, 3.2])
def test_stribeck_weight_of_width_zero_is_the_original(exponent: float) -> None:
    v_s = ca.SX.sym("v_s")
    weight = ca.Function("w", [v_s], [smooth.stribeck(-2e-3, v_s, exponent, 0.0)])
    assert float(weight(1e-3)) == pytest.approx(np.exp(-(2.0**exponent)), rel=1e-14)
    assert smooth.stribeck(0.0, 1e-3, exponent, 0.0) == 1.0


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
