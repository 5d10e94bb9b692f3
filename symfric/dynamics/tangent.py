"""Linear equations of a model near an equilibrium, in coordinates of its tangent space.

    M dy' = J dy + K dd,   C dy = 0

C contains the algebraic equations, the constraints of a mechanism with their rates, and the slips
of sticking contacts. With dy = T e + Y dd, where e are as many of the states as are independent,

    e' = A e + B dd,   (M T) A = J T,   (M T) B = K + J Y   in the rows with rates
"""

from typing import Any, NamedTuple

import numpy as np
from scipy.linalg import qr

from symfric.dynamics.equations import DEPENDENT, Equations, Indices
from symfric.foundation.numeric import Array
from symfric.integrator.equations.matrices import null_space


class Tangent(NamedTuple):
    """Linear equations e' = A e + B dd with dy = T e + Y dd.

    Attributes:
        states: indices of the independent states e in y, shape (k,).
        A, B: shapes (k, k) and (k, n_d).
        T, Y: shapes (n, k) and (n, n_d); T is the identity in the rows `states`.
    """

    states: Indices
    A: Array
    B: Array
    T: Array
    Y: Array


def independent(C: Array, scale: Array, states: Indices) -> tuple[Indices, Array]:
    """Return indices of independent states e, and T with C T = 0 and the identity in their rows.

    Args:
        C: derivatives of the conditions, shape (m, n).
        scale: typical magnitudes of the unknowns, shape (n,).
        states: indices of the unknowns among which e is selected.
    """
    rows = C * scale
    size = np.maximum(np.abs(rows).max(axis=1, keepdims=True, initial=0.0), 1e-300)
    _, s, V = np.linalg.svd(rows / size)
    rank = int((s > DEPENDENT * s.max(initial=0.0)).sum())
    N = scale[:, None] * V[rank:].T
    share = N[states] / scale[states][:, None]
    found: Any = qr(share.T, mode="economic", pivoting=True)
    _, R, order = found
    k = int((np.abs(np.diag(R)) > DEPENDENT).sum())
    chosen = np.sort(np.asarray(states)[order[:k]]).astype(np.intp)
    T = N @ np.linalg.pinv(N[chosen])
    T[chosen] = np.eye(k)
    return chosen, T


def conditions(eq: Equations, y: Array, d: Array) -> tuple[Array, Array, Array]:
    """Return C, and derivatives of f by y and by d, at y."""
    J, of_C, of_slips, K, *_ = (slope.full() for slope in eq.slopes(y, d))
    stuck = eq.stuck(y)
    modes = np.eye(y.size)[eq.modes]
    return np.vstack([J[eq.algebraic], of_C, of_slips[stuck], modes]), J, K


def tangent(eq: Equations, y: Array, d: Array) -> Tangent:
    """Return the linear equations at the equilibrium `y`."""
    C, J, K = conditions(eq, y, d)
    states = np.setdiff1d(np.arange(len(eq.model.x)), eq.modes)
    chosen, T = independent(C, eq.scale, states)
    rows, free, moving = eq.algebraic, null_space(eq.M), eq.differential
    Y = -free @ np.linalg.solve(J[rows] @ free, K[rows])
    E = eq.M[moving] @ T
    right = np.hstack([J[moving] @ T, K[moving] + J[moving] @ Y])
    size = (np.abs(eq.M[moving]) @ eq.scale)[:, None]
    both: Array = np.linalg.lstsq(E / size, right / size, rcond=None)[0].astype(float)
    return Tangent(chosen, both[:, : chosen.size], both[:, chosen.size :], T, Y)
