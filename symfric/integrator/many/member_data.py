"""Data of the members of an ensemble: start values, parameters, inputs and end times."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, final

import numpy as np
from numpy.typing import ArrayLike

from symfric.foundation import checks
from symfric.foundation.numeric import Array
from symfric.integrator.equations.initial import first_guess
from symfric.integrator.equations.inputs import Hold, Input, InputData, Sampled, input_data, paced
from symfric.integrator.equations.system import System
from symfric.model import Model

Values = dict[str, Array]
MemberInput = Input | ArrayLike
"""Input as in `simulate`, or an array of numbers or samples (members, n), one row per member."""
WHERE = "simulate_many"


@final
@dataclass(frozen=True, eq=False)
class MemberData:
    """Data of all members of an ensemble.

    Attributes:
        model: equations of the members.
        count: number of members.
        x0, p: start values and parameters by name, shape (count,).
        inputs: inputs common to all members; where members differ, those of one member.
        own: input that differs between members -> its signals, shape (count, n).
        sampled: ends of the intervals between samples [s].
        ends: end time of each member [s], shape (count,).
        varied: values given as arrays, shape (count,), by name: a parameter, "x0.v", "u.force" or
            "t_end". Samples of an input are not included.
        fixed: values given as one number for all members, by the same names.
    """

    model: Model
    count: int
    x0: Values
    p: Values
    inputs: InputData
    own: dict[str, Sampled]
    sampled: Array
    ends: Array
    varied: Values
    fixed: dict[str, float]

    def starts(self, system: System, pick: slice) -> tuple[Array, Array]:
        """Return start values of the unknowns (members, n) and the parameters.

        The values of algebraic unknowns are guesses.
        """
        x, values = self.model.initial_states(
            {name: v[pick] for name, v in self.x0.items()},
            {name: v[pick] for name, v in self.p.items()},
            pick.stop - pick.start,
            begin := float(self.inputs.breaks[0]),
        )
        return first_guess(system, self.model, x, begin), values

    def data(self, pick: slice) -> Array:
        """Return input data (members, n_data, intervals), or one row if common to all members."""
        common = self.inputs.values[None]
        if not self.own:
            return common
        every = np.repeat(common, pick.stop - pick.start, axis=0)
        breaks, symbols = self.inputs.breaks, self.inputs.data
        names = [symbols[i].name() for i in range(symbols.numel())]
        k = np.searchsorted(self.sampled[1:-1], breaks[:-1], side="right")
        for name, signal in self.own.items():
            part = type(signal)(signal.t, np.asarray(signal.values)[pick])
            for symbol, rows in zip(("k", "dot"), part.coefficients(self.sampled), strict=True):
                if f"{name}_{symbol}" in names:
                    every[:, names.index(f"{name}_{symbol}")] = rows[:, k]
        return every


def member_data(
    model: Model,
    span: tuple[float, float | Array],
    x0: Mapping[str, ArrayLike] | None,
    u: Mapping[str, MemberInput] | None,
    p: Mapping[str, ArrayLike] | None,
) -> MemberData:
    """Return the checked data of the members of an ensemble.

    Args:
        model: equations of the members.
        span: start time, and end time of all members or of each [s].
        x0, u, p: start values, inputs and parameters by name; numbers, or arrays with one entry per
            member.

    Raises:
        ValueError: unknown names, values that are not numbers, or arrays of different lengths.
    """
    t_start, ends = span[0], np.asarray(span[1], dtype=float)
    last = float(ends.max())
    values = {
        f"{letter}.{name}": checks.array(f"{WHERE}: {letter}.{name}", value, ndim=None)
        for letter, named in (("x0", x0), ("p", p))
        for name, value in model.named(letter, named).items()
    }
    given: dict[str, Any] = model.named("u", u)
    signals = {name: _signal(name, value, t_start) for name, value in given.items()}
    own = {n: s for n, s in signals.items() if isinstance(s, Sampled) and s.rows is not None}
    lengths = {name: value.shape for name, value in values.items() if value.ndim}
    for name, signal in own.items():
        samples = signal.values if isinstance(given[name], Sampled) else given[name]
        lengths[f"u.{name}"] = np.shape(samples)
    lengths |= {"t_end": ends.shape} if ends.ndim else {}
    count = _count(lengths)
    for v in model.p:
        for end in (np.min, np.max) if f"p.{v.name}" in values else ():
            v.within(f"{WHERE}: p.{v.name}", float(end(values[f"p.{v.name}"])))
    common = signals | {name: _one(signal, t_start, last) for name, signal in own.items()}
    times = [np.asarray(s.t) for s in common.values() if isinstance(s, Sampled)]
    numbers = {n.removeprefix("p."): values[n] for n in sorted(values, key=lambda n: n[0])}
    for name, value in given.items():
        if not (callable(value) or isinstance(value, Sampled) or np.ndim(value) > 1):
            numbers[f"u.{name}"] = np.asarray(value, float)
    numbers |= {"t_end": ends} if ends.ndim else {}
    every = {name: np.broadcast_to(value, (count,)) for name, value in values.items()}
    return MemberData(
        model,
        count,
        {v.name: every[f"x0.{v.name}"] for v in model.x if f"x0.{v.name}" in every},
        {v.name: every[f"p.{v.name}"] for v in model.p if f"p.{v.name}" in every},
        paced(input_data(model, common, t_start, last), model),
        own,
        _between(times, t_start, last),
        np.broadcast_to(ends, (count,)).astype(float),
        {name: np.array(value) for name, value in numbers.items() if value.ndim},
        {name: float(value) for name, value in numbers.items() if not value.ndim},
    )


def _count(lengths: Mapping[str, tuple[int, ...]]) -> int:
    """Return the number of members from the shapes of the given arrays.

    Raises:
        ValueError: no members, or arrays of different lengths.
    """
    matrix = any(len(s) > 1 for name, s in lengths.items() if not name.startswith("u."))
    if matrix or len({shape[0] for shape in lengths.values()}) > 1:
        shapes = ", ".join(f"{name} of shape {shape}" for name, shape in lengths.items())
        raise ValueError(f"{WHERE}: expected numbers or arrays of one length, got {shapes}")
    count = next((shape[0] for shape in lengths.values()), 1)
    if count < 1:
        raise ValueError(f"{WHERE}: expected at least one member, got empty arrays")
    return count


def _signal(name: str, value: Any, t_start: float) -> Any:
    """Return an input for `input_data`; numbers per member become held samples."""
    if isinstance(value, Sampled) or callable(value) or checks.as_number(value) is not None:
        return value
    return Hold([t_start], checks.array(f"{WHERE}: u.{name}", value)[:, None])


def _one(signal: Sampled, t_start: float, t_end: float) -> Sampled:
    """Return the signal of one representative member, with a nonzero slope if any has one."""
    rises = signal.coefficients(_between([np.asarray(signal.t)], t_start, t_end))[1]
    row = int(np.argmax(rises.any(axis=-1)))
    return type(signal)(signal.t, np.asarray(signal.values)[row])


def _between(times: list[Array], t_start: float, t_end: float) -> Array:
    """Return start, end and the times between them [s], sorted."""
    every = np.unique(np.concatenate([[t_start, t_end], *times]))
    return every[(every >= t_start) & (every <= t_end)]


def ends_of(t_end: float | ArrayLike) -> float | Array:
    """Return the checked end time of all members, or of each member [s]."""
    number = checks.as_number(t_end)
    if number is not None or isinstance(t_end, str | type):
        return checks.number(f"{WHERE}: t_end", t_end, unit="s")
    what = "a number of seconds, or a sequence with one for each member"
    ends = checks.array(f"{WHERE}: t_end", t_end, what=what)
    if not ends.size:
        raise ValueError(f"{WHERE}: expected at least one member, got empty arrays")
    return ends
