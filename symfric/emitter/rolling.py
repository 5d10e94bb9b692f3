"""Parts of a graph that are alike, one for each element of an array: what becomes a loop.

A law of n elements is written out n times in CasADi's graph. Two kinds of rows show where:

    stores   next_1, next_2, ..., next_n            consecutive rows of a result
    sums     start + term_1 + term_2 + ... + term_n

Their graphs are woven together from the top: n nodes with the same operation become one node, until
all n are the same node (a value from outside the loop), consecutive rows of an array, or constants
(a table). Where anything else differs, the graphs are not alike and stay as they are.
"""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import final

import casadi as ca

from symfric.emitter.logic import BOOLEAN
from symfric.foundation.graph import SELECT, Graph, Node

LEAST = 3
"""Elements below which they stay written out."""

OUTER, TRUTH, READ, TABLE = range(4)
"""Arguments of the graph of a loop's body."""

STORED, ADDED = range(2)
"""Results of the graph of a loop's body."""

Lanes = tuple[int, ...]
"""Alike nodes, one of every element."""


@final
@dataclass(frozen=True)
class Array:
    """Consecutive rows of an argument or a result that C can index.

    Attributes:
        group: number of the argument or result.
        text: C in front of the index, such as `state->F`. An argument and a result with the same
            text are the same memory.
    """

    group: int
    first: int
    size: int
    text: str

    def holds(self, group: int, row: int) -> bool:
        """Return True if the row belongs to it."""
        return group == self.group and self.first <= row < self.first + self.size


@final
@dataclass(frozen=True)
class Store:
    """Rows of the result `group` from `first` on."""

    lanes: Lanes
    group: int
    first: int


@final
@dataclass(frozen=True)
class Sum:
    """Node `total` = `start` + lanes in their order; without a start the lanes alone."""

    lanes: Lanes
    start: int | None
    total: int


Strand = Store | Sum


@final
@dataclass(frozen=True)
class Body:
    """Operations of a loop for each element, as a graph.

    Attributes:
        graph: arguments `OUTER`, `TRUTH`, `READ`, `TABLE`; results `STORED`, `ADDED`.
        outer: the nodes of the whole graph behind the rows of `OUTER`.
        truths: those behind the rows of `TRUTH`, which are conditions.
        reads: (argument, row) of the first element behind the rows of `READ`.
        tables: constants of all elements behind the rows of `TABLE`.
        inside: the operations of the whole graph that it does.
    """

    graph: Graph
    outer: tuple[int, ...]
    truths: tuple[int, ...]
    reads: tuple[tuple[int, int], ...]
    tables: tuple[tuple[float, ...], ...]
    inside: frozenset[int]


def strands(source: Graph, read: Sequence[Array], written: Sequence[Array]) -> list[Strand]:
    """All rows and sums whose graphs are alike over `LEAST` or more elements."""
    found: list[Strand] = []
    for array in written:
        nodes = source.results[array.group][array.first : array.first + array.size]
        for a, b in _runs(source, nodes, read, same=True):
            found.append(Store(nodes[a:b], array.group, array.first + a))
    for terms, after in _chains(source):
        for a, b in _runs(source, terms, read):
            found.append(Sum(tuple(terms[a:b]), after[a - 1] if a else None, after[b - 1]))
    return found


def _runs(
    source: Graph, nodes: Sequence[int], read: Sequence[Array], same: bool = False
) -> Iterator[tuple[int, int]]:
    """Ranges of alike neighbours: different nodes, or, if requested, the same node."""

    def alike(lanes: Lanes) -> bool:
        several = len(set(lanes))
        if several == 1:
            return same
        return several == len(lanes) and _gathered(source, [lanes], read) is not None

    a = 0
    for b in range(1, len(nodes) + 1):
        if b < len(nodes) and alike((nodes[b - 1], nodes[b])):
            continue
        lanes = tuple(nodes[a:b])
        if len(lanes) >= LEAST and alike(lanes):
            yield a, b
        a = b


