"""Base parameters of a robot, and the combinations of them that a record determines.

Some columns of the regressor are zero or depend on others for every motion. The base parameters are
independent combinations that determine all torques:

    Y pi = Y_1 (pi_1 + K pi_2),   Y_2 = Y_1 K

Y_1 are the columns with a nonzero diagonal in the QR decomposition of the regressor over random
motions. Of these, a record determines only those that its motion excites. With s the prior scale of
each parameter (from the file) and sigma the noise of the torques, a combination of singular value d,

    sigma^-1 Y_1 diag(s) = U D V',

has the standard error 1 / d relative to its scale; it is determined if this is below one half.
Sources: Gautier, J. Robotic Systems 8(4), 1991; Pham and Gautier, ICRA 1991.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, final

import numpy as np

from identification.data.record import Array
from identification.robot.dynamics import TERMS, UNITS, RobotModel
from symfric.foundation.shown import brief

RANK = 1e-8
"""Entry of the diagonal of R relative to the norm of its column below which a column depends."""
SMALL = 1e-6
"""Factor of a combination below which a parameter is omitted."""
SURE = 0.5
"""Largest standard error of a determined parameter, relative to its scale."""
SAMPLES = 200
"""Number of random motions."""
NAMED = 3
"""Largest number of terms in the name of a combination."""


class Columns(NamedTuple):
    """Columns of a linear model of the torques other than friction.

    Attributes:
        labels, units: name and unit of each parameter, shape (p,).
        values: prior values, shape (p,).
        scales: prior scales, shape (p,).
    """

    labels: tuple[str, ...]
    units: tuple[str, ...]
    values: Array
    scales: Array


def columns_of(model: RobotModel, rotors: bool) -> Columns:
    """Return inertial parameters, rotor inertias if requested, and constant offsets.

    The scale of m is the mass m of the body, that of m c is m L and that of J is m L^2, where L is
    the largest distance of its mass from its origin that the file shows.
    """
    per_body = model.pi.reshape(-1, 10)
    m, J = per_body[:, 0], per_body[:, 4:7].sum(axis=1) / 2
    L = np.sqrt(np.maximum(J, 1e-8 * m) / m)
    scales = (m[:, None] * L[:, None] ** np.array([0, 1, 1, 1, *[2] * 6])).ravel()
    labels = [f"{term} {body}" for body in model.bodies for term in TERMS]
    units, n = [*UNITS * len(model.bodies)], len(model.joints)
    if rotors:
        labels += [f"rotor inertia {joint}" for joint in model.names]
        units += ["kg m^2" if unit == "rad" else "kg" for unit in model.units]
        reach = model.inertial_columns(*model.random_motion(SAMPLES)) @ model.pi
        qdd = model.random_motion(SAMPLES)[2]
        scales = np.append(scales, np.std(reach, axis=0) / np.std(qdd, axis=0))
    values = np.append(model.pi, np.zeros(n * rotors))
    return Columns(tuple(labels), tuple(units), values, scales)


def regressor(model: RobotModel, q: Array, v: Array, a: Array, rotors: bool) -> Array:
    """Return the columns of `columns_of` for N samples, shape (N, n, p)."""
    Y = model.inertial_columns(q, v, a)
    if rotors:
        Y = np.concatenate([Y, a[:, :, None] * np.eye(a.shape[1])], axis=2)
    return Y


@final
@dataclass(frozen=True, eq=False)
class Base:
    """Base parameters x = pi_1 + K pi_2.

    Attributes:
        chosen: indices of pi_1 among all parameters, shape (b,).
        K: shape (b, p), with the unit matrix in the columns `chosen`.
        labels, units: name and unit of each combination.
        values, scales: prior value and scale of each combination, shape (b,).
    """

    chosen: tuple[int, ...]
    K: Array
    labels: tuple[str, ...]
    units: tuple[str, ...]
    values: Array
    scales: Array

    __repr__ = brief


def base_of(model: RobotModel, columns: Columns, rotors: bool) -> Base:
    """Return the base parameters, from the numerical rank over random motions."""
    W = regressor(model, *model.random_motion(SAMPLES), rotors)
    W = W.reshape(-1, W.shape[2]) * columns.scales
    size = np.linalg.norm(W, axis=0)
    there = size > RANK * size.max()
    unit = W / np.where(there, size, 1.0)
    R = np.linalg.qr(unit[:, there], mode="r")
    kept = np.flatnonzero(there)[np.abs(np.diag(R)) > RANK]
    K = np.linalg.lstsq(W[:, kept], W, rcond=None)[0]
    K[np.abs(K) < SMALL] = 0.0
    K[:, ~there] = 0.0
    K[:, kept] = np.eye(kept.size)
    scales = np.sqrt(np.sum((K * columns.scales[kept, None]) ** 2, axis=1))
    K = K * columns.scales[kept, None] / columns.scales
    names = tuple(_name(columns.labels, k, row) for k, row in zip(kept, K, strict=True))
    units = tuple(columns.units[k] for k in kept)
    return Base(tuple(kept.tolist()), K, names, units, K @ columns.values, scales)


def _name(labels: Sequence[str], first: int, row: Array) -> str:
    """Return a combination as text, its own parameter first."""
    others = [k for k in np.flatnonzero(row) if k != first]
    terms = [f"{'-' if row[k] < 0 else '+'} {abs(row[k]):.3g} {labels[k]}" for k in others[:NAMED]]
    more = [f"+ {len(others) - NAMED} terms"] if len(others) > NAMED else []
    return " ".join([labels[first], *terms, *more])
