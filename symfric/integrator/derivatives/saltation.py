"""Derivatives across jumps: saltation matrices, and the links that they form between steps.

The time of an event g(t, y, d) = 0 depends on the parameters. With S the derivatives of y at a
fixed time before the event, f the rate of y, and r a reset,

    t*' = -(g_y S + g_d d') / (g_y f + g_t)
    S   <- S + f t*'                                of y at the event, which moves
    S   <- C (r_y S + r_t t*' + r_d d') + C_d d'     after the reset

where C updates the algebraic unknowns. The next step starts at the event, so it is shorter by t*'.
An event caused by another jump shares the time of that jump. Events at one instant whose times have
different derivatives are taken one after another, with f between them. If another order leads to
another state, the motion has no derivative.

A passage is the matrix [A B] of X -> A X + B d' across a jump, shape (n + 1, n + 1 + n_d): X holds
the derivatives of y and, in its last row, of the time at which y is evaluated. After each step of a
run with jumps, the derivatives Z_i of its start, of its end and of each row of its dense output,
and T of the time of its start, give

    F = sum_i share_i Z_i + fall T,      X = A F + B d'

where X holds the derivatives of the start of the next step and of its time. Without a jump, X and
F are Z of the end. After an event, F is Z of the dense output at a fixed time.

Source: Aizerman and Gantmakher, Quart. J. Mech. Appl. Math., 1958; Leine and Nijmeijer, Dynamics
and Bifurcations of Non-Smooth Mechanical Systems, 2004 (saltation matrix).
"""

from collections.abc import Iterable, Sequence
from itertools import permutations
from typing import NamedTuple

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.foundation.checks import listed
from symfric.foundation.numeric import Array
from symfric.integrator.derivatives.functions import derivatives
from symfric.integrator.derivatives.path import Jump, RunPath
from symfric.integrator.equations.initial import ASSEMBLED, ITERATIONS, consistent

Which = Sequence[int] | NDArray[np.intp]
GRAZING = 1e-6
"""Relative rate of an event expression below which it touches zero without crossing it.

It is relative to the mean rate in the step before; relative to its own terms the limit is squared.
"""
SAME = 1e-6
"""Relative difference of results that counts as equal, such as those of two orders of events."""
MOST = 4
"""Simultaneous events up to which all orders are tried; for more, only exchanges of neighbours."""


class Links(NamedTuple):
    """Links of a run; tables have one row per distinct jump, and the first row is for no jump.

    Attributes:
        start: passage at the start.
        of: number of the row that applies after each step, shape (steps,).
        share: shape (rows, 2 + rows of the dense output).
        fall: shape (rows, n).
        by_state: A without its last column, shape (rows, n + 1, n).
        by_data: B, shape (rows, n + 1, n_d).
        alone: passages of the single jumps of the run.
    """

    start: Array
    of: NDArray[np.intp]
    share: Array
    fall: Array
    by_state: Array
    by_data: Array
    alone: Array


def links(path: RunPath) -> Links:
    """Return the links of a run.

    Raises:
        ValueError: an event only touches zero, events at one instant do not commute, or an event
            coincides with a jump of the inputs.
    """
    every, dense, n = _passages(path), path.dense, path.integrator.system.n
    own = dict(zip(map(id, path.jumps), every, strict=True))
    if path.breaks:
        k = np.array([mark.step for mark in path.breaks])
        here = _Instants(path, dense.t0[k], path.steps[2][k])
        still = here.to_fixed_time(np.zeros((k.size, n)))
        own |= zip(map(id, path.breaks), here.followed(still, dense.y0[k]), strict=True)
    start, *later = (
        then(*(at_start(path) if mark is None else own[id(mark)] for mark in marks))
        for _, marks in path.openings
    )
    tables = np.array([_Instants(path, dense.t0[:1], path.steps[2][:1]).nothing[0], *later])
    behind = np.array([step - 1 for step, _ in path.openings[1:]], dtype=np.intp)
    of, fall = np.zeros(dense.t0.size, dtype=np.intp), np.zeros((len(tables), n))
    of[behind] = np.arange(1, behind.size + 1)
    theta = path.theta[behind]
    fall[1:] = -(1 - theta)[:, None] * dense.rates(behind, np.ones(behind.size))
    share = path.shares(np.append(1.0, theta))
    return Links(start, of, share, fall, tables[:, :, :n], tables[:, :, n + 1 :], every)


def then(first: Array, *others: Array) -> Array:
    """Return the passage that combines passages one after another."""
    m = first.shape[-2]
    for other in others:
        first = other[..., :m] @ first
        first[..., m:] += other[..., m:]
    return first


