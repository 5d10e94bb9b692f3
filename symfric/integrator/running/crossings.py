"""Zero crossings within an accepted step: Functions for both engines, and root search in Python.

All arithmetic on many numbers is in Functions, so that virtual machine and compiled code agree bit
for bit. Only the tests of signs and the Illinois method are written twice, with the same
operations: in Python (`Isolation` and `events`) and in C (`search.c`).

The search isolates roots. Values at five places bound an expression between these places if it is a
polynomial of degree 4 or has one corner (an expression that is linear in the states is such a
polynomial on the dense output of all methods). A piece that may have more roots than the signs at
its ends show is divided into quarters, down to the event tolerance.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from itertools import pairwise
from math import inf
from typing import Any, final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.foundation.numeric import Array
from symfric.integrator.equations.expressions import divided_once
from symfric.integrator.running.record import Record
from symfric.model import Model
from symfric.model.contact import mode_changes, switching

LOOKS = (0.0, 0.25, 0.5, 0.75, 1.0)
"""Relative places at which each step, and each doubtful piece of a step, is evaluated."""
FINER = 64
"""Maximum number of subdivisions per step.

Only crossings whose distance is close to the event tolerance need as many.
"""
AT_ONCE = 8
"""Number of steps that one call of `Crossings.possible` tests."""
ROUNDING = 64 * float(np.finfo(float).eps)
"""Ratio of bends to terms of an expression below which its bends are rounding errors.

A sign change by such a bend is not a crossing.
"""
STRAIGHT = 3.01
"""Ratio of all values to all bends at five places above which no root is hidden.

The formulas require 3; the rest is a margin for rounding. Compiled code makes this test first.
"""
SHARPER = 1e-3
"""Fraction of the tolerance to which events are located.

A ball whose impacts are all late gains energy. It might bounce forever if its impacts lose little.
"""
KEPT = 100
"""Number of event times that are stored to detect an event storm."""
ALIKE = 4
"""Number of consecutive equal events whose intervals are examined for a storm."""
SOON = 2.0
"""Delay after a jump, in event tolerances, at which the new signs are evaluated."""
RESTART, LEAST = 1e3, 1e-3
"""Step after an event, in event tolerances, and its smallest ratio to the step that was cut.