def _chains(source: Graph) -> Iterator[tuple[list[int], list[int]]]:
    """Return the terms of every sum of three and more, and the nodes after adding each of them."""
    uses = Counter(i for node in source.nodes for i in node.args)
    uses.update(i for row in source.results for i in row)

    def inner(i: int) -> bool:
        return source.nodes[i].op == ca.OP_ADD and uses[i] == 1

    left = {n.args[0] for n in source.nodes if n.op == ca.OP_ADD and inner(n.args[0])}
    for top, node in enumerate(source.nodes):
        if node.op != ca.OP_ADD or top in left:
            continue
        after = [top]
        while inner(source.nodes[after[-1]].args[0]):
            after.append(source.nodes[after[-1]].args[0])
        after.reverse()
        terms = [source.nodes[after[0]].args[0], *(source.nodes[i].args[1] for i in after)]
        if len(terms) >= LEAST:
            yield terms, [terms[0], *after]


def _gathered(
    source: Graph, roots: Sequence[Lanes], read: Sequence[Array]
) -> dict[Lanes, tuple[Lanes, ...]] | None:
    """All lanes under the roots with their arguments; None where the graphs are not alike."""
    found: dict[Lanes, tuple[Lanes, ...]] = {}
    waiting = list(roots)
    while waiting:
        lanes = waiting.pop()
        if lanes in found:
            continue
        found[lanes] = ()
        if len(set(lanes)) == 1:
            continue
        nodes = [source.nodes[i] for i in lanes]
        first = nodes[0]
        if any(node.op != first.op for node in nodes):
            return None
        if first.op == ca.OP_INPUT:
            if not _consecutive([node.entry for node in nodes], read):
                return None
        elif first.op != ca.OP_CONST:
            found[lanes] = tuple(zip(*(node.args for node in nodes), strict=True))
            waiting += found[lanes]
    return found


def _consecutive(entries: Sequence[tuple[int, int]], read: Sequence[Array]) -> bool:
    group, row = entries[0]
    if any(entry != (group, row + i) for i, entry in enumerate(entries)):
        return False
    return any(array.holds(group, row) and array.holds(*entries[-1]) for array in read)


def woven(source: Graph, strands: Sequence[Strand], read: Sequence[Array]) -> Body:
    """Return the body of the loop that makes all `strands`, which have equally many lanes.

    Raises:
        ValueError: their graphs are not alike.
    """
    gathered = _gathered(source, [strand.lanes for strand in strands], read)
    if gathered is None:
        raise ValueError("woven: expected alike graphs, got others")
    outer, truths = dict[int, int](), dict[int, int]()
    reads, tables = dict[tuple[int, int], int](), dict[tuple[float, ...], int]()
    nodes: list[Node] = []
    known: dict[Node, int] = {}
    number: dict[Lanes, int] = {}

    def leaf(group: int, row: int) -> Node:
        return Node(ca.OP_INPUT, entry=(group, row))

    for lanes in sorted(gathered, key=lambda lanes: lanes[0]):
        i, node = lanes[0], source.nodes[lanes[0]]
        if len(set(lanes)) == 1 and is_truth(source, i):
            node = leaf(TRUTH, truths.setdefault(i, len(truths)))
        elif len(set(lanes)) == 1 and node.op != ca.OP_CONST:
            node = leaf(OUTER, outer.setdefault(i, len(outer)))
        elif node.op == ca.OP_INPUT:
            node = leaf(READ, reads.setdefault(node.entry, len(reads)))
        elif node.op == ca.OP_CONST and len(set(lanes)) > 1:
            values = tuple(source.nodes[k].value for k in lanes)
            node = leaf(TABLE, tables.setdefault(values, len(tables)))
        elif node.op != ca.OP_CONST:
            node = replace(node, args=tuple(number[a] for a in gathered[lanes]))
        number[lanes] = known.setdefault(node, len(nodes))
        if number[lanes] == len(nodes):
            nodes.append(node)
    stored = tuple(number[s.lanes] for s in strands if isinstance(s, Store))
    added = tuple(number[s.lanes] for s in strands if not isinstance(s, Store))
    made = Graph(tuple(nodes), (stored, added))
    inside = frozenset(i for lanes in gathered if len(set(lanes)) > 1 for i in lanes)
    return Body(made, tuple(outer), tuple(truths), tuple(reads), tuple(tables), inside)


def is_truth(source: Graph, i: int) -> bool:
    """Return True if a node is a condition and not a number."""
    node = source.nodes[i]
    if node.op == SELECT:
        return all(is_truth(source, k) for k in node.args[1:])
    return node.op in BOOLEAN
