"""Multiple shooting: each interval consists of a few steps of an integrator.

    x_(k+1) = F(x_k, u_k, p, t_k, h),   share of the cost = c(h),   c' = L(t, x, z, u, p),  c(0) = 0

F is `symfric.flow` of the model with its cost as an additional state, so the derivatives are exact
for the discrete map. Bounds and path conditions hold at the nodes.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import final

import casadi as ca
import numpy as np

from ocp.formulation.phase import Span
from ocp.formulation.statement import further_states
from ocp.transcription.blocks import LAST, Block, Piece, Rows, block, order_of, select
from ocp.transcription.schemes import Shooting
from ocp.transcription.unknowns import Data, Layout, Local
from symfric import integrator
from symfric.foundation.parameters import Variable
from symfric.foundation.variable import stacked
from symfric.model import Model

LARGEST = 20_000
"""Largest number of operations of an interval that is expanded to one expression; for longer ones
the steps stay function calls, which are slower but differentiate quickly."""


@final
@dataclass(frozen=True, eq=False)
class Shot:
    """The equations of one interval of a phase.

    Attributes:
        local: its unknowns; x and u are those at its start.
        block: rows and share of the cost.
        path: conditions at a node, with the input of the interval before (without inputs), and
            with that of the next interval; None if there are none.
    """

    local: Local
    block: Block
    path: tuple[tuple[Rows, Block | None], ...]


def shot(local: Local, scheme: Shooting) -> Shot:
    """Formulate the equations of an interval of a phase.

    Raises:
        ValueError: conditions or costs at nodes that contain algebraic variables, a bound on one,
            a mechanism with prescribed motion in time.
    """
    span = local.span
    _check(span)
    model, added = with_cost(span)
    x, u, rest = (ca.MX.sym(name, getattr(local, name).numel()) for name in ("x", "u", "rest"))
    theta = ca.MX.sym("theta", local.theta.numel())
    outputs = [*local.values, local.h]
    values = ca.Function("values", [local.x, local.u, local.rest, local.theta], outputs)
    t, x_si, _, u_si, p, h = values(x, u, rest, theta)
    F = integrator.flow(model, steps=scheme.steps, method=scheme.method)
    ends = F(ca.vertcat(x_si, *([0.0] * added)), u_si, ca.vertcat(p, t), h)
    nominal = ca.DM(span.model.nominal("x"))
    v, n = ca.vertcat(x, u, rest), len(span.model.x)
    rows, share = -ends[:n] / nominal, ends[n] if added else None
    made = _written_out(v, theta, rows, share)
    return Shot(local, made, tuple(_paths(local)))


def _written_out(v: ca.MX, theta: ca.MX, rows: ca.MX, share: ca.MX | None) -> Block:
    """Return the block as expanded expressions if not too long, else as calls of steps."""
    interval = ca.Function("interval", [v, theta], [rows, *([] if share is None else [share])])
    try:
        flat = interval.expand()
    except RuntimeError:  # it contains an implicit equation
        flat = None
    if flat is None or flat.n_instructions() > LARGEST:
        symbols = [ca.MX.sym("v", v.numel()), ca.MX.sym("theta", theta.numel())]
        outputs = interval.call(symbols)
    else:
        symbols = [ca.SX.sym("v", v.numel()), ca.SX.sym("theta", theta.numel())]
        outputs = flat.call(symbols)
    return block("interval", *symbols, *outputs)


def with_cost(span: Span) -> tuple[Model, int]:
    """Return the model with its start time as a parameter, and its cost, if any, as a state."""
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
    return replace(model, p=(*model.p, start), **changes), len(cost)


def _check(span: Span) -> None:
    """Raise ValueError for conditions that shooting does not support."""
    model = span.model
    problems: list[str] = []
    inside = model.vector("z")
    conditions = [*span.path, *(row for rows in span.rows_at.values() for row in rows)]
    named = [(row.name, row.expression) for row in conditions] + [("the end cost", span.end)]
    for name, expression in named:
        if model.z and ca.depends_on(expression, inside):
            problems.append(f"{name} depends on algebraic variables")
    problems += [
        f"a bound on {v.name}, an algebraic variable"
        for v in model.z
        if np.isfinite(span.box(v.name)).any()
    ]
    mechanics = model.holonomic
    if mechanics is not None:
        parts = ca.vertcat(mechanics.implicit, mechanics.rates, mechanics.phi)
        if ca.depends_on(parts, model.t):
            problems.append("time in the equations of a mechanism")
    if problems:
        raise ValueError(
            f"{span.name}: Shooting: expected conditions on states and inputs at nodes, got "
            f"{'; '.join(problems)}; use Radau(3)"
        )


def _paths(local: Local) -> Iterator[tuple[Rows, Block | None]]:
    """Yield path conditions without inputs, then those with inputs."""
    span = local.span
    u = span.model.vector("u")
    knows = [bool(u.numel()) and bool(ca.depends_on(row.expression, u)) for row in span.path]
    for wanted in (False, True):
        rows = [row for row, found in zip(span.path, knows, strict=True) if found == wanted]
        expressions = stacked(row.expression for row in rows)
        (r,) = ca.Function("path", span.symbols, [expressions]).call(local.values)
        made = Rows.of(rows)
        r = r / ca.DM(made.scale)
        yield made, block("path", local.v, local.theta, r) if rows else None


def pieces_of_intervals(
    number: int, made: Shot, layout: Layout, gap: Piece, data: Data
) -> Iterator[Piece]:
    """Yield the flow over all intervals, whose linear part is in `gap`, and the path conditions."""
    own = layout.spans[number]
    N = own.intervals
    interval, zero = np.arange(N), np.zeros(N)
    parts = made.local.columns(layout, own.nodes[:, :-1], own.z, own.u, N)
    theta = data.theta(interval, zero)
    yield replace(gap, block=made.block, selection=select(parts, N), theta=theta)
    (free, without), (bound, with_inputs) = made.path
    after = (interval, interval + 1, zero + 1.0)  # starts are usually prescribed
    ends = (np.append(interval, N - 1), np.arange(N + 1), np.append(zero, 1.0))
    for rows, written, (at, node, offset) in ((free, without, after), (bound, with_inputs, ends)):
        if written is not None:
            x, u = own.nodes[:, node], own.u[:, at]
            parts = made.local.columns(layout, x, own.z, u, node.size)
            order = order_of(number, node, LAST - 2)
            yield made.local.piece(rows, written, parts, data, (at, offset), order)
