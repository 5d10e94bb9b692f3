"""Base parameters of a robot, and physically consistent inertias that agree with them.

Base parameters are the combinations of inertial parameters that determine torques. Some columns of
the regressor are zero or depend on others for every motion. With independent columns Y_1,

    Y pi = Y_1 x,   x = K pi,   Y = Y_1 K

Y_1 are the columns with a nonzero diagonal in the QR decomposition of Y over random motions.

Consistent bodies have a positive density. They

    minimise  (K pi - x)' C^-1 (K pi - x) / 2 + sum_k D(P_k),
    D(P) = tr(P_0^-1 P) - log det(P_0^-1 P) - 4,   P = [tr(J)/2 - J, m c; m c', m]

x are the estimated base parameters and C is their covariance. A body is a distribution of mass if
its pseudo-inertia P is positive definite. D is the divergence from the values P_0 of the file: it
is convex and keeps P positive definite, and near P_0 it is half the square of the relative change.
Combinations that the data do not determine therefore remain close to the file. The problem is
convex and is solved by Newton's method.
Sources: Gautier, J. Robotic Systems 8(4), 1991; Wensing, Kim and Slotine, IEEE Robotics and
Automation Letters 3(1), 2018; Lee, Wensing and Park, IEEE Trans. Robotics 36(1), 2020.
"""

from dataclasses import dataclass
from typing import final

import numpy as np

from identification.data.record import Array
from identification.robot.dynamics import COLUMNS, ROWS, TERMS, UNITS, RobotModel
from symfric.foundation.shown import brief

RANK = 1e-8
"""Entry of the diagonal of R relative to the norm of its column below which a column depends."""
SMALL = 1e-6
"""Factor of a combination below which a parameter is omitted."""
SAMPLES = 200
"""Number of random motions."""
NAMED = 3
"""Largest number of terms in the name of a combination."""


@final
@dataclass(frozen=True, eq=False)
class Base:
    """Base parameters x = K pi.

    Attributes:
        chosen: indices of the columns Y_1, shape (b,).
        K: shape (b, p), with the unit matrix in the columns `chosen`.
        labels, units: name and unit of each combination.
        values, scales: value of the file and prior scale of each combination, shape (b,).
        rotors: prior scales of the rotor inertias, the last parameters, shape (r,).
    """

    chosen: tuple[int, ...]
    K: Array
    labels: tuple[str, ...]
    units: tuple[str, ...]
    values: Array
    scales: Array
    rotors: Array

    __repr__ = brief


def regressor(model: RobotModel, q: Array, v: Array, a: Array, rotors: bool) -> Array:
    """Return the columns of all parameters, rotor inertias last, for N samples, (N, n, p)."""
    columns = model.inertial_columns(q, v, a)
    each = [columns, a[:, :, None] * np.eye(a.shape[1])] if rotors else [columns]
    return np.concatenate(each, axis=2)


def base_of(model: RobotModel, rotors: bool) -> Base:
    """Return the base parameters.

    The prior scale of m is the mass m of the body, that of m c is m L and that of J is m L^2, where
    L is the radius of gyration about its origin. That of a rotor inertia is a torque of the file
    divided by an acceleration.
    """
    motion = model.random_motion(SAMPLES)
    columns = regressor(model, *motion, rotors)
    per_body = model.pi.reshape(-1, 10)
    m, inertia = per_body[:, 0], per_body[:, 4:7].sum(axis=1) / 2
    L = np.sqrt(np.maximum(inertia / m, 1e-8))
    scales = (m[:, None] * L[:, None] ** np.array([0, 1, 1, 1, *[2] * 6])).ravel()
    labels = [f"{term} {body}" for body in model.bodies for term in TERMS]
    units, spins = [*UNITS * len(model.bodies)], np.zeros(0)
    if rotors:
        spins = np.std(columns[..., : model.pi.size] @ model.pi, axis=0) / np.std(motion[2], axis=0)
        labels += [f"rotor inertia {joint}" for joint in model.names]
        units += ["kg m^2" if unit == "rad" else "kg" for unit in model.units]
    scales, values = np.append(scales, spins), np.append(model.pi, np.zeros(spins.size))
    scaled = columns.reshape(-1, scales.size) * scales
    size = np.linalg.norm(scaled, axis=0)
    there = np.flatnonzero(size > RANK * size.max())
    R = np.linalg.qr(scaled[:, there] / size[there], mode="r")
    kept = there[np.abs(np.diag(R)) > RANK]
    mix = np.linalg.lstsq(scaled[:, kept], scaled, rcond=None)[0]
    mix[np.abs(mix) < SMALL] = 0.0
    mix[:, kept] = np.eye(kept.size)
    mix = mix * scales[kept, None] / scales
    names = tuple(_name(labels, int(k), row) for k, row in zip(kept, mix, strict=True))
    size = np.sqrt(np.sum((mix * scales) ** 2, axis=1))
    chosen = tuple(kept.tolist())
    return Base(chosen, mix, names, tuple(units[k] for k in chosen), mix @ values, size, spins)


def _name(labels: list[str], first: int, row: Array) -> str:
    """Return a combination as text, its own parameter first."""
    others = [k for k in np.flatnonzero(row).tolist() if k != first]
    terms = [f"{'-' if row[k] < 0 else '+'} {abs(row[k]):.3g} {labels[k]}" for k in others[:NAMED]]
    more = [f"+ {len(others) - NAMED} terms"] if len(others) > NAMED else []
    return " ".join([labels[first], *terms, *more])


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