def at_start(path: RunPath) -> Array:
    """Return the passage from the given to the consistent start values."""
    here = _Instants(path, path.dense.t0[:1], path.data(np.zeros(1, dtype=np.intp)))
    return here.consistent(here.nothing, path.guess, path.dense.y0[:1])[0]


def _passages(path: RunPath) -> Array:
    """Return the passages of all events of a run."""
    n, n_d = path.integrator.system.n, path.steps[2].shape[1]
    found = np.empty((len(path.jumps), n + 1, n + 1 + n_d))
    single = [i for i, jump in enumerate(path.jumps) if _is_single(path, jump)]
    if single:
        here = _Instants.of(path, [path.jumps[i] for i in single])
        rate, which = here.rates_before(), np.array([jump.which[0] for jump in here.jumps])
        to_event = here.to_event(here.delay(which, here.before, rate), rate)
        found[single] = then(to_event, here.reset(here.before, which[:, None], here.after))
    for i in set(range(len(path.jumps))).difference(single):
        found[i] = _passage(_Instants.of(path, [path.jumps[i]]))[0]
    return found


def _is_single(path: RunPath, jump: Jump) -> bool:
    """Return True if a single event cut a step, away from breaks, and there are no constraints."""
    if len(jump.which) > 1 or not jump.size or path.integrator.system.manifold is not None:
        return False
    breaks, k = path.inputs.breaks, path.place(jump)
    return min(jump.t - breaks[k], breaks[k + 1] - jump.t) > path.tolerance or breaks.size == 2


def _passage(here: "_Instants") -> Array:
    """Return the passage of events at one instant; from a fixed time if they cut a step."""
    (jump,), path = here.jumps, here.path
    if jump.at_once:
        return here.reset(here.before, jump.which, here.after)
    rate = here.rates_before()
    if not jump.size:
        return then(here.to_fixed_time(rate), _crossed(here, rate))
    breaks, k = path.inputs.breaks, path.place(jump)
    for edge in (k, k + 1):
        if not 0 < edge < breaks.size - 1 or abs(breaks[edge] - jump.t) > path.tolerance:
            continue
        other = here._replace(d=path.data(np.array([2 * edge - 1 - k])))
        moved = not all(_near(here.rate(y), other.rate(y)) for y in (here.before, here.after))
        if moved and any(here.delay([i], here.before, rate).any() for i in jump.which):
            raise ValueError(
                f"{here.where(jump.which)}: expected an event apart from the jumps of the inputs, "
                f"got one at t = {breaks[edge]:.9g} s; the derivatives before and after it "
                "differ"
            )
    return _crossed(here, rate)


def event_times(path: RunPath, jump: Jump) -> Array:
    """Return the passage to the times of simultaneous events, shape (events, n + 1 + n_d)."""
    here = _Instants.of(path, [jump])
    rate = here.rates_before()
    delays = np.vstack([here.delay([i], here.before, rate) for i in jump.which])
    start = here.nothing if jump.size else here.to_fixed_time(rate)
    return then(start[0], np.insert(delays, rate.shape[1], 0.0, axis=1))


def _crossed(here: "_Instants", rate: Array) -> Array:
    """Return the passage of crossed events, from derivatives at a fixed time before them."""
    which, groups = here.jumps[0].which, list[tuple[Array, list[int]]]()
    for i in which:
        delay = here.delay([i], here.before, rate)
        own = next((events for other, events in groups if _near(other, delay)), None)
        if own is None:
            groups.append((delay, [i]))
        else:
            own.append(i)
    if len(groups) == 1:
        to_event = here.to_event(groups[0][0], rate)
        return then(to_event, here.reset(here.before, which, here.after))
    every = [events for _, events in groups]
    orders: Iterable[Sequence[list[int]]] = permutations(every)
    if len(every) > MOST:
        pairs = range(len(every) - 1)
        swaps = ([*every[:i], every[i + 1], every[i], *every[i + 2 :]] for i in pairs)
        orders = [every, every[::-1], *swaps]
    first, *others = (_one_by_one(here, order, rate) for order in orders)
    if first is None or not all(other is not None and _near(first, other, -1) for other in others):
        raise ValueError(
            f"{here.where(which)}: expected events at different times, or independent of "
            "their order, got some whose order changes the result; the motion has no "
            "derivative there"
        )
    return first


