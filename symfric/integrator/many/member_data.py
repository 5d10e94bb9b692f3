"""Members of an ensemble: their data, and their results in memory or in a folder."""

import os
import stat
import warnings
from collections.abc import Collection, Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from hashlib import sha256
from math import prod
from pathlib import Path
from typing import Any, final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from symfric.foundation import checks, storable
from symfric.foundation.files import written
from symfric.foundation.numeric import Array
from symfric.integrator.equations.initial import first_guess
from symfric.integrator.equations.inputs import Hold, Input, InputData, Sampled, input_data, paced
from symfric.integrator.equations.system import System
from symfric.integrator.many.chunk import Solved
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


BLOCK = 2**20
"""Bytes written at once when a file is created."""


@final
class Store:
    """Signals of all members and the outcome of their runs.

    In a folder, every signal is an array file, memory-mapped for reading, and a small file with a
    checksum marks every complete chunk, so that a later call can continue. Chunks that are missing,
    truncated, damaged or changed by another program are computed again. The name of the subfolder
    is a hash of all data that determine the results, so results of other arguments are never used.

    Attributes:
        signals: name -> values (members, times).
        attempts, reached: number of attempts of each member, and the time [s] that it reached.
        reach: least and greatest value of each state over the steps, shape (members, 2, nx).
        failed: number of a failed member -> message.
        damaged: first members of the chunks whose stored results have changed.

    Raises:
        ValueError: the folder is not writable or too small for all results.
    """

    def __init__(
        self, folder: Path | None, names: Iterable[str], members: int, times: int, states: int
    ) -> None:
        self._folder, shape = folder, (members, times)
        self._files: list[_ArrayFile] = []
        if folder is None:
            self.signals = {name: np.full(shape, np.nan) for name in names}
        else:
            files = {name: _ArrayFile(folder / f"{name}.npy", shape) for name in names}
            for file in files.values():
                file.make()
            self._files = list(files.values())
            self.signals = {name: file.array for name, file in files.items()}
        self.attempts = np.zeros(members, dtype=np.int64)
        self.reached = np.full(members, np.nan)
        self.reach = np.full((members, 2, states), np.nan)
        self.failed: dict[int, str] = {}
        self.damaged: list[int] = []

    def _mark(self, first: int) -> Path | None:
        return None if self._folder is None else self._folder / f"chunk-{first}.npz"

    def left(self, firsts: Collection[int]) -> list[int]:
        """Return the first members of the incomplete chunks among those that start at `firsts`.

        Warns:
            UserWarning: stored results of some chunks have changed.
        """
        found = [first for first in firsts if not self.has(first)]
        if self.damaged:
            warnings.warn(
                f"simulate_many: out: {len(self.damaged)} of {len(firsts)} chunks in "
                f"'{self._folder}' have been deleted, truncated or changed since; they "
                "are computed again",
                UserWarning,
                stacklevel=3,
            )
        return found

    def has(self, first: int) -> bool:
        """Return True if the chunk that starts at `first` is complete, and load its results."""
        mark = self._mark(first)
        if mark is None or not mark.exists():
            return False
        try:
            with mark.open("rb") as file:
                saved = storable.arrays(file)
            if str(saved.pop("checksum")) == self._checksum(first, saved["attempts"].size):
                self._note(first, saved)
                return True
        except (OSError, ValueError, KeyError):
            pass  # the marker file is damaged
        self.damaged.append(first)
        return False

    def put(self, first: int, result: Solved) -> None:
        """Store the results of the chunk that starts at `first`.

        Raises:
            ValueError: the results cannot be written; complete chunks are kept.
        """
        size, mark = result.attempts.size, self._mark(first)
        outcome: dict[str, Any] = {
            name: getattr(result, name) for name in ("attempts", "reached", "reach")
        }
        outcome["failed"] = np.array(list(result.failed), dtype=np.int64)
        outcome["why"] = np.array(list(result.failed.values()), dtype=np.str_)
        self._note(first, outcome)
        if mark is None:
            for i, values in enumerate(self.signals.values()):
                values[first : first + size] = result.signals[:, :, i]
            return
        try:
            for i, file in enumerate(self._files):
                file.write(first, result.signals[:, :, i])
            with written(mark) as temporary, temporary.open("wb") as marker:
                np.savez(marker, **outcome, checksum=np.array(self._checksum(first, size)))
        except (OSError, ValueError) as error:
            raise ValueError(
                f"simulate_many: out: expected disk space for members from {first} on in "
                f"'{self._folder}', got {_reason(error)}; complete chunks are kept, call again to "
                "continue"
            ) from None

    def _checksum(self, first: int, size: int) -> str:
        """Return a hash of the results of `size` members, as read from the files."""
        total = sha256()
        for values in self.signals.values():
            total.update(np.ascontiguousarray(values[first : first + size]).tobytes())
        return total.hexdigest()

    def _note(self, first: int, outcome: dict[str, NDArray[Any]]) -> None:
        """Store the results of the members from `first` on, and the messages of failed members."""
        failed = zip(outcome["failed"].tolist(), outcome["why"].tolist(), strict=True)
        pick = slice(first, first + outcome["attempts"].size)
        for name in ("attempts", "reached", "reach"):
            getattr(self, name)[pick] = outcome[name]
        self.failed |= {first + m: why for m, why in failed}


