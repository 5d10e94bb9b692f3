"""Conditions at single nodes and between phases: ends, via points, links, joins, end costs.

Each condition is differentiated once. A `Maker` then returns it as a `Piece` of a program.
"""

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from math import inf

import casadi as ca
import numpy as np

from ocp.formulation.phase import Free, Row, Span, limits
from ocp.formulation.problem import Problem
from ocp.transcription.blocks import (
    Array,
    Indices,
    Piece,
    RowBlock,
    Rows,
    block,
    linear_piece,
    select,
)
from ocp.transcription.unknowns import Columns, Grid, Layout, LocalUnknowns, time_scale
from symfric.foundation.variable import stacked

Maker = Callable[[Grid], Piece | None]
"""Function that returns the piece of a condition on a grid, or None if the grid has no place."""


def at_nodes(local: LocalUnknowns) -> Iterator[Maker]:
    """Yield the conditions of a phase at its ends and via points, and its cost at the end."""
    span = local.span
    for fraction, rows in span.rows_at.items():
        for inside in (False, True):
            some = [row for row in rows if _knows_inside(span, row.expression) == inside]
            if some:
                sizes = ca.DM([row.nominal for row in some])
                made = _node_block(local, stacked(row.expression for row in some) / sizes)
                yield partial(_at_node, local, fraction, Rows.of(some), made, inside)
    if not span.end.is_zero():
        made = _node_block(local, ca.SX(0, 1), span.end)
        yield partial(_at_node, local, 1.0, Rows.of(()), made, _knows_inside(span, span.end))


def _at_node(
    local: LocalUnknowns, fraction: float, rows: Rows, made: RowBlock, inside: bool, grid: Grid
) -> Piece:
    """Return rows, or a share of the cost, at one node of a phase.

    Rows with inputs or algebraic variables (`inside`) belong to the interval before the node.
    """
    node = grid.nodes[local.number][fraction]
    interval, columns = _columns_at(local, grid, node, inside)
    stage, k = (interval, Piece.LAST - 1) if inside else (node, 1)
    at = np.array([interval]), np.array([float(node > 0)])
    return local.piece(
        grid, rows, made, columns, at, Piece.order_of(local.number, np.array([stage]), k)
    )


def _columns_at(
    local: LocalUnknowns, grid: Grid, node: int, inside: bool
) -> tuple[int, tuple[Columns, Columns, Indices]]:
    """Return the interval and the columns of x, z and u at a node of the mesh.

    Algebraic variables and inputs are those of the interval before the node; at node 0, those of
    the first collocation point. With `inside`, states are those at the end of this interval, not
    the copy at the node.
    """
    span, scheme = grid.layout.spans[local.number], grid.scheme
    interval, d = max(node - 1, 0), scheme.degree
    x: Columns = span.nodes[:, [node]]
    z: Columns = span.z[:, :1]  # not used under shooting
    if node and d:
        z = _sum(span.z[:, interval * d : node * d], scheme.inner_ends)
        if inside:
            x = _sum(span.carrying[:, :, interval], scheme.ends)
    return interval, (x, z, span.u[:, [interval]])


def _sum(columns: Indices, weights: Array) -> Columns:
    """Return weighted sums of `columns` (k, terms) at one place; zero weights are omitted."""
    kept = np.flatnonzero(weights)
    factors = np.broadcast_to(weights[kept], (columns.shape[0], kept.size))
    return columns[:, kept, None], factors[:, :, None]


def at_starts(local: LocalUnknowns, rows: Sequence[Row], first: int) -> Maker:
    """Return conditions at the starts of all intervals of a phase from the interval `first` on.

    Inputs are constant on intervals, so expressions with inputs jump there, and no collocation
    point is at a start. Algebraic variables are those of the first collocation point.
    """
    made = _node_block(local, stacked(row.expression / row.nominal for row in rows))

    def piece(grid: Grid) -> Piece | None:
        span = grid.layout.spans[local.number]
        at = np.arange(first, span.intervals)
        if not at.size:
            return None
        columns = span.nodes[:, at], span.z[:, at * grid.scheme.degree], span.u[:, at]
        order = Piece.order_of(local.number, at, Piece.LAST - 1)
        return local.piece(grid, Rows.of(rows), made, columns, (at, np.zeros(at.size)), order)

    return piece


def jumping(span: Span) -> list[Row]:
    """Return the path conditions that jump with the inputs and need no algebraic variables."""
    u, z = span.model.vector("u"), span.model.vector("z")
    rows = [row for row in span.path if ca.depends_on(row.expression, u)]
    return [row for row in rows if not (z.numel() and ca.depends_on(row.expression, z))]


def _knows_inside(span: Span, expression: ca.SX) -> bool:
    """Return True if `expression` contains algebraic variables or inputs."""
    inside = ca.vertcat(span.model.vector("z"), span.model.vector("u"))
    return bool(inside.numel()) and bool(ca.depends_on(expression, inside))


def _node_block(local: LocalUnknowns, rows: ca.SX, share: ca.SX | None = None) -> RowBlock:
    outputs = [rows, ca.SX(0) if share is None else share]
    r, q = ca.Function("at_node", local.span.symbols, outputs).call(local.values)
    return block("node", local.v, local.theta, r, None if share is None else q)


