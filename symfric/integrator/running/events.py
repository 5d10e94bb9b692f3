"""Events: zero crossings in accepted steps, located and carried out.

This file contains the search of the virtual machine, and the types that both engines share.
`search.c` repeats the search in C, operation by operation.
"""

from collections.abc import Sequence
from enum import IntEnum
from functools import cached_property, partial
from typing import final

import numpy as np
from numpy.typing import NDArray

from symfric.foundation.numeric import Array, Buffered, bound
from symfric.integrator.equations.initial import SURE
from symfric.integrator.methods.attempt import RRow, SRow
from symfric.integrator.running import crossings as limits
from symfric.integrator.running.crossings import (
    AT_ONCE,
    LOOKS,
    Crossings,
    Isolation,
    Memory,
    passed,
)
from symfric.integrator.running.record import Jumps, Record
from symfric.model.parts import Event

JUMPS = 512
"""Number of jumps recorded between two returns of an engine."""


class Stop(IntEnum):
    """Reason why an engine returned; some of the reasons are requests of events.

    `SEARCH`: algebraic unknowns need a full search after a jump of inputs. `FOLLOW`: algebraic
    unknowns have to follow an event. `DECIDE`: the modes of contacts have to be decided together.
    """

    END = 0
    FULL = 1
    ATTEMPTS = 2
    STEP_TOO_SMALL = 3
    TERMINAL = 4
    STORM = 5
    FOLLOW = 6
    SEARCH = 7
    DECIDE = 8


class Change(IntEnum):
    """Change of a step by the event search."""

    NOTHING = 0
    RESUMED = 1
    CUT = 2
    DROPPED = 3


@final
class Eventful:
    """Event data of a run in progress, which the engines read and write.

    Attributes:
        crossings: Functions of the events of the model.
        steps: number of accepted steps in the current engine call.
        memory: see `Memory`.
        rows: records of jumps; the first `count` rows are in use.
    """

    def __init__(self, crossings: Crossings, tolerance: float = 0.0) -> None:
        self.crossings, self.memory = crossings, Memory.new(crossings.count, tolerance)
        self.count = self.steps = 0
        self.rows = np.empty((JUMPS, crossings.width))

    def begin(self, tolerance: float) -> None:
        """Forget the last run; events have this `tolerance` [s] of their times."""
        self.memory[:] = 0.0
        self.memory[Memory.TOLERANCE] = tolerance
        self.count = self.steps = 0

    @property
    def tolerance(self) -> float:
        """Tolerance of event times [s]."""
        return float(self.memory[Memory.TOLERANCE])

    @cached_property
    def search(self) -> "Search":
        """Event search of the virtual machine, with its buffers."""
        return Search(self)

    @property
    def full(self) -> bool:
        """True if the record of jumps is full."""
        return self.count >= self.rows.shape[0]

    @property
    def pointers(self) -> tuple[int, int, int]:
        """Addresses of memory and rows, and the number of rows, for compiled code."""
        return self.memory.ctypes.data, self.rows.ctypes.data, self.rows.shape[0]

    def jumps(self, steps: int) -> Jumps:
        """Return the jumps of the last engine call, made after `steps` accepted steps."""
        return Jumps.of(self.rows[: self.count], self.crossings.record.n, steps)

    def entered(self) -> None:
        """Record that the run data have jumped.

        The stored values are then those at the end of the last step, or before another jump there.
        """
        if self.memory[Memory.PHASE] == Memory.ON:
            self.memory[Memory.PHASE] = Memory.JUMPED

    def decided(self) -> None:
        """Record that the modes of all contacts were decided, so none of them has to change."""
        count = self.crossings.count
        self.memory[Memory.before(count)][self.crossings.decided] = np.nan
        self.memory[Memory.last(count)][self.crossings.decided] = 0.0

    def started(self, events: Sequence[Event], values: Array) -> None:
        """Store values just before the start for events that have already happened at the start.

        The other events keep their `values` at the start.
        """
        if any(event.at_start for event in events):
            self.memory[Memory.PHASE] = Memory.JUMPED
            self.memory[Memory.before(self.crossings.count)] = [
                -e.direction if e.at_start else x for e, x in zip(events, values, strict=True)
            ]


