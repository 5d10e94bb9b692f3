"""Derivatives of a run: forward, and reverse by one sweep.

The accepted steps are differentiated with their sizes held fixed. The step-size controller is not
differentiated (internal numerical differentiation), so the derivatives are those of the discrete
solution and exact to rounding. An event moves with the parameters: the step that it cuts ends, and
the next one begins, where the dense output has the event (`saltation`). All other steps end at
fixed times. At an event, the rate of the solution comes from the equations. The rate of the dense
output differs from it by the error of the dense output, or by more across a jump of the force.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple, final

import numpy as np
from numpy.typing import NDArray

from symfric.foundation.numeric import Array
from symfric.integrator.derivatives.functions import derivatives
from symfric.integrator.derivatives.path import Jump, RunPath, Seeds, of_data
from symfric.integrator.derivatives.saltation import Links, at_start, event_times, links
from symfric.integrator.running.record import Dense


class Slopes(NamedTuple):
    """Derivatives of a run.

    Attributes:
        dense: derivatives of the solution at fixed times, as dense output of names * n columns,
            those of a name together.
        times: derivatives of the times of the events, shape (events, names).
    """

    dense: Dense
    times: Array


def forward(path: RunPath, which: Seeds) -> Slopes:
    """Return the derivatives of the solution with respect to all names, in one sweep over steps."""
    n, names, linked = path.integrator.system.n, len(which.names), path.linked
    state, of_d = np.zeros((n + 1, names)), of_data(which.parameters, path.steps[2].shape[1])
    state[: which.start.shape[0]] = which.start
    sweep, rows = derivatives(path.integrator).forward(which.parameters, linked), [*path.steps]
    if not linked:
        state = _after(at_start(path), state, of_d)[:n]
        behind, inner = sweep(rows, state.T, path.backend)
        return Slopes(_dense(path, state, behind, inner), np.zeros((0, names)))
    every = links(path)
    state = _after(every.start, state, of_d)
    by_data = (every.by_data @ of_d).transpose(0, 2, 1)
    tables = (every.share, every.fall, every.by_state, by_data)
    rows += [(table.reshape(table.shape[0], -1), every.of) for table in tables]
    behind, inner = sweep(rows, state.T, path.backend)
    states = np.concatenate([state.T[None], behind.reshape(-1, names, n + 1)])
    dense = _at_fixed_times(path, _dense(path, state[:n], states[1:, :, :n], inner), states)
    return Slopes(dense, _times(path, every, dense, states, of_d))


def _after(passage: Array, state: Array, of_d: Array) -> Array:
    """Return the derivatives after a passage."""
    return passage @ np.vstack([state, of_d])


def _dense(path: RunPath, start: Array, behind: Array, inner: Array) -> Dense:
    """Return the derivatives over all steps, from those of the start and the sweep's results."""
    steps, size = inner.shape[0], start.size
    parts = inner.reshape(steps, -1, size)
    begin = np.vstack([start.T.reshape(1, -1), behind[:-1].reshape(steps - 1, size)])
    return Dense(path.dense.t0, path.dense.t1, begin, parts[:, 0], parts[:, 1:])


def _at_fixed_times(path: RunPath, found: Dense, states: Array) -> Dense:
    """Return the derivatives at fixed times, up to the events that cut steps.

    `found` holds the derivatives at fixed places in full steps; `states` holds those of the starts
    of steps and, in the last column, of their times.
    """
    cut = np.array([jump.step - 1 for jump in path.jumps if jump.size], dtype=np.intp)
    begin, end, bend = found.y0, found.y1.copy(), found.D.copy()
    end[cut], bend[cut] = _cut(found, cut, path.theta[cut])
    late = np.flatnonzero(states[:-1, :, -1].any(axis=1))
    ahead = _ahead(path.dense, late, path.theta[late])
    for part, rest in zip((begin, end, bend), ahead, strict=True):
        moved = np.einsum("ks,k...n->k...sn", states[late, :, -1], rest)
        part[late] -= moved.reshape(part[late].shape)
    return Dense(found.t0, found.t1, begin, end, bend)


