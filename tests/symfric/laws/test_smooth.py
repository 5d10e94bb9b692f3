"""Smooth approximations: values and two derivatives at zero, and continuity at knots of laws."""

import tomllib
from collections.abc import Callable
from itertools import product
from math import e, exp
from pathlib import Path
from re import findall

import casadi as ca
import numpy as np
import pytest
from law_cases import given_inputs, state_symbols

import symfric as sf
from symfric import ALL_LAWS, HaessigFriedland, Law, MaxwellSlip, StickSlip
from symfric.laws import GMS, Bristle2D, ElastoPlastic, Gonthier
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


def with_derivatives(block: Callable[[ca.SX], ca.SX]) -> ca.Function:
    x = ca.SX.sym("x")
    second, first = ca.hessian(block(x), x)
    return ca.Function("block", [x], [block(x), first, second])


def test_value_slope_and_curvature_are_known_at_zero_and_finite_everywhere() -> None:
    for name, (block, *expected) in AT_ZERO.items():
        f = with_derivatives(block)
        assert [float(y) for y in f(0.0)] == pytest.approx(expected, rel=1e-12, abs=1e-15), name
        largest = 700.0 if name == "phi1" else 1e3  # beyond, exp itself overflows
        for x in TINY:
            assert all(np.isfinite(float(y)) for y in f(min(x, largest))), (name, x)


def test_stribeck_weight_and_power_at_every_exponent() -> None:
    n, v_s = ca.SX.sym("n"), ca.SX.sym("v_s")
    slope = ca.Function("slope", [n], [ca.gradient(smooth.power(0.0, n, EPS), n)])
    for exponent in (0.5, 0.78, 1.0, 2.0, 3.2):
        assert float(slope(exponent)) == pytest.approx(0.0, abs=1e-14)
        assert smooth.stribeck(3e-3, 3e-3, exponent, 1e-12) == pytest.approx(1 / e, rel=1e-4)
        weight = ca.Function("w", [v_s], [smooth.stribeck(-2e-3, v_s, exponent, 0.0)])
        assert float(weight(1e-3)) == pytest.approx(np.exp(-(2.0**exponent)), rel=1e-14)
        assert smooth.stribeck(0.0, 1e-3, exponent, 0.0) == 1.0


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


def test_phi1_is_accurate_on_both_sides_of_its_seam() -> None:
    for x in (s * m for m in (1e-9, 9.9e-3, 1.01e-2, 0.3, 5.0, 50.0) for s in (1, -1)):
        assert smooth.phi1(x) == pytest.approx(exact_phi1(x), rel=3e-13)
        assert float(smooth.phi1(ca.DM(x))) == pytest.approx(exact_phi1(x), rel=3e-13)
    x = np.array([-1.0, 0.0, 1.0])
    np.testing.assert_allclose(smooth.phi1(x), [1 - 1 / e, 1.0, e - 1], rtol=1e-15)


SHARES = np.concatenate([np.linspace(-3.0, 3.0, 8001), np.logspace(0.0, 18.0, 200)])


def test_overload_is_the_power_to_the_bit_up_to_its_bound_and_rises_everywhere() -> None:
    for n in (1.0, 3.0, 20.0, 50.0, 1000.0):
        with np.errstate(over="ignore"):
            exact = smooth.power(SHARES, n, 1e-8)
        found = smooth.overload(SHARES, n, 1e-8)
        below = (1 + smooth.BACK ** (2 / n)) / 2 >= SHARES**2
        assert below.sum() > 1000
        assert (found[below] == exact[below]).all()
        assert found.max() < smooth.BACK * (1 + n / 2) * 1.01
        if n == 1.0:
            continue
        assert found[-1] == pytest.approx(smooth.BACK * (1 + n / 2))
        slopes = with_derivatives(lambda x, n=n: smooth.overload(x, n, 1e-8))
        edge = smooth.BACK ** (1 / n)
        for share in (0.0, 1.0, 0.9 * edge, edge, 1.1 * edge, 6.0, 1e6, 1e100):
            assert all(np.isfinite(float(y)) for y in slopes(share)[1:])
        assert float(slopes(1.0)[1]) == pytest.approx(n)
        near = edge * np.linspace(0.8, 1.2, 2001)  # a falling one would be a spring that explodes
        assert (slopes(near.reshape(1, -1))[1].full() >= 0.0).all()