@final
class Search:
    """Event search after each accepted step, equal to the search of the compiled loop."""

    def __init__(self, eventful: Eventful) -> None:
        self.eventful, self.crossings = eventful, eventful.crossings
        self.memory = eventful.memory
        self._before = self.memory[Memory.before(self.crossings.count)]
        functions = map(Buffered, self.crossings.functions)
        self._looks, self._noise, _, self._values, self._cut, self._jump = functions
        self._doubts = Buffered(self.crossings.doubts)
        self._directions = np.array(self.crossings.directions)
        self._changes = np.array(self.crossings.changes)
        count = self.crossings.count
        self._none, self._first = np.zeros((2, count))
        self._ends = np.zeros((AT_ONCE, count))
        self._rows = np.zeros((AT_ONCE, self.crossings.record.width))
        self._data, self._some = np.zeros((AT_ONCE, self.crossings.data)), np.zeros(AT_ONCE)
        inputs = self._first, self._rows, self._data
        self._possible = bound(self.crossings.possible, inputs, (self._ends, self._some))

    def without(self, rows: Array, R: Array) -> int:
        """Return the number of leading accepted steps among `rows` that surely have no event."""
        if self.memory[Memory.PHASE] != Memory.ON or self.memory[Memory.RESUME]:
            return 0
        self._data[:] = R[R.size - self.crossings.data :]
        done = 0
        while done < len(rows):
            part = rows[done : done + AT_ONCE]
            self._first[:], self._rows[: len(part)] = self._before, part
            self._possible()
            some = self._some[: len(part)] != 0
            passed_by = int(some.argmax()) if some.any() else len(part)
            if passed_by:
                self._before[:] = self._ends[passed_by - 1]
            done += passed_by
            if passed_by < len(part):
                break
        self.eventful.steps += done
        return done

    def __call__(self, row: Array, S: Array, R: Array) -> tuple[Change, Stop | None]:
        """Search the accepted step `row`, which led to S, for events.

        The first events are carried out: the row is cut there, and S continues after them. If they
        happen at the very start of the step, the row is dropped. Without events, the next step in S
        may be lengthened if an earlier event shortened it.
        """
        d = R[R.size - self.crossings.data :]
        found = self._crossing(row, d)
        if found is None:
            self.eventful.steps += 1
            h = min(float(self.memory[Memory.RESUME]), float(R[RRow.H_MAX]))
            self.memory[Memory.RESUME] = 0.0
            if S[SRow.H] >= h:
                return Change.NOTHING, None
            S[SRow.H] = h
            return Change.RESUMED, None
        theta, which = found
        h = float(row[Record.T1] - row[Record.T0])
        self.memory[Memory.RESUME] = max(self.memory[Memory.RESUME], h)
        (cut,) = self._cut(theta, row)
        t, record = float(cut[Record.T1]), self.crossings.record
        kept = t != row[Record.T0]
        size = (h if kept else -h) if theta > 0 else 0.0
        row[:] = cut if kept else row
        self._before[:], fresh = self._jump(cut, d)
        self._before[which] = np.nan
        self.memory[Memory.PHASE] = Memory.JUMPED
        before, after = cut[record.y1], cut[record.y1].copy()
        for (event, state), value in zip(self.crossings.resets, fresh, strict=True):
            after[state] = value if which[event] else after[state]
        self.eventful.steps += kept
        steps = self.eventful.steps
        self.eventful.rows[self.eventful.count] = [steps, t, size, *before, *after, *which]
        self.eventful.count += 1
        # the step size after an event is a guess: earlier steps are no guide, since the dynamics
        # may be faster
        again = max(
            min(h, limits.RESTART * self.eventful.tolerance), limits.LEAST * h, SURE * abs(t)
        )
        S[:] = SRow.at(t, again, after)
        return (Change.CUT if kept else Change.DROPPED), self._request(t, which)

    def _request(self, t: float, which: NDArray[np.bool_]) -> Stop | None:
        """Return the request of the events `which` at time `t`."""
        if any(over for over, here in zip(self.crossings.terminal, which, strict=True) if here):
            return Stop.TERMINAL
        several = piled(self.memory, t, which, self._changes)
        if storm(self.memory, t, which):
            return Stop.STORM
        if several:
            return Stop.DECIDE
        return Stop.FOLLOW if self.crossings.follows else None

    def _crossing(self, row: Array, d: Array) -> tuple[float, NDArray[np.bool_]] | None:
        """Return the place of the first events in the step and a mask of them; None without events.

        After a jump, the signs are evaluated a few tolerances later. An expression that the jump
        carried through zero, not just to zero, is an event at the very start.
        """
        memory, count = self.memory, self.crossings.count
        tolerance = self.eventful.tolerance
        h, low = float(row[Record.T1] - row[Record.T0]), 0.0
        g = np.empty((len(LOOKS), count))
        jumped = np.zeros(count, dtype=bool)
        if memory[Memory.PHASE] == Memory.ON:
            g[0] = self._before
        elif memory[Memory.PHASE] == Memory.FRESH:
            g[0] = self._inside(row, d, 0.0)
        else:
            low = min(limits.SOON * tolerance / h, 0.1)
            g[0] = self._inside(row, d, low)
            jumped = passed(self._before, g[0], self._directions) & (g[0] != 0)
        g[1:] = self._looks(low, row, d)[0].reshape(-1, count)
        doubts = self._doubted(self._none, g)
        if doubts.any() or passed(g[:-1], g[1:], self._directions).any() or jumped.any():
            noise = self._noise(row, d)[0] if doubts.any() else self._none
            doubted, inside = partial(self._doubted, noise), partial(self._inside, row, d)
            found = Isolation(inside, doubted, self._directions, tolerance / h)
            found.roots[jumped] = 0.0
            theta = found.first([low + s * (1 - low) for s in LOOKS], g, doubted(g))
            if theta <= 1:
                return theta, (found.roots - theta) * h <= tolerance
        self._before[:] = g[-1]
        memory[Memory.PHASE] = Memory.ON
        return None

    def _inside(self, row: Array, d: Array, theta: float) -> Array:
        """Return the event values at `theta` within a step."""
        return self._values(theta, row, d)[0]

    def _doubted(self, noise: Array, g: Array) -> Array:
        """Return an array over pieces and events, nonzero where a piece is doubtful."""
        return self._doubts(g.ravel(), noise)[0].reshape(-1, g.shape[1])


