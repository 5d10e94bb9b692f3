"""Exact derivatives are the limit of difference quotients, which approach it with order two."""

from functools import cache

import casadi as ca
import numpy as np
import pytest
from law_cases import CASES, symbolic

POINTS = [(name, i) for name in CASES for i in range(len(symbolic(name)[0]))]
V, SHARE = 7e-4, 0.6


@cache
def force_rate_and_gradient(name: str) -> ca.Function:
    _, symbols, outputs, _ = symbolic(name)
    return ca.Function("f", [symbols], [outputs, ca.jacobian(outputs, symbols)])


def expansion_point(name: str) -> np.ndarray:
    """Sliding near the Stribeck velocity with a bent bristle and every parameter off zero."""
    names, _, _, values = symbolic(name)
    law = CASES[name]
    z = SHARE * np.asarray(law.steady_state(1.0, 7.848)).ravel()
    nominal = np.array([state.nominal for state in law.states])
    z = np.where(np.abs(z) > 1e-6 * nominal, z, 0.3 * nominal)
    off_zero = {n: x if x else 0.3 for n, x in values.items()}
    # at 1e-9 m/s the smoothing has long saturated: compare where it bends
    smoothing = {n: 5e-4 for n in values if n.startswith("v_e")}
    return np.array([V, *z, *((off_zero | smoothing)[n] for n in names[1 + z.size :])])


@pytest.mark.parametrize("name", CASES)
def test_difference_quotient_approaches_the_gradient_with_order_two(name: str) -> None:
    for i in range(len(symbolic(name)[0])):
        quotients_approach_the_gradient_by(name, i)


def quotients_approach_the_gradient_by(name: str, i: int) -> None:
    f, x = force_rate_and_gradient(name), expansion_point(name)
    exact = f(x)[1].full()[:, i]
    errors: list[np.ndarray] = []
    for h in 0.04 * abs(x[i]) * np.array([1.0, 0.5, 0.25]):
        step = np.zeros(x.size)
        step[i] = h
        errors.append((f(x + step)[0] - f(x - step)[0]).full().ravel() / (2 * h) - exact)
    rounding = 1e-9 * np.abs(f(x)[0].full().ravel()) / abs(x[i])
    for e in np.transpose(errors)[np.abs(errors[0]) > rounding]:
        assert e[0] / e[1] == pytest.approx(4.0, abs=0.3)
        assert e[1] / e[2] == pytest.approx(4.0, abs=0.3)


def test_many_derivatives_have_an_error_whose_ratio_is_seen() -> None:
    """Parameters that enter linearly leave nothing to compare beyond equality."""
    bent = 0
    for name, i in POINTS:
        f, x = force_rate_and_gradient(name), expansion_point(name)
        step = np.zeros(x.size)
        step[i] = 0.04 * abs(x[i])
        quotient = (f(x + step)[0] - f(x - step)[0]).full().ravel() / (2 * step[i])
        error = np.abs(quotient - f(x)[1].full()[:, i])
        bent += bool((error > 1e-9 * np.abs(f(x)[0].full().ravel()) / abs(x[i])).any())
    assert bent >= len(POINTS) * 2 // 5
