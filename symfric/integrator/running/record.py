"""Record of a run: steps with their continuous solution, values at times, and events."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple, final

import numpy as np
from numpy.typing import NDArray

from symfric.foundation.numeric import Array
from symfric.foundation.status import Status


class Record(NamedTuple):
    """Layout of the record (t0, t1, y0, y1, D) of an accepted step.

    Attributes:
        n: number of unknowns.
        rows: number of rows of the dense output D, each of length n.
    """

    n: int
    rows: int
    T0 = 0
    T1 = 1

    @property
    def width(self) -> int:
        """Length of a record."""
        return 2 + (2 + self.rows) * self.n

    @property
    def y0(self) -> slice:
        """Slice of the unknowns at the start."""
        return self.bend(-2)

    @property
    def y1(self) -> slice:
        """Slice of the unknowns at the end."""
        return self.bend(-1)

    def bend(self, k: int) -> slice:
        """Return the slice of row `k` of the dense output."""
        return slice(2 + (2 + k) * self.n, 2 + (3 + k) * self.n)


@final
@dataclass(frozen=True, eq=False)
class Dense:
    """Piecewise polynomial solution, one piece per accepted step.

    With theta = (t - t0) / (t1 - t0) and d(theta) = d_1 + theta (d_2 + theta d_3):

        y(theta) = (1 - theta) y0 + theta [y1 + (1 - theta) d(theta)]

    Attributes:
        t0, t1: start and end of each piece, shape (k,).
        y0, y1: values there, shape (k, n); after an event, y0 differs from the y1 before it.
        D: coefficients d_1, ..., d_r, shape (k, r, n).
    """

    t0: Array
    t1: Array
    y0: Array
    y1: Array
    D: Array

    @classmethod
    def of(cls, rows: Array, n: int) -> "Dense":
        """Return the pieces as views of the rows (t0, t1, y0, y1, D) that an engine writes."""
        y0, y1, D = rows[:, 2 : 2 + n], rows[:, 2 + n : 2 + 2 * n], rows[:, 2 + 2 * n :]
        return cls(rows[:, 0], rows[:, 1], y0, y1, D.reshape(len(rows), D.shape[1] // n, n))

    @property
    def rows(self) -> Array:
        """Rows (t0, t1, y0, y1, D) of the pieces, as for `of`."""
        k, r, n = self.D.shape
        ends = self.t0[:, None], self.t1[:, None], self.y0, self.y1
        return np.hstack([*ends, self.D.reshape(k, r * n)])

    def __call__(self, times: Array) -> Array:
        """Return the values at `times`, shape (n, m); at an event, the value after it."""
        k = np.searchsorted(self.t0[1:], times, side="right")
        return self.piece(k, (times - self.t0[k]) / (self.t1[k] - self.t0[k])).T

    def piece(self, k: NDArray[np.intp], theta: Array) -> Array:
        """Return values of the pieces `k` at `theta`, shape (m, n)."""
        s = theta[:, None]
        bend = np.zeros_like(self.y0[k])
        for row in range(self.D.shape[1] - 1, -1, -1):
            bend = self.D[k, row] + s * bend
        return (1 - s) * self.y0[k] + s * (self.y1[k] + (1 - s) * bend)

    def rates(self, k: NDArray[np.intp], theta: Array) -> Array:
        """Return time derivatives of the pieces `k` at `theta`, shape (m, n)."""
        s = theta[:, None]
        bend, slope = np.zeros_like(self.y0[k]), np.zeros_like(self.y0[k])
        for row in range(self.D.shape[1] - 1, -1, -1):
            slope = bend + s * slope
            bend = self.D[k, row] + s * bend
        rise = self.y1[k] - self.y0[k] + (1 - 2 * s) * bend + s * (1 - s) * slope
        return rise / (self.t1 - self.t0)[k, None]


def hermite(t: Array, y: Array, slope: Array) -> Dense:
    """Return the cubic Hermite interpolant of y (n, m) with slopes (n, m) at times t (m,)."""
    h = np.diff(t)[None, :]
    rise = np.diff(y, axis=1)
    first = h * slope[:, :-1] - rise
    second = rise - h * slope[:, 1:] - first
    D = np.stack([first.T, second.T], axis=1)
    return Dense(t[:-1], t[1:], y[:, :-1].T, y[:, 1:].T, D)


@final
@dataclass(eq=False)
class Outputs:
    """Unknowns at increasing times; mutable, filled in order.

    The compiled loop repeats `fill` operation by operation (`symfric_outputs` in `march.c`).

    Attributes:
        times: times of the result [s], shape (m,).
        values: unknowns at these times, shape (n, m), known for the first `found` times.
        found: number of times reached.
    """

    times: Array
    values: Array
    found: int = 0

    @classmethod
    def at(cls, times: Array, n: int) -> "Outputs":
        """Return empty outputs for `n` unknowns at `times`."""
        times = np.ascontiguousarray(times)
        return cls(times, np.empty((n, times.size)))

    def fill(self, piece: Dense, last: bool = False) -> None:
        """Fill in the values at the times within `piece`.

        A time at the very end of the piece belongs to the next piece, since an event or a break may
        change the values there. In the `last` piece of a run it belongs to that piece.
        """
        end = int(np.searchsorted(self.times, piece.t1[-1], side="right" if last else "left"))
        if end > self.found:
            self.values[:, self.found : end] = piece(self.times[self.found : end])
            self.found = end

    def back_to(self, t: float) -> None:
        """Discard values after `t` [s], from steps that were interrupted before they were kept."""
        self.found = min(self.found, int(np.searchsorted(self.times, t, side="right")))

    @property
    def reached(self) -> Array:
        """Unknowns at the times that were reached, shape (n, found)."""
        return self.values[:, : self.found]


@final
@dataclass(frozen=True, eq=False)
class Jumps:
    """Events of a run, one row per time.

    Attributes:
        step: number of accepted steps before the events, shape (k,).
        t: time [s], shape (k,).
        size: full size of the step that the events cut [s]; negative if nothing of the step is
            left, 0 if a jump led to the events instead of motion, shape (k,).
        before, after: unknowns just before and after the events, shape (k, n).
        which: mask of the events that happened together, shape (k, events).
    """

    step: NDArray[np.intp]
    t: Array
    size: Array
    before: Array
    after: Array
    which: NDArray[np.bool_]

    @classmethod
    def of(cls, rows: Array, n: int, steps: int = 0) -> "Jumps":
        """Return the jumps of records (steps before, t, size, y before, y after, which).

        `steps` accepted steps were made before the records.
        """
        rows, after = rows.copy(), 3 + n
        return cls(
            rows[:, 0].astype(np.intp) + steps,
            rows[:, 1],
            rows[:, 2],
            rows[:, 3:after],
            rows[:, after : after + n],
            rows[:, after + n :] != 0.0,
        )


MOST_BYTES = 64 * 2**20
"""Memory limit of the accepted steps of a run.

