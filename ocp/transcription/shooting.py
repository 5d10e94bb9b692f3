"""Multiple shooting: each interval consists of a few steps of an integrator.

    x_(k+1) = F(x_k, u_k, p, t_k, h),   share of the cost = c(h),   c' = L(t, x, z, u, p),  c(0) = 0

F is `symfric.flow` of the model with its cost as an additional state. The derivatives are those of
the discrete map. Bounds and path conditions are imposed at the nodes.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any, final

import casadi as ca
import numpy as np

from ocp.formulation.phase import Span
from ocp.formulation.statement import further_states, rebuilt
from ocp.transcription.blocks import LAST, Block, Piece, Rows, block, order_of, select
from ocp.transcription.schemes import Shooting
from ocp.transcription.unknowns import Grid, Local
from symfric import integrator
from symfric.foundation.parameters import Variable
from symfric.foundation.variable import stacked
from symfric.model import Model

LARGEST = 20_000
"""Largest number of operations of an interval that is expanded to one expression. In longer ones
the steps remain function calls, which are slower but take less time to differentiate."""


@final
@dataclass(frozen=True, eq=False)
class Shot:
    """Equations of one interval of a phase.

    Attributes:
        local: unknowns of the interval; x and u are the values at its start.
        block: rows and share of the cost.
        paths: (whether they contain inputs, rows, block) of path conditions at a node; inputs are
            those of the next interval.
    """

    local: Local
    block: Block
    paths: tuple[tuple[bool, Rows, Block], ...]


def shot(local: Local, scheme: Shooting) -> Shot:
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


def _interval_block(interval: ca.Function) -> Block:
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
    if mechanics is not None:
        parts = ca.vertcat(mechanics.implicit, mechanics.rates, mechanics.phi)
        if ca.depends_on(parts, model.t):
            problems.append("time in the equations of a mechanism")
    if problems:
        raise ValueError(
            f"{span.name}: Shooting: expected conditions on states and inputs at nodes, got "
            f"{'; '.join(problems)}; use Radau(3)"
        )


def _paths(local: Local) -> Iterator[tuple[bool, Rows, Block]]:
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
        order = order_of(number, node, LAST - 2)
        yield local.piece(grid, rows, path, columns, (at, offset), order)