def piled(memory: Array, t: float, which: NDArray[np.bool_], changes: NDArray[np.intp]) -> bool:
    """Return True if events `which` change several modes at time `t`, at once or one by one.

    `changes` are those of `Crossings`; an event with the number 2 may change all modes.
    """
    own, last = int(changes[which].sum()), memory[Memory.last(which.size)] != 0
    if own != 1 or not (changes[last] == 1).any():
        return own > 1
    count = int(memory[Memory.COUNT])
    apart = max(float(memory[Memory.TOLERANCE]), float(np.spacing(abs(t))))
    return t - float(memory[Memory.TIMES][(count - 1) % limits.KEPT]) < 10 * apart


def storm(memory: Array, t: float, which: NDArray[np.bool_]) -> bool:
    """Record the events `which` at time `t`; return True if they complete a storm.

    Events that accumulate at one time (Zeno) must not stop the clock. Four consecutive events of
    one kind are a storm if their intervals shrink like a geometric series with less than a thousand
    event tolerances still to come. A hundred events are a storm if they are less than a few
    tolerances, or roundings of the clock, apart. Frequent events of a fast machine, or many events
    in a long run, are not a storm.
    """
    last, times = memory[Memory.last(which.size)], memory[Memory.TIMES]
    memory[Memory.ALIKE] = memory[Memory.ALIKE] + 1 if (last == which).all() else 1
    last[:] = which
    count = int(memory[Memory.COUNT]) + 1
    times[(count - 1) % limits.KEPT] = t
    memory[Memory.COUNT] = count
    tolerance = float(memory[Memory.TOLERANCE])
    apart = max(tolerance, float(np.spacing(abs(t))))
    if count >= limits.KEPT and t - times[count % limits.KEPT] < 10 * apart * limits.KEPT:
        return True
    if memory[Memory.ALIKE] < limits.ALIKE:
        return False
    recent = times[np.arange(count - limits.ALIKE, count) % limits.KEPT]
    a, b, c = (float(gap) for gap in np.diff(recent))
    return b < a and c < b and c * c / (b - c) < 1000 * tolerance
