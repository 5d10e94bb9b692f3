"""Equations at a collocation point, and the coupling of the points of an interval.

For an explicit model with states x the rows are

    0 = h f(t, x, z, u, p) - x'(s_j),   0 = alg(t, x, z, u, p),   path conditions

For a mechanism they are implicit: its accelerations are slopes a = v'(s_j) / h of the polynomial,
so no mass matrix is inverted, in the equations or in their derivatives:

    0 = h v - q'(s_j),   0 = h (M(q) a + phi_q' lam - Q),   0 = phi_q a + ...,   0 = h y' - y'(s_j)

All rows are divided by nominal values; slopes of the polynomials are linear in the unknowns.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import final

import casadi as ca
import numpy as np

from ocp.formulation.phase import Span
from ocp.transcription.blocks import Array, Block, Indices, Linear, Piece, Rows, block, order_of
from ocp.transcription.schemes import Coefficients
from ocp.transcription.unknowns import Data, Layout, Local
from symfric.foundation.programs import CompileError
from symfric.foundation.variable import stacked
from symfric.integrator.compiled.background import Prospect
from symfric.integrator.compiled.compiler import library
from symfric.model.holonomic import Holonomic

PER_INSTRUCTION = 3e-9
"""Time of the virtual machine per instruction [s]."""
ITERATIONS = 30
"""Least number of solver iterations, each with one call of every function."""
FUNCTIONS = ("rows", "share", "slopes", "jacobian", "hessian")


@final
@dataclass(eq=False)
class Engine:
    """The fastest available Functions of a block, with a cache of compiled ones.

    Attributes:
        block: the original block, of SX.
        expected: predicted time [s] that compiled code would have saved so far.
    """

    block: Block
    expected: float = 0.0

    @cached_property
    def _functions(self) -> dict[str, ca.Function]:
        found = {name: getattr(self.block, name) for name in FUNCTIONS}
        return {name: function for name, function in found.items() if function is not None}

    @cached_property
    def _instructions(self) -> int:
        if not self.block.rows.is_a("SXFunction"):
            return 0  # calls of other functions do not fit in one C file
        return sum(function.n_instructions() for function in self._functions.values())

    @cached_property
    def _prospect(self) -> Prospect:
        names = tuple(function.name() for function in self._functions.values())
        return Prospect(self._source, names, self._instructions)

    @cached_property
    def _compiled(self) -> Block:
        prospect = self._prospect
        path = str(library(prospect.written(), *prospect.names))
        functions = {name: ca.external(f.name(), path) for name, f in self._functions.items()}
        return replace(self.block, **functions)

    def _source(self) -> str:
        code = ca.CodeGenerator("block.c")
        for function in self._functions.values():
            code.add(function)
        return code.dump()

    def at(self, places: int) -> Block:
        """Return the block, compiled if worthwhile, for a number of places per solver iteration."""
        if "_compiled" in self.__dict__:
            return self._compiled
        self.expected += ITERATIONS * places * self._instructions * PER_INSTRUCTION
        if self._prospect.pays(self.expected):
            try:
                return self._compiled
            except CompileError:  # solve without a compiler if it is broken
                self._prospect.hopeless = True
        return self.block


LEAST, MOST = 1e-6, 1e6
"""Limits of scales of rows without nominal value, which follow from their derivatives."""


@final
@dataclass(frozen=True, eq=False)
class PointEquations:
    """The equations of one collocation point of a phase.

    Attributes:
        local: its unknowns, followed in v by the slopes of the velocities of a mechanism.
        engine: rows and share of the cost.
        rows: names, sizes and ranges; path conditions are the last ones.
        sloped: for each state the row from which its slope is subtracted; -1 if the slope is a
            local unknown.
    """

    local: Local
    engine: Engine
    rows: Rows
    sloped: Indices

    @property
    def block(self) -> Block:
        """Rows and share of the cost, uncompiled."""
        return self.engine.block


def point_equations(local: Local) -> PointEquations:
    """Formulate the equations of a collocation point of a phase."""
    span, h = local.span, local.h
    model = span.model
    values, x_nominal = local.values, model.nominal("x")
    mechanics = model.holonomic
    conditions = stacked(row.expression for row in span.path)
    paths = Rows.of(span.path)
    slopes, sloped = ca.SX(0, 1), np.arange(len(model.x))
    equations = [f"the equation of {v.name}" for v in model.x]
    if mechanics is None:
        rates, algebraic = _evaluated(span, [model.ode, model.alg], values)
        rows = h * rates / ca.DM(x_nominal)
        scale = x_nominal
    else:
        n = mechanics.n
        slopes = ca.SX.sym("slopes", n)
        sloped = np.concatenate([np.arange(n), np.full(n, -1), np.arange(2 * n, len(model.x))])
        a = slopes * ca.DM(x_nominal[n : 2 * n]) / h
        implicit, further = _evaluated(
            span, [mechanics.implicit, mechanics.rates], values, (mechanics.a, a)
        )
        mass = _masses(span, mechanics) * x_nominal[n : 2 * n]
        first, last = x_nominal[:n], x_nominal[2 * n :]
        rows = ca.vertcat(
            h * values[1][n : 2 * n] / ca.DM(first),
            h * implicit[:n, :] / ca.DM(mass),
            h * further / ca.DM(last),
        )
        scale, algebraic = np.concatenate([first, mass, last]), implicit[n:, :]
    algebraic_scale = _row_sizes(span, mechanics)
    (path,) = _evaluated(span, [conditions], values)
    (running,) = _evaluated(span, [span.running], values)
    share = None if span.running.is_zero() else local.weight * running
    rows = ca.vertcat(rows, algebraic / ca.DM(algebraic_scale), path / ca.DM(paths.scale))
    names = [*equations, *(f"the algebraic equation {i + 1}" for i in range(len(model.z)))]
    return PointEquations(
        local,
        Engine(block("point", ca.vertcat(local.v, slopes), local.theta, rows, share)),
        Rows.zero(names, np.concatenate([scale, algebraic_scale])) + paths,
        sloped,
    )


def _evaluated(
    span: Span,
    expressions: Sequence[ca.SX | None],
    values: Sequence[ca.SX],
    accelerations: tuple[ca.SX, ca.SX] | None = None,
) -> list[ca.SX]:
    """Evaluate expressions in the symbols of the model at other values."""
    symbols, values = list(span.symbols), list(values)
    if accelerations is not None:
        symbols.append(accelerations[0])
        values.append(accelerations[1])
    outputs = [ca.SX(0, 1) if e is None else ca.densify(ca.SX(e)) for e in expressions]
    return ca.Function("evaluated", symbols, outputs).call(values)


def _masses(span: Span, mechanics: Holonomic) -> Array:
    """Return the diagonal of the mass matrix at the start of the model, shape (n,)."""
    n = mechanics.n
    M = ca.jacobian(mechanics.implicit[:n, :], mechanics.a)
    return _positive(_at_start(span, ca.diag(M)))


def _row_sizes(span: Span, mechanics: Holonomic | None) -> Array:
    """Return the largest change of each algebraic row for a nominal change of an unknown."""
    model = span.model
    if not model.z:
        return np.zeros(0)
    rows, unknowns = model.alg, [model.vector(letter) for letter in "xzu"]
    sizes = np.concatenate([model.nominal(letter) for letter in "xzu"])
    if mechanics is not None:
        rows = mechanics.implicit[mechanics.n :, :]
        unknowns.append(mechanics.a)
        sizes = np.append(sizes, model.nominal("x")[mechanics.n : 2 * mechanics.n])
    J = ca.fabs(ca.jacobian(rows, ca.vertcat(*unknowns))) @ ca.diag(ca.DM(sizes))
    largest = stacked(ca.mmax(J[i, :]) if J[i, :].nnz() else 1.0 for i in range(len(model.z)))
    return _positive(_at_start(span, largest))


def _at_start(span: Span, expression: ca.SX) -> Array:
    """Evaluate an expression at the start of the model, with zero accelerations."""
    model, mechanics = span.model, span.model.holonomic
    symbols = [*span.symbols, *([] if mechanics is None else [mechanics.a])]
    z, u = (np.array([float(v.start) for v in group]) for group in (model.z, model.u))
    numbers = [0.0, model.initial_state(), z, u, span.p]
    numbers += [] if mechanics is None else [np.zeros(mechanics.n)]
    function = ca.Function("at_start", symbols, [ca.densify(expression)])
    return np.array(function.call([ca.DM(value) for value in numbers])[0]).ravel()


def _positive(values: Array) -> Array:
    """Return sizes that are safe to divide by."""
    sizes = np.abs(values)
    return np.clip(np.where(np.isfinite(sizes) & (sizes > 0), sizes, 1.0), LEAST, MOST)


def pieces_of_points(
    number: int, equations: PointEquations, layout: Layout, scheme: Coefficients, data: Data
) -> Piece:
    """Return the equations at all collocation points of a phase."""
    local, span = equations.local, layout.spans[number]
    d, N = scheme.degree, span.intervals
    interval, j = np.repeat(np.arange(N), d), np.tile(np.arange(d), N)
    carrying = _carrying(layout, number, interval)
    parts = local.columns(layout, span.inner, span.z, span.u[:, interval], N * d)
    velocities = np.flatnonzero(equations.sloped < 0)
    slopes = scheme.slopes[:, j]
    if velocities.size:
        factors = np.broadcast_to(slopes, (velocities.size, *slopes.shape))
        parts.append((carrying[velocities], factors))
    known = np.flatnonzero(equations.sloped >= 0)
    linear = Linear.of(
        np.repeat(equations.sloped[known], d + 1),
        carrying[known].reshape(-1, N * d),
        -np.tile(slopes, (known.size, 1)),
    )
    made, at = equations.engine.at(N * d), (interval, scheme.nodes[1 + j])
    weights, order = scheme.weights[j], order_of(number, interval, 2 + j)
    return local.piece(equations.rows, made, parts, data, at, order, weights, linear)


def _carrying(layout: Layout, number: int, interval: Indices) -> Indices:
    """Return the columns of the states that define the polynomial of each `interval`."""
    span = layout.spans[number]
    d = span.degree
    inner = span.inner.reshape(span.inner.shape[0], span.intervals, d)[:, interval]
    return np.concatenate([span.nodes[:, interval, None], inner], axis=2).transpose(0, 2, 1)


def gaps(number: int, span: Span, layout: Layout, scheme: Coefficients) -> Piece:
    """Return the rows of continuity at the next node: x_(k+1) = sum_r ends[r] x_r."""
    own = layout.spans[number]
    interval = np.arange(own.intervals)
    names = [v.name for v in span.model.x]
    carrying, weights = ends_of(number, layout, scheme)
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


def ends_of(number: int, layout: Layout, scheme: Coefficients) -> tuple[Indices, Array]:
    """Return columns and weights (nx, terms, N) of the states at the ends of all intervals."""
    carrying = _carrying(layout, number, np.arange(layout.spans[number].intervals))
    ends = np.flatnonzero(scheme.ends)  # the others are zero
    columns = carrying[:, ends]
    return columns, np.broadcast_to(scheme.ends[ends, None], columns.shape)
