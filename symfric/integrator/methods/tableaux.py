"""Integration methods by their public names; their coefficients are in `tableaux.toml`."""

import tomllib
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

from symfric.integrator.methods.families import (
    BackwardEuler,
    Explicit,
    Exponential,
    Rosenbrock,
)
from symfric.integrator.methods.method import Array, Method
from symfric.integrator.methods.radau import Radau, collocation, error_weights, nodes


def _array(rows: list[Any]) -> Array:
    """Return a vector, or a matrix whose short rows are filled with zeros."""
    if rows and isinstance(rows[0], list):
        width = len(rows[-1]) + (not rows[0])
        return np.array([_array(row).tolist() + [0.0] * (width - len(row)) for row in rows])
    return np.array([Fraction(value) for value in rows], dtype=float)


def shampine(b: Array, D: Array) -> Array:
    """Return the coefficients H of the quartic that has the slopes k_1 and k_s at its ends.

    With the increment r = sum_j b_j k_j and the free term q = sum_j D_j k_j, the quartic is

        y_0 + theta [r + (1 - theta) (k_1 - r + theta (2 r - k_1 - k_s + (1 - theta) q))]

    D = 0 gives the cubic of Hermite, which has two rows.
    """
    first, last = np.eye(b.size)[[0, -1]]
    rows = [first - b, 2 * b - first - last + D, -D]
    return np.array(rows if D.any() else rows[:2])


def through(c: Array) -> Array:
    """Return the coefficients H of the polynomial through 0 and the increments at nodes c.

    The last node is 1.
    """
    inner, rows = c[:-1], np.eye(c.size)
    values = (rows[:-1] - inner[:, None] * rows[-1]) / (inner * (1 - inner))[:, None]
    vandermonde: Array = np.vander(inner, increasing=True)
    return np.linalg.solve(vandermonde, values)


def _explicit(A: Array, D: Array, **fields: Any) -> Explicit:
    """Return an explicit method whose dense output has the free term with the increments D."""
    return Explicit(A=A, H=shampine(A[-1], D), **fields)


def _read(family: Any, key: str) -> Any:
    """Return the method `key` of `tableaux.toml`."""
    fields = _TABLEAUX[key].items()
    return family(**{k: _array(v) if isinstance(v, list) else v for k, v in fields})


_TABLEAUX = tomllib.loads(Path(__file__).with_name("tableaux.toml").read_text("utf-8"))
_NODES = np.array([(4 - np.sqrt(6.0)) / 10, (4 + np.sqrt(6.0)) / 10, 1.0])
_POWERS = _NODES[:, None] ** np.arange(1, 4) / np.arange(1, 4)

RODAS5P: Rosenbrock = _read(Rosenbrock, "rodas5p")
DOPRI5: Explicit = _read(_explicit, "dopri5")
RADAU5 = Radau(
    name="Radau5",
    A=_POWERS @ np.linalg.inv(np.vander(_NODES, increasing=True)),
    E=np.array([-(13 + 7 * np.sqrt(6.0)) / 3, (-13 + 7 * np.sqrt(6.0)) / 3, -1 / 3]),
    H=through(_NODES),
    iterations=3,
    more=1,
    order=5,
    embedded=3,
    dense=4,
    dense_dae=4,
    source="Hairer and Wanner, Solving Ordinary Differential Equations II, IV.5 and IV.8, 1996",
)
_NODES_9 = nodes(5)
_MATRIX_9 = collocation(_NODES_9)
RADAU9 = Radau(
    name="Radau9",
    A=_MATRIX_9,
    E=error_weights(_NODES_9, _MATRIX_9),
    H=through(_NODES_9),
    iterations=5,
    more=3,
    order=9,
    embedded=5,
    dense=6,
    dense_dae=6,
    source="Hairer and Wanner, Stiff differential equations solved by Radau methods, "
    "J. Comp. Appl. Math. 111, 1999",
)
FOR_DERIVATIVES = replace(RADAU5, finer=8.0)
"""Method for derivatives of runs.

A step across the whole steep part of a law gives the right motion, but a wrong derivative. Limiting
steps to half the width of that part takes a quarter more steps, and reduces the error of
derivatives of a pump at rtol 1e-6 from 6e-3 to 1.5e-4. Derivatives by Rodas5P have twenty times the
error of Rodas5P itself.
"""
BACKWARD_EULER = BackwardEuler(
    name="backward Euler",
    iterations=4,
    order=1,
    source="Hairer and Wanner, Solving Ordinary Differential Equations II, IV.3, 1996",
)
EXPONENTIAL = Exponential(
    name="exponential Euler",
    order=1,
    source="Hochbruck and Ostermann, Exponential integrators, Acta Numerica 19, 2010",
)

METHODS: dict[str, Method] = {
    "rodas5p": RODAS5P,
    "rodas4p": _read(Rosenbrock, "rodas4p"),
    "rodas3": _read(Rosenbrock, "rodas3"),
    "radau5": RADAU5,
    "radau9": RADAU9,
    "dopri5": DOPRI5,
    "backward_euler": BACKWARD_EULER,
    "exponential": EXPONENTIAL,
}
"""All methods by their public names; the order test covers each of them."""
ADAPTIVE = {name: method for name, method in METHODS.items() if method.adaptive}
"""Methods with step size control, which `simulate` accepts."""


def key_of(method: Method) -> str:
    """Return the public name of `method`."""
    return next(key for key, known in METHODS.items() if known.name == method.name)
