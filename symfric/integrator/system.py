"""A model as the step sees it: one column of unknowns, one right-hand side, a mass pattern."""

from dataclasses import dataclass
from functools import cached_property
from typing import final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.integrator.inputs import Drivers
from symfric.model import Model


@final
@dataclass(frozen=True, eq=False)
class System:
    """M y' = f(y, d) with y = (x, z, t): states, algebraic variables, time.

    Time is an unknown with rate 1, and only where the equations depend on it, so that no method
    needs terms for explicit time.

    Attributes:
        y: SX symbols (n, 1).
        d: SX symbols of the constants of a run: parameters, then input data.
        f: SX (n, 1).
        mass: SX (n, n), constant.
        nx: number of differential states, the first rows of y.
        timed: whether y ends with time.
        names: of the unknowns, for messages.
        nominal: typical magnitude of each differential state, shape (nx,).
        monitors: SX (m, 1), expressions whose relative error is controlled too: those of the model
            and its algebraic variables.
        monitor_nominal: their typical magnitudes, shape (m,).
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
    monitor_nominal: NDArray[np.float64]

    @property
    def n(self) -> int:
        """Number of unknowns."""
        return self.y.numel()

    @cached_property
    def diagonal(self) -> tuple[int, ...]:
        """Differential equations with the rate of their own unknown: safe pivots."""
        return tuple(i for i in range(self.nx) if self.mass.sparsity().has_nz(i, i))

    @cached_property
    def is_ode(self) -> bool:
        """Whether the mass matrix is the identity."""
        return bool((ca.DM(self.mass).full() == np.eye(self.n)).all())

    @cached_property
    def algebraic(self) -> tuple[list[int], list[int]]:
        """Rows without rates (equations) and columns without rates (unknowns) of M y' = f."""
        pattern = ca.DM(self.mass.sparsity(), 1).full() != 0
        rows = [int(i) for i in np.flatnonzero(~pattern.any(axis=1))]
        columns = [int(i) for i in np.flatnonzero(~pattern.any(axis=0))]
        return rows, columns

    @cached_property
    def constraints(self) -> ca.Function:
        """(y, d) -> algebraic equations, and their derivatives by the algebraic unknowns."""
        rows, columns = self.algebraic
        g = self.f[rows]
        return ca.Function(
            "constraints", [self.y, self.d], [g, ca.jacobian(g, self.y[columns])], {"cse": True}
        )


def system(model: Model, inputs: Drivers) -> System:
    """Put the inputs into the model and bring it into the form M y' = f(y, d).

    An implicit model that is linear in x' with a constant matrix keeps that matrix as mass; any
    other one gets its rates as additional algebraic unknowns.
    """
    x, z = model.vector("x"), model.vector("z")
    nx = x.numel()
    names = [v.name for v in (*model.x, *model.z)]
    if model.ode is not None:
        unknowns, f = ca.vertcat(x, z), ca.vertcat(model.ode, model.alg)
        mass = ca.diagcat(ca.SX.eye(nx), ca.SX(z.numel(), z.numel()))
    else:
        matrix = ca.jacobian(model.residual, model.xdot)
        unknowns = ca.vertcat(x, z)
        if matrix.is_constant():
            f = -ca.substitute(model.residual, model.xdot, ca.SX.zeros(nx))
            mass = ca.horzcat(matrix, ca.SX(matrix.size1(), z.numel()))
        else:
            unknowns = ca.vertcat(x, model.xdot, z)
            f = ca.vertcat(model.xdot, model.residual)
            mass = ca.diagcat(ca.SX.eye(nx), ca.SX(f.numel() - nx, f.numel() - nx))
            names = [*names[:nx], *(f"{v.name}_dot" for v in model.x), *names[nx:]]
    f = ca.substitute(f, model.vector("u"), inputs.expression)
    timed = bool(ca.depends_on(f, model.t))
    if timed:
        unknowns, f = ca.vertcat(unknowns, model.t), ca.vertcat(f, 1)
        mass = ca.diagcat(mass, 1)
        names.append("t")
    # an algebraic unknown without influence on the states would be free to be anything
    watched = [*((m.expression, m.nominal) for m in model.monitors)]
    watched += [(v.symbol, v.nominal) for v in model.z]
    monitors = ca.vertcat(ca.SX(0, 1), *(ca.SX(expression) for expression, _ in watched))
    return System(
        unknowns,
        ca.vertcat(model.vector("p"), inputs.data),
        ca.cse(f),
        ca.sparsify(mass),
        nx,
        timed,
        tuple(names),
        model.nominal("x"),
        ca.substitute(monitors, model.vector("u"), inputs.expression),
        np.array([nominal for _, nominal in watched], dtype=float),
    )
