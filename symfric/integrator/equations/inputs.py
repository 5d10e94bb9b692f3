"""Inputs of a model over time: constants, expressions and sampled signals, and their rates."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from hashlib import sha256
from typing import Any, NamedTuple, final

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike, NDArray

from symfric.foundation import checks
from symfric.foundation.numeric import Array, is_number
from symfric.foundation.parameters import Variable
from symfric.foundation.shown import brief
from symfric.foundation.variable import stacked, strays
from symfric.integrator.equations.expressions import Pieces, lifted, pieces
from symfric.model import Model

RAMP = "linear"
"""Structure of an input that is linear in time on each interval."""
NO_ROWS = ca.SX(0, 1)
"""Empty column, created once."""


@dataclass(frozen=True, eq=False)
class Sampled:
    """Signal given by samples, with a polynomial of degree 0 or 1 between the sample times.

    Attributes:
        t: increasing sample times [s], shape (n,).
        values: samples, shape (n,); (members, n) for an ensemble with different samples per member.

    Both arrays are copied and read-only. Before the first sample and after the last one the signal
    is constant.
    """

    t: ArrayLike
    values: ArrayLike

    __repr__ = brief

    def __post_init__(self) -> None:
        where = type(self).__name__
        t = checks.times(f"{where}: t", self.t)
        what = "a sequence of numbers, or a matrix with a row for each member"
        values = checks.array(f"{where}: values", self.values, ndim=None, what=what)
        if values.ndim not in (1, 2):
            raise checks.refused(f"{where}: values", what, self.values)
        if t.size != values.shape[-1]:
            raise ValueError(
                f"{where}: expected a value for every time, got {t.size} times "
                f"and {values.shape[-1]} values"
            )
        for name, samples in (("t", t.copy()), ("values", values.copy())):
            samples.flags.writeable = False
            object.__setattr__(self, name, samples)

    @property
    def rows(self) -> int | None:
        """Number of members with their own samples; None for a single signal."""
        return np.shape(self.values)[0] if np.ndim(self.values) == 2 else None

    def coefficients(self, breaks: Array) -> Array:
        """Return value and slope at the start of each interval, shape (2, ..., len(breaks) - 1)."""
        raise NotImplementedError


@final
@dataclass(frozen=True, eq=False, repr=False)
class Hold(Sampled):
    """Zero-order hold, like the output of a digital controller: `values[k]` from t[k] to t[k+1]."""

    def coefficients(self, breaks: Array) -> Array:
        """Return the value at the start of each interval; slope 0."""
        t, values = np.asarray(self.t), np.asarray(self.values)
        middle = (breaks[:-1] + breaks[1:]) / 2
        index = np.clip(np.searchsorted(t, middle, side="right") - 1, 0, t.size - 1)
        held = values[..., index]
        return np.stack([held, np.zeros_like(held)])


@final
@dataclass(frozen=True, eq=False, repr=False)
class Linear(Sampled):
    """Linear interpolation between the samples, as for a measured signal."""

    def coefficients(self, breaks: Array) -> Array:
        """Return the value and the slope at the start of each interval."""
        t, values = np.asarray(self.t), np.asarray(self.values)
        ends = np.array([np.interp(breaks, t, row) for row in np.atleast_2d(values)])
        ends = ends if values.ndim == 2 else ends[0]
        return np.stack([ends[..., :-1], np.diff(ends) / np.diff(breaks)])


KINDS = "an input is a number, Hold or Linear samples, or a function of the symbolic time"

Input = float | Sampled | Callable[[ca.SX], Any]
"""Constant, samples, or a function of the symbolic time that returns an expression."""


@dataclass(frozen=True, eq=False)
class InputData:
    """Inputs of one simulation in terms of time and data.

    Attributes:
        expression: SX (nu, 1), the inputs in terms of `t` and `data`.
        data: SX symbols that are constant on each interval.
        breaks: interval ends in [t_start, t_end], shape (n + 1,).
        values: `data` on each interval, shape (n_data, n).
        key: structure; inputs of one model with equal keys have the same equations.
        pace: length [s] of the shortest nearly linear pieces of functions of time, or inf.
    """

    expression: ca.SX
    data: ca.SX
    breaks: Array
    values: Array
    key: tuple[str, ...]
    pace: float = np.inf

    @cached_property
    def span(self) -> tuple[float, float]:
        """First and last time [s]."""
        return float(self.breaks[0]), float(self.breaks[-1])

    def interval(self, times: Array) -> NDArray[np.intp]:
        """Return the index of the interval of each time; at a break, that of the later interval."""
        return np.searchsorted(self.breaks[1:-1], times, side="right")

    def stopping_at(self, times: ArrayLike) -> InputData:
        """Return the same inputs with additional breaks at `times` [s] inside the span."""
        at = np.asarray(times, dtype=float)
        at = at[(at > self.breaks[0]) & (at < self.breaks[-1])]
        if not at.size:
            return self
        breaks = np.union1d(self.breaks, at)
        return replace(self, breaks=breaks, values=self.values[:, self.interval(breaks[:-1])])


def input_data(
    model: Model, given: Mapping[str, Input] | None, t_start: float, t_end: float
) -> InputData:
    """Collect the inputs `given` by name; the other inputs keep their start values.

    Numbers and samples become data. Expressions become part of the equations, with their numbers as
    data. Breaks are at all sample times and at discontinuities of functions of time.

    Raises:
        ValueError: unknown name, or a value of an unsupported type.
    """
    if not model.u and not given:
        return _undriven(t_start, t_end)
    signals = model.named("u", given)
    breaks = np.array([t_start, t_end])
    if times := [np.asarray(s.t) for s in signals.values() if isinstance(s, Sampled)]:
        inner = np.concatenate(times)
        breaks = np.unique(np.append(breaks, inner[(inner > t_start) & (inner < t_end)]))
    begin = ca.SX.sym("t_k")
    parts = [_part(model, v, signals.get(v.name, v.start), breaks, begin) for v in model.u]
    values = [row for part in parts for row in part.values]
    data = [symbols for part in parts for symbols in part.data]
    if any(part.key == RAMP for part in parts):
        values, data = [*values, breaks[:-1]], [*data, begin]
    found = InputData(
        stacked(part.expression for part in parts),
        stacked(data),
        breaks,
        np.vstack(values) if values else np.zeros((0, breaks.size - 1)),
        tuple(part.key for part in parts),
        min((part.pieces.pace for part in parts), default=np.inf),
    )
    onsets = [t for part in parts for t in part.pieces.onsets]
    return found.stopping_at(onsets) if onsets else found


def paced(inputs: InputData, model: Model) -> InputData:
    """Return the same inputs with breaks at discontinuities of functions of time in the model.

    An example is the ramp of a road. The discontinuities are those at zero states and inputs, with
    parameters at their start values.
    """
    if (rows := model.memory.get("rows of time")) is None:
        of_time = np.flatnonzero(ca.which_depends(model.residual, model.t, 1, True)).tolist()
        others = ca.vertcat(model.xdot, *(model.vector(letter) for letter in "xzup"))
        still = ca.DM.zeros(others.numel())
        still[others.numel() - len(model.p) :] = model.values("p")
        frozen = ca.substitute(model.residual[of_time], others, ca.SX(still))
        rows = tuple(ca.SX.serialize(row) for row in ca.vertsplit(frozen)) if of_time else ()
        model.memory["rows of time"] = rows
    times = [t for row in rows for t in pieces(row, *inputs.span).onsets]
    return inputs.stopping_at(times) if times else inputs


@lru_cache
def _undriven(t_start: float, t_end: float) -> InputData:
    """Return the input data of a model without inputs."""
    return InputData(NO_ROWS, NO_ROWS, np.array([t_start, t_end]), np.zeros((0, 1)), ())


class _InputPart(NamedTuple):
    """Expression and data of one input.

    Attributes:
        key: structure of the input.
        expression: in terms of time and data; a `RAMP` counts time from the start of an interval.
        data: symbols, scalars or columns.
        values: values of the data on each interval.
        pieces: nearly linear pieces of a function of time.
    """

    key: str
    expression: ca.SX
    data: tuple[ca.SX, ...]
    values: tuple[Array, ...]
    pieces: Pieces = Pieces()


def _part(model: Model, variable: Variable, signal: Any, breaks: Array, begin: ca.SX) -> _InputPart:
    """Return expression and data of the input `variable`; `begin` is the start of an interval."""
    where, name = f"input '{variable.name}'", variable.name
    held = ca.SX.sym(f"{name}_k")
    if isinstance(signal, Sampled):
        if signal.rows is not None:
            raise ValueError(
                f"{where}: expected samples of one signal, got samples of {signal.rows} members, "
                "use these with simulate_many"
            )
        value, rise = signal.coefficients(breaks)
        if not rise.any():
            return _InputPart("hold", held, (held,), (value,))
        slope = ca.SX.sym(f"{name}_dot")
        return _InputPart(RAMP, held + slope * (model.t - begin), (held, slope), (value, rise))
    if not callable(signal):
        # numbers are data, so that a new value does not require a new integrator
        number = checks.number(where, signal, hint=KINDS)
        return _InputPart("hold", held, (held,), (np.full(breaks.size - 1, number),))
    others = stacked(model.vector(letter) for letter in "xzp")
    expression = _evaluated(where, signal, model, ca.vertcat(model.t, others))
    of_time = ca.substitute(expression, others, ca.SX.zeros(others.numel()))
    made, data, numbers = lifted(expression, ca.vertcat(model.t, others), name)
    # the key is the structure of the expression, not the Python function, whose variables may have
    # changed since the last call; numbers are data
    key = sha256(ca.SX.serialize(made).encode()).hexdigest()
    values = tuple(np.full(breaks.size - 1, number) for number in numbers)
    found = pieces(ca.SX.serialize(of_time), float(breaks[0]), float(breaks[-1]))
    return _InputPart(key, made, (data,), values, found)


def _evaluated(where: str, signal: Callable[[ca.SX], Any], model: Model, known: ca.SX) -> ca.SX:
    """Return the expression of the function `signal` at the symbolic time, in `known` symbols."""
    what = "a function of the symbolic time that returns one expression"
    hint = (
        "write casadi.sin(t) for math.sin(t), casadi.if_else(t > 1, a, b) for a Python if, "
        "and samples as Linear(t, values)"
    )
    if isinstance(signal, type):
        raise checks.refused(where, what, signal, KINDS)
    try:
        made = signal(model.t)
    except (TypeError, ArithmeticError, LookupError, AttributeError, RuntimeError) as error:
        reason = (str(error).strip().splitlines() or [""])[0].rpartition(".cpp:")[2]
        failed = f"{type(error).__name__} ({reason.lstrip('0123456789: ')})"
        raise ValueError(f"{where}: expected {what}, got {failed}; {hint}") from error
    number = checks.as_number(made)
    if number is not None and not np.isfinite(number):
        raise ValueError(f"{where}: expected {what}, got {number}; {hint}")
    if number is None and not (isinstance(made, ca.SX) and made.is_scalar()):
        raise checks.refused(where, what, made, hint)
    if other := strays(made, known):
        raise ValueError(f"{where}: expected an expression in time alone, got {', '.join(other)}")
    return ca.SX(made)


def rate_of(signal: Input) -> Input:
    """Return the time derivative of an input, exact for the interpolated signal.

    A number has the rate 0, and a function its derivative. The rate of `Linear` samples is a `Hold`
    of the slopes between them, with 0 before the first and after the last sample.

    Raises:
        ValueError: `Hold` samples, which jump, or a value that is not an input.
    """
    if isinstance(signal, Linear):
        t, values = np.asarray(signal.t), np.asarray(signal.values)
        if t.size < 2:
            return 0.0
        slopes = np.diff(values) / np.diff(t)
        still = np.zeros((*values.shape[:-1], 1))
        before = t[0] - (t[1] - t[0])
        return Hold(np.r_[before, t], np.concatenate([still, slopes, still], axis=-1))
    if isinstance(signal, Sampled):
        raise ValueError(
            "rate_of: expected a signal without jumps, got Hold samples; Linear(t, values) is "
            "linear between samples"
        )
    if is_number(signal):
        return 0.0
    function = checks.function("rate_of", signal, KINDS)

    def rate(t: ca.SX) -> ca.SX:
        return ca.jtimes(ca.SX(function(t)), t, ca.SX(1))

    return rate
