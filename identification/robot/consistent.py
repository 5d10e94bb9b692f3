"""Physically consistent inertias: bodies with a positive density.

    minimise  (K pi - x)' C^-1 (K pi - x) / 2 + sum_k D(P_k),
    D(P) = tr(P_0^-1 P) - log det(P_0^-1 P) - 4,   P = [tr(J)/2 - J, m c; m c', m]

x are the estimated base parameters and C is their covariance. A body is a distribution of mass if
its pseudo-inertia P is positive definite. D is the divergence from the values P_0 of the file: it
is convex and keeps P positive definite, and near P_0 it is half the square of the relative change.
Combinations that the data do not determine therefore remain close to the file. The problem is
convex and is solved by Newton's method.
Sources: Wensing, Kim and Slotine, IEEE Robotics and Automation Letters 3(1), 2018; Lee, Wensing and
Park, IEEE Trans. Robotics 36(1), 2020.
"""

import numpy as np

from identification.data.record import Array
from identification.robot.dynamics import COLUMNS, ROWS

FLOOR = 1e-3
"""Least eigenvalue of P_0 relative to its largest, for point masses and unphysical files."""
ROUNDS = 100
"""Largest number of Newton steps."""
DECREMENT = 1e-9
"""Newton decrement at which the iteration ends."""


def pseudo_inertia(numbers: Array) -> Array:
    """Return P of the ten inertial parameters of a body, shape (4, 4)."""
    J, P = np.zeros((3, 3)), np.zeros((4, 4))
    J[ROWS, COLUMNS] = J[COLUMNS, ROWS] = numbers[4:]
    P[:3, :3] = np.trace(J) / 2 * np.eye(3) - J
    P[:3, 3] = P[3, :3] = numbers[1:4]
    P[3, 3] = numbers[0]
    return P


BASIS = np.array([pseudo_inertia(row) for row in np.eye(10)])
"""Derivatives of P by the parameters, shape (10, 4, 4)."""


def consistent(x: Array, C: Array, K: Array, bodies: Array, rotors: Array) -> tuple[Array, Array]:
    """Return inertial parameters of all bodies and rotor inertias, all physically consistent.

    Args:
        x: base parameters, shape (b,).
        C: their covariance; zero along combinations that are not determined, shape (b, b).
        K: matrix of the combinations, shape (b, 10 k + r).
        bodies: values of the file, shape (10 k,).
        rotors: expected sizes of the rotor inertias, shape (r,).
    """
    nearest = [_regular(pseudo_inertia(row)) for row in bodies.reshape(-1, 10)]
    inverses = [np.linalg.inv(P) for P in nearest]
    size = np.sqrt(np.diag(C))
    size = np.where(size > 0, size, 1.0)
    values, V = np.linalg.eigh(C / np.outer(size, size))
    known = values > 1e-12 * values.max()
    root = (V[:, known] / np.sqrt(values[known])).T / size  # root' root = C^-1
    B, goal = root @ K, root @ x
    p = np.concatenate([*map(_numbers, nearest), rotors])

    def barrier(p: Array) -> float:
        total = float(np.sum(p[bodies.size :] / rotors)) if rotors.size else 0.0
        if np.any(p[bodies.size :] <= 0):
            return np.inf
        total -= float(np.sum(np.log(p[bodies.size :])))
        for row, inverse in zip(p[: bodies.size].reshape(-1, 10), inverses, strict=True):
            P = pseudo_inertia(row)
            if np.linalg.eigvalsh(P)[0] <= 0:
                return np.inf
            total += float(np.sum(inverse * P)) - float(np.linalg.slogdet(P)[1])
        return total

    def cost(p: Array) -> float:
        return float(np.sum((B @ p - goal) ** 2)) / 2 + barrier(p)

    now = cost(p)
    for _ in range(ROUNDS):
        g, H = B.T @ (B @ p - goal), B.T @ B
        for k, inverse in enumerate(inverses):
            part = slice(10 * k, 10 * k + 10)
            Q = np.linalg.inv(pseudo_inertia(p[part])) @ BASIS  # (10, 4, 4)
            g[part] += np.einsum("iab,ab->i", BASIS, inverse) - np.trace(Q, axis1=1, axis2=2)
            H[part, part] += np.einsum("iab,jba->ij", Q, Q)
        for k, size_k in enumerate(rotors, start=bodies.size):
            g[k] += 1 / size_k - 1 / p[k]
            H[k, k] += 1 / p[k] ** 2
        scale = 1 / np.sqrt(np.diag(H))
        step = -scale * np.linalg.solve(H * np.outer(scale, scale), scale * g)
        if -g @ step < DECREMENT * (1.0 + abs(now)):
            break
        length = 1.0
        while (there := cost(p + length * step)) > now + 1e-4 * length * (g @ step):
            length /= 2
            if length < 1e-9:
                return p[: bodies.size], p[bodies.size :]
        p, now = p + length * step, there
    return p[: bodies.size], p[bodies.size :]


def _regular(P: Array) -> Array:
    """Return the nearest matrix whose eigenvalues are at least `FLOOR` of the largest."""
    unit = np.diag([1.0, 1.0, 1.0, np.sqrt(max(np.trace(P[:3, :3]), 1e-12) / max(P[3, 3], 1e-12))])
    values, V = np.linalg.eigh(unit @ P @ unit)  # all entries in kg m^2
    back = np.linalg.inv(unit)
    return back @ (V * np.maximum(values, FLOOR * values.max())) @ V.T @ back


def _numbers(P: Array) -> Array:
    """Return the ten inertial parameters of P; the inverse of `pseudo_inertia`."""
    J = np.trace(P[:3, :3]) * np.eye(3) - P[:3, :3]
    return np.array([P[3, 3], *P[:3, 3], *J[ROWS, COLUMNS]])