def _reason(error: OSError | ValueError) -> str:
    """Return the message of the operating system about a file that cannot be written."""
    cause = error if isinstance(error, OSError) else error.__cause__
    return cause.strerror if isinstance(cause, OSError) and cause.strerror else str(error)


@final
@dataclass(frozen=True, eq=False)
class _ArrayFile:
    """Array file (`numpy.save`), written by rows and read through a memory map.

    It is not written through the map, because a signal would then end the process on a full disk.
    """

    path: Path
    shape: tuple[int, int]

    def make(self) -> None:
        """Create a file of NaN, so that its disk space is allocated, unless a valid one exists.

        If two calls create the file at the same time, both use the file of one of them.
        """
        missing = not os.path.lexists(self.path)
        if not missing and self._is_whole():
            return
        row = np.full(self.shape[1:], np.nan).tobytes()
        rows = max(1, BLOCK // len(row))
        try:
            with suppress(FileExistsError), written(self.path) as temporary:
                with temporary.open("wb") as file:
                    np.lib.format.write_array_header_1_0(file, self._header)
                    for first in range(0, self.shape[0], rows):
                        file.write(row * min(rows, self.shape[0] - first))
                if missing:
                    try:
                        os.link(temporary, self.path)
                    except FileExistsError:
                        raise
                    except OSError:  # no hard links: the last writer wins
                        pass
        except (OSError, ValueError) as error:
            raise ValueError(
                f"simulate_many: out: expected {8e-6 * prod(self.shape):.3g} MB of disk space for "
                f"'{self.path}', got {_reason(error)}"
            ) from None

    @property
    def _header(self) -> dict[str, object]:
        return {"descr": "<f8", "fortran_order": False, "shape": self.shape}

    def _is_whole(self) -> bool:
        """Return True if the file has the required header and size."""
        try:
            status = self.path.lstat()
            if not stat.S_ISREG(status.st_mode):
                return False
            with self.path.open("rb") as file:
                version = np.lib.format.read_magic(file)
                header = np.lib.format.read_array_header_1_0(file) if version == (1, 0) else None
                size = file.tell() + 8 * prod(self.shape)
        except (OSError, ValueError):
            return False
        return header == (self.shape, False, np.dtype("<f8")) and status.st_size == size

    @cached_property
    def array(self) -> Array:
        """Values as a read-only memory map."""
        return np.lib.format.open_memmap(self.path, mode="r")

    def write(self, first: int, rows: Array) -> None:
        """Overwrite the rows from `first` on with `rows`."""
        end = self.path.stat().st_size
        with self.path.open("r+b") as file:
            file.seek(end - 8 * prod(self.shape) + 8 * first * self.shape[1])
            file.write(np.ascontiguousarray(rows, dtype="<f8").tobytes())
