"""Equations at a collocation point, and coupling of the points of an interval.

For an explicit model with states x the rows are

    0 = h f(t, x, z, u, p) - x'(s_j),   0 = alg(t, x, z, u, p),   path conditions

For a mechanism the rows are implicit. Its accelerations are slopes a = v'(s_j) / h of the
polynomial, so neither the equations nor their derivatives invert a mass matrix:

    0 = h v - q'(s_j),   0 = h (M(q) a + phi_q' lam - Q),   0 = phi_q a + ...,   0 = h y' - y'(s_j)

All rows are divided by nominal values. Slopes of the polynomials are linear in the unknowns.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import final

import casadi as ca
import numpy as np

from ocp.formulation.phase import Span
from ocp.transcription.blocks import Array, Block, Indices, Linear, Piece, Rows, block, order_of
from ocp.transcription.unknowns import Grid, Local
from symfric.foundation.programs import CompileError
from symfric.foundation.variable import stacked
from symfric.integrator.compiled.background import Prospect
from symfric.integrator.compiled.compiler import library

PER_INSTRUCTION = 3e-9
"""Time of the virtual machine per instruction [s]."""
ITERATIONS = 30
"""Smallest number of iterations of a solve, each with one call of every function."""
FUNCTIONS = ("rows", "share", "slopes", "jacobian", "hessian")


@final
@dataclass(eq=False)
class Engine:
    """Block whose Functions are compiled when this saves time.

    Attributes:
        block: the original block of SX Functions.
        expected: predicted time [s] of the evaluations so far, which compiled code would reduce.
    """

    block: Block
    expected: float = 0.0

    def __post_init__(self) -> None:
        functions = {name: getattr(self.block, name) for name in FUNCTIONS}
        self._functions = {name: f for name, f in functions.items() if f is not None}
        self._instructions = 0  # blocks that call other functions are not compiled
        if self.block.rows.is_a("SXFunction"):
            self._instructions = sum(f.n_instructions() for f in self._functions.values())
        names = tuple(f.name() for f in self._functions.values())
        self._prospect = Prospect(self._source, names, self._instructions)

    def _source(self) -> str:
        code = ca.CodeGenerator("block.c")
        for function in self._functions.values():
            code.add(function)
        return code.dump()

    @cached_property
    def compiled(self) -> Block:
        """Block with compiled Functions."""
        path = str(library(self._prospect.written(), *self._prospect.names))
        functions = {name: ca.external(f.name(), path) for name, f in self._functions.items()}
        return replace(self.block, **functions)

    def at(self, places: int) -> Block:
        """Return the block for a number of places per iteration, compiled if this saves time."""
        if "compiled" in self.__dict__:
            return self.compiled
        self.expected += ITERATIONS * places * self._instructions * PER_INSTRUCTION
        if self._prospect.pays(self.expected):
            try:
                return self.compiled
            except CompileError:  # compiled code is optional
                self._prospect.hopeless = True
        return self.block


LEAST, MOST = 1e-6, 1e6
"""Limits of the scales of rows without nominal value, which are derived from derivatives."""


@final
@dataclass(frozen=True, eq=False)
class PointEquations:
    """Equations of one collocation point of a phase.

    Attributes:
        local: unknowns of the point, which the slopes of the velocities of a mechanism follow in v.
        engine: rows and share of the cost.
        rows: names, sizes and ranges of the rows; the path conditions come last.
        sloped: for each state, index of the row from which its slope is subtracted; -1 if the slope
            is a local unknown.
    """

    local: Local
    engine: Engine
    rows: Rows
    sloped: Indices


def point_equations(local: Local) -> PointEquations:
    """Formulate the equations of a collocation point of a phase."""
    span, model, h = local.span, local.span.model, local.h
    mechanics, nominal, paths = model.holonomic, model.nominal("x"), Rows.of(span.path)
    ode = ca.SX(0, 1) if model.ode is None else model.ode
    n, a, implicit, further = 0, ca.SX(0, 1), model.alg, ode
    if mechanics is not None:
        n, a, implicit, further = mechanics.n, mechanics.a, mechanics.implicit, mechanics.rates
    slopes = ca.SX.sym("slopes", n)
    at_start = _at_start(span, a)
    mass = at_start(ca.diag(ca.jacobian(implicit[:n, :], a))) * nominal[n : 2 * n]
    algebraic = implicit[n:, :]
    sizes = np.concatenate([*(model.nominal(letter) for letter in "xzu"), nominal[n : 2 * n]])
    slope = ca.jacobian(algebraic, ca.vertcat(*span.symbols[1:4], a))
    J = ca.fabs(slope) @ ca.diag(ca.DM(sizes))  # change of rows by nominal changes of unknowns
    largest = stacked(ca.mmax(J[i, :]) if J[i, :].nnz() else 1.0 for i in range(len(model.z)))
    scale = np.concatenate([nominal[:n], mass, nominal[2 * n :], at_start(largest)])
    path = stacked(row.expression for row in span.path)
    outputs = [ca.densify(ca.SX(e)) for e in (implicit, further, path, span.running)]
    implicit, further, path, running = ca.Function("evaluated", [*span.symbols, a], outputs).call(
        [*local.values, slopes * ca.DM(nominal[n : 2 * n]) / h]
    )
    rates = h * ca.vertcat(local.values[1][n : 2 * n, :], implicit[:n, :], further)
    rows = ca.vertcat(rates, implicit[n:, :], path) / ca.DM([*scale, *paths.scale])
    names = [f"the equation of {v.name}" for v in model.x]
    names += [f"the algebraic equation {i + 1}" for i in range(len(model.z))]
    share = None if span.running.is_zero() else local.weight * running
    return PointEquations(
        local,
        Engine(block("point", ca.vertcat(local.v, slopes), local.theta, rows, share)),
        Rows.zero(names, scale) + paths,
        np.concatenate([np.arange(n), np.full(n, -1), np.arange(2 * n, len(model.x))]),
    )


def _at_start(span: Span, a: ca.SX) -> Callable[[ca.SX], Array]:
    """Return a function from an expression to its absolute values at the start of the model.

    Accelerations `a` are zero. The values are finite and between `LEAST` and `MOST`.
    """
    model = span.model
    z, u = (np.array([float(v.start) for v in group]) for group in (model.z, model.u))
    numbers = [ca.DM(x) for x in (0.0, model.initial_state(), z, u, span.p, np.zeros(a.numel()))]

    def sizes(expression: ca.SX) -> Array:
        function = ca.Function("at_start", [*span.symbols, a], [ca.densify(expression)])
        found = np.abs(np.array(function.call(numbers)[0]).ravel())
        return np.clip(np.where(np.isfinite(found) & (found > 0), found, 1.0), LEAST, MOST)

    return sizes


def piece_of_points(equations: PointEquations, grid: Grid) -> Piece:
    """Return the piece of the equations at all collocation points of a phase."""
    local, scheme = equations.local, grid.scheme
    span, d = grid.layout.spans[local.number], scheme.degree
    N = span.intervals
    interval, j = np.repeat(np.arange(N), d), np.tile(np.arange(d), N)
    carrying, slopes = span.carrying[:, :, interval], scheme.slopes[:, j]
    velocities = np.flatnonzero(equations.sloped < 0)
    known = np.flatnonzero(equations.sloped >= 0)
    factors = np.broadcast_to(slopes, (velocities.size, *slopes.shape))
    return local.piece(
        grid,
        equations.rows,
        equations.engine.at(N * d),
        (span.inner, span.z, span.u[:, interval]),
        (interval, scheme.nodes[1 + j]),
        order_of(local.number, interval, 2 + j),
        extra=[(carrying[velocities], factors)] if velocities.size else [],
        weights=scheme.weights[j],
        linear=Linear.of(
            np.repeat(equations.sloped[known], d + 1),
            carrying[known].reshape(-1, N * d),
            -np.tile(slopes, (known.size, 1)),
        ),
    )


def gaps(number: int, span: Span, grid: Grid) -> Piece:
    """Return the rows of continuity at the next node: x_(k+1) = sum_r ends[r] x_r."""
    own = grid.layout.spans[number]
    interval, names = np.arange(own.intervals), [v.name for v in span.model.x]
    carrying, weights = own.ends(grid.scheme)
    columns = np.concatenate([own.nodes[:, None, 1:], carrying], axis=1)
    weights = np.concatenate([np.ones((len(names), 1, own.intervals)), -weights], axis=1)
    return Piece(
        rows=Rows.zero([f"the continuity of {name}" for name in names], span.model.nominal("x")),
        order=order_of(number, interval, 0),
        span=number,
        interval=interval,
        offset=np.ones(own.intervals),
        linear=Linear.of(
            np.repeat(np.arange(len(names)), weights.shape[1]),
            columns.reshape(-1, own.intervals),
            weights.reshape(-1, own.intervals),
        ),
    )
