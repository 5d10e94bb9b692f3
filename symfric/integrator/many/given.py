"""Data of the members of an ensemble: start values, parameters, inputs and end."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from symfric.foundation import checks
from symfric.integrator.equations.initial import first_guess
from symfric.integrator.equations.inputs import Hold, Input, InputData, Sampled, input_data, paced
from symfric.integrator.equations.system import System
from symfric.model import Model

Array = NDArray[np.float64]
Values = dict[str, Array]
MemberInput = Input | ArrayLike
"""Input as in `simulate`, or an array of numbers or samples (members, n), one row per member."""
WHERE = "simulate_many"


@final
@dataclass(frozen=True, eq=False)
class Members:
    """All members of an ensemble and their data.

    Attributes:
        model: their equations.
        count: number of members.
        x0, p: start values and parameters by name, shape (count,).
        inputs: the inputs of all; those that differ are in `own`.
        own: input -> signals of the members, shape (count, n).
        sampled: ends of the intervals between samples [s].
        ends: end of each member [s], shape (count,).
        varied: values given as arrays, by name: a parameter, "x0.v", "u.force", "t_end"; shape
            (count,). Samples of an input are not included.
        fixed: values given as one number for all, likewise.
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
        """Return start values of the unknowns (members, n), algebraic ones guessed, and
        parameters.
        """
        x, values = self.model.initial_states(
            {name: v[pick] for name, v in self.x0.items()},
            {name: v[pick] for name, v in self.p.items()},
            pick.stop - pick.start,
            begin := float(self.inputs.breaks[0]),
        )
        return first_guess(system, self.model, x, begin), values

    def data(self, pick: slice) -> Array:
        """Return input data (members, n_data, intervals); one row if they are common to all."""
        common = self.inputs.values[None]
        if not self.own:
            return common
        every = np.repeat(common, pick.stop - pick.start, axis=0)
        breaks, symbols = self.inputs.breaks, self.inputs.data
        names = [symbols[i].name() for i in range(symbols.numel())]
        k = np.searchsorted(self.sampled[1:-1], breaks[:-1], side="right")
        for name, signal in self.own.items():
            part = type(signal)(signal.t, np.asarray(signal.values)[pick])
            value, rise = part.coefficients(self.sampled)
            every[:, names.index(f"{name}_k")] = value[:, k]
            if f"{name}_dot" in names:
                every[:, names.index(f"{name}_dot")] = rise[:, k]
        return every


def members_of(
    model: Model,
    span: tuple[float, float | Array],
    x0: Mapping[str, ArrayLike] | None,
    u: Mapping[str, MemberInput] | None,
    p: Mapping[str, ArrayLike] | None,
) -> Members:
    """Collect the members of an ensemble.

    Args:
        model: their equations.
        span: start, and end of all or of each [s].
        x0, u, p: start values, inputs and parameters by name, numbers or an entry for each member.

    Raises:
        ValueError: unknown names, not numbers, arrays of different lengths.
    """
    t_start, ends = span[0], np.asarray(span[1])
    given = {
        f"{letter}.{name}": checks.array(f"{WHERE}: {letter}.{name}", value, ndim=None)
        for letter, values in (("x0", model.named("x0", x0)), ("p", model.named("p", p)))
        for name, value in values.items()
    }
    signals = {name: _signal(name, value, t_start) for name, value in model.named("u", u).items()}
    own = {n: s for n, s in signals.items() if isinstance(s, Sampled) and s.rows is not None}
    lengths = {name: value.shape for name, value in given.items() if value.ndim}
    for name, signal in own.items():
        value: Any = (u or {})[name]
        lengths[f"u.{name}"] = np.shape(signal.values if isinstance(value, Sampled) else value)
    lengths |= {"t_end": ends.shape} if ends.ndim else {}
    count = _count(lengths)
    numbers = _numbers(given, u or {}) | ({"t_end": ends.astype(float)} if ends.ndim else {})
    for v in model.p:
        for end in (np.min, np.max) if f"p.{v.name}" in given else ():
            v.within(f"{WHERE}: p.{v.name}", float(end(given[f"p.{v.name}"])))
    last = float(ends.max())
    common = signals | {name: _one(signal, t_start, last) for name, signal in own.items()}
    times = [np.asarray(s.t) for s in common.values() if isinstance(s, Sampled)]
    every = {name: np.broadcast_to(value, (count,)) for name, value in given.items()}
    return Members(
        model,
        count,
        {v.name: every[f"x0.{v.name}"] for v in model.x if f"x0.{v.name}" in every},
        {v.name: every[f"p.{v.name}"] for v in model.p if f"p.{v.name}" in every},
        paced(input_data(model, common, t_start, last), model),
        own,
        _between(times, t_start, last),
        np.broadcast_to(ends, (count,)).astype(float),
        {name: np.array(values) for name, values in numbers.items() if values.ndim},
        {name: float(value) for name, value in numbers.items() if not value.ndim},
    )


