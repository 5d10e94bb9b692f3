"""Gradients by one sweep backwards over the accepted steps, whatever the number of parameters."""

from collections.abc import Mapping
from typing import final

import numpy as np
from numpy.typing import NDArray

from symfric.integrator.derivatives.functions import derivatives
from symfric.integrator.derivatives.links import Links, links
from symfric.integrator.derivatives.path import Path
from symfric.integrator.derivatives.saltation import at_start
from symfric.integrator.derivatives.seeds import Seeds

Array = NDArray[np.float64]


def gradient(
    path: Path, which: Seeds, times: Array, weights: Mapping[int, Array]
) -> dict[str, float]:
    """Derivatives of sum_ij weights_ij signal_i(t_j), of the discrete solution, exact to rounding.

    Args:
        path: the run.
        which: what to differentiate with respect to.
        times: t_j [s], increasing, shape (m,).
        weights: number of a signal -> its weights, shape (m,); no others need a derivative.
    """
    s, used = path.integrator.system, tuple(weights)
    if not used:
        return dict.fromkeys(which.names, 0.0)
    every = np.array([*weights.values()]).T
    rows = [times, path.unknowns(times), path.data_at(times), every]
    by_y, of_d = derivatives(path.integrator).weighted(used)(rows, backend=path.backend)
    looks, by_data = _Looks(path, times, by_y), of_d.sum(axis=0)
    start, more = _swept_back(path, looks)
    found = start[: s.nx] @ which.start + which.through(by_data + more)
    return dict(zip(which.names, found.tolist(), strict=True))


def _swept_back(path: Path, looks: "_Looks") -> tuple[Array, Array]:
    """Adjoints of the start, before it is made consistent, and of d."""
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
    before, of_data = made.reverse(path.linked)(steps, np.zeros(n + path.linked), path.backend)
    adjoint = before[-1] if path.linked else np.append(before[-1], 0.0)
    return first.by_state.T @ adjoint, of_data.sum(axis=0) + first.by_data.T @ adjoint


@final
class _Looks:
    """Weights of the solution at times, carried to the steps.

    Args:
        path: the run.
        times: t_j [s], increasing, shape (m,).
        by_y: weights of y there, shape (m, n).

    Attributes:
        weights: of start, end and dense output of each step, a row each.
    """

    def __init__(self, path: Path, times: Array, by_y: Array) -> None:
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
        """What a later start of each step adds to the sum through the places of times in it.

        Of steps that jumps come before; others start at fixed times.
        """
        path, found = self.path, np.zeros(self.path.dense.t0.size)
        moves = np.append(path.pieces[0].opening != (None,), every.of[:-1] > 0)
        inside = np.flatnonzero(moves[self.step])
        k = self.step[inside]
        since = self.times[inside] - path.dense.t0[k]
        slopes = path.dense.rates(k, since / (path.dense.t1 - path.dense.t0)[k])
        falls = (1 - since / path.size[k]) * (slopes * self.by_y[inside]).sum(axis=1)
        np.subtract.at(found, k, falls)
        return found
