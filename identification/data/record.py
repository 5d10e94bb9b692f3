"""Class `Record`: signals over time or points without time; and its controller `PositionLoop`."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import TypeVar, final

import numpy as np
from numpy.typing import NDArray

from symfric.drives.drive import Drive
from symfric.foundation import checks
from symfric.foundation.shown import brief

Array = NDArray[np.float64]


@final
@dataclass(frozen=True, eq=False)
class PositionLoop:
    """Sampled cascade of position and velocity feedback with its reference.

        command = clip(kp kv (reference - x) - kv dx, +-limit)
        force = gain (command + disturbance)

    dx is the difference of the mean of the last two positions. The command is held for one sample.

    Attributes:
        kp: position gain [1/s].
        kv: velocity gain [command s/m].
        gain: force per command [N per command unit].
        limit: largest command.
        reference: position reference at the samples [m], shape (n,).
        disturbance: signal added to the command, shape (n,).

    Raises:
        ValueError: numbers are not finite, or the series have different lengths.
    """

    kp: float
    kv: float
    gain: float
    limit: float
    reference: Array
    disturbance: Array

    __repr__ = brief

    def __post_init__(self) -> None:
        for key, value in vars(self).items():
            where = f"PositionLoop: {key}"
            if key in ("reference", "disturbance"):
                object.__setattr__(self, key, checks.array(where, value))
            else:
                above = 0.0 if key == "limit" else None
                object.__setattr__(self, key, checks.number(where, value, above=above))
        if self.reference.shape != self.disturbance.shape:
            raise ValueError(
                "PositionLoop: expected reference and disturbance of one length, got "
                f"{self.reference.size} and {self.disturbance.size}"
            )

    def between(self, first: int, end: int) -> "PositionLoop":
        """Return the controller over the samples `first` to `end`, excluding `end`."""
        reference, disturbance = self.reference[first:end], self.disturbance[first:end]
        return replace(self, reference=reference, disturbance=disturbance)


GAP = 5.0
"""Shortest gap, relative to the median interval."""
JITTER = 0.01
"""Largest relative deviation of a sample interval from the mean in uniform samples."""


FEWEST = 20
"""Smallest number of samples of a piece that is checked."""


def runs(there: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Return first and end (exclusive) of each run of True values."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], there, [False]]).astype(int)))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))


def constant_runs(y: Array) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return first samples and lengths of all runs of equal values in a signal."""
    first = np.concatenate([[0], np.flatnonzero(np.diff(y) != 0) + 1])
    return first, np.diff(np.concatenate([first, [y.size]]))


LONG, BLOCKS = 100_000, 20
"""Number of samples above which statistics use evenly spaced blocks, and number of the blocks."""


def blocks(n: int, most: int = LONG) -> list[slice]:
    """Return slices of n samples: all of them, or evenly spaced blocks of about `most` in all."""
    if n <= most:
        return [slice(0, n)]
    size = most // BLOCKS + 1  # a reflected block then has a length with small prime factors
    return [slice(k, k + size) for k in np.linspace(0, n - size, BLOCKS).astype(int).tolist()]


Entry = TypeVar("Entry", bound=np.generic)