def _one_by_one(here: "_Instants", order: Sequence[list[int]], rate: Array) -> Array | None:
    """Return the passage of simultaneous events in this order; None if one prevents another."""
    y, through, system = here.before, here.nothing, here.path.integrator.system

    def speeds(events: Sequence[int]) -> Array:
        slopes = (here.slopes([i], y) for i in events)
        return np.array([float(by_y[0] @ rate[0] + by_t[0]) for by_t, by_y, _ in slopes])

    before = dict(zip(here.jumps[0].which, speeds(here.jumps[0].which), strict=True))
    for events in order:
        if (speeds(events) * [before[i] for i in events] <= 0).any():
            return None
        to_event = here.to_event(here.delay(events[:1], y, rate), rate)
        where, start = here.where(here.jumps[0].which), here.jumped(y, events)[0]
        after = consistent(system, where, start, here.d[0])[None]
        through = then(through, to_event, here.reset(y, events, after))
        y, rate = after, here.rate(after)
        through = then(through, here.to_fixed_time(rate))
    return through


def _near(one: Array, other: Array, axis: int | None = None) -> bool:
    """Return True if arrays are equal, relative to the largest entry, of all or along an axis."""
    size = np.abs(one).max(axis, keepdims=True, initial=0.0)
    return bool((np.abs(one - other) <= SAME * size).all())


NOTHING = np.zeros(0)


