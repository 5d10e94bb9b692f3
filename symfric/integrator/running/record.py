"""Record of a run: steps with their continuous solution, values at times, and events."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import final

import numpy as np
from numpy.typing import NDArray

from symfric.foundation.status import Status

Array = NDArray[np.float64]


@final
@dataclass(frozen=True, eq=False)
class Dense:
    """Piecewise polynomial solution, one piece per accepted step.

    With theta = (t - t0) / (t1 - t0) and d(theta) = d_1 + theta (d_2 + theta d_3):

        y(theta) = (1 - theta) y0 + theta [y1 + (1 - theta) d(theta)]

    Attributes:
        t0, t1: start and end of each piece, shape (k,).
        y0, y1: values there, shape (k, n); y0 differs from the y1 before it after an event.
        D: coefficients, shape (k, r, n).
    """

    t0: Array
    t1: Array
    y0: Array
    y1: Array
    D: Array

    @property
    def nbytes(self) -> int:
        """Memory of the arrays [bytes]."""
        return sum(a.nbytes for a in (self.t0, self.t1, self.y0, self.y1, self.D))

    def __call__(self, times: Array) -> Array:
        """Return values at `times`, shape (n, m); at an event the value after it."""
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


def pieces_of(records: Array, n: int) -> Dense:
    """Return pieces as views of the rows (t0, t1, y0, y1, D) that an engine writes."""
    k, rows = records.shape[0], (records.shape[1] - 2) // n - 2
    return Dense(
        records[:, 0],
        records[:, 1],
        records[:, 2 : 2 + n],
        records[:, 2 + n : 2 + 2 * n],
        records[:, 2 + 2 * n :].reshape(k, rows, n),
    )


def join(pieces: list[Dense]) -> Dense:
    """Concatenate pieces of several runs, in order."""
    if len(pieces) == 1:
        return pieces[0]
    return Dense(
        np.concatenate([p.t0 for p in pieces]),
        np.concatenate([p.t1 for p in pieces]),
        np.concatenate([p.y0 for p in pieces]),
        np.concatenate([p.y1 for p in pieces]),
        np.concatenate([p.D for p in pieces]),
    )


@final
@dataclass(eq=False)
class Outputs:
    """Unknowns at increasing times; mutable, filled in order.

    The compiled loop repeats `fill` operation by operation (`symfric_outputs` in `march.c`).

    Attributes:
        times: of the result [s], shape (m,).
        values: unknowns there, shape (n, m), known for the first `found` times.
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

        A time at its very end belongs to the next piece, since an event or a break may change the
        values there, unless this is the `last` piece of the run.
        """
        end = int(np.searchsorted(self.times, piece.t1[-1], side="right" if last else "left"))
        if end > self.found:
            self.values[:, self.found : end] = piece(self.times[self.found : end])
            self.found = end

    def stand(self, t: float, y: Array) -> None:
        """Set the remaining times up to `t` [s] to the constant unknowns `y`."""
        end = int(np.searchsorted(self.times, t, side="right"))
        self.values[:, self.found : end] = y[:, None]
        self.found = max(self.found, end)

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
        step: number of accepted steps before it, shape (k,).
        t: time [s], shape (k,).
        size: full size of the step that it cut [s]; negative if nothing of the step is left, 0 if a
            jump led there instead of motion, shape (k,).
        before, after: unknowns just before and after it, shape (k, n).
        which: the events that happened together, shape (k, events).
    """

    step: NDArray[np.intp]
    t: Array
    size: Array
    before: Array
    after: Array
    which: NDArray[np.bool_]

    @classmethod
    def of(cls, rows: Array, n: int, steps: int = 0) -> "Jumps":
        """Build from records (steps before, t, size, y before, y after, which), `steps` already
        made.
        """
        rows = rows.copy()
        return cls(
            rows[:, 0].astype(np.intp) + steps,
            rows[:, 1],
            rows[:, 2],
            rows[:, 3 : 3 + n],
            rows[:, 3 + n : 3 + 2 * n],
            rows[:, 3 + 2 * n :] != 0.0,
        )

    @classmethod
    def joined(cls, parts: "list[Jumps]") -> "Jumps":
        """Concatenate the events of several parts of a run, at least one."""
        return cls(
            np.concatenate([p.step for p in parts]),
            np.concatenate([p.t for p in parts]),
            np.concatenate([p.size for p in parts]),
            np.concatenate([p.before for p in parts]),
            np.concatenate([p.after for p in parts]),
            np.concatenate([p.which for p in parts]),
        )


MOST_BYTES = 64 * 2**20
"""Memory limit of the accepted steps of a run. A longer run keeps only the values at its result
times; dense output is then recomputed by a second run with the same bits.
"""


@final
@dataclass(frozen=True, eq=False)
class Extent:
    """Shortest and longest accepted step [s], least and greatest unknowns (2, n)."""

    shortest: float
    longest: float
    reach: Array


