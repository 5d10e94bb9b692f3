"""Conversion of the equations of a model to the form M y' = f(y, d), which steps integrate.

A system has one column of unknowns, one right-hand side and a constant mass matrix, which may be
singular. If the matrix dF/dx' of a fully implicit model is constant, it becomes the mass matrix;
nothing is inverted. Only rows that depend on other rows are replaced by the combination of
equations that contains no rates,

    M_i = sum_k c_k M_k   =>   0 = f_i - sum_k c_k f_k,

because these equations are as small as J, and in M / (gamma h) - J they would be lost in the
rounding of M / h. (Example: a capacitor between two nodes of a circuit, whose current leaves one
node and enters the other.)

If dF/dx' is not constant, the rates v = B x' on which the equations depend become unknowns,

    B x' = v,   0 = F(v, x, z),

and dependent equations are combined in the same way.

Limits: the null space of the matrix must not change with states or parameters. Write a charge q(x)
that makes it change as an additional state, q' = i, 0 = q - q(x).
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.foundation.checks import listed
from symfric.foundation.numeric import Array
from symfric.foundation.variable import stacked
from symfric.integrator.equations.expressions import branchless, divided_once
from symfric.integrator.equations.inputs import InputData
from symfric.integrator.equations.manifold import Manifold, holonomic_columns, manifold
from symfric.integrator.equations.matrices import Order, echelon, null_space
from symfric.model import Model
from symfric.model.parts import Inner

Columns = tuple[ca.SX, ca.SX, ca.SX, list[str]]
"""Unknowns without time, right-hand side, mass matrix and names."""
SAMPLES = 4
"""Number of random points at which a non-constant matrix is evaluated."""


def check_index(where: str, y: ca.SX, f: ca.SX, mass: ca.SX, names: list[str]) -> None:
    """Check that in M y' = f(y) the equations without rates determine the remaining unknowns.

    The rates determine M y; the equations without rates must determine the rest of y. Constraints
    on positions alone, for example, do not determine their multipliers (index 3).

    Raises:
        ValueError: the unknowns are structurally undetermined, for any numerical values.
    """
    pattern, every = ca.DM(mass.sparsity(), 1), range(f.numel())
    still = [i for i in every if not pattern[i, :].nnz()]
    if not still:
        return
    pattern[still, :] = ca.DM(ca.jacobian_sparsity(f[still], y), 1)
    pattern = ca.sparsify(pattern)
    rank = ca.sprank(pattern)
    if rank == f.numel():
        return
    loose = [names[i] for i in every if ca.sprank(pattern[:, [k for k in every if k != i]]) == rank]
    raise ValueError(
        f"{where}: expected algebraic equations that determine {listed(loose)} at given states "
        "(index 1), got some that do not depend on them; differentiate these by time, or make the "
        "changing quantity (a charge, a momentum) a state of its own"
    )


def implicit_columns(model: Model) -> Columns:
    """Return the unknowns, right-hand side, mass matrix and names of a model with a residual."""
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
    """Return M as a sparse matrix, extended by zero columns to this number of columns."""
    return ca.sparsify(ca.horzcat(ca.SX(ca.DM(M)), ca.SX(M.shape[0], columns - M.shape[1])))


def _dependent(M: Array) -> dict[int, ca.DM]:
    """Return the dependent rows of M: row -> coefficients of all rows, 0 for the row itself."""
    rows, B = echelon(M.T)
    coefficients = np.zeros((M.shape[0], M.shape[0]))
    coefficients[:, rows] = B.T
    return {i: ca.sparsify(ca.DM(coefficients[i])) for i in set(range(M.shape[0])).difference(rows)}


def _combined(F: ca.SX, at_rest: ca.SX, dependent: Mapping[int, ca.DM]) -> ca.SX:
    """Return F with rates eliminated from `dependent` equations; `at_rest` is F at zero rates."""
    found = ca.SX(F)
    for i, coefficients in dependent.items():
        found[i] = at_rest[i] - ca.dot(coefficients, at_rest)
    return found


def _samples(model: Model, matrix: ca.SX) -> list[Array]:
    """Return the matrix at random points near the start; random entries if it is finite at none."""
    rng = np.random.default_rng(0)
    starts = {"x": model.initial_state(), "z": np.array([float(v.start) for v in model.z])}
    starts |= {"u": model.values("u"), "p": model.values("p")}
    columns = [model.vector(letter) for letter in starts]
    at = ca.Function("matrix", [model.t, model.xdot, *columns], [ca.densify(matrix)])
    found: list[Array] = []
    for _ in range(SAMPLES):
        near = [
            start * rng.uniform(0.9, 1.1, start.size)
            + 0.1 * model.nominal(letter) * rng.uniform(-1, 1, start.size)
            for letter, start in starts.items()
        ]
        rates = model.nominal("x") * rng.normal(size=len(model.x))
        found.append(ca.DM(at(rng.uniform(), rates, *near)).full())
    finite = [M for M in found if np.isfinite(M).all()]
    pattern = ca.DM(matrix.sparsity(), 1).full()
    return finite or [pattern * rng.normal(size=pattern.shape)]


@final
@dataclass(frozen=True, eq=False)
class System:
    """System M y' = f(y, d) with y = (x, z, t): states, algebraic variables, time.

    Time is an unknown with rate 1, present only if the equations depend on it. Methods therefore
    need no terms for explicit time.

    Attributes:
        y: SX symbols (n, 1).
        d: SX symbols of the constants of a run: parameters, then input data.
        f: SX (n, 1).
        mass: SX (n, n), constant.
        nx: number of differential states, the first rows of y.
        timed: True if y ends with time.
        names: names of the unknowns, for messages.
        nominal: typical magnitude of each differential state, shape (nx,).
        monitors: SX (m, 1), further expressions whose relative error is controlled: the monitors of
            the model and its algebraic variables.
        monitor_nominal: SX (m, 1), typical magnitudes of the monitors, in terms of d.
        manifold: constraint manifold of a holonomic model.
        pivots: groups of rows whose diagonal is a safe pivot after the groups before are
            eliminated: rows with the rate of their own unknown and mass matrices, constraints,
            normal forces.
        slips: number of monitors that come from the model; they are the first ones.
        inner: f in terms of inner unknowns, with sparse derivatives; None if f is used directly.
            Its groups replace `pivots`.
        orders: matrix name -> pivot order, for matrices whose order of least fill is unstable
            (`symfric.integrator.equations.matrices`).
        slope: Jacobian of f; None to derive it from f.
        branchless: True if steps evaluate tanh without branches
            (`symfric.integrator.equations.expressions`).
    """

    y: ca.SX
    d: ca.SX
    f: ca.SX
    mass: ca.SX
    nx: int
    timed: bool
    names: tuple[str, ...]
    nominal: NDArray[np.float64]
    monitors: ca.SX
    monitor_nominal: ca.SX
    manifold: Manifold | None = None
    pivots: tuple[tuple[int, ...], ...] = ()
    slope: ca.SX | None = None
    slips: int = 0
    inner: Inner | None = None
    orders: Mapping[str, Order] = field(default_factory=dict[str, Order])
    branchless: bool = True

    @cached_property
    def n(self) -> int:
        """Number of unknowns."""
        return self.y.numel()

    @property
    def rubs(self) -> bool:
        """True if the model has sliding velocities, or contacts that may stick."""
        return self.slips > 0 or (self.manifold is not None and self.manifold.applied > 0)

    @cached_property
    def J(self) -> ca.SX:
        """Jacobian of f, shape (n, n)."""
        return ca.jacobian(self.f, self.y) if self.slope is None else self.slope

    @cached_property
    def plain(self) -> "System":
        """The same system with tanh unchanged, for steps that are differentiated."""
        return replace(self, slope=self.J, branchless=False)

    def in_steps(self, function: ca.Function) -> ca.Function:
        """Return a `function` of the equations in the form that steps call."""
        return branchless(function) if self.branchless else function

    @cached_property
    def M(self) -> Array:
        """Mass matrix as numbers."""
        return ca.DM(self.mass).full()

    @cached_property
    def is_ode(self) -> bool:
        """True if the mass matrix is the identity."""
        return np.array_equal(self.M, np.eye(self.n))

    @cached_property
    def has_pivots(self) -> bool:
        """True if pivots have to be chosen numerically.

        Pivots of pure differential equations (1/(gamma h) dominates for small steps) and of
        mechanisms (definite matrices) are stable.
        """
        return self.manifold is None and not self.is_ode

    @cached_property
    def is_semi_explicit(self) -> bool:
        """True if the mass matrix is the identity except for zeros on its diagonal."""
        diagonal = np.diag(self.M)
        return bool((np.diag(diagonal) == self.M).all() and np.isin(diagonal, (0.0, 1.0)).all())

    @cached_property
    def algebraic(self) -> tuple[list[int], list[int]]:
        """Rows without rates (equations) and columns without rates (unknowns) of M y' = f."""
        rows, columns = (np.flatnonzero(~self.M.any(axis=axis)).tolist() for axis in (1, 0))
        return rows, columns

    @cached_property
    def free(self) -> NDArray[np.float64]:
        """Directions of y that the algebraic equations determine, as columns; M maps them to zero.

        They are unit vectors of the unknowns without rates if the nonzero columns of M are linearly
        independent.
        """
        return null_space(self.M)

    @cached_property
    def constraints(self) -> ca.Function:
        """Function (y, d) -> algebraic equations and their derivatives along `free`; dense."""
        g = self.f[self.algebraic[0]]
        slope = ca.jacobian(g, self.y)
        columns = self.algebraic[1]
        along = slope[:, columns] if len(columns) == g.numel() else slope @ ca.DM(self.free)
        both = [ca.densify(g), ca.densify(along)]
        return ca.Function("constraints", [self.y, self.d], both, {"cse": True})