This step only determines the signs after the event. The next one is as long as the step that was
cut, if error control allows: motion after a friction event is usually as smooth as before.
"""


@final
class Memory:
    """Event data kept between steps, a column of numbers that both engines share.

    Layout: phase, tolerance [s], number of jumps, number of consecutive last jumps of one kind,
    step [s] to resume after a jump, times of the last jumps. Then follow, for all events, the
    values before the next step, and flags that are 1 for events of the last jump, else 0.
    """

    PHASE, TOLERANCE, COUNT, ALIKE, RESUME = range(5)
    TIMES = slice(5, 5 + KEPT)
    FRESH, JUMPED, ON = 0.0, 1.0, 2.0
    """Phases of the event values.

    FRESH: they are computed at the start of the step. JUMPED: they are those before a jump at the
    start, NaN for events of that jump. ON: they are those at the end of the previous step.
    """

    @staticmethod
    def before(count: int) -> slice:
        """Return the slice of the values of `count` events."""
        return slice(5 + KEPT, 5 + KEPT + count)

    @staticmethod
    def last(count: int) -> slice:
        """Return the slice of the flags of `count` events that took part in the last jump."""
        return slice(5 + KEPT + count, 5 + KEPT + 2 * count)

    @staticmethod
    def new(count: int, tolerance: float) -> Array:
        """Return the initial memory for the `tolerance` [s] of event times."""
        memory = np.zeros(5 + KEPT + 2 * count)
        memory[Memory.TOLERANCE] = tolerance
        return memory


@final
@dataclass(frozen=True, eq=False)
class Crossings:
    """Functions for the events of a model in one accepted step, a row (t0, t1, y0, y1, D).

    Attributes:
        looks: (low, row, d) -> event values at all `LOOKS` but the first, between low and 1, place
            by place.
        noise: (row, d) -> rounding level of each event in the step.
        doubts: (values at five places, place by place, noise) -> for each piece, nonzero if it may
            have further roots.
        doubt: the same for a single event.
        values: (theta, row, d) -> event values within the step.
        cut: (theta, row) -> the row up to theta, with the same polynomial.
        jump: (row, d) -> event values at the end of the row, and values of all resets there.
        record: layout of a row.
        directions, terminal: direction of each event, and True if it is terminal.
        resets: event number and state number of each reset, in order.
        changes: how each event changes modes of contacts, see `symfric.model.contact.mode_changes`.
        follows: True if algebraic unknowns have to follow a reset.
        closes: True if loops have to be closed again after a reset.
    """

    looks: ca.Function
    noise: ca.Function
    doubts: ca.Function
    doubt: ca.Function
    values: ca.Function
    cut: ca.Function
    jump: ca.Function
    record: Record
    directions: tuple[int, ...]
    terminal: tuple[bool, ...]
    resets: tuple[tuple[int, int], ...]
    changes: tuple[int, ...]
    follows: bool
    closes: bool

    @cached_property
    def decided(self) -> NDArray[np.bool_]:
        """Mask of the events of contacts whose modes are decided together."""
        return np.array(self.changes) == 1

    @property
    def count(self) -> int:
        """Number of events."""
        return len(self.directions)

    @property
    def width(self) -> int:
        """Length of the record of a jump: (steps before it, t, size, y before, y after, which)."""
        return 3 + 2 * self.record.n + self.count

    @property
    def data(self) -> int:
        """Number of entries of d."""
        return self.jump.numel_in(1)

    @cached_property
    def possible(self) -> ca.Function:
        """(values before, `AT_ONCE` rows, their d) -> values at their ends, 1 for possible events.

        It makes the tests of `Isolation` without noise. They save the virtual machine most
        searches.
        """
        five, directions = ca.SX.sym("five", len(LOOKS) * self.count), ca.DM(self.directions)
        none, pieces = ca.SX.zeros(self.count), ca.vertsplit(five, self.count)
        crossed = [passed(*ends, directions) for ends in pairwise(pieces)]
        test = ca.vertcat(self.doubts(five, none), *crossed)
        some = ca.Function("symfric_some", [five], [ca.mmax(test)])
        before, row = ca.MX.sym("before", self.count), ca.MX.sym("row", self.record.width)
        d = ca.MX.sym("d", self.data)
        after = self.looks(0.0, row, d)
        results = [after[-self.count :], some(ca.vertcat(before, after))]
        step = ca.Function("symfric_possible", [before, row, d], results)
        return step.mapaccum(AT_ONCE)

    @property
    def functions(self) -> tuple[ca.Function, ...]:
        """Functions that the compiled search calls."""
        return self.looks, self.noise, self.doubt, self.values, self.cut, self.jump


def crossings(
    model: Model, values: ca.Function, sizes: ca.Function, resets: ca.Function, rows: int,
    follows: bool, closes: bool,
) -> Crossings:  # fmt: skip
    """Build the Functions of `Crossings`.

    Args:
        model: model with the events.
        values: (t, y, d) -> value of each event.
        sizes: (t, y, d) -> for each event, the sum of the magnitudes of the contributions of t and
            y.
        resets: (t, y, d) -> value of each reset, event after event.
        rows: number of rows of the dense output.
        follows, closes: as in `Crossings`.
    """
    events, states = model.events, [v.name for v in model.x]
    at = Record(values.numel_in(1), rows)
    row, d = ca.SX.sym("row", at.width), ca.SX.sym("d", values.numel_in(2))
    theta, low, end = ca.SX.sym("theta"), ca.SX.sym("low"), (row[at.T1], row[at.y1])
    looks = [_place(at, row, low + s * (1 - low)) if s < 1 else end for s in LOOKS[1:]]
    level = ROUNDING * sizes(*end, d)
    return Crossings(
        _function("looks", [low, row, d], [ca.vertcat(*(values(*look, d) for look in looks))]),
        _function("noise", [row, d], [ca.if_else(level < inf, level, 0)]),
        _doubtful("doubts", len(events)),
        _doubtful("doubt", 1),
        _function("values", [theta, row, d], [values(*_inside(at, row, theta), d)]),
        cutting(at),
        _function("jump", [row, d], [values(*end, d), resets(*end, d)]),
        at,
        tuple(e.direction for e in events),
        tuple(e.terminal for e in events),
        tuple((i, states.index(name)) for i, e in enumerate(events) for name in e.reset),
        mode_changes(switching(model.contacts, model.x, events), events),
        follows,
        closes,
    )


def _function(name: str, arguments: list[ca.SX], results: list[ca.SX]) -> ca.Function:
    dense = [ca.densify(divided_once(result)) for result in results]
    return ca.Function(f"symfric_{name}", arguments, dense, {"cse": True})


def _doubtful(name: str, count: int) -> ca.Function:
    """Return a Function that tests each piece between five values for hidden roots.

    If an expression is a polynomial of degree 4, or a line with one corner, it is off its chord by
    at most S x (1 - x), 0 <= x <= 1, on inner pieces, and by S (1 - x) from the outer end on outer
    pieces. On inner pieces, S is the sum of the second differences at their ends and an eighth of
    the third one; on outer pieces, it bounds half the second derivative. An expression above that
    bound has one sign, or is monotonic. A bend below the noise is rounding.
    """
    five, noise = ca.SX.sym("values", len(LOOKS) * count), ca.SX.sym("noise", count)
    values = ca.vertsplit(five, count)
    a, b, c = (x - 2 * y + z for x, y, z in zip(values, values[1:], values[2:], strict=False))
    bows, sizes = [ca.fabs(x) for x in (a, b, c)], [ca.fabs(x) for x in values]
    first = 0.75 * (ca.fabs(3 * (a - b) + c) + bows[0]) + bows[1] / 8
    last = 0.75 * (ca.fabs(3 * (c - b) + a) + bows[2]) + bows[1] / 8
    doubts = ca.vertcat(
        sizes[0] < first - noise,
        sizes[1] + sizes[2] < bows[0] + bows[1] + bows[2] / 8 - noise,
        sizes[2] + sizes[3] < bows[0] / 8 + bows[1] + bows[2] - noise,
        sizes[4] < last - noise,
    )
    return _function(name, [five, noise], [doubts])


def _place(at: Record, row: ca.SX, theta: Any) -> tuple[ca.SX, ca.SX]:
    """Return time and unknowns within a step, as in `Dense`."""
    bend: Any = 0.0
    for k in reversed(range(at.rows)):
        bend = row[at.bend(k)] + theta * bend
    t = row[at.T0] + theta * (row[at.T1] - row[at.T0])
    return t, (1 - theta) * row[at.y0] + theta * (row[at.y1] + (1 - theta) * bend)


def _inside(at: Record, row: ca.SX, theta: ca.SX) -> tuple[ca.SX, ca.SX]:
    """Return time and unknowns as `_place` does, with the time limited to the end of the step."""
    t, y = _place(at, row, theta)
    return ca.if_else(theta < 1, ca.fmin(t, row[at.T1]), row[at.T1]), y


def cutting(at: Record) -> ca.Function:
    """Return the Function (theta, row) -> the row up to theta, with the same polynomial.

    The new coefficients satisfy d'_k - d'_(k+1) = theta^(k+1) [d_k - d_(k+1)], d_(r+1) = 0.
    """
    row, theta = ca.SX.sym("row", at.width), ca.SX.sym("theta")
    t, y = _inside(at, row, theta)
    powers = [theta * theta]
    for _ in range(at.rows - 1):
        powers.append(powers[-1] * theta)
    bends: list[ca.SX] = []
    old, new = ca.SX.zeros(at.n), ca.SX.zeros(at.n)
    for k in reversed(range(at.rows)):
        here = row[at.bend(k)]
        new, old = new + powers[k] * (here - old), here
        bends.insert(0, new)
    return _function("cut", [theta, row], [ca.vertcat(row[at.T0], t, row[at.y0], y, *bends)])


LEAST_PART = 1e-15
"""Shortest fraction of a step that rounding resolves."""


@final
class Isolation:
    """Search for the first roots in one step.

    Args:
        values: theta -> value of each event.
        doubts: (values at five places) -> for each piece and event, nonzero if it may have more
            roots than the signs show.
        directions: directions of the events.
        tolerance: tolerance of event times, as a fraction of the step.

    Attributes:
        roots: first root found of each event, inf if there is none.
        left: number of subdivisions that are still allowed.
    """

    def __init__(
        self,
        values: Callable[[float], Array],
        doubts: Callable[[Array], Array],
        directions: NDArray[np.intp],
        tolerance: float,
    ) -> None:
        self.values, self.doubts, self.directions = values, doubts, directions
        self.tolerance, self.share = tolerance, max(SHARPER * tolerance, LEAST_PART)
        self.roots, self.left = np.full(directions.size, np.inf), FINER

    def first(self, at: Sequence[float], g: Array, doubts: Array) -> float:
        """Return the first root between the places `at` with values g, or a value beyond them.

        If a root is certain, doubtful events without a root of their own are searched once more
        before it, because events that jump with it do not jump earlier. All other doubtful events
        are searched piece by piece.
        """
        hits = passed(g[:-1], g[1:], self.directions) & (self.roots > at[0])
        suspects, sure = doubts != 0, float(self.roots.min())
        doubtful = bool(suspects.any())
        if doubtful:
            long = np.diff(at)[:, None] > max(self.tolerance, LEAST_PART)
            suspects &= long & (self.left > 0)
        for k in np.flatnonzero((hits & ~suspects).any(axis=1)).tolist() if hits.any() else ():
            if at[k] < sure:
                for i in np.flatnonzero(hits[k] & ~suspects[k]).tolist():
                    value = partial(self._value, i)
                    ends = float(g[k, i]), float(g[k + 1, i])
                    self.roots[i] = locate(value, at[k], at[k + 1], ends, self.share)
                sure = float(self.roots.min())
        if not doubtful:
            return sure
        if sure <= at[-1]:
            others = suspects & (self.roots > 1) & (np.array(at[:-1]) < sure)[:, None]
            if others.any():
                suspects &= ~others
                sure = self._again(at[0], sure - self.share, g[0], np.any(others, axis=0))
        for k in np.flatnonzero(suspects.any(axis=1)).tolist():
            if at[k] >= sure:
                break
            found = self._again(at[k], at[k + 1], g[k], suspects[k])
            if found <= at[k + 1]:
                return found
        return float(self.roots.min())

    def _value(self, event: int, theta: float) -> float:
        return float(self.values(theta)[event])

    def _again(self, a: float, b: float, before: Array, suspects: NDArray[np.bool_]) -> float:
        """Repeat `first` from a to b for the doubtful events; `before` holds the values at a."""
        self.left -= 1
        b = max(a, b)
        at = [a, *(a + s * (b - a) for s in LOOKS[1:])]
        g = np.stack([before, *map(self.values, at[1:])])
        return self.first(at, g, self.doubts(g) * suspects)


def passed(before: Any, after: Any, directions: Any) -> Any:
    """Return a mask of the events that pass zero in their directions, for arrays, SX and DM."""
    rising = (before < 0) * (after >= 0) * (directions >= 0)
    return rising + (before > 0) * (after <= 0) * (directions <= 0)


def locate(
    value: Callable[[float], float], a: float, b: float, ends: tuple[float, float], tolerance: float
) -> float:
    """Return the root in [a, b] of a function, rounded up.

    Its values at a and b, the `ends`, differ in sign. The Illinois method is used.
    """
    fa, fb = ends
    if fb == 0.0:
        return b
    side = 0
    for _ in range(100):
        if not b - a > tolerance:
            break
        c = (fa * b - fb * a) / (fa - fb)
        c = min(max(c, a + 1e-3 * (b - a)), b - 1e-3 * (b - a)) if side else c
        fc = value(c)
        if fc == 0.0:
            return c
        if (fc > 0) == (fb > 0):
            b, fb = c, fc
            fa = fa / 2 if side == 1 else fa
            side = 1
        else:
            a, fa = c, fc
            fb = fb / 2 if side == -1 else fb
            side = -1
    return b
