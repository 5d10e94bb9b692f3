"""What a run has produced: accepted steps, as many as are worth their memory, and what happened."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import final

import numpy as np
from numpy.typing import NDArray

from symfric.foundation.status import Status
from symfric.integrator.running.dense import Dense, Outputs, join, pieces_of
from symfric.integrator.running.events import Jumps
from symfric.integrator.running.integrator import Integrator

Array = NDArray[np.float64]
MOST_BYTES = 64 * 2**20
"""Of accepted steps that a run keeps. A longer one keeps none: its results stand at their times,
and who asks for what lies between lets it run again, to the bit."""


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
    """What a run has produced so far; a mutable record that survives interrupts and failures.

    Attributes:
        t, y: where it started.
        outputs: unknowns at the times of the result.
        jumps: the events that happened, with the unknowns on both sides.
        happened: (time, name) of every event.
        steps, attempts: how many, accepted and all.
        engine: what ran it.
        most: bytes of accepted steps that it keeps.
        integrator: the one it ended with: pivots that fail on the way are replaced.
        again: (times, bytes) -> another run with these outputs, which keeps so many bytes of steps;
            None where this one has kept all.
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
    integrator: Integrator | None = None
    again: Callable[[Array, float], "Run"] | None = None
    status: Status = Status.SUCCESS
    message: str = Status.SUCCESS.value
    most: float = MOST_BYTES
    _kept: list[Dense | Array] = field(default_factory=list[Dense | Array])
    _held: int = 0
    _before: Extent | None = None

    def keep(self, piece: Dense | Array) -> None:
        """Append accepted steps with their continuous solution, or rows of records of them.

        They belong to the run from now on.
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
        """Take the steps of a run that is over, all that it counts already."""
        self._kept = [steps]

    @property
    def kept(self) -> int:
        """How many accepted steps are in memory."""
        return sum(p.shape[0] if isinstance(p, np.ndarray) else p.t0.size for p in self._kept)

    @property
    def complete(self) -> bool:
        """Whether all accepted steps are kept."""
        return self._before is None

    def stop(self, status: Status, message: str | None = None) -> None:
        """End the run with `status`, said in `message` or in the sentence of the status."""
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
        """The continuous solution over all accepted steps, of a long run by another one."""
        if self.again is not None:
            return self.again(np.zeros(0), np.inf).dense
        return join(self._pieces())

    @property
    def last(self) -> Dense:
        """The last accepted step, as a copy."""
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
        """How long the steps are and how large the unknowns become."""
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
        """Start and ends of steps, (k,) and (k, n); of a long run the times of the result."""
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
        """Largest magnitude of an unknown at the start and at the ends of steps."""
        found = self._pieces()
        first = found[0].y0[0] if self._before is None else self._before.reach
        ends = (first[..., unknown], *(p.y1[:, unknown] for p in found))
        return max(float(np.abs(y).max()) for y in ends)

    def at(self, times: Array) -> Array:
        """Unknowns at `times` [s], shape (n, times), of a long run as outputs of another one."""
        if self.again is None or "dense" in self.__dict__:
            return self.dense(times)
        if times.size and times.min() >= self._pieces()[-1].t0[0]:
            return self.last(times)
        wanted, places = np.unique(times, return_inverse=True)
        return self.again(wanted, self.most).outputs.values[:, places]
