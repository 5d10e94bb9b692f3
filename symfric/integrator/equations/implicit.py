"""Fully implicit models in the form M y' = f(y), whatever the rank of their mass matrix.

A constant matrix dF/dx' stays the mass matrix, singular or not: nothing is inverted. Only rows that
follow from others are replaced by what is left over without rates,

    M_i = sum_k c_k M_k   =>   0 = f_i - sum_k c_k f_k,

because in M / (gamma h) - J these equations, as small as J, would drown in the rounding of M / h.
(A capacitor between two nodes of a circuit: its current leaves one and enters the other.)

Where dF/dx' is not constant, the rates v = B x' that the equations depend on are unknowns,

    B x' = v,   0 = F(v, x, z),

with the same combination of equations that never depend on rates.

Limits: the directions that a matrix maps to zero must not turn with states or parameters. Write
such a charge q(x) as a state of its own, q' = i, 0 = q - q(x).
"""

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.integrator.equations.rank import echelon
from symfric.model import Model

Array = NDArray[np.float64]
Equations = tuple[ca.SX, ca.SX, ca.SX, list[str]]
"""Unknowns without time, right-hand side, mass matrix and names."""
SAMPLES = 4
"""Random points at which a matrix that is not constant is looked at."""


def implicit_columns(model: Model) -> Equations:
    """Unknowns, right-hand side, mass matrix and names of a model with a residual."""
    x, z, F = model.vector("x"), model.vector("z"), model.residual
    nx, names = x.numel(), [v.name for v in (*model.x, *model.z)]
    matrix = ca.jacobian(F, model.xdot)
    at_rest = ca.substitute(F, model.xdot, ca.SX.zeros(nx))
    if matrix.is_constant():
        M = ca.DM(matrix).full()
        dependent = _dependent(M)
        M[list(dependent)] = 0.0
        f = -_combined(at_rest, at_rest, dependent)
        return ca.vertcat(x, z), f, _padded(M, f.numel()), names
    samples = _samples(model, matrix)
    moving, B = echelon(np.vstack(samples))
    v, rates = model.xdot[moving], ca.SX.zeros(nx)
    rates[moving] = v
    moved = ca.substitute(F, model.xdot, rates)
    f = ca.vertcat(v, _combined(moved, at_rest, _dependent(np.hstack(samples))))
    mass = ca.vertcat(_padded(B, f.numel()), ca.SX(F.numel(), f.numel()))
    names[nx:nx] = [f"{model.x[i].name}_dot" for i in moving]
    return ca.vertcat(x, v, z), f, mass, names


def _padded(M: Array, columns: int) -> ca.SX:
    """M as a sparse matrix with that many columns."""
    return ca.sparsify(ca.horzcat(ca.SX(ca.DM(M)), ca.SX(M.shape[0], columns - M.shape[1])))


def _dependent(M: Array) -> dict[int, dict[int, float]]:
    """Rows of M that follow from others: row -> coefficients of these; rows of zeros have none."""
    rows, B = echelon(M.T)
    return {
        i: {rows[k]: float(B[k, i]) for k in np.flatnonzero(B[:, i])}
        for i in range(M.shape[0])
        if i not in rows
    }


def _combined(F: ca.SX, at_rest: ca.SX, dependent: dict[int, dict[int, float]]) -> ca.SX:
    """F, with dependent equations freed of rates; `at_rest` is F without any."""
    found = ca.SX(F)
    for i, coefficients in dependent.items():
        found[i] = at_rest[i] - sum(c * at_rest[k] for k, c in coefficients.items())
    return found


def _samples(model: Model, matrix: ca.SX) -> list[Array]:
    """The matrix at random points near the start; with random entries where it is not finite."""
    rng = np.random.default_rng(0)
    columns = {"x": model.vector("x"), "z": model.vector("z")}
    columns |= {"u": model.vector("u"), "p": model.vector("p")}
    at = ca.Function("matrix", [model.t, model.xdot, *columns.values()], [ca.densify(matrix)])
    starts = {"x": model.initial_state(), "u": model.values("u"), "p": model.values("p")}
    starts["z"] = np.array([float(v.start) for v in model.z])
    found: list[Array] = []
    for _ in range(SAMPLES):
        beside = [
            starts[name] * rng.uniform(0.9, 1.1, starts[name].size)
            + 0.1 * model.nominal(name) * rng.uniform(-1, 1, starts[name].size)
            for name in columns
        ]
        rates = model.nominal("x") * rng.normal(size=len(model.x))
        found.append(ca.DM(at(rng.uniform(), rates, *beside)).full())
    finite = [M for M in found if np.isfinite(M).all()]
    pattern = ca.DM(matrix.sparsity(), 1).full()
    return finite or [pattern * rng.normal(size=pattern.shape)]
