"""Inputs of a model over time: constants, expressions, sampled signals."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, final

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike, NDArray

from symfric.foundation.parameters import check_names
from symfric.foundation.symbols import stacked
from symfric.model import Model, finite


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
        t, values = np.asarray(self.t, dtype=float), np.asarray(self.values, dtype=float)
        where = type(self).__name__
        if t.ndim != 1 or t.shape != values.shape or t.size < 1:
            raise ValueError(
                f"{where}: expected t and values of one length, got {t.shape} and {values.shape}"
            )
        if not (np.isfinite(t).all() and np.isfinite(values).all()):
            raise ValueError(f"{where}: expected finite samples, got NaN or infinity")
        if (np.diff(t) <= 0).any():
            k = int(np.argmax(np.diff(t) <= 0))
            raise ValueError(
                f"{where}: expected increasing times, got t[{k + 1}] = {t[k + 1]:g} "
                f"after t[{k}] = {t[k]:g}"
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
    given = dict(given or {})
    check_names(f"model '{model.name}' u", given, [v.name for v in model.u])
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
            signal = Hold([t_start], [finite(f"input '{variable.name}'", signal)])
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
            rows.append(ca.SX(signal(model.t)))
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


def _undriven(t_start: float, t_end: float) -> Drivers:
    """The drivers of a model without inputs."""
    return Drivers(stacked(()), stacked(()), np.array([t_start, t_end]), np.zeros((0, 1)), ())