A longer run keeps only the values at its result times. Its dense output is then recomputed by a
second run, which gives the same bits.
"""


class Extent(NamedTuple):
    """Shortest and longest accepted step [s]."""

    shortest: float
    longest: float


@final
@dataclass(eq=False)
class RunRecord:
    """Record of a run; mutable, and available after interrupts and failures.

    Attributes:
        t, y: start time and start values.
        outputs: unknowns at the times of the result.
        jumps: events that happened, with the unknowns on both sides.
        happened: (time, name) of every event.
        steps, attempts: numbers of accepted steps and of all attempts.
        engine: name of the engine.
        again: (times, bytes) -> another run with outputs at these times and this memory limit; None
            if this run has kept all steps.
        status, message: status at the end, and a sentence about it.
        most: memory limit of the accepted steps [bytes].
        kept: rows of accepted steps (`Dense.of`), batch by batch. Once the limit is exceeded, only
            the last row.
        ends: smallest and largest unknowns at the start and at the ends of steps, shape (2, n);
            None before the first step.
    """

    t: float
    y: Array
    outputs: Outputs
    jumps: list[Jumps] = field(default_factory=list[Jumps])
    happened: list[tuple[float, str]] = field(default_factory=list[tuple[float, str]])
    steps: int = 0
    attempts: int = 0
    engine: str = ""
    again: Callable[[Array, float], "RunRecord"] | None = None
    status: Status = Status.SUCCESS
    message: str = Status.SUCCESS.value
    most: float = MOST_BYTES
    kept: list[Array] = field(default_factory=list[Array])
    ends: Array | None = None
    _held: int = 0
    _before: Extent | None = None

    def keep(self, rows: Array) -> None:
        """Append rows of accepted steps; the run takes ownership of them."""
        if not len(rows):
            return
        self.steps += len(rows)
        self.kept.append(rows)
        self._held += rows.nbytes
        if self._held > self.most:
            self._before, self.kept = self.extent, [rows[-1:].copy()]

    @property
    def complete(self) -> bool:
        """True if all accepted steps are kept."""
        return self._before is None

    def stop(self, status: Status, message: str | None = None) -> None:
        """End the run with `status` and `message`, by default the sentence of the status."""
        self.status, self.message = status, message or status.value

    @property
    def _rows(self) -> list[Array]:
        """Kept rows; a single one for a start without steps."""
        if self.kept:
            return self.kept
        return [np.concatenate([[self.t, np.nextafter(self.t, np.inf)], self.y, self.y])[None]]

    @cached_property
    def dense(self) -> Dense:
        """Continuous solution over all accepted steps; recomputed for a long run."""
        if self.again is not None:
            return self.again(np.zeros(0), np.inf).dense
        rows = self._rows
        return Dense.of(rows[0] if len(rows) == 1 else np.vstack(rows), self.y.size)

    @property
    def last(self) -> Dense:
        """Last accepted step, as a copy."""
        return Dense.of(self._rows[-1][-1:].copy(), self.y.size)

    @property
    def reached(self) -> float:
        """Time at the end of the last accepted step [s]."""
        return float(self.kept[-1][-1, 1]) if self.kept else self.t

    @property
    def _ends(self) -> list[Array]:
        """Unknowns at the ends of steps, batch by batch."""
        n = self.y.size
        return [rows[:, 2 + n : 2 + 2 * n] for rows in self._rows]

    @property
    def end(self) -> Array:
        """Unknowns at the end of the last accepted step, shape (n,)."""
        n = self.y.size
        return self.kept[-1][-1, 2 + n : 2 + 2 * n] if self.kept else self.y

    @property
    def extent(self) -> Extent:
        """Range of the step lengths and of the unknowns."""
        lengths = [rows[:, 1] - rows[:, 0] for rows in self._rows]
        if self._before is not None:
            lengths.append(np.array(self._before))
        every = np.concatenate(lengths)
        return Extent(float(every.min()), float(every.max()))

    @property
    def seen(self) -> tuple[Array, Array]:
        """Start and ends of steps, (k,) and (k, n); for a long run, the times of the result."""
        if not self.complete:
            return self.outputs.times[: self.outputs.found], self.outputs.reached.T
        times = [self.t], *(rows[:, 1] for rows in self._rows)
        return np.concatenate(times), np.concatenate([self.y[None], *self._ends])

    @property
    def reach(self) -> Array:
        """Smallest and largest unknowns at the start and at the ends of steps, shape (2, n)."""
        return np.array([self.y, self.y]) if self.ends is None else self.ends

    @property
    def farthest(self) -> Array:
        """Largest magnitudes of the unknowns at the start and at the ends of steps, shape (n,)."""
        low, high = np.abs(self.reach)
        return np.maximum(low, high)

    def at(self, times: Array) -> Array:
        """Return unknowns at `times` [s], shape (n, times); for a long run by recomputation."""
        if self.again is None or "dense" in self.__dict__:
            return self.dense(times)
        if times.size and times.min() >= self._rows[-1][0, 0]:
            return self.last(times)
        wanted, places = np.unique(times, return_inverse=True)
        return self.again(wanted, self.most).outputs.values[:, places]