def _cut(dense: Dense, k: NDArray[np.intp], theta: Array) -> tuple[Array, Array]:
    """Return the end and D of pieces up to theta, the same polynomials (`running.crossings`)."""
    end, D = dense.piece(k, theta), np.empty_like(dense.D[k])
    old, new = np.zeros_like(end), np.zeros_like(end)
    for row in reversed(range(D.shape[1])):
        new = new + theta[:, None] ** (row + 2) * (dense.D[k, row] - old)
        old, D[:, row] = dense.D[k, row], new
    return end, D


def _ahead(dense: Dense, k: NDArray[np.intp], theta: Array) -> tuple[Array, Array, Array]:
    """Return (1 - theta s) y'(s) of pieces in the form of `Dense`, where s is the place in them.

    This is the delay of the solution at a fixed time if a step starts later and ends at its fixed
    time; the piece is the part of the step up to theta.
    """
    D, h = dense.D[k], (dense.t1 - dense.t0)[k, None]
    rows = D.shape[1]
    # y = sum_j c_j s^j, y' = sum_j p_j s^j, and their product q
    c = np.zeros((rows + 2, *dense.y0[k].shape))
    c[1] = dense.y1[k] - dense.y0[k]
    c[1 : rows + 1] += D.transpose(1, 0, 2)
    c[2:] -= D.transpose(1, 0, 2)
    p = np.arange(1, rows + 2)[:, None, None] * c[1:] / h
    q = np.concatenate([p, np.zeros_like(p[:1])])
    q[1:] -= theta[:, None] * p
    bend = -np.cumsum(q[:1:-1], axis=0)[::-1].transpose(1, 0, 2)
    return q[0], q.sum(axis=0), bend


def _times(path: RunPath, every: Links, dense: Dense, states: Array, of_d: Array) -> Array:
    """Return the derivatives of the times of all events, shape (events, names)."""
    found, own, names = list[Array](), iter(every.alone), of_d.shape[1]
    for step, marks in path.openings:
        jumps = [mark for mark in marks if isinstance(mark, Jump)]
        before = dense.y1[step - 1].reshape(names, -1).T if step else states[0, :, :-1].T
        state = np.vstack([before, np.zeros(names)])
        for jump in jumps:
            after = _after(next(own), state, of_d)
            if len(jump.which) > 1 and not jump.at_once:
                found += [*_after(event_times(path, jump), state, of_d)]
            else:
                same = states[step, :, -1] if len(jumps) == 1 else after[-1]
                found += [same] * len(jump.which)
            state = after
    return np.array(found).reshape(-1, names)


def of_signals(path: RunPath, which: Seeds, solution: Dense, times: Array) -> Array:
    """Return the derivatives of all signals at times, shape (names, signals, times).

    Args:
        path: the run.
        which: names to differentiate with respect to.
        solution: derivatives of the solution, from `forward`.
        times: times of the result [s].
    """
    rows = [*path.at(times), solution(times).T]
    (found,) = derivatives(path.integrator).of_signals(which.parameters)(rows, backend=path.backend)
    # CasADi stores column by column
    return np.ascontiguousarray(found.T).reshape(len(which.names), -1, times.size)


def gradient(
    path: RunPath, which: Seeds, times: Array, weights: Mapping[int, Array]
) -> dict[str, float]:
    """Return the derivatives of sum_ij weights_ij signal_i(t_j), of the discrete solution.

    They are exact to rounding.

    Args:
        path: the run.
        which: names to differentiate with respect to.
        times: t_j [s], increasing, shape (m,).
        weights: signal number -> its weights, shape (m,); other signals do not need a derivative.
    """
    s, used = path.integrator.system, tuple(weights)
    if not used:
        return dict.fromkeys(which.names, 0.0)
    rows = [*path.at(times), np.array([*weights.values()]).T]
    by_y, by_d = derivatives(path.integrator).weighted(used)(rows, backend=path.backend)
    start, more = _swept_back(path, _Looks(path, times, by_y))
    by_data = by_d.sum(axis=0) + more
    found = start[: s.nx] @ which.start + by_data @ of_data(which.parameters, by_data.size)
    return dict(zip(which.names, found.tolist(), strict=True))


