"""Moves of a cart on a spring, and derivatives of optima by differences of re-solves."""

from collections.abc import Callable
from typing import Any

import casadi as ca
from phases import solve_once

from ocp import TIME, Free, Ipopt, Legendre, Phase, Problem, Radau, Shooting, integral
from ocp.transcription.schemes import Scheme
from symfric import Model, Variable

X, V, F = Variable("x", "m"), Variable("v", "m/s"), Variable("a", "N")
M, K = Variable("m", "kg", start=2.0), Variable("k", "N/m")
CART = Model(
    "cart", x=(X, V), u=(F,), p=(M, K),
    ode=ca.vertcat(V.symbol, (F.symbol - K.symbol * X.symbol) / M.symbol),
)  # fmt: skip
EFFORT = integral(lambda s: s.a**2)
SCHEMES = (Radau(3), Legendre(2), Shooting("rodas5p", 2))


def move(
    x: float = 0.0, v: float = 0.0, to: float = 1.0, T: float = 1.0, m: float = 2.0, k: float = 0.0,
    limit: float = 100.0,
) -> Problem:  # fmt: skip
    phase = Phase(CART, T, start={"x": x, "v": v}, end={"x": to, "v": 0.0}, p={"m": m, "k": k})
    return Problem(phase, EFFORT, bounds={"a": (-limit, limit)})


def fastest(m: float = 2.0, high: float = 10.0, low: float = -5.0) -> Problem:
    ends = {"x": 0.0, "v": 0.0}
    phase = Phase(CART, Free(0.1, 5.0), start=ends, end=ends | {"x": 1.0}, p={"m": m})
    return Problem(phase, TIME, bounds={"a": (low, high)})


def touching(l: float = 1 / 9) -> Problem:  # noqa: E741
    ends = {"x": 0.0, "v": 1.0}
    phase = Phase(CART, 1.0, start=ends, end=ends | {"v": -1.0}, p={"m": 1.0})
    return Problem(phase, integral(lambda s: s.a**2 / 2), bounds={"x": (None, l)})


def slope(
    make: Callable[..., Problem],
    name: str,
    value: float,
    N: int,
    scheme: Scheme,
    step: float = 1e-4,
) -> tuple[Any, dict[str, Any]]:
    """Return dJ*/dvalue and derivatives of times and signals by differences of re-solves."""
    h = step * (abs(value) or 1.0)
    high, low = (
        solve_once(make(**{name: value + d}), N, scheme, Ipopt(tol=1e-11)) for d in (h, -h)
    )
    signals = {n: (high[n] - low[n]) / (2 * h) for n in (*high.states, *high.inputs)}
    return (high.cost - low.cost) / (2 * h), signals | {"t": (high.t - low.t) / (2 * h)}


def there_and_back(T: float = 1.0) -> Problem:
    rest = {"x": 0.0, "v": 0.0}
    out = Phase(CART, T, start=rest, end={"x": 1.0}, p={"k": 5.0}, name="out")
    return Problem(out >> Phase(CART, 1.5, end=rest, p={"k": 5.0}, name="back"), EFFORT)
