"""Every law is as smooth as it says, where it says, and no smoother."""

import tomllib
from math import exp
from pathlib import Path
from re import findall

import casadi as ca
import numpy as np
import pytest
from law_cases import given_inputs, state_symbols

import symfric as sf
from symfric import ALL_LAWS, Law
from symfric.laws import GMS, Bristle2D, ElastoPlastic, Gonthier, HaessigFriedland, StickSlip

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