@final
@dataclass(eq=False)
class Run:
    """Mutable record of a run; it survives interrupts and failures.

    Attributes:
        t, y: start.
        outputs: unknowns at the times of the result.
        jumps: the events that happened, with the unknowns on both sides.
        happened: (time, name) of every event.
        steps, attempts: number of accepted steps and of all attempts.
        engine: name of the engine.
        most: memory limit of the accepted steps [bytes].
        again: (times, bytes) -> another run with these outputs and this memory limit; None if this
            run has kept all steps.
        status, message: how it ended.
    """

    t: float
    y: Array
    outputs: Outputs
    jumps: list[Jumps] = field(default_factory=list[Jumps])
    happened: list[tuple[float, str]] = field(default_factory=list[tuple[float, str]])
    steps: int = 0
    attempts: int = 0
    engine: str = ""
    again: Callable[[Array, float], "Run"] | None = None
    status: Status = Status.SUCCESS
    message: str = Status.SUCCESS.value
    most: float = MOST_BYTES
    _kept: list[Dense | Array] = field(default_factory=list[Dense | Array])
    _held: int = 0
    _before: Extent | None = None

    def keep(self, piece: Dense | Array) -> None:
        """Append accepted steps with their continuous solution, or their record rows.

        The run takes ownership of them.
        """
        count = piece.shape[0] if isinstance(piece, np.ndarray) else piece.t0.size
        if not count:
            return
        self.steps += count
        self._kept.append(piece)
        self._held += piece.nbytes
        if self._held > self.most:
            self._before, self._kept = self.extent, [self.last]

    def keep_all(self, steps: Dense) -> None:
        """Replace the kept steps by all steps of the finished run; the counters stay."""
        self._kept = [steps]

    @property
    def kept(self) -> int:
        """Number of accepted steps in memory."""
        return sum(p.shape[0] if isinstance(p, np.ndarray) else p.t0.size for p in self._kept)

    @property
    def complete(self) -> bool:
        """True if all accepted steps are kept."""
        return self._before is None

    def stop(self, status: Status, message: str | None = None) -> None:
        """End the run with `status` and `message`, by default the sentence of the status."""
        self.status, self.message = status, message or status.value

    def _pieces(self) -> list[Dense]:
        n = self.y.size
        found = [pieces_of(p, n) if isinstance(p, np.ndarray) else p for p in self._kept]
        if found:
            return found
        at, y = np.array([self.t]), self.y[None]
        return [Dense(at, np.nextafter(at, np.inf), y, y, np.zeros((1, 0, n)))]

    @cached_property
    def dense(self) -> Dense:
        """Continuous solution over all accepted steps; a long run is recomputed."""
        if self.again is not None:
            return self.again(np.zeros(0), np.inf).dense
        return join(self._pieces())

    @property
    def last(self) -> Dense:
        """Last accepted step, as a copy."""
        p = self._pieces()[-1]
        return Dense(*(a[-1:].copy() for a in (p.t0, p.t1, p.y0, p.y1, p.D)))

    @property
    def reached(self) -> float:
        """Time at the end of the last accepted step [s]."""
        if not self._kept:
            return self.t
        p = self._kept[-1]
        return float(p[-1, 1] if isinstance(p, np.ndarray) else p.t1[-1])

    @property
    def end(self) -> Array:
        """Unknowns at the end of the last accepted step, shape (n,)."""
        if not self._kept:
            return self.y
        p, n = self._kept[-1], self.y.size
        return p[-1, 2 + n : 2 + 2 * n] if isinstance(p, np.ndarray) else p.y1[-1]

    @property
    def extent(self) -> Extent:
        """Range of the step lengths and of the unknowns."""
        lengths = [p.t1 - p.t0 for p in self._pieces()]
        shortest = [float(h.min()) for h in lengths]
        longest = [float(h.max()) for h in lengths]
        if self._before is not None:
            shortest.append(self._before.shortest)
            longest.append(self._before.longest)
        return Extent(min(shortest), max(longest), self.reach)

    @property
    def reach(self) -> Array:
        """Least and greatest unknowns at the start and at the ends of steps, shape (2, n)."""
        found = self._pieces()
        first = found[0].y0[:1] if self._before is None else self._before.reach
        ends = [first, *(p.y1 for p in found)]
        least, most = ([f(y, axis=0) for y in ends] for f in (np.min, np.max))
        return np.array([np.min(least, axis=0), np.max(most, axis=0)])

    @property
    def seen(self) -> tuple[Array, Array]:
        """Start and ends of steps, (k,) and (k, n); for a long run the times of the result."""
        if not self.complete:
            return self.outputs.times[: self.outputs.found], self.outputs.reached.T
        found = self._pieces()
        times, unknowns = [p.t1 for p in found], [p.y1 for p in found]
        return np.concatenate([[self.t], *times]), np.concatenate([self.y[None], *unknowns])

    @property
    def largest(self) -> Array:
        """Largest magnitudes of the unknowns at the start and at the ends of steps, shape (n,)."""
        return np.abs(self.reach).max(axis=0)

    def farthest(self, unknown: int) -> float:
        """Return the largest magnitude of an unknown at the start and at the ends of steps."""
        found = self._pieces()
        first = found[0].y0[0] if self._before is None else self._before.reach
        ends = (first[..., unknown], *(p.y1[:, unknown] for p in found))
        return max(float(np.abs(y).max()) for y in ends)

    def at(self, times: Array) -> Array:
        """Return unknowns at `times` [s], shape (n, times); for a long run by recomputation."""
        if self.again is None or "dense" in self.__dict__:
            return self.dense(times)
        if times.size and times.min() >= self._pieces()[-1].t0[0]:
            return self.last(times)
        wanted, places = np.unique(times, return_inverse=True)
        return self.again(wanted, self.most).outputs.values[:, places]
