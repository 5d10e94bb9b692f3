"""Inputs of a model over time: constants, expressions, sampled signals."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, final

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike, NDArray

from symfric.foundation import checks
from symfric.foundation.symbols import stacked, strays
from symfric.model import Model


@dataclass(frozen=True, eq=False)
class Sampled:
    """A signal given by samples: polynomial between the sample times, of degree 0 or 1.

    Attributes:
        t: increasing sample times [s], shape (n,).
        values: samples, shape (n,).

    Before the first and after the last sample the end value holds.
    """

    t: ArrayLike
    values: ArrayLike

    def __post_init__(self) -> None:
        where = type(self).__name__
        t = checks.times(f"{where}: t", self.t)
        values = checks.array(f"{where}: values", self.values)
        if t.size != values.size:
            raise ValueError(
                f"{where}: expected a value for every time, got {t.size} times "
                f"and {values.size} values"
            )
        object.__setattr__(self, "t", t)
        object.__setattr__(self, "values", values)

    def coefficients(self, breaks: NDArray[np.float64]) -> NDArray[np.float64]:
        """Value and slope at the start of each interval between `breaks`, shape (2, n - 1)."""
        raise NotImplementedError


@final
@dataclass(frozen=True, eq=False)
class Hold(Sampled):
    """Zero-order hold: `values[k]` from t[k] until t[k+1], as a digital controller puts it out."""

    def coefficients(self, breaks: NDArray[np.float64]) -> NDArray[np.float64]:
        """Value at the start of each interval; slope 0."""
        t, values = np.asarray(self.t), np.asarray(self.values)
        middle = (breaks[:-1] + breaks[1:]) / 2
        index = np.clip(np.searchsorted(t, middle, side="right") - 1, 0, t.size - 1)
        return np.vstack([values[index], np.zeros(index.size)])


@final
@dataclass(frozen=True, eq=False)
class Linear(Sampled):
    """Linear interpolation between the samples, as for a measured signal."""

    def coefficients(self, breaks: NDArray[np.float64]) -> NDArray[np.float64]:
        """Value and slope at the start of each interval."""
        ends = np.interp(breaks, np.asarray(self.t), np.asarray(self.values))
        return np.vstack([ends[:-1], np.diff(ends) / np.diff(breaks)])


KINDS = "an input is a number, Hold or Linear samples, or a function of the symbolic time"

Input = float | Sampled | Callable[[ca.SX], Any]
"""A constant, samples, or a function of the symbolic time that returns an expression."""


@dataclass(frozen=True, eq=False)
class Drivers:
    """How the inputs of one simulation enter its equations.

    Attributes:
        expression: SX (nu, 1), the inputs in terms of `t` and `data`.
        data: SX symbols that are constant on each interval.
        breaks: interval ends in [t_start, t_end], shape (n + 1,).
        values: `data` on each interval, shape (n_data, n).
        key: the structure; two drivers of a model with one key have the same equations.
    """

    expression: ca.SX
    data: ca.SX
    breaks: NDArray[np.float64]
    values: NDArray[np.float64]
    key: tuple[object, ...]

    def interval(self, times: NDArray[np.float64]) -> NDArray[np.intp]:
        """Number of the interval that holds each time; at a break the later one."""
        return np.searchsorted(self.breaks[1:-1], times, side="right")


def drivers(
    model: Model, given: Mapping[str, Input] | None, t_start: float, t_end: float
) -> Drivers:
    """Collect the inputs `given` by name; the others keep their start value.

    Numbers and samples become data, expressions go into the equations.

    Raises:
        ValueError: unknown name or a value of another kind.
    """
    if not model.u and not given:
        return _undriven(t_start, t_end)
    given = model.named("u", given)
    sampled = {name: s for name, s in given.items() if isinstance(s, Sampled)}
    inner = np.concatenate([np.asarray(s.t) for s in sampled.values()] or [np.zeros(0)])
    inner = inner[(inner > t_start) & (inner < t_end)]
    breaks = np.unique(np.concatenate([[t_start], inner, [t_end]]))
    rows: list[ca.SX] = []
    symbols: list[ca.SX] = []
    values: list[NDArray[np.float64]] = []
    start = ca.SX.sym("t_k")
    key: list[object] = []
    for variable in model.u:
        signal = given.get(variable.name, variable.start)
        if not callable(signal) and not isinstance(signal, Sampled):
            # a number is data too: another value must not mean another integrator
            number = checks.number(f"input '{variable.name}'", signal, hint=KINDS)
            signal = Hold([t_start], [number])
        if isinstance(signal, Sampled):
            c, slope = ca.SX.sym(f"{variable.name}_k"), ca.SX.sym(f"{variable.name}_dot")
            value, rise = signal.coefficients(breaks)
            symbols, values = [*symbols, c], [*values, value]
            key.append("linear" if rise.any() else "hold")
            if rise.any():
                rows.append(c + slope * (model.t - start))
                symbols, values = [*symbols, slope], [*values, rise]
            else:
                rows.append(c)
        else:
            rows.append(_expression(variable.name, signal, model.t))
            key.append(signal)
    expression = stacked(rows)
    if ca.depends_on(expression, start):
        symbols, values = [*symbols, start], [*values, breaks[:-1]]
    return Drivers(
        expression,
        stacked(symbols),
        breaks,
        np.vstack(values) if values else np.zeros((0, breaks.size - 1)),
        tuple(key),
    )


def _expression(name: str, signal: Callable[[ca.SX], Any], t: ca.SX) -> ca.SX:
    """What the function `signal` makes of the symbolic time."""
    where, what = f"input '{name}'", "a function of the symbolic time that returns one expression"
    hint = (
        "write casadi.sin(t) for math.sin(t), casadi.if_else(t > 1, a, b) for a Python if, "
        "and samples as Linear(t, values)"
    )
    if isinstance(signal, type):
        raise checks.refused(where, what, signal, KINDS)
    try:
        made = signal(t)
    except (TypeError, ArithmeticError, RuntimeError, NotImplementedError) as error:
        reason = (str(error).strip().splitlines() or [""])[0].rpartition(".cpp:")[2]
        said = f"{type(error).__name__} ({reason.lstrip('0123456789: ')})"
        raise ValueError(f"{where}: expected {what}, got {said}; {hint}") from error
    number = checks.as_number(made)
    if number is not None and not np.isfinite(number):
        raise ValueError(f"{where}: expected {what}, got {number}; {hint}")
    if number is None and not (isinstance(made, ca.SX) and made.is_scalar()):
        raise checks.refused(where, what, made, hint)
    expression = ca.SX(made)
    if other := strays(expression, t):
        raise ValueError(f"{where}: expected an expression in time alone, got {', '.join(other)}")
    return expression


def _undriven(t_start: float, t_end: float) -> Drivers:
    """The drivers of a model without inputs."""
    return Drivers(stacked(()), stacked(()), np.array([t_start, t_end]), np.zeros((0, 1)), ())
