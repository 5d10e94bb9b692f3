"""Conditions at single nodes and between phases: ends, via points, links, joins, end costs."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from math import inf
from typing import final

import casadi as ca
import numpy as np

from ocp.formulation.phase import Free, Row, Span
from ocp.formulation.problem import Problem
from ocp.transcription.blocks import (
    LAST,
    Array,
    Block,
    Indices,
    Piece,
    Rows,
    block,
    linear_piece,
    order_of,
    select,
)
from ocp.transcription.schemes import Coefficients
from ocp.transcription.unknowns import Columns, Data, Layout, Local, time_scale
from symfric.foundation.variable import stacked


@final
@dataclass(frozen=True, eq=False)
class AtNode:
    """Rows, or a share of the cost, at one node of a phase.

    Attributes:
        local: their unknowns.
        fraction: of the node, as a fraction of T.
        rows: the conditions; none for a cost.
        block: rows and share.
        inside: whether they contain inputs or algebraic variables, which belong to an interval.
    """

    local: Local
    fraction: float
    rows: Rows
    block: Block
    inside: bool

    def piece(self, layout: Layout, scheme: Coefficients, data: Data, node: int) -> Piece:
        """Return the piece at node number `node` of the mesh."""
        interval, offset, parts = columns_at(self.local, layout, scheme, node, self.inside)
        stage, inside = (interval, LAST - 1) if self.inside else (node, 1)
        order = order_of(self.local.number, np.array([stage]), inside)
        at = np.array([interval]), np.array([offset])
        return self.local.piece(self.rows, self.block, parts, data, at, order)


def columns_at(
    local: Local, layout: Layout, scheme: Coefficients, node: int, inside: bool
) -> tuple[int, float, list[Columns]]:
    """Return interval, place in it, and columns of the local unknowns at a node of the mesh.

    Algebraic variables and inputs belong to the interval before; at node 0 to the first
    collocation point. With `inside` states belong to that interval, not to the copy at the node.
    """
    span, d = layout.spans[local.number], scheme.degree
    interval, offset = (0, 0.0) if node == 0 else (node - 1, 1.0)
    x: Columns = span.nodes[:, [node]]
    z: Columns = span.z[:, :1]  # not used under shooting
    if node and d:
        points = slice(interval * d, node * d)
        z = _sum(span.z[:, points], scheme.inner_ends)
        if inside:
            x = _sum(span.points_of(interval), scheme.ends)
    return interval, offset, local.columns(layout, x, z, span.u[:, [interval]], 1)


def _sum(columns: Indices, weights: Array) -> Columns:
    """Return sums of `columns` (k, terms) with the same weights, at one place."""
    kept = np.flatnonzero(weights)
    factors = np.broadcast_to(weights[kept], (columns.shape[0], kept.size))
    return columns[:, kept, None], factors[:, :, None]


def at_nodes(local: Local) -> list[AtNode]:
    """Return conditions at the ends and at via points of a phase, and its cost at the end."""
    span = local.span
    found: list[AtNode] = []
    for fraction, rows in span.rows_at.items():
        for inside in (False, True):
            some = [row for row in rows if _knows_inside(span, row.expression) == inside]
            if some:
                sizes = ca.DM([row.nominal for row in some])
                made = _node_block(local, stacked(row.expression for row in some) / sizes)
                found.append(AtNode(local, fraction, Rows.of(some), made, inside))
    if not span.end.is_zero():
        made = _node_block(local, ca.SX(0, 1), span.end)
        found.append(AtNode(local, 1.0, Rows.of(()), made, _knows_inside(span, span.end)))
    return found


@final
@dataclass(frozen=True, eq=False)
class AtStarts:
    """Rows at the starts of the intervals of a phase, with the inputs that begin there.

    Inputs are held: expressions with them jump there, before the first collocation point. The first
    interval is covered by the conditions at the start of the phase.

    Attributes:
        local: their unknowns.
        rows: the conditions.
        block: their values.
    """

    local: Local
    rows: Rows
    block: Block

    def piece(self, layout: Layout, scheme: Coefficients, data: Data) -> Piece:
        """Return the piece; algebraic variables are those of the first collocation points."""
        number = self.local.number
        span, at = layout.spans[number], np.arange(1, layout.spans[number].intervals)
        z = span.z[:, at * scheme.degree]
        parts = self.local.columns(layout, span.nodes[:, at], z, span.u[:, at], at.size)
        order = order_of(number, at, LAST - 1)
        return self.local.piece(self.rows, self.block, parts, data, (at, np.zeros(at.size)), order)


def at_starts(local: Local, rows: Sequence[Row]) -> AtStarts:
    """Return conditions at the starts of all intervals of a phase but the first one."""
    expressions = stacked(row.expression / row.nominal for row in rows)
    return AtStarts(local, Rows.of(rows), _node_block(local, expressions))


def _knows_inside(span: Span, expression: ca.SX) -> bool:
    """Return True if an expression contains algebraic variables or inputs."""
    inside = ca.vertcat(span.model.vector("z"), span.model.vector("u"))
    return bool(inside.numel()) and bool(ca.depends_on(expression, inside))


def _node_block(local: Local, rows: ca.SX, share: ca.SX | None = None) -> Block:
    outputs = [rows, ca.SX(0) if share is None else share]
    r, q = ca.Function("at_node", local.span.symbols, outputs).call(local.values)
    return block("node", local.v, local.theta, r, None if share is None else q)


@final
@dataclass(frozen=True, eq=False)
class Between:
    """Rows between the end of one phase and the start of the next one.

    Attributes:
        before, after: unknowns of both.
        block: its rows, in the local unknowns of both.
        rows: names, sizes and ranges.
        link: whether the rows determine the start of states; False for joins.
    """

    before: Local
    after: Local
    block: Block
    rows: Rows
    link: bool

    def piece(self, layout: Layout, scheme: Coefficients, data: Sequence[Data]) -> Piece:
        """Return the piece."""
        a, b = self.before.number, self.after.number
        N = layout.spans[a].intervals
        zero, one, last = np.zeros(1, np.int64), np.ones(1), np.array([N - 1])
        ends = columns_at(self.before, layout, scheme, N, False)[2]
        starts = columns_at(self.after, layout, scheme, 0, False)[2]
        theta = data[a].theta(last, one), data[b].theta(zero, 0 * one)
        return Piece(
            rows=self.rows,
            order=order_of(a, np.array([N]), 0 if self.link else LAST),
            span=b,
            interval=zero,
            offset=0 * one,
            block=self.block,
            selection=select([*ends, *starts], 1),
            theta=ca.vertcat(*theta),
        )


def between(before: Local, after: Local) -> list[Between]:
    """Return links that are expressions, and joins, of a phase to the one before."""
    span = after.span
    v, theta = ca.vertcat(before.v, after.v), ca.vertcat(before.theta, after.theta)
    found: list[Between] = []
    states = [v.name for v in span.model.x]
    links = [link for link in span.links if _same_state(before.span, link.expression) < 0]
    if links:
        at = [states.index(link.state) for link in links]
        sizes = span.model.nominal("x")[at]
        expressions = stacked(link.expression for link in links)
        (ends,) = ca.Function("link", before.span.symbols, [expressions]).call(before.values)
        made = block("link", v, theta, (after.values[1][at] - ends) / ca.DM(sizes))
        rows = Rows.zero([f"the start of {link.state}" for link in links], sizes)
        found.append(Between(before, after, made, rows, link=True))
    if span.joins:
        rows = Rows.of(span.joins)
        values = [join.function.call([*before.values, *after.values])[0] for join in span.joins]
        made = block("join", v, theta, stacked(values) / ca.DM(rows.scale))
        found.append(Between(before, after, made, rows, link=False))
    return found


def _same_state(before: Span, expression: ca.SX) -> int:
    """Return the index of the state equal to the expression, or -1."""
    return next((i for i, v in enumerate(before.model.x) if ca.is_equal(expression, v.symbol)), -1)


def plain_links(
    number: int, before: Span, span: Span, layout: Layout, released: Collection[int]
) -> list[Piece]:
    """Return the continuity of states from phase `number - 1`, `before`, to phase `number`.

    Args:
        released: states of `span` whose start follows from other states.
    """
    a, b = layout.spans[number - 1], layout.spans[number]
    states = [v.name for v in span.model.x]
    pairs = [
        (states.index(link.state), _same_state(before, link.expression)) for link in span.links
    ]
    pairs = [(to, origin) for to, origin in pairs if origin >= 0 and to not in released]
    if not pairs:
        return []
    to, origin = (np.array(part) for part in zip(*sorted(pairs), strict=True))
    sizes, old = span.model.nominal("x")[to], before.model.nominal("x")[origin]
    rows = Rows.zero([f"the continuity of {states[i]}" for i in to], sizes)
    columns = np.column_stack([b.nodes[to, 0], a.nodes[origin, -1]])
    weights = np.column_stack([np.ones(to.size), -old / sizes])
    return [linear_piece(rows, columns, weights, number, order_of(number - 1, a.intervals, 0))]


def whole(
    problem: Problem, layout: Layout, released: Sequence[Mapping[float, Collection[int]]]
) -> list[Piece]:
    """Return periodicity, shared starts and sums of durations.

    Args:
        released: for each phase, states at fractions of T whose values follow from others.
    """
    spans, phases = problem.spans, len(problem.chain)
    end = order_of(len(spans), 0, 0)
    found: list[Piece] = []
    for first in range(0, len(spans), phases):
        last = first + phases - 1
        loose = [spans[first].model.x[i].name for i in released[first].get(0.0, ())]
        kept = [name for name in problem.periodic if name not in loose]
        found += _equal_states(problem, layout, (last, -1), (first, 0), kept, end)
        for phase, name in problem.shared_starts if first else ():
            a, b = (phase, 0), (first + phase, 0)
            found += _equal_states(problem, layout, a, b, (name,), end)
    for numbers, total in problem.durations:
        free = [(i, spans[i]) for i in numbers if isinstance(spans[i].T, Free)]
        given = sum(T for i in numbers if not isinstance(T := spans[i].T, Free))
        low, high = (total.lower, total.upper) if isinstance(total, Free) else (total, total)
        size = np.array([high])
        name = "the duration of phases " + ", ".join(str(i + 1) for i in numbers)
        rows = Rows((name,), size, np.array([low - given]), np.array([high - given]))
        columns = np.array([[layout.spans[i].T for i, _ in free]])
        weights = np.array([[time_scale(span) for _, span in free]]) / size
        found.append(linear_piece(rows, columns, weights, numbers[0], end))
    return found


def _equal_states(
    problem: Problem,
    layout: Layout,
    a: tuple[int, int],
    b: tuple[int, int],
    names: Sequence[str],
    order: Indices,
) -> list[Piece]:
    """Return rows for equal states `names` at (phase, node) a and b."""
    if not names:
        return []
    columns: list[Indices] = []
    sizes: list[Array] = []
    for span, node in (a, b):
        model = problem.spans[span].model
        at = [[v.name for v in model.x].index(name) for name in names]
        columns.append(layout.spans[span].nodes[at, node])
        sizes.append(model.nominal("x")[at])
    what = "the period" if a[1] < 0 else "the start in all scenarios"
    rows = Rows.zero([f"{what} of {name}" for name in names], sizes[1])
    weights = np.column_stack([sizes[0] / sizes[1], -np.ones(len(names))])
    return [linear_piece(rows, np.column_stack(columns), weights, a[0], order)]


def largest(layout: Layout, scenarios: int, spans: int, name: str) -> list[Piece]:
    """Return rows whose linear part bounds the cost of each scenario: cost - largest <= 0."""
    column = np.array([[layout.largest]])
    rows = Rows((name,), np.ones(1), np.array([-inf]), np.zeros(1))
    return [
        linear_piece(rows, column, np.array([[-1.0]]), 0, order_of(spans + 1, i, 0))
        for i in range(scenarios)
    ]