def between(before: LocalUnknowns, after: LocalUnknowns) -> Iterator[Maker]:
    """Yield links by expressions, and joins, between a phase and the previous one."""
    span = after.span
    v, theta = ca.vertcat(before.v, after.v), ca.vertcat(before.theta, after.theta)
    links = [link for link in span.links if not before.span.same_state(link.expression)]
    if links:
        states = [v.name for v in span.model.x]
        at = [states.index(link.state) for link in links]
        sizes = span.model.nominal("x")[at]
        expressions = stacked(link.expression for link in links)
        (ends,) = ca.Function("link", before.span.symbols, [expressions]).call(before.values)
        made = block("link", v, theta, (after.values[1][at] - ends) / ca.DM(sizes))
        rows = Rows.zero([f"the start of {link.state}" for link in links], sizes)
        yield partial(_between, before, after, made, rows, 0)
    if span.joins:
        rows = Rows.of(span.joins)
        values = [join.function.call([*before.values, *after.values])[0] for join in span.joins]
        made = block("join", v, theta, stacked(values) / ca.DM(rows.scale))
        yield partial(_between, before, after, made, rows, Piece.LAST)


def _between(
    before: LocalUnknowns, after: LocalUnknowns, made: RowBlock, rows: Rows, inside: int, grid: Grid
) -> Piece:
    """Return rows between the end of one phase and the start of the next one."""
    a, b, layout = before.number, after.number, grid.layout
    N = layout.spans[a].intervals
    zero, one = np.zeros(1, np.int64), np.ones(1)
    ends = before.columns(layout, *_columns_at(before, grid, N, False)[1])
    starts = after.columns(layout, *_columns_at(after, grid, 0, False)[1])
    theta = grid.data[a].theta(np.array([N - 1]), one), grid.data[b].theta(zero, 0 * one)
    return Piece(
        rows=rows,
        order=Piece.order_of(a, np.array([N]), inside),
        span=b,
        interval=zero,
        offset=0 * one,
        block=made,
        selection=select([*ends, *starts], 1),
        theta=ca.vertcat(*theta),
    )


def plain_links(problem: Problem, number: int, grid: Grid) -> list[Piece]:
    """Return rows for the continuity of states from phase `number - 1` to phase `number`.

    States whose start follows from other states have no such row.
    """
    before, span = problem.spans[number - 1], problem.spans[number]
    new, released = [v.name for v in span.model.x], grid.released[number].get(0.0, ())
    links = [(link.state, before.same_state(link.expression)) for link in span.links]
    pairs = [(to, of) for to, of in links if of and new.index(to) not in released]
    pairs.sort(key=lambda pair: new.index(pair[0]))
    order = Piece.order_of(number - 1, grid.layout.spans[number - 1].intervals, 0)
    ends = (number, 0), (number - 1, -1)
    what = "the continuity"
    return [_equal_states(problem, grid.layout, ends, pairs, what, order)] if pairs else []


def whole(problem: Problem, grid: Grid) -> Iterator[Piece]:
    """Yield the rows of periodicity, of shared starts, and of sums of durations."""
    spans, phases, layout = problem.spans, len(problem.chain), grid.layout
    end = Piece.order_of(len(spans), 0, 0)
    for first in range(0, len(spans), phases):
        last = first + phases - 1
        released = [spans[first].model.x[i].name for i in grid.released[first].get(0.0, ())]
        names = [name for name in problem.periodic if name not in released]
        if names:
            ends, pairs = ((last, -1), (first, 0)), [*zip(names, names, strict=True)]
            yield _equal_states(problem, layout, ends, pairs, "the period", end)
        for phase, name in problem.shared_starts if first else ():
            starts, what = ((phase, 0), (first + phase, 0)), "the start in all scenarios"
            yield _equal_states(problem, layout, starts, [(name, name)], what, end)
    for numbers, total in problem.durations:
        free = [i for i in numbers if isinstance(spans[i].T, Free)]
        fixed = sum(limits(spans[i].T)[0] for i in numbers if i not in free)
        low, high = limits(total)
        size = np.array([high])
        some = "the duration of phases " + ", ".join(str(i + 1) for i in numbers)
        name = some if len(numbers) < phases else "the duration"
        rows = Rows((name,), size, np.array([low - fixed]), np.array([high - fixed]))
        columns = np.array([[layout.spans[i].T for i in free]])
        weights = np.array([[time_scale(spans[i]) for i in free]]) / size
        yield linear_piece(rows, columns, weights, numbers[0], end)


def _equal_states(
    problem: Problem, layout: Layout, places: tuple[tuple[int, int], tuple[int, int]],
    names: Sequence[tuple[str, str]], what: str, order: Indices,
) -> Piece:  # fmt: skip
    """Return rows that equate pairs of states at two `places` (phase, node)."""
    columns: list[Indices] = []
    sizes: list[Array] = []
    for (span, node), states in zip(places, zip(*names, strict=True), strict=True):
        model = problem.spans[span].model
        at = [[v.name for v in model.x].index(name) for name in states]
        columns.append(layout.spans[span].nodes[at, node])
        sizes.append(model.nominal("x")[at])
    rows = Rows.zero([f"{what} of {name}" for name, _ in names], sizes[0])
    weights = np.column_stack([np.ones(len(names)), -sizes[1] / sizes[0]])
    return linear_piece(rows, np.column_stack(columns), weights, places[0][0], order)


def largest(layout: Layout, scenarios: int, spans: int, name: str) -> list[Piece]:
    """Return rows whose linear part bounds the cost of each scenario: cost - largest <= 0."""
    column = np.array([[layout.largest]])
    rows = Rows((name,), np.ones(1), np.array([-inf]), np.zeros(1))
    return [
        linear_piece(rows, column, np.array([[-1.0]]), 0, Piece.order_of(spans + 1, i, 0))
        for i in range(scenarios)
    ]
