"""Base parameters of a robot: the combinations of inertial parameters that determine torques.

Some columns of the regressor are zero or depend on others for every motion. With independent
columns Y_1,

    Y pi = Y_1 x,   x = K pi,   Y = Y_1 K

Y_1 are the columns with a nonzero diagonal in the QR decomposition of Y over random motions.
Source: Gautier, J. Robotic Systems 8(4), 1991.
"""

from dataclasses import dataclass
from typing import final

import numpy as np

from identification.data.record import Array
from identification.robot.dynamics import TERMS, UNITS, RobotModel
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
