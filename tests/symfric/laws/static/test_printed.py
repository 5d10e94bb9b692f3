"""Every static law computes the equation that it prints, over decades of all its parameters.

Where the equation holds |v|, the law may differ by 1e-4 of what falls; elsewhere by rounding.
"""

from dataclasses import replace
from types import SimpleNamespace

import casadi as ca
import numpy as np
import pytest
from printed_laws import SMOOTH

from symfric import ALL_LAWS, Law, Stribeck, parameters, with_values

ORIGINAL = {"hollars": {"u_eps": 0.0}, "exudyn": {"u_eps": 0.0}}
"""Laws whose equation is printed for the float 0 of a width."""

OTHERS = {
    *("karnopp", "awrejcewicz", "quarter_car_general", "wojewoda", "bam"),  # take further inputs
    "exact_coulomb",  # a law with a mode
}
"""Static laws that need more than v and N; `test_golden` compares them."""


def drawn(law: Law, rng: np.random.Generator) -> Law:
    """The law at numbers over decades of their defaults, in the order that it asks for."""
    values: dict[str, float] = {}
    for name, p in parameters(law).items():
        if name in ("u_eps",):
            continue
        default = float(p.value) or {"viscous": 0.3, "shape": 0.4}.get(p.role, 0.0)
        if p.role in ("shape", "temperature", "geometry") and np.isfinite(p.upper):
            low = max(p.lower, 0.0 if p.role == "temperature" else -1.0)
            values[name] = float(rng.uniform(low, p.upper))
        else:
            values[name] = abs(default) * 10 ** float(rng.uniform(-2, 2))
    for low, high in (*law.ordered, *law.strictly_ordered):
        if values[low] > values[high]:
            values[low], values[high] = values[high], values[low]
    return with_values(law, values)


def cases(count: int, seed: int) -> list[tuple[str, Law, float, float]]:
    rng = np.random.default_rng(seed)
    found: list[tuple[str, Law, float, float]] = []
    for name in SMOOTH:
        for _ in range(count):
            law = drawn(replace(ALL_LAWS[name](), **ORIGINAL.get(name, {})), rng)
            scales = [float(p.value) for p in parameters(law).values() if p.unit == "m/s"]
            v = (rng.choice(scales) if scales else 1e-3) * 10 ** rng.uniform(-5, 3)
            found.append((name, law, float(v), float(10 ** rng.uniform(-2, 3))))
    return found


def test_an_equation_stands_for_every_static_law() -> None:
    static = {name for name, kind in ALL_LAWS.items() if not kind().states}
    assert static - set(SMOOTH) <= OTHERS
    assert set(SMOOTH) <= static


def worst(count: int, seed: int) -> list[str]:
    wrong: list[str] = []
    for name, law, v, N in cases(count, seed):
        p = SimpleNamespace(**{n: float(x.value) for n, x in parameters(law).items()})
        expected, found = SMOOTH[name](p, v, N), float(law.force(v, N))
        falls = abs(float(law.static_level(N)))
        if abs(found - expected) > 1e-9 * abs(expected) + 1e-4 * falls * (found != expected):
            wrong.append(f"{law} at v = {v:g}, N = {N:g}: {found:g}, printed {expected:g}")
    return wrong


def test_force_is_the_printed_equation_at_any_numbers() -> None:
    assert worst(40, seed=1) == []


@pytest.mark.slow
def test_force_is_the_printed_equation_at_many_numbers() -> None:
    assert worst(4000, seed=2) == []


DELTAS = (0.1, 0.2, 0.35, 0.5, 0.7, 0.78, 1.0, 1.3, 1.7, 2.0, 2.5, 3.2, 5.0, 10.0)


@pytest.mark.parametrize("delta", DELTAS)
def test_stribeck_differs_from_its_equation_by_less_than_it_says(delta: float) -> None:
    """At every speed, for v_eps from far below to far above v_s."""
    for v_s in (1e-9, 1e-3, 20.0):
        for ratio in (1e-8, 1e-4, 1e-2, 0.09, 0.5, 3.0, 1e4):
            law = Stribeck(mu_s=0.4, mu_d=0.1, v_s=v_s, delta=delta, v_eps=ratio * v_s)
            v = v_s * np.concatenate(
                [np.geomspace(1e-14, 1e3, 2000), ratio * np.geomspace(1e-7, 9, 999)]
            )
            with np.errstate(over="ignore"):
                printed = (0.1 + 0.3 * np.exp(-((v / v_s) ** delta))) * np.tanh(v / law.v_eps)
            error = np.abs(law.force(v, 5.0) - 5.0 * printed)
            assert error.max() < 1e-4 * 0.3 * 5.0
            if delta >= 0.7 and ratio < 1:
                assert (error / (5.0 * printed)).max() < 1e-3


@pytest.mark.parametrize("delta", DELTAS)
def test_derivatives_of_stribeck_stay_finite_at_every_exponent(delta: float) -> None:
    v, d = ca.SX.sym("v"), ca.SX.sym("d")
    for v_s, v_eps in ((1e-3, 1e-4), (1e-9, 1e-15), (20.0, 2.0)):
        F = Stribeck(delta=d, v_s=v_s, v_eps=v_eps).force(v, 5.0)
        hessian, gradient = ca.hessian(F, ca.vertcat(v, d))
        f = ca.Function("f", [v, d], [F, gradient, hessian])
        for speed in (0.0, 1e-300, 1e-20, 1e-12, 1e-6, 1e-3, 1.0, 1e3):
            assert all(part.is_regular() for part in f(speed * v_s, delta)), (v_s, speed)