def system(model: Model, inputs: InputData) -> System:
    """Insert the inputs into the model and convert it to M y' = f(y, d).

    An implicit model that is linear in x' with a constant matrix keeps that matrix as its mass
    matrix, even if it is singular. Any other implicit model gets its rates as additional algebraic
    unknowns, and a holonomic model its accelerations.

    Raises:
        ValueError: the model has no unknowns, or its index is above 1.
    """
    mechanics, nx, u = model.holonomic, len(model.x), model.vector("u")
    if mechanics is not None:
        unknowns, f, mass, names = holonomic_columns(model, mechanics)
    elif model.ode is None:
        unknowns, f, mass, names = implicit_columns(model)
    else:
        unknowns, f = ca.vertcat(model.vector("x"), model.vector("z")), model.ode
        f = ca.vertcat(f, model.alg)
        mass = ca.diagcat(ca.SX.eye(nx), ca.SX(len(model.z), len(model.z)))
        names = [v.name for v in (*model.x, *model.z)]
    if not names:
        raise ValueError(
            f"model '{model.name}': expected states x or unknowns z to solve for, got none; "
            "evaluate its outputs by model.function"
        )
    f = ca.substitute(f, u, inputs.expression)
    if mechanics is None:
        check_index(f"model '{model.name}'", unknowns, f, mass, names)
    phi = mechanics.phi if mechanics else ca.SX(0, 1)
    timed = bool(ca.depends_on(ca.vertcat(f, phi), model.t))
    if timed:
        unknowns, f = ca.vertcat(unknowns, model.t), ca.vertcat(f, 1)
        mass = ca.diagcat(mass, 1)
        names.append("t")
    n, m = (mechanics.n, phi.numel()) if mechanics else (0, 0)
    # algebraic unknowns need error control even if no state depends on them, or they would drift
    watched = [*((m.expression, m.nominal) for m in model.monitors)]
    idle = range(m - mechanics.norms, m) if mechanics else ()
    watched += [(v.symbol, v.nominal) for i, v in enumerate(model.z) if i not in idle]
    monitors = stacked(ca.SX(expression) for expression, _ in watched)
    d = ca.vertcat(model.vector("p"), inputs.data)
    own = (i for i in range(nx) if mass.sparsity().has_nz(i, i))
    loop = tuple(range(nx + n + m, nx + n + len(model.z))) if mechanics else ()
    inner = None if mechanics is None else mechanics.inner
    if inner is not None:
        rows, values = ca.substitute([inner.f, inner.values], [u], [inputs.expression])
        whole = ca.vertcat(f[:nx], rows, f[nx + rows.numel() :, 0])
        inner = replace(inner, values=values, f=whole)
    return System(
        unknowns,
        d,
        divided_once(ca.cse(f)),
        ca.sparsify(mass),
        nx,
        timed,
        tuple(names),
        model.nominal("x"),
        ca.substitute(monitors, u, inputs.expression),
        stacked(ca.SX(nominal) for _, nominal in watched),
        manifold(model, mechanics, unknowns, d, f, inputs.expression) if mechanics else None,
        ((*own, *range(nx, nx + n)), tuple(range(nx + n, nx + n + m)), loop),
        slips=len(model.monitors),
        inner=inner,
    )
