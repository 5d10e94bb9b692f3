"""Equations of intervals: collocation points, or steps of an integrator (multiple shooting).

For an explicit model with states x the rows of a collocation point are

    0 = h f(t, x, z, u, p) - x'(s_j),   0 = alg(t, x, z, u, p),   path conditions

For a mechanism the rows are implicit. Its accelerations are slopes a = v'(s_j) / h of the
polynomial, so neither the equations nor their derivatives invert a mass matrix:

    0 = h v - q'(s_j),   0 = h (M(q) a + phi_q' lam - Q),   0 = phi_q a + ...,   0 = h y' - y'(s_j)

Path conditions with a penalty have their violations as further unknowns s >= 0 of the point,

    lower <= e - s_above + s_below <= upper,   share of the cost += linear s + quadratic s^2

All rows are divided by nominal values. Slopes of the polynomials are linear in the unknowns. In
multiple shooting each interval consists of a few steps of an integrator,

    x_(k+1) = F(x_k, u_k, p, t_k, h),   share of the cost = c(h),   c' = L(t, x, z, u, p),  c(0) = 0

where F is `symfric.flow` of the model with its cost as an additional state. The derivatives are
those of the discrete map. Bounds and path conditions are imposed at the nodes.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple, final

import casadi as ca
import numpy as np

from ocp.formulation.changed_models import further_states, rebuilt
from ocp.formulation.phase import Span
from ocp.transcription.blocks import (
    Array,
    ConstantEntries,
    Indices,
    Piece,
    RowBlock,
    Rows,
    block,
    select,
)
from ocp.transcription.schemes import Shooting
from ocp.transcription.unknowns import Grid, LocalUnknowns
from symfric import integrator
from symfric.foundation.parameters import Variable
from symfric.foundation.programs import CompileError
from symfric.foundation.variable import stacked
from symfric.integrator.compiled.columns import Prospect
from symfric.integrator.compiled.compiler import library
from symfric.model import Model

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

    block: RowBlock
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
    def compiled(self) -> RowBlock:
        """Block with compiled Functions."""
        path = str(library(self._prospect.written(), *self._prospect.names))
        functions = {name: ca.external(f.name(), path) for name, f in self._functions.items()}
        return self.block._replace(**functions)

    def at(self, places: int) -> RowBlock:
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


class PointEquations(NamedTuple):
    """Equations of one collocation point of a phase.

    Attributes:
        local: unknowns of the point, which the slopes of the velocities of a mechanism and the
            violations follow in v.
        engine: rows and share of the cost.
        rows: names, sizes and ranges of the rows; the path conditions come last, those with a
            penalty after the others.
        sloped: for each state, index of the row from which its slope is subtracted; -1 if the slope
            is a local unknown.
    """

    local: LocalUnknowns
    engine: Engine
    rows: Rows
    sloped: Indices


def point_equations(local: LocalUnknowns) -> PointEquations:
    """Formulate the equations of a collocation point of a phase."""
    span, model, h = local.span, local.span.model, local.h
    conditions, penalised = (*span.path, *span.penalised), span.penalised
    mechanics, nominal, paths = model.holonomic, model.nominal("x"), Rows.of(conditions)
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
    path = stacked(row.expression for row in conditions)
    slacks = ca.SX.sym("slacks", len(span.sides))
    shares = ca.SX(0)
    outputs = [ca.densify(ca.SX(e)) for e in (implicit, further, path, span.running)]
    implicit, further, path, running = ca.Function("evaluated", [*span.symbols, a], outputs).call(
        [*local.values, slopes * ca.DM(nominal[n : 2 * n]) / h]
    )
    for s, (k, side) in zip(ca.vertsplit(slacks), span.sides, strict=True):
        row = penalised[k]
        path[len(span.path) + k] -= side * row.nominal * s
        shares += row.linear * row.nominal * s + row.quadratic * (row.nominal * s) ** 2
    running += shares
    rates = h * ca.vertcat(local.values[1][n : 2 * n, :], implicit[:n, :], further)
    rows = ca.vertcat(rates, implicit[n:, :], path) / ca.DM([*scale, *paths.scale])
    names = [f"the equation of {v.name}" for v in model.x]
    names += [f"the algebraic equation {i + 1}" for i in range(len(model.z))]
    share = None if running.is_zero() else local.weight * running
    return PointEquations(
        local,
        Engine(block("point", ca.vertcat(local.v, slopes, slacks), local.theta, rows, share)),
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
    slacks = span.slacks(len(local.span.sides))[:, j, interval]
    columns, places = (span.inner, span.z, span.u[:, interval]), (interval, scheme.nodes[1 + j])
    return local.piece(
        grid, equations.rows, equations.engine.at(N * d), columns, places,
        Piece.order_of(local.number, interval, 2 + j), weights=scheme.weights[j],
        extra=[*([(carrying[velocities], factors)] if velocities.size else []), slacks],
        linear=ConstantEntries.of(equations.sloped[known], carrying[known], -slopes),
    )  # fmt: skip


def gaps(number: int, span: Span, grid: Grid) -> Piece:
    """Return the rows of continuity at the next node: x_(k+1) = sum_r ends[r] x_r."""
    own = grid.layout.spans[number]
    interval, names = np.arange(own.intervals), [v.name for v in span.model.x]
    carrying, weights = own.ends(grid.scheme)
    columns = np.concatenate([own.nodes[:, None, 1:], carrying], axis=1)
    weights = np.concatenate([np.ones((len(names), 1, own.intervals)), -weights], axis=1)
    return Piece(
        rows=Rows.zero([f"the continuity of {name}" for name in names], span.model.nominal("x")),
        order=Piece.order_of(number, interval, 0),
        span=number,
        interval=interval,
        offset=np.ones(own.intervals),
        linear=ConstantEntries.of(np.arange(len(names)), columns, weights),
    )


LARGEST = 20_000
"""Largest number of operations of an interval that is expanded to one expression. In longer ones
the steps remain function calls, which are slower but take less time to differentiate."""


class Shot(NamedTuple):
    """Equations of one interval of a phase.

    Attributes:
        local: unknowns of the interval; x and u are the values at its start.
        block: rows and share of the cost.
        paths: (whether they contain inputs, rows, block) of path conditions at a node; inputs are
            those of the next interval.
    """

    local: LocalUnknowns
    block: RowBlock
    paths: tuple[tuple[bool, Rows, RowBlock], ...]


def shot(local: LocalUnknowns, scheme: Shooting) -> Shot:
    """Formulate the equations of an interval of a phase.

    Raises:
        ValueError: conditions or costs at nodes contain algebraic variables, an algebraic variable
            has a bound, or the equations of a mechanism contain the time.
    """
    span = local.span
    _check(span)
    model, added = with_cost(span)
    names = ("x", "u", "rest", "theta")
    x, u, rest, theta = (ca.MX.sym(name, local.symbols[name].numel()) for name in names)
    own = [local.symbols[name] for name in names]
    values = ca.Function("values", own, [*local.values, local.h])
    t, x_si, _, u_si, p, h = values(x, u, rest, theta)
    F = integrator.flow(model, steps=scheme.steps, method=scheme.method)
    ends = F(ca.vertcat(x_si, *([0.0] * added)), u_si, ca.vertcat(p, t), h)
    n = len(span.model.x)
    outputs = [-ends[:n] / ca.DM(span.model.nominal("x")), *([ends[n]] if added else [])]
    interval = ca.Function("interval", [ca.vertcat(x, u, rest), theta], outputs)
    return Shot(local, _interval_block(interval), tuple(_paths(local)))


def _interval_block(interval: ca.Function) -> RowBlock:
    """Return the block as an expanded expression, or with calls of steps if it is too long."""
    flat = interval.expand()
    function, kind = (flat, ca.SX) if flat.n_instructions() <= LARGEST else (interval, ca.MX)
    symbols: list[Any] = [kind.sym(n, interval.size1_in(i)) for i, n in enumerate(("v", "theta"))]
    return block("interval", *symbols, *function.call(symbols))


def with_cost(span: Span) -> tuple[Model, int]:
    """Return the model with start time as parameter and cost as state, and the number of costs."""
    model = span.model
    start = Variable("shooting_start", "s")
    shifted = model.t + start.symbol
    cost = () if span.running.is_zero() else (Variable("shooting_cost", "1"),)
    rates = stacked([ca.substitute(span.running, model.t, shifted)] if cost else [])
    changes = further_states(model, cost, rates)
    if model.holonomic is None:
        ode = model.function("ode")(*span.symbols)
        ode, alg = ca.substitute([ode, model.alg], [model.t], [shifted])
        changes |= {"ode": ca.vertcat(ode, rates), "alg": alg}
    return rebuilt(model, p=(*model.p, start), **changes), len(cost)


def _check(span: Span) -> None:
    """Raise ValueError if `span` has conditions that shooting does not support."""
    model, mechanics = span.model, span.model.holonomic
    conditions = [*span.path, *(row for rows in span.rows_at.values() for row in rows)]
    kinds = {
        "soft path conditions": span.softened,
        "absolute(...)": span.absolutes,
        "complementary(...)": [row for row in span.path if row.is_product],
    }
    named = [(row.name, row.expression) for row in conditions] + [("the end cost", span.end)]
    problems = [
        f"{name} depends on algebraic variables"
        for name, expression in named
        if model.z and ca.depends_on(expression, model.vector("z"))
    ]
    problems += [
        f"a bound on {v.name}, an algebraic variable"
        for v in model.z
        if np.isfinite(span.boxes[v.name]).any()
    ]
    problems += [f"{kind}, which need collocation points" for kind, rows in kinds.items() if rows]
    if mechanics is not None:
        parts = ca.vertcat(mechanics.implicit, mechanics.rates, mechanics.phi)
        if ca.depends_on(parts, model.t):
            problems.append("time in the equations of a mechanism")
    if problems:
        raise ValueError(
            f"{span.name}: Shooting: expected conditions on states and inputs at nodes, got "
            f"{'; '.join(problems)}; use Radau(3)"
        )


def _paths(local: LocalUnknowns) -> Iterator[tuple[bool, Rows, RowBlock]]:
    """Yield the path conditions without inputs, then those with inputs; see `Shot`."""
    span, u = local.span, local.span.model.vector("u")
    knows = [bool(u.numel()) and bool(ca.depends_on(row.expression, u)) for row in span.path]
    for inputs in (False, True):
        conditions = [row for row, known in zip(span.path, knows, strict=True) if known == inputs]
        if conditions:
            rows = Rows.of(conditions)
            expressions = stacked(row.expression for row in conditions)
            (r,) = ca.Function("path", span.symbols, [expressions]).call(local.values)
            yield inputs, rows, block("path", local.v, local.theta, r / ca.DM(rows.scale))


def pieces_of_intervals(made: Shot, gap: Piece, grid: Grid) -> Iterator[Piece]:
    """Yield the flow over all intervals, with its linear part from `gap`, and path conditions."""
    local, number = made.local, made.local.number
    own = grid.layout.spans[number]
    N = own.intervals
    interval, zero = np.arange(N), np.zeros(N)
    selection = select(local.columns(grid.layout, own.nodes[:, :-1], own.z, own.u), N)
    theta = grid.data[number].theta(interval, zero)
    yield replace(gap, block=made.block, selection=selection, theta=theta)
    for inputs, rows, path in made.paths:
        at, node, offset = interval, interval + 1, zero + 1.0  # starts are usually prescribed
        if inputs:
            at, node, offset = np.append(at, N - 1), np.arange(N + 1), np.append(zero, 1.0)
        columns = own.nodes[:, node], own.z, own.u[:, at]
        order = Piece.order_of(number, node, Piece.LAST - 2)
        yield local.piece(grid, rows, path, columns, (at, offset), order)