def test_rates_are_numbers_in_float_after_a_load_has_fallen() -> None:
    """|r|^50 at a sixth of the load is 8e38, beyond float."""
    one, laws = np.float32, (HaessigFriedland(), MaxwellSlip(), StickSlip())
    for law, fallen in product(laws, (2.0, 6.0, 100.0, 1e4)):
        z = np.array([s for s in law.steady_state(1.0, 60.0)], np.float32).reshape(-1, 1)
        rates = law.rate(one(0.01), one(60.0 / fallen), z)
        assert np.isfinite(np.asarray(rates, np.float32)).all()
        assert (np.sign(rates) <= 0.0).all() or isinstance(law, StickSlip)


LAWS = {name: getattr(sf.laws, name) for name in sf.laws.__all__}
TABLE = tomllib.loads(Path(__file__).with_name("knots.toml").read_text(encoding="utf-8"))
FORMS: dict[str, tuple[Law, list[tuple[float, int]]]] = {
    text: (eval(text, LAWS), knots) for text, knots in TABLE.items()
}
"""Forms of laws and their knots: velocity [m/s] and number of continuous derivatives there."""


def derivatives(law: Law, scale: float, order: int) -> ca.Function:
    """Return force and derivatives up to `order` as a function of the velocity over `scale`."""
    x = ca.SX.sym("x")
    rows = [ca.SX(law.force(scale * x, 5.0, **given_inputs(law)))]
    for _ in range(order):
        rows.append(ca.gradient(rows[-1], x))
    return ca.Function("derivatives", [x], [ca.vertcat(*rows)])


def test_law_has_as_many_continuous_derivatives_at_its_knots_as_it_claims() -> None:
    step = 1e-9
    for name, (law, knots) in FORMS.items():
        scale = max(v for v, _ in knots) or 1e-3
        for v, k in knots:
            f = derivatives(law, scale, k + 1)
            for knot in {v / scale, -v / scale}:
                left, at, right = (f(knot + s).full().ravel() for s in (-step, 0.0, step))
                size = max(abs(left).max(), abs(right).max(), 1e-2)
                assert left[: k + 1] == pytest.approx(right[: k + 1], abs=1e-6 * size), name
                assert at[: k + 1] == pytest.approx(right[: k + 1], abs=1e-6 * size), name
                assert abs(left[k + 1] - right[k + 1]) > 1e-5 * size, name
        weakest, claim = min(k for _, k in knots), law.facts.smoothness
        if weakest < 0:
            assert "jump" in claim or "v_eps=0.0" in name
        elif name in ("Exudyn(mu_v=0.4)", f"{type(law).__name__}()"):
            assert claim.startswith(f"C{weakest} "), name
        else:
            assert f"C{weakest}" in findall(r"C\d", claim), name


def test_law_that_claims_all_derivatives_has_continuous_ones() -> None:
    points = np.array([*np.arange(-3.0, 3.1, 0.25), 10.0, -10.0, 100.0, -100.0])
    steps = 1e-9 * np.maximum(1.0, np.abs(points))
    for name, kind in ALL_LAWS.items():
        if kind().states or not kind.facts.smoothness.startswith("C∞"):
            continue
        f = derivatives(kind(), min(float(kind().velocity_scale), 1.0), 3)
        left, here, right = (f((points + s)[None, :]).full() for s in (-steps, 0.0, steps))
        size = np.abs(here).max(axis=1, keepdims=True) + 1e-9
        assert (np.abs([left - here, right - here]) <= 1e-4 * size).all(), name


