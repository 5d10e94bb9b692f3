"""Derivatives across jumps: saltation matrices.

The time of an event g(t, y, d) = 0 depends on the parameters. With S the derivatives of y at a
fixed
time before it, f the rate of y and a reset r,

    t*' = -(g_y S + g_d d') / (g_y f + g_t)
    S   <- S + f t*'                                of y at the event, which moves
    S   <- C (r_y S + r_t t*' + r_d d') + C_d d'     after the reset

where C updates the algebraic unknowns, and the next step starts at the event, so it is shorter by
t*'. An event caused by another jump shares the time of that jump. Events at one instant whose times
differ in their derivatives are taken one after another, with f between them; if another order leads
to another state, the motion has no derivative.

Source: Aizerman and Gantmakher, Quart. J. Mech. Appl. Math., 1958; Leine and Nijmeijer, Dynamics
and Bifurcations of Non-Smooth Mechanical Systems, 2004 (saltation matrix).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import permutations
from typing import final

import numpy as np
from numpy.typing import NDArray

from symfric.foundation.checks import listed
from symfric.integrator.derivatives.functions import Derivatives, derivatives
from symfric.integrator.derivatives.path import Jump, Path
from symfric.integrator.equations.initial import ASSEMBLED, ITERATIONS, consistent

Array = NDArray[np.float64]
GRAZING = 1e-6
"""Rate of an event expression over its mean rate in the step before, below which it touches zero
without crossing it; the square is the limit of the rate over its terms.
"""
SAME = 1e-6
"""Relative difference of two orders of events that counts as equal."""
MOST = 4
"""Number of simultaneous events up to which all orders are tried; for more, neighbours are
exchanged."""


@final
@dataclass(frozen=True, eq=False)
class Passage:
    """Derivatives after a jump in terms of those before it: X -> by_state X + by_data d'.

    X holds the derivatives of y and, in its last row, of the time at which y is evaluated.

    Attributes:
        by_state: shape (n + 1, n + 1).
        by_data: shape (n + 1, n_d).
    """

    by_state: Array
    by_data: Array

    def then(self, other: "Passage") -> "Passage":
        """Return this passage followed by `other`."""
        through = other.by_state @ self.by_data + other.by_data
        return Passage(other.by_state @ self.by_state, through)


def at_start(path: Path) -> Passage:
    """Return the passage from given to consistent start values."""
    d = path.data(np.zeros(1, dtype=np.intp))[0]
    return _followed(path, path.guess, path.dense.y0[0], d)


def passage(path: Path, jump: Jump) -> Passage:
    """Return the passage of events.

    Derivatives before it are of y at the time of the events; if these cut a step, at a fixed time.

    Raises:
        ValueError: an event that only touches zero, events at one instant that do not commute, or
            one that coincides with a jump of the inputs.
    """
    d = path.data(np.array([path.place(jump)]))[0]
    here = _Instant(path, derivatives(path.integrator), jump.t, d)
    if jump.at_once:
        return here.reset(jump.before, jump.which, jump.after)
    if jump.size:
        _alone_in_time(path, here, jump)
        return here.crossed(jump, here.before(jump))
    rate = here.before(jump)
    return here.to_fixed_time(rate).then(here.crossed(jump, rate))


def _followed(path: Path, y: Array, found: Array, d: Array) -> Passage:
    """Return the passage of `consistent` from y to `found`."""
    made = derivatives(path.integrator)
    n, free = made.system.n, made.system.free
    by_y, by_d = np.eye(n), np.zeros((n, d.size))
    manifold = made.system.manifold
    if manifold is not None and made.assembly is not None:
        for _ in range(ITERATIONS):
            slope, more = (m.full() for m in made.assembly.call([y, d]))
            by_y, by_d = slope @ by_y, slope @ by_d + more
            y = manifold.project(y, d).full().ravel()
            size = max(1.0, float(np.abs(y[: made.system.nx]).max(initial=0.0)))
            if np.abs(manifold.defect(y, d).full()).max(initial=0.0) < ASSEMBLED * size:
                break
    if free.size:
        slope, more = (m.full() for m in made.algebraic.call([found, d]))
        by_d -= free @ np.linalg.solve(slope @ free, slope @ by_d + more)
        by_y -= free @ np.linalg.solve(slope @ free, slope @ by_y)
    by_state = np.eye(n + 1)
    by_state[:n, :n] = by_y
    return Passage(by_state, np.vstack([by_d, np.zeros(d.size)]))


def _alone_in_time(path: Path, here: "_Instant", jump: Jump) -> None:
    """Check that no event that moves coincides with a jump of the inputs, where rates change.

    Raises:
        ValueError: one does.
    """
    breaks, k = path.inputs.breaks, path.place(jump)
    for edge in (k, k + 1):
        if not 0 < edge < breaks.size - 1 or abs(breaks[edge] - jump.t) > path.tolerance:
            continue
        other = _Instant(path, here.made, jump.t, path.data(np.array([2 * edge - 1 - k]))[0])
        moved = not all(_near(here.rate(y), other.rate(y)) for y in (jump.before, jump.after))
        if moved and any(here.delay(i, jump.before, here.before(jump)).any() for i in jump.which):
            raise ValueError(
                f"{here.where(jump.which)}: expected an event apart from the jumps of the inputs, "
                f"got one at t = {breaks[edge]:.9g} s; the derivatives before and after it "
                "differ"
            )


def _near(one: Array, other: Array) -> bool:
    """Return True if two arrays are equal, relative to their largest entry."""
    return bool(np.abs(one - other).max(initial=0.0) <= SAME * np.abs(one).max(initial=0.0))


@final
@dataclass(frozen=True, eq=False)
class _Instant:
    """Instant at which events happen: the run, its Functions, time and run data."""

    path: Path
    made: Derivatives
    t: float
    d: Array

    def where(self, which: Sequence[int]) -> str:
        """Return the location for messages."""
        model = self.path.integrator.model
        names = listed(f"'{model.events[i].name}'" for i in which)
        return f"sensitivities of '{model.name}': event {names} at t = {self.t:.9g} s"

    def rate(self, y: Array) -> Array:
        """Return the rates y' of the equations."""
        matrix, right = (m.full() for m in self.made.rates.call([y, self.d]))
        return np.linalg.solve(matrix, right[:, 0]).astype(float)

    def before(self, jump: Jump) -> Array:
        """Return the rates just before events, where modes and inputs are unchanged.

        They come from the equations: in a step that a jump of the force ended, dense output has a
        mean
        rate.
        """
        if not jump.size:
            return self.rate(jump.before)
        dense, k = self.path.dense, np.array([jump.step - 1])
        back = 2 * max(self.path.tolerance, float(np.spacing(abs(jump.t))))
        theta = 1.0 - back / (dense.t1[k] - dense.t0[k])
        return self.rate(dense.piece(k, np.maximum(theta, 0.0))[0])

    def delay(self, event: int, y: Array, slope: Array) -> Array:
        """Return the derivative of the time of an event by y at a fixed time and by d, shape (n +
        n_d,).

        Raises:
            ValueError: its expression only touches zero.
        """
        by_t, by_y, by_d = self.slopes_of(event, y)
        rate = float(by_y @ slope + by_t[0])
        terms = float(np.abs(by_y) @ np.abs(slope) + abs(by_t[0]))
        if not abs(rate) > max(GRAZING**2 * terms, GRAZING * self.mean_rate(event)):
            raise ValueError(
                f"{self.where([event])}: expected an expression that crosses zero, got one that "
                f"touches it at a rate of {rate:.3g} per second; the time of such an event has no "
                "derivative"
            )
        return -np.concatenate([by_y, by_d]) / rate

    def slopes_of(self, event: int, y: Array) -> tuple[Array, Array, Array]:
        """Return derivatives of an event expression by t, y and d."""
        found = self.made.of_events.call([self.t, y, self.d])
        by_t, by_y, by_d = (m.full()[event] for m in found)
        return by_t, by_y, by_d

    def speed(self, event: int, y: Array, slope: Array) -> float:
        """Return the rate of an event expression."""
        by_t, by_y, _ = self.slopes_of(event, y)
        return float(by_y @ slope + by_t[0])

    def mean_rate(self, event: int) -> float:
        """Return the mean rate of an event expression in the step before."""
        path = self.path
        k = int(np.searchsorted(path.dense.t1, self.t, side="left"))
        if k == path.dense.t0.size or path.dense.t1[k] != self.t:
            return 0.0
        t0, y0 = float(path.dense.t0[k]), path.dense.y0[k]
        return abs(float(self.made.events(t0, y0, self.d)[event])) / (self.t - t0)

    def reset(self, y: Array, which: Sequence[int], found: Array) -> Passage:
        """Return the passage of the resets of events at y; `found` is y after them."""
        n = y.size
        by_state, by_data = np.eye(n + 1), np.zeros((n + 1, self.d.size))
        by_t, by_y, by_d = (m.full() for m in self.made.of_resets.call([self.t, y, self.d]))
        for k, (event, state) in enumerate(self.resets):
            if event in which:
                by_state[state] = np.append(by_y[k], by_t[k])
                by_data[state] = by_d[k]
        after = self.after(y, which)
        return Passage(by_state, by_data).then(_followed(self.path, after, found, self.d))

    @property
    def resets(self) -> tuple[tuple[int, int], ...]:
        """Numbers of event and state of each reset."""
        crossings = self.path.integrator.crossings
        return () if crossings is None else crossings.resets

    def after(self, y: Array, which: Sequence[int]) -> Array:
        """Return unknowns y after the resets of events, algebraic ones as before."""
        fresh = self.made.resets(self.t, y, self.d).full().ravel()
        after = y.copy()
        for value, (event, state) in zip(fresh, self.resets, strict=True):
            after[state] = value if event in which else after[state]
        return after

    def to_fixed_time(self, rate: Array) -> Passage:
        """Return the passage from derivatives of y at a moving time to those at a fixed time."""
        by_state = np.eye(rate.size + 1)
        by_state[:-1, -1] = -rate
        by_state[-1, -1] = 0.0
        return Passage(by_state, np.zeros((rate.size + 1, self.d.size)))

    def to_event(self, delay: Array, slope: Array) -> Passage:
        """Return the passage from derivatives of y at a fixed time to those at an event."""
        n = slope.size
        times = np.vstack([slope[:, None], [[1.0]]]) @ delay[None]
        by_state = np.zeros((n + 1, n + 1))
        by_state[:n, :n] = np.eye(n)
        by_state[:, :n] += times[:, :n]
        return Passage(by_state, times[:, n:])

    def crossed(self, jump: Jump, slope: Array) -> Passage:
        """Return the passage of crossed events from derivatives at a fixed time before them."""
        groups: list[tuple[Array, list[int]]] = []
        for i in jump.which:
            delay = self.delay(i, jump.before, slope)
            own = next((events for other, events in groups if _near(other, delay)), None)
            if own is None:
                groups.append((delay, [i]))
            else:
                own.append(i)
        if len(groups) == 1:
            to_event = self.to_event(groups[0][0], slope)
            return to_event.then(self.reset(jump.before, jump.which, jump.after))
        first, *others = (self.one_by_one(jump, order, slope) for order in _orders(groups))
        if first is None or not all(other and _alike(first, other) for other in others):
            raise ValueError(
                f"{self.where(jump.which)}: expected events at different times, or independent of "
                "their order, got some whose order changes the result; the motion has no "
                "derivative there"
            )
        return first

    def one_by_one(
        self, jump: Jump, order: Sequence[tuple[int, ...]], rate: Array
    ) -> Passage | None:
        """Return the passage of ordered simultaneous events; None if one prevents another."""
        y, n = jump.before, jump.before.size
        system, where = self.path.integrator.system, self.where(jump.which)
        through = Passage(np.eye(n + 1), np.zeros((n + 1, self.d.size)))
        before = {i: self.speed(i, y, rate) for i in jump.which}
        for events in order:
            if any(self.speed(i, y, rate) * before[i] <= 0 for i in events):
                return None
            delay = self.delay(events[0], y, rate)
            after = consistent(system, where, self.after(y, events), self.d)
            through = through.then(self.to_event(delay, rate)).then(self.reset(y, events, after))
            y, rate = after, self.rate(after)
            through = through.then(self.to_fixed_time(rate))
        return through


def _orders(groups: Sequence[tuple[Array, list[int]]]) -> list[list[tuple[int, ...]]]:
    """Return the orders in which groups of events are tried."""
    every = [tuple(events) for _, events in groups]
    if len(every) <= MOST:
        return [list(order) for order in permutations(every)]
    swapped = [[*every[:i], every[i + 1], every[i], *every[i + 2 :]] for i in range(len(every) - 1)]
    return [every, every[::-1], *swapped]


def _alike(one: Passage, other: Passage) -> bool:
    """Return True if two passages are equal, each row relative to its largest entry."""
    a, b = (np.hstack([x.by_state, x.by_data]) for x in (one, other))
    return bool((np.abs(a - b) <= SAME * np.abs(a).max(axis=1, keepdims=True)).all())
