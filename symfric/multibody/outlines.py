"""Outlines of solids as lines, for films and schematics.

An outline is an array of points [m], shape (n, 3), in the axes of a frame; NaN interrupts the line.
"""

from collections.abc import Iterable
from itertools import combinations, product

import numpy as np

from symfric.foundation.numeric import Array

AROUND = 24
"""Number of chords of a circle."""


def box(x: float, y: float, z: float) -> Array:
    """Return the edges of a box with these sides [m] about the origin."""
    corners = np.array([*product((-0.5, 0.5), repeat=3)])
    edges = (pair for pair in combinations(corners, 2) if np.count_nonzero(pair[0] - pair[1]) == 1)
    return _joined(np.array(edge) * [x, y, z] for edge in edges)


def cylinder(radius: float, length: float) -> Array:
    """Return both ends and four lines of a cylinder about z [m]."""
    ends = [radius * _circle(2) + [0.0, 0.0, side * length / 2] for side in (-1, 1)]
    return _joined([*ends, *np.stack(ends, axis=1)[: AROUND : AROUND // 4]])


def sphere(radius: float) -> Array:
    """Return three circles of a sphere [m]."""
    return _joined(radius * _circle(axis) for axis in range(3))


def _circle(axis: int) -> Array:
    """Return the unit circle about an axis."""
    angles = np.linspace(0.0, 2 * np.pi, AROUND + 1)
    return np.insert(np.stack([np.cos(angles), np.sin(angles)], axis=1), axis, 0.0, axis=1)


def _joined(lines: Iterable[Array]) -> Array:
    """Return lines as one array, in which NaN separates them."""
    return np.concatenate([np.vstack([line, np.full(3, np.nan)]) for line in lines])