def test_value_and_derivatives_of_every_form_are_finite_and_odd() -> None:
    extremes = np.array([0.0, 1e-300, 1e-12, 1e-6, 1e-3, 1.0, 1e3])
    for name, (law, _) in FORMS.items():
        x, inputs = ca.SX.sym("x"), given_inputs(law)
        given = {n: ca.SX.sym(n) for n in inputs}
        every = ca.vertcat(x, *given.values())
        F = ca.SX(law.force(x, 5.0, **given))
        hessian, gradient = ca.hessian(F, every)
        f = ca.Function("f", [every], [F, ca.vertcat(gradient, ca.vec(hessian))])
        points = np.vstack([extremes, *(np.full(extremes.shape, w) for w in inputs.values())])
        forwards, backwards = f(points), f(-points)
        assert all(part.is_regular() for part in (*forwards, *backwards)), name
        assert not law.facts.odd or (forwards[0].full() == -backwards[0].full()).all(), name


N, V = 8.0, 2e-3
G = N * (0.1 + 0.05 * exp(-4.0))
LEVEL, BENT = N * 0.1, 190.0 * V

KNOTS: list[tuple[Law, int, float, list[float], int]] = [
    (ElastoPlastic(z_ba=3e-6), 1, 3e-6, [0.0], 2),  # break-away
    (ElastoPlastic(z_ba=3e-6), 1, G / 1e5, [0.0], 2),  # full slip
    (GMS(), 1, 0.97 * G / 4, [0.0] * 4 + [0.5] * 4, 2),  # latch begins
    (GMS(), 1, G / 4, [0.0] * 4 + [0.5] * 4, 2),  # latched
    (GMS(), 1, 0.0, [0.0] * 4 + [0.5] * 4, 2),  # unloaded
    (GMS(), 1, -0.2 * G / 4, [0.0] * 4 + [0.5] * 4, 2),  # reversed
    (Gonthier(), 0, 1e-4, [0.0, 0.5], 1),  # full direction
    (HaessigFriedland(), 1, 0.95 * LEVEL / 1e5, [0.0], 2),  # excess begins to go
    (HaessigFriedland(), 1, LEVEL / 1e5, [0.0], 2),  # excess gone
    (StickSlip(), 0, 1e-3, [5e-7], 2),  # full slip
    (StickSlip(), 0, 1.5e-3, [5e-7], 2),  # dynamic level
    (Bristle2D(), 1, (0.98 * G - BENT) / 1e5, [0.0], 2),  # saturation begins
    (Bristle2D(), 1, (1.02 * G - BENT) / 1e5, [0.0], 2),  # saturated
]
"""Law, what varies (0 is v, 1 the first state), the knot, the states, continuous derivatives."""


def test_derivatives_of_laws_with_states_agree_on_both_sides_up_to_the_stated_order() -> None:
    for law, which, knot, states, order in KNOTS:
        v, z = ca.SX.sym("v"), state_symbols(law)
        x = v if which == 0 else z[0]
        rows = [ca.vertcat(law.force(v, N, z), law.rate(v, N, z))]
        for _ in range(order + 1):
            rows.append(ca.jacobian(rows[-1], x))
        f = ca.Function("f", [v, z], [ca.horzcat(*rows)])
        scale = abs(knot) or G / 4
        points = [knot - 1e-10 * scale, knot + 1e-10 * scale]
        at = [(p, states) if which == 0 else (V, [p, *states[1:]]) for p in points]
        left, right = (f(*point).full() * scale ** np.arange(order + 2) for point in at)
        size = np.abs(np.stack([left, right])).max(axis=(0, 2), keepdims=True)[0]
        gap = np.abs(right - left) / np.maximum(size, 1e-300)
        assert gap[:, : order + 1].max() < 1e-6, (law, knot)
        assert gap[:, order + 1].max() > 1e-3, (law, knot)