class _Instants(NamedTuple):
    """Instants of a run, m in number; each array has one row per instant.

    Attributes:
        path: the run.
        t: times [s].
        d: run data.
        jumps: events at these times, if any.
        before, after: unknowns before and after the events.
    """

    path: RunPath
    t: Array
    d: Array
    jumps: Sequence[Jump] = ()
    before: Array = NOTHING
    after: Array = NOTHING

    @classmethod
    def of(cls, path: RunPath, jumps: Sequence[Jump]) -> "_Instants":
        """Return the instants of events."""
        d = path.data(np.array([path.place(jump) for jump in jumps]))
        before = np.array([jump.before for jump in jumps])
        after = np.array([jump.after for jump in jumps])
        return cls(path, np.array([jump.t for jump in jumps]), d, jumps, before, after)

    @property
    def nothing(self) -> Array:
        """Passages without a jump."""
        n, (m, n_d) = self.path.integrator.system.n, self.d.shape
        return np.tile(np.eye(n + 1, n + 1 + n_d), (m, 1, 1))

    def where(self, which: Sequence[int], row: int = 0) -> str:
        """Return the start of messages about events."""
        model = self.path.integrator.model
        names = listed(f"'{model.events[i].name}'" for i in which)
        return f"sensitivities of '{model.name}': event {names} at t = {self.t[row]:.9g} s"

    def _values(self, function: ca.Function, *rows: Array) -> list[Array]:
        """Return the results of a Function, matrices column by column."""
        made = derivatives(self.path.integrator)
        return made.many(function, [*rows, self.d], self.path.backend)

    def rate(self, y: Array) -> Array:
        """Return the rates y' of the equations."""
        system = self.path.integrator.system
        matrix, right = self._values(derivatives(self.path.integrator).rates, y)
        if system.is_ode:
            return right
        matrix = matrix.reshape(-1, system.n, system.n).transpose(0, 2, 1)
        return np.linalg.solve(matrix, right[:, :, None])[:, :, 0].astype(float)

    def rates_before(self) -> Array:
        """Return the rates just before the events, from the equations.

        In a step that a jump of the force ended, the dense output has only a mean rate.
        """
        y, dense = self.before.copy(), self.path.dense
        cut = np.array([jump.size > 0 for jump in self.jumps])
        k = np.array([jump.step - 1 for jump in self.jumps])[cut]
        back = 2 * np.maximum(self.path.tolerance, np.spacing(np.abs(self.t[cut])))
        theta = 1.0 - back / (dense.t1[k] - dense.t0[k])
        y[cut] = dense.piece(k, np.maximum(theta, 0.0))
        return self.rate(y)

    def slopes(self, which: Which, y: Array) -> tuple[Array, Array, Array]:
        """Return the derivatives of one event expression per instant with respect to t, y and d."""
        found = self._values(derivatives(self.path.integrator).of_events, self.t, y)
        m, every, own = self.t.size, len(self.path.integrator.model.events), np.asarray(which)
        by_t, by_y, by_d = (a.reshape(m, -1, every)[np.arange(m), :, own] for a in found)
        return by_t[:, 0], by_y, by_d

    def delay(self, which: Which, y: Array, rate: Array) -> Array:
        """Return the derivatives of event times by y at a fixed time and by d, shape (m, n + n_d).

        Raises:
            ValueError: an expression only touches zero.
        """
        by_t, by_y, by_d = self.slopes(which, y)
        speed = (by_y * rate).sum(axis=1) + by_t
        terms = (np.abs(by_y) * np.abs(rate)).sum(axis=1) + np.abs(by_t)
        dense, row = self.path.dense, np.arange(self.t.size)
        k = np.minimum(np.searchsorted(dense.t1, self.t), dense.t1.size - 1)
        (began,) = self._values(self.path.integrator.events, dense.t0[k], dense.y0[k])
        ends = dense.t1[k] == self.t
        mean = (
            ends * np.abs(began[row, np.asarray(which)]) / np.where(ends, self.t - dense.t0[k], 1.0)
        )
        touches = ~(np.abs(speed) > np.maximum(GRAZING**2 * terms, GRAZING * mean))
        if touches.any():
            row = int(touches.argmax())
            raise ValueError(
                f"{self.where([np.ravel(which)[row]], row)}: expected an expression that crosses "
                f"zero, got one that touches it at a rate of {speed[row]:.3g} per second; the time "
                "of such an event has no derivative"
            )
        return -np.hstack([by_y, by_d]) / speed[:, None]

    def to_event(self, delay: Array, rate: Array) -> Array:
        """Return the passages from derivatives of y at a fixed time to those at an event."""
        n, found = rate.shape[1], self.nothing
        found[:, n, n] = 0.0
        times = np.hstack([rate, np.ones((rate.shape[0], 1))])[:, :, None] * delay[:, None]
        found[:, :, :n] += times[:, :, :n]
        found[:, :, n + 1 :] = times[:, :, n:]
        return found

    def to_fixed_time(self, rate: Array) -> Array:
        """Return the passages from derivatives of y at a moving time to those at a fixed time."""
        n, found = rate.shape[1], self.nothing
        found[:, :n, n], found[:, n, n] = -rate, 0.0
        return found

    @property
    def _resets(self) -> tuple[tuple[int, int], ...]:
        """Numbers of the event and of the state of each reset."""
        crossings = self.path.integrator.crossings
        return () if crossings is None else crossings.resets

    def jumped(self, y: Array, which: Which) -> Array:
        """Return y after the resets of events, with algebraic unknowns unchanged."""
        (fresh,), after = self._values(self.path.integrator.resets, self.t, y), y.copy()
        for k, (event, state) in enumerate(self._resets):
            here = (np.atleast_2d(which) == event).any(axis=1)
            after[here, state] = fresh[here, k]
        return after

    def reset(self, y: Array, which: Which, found: Array) -> Array:
        """Return the passages of the resets of events `which` (m, events) from y to `found`."""
        n, every, jumps = y.shape[1], self._resets, self.nothing
        if not every:
            return self.followed(jumps, found)
        slopes = self._values(derivatives(self.path.integrator).of_resets, self.t, y)
        by_t, by_y, by_d = (a.reshape(self.t.size, -1, len(every)) for a in slopes)
        for k, (event, state) in enumerate(every):
            here = (np.atleast_2d(which) == event).any(axis=1)
            jumps[here, state, :n], jumps[here, state, n] = by_y[here, :, k], by_t[here, 0, k]
            jumps[here, state, n + 1 :] = by_d[here, :, k]
        return self.consistent(jumps, self.jumped(y, which), found)

    def consistent(self, jumps: Array, y: Array, found: Array) -> Array:
        """Return passages to y and on to the consistent `found`; for mechanisms at one instant."""
        made, n = derivatives(self.path.integrator), y.shape[-1]
        manifold = made.system.manifold
        if manifold is not None and made.assembly is not None:
            y, (d,) = y.ravel(), self.d
            for _ in range(ITERATIONS):
                slope, more = (m.full() for m in made.assembly.call([y, d]))
                jumps[:, :n] = slope @ jumps[:, :n]
                jumps[:, :n, n + 1 :] += more
                y = manifold.project(y, d).full().ravel()
                size = max(1.0, float(np.abs(y[: made.system.nx]).max(initial=0.0)))
                if np.abs(manifold.defect(y, d).full()).max(initial=0.0) < ASSEMBLED * size:
                    break
        return self.followed(jumps, found)

    def followed(self, jumps: Array, found: Array) -> Array:
        """Return passages followed by the update of the algebraic unknowns at `found`."""
        made = derivatives(self.path.integrator)
        n, m, free = made.system.n, self.t.size, made.system.free
        if free.size:
            slope, more = self._values(made.algebraic, found)
            slope = slope.reshape(m, n, -1).transpose(0, 2, 1)
            left = slope @ jumps[:, :n]
            left[:, :, n + 1 :] += more.reshape(m, -1, slope.shape[1]).transpose(0, 2, 1)
            jumps[:, :n] -= free @ np.linalg.solve(slope @ free, left)
        return jumps