def _numbers(given: Mapping[str, Array], u: Mapping[str, Any]) -> Values:
    """Return all numbers that were given: parameters by name, then "x0.v" and "u.force"."""
    plain = {n: np.asarray(v, float) for n, v in u.items() if not callable(v) and _is_plain(v)}
    found = {n.removeprefix("p."): v for n, v in given.items() if n.startswith("p.")}
    found |= {name: value for name, value in given.items() if name.startswith("x0.")}
    return found | {f"u.{name}": value for name, value in plain.items()}


def _is_plain(value: Any) -> bool:
    return not isinstance(value, Sampled) and np.ndim(value) < 2


def _count(lengths: Mapping[str, tuple[int, ...]]) -> int:
    """Return the number of members from the shapes of the given arrays.

    Raises:
        ValueError: no members, or different lengths.
    """
    wrong = (len(s) > 1 for name, s in lengths.items() if not name.startswith("u."))
    if len({shape[0] for shape in lengths.values()}) > 1 or any(wrong):
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
    numbers = checks.array(f"{WHERE}: u.{name}", value)
    return Hold([t_start], numbers[:, None])


def _one(signal: Sampled, t_start: float, t_end: float) -> Sampled:
    """Return the signal of one member as representative, one that changes if any does."""
    rises = signal.coefficients(_between([np.asarray(signal.t)], t_start, t_end))[1]
    row = int(np.argmax(rises.any(axis=-1)))
    return type(signal)(signal.t, np.asarray(signal.values)[row])


def _between(times: list[Array], t_start: float, t_end: float) -> Array:
    """Return start and end, and the times between them."""
    inner = np.concatenate([np.zeros(0), *times])
    inner = inner[(inner > t_start) & (inner < t_end)]
    return np.unique(np.concatenate([[t_start], inner, [t_end]]))


def input_of(inputs: InputData, data: Array, end: float) -> InputData:
    """Return the inputs of one member: its own data (n_data, intervals), up to its end."""
    last = int(np.searchsorted(inputs.breaks, end)) - 1
    breaks = np.append(inputs.breaks[: last + 1], end)
    return replace(inputs, breaks=breaks, values=np.ascontiguousarray(data[:, : last + 1]))


def ends_of(t_end: float | ArrayLike) -> float | Array:
    """Return the end of all members, or of each one [s]."""
    number = checks.as_number(t_end)
    if number is not None or isinstance(t_end, str | type):
        return checks.number("simulate_many: t_end", t_end, unit="s")
    what = "a number of seconds, or a sequence with one for each member"
    ends = checks.array("simulate_many: t_end", t_end, what=what)
    if not ends.size:
        raise ValueError("simulate_many: expected at least one member, got empty arrays")
    return ends


def all_later(ends: float | Array, t_start: float) -> None:
    """Check that all ends are after the start."""
    if np.min(ends) <= t_start:
        raise ValueError(
            f"simulate_many: expected t_end > t_start = {t_start:g} s, got {np.min(ends):g} s for "
            f"member {np.argmin(ends)}"
        )


def units_of(model: Model) -> dict[str, str]:
    """Return the units of all values that may be given."""
    found = {v.name: v.unit for v in model.p} | {"t_end": "s"}
    for what, group in (("x0", model.x), ("u", model.u)):
        found |= {f"{what}.{v.name}": v.unit for v in group}
    return found