def _swept_back(path: RunPath, looks: "_Looks") -> tuple[Array, Array]:
    """Return the adjoints of the start, before it is made consistent, and of d."""
    n, made = path.integrator.system.n, derivatives(path.integrator)
    steps = [a[::-1] for a in (*path.steps, looks.weights)]
    if path.linked:
        every = links(path)
        first, behind = every.start, every.of[::-1]
        tables = (every.share, every.fall, every.by_state, every.by_data)
        flat = ((table.reshape(table.shape[0], -1), behind) for table in tables)
        steps += [looks.ahead(every)[::-1], *flat]
    else:
        first = at_start(path)
    before, by_data = made.reverse(path.linked)(steps, np.zeros(n + path.linked), path.backend)
    adjoint = before[-1] if path.linked else np.append(before[-1], 0.0)
    return first[:, : n + 1].T @ adjoint, by_data.sum(axis=0) + first[:, n + 1 :].T @ adjoint


@final
class _Looks:
    """Weights of the solution at times, distributed to the steps.

    Args:
        path: the run.
        times: t_j [s], increasing, shape (m,).
        by_y: weights of y at these times, shape (m, n).

    Attributes:
        weights: weights of start, end and dense output, one row per step.
    """

    def __init__(self, path: RunPath, times: Array, by_y: Array) -> None:
        t0, (steps, rows, n) = path.dense.t0, path.dense.D.shape
        self.path, self.times, self.by_y = path, times, by_y
        self.step = np.searchsorted(t0[1:], times, side="right")
        theta = (times - t0[self.step]) / path.size[self.step]
        total = np.zeros((steps, rows + 2, n))
        shares = path.shares(theta)[:, :, None] * by_y[:, None, :]
        if times.size > 1:
            first = np.append(0, np.flatnonzero(self.step[1:] != self.step[:-1]) + 1)
            total[self.step[first]] = np.add.reduceat(shares, first)
        else:
            total[self.step] = shares
        self.weights = total.reshape(steps, -1)

    def ahead(self, every: Links) -> Array:
        """Return the derivative of the sum by the start time of each step, from times within it.

        It is nonzero only for steps after jumps; other steps start at fixed times.
        """
        path, found = self.path, np.zeros(self.path.dense.t0.size)
        moves = np.append(path.openings[0][1] != (None,), every.of[:-1] > 0)
        inside = np.flatnonzero(moves[self.step])
        k = self.step[inside]
        since = self.times[inside] - path.dense.t0[k]
        slopes = path.dense.rates(k, since / (path.dense.t1 - path.dense.t0)[k])
        falls = (1 - since / path.size[k]) * (slopes * self.by_y[inside]).sum(axis=1)
        np.subtract.at(found, k, falls)
        return found


@final
@dataclass(frozen=True, eq=False)
class Differentiated:
    """Derivatives along the steps of a run.

    Attributes:
        make: function that returns the run; it is called when the run is first needed.
        which: names to differentiate with respect to.
        names: names of the signals.
        t: times of the result [s].
    """

    make: Callable[[], RunPath]
    which: Seeds
    names: tuple[str, ...]
    t: Array

    @cached_property
    def path(self) -> RunPath:
        """Run to differentiate."""
        return self.make()

    @cached_property
    def solution(self) -> Slopes:
        """Derivatives of the unknowns."""
        return forward(self.path, self.which)

    def at(self, times: Array) -> dict[str, dict[str, Array]]:
        """Return derivatives of all signals: name -> signal -> values, shape (times,)."""
        values = of_signals(self.path, self.which, self.solution.dense, times)
        return {
            seed: dict(zip(self.names, rows, strict=True))
            for seed, rows in zip(self.which.names, values, strict=True)
        }

    def pull_back(self, weights: Mapping[str, Array]) -> dict[str, float]:
        """Return the derivatives of a weighted sum of signals at `t`."""
        used = {self.names.index(name): w for name, w in weights.items() if w.any()}
        return gradient(self.path, self.which, self.t, used)

    def delays(self) -> dict[str, Array]:
        """Return the derivatives of the times of events: name -> values, shape (events,)."""
        return dict(zip(self.which.names, self.solution.times.T, strict=True))
