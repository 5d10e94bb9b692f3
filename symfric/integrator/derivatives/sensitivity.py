"""Derivatives of what was computed: the accepted steps, differentiated with their sizes held fixed.

The step-size controller takes no part (internal numerical differentiation), so the derivatives are
those of the discrete solution and exact to rounding. An event moves with what is differentiated:
the step that it cuts ends, and the next one begins, where the dense output has the event
(`saltation`); all other steps end at fixed times.
"""

from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import NDArray

from symfric.integrator.derivatives.functions import derivatives, whole_step
from symfric.integrator.derivatives.path import Jump, Path, Piece
from symfric.integrator.derivatives.saltation import passage
from symfric.integrator.derivatives.seeds import Seeds
from symfric.integrator.running.dense import Dense, join

Array = NDArray[np.float64]


@final
@dataclass(frozen=True, eq=False)
class Slopes:
    """Derivatives of a run.

    Attributes:
        dense: of the solution at fixed times, as dense output of names * n columns, those of a name
            together.
        times: of the times of its jumps, shape (jumps, names).
    """

    dense: Dense
    times: Array


def forward(path: Path, which: Seeds) -> Slopes:
    """Derivatives of the solution; all directions go along in one sweep over the steps."""
    s, names = path.integrator.system, len(which.names)
    of_d = which.of_data(s.d.numel())
    state = np.zeros((s.n + 1, names))
    state[: s.nx] = which.start
    pieces, times = list[Dense](), list[Array]()
    for piece in path.pieces:
        for jump in piece.opening:
            move = passage(path, jump)
            state = move.by_state @ state + move.by_data @ of_d
            if isinstance(jump, Jump):
                times.append(state[-1])
        if piece.count:
            pieces.append(_swept(path, which, piece, state))
            state = np.vstack([pieces[-1].y1[-1].reshape(names, s.n).T, np.zeros(names)])
    return Slopes(join(pieces), np.array(times).reshape(-1, names))


def _swept(path: Path, which: Seeds, piece: Piece, state: Array) -> Dense:
    """Derivatives over a piece, from those at its start and of the time of its start."""
    n, names, k = path.integrator.system.n, len(which.names), piece.steps
    steps = [a[k] for a in path.steps]
    if path.integrator.model.events:
        of_h = np.zeros((piece.count, names))
        of_h[0] = -state[-1]
        steps.append(of_h)
    after, inner = derivatives(path.integrator).forward(which)(steps, state[:n].T, path.backend)
    begin = np.vstack([state[:n].T.reshape(1, -1), after[:-1]])
    bent = inner.reshape(piece.count, path.dense.D.shape[1], names * n)
    t0, t1 = path.dense.t0[k], path.dense.t1[k]
    if state[-1].any():
        ahead, bend = _ahead(whole_step(path, k.start))
        begin[0] -= np.outer(state[-1], ahead).ravel()
        bent[0] -= np.einsum("s,rn->rsn", state[-1], bend).reshape(bent.shape[1], -1)
    found = Dense(t0, t1, begin, after, bent)
    if not path.cuts(k.stop):
        return found
    end, bent[-1] = _cut(found, (t1[-1] - t0[-1]) / path.size[k][-1])
    return Dense(t0, t1, begin, np.vstack([after[:-1], end]), bent)


def _cut(dense: Dense, theta: float) -> tuple[Array, Array]:
    """End and D of the last piece up to theta, the same polynomial (`running.crossings`)."""
    old, new = np.zeros(dense.y0.shape[1]), np.zeros(dense.y0.shape[1])
    D = np.empty_like(dense.D[-1])
    for k in reversed(range(D.shape[0])):
        new = new + theta ** (k + 2) * (dense.D[-1, k] - old)
        old, D[k] = dense.D[-1, k], new
    return dense.piece(np.array([dense.t0.size - 1]), np.array([theta])), D


def _ahead(step: Dense) -> tuple[Array, Array]:
    """(1 - theta) y'(theta) of one step in the form of `Dense`: its start and its D; it ends at 0.

    That is by how much the solution at a fixed time falls behind where the step starts later and
    ends at its time.
    """
    D = step.D[0]
    # y = sum_j c_j theta^j, of which (y_theta - y_theta(0)) / theta is D
    start = step.y1[0] - step.y0[0] + D[0]
    c = np.vstack([D[1:], np.zeros_like(D[:1])]) - D
    h = step.t1[0] - step.t0[0]
    return start / h, np.arange(2, len(c) + 2)[:, None] * c / h


def of_signals(path: Path, which: Seeds, solution: Dense, times: Array) -> Array:
    """Derivatives of all signals at times, shape (names, signals, times).

    Args:
        path: the run.
        which: what to differentiate with respect to.
        solution: derivatives of the solution, from `forward`.
        times: where [s].
    """
    rows = [times, path.unknowns(times), path.data_at(times), solution(times).T]
    (found,) = derivatives(path.integrator).of_signals(which)(rows, backend=path.backend)
    # CasADi stores column by column
    return np.ascontiguousarray(found.T).reshape(len(which.names), -1, times.size)