def some(y: NDArray[Entry]) -> NDArray[Entry]:
    """Return a signal, of a long one only evenly spaced samples, for its quantiles."""
    return y[:: 1 + y.size // LONG]


def count_of(y: Array) -> float:
    """Return the smallest step between values of a signal; 0 if they are not on a coarse grid.

    Of a long signal, only blocks are evaluated.
    """
    levels = np.unique(np.concatenate([y[part] for part in blocks(y.size)]))
    if levels.size < 2 or levels.size > 0.5 * min(y.size, LONG):
        return 0.0
    steps = np.diff(levels)
    smallest = float(np.quantile(steps, 0.05))
    off = np.abs(steps / smallest - np.rint(steps / smallest)) if smallest > 0 else np.ones(1)
    return smallest if np.median(off) < 0.02 and smallest > 1e-12 * np.ptp(y) else 0.0


def first_of(names: Sequence[str]) -> str:
    """Return the first name, with the number of the others."""
    return f"{names[0]} and {len(names) - 1} more" if len(names) > 1 else names[0]


@final
@dataclass(frozen=True, eq=False)
class Record:
    """Signals of one experiment, in SI units and of equal length.

    The canonical channels of a drive are x, v, a and force; for a rotary drive their units are rad,
    rad/s, rad/s^2 and N m. Points of a friction curve have the channels v and F. All other signals
    keep the names of their columns.

    Attributes:
        name: origin of the record; all messages begin with it.
        t: increasing sample times [s], shape (n,); None: points without time.
        signals: name -> values, shape (n,) each.
        units: name -> SI unit; "" if unknown.
        first_row: row of the first sample in its file, for messages; 0: messages give indices.
        loop: position controller of the experiment, if known.
        columns: name -> name of the column in its file, if different.
        left_out: column -> reason why it is not a signal.
        drive: drive whose log was converted to this record; None: no drive.

    Raises:
        ValueError: unequal lengths, values that are not finite, times that do not increase, or
            fewer than two samples; all problems in one error, each with its location.
    """

    name: str
    t: Array | None
    signals: Mapping[str, Array]
    units: Mapping[str, str]
    first_row: int = 0
    loop: PositionLoop | None = None
    columns: Mapping[str, str] = field(default_factory=dict[str, str])
    left_out: Mapping[str, str] = field(default_factory=dict[str, str])
    drive: Drive | None = None

    __repr__ = brief

    def __post_init__(self) -> None:
        where = f"data '{self.name}'"
        given = checks.named(f"{where}: signals", self.signals)
        signals = {key: self._column(key, values) for key, values in given.items()}
        units = checks.named(f"{where}: units", self.units, signals)
        for unit in units.values():
            checks.kind(f"{where}: units", unit, str, "SI units, such as 'm'")
        object.__setattr__(self, "signals", signals)
        object.__setattr__(self, "units", {key: units.get(key, "") for key in signals})
        if self.t is not None:
            object.__setattr__(self, "t", self._column("t", self.t))
        if problems := self._problems():
            raise ValueError(f"{where}: " + "; ".join(problems))

    def _column(self, key: str, values: object) -> Array:
        where = f"data '{self.name}': {key}"
        column = checks.array(where, values, ndim=None, what="a column of numbers", nan=True).copy()
        column.setflags(write=False)
        return column

    def _problems(self) -> list[str]:
        """Return the problems of shapes; if there are none, those of values, then of times."""
        if not self.signals:
            return ["expected at least one signal, got none"]
        every = {**({} if self.t is None else {"t": self.t}), **self.signals}
        shapes = {key: values.shape for key, values in every.items()}
        if any(len(shape) != 1 for shape in shapes.values()) or len(set(shapes.values())) > 1:
            found = ", ".join(f"{key}: {shape}" for key, shape in shapes.items())
            return [f"expected columns of one length, got {found}"]
        n, size = self.size, 0 if self.loop is None else self.loop.reference.size
        if n < 2:
            return [f"expected at least two samples, got {n}"]
        if self.loop is not None and size != n:
            return [f"expected a controller with a reference of {n} samples, got {size}"]
        bad = {key: np.flatnonzero(~np.isfinite(values)) for key, values in every.items()}
        problems = [
            f"column {key}, {self.place(int(at[0]))}: expected a finite number, got "
            f"{every[key][at[0]]} ({at.size} such cells)"
            for key, at in bad.items()
            if at.size
        ]
        return problems or ([] if self.t is None else self._time_problems(self.t))

    def _time_problems(self, t: Array) -> list[str]:
        back = np.flatnonzero(np.diff(t) <= 0)
        if not back.size:
            return []
        k, hint = int(back[0]), ""
        if back.size <= self.size // 20 and t[k + 1] <= t[0] + self.step:
            hint = "; the time restarts: use one file for each record"
        elif not np.any(np.diff(t)[back] < 0):
            alike = [values[back + 1] == values[back] for values in self.signals.values()]
            hint = "; several values at one time: if its clock is too coarse, pass step= (--step)"
            if np.all(alike):
                hint = "; missing='drop' (--missing drop) leaves out repeated rows"
        return [
            f"column t, {self.place(k + 1)}: expected increasing times, got {t[k + 1]:.12g} s "
            f"after {t[k]:.12g} s ({back.size} such rows){hint}"
        ]

    def place(self, sample: int) -> str:
        """Return the location of a sample for messages: its row in the file, or its index."""
        return f"row {sample + self.first_row}" if self.first_row else f"sample {sample}"

    def __getitem__(self, name: str) -> Array:
        """Return a signal by its name or that of its column; "t" stands for the times."""
        if name == "t" and self.t is not None:
            return self.t
        return self.signals[self.channel(name)]

    def __contains__(self, name: object) -> bool:
        timed = name == "t" and self.t is not None
        return timed or name in self.signals or name in self.columns.values()

    def channel(self, name: str) -> str:
        """Return the name of a signal, given that name or the name of its column.

        Raises:
            ValueError: no such signal; the message gives the reason if it was left out.
        """
        if name in self.signals:
            return name
        for key, column in self.columns.items():
            if column == name and key in self.signals:
                return key
        why = self.left_out.get(name)
        hint = f"it was left out: {why}" if why else f"name it with columns={{'{name}': ...}}"
        raise ValueError(
            f"data '{self.name}': expected a signal '{name}', got {', '.join(self.signals)}; {hint}"
        )

    def unit(self, name: str) -> str:
        """Return the SI unit of a signal."""
        return "s" if name == "t" else self.units[self.channel(name)]

    @property
    def size(self) -> int:
        """Number of samples, equal for all signals."""
        return next(iter(self.signals.values())).size

    @property
    def time(self) -> Array:
        """Sample times [s].

        Raises:
            ValueError: points without time.
        """
        if self.t is None:
            raise ValueError(
                f"data '{self.name}': expected a record over time, got points without time; "
                "fit them with Points(), or pass step= [s]"
            )
        return self.t

    @property
    def step(self) -> float:
        """Mean sample interval [s]."""
        t = self.time
        return float(t[-1] - t[0]) / (t.size - 1)

    @property
    def median_step(self) -> float:
        """Median sample interval [s], unaffected by gaps."""
        return float(np.median(np.diff(self.time)))

    @property
    def pieces(self) -> list[slice]:
        """Slices of the samples between gaps."""
        cuts = np.flatnonzero(np.diff(self.time) > GAP * self.median_step) + 1
        return [slice(a, b) for a, b in pairwise([0, *cuts.tolist(), self.size])]

    def uniform(self) -> "Record":
        """Return this record if its samples are equally spaced to 1 % of the interval.

        Raises:
            ValueError: unequal intervals. Filters and differences need equal intervals, and the
                user decides whether interpolated samples may replace measured ones.
        """
        t = self.time
        intervals = np.diff(t)
        k = int(np.argmax(np.abs(intervals - self.step)))
        if abs(intervals[k] - self.step) > JITTER * self.step:
            raise ValueError(
                f"data '{self.name}': column t, {self.place(k + 1)}: expected equal intervals of "
                f"{self.step:.6g} s to {JITTER:.0%}, got {intervals[k]:.6g} s at t = {t[k]:.6g} s; "
                "use data.resampled() (--resample)"
            )
        return self

    def at(self, rows: slice | NDArray[np.integer] | NDArray[np.bool_]) -> "Record":
        """Return the record at the given rows; slices without a step keep the controller."""
        first, loop = 0, None
        if isinstance(rows, slice) and rows.step in (None, 1):
            begin, end, _ = rows.indices(self.size)
            first = self.first_row + begin if self.first_row else 0
            loop = None if self.loop is None else self.loop.between(begin, end)
        return replace(
            self,
            t=None if self.t is None else self.t[rows],
            signals={key: values[rows] for key, values in self.signals.items()},
            first_row=first,
            loop=loop,
        )

    def between(self, begin: float, end: float) -> "Record":
        """Return the samples with begin <= t <= end [s]; the times are unchanged.

        Raises:
            ValueError: fewer than two samples in this interval.
        """
        where = f"data '{self.name}': between"
        begin, end = (checks.number(where, at, unit="s") for at in (begin, end))
        t = self.time
        first, last = np.searchsorted(t, begin, "left"), np.searchsorted(t, end, "right")
        if last - first < 2:
            raise ValueError(
                f"{where}: expected times within {t[0]:g} ... {t[-1]:g} s with at least two "
                f"samples, got {begin:g} ... {end:g} s"
            )
        return self.at(slice(int(first), int(last)))

    def thinned(self, every: int) -> "Record":
        """Return every n-th sample of the record, n = `every`, without prior filtering.

        The controller is dropped, because its reference belongs to all samples.
        """
        every = checks.count(f"data '{self.name}': thinned", every)
        return self if every == 1 else self.at(slice(None, None, every))

    def renamed(self, names: Mapping[str, str]) -> "Record":
        """Return the record with renamed signals: {"old": "new"}."""
        where = f"data '{self.name}': renamed"
        given = {self.channel(old): new for old, new in checks.named(where, names).items()}
        for new in given.values():
            checks.text(where, new, "names")
        keys = [given.get(key, key) for key in self.signals]
        if len(set(keys)) < len(keys) or "t" in keys:
            raise ValueError(f"{where}: expected every name once, got {', '.join(keys)}")
        return replace(
            self,
            signals=dict(zip(keys, self.signals.values(), strict=True)),
            units=dict(zip(keys, self.units.values(), strict=True)),
            columns={given.get(key, key): column for key, column in self.columns.items()},
        )


def even_blocks(record: Record) -> tuple[Record, ...]:
    """Return the longest piece of a record without gaps, at equal intervals; () if it is too short.

    Evenly spaced `blocks` represent a long piece.
    """
    if record.t is None or record.size < FEWEST:
        return ()
    longest = max(record.pieces, key=lambda part: part.stop - part.start)
    size, first = longest.stop - longest.start, longest.start
    if size < FEWEST:
        return ()
    each = (slice(first + part.start, first + part.stop) for part in blocks(size))
    return tuple(_even(record.at(part)) for part in each)


def _even(piece: Record) -> Record:
    """Return a record at equal intervals, interpolated if its intervals differ by more than 5 %."""
    step = (piece.time[-1] - piece.time[0]) / (piece.size - 1)
    grid = piece.time[0] + step * np.arange(piece.size)
    if np.abs(grid - piece.time).max() < 0.05 * step:
        return piece
    signals = {key: np.interp(grid, piece.time, y) for key, y in piece.signals.items()}
    return Record(piece.name, grid, signals, piece.units, first_row=piece.first_row)


def joined(steady: Sequence[Record], signal: str) -> Array:
    """Return a signal, a row for each block, shape (blocks, n)."""
    return np.stack([block[signal] for block in steady])
