"""Gradients by one sweep backwards over the accepted steps, whatever the number of parameters."""

from collections.abc import Mapping
from typing import final

import numpy as np
from numpy.typing import NDArray

from symfric.integrator.derivatives.functions import derivatives, whole_step
from symfric.integrator.derivatives.path import Jump, Path, Piece
from symfric.integrator.derivatives.saltation import passage
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
    adjoint = np.zeros(s.n + 1)
    for piece in reversed(path.pieces):
        if piece.count:
            adjoint, more = _swept_back(path, piece, looks, adjoint)
            by_data += more
        for jump in reversed(piece.opening):
            move = passage(path, jump)
            by_data += move.by_data.T @ adjoint
            adjoint = move.by_state.T @ adjoint
    found = adjoint[: s.nx] @ which.start + which.through(by_data)
    return dict(zip(which.names, found.tolist(), strict=True))


def _swept_back(path: Path, piece: Piece, looks: "_Looks", adjoint: Array) -> tuple[Array, Array]:
    """Adjoints at the start of a piece, of y and of the time of that start, and of d."""
    k, after, made = piece.steps, adjoint[:-1], derivatives(path.integrator)
    if path.cuts(k.stop):
        looks.add(k.stop - 1, float(path.dense.t1[k.stop - 1]), after)
        after = np.zeros_like(after)
    steps = [*(a[k][::-1] for a in path.steps), looks.weights(k)[::-1]]
    before, of_data, *of_h = made.reverse(steps, after, path.backend)
    moved = 0.0
    if any(isinstance(jump, Jump) for jump in piece.opening):
        moved = looks.ahead(k.start) - float(of_h[0][-1, 0])
    return np.append(before[-1], moved), of_data.sum(axis=0)


@final
class _Looks:
    """Weights of the solution at times, carried to the steps.

    Args:
        path: the run.
        times: t_j [s], shape (m,).
        by_y: weights of y there, shape (m, n).
    """

    def __init__(self, path: Path, times: Array, by_y: Array) -> None:
        t0, (steps, rows, n) = path.dense.t0, path.dense.D.shape
        self.path, self.by_y = path, by_y
        self.step = np.searchsorted(t0[1:], times, side="right")
        self.theta = (times - t0[self.step]) / path.size[self.step]
        self.total = np.zeros((steps, rows + 2, n))
        shares = self._basis(self.theta)[:, :, None] * by_y[:, None, :]
        if times.size > 1:
            first = np.append(0, np.flatnonzero(self.step[1:] != self.step[:-1]) + 1)
            self.total[self.step[first]] = np.add.reduceat(shares, first)
        else:
            self.total[self.step] = shares
        self.cut: tuple[int, float, Array] = (-1, 0.0, np.zeros(n))

    def _basis(self, theta: Array) -> Array:
        """Shares of start, end and dense output in a value, shape (m, rows + 2)."""
        shares = np.empty((theta.size, self.total.shape[1]))
        shares[:, 0], shares[:, 1] = 1 - theta, theta
        for row in range(2, shares.shape[1]):
            shares[:, row] = theta * (shares[:, row - 1] if row > 2 else shares[:, 0])
        return shares

    def weights(self, steps: slice) -> Array:
        """Of start, end and dense output of steps, a row each."""
        return self.total[steps].reshape(self.total[steps].shape[0], -1)

    def add(self, step: int, t: float, weight: Array) -> None:
        """A weight of y at the time [s] of the event that cut a step."""
        theta = (t - self.path.dense.t0[step]) / self.path.size[step]
        self.total[step] += self._basis(np.array([theta]))[0, :, None] * weight
        self.cut = (step, theta, weight)

    def ahead(self, step: int) -> float:
        """What a later start of a step adds to the sum through the places of times in it."""
        inside = self.step == step
        theta, by_y = self.theta[inside], self.by_y[inside]
        if self.cut[0] == step:
            theta, by_y = np.append(theta, self.cut[1]), np.vstack([by_y, self.cut[2]])
        whole = whole_step(self.path, step)
        slopes = whole.rates(np.zeros(theta.size, dtype=np.intp), theta)
        return -float(((1 - theta)[:, None] * slopes * by_y).sum())
