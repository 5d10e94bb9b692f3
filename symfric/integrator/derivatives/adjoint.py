"""Gradients by one sweep backwards over the accepted steps, whatever the number of parameters."""

import numpy as np
from numpy.typing import NDArray

from symfric.integrator.derivatives.sensitivity import (
    Path,
    Seeds,
    derivatives,
    made_consistent,
    signal_slopes,
)

Array = NDArray[np.float64]


def gradient(path: Path, which: Seeds, times: Array, weights: Array) -> dict[str, float]:
    """Derivatives of sum_ij weights_ij signal_i(t_j), of the discrete solution, exact to rounding.

    Args:
        path: the run.
        which: what to differentiate with respect to.
        times: t_j [s], shape (m,).
        weights: shape (signals, m).
    """
    s, made = path.integrator.system, derivatives(path.integrator)
    by_y, by_d = signal_slopes(path, times)
    # a signal without weight may have no derivative, as a norm at zero
    used = np.flatnonzero(weights.any(axis=1))
    weights, by_y, by_d = weights[used], by_y[:, used], by_d[:, used]
    by_data = np.einsum("rm,mrd->d", weights, by_d)
    on_steps = _on_steps(path, times, np.einsum("rm,mrn->mn", weights, by_y))
    adjoint = np.zeros(s.n)
    for piece in reversed(path.pieces):
        steps = [a[piece][::-1] for a in (*path.steps, on_steps)]
        before, of_data = made.reverse(steps, adjoint, path.backend)
        by_data += of_data.sum(axis=0)
        adjoint = before[-1]
        by_before, by_start = made_consistent(path, piece)
        by_data += by_start.T @ adjoint
        adjoint = by_before.T @ adjoint
    through_start = adjoint[: s.nx] @ which.start
    through_data = by_data @ which.of_data(by_data.size)
    return dict(zip(which.names, (through_start + through_data).tolist(), strict=True))


def _on_steps(path: Path, times: Array, by_y: Array) -> Array:
    """Weights of values at times, (times, n), carried to the steps: start, end, dense output."""
    dense, n = path.dense, by_y.shape[1]
    rows = dense.D.shape[1]
    k = np.clip(np.searchsorted(dense.t0, times, side="right") - 1, 0, dense.t0.size - 1)
    theta = (times - dense.t0[k]) / (dense.t1[k] - dense.t0[k])
    basis = np.stack([1 - theta, theta, *(theta**r * (1 - theta) for r in range(1, rows + 1))])
    total = np.zeros((dense.t0.size, rows + 2, n))
    np.add.at(total, k, basis.T[:, :, None] * by_y[:, None, :])
    return total.reshape(dense.t0.size, -1)
