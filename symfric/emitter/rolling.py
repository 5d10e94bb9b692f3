"""Isomorphic parts of a graph, one for each element of an array.

A law of n elements repeats a part of CasADi's graph n times. Two kinds of rows indicate this:

    stores   next_1, next_2, ..., next_n            consecutive rows of a result
    sums     start + term_1 + term_2 + ... + term_n

Their graphs are merged from the results down: n nodes with the same operation become one node,
until all n are the same node (a value from outside the loop), consecutive rows of an array, or
constants (a table). Graphs with other differences are not merged.
"""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import casadi as ca

from symfric.emitter.logic import BOOLEAN
from symfric.foundation.graph import SELECT, Graph, Node

LEAST = 3
"""Smallest number of elements in a loop."""

OUTER, TRUTH, READ, TABLE = range(4)
"""Arguments of the graph of a loop body."""

Lanes = tuple[int, ...]
"""Corresponding nodes, one for each element."""


class Array(NamedTuple):
    """Consecutive rows of an argument or a result that C can index.

    Attributes:
        group: number of the argument or result.
        text: C text in front of the index, such as `state->F`. An argument and a result with the
            same text share memory.
    """

    group: int
    first: int
    size: int
    text: str

    def holds(self, entry: tuple[int, int]) -> bool:
        """Return True if the array contains the row `entry`, (group, row)."""
        return entry[0] == self.group and self.first <= entry[1] < self.first + self.size


class Arrays(NamedTuple):
    """Rows that C can index: rows of arguments (`read`) and of results (`written`)."""

    read: tuple[Array, ...] = ()
    written: tuple[Array, ...] = ()


class StoredRows(NamedTuple):
    """Consecutive rows of a result, beginning at `offset` in `array`."""

    lanes: Lanes
    array: Array
    offset: int


class Sum(NamedTuple):
    """Node `total`: the sum of `start`, if there is one, and the lanes in their order."""

    lanes: Lanes
    start: int | None
    total: int


Strand = StoredRows | Sum


class Body(NamedTuple):
    """Operations of a loop for each element, as a graph.

    Attributes:
        graph: arguments `OUTER`, `TRUTH`, `READ`, `TABLE`; results: rows stored, terms added.
        outer: nodes of the whole graph that the rows of `OUTER` stand for.
        truths: conditions of the whole graph that the rows of `TRUTH` stand for.
        reads: array and offset of the first element, for each row of `READ`.
        tables: constants of all elements, for each row of `TABLE`.
        inside: operations of the whole graph that the loop computes.
    """

    graph: Graph
    outer: tuple[int, ...]
    truths: tuple[int, ...]
    reads: tuple[tuple[Array, int], ...]
    tables: tuple[tuple[float, ...], ...]
    inside: frozenset[int]

    @property
    def taken(self) -> tuple[int, ...]:
        """Nodes that the loop takes from outside."""
        return (*self.outer, *self.truths)


def strands(source: Graph, arrays: Arrays) -> list[Strand]:
    """Return all rows and sums whose graphs are isomorphic for `LEAST` or more elements."""
    found: list[Strand] = []
    for array in arrays.written:
        nodes = source.results[array.group][array.first : array.first + array.size]
        runs = _runs(source, nodes, arrays, same=True)
        found += (StoredRows(nodes[a:b], array, a) for a, b in runs)
    for terms, after in _chains(source):
        for a, b in _runs(source, terms, arrays):
            found.append(Sum(tuple(terms[a:b]), after[a - 1] if a else None, after[b - 1]))
    return found


def _runs(
    source: Graph, nodes: Sequence[int], arrays: Arrays, same: bool = False
) -> Iterator[tuple[int, int]]:
    """Yield ranges of isomorphic neighbours; with `same`, also those of one repeated node."""

    def alike(lanes: Lanes) -> bool:
        several = len(set(lanes))
        if several == 1:
            return same
        return several == len(lanes) and _gathered(source, [lanes], arrays) is not None

    a = 0
    for b in range(1, len(nodes) + 1):
        if b < len(nodes) and alike((nodes[b - 1], nodes[b])):
            continue
        lanes = tuple(nodes[a:b])
        if len(lanes) >= LEAST and alike(lanes):
            yield a, b
        a = b


def _chains(source: Graph) -> Iterator[tuple[list[int], list[int]]]:
    """Yield the terms of each sum of `LEAST` or more, and the nodes after adding each term."""
    uses = Counter(i for node in source.nodes for i in node.args)
    uses.update(i for row in source.results for i in row)

    def inner(i: int) -> bool:
        return source.nodes[i].op == ca.OP_ADD and uses[i] == 1

    left = {n.args[0] for n in source.nodes if n.op == ca.OP_ADD and inner(n.args[0])}
    for top, node in enumerate(source.nodes):
        if node.op != ca.OP_ADD or top in left:
            continue
        after = [top]
        while inner(source.nodes[after[0]].args[0]):
            after.insert(0, source.nodes[after[0]].args[0])
        terms = [source.nodes[after[0]].args[0], *(source.nodes[i].args[1] for i in after)]
        if len(terms) >= LEAST:
            yield terms, [terms[0], *after]


def _gathered(
    source: Graph, roots: Sequence[Lanes], arrays: Arrays
) -> dict[Lanes, tuple[Lanes, ...]] | None:
    """Return all lanes under the roots with their arguments; None if not isomorphic."""
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
        if any(node.op != nodes[0].op for node in nodes):
            return None
        if nodes[0].op == ca.OP_INPUT:
            (group, row), last = nodes[0].entry, nodes[-1].entry
            following = all(node.entry == (group, row + i) for i, node in enumerate(nodes))
            if not (
                following and any(a.holds((group, row)) and a.holds(last) for a in arrays.read)
            ):
                return None
        elif nodes[0].op != ca.OP_CONST:
            found[lanes] = tuple(zip(*(node.args for node in nodes), strict=True))
            waiting += found[lanes]
    return found


def woven(source: Graph, strands: Sequence[Strand], arrays: Arrays) -> Body:
    """Return the body of the loop that computes all `strands`, which have equal numbers of lanes.

    The lanes of each strand are isomorphic, see `strands`.
    """
    gathered = _gathered(source, [strand.lanes for strand in strands], arrays) or {}
    outer, truths = dict[int, int](), dict[int, int]()
    reads, tables = dict[tuple[Array, int], int](), dict[tuple[float, ...], int]()
    known, number = dict[Node, int](), dict[Lanes, int]()

    def leaf(group: int, row: int) -> Node:
        return Node(ca.OP_INPUT, entry=(group, row))

    for lanes in sorted(gathered, key=lambda lanes: lanes[0]):
        i, node, single = lanes[0], source.nodes[lanes[0]], len(set(lanes)) == 1
        if single and is_truth(source, i):
            node = leaf(TRUTH, truths.setdefault(i, len(truths)))
        elif single and node.op != ca.OP_CONST:
            node = leaf(OUTER, outer.setdefault(i, len(outer)))
        elif node.op == ca.OP_INPUT:
            array = next(a for a in arrays.read if a.holds(node.entry))
            node = leaf(READ, reads.setdefault((array, node.entry[1] - array.first), len(reads)))
        elif node.op == ca.OP_CONST and not single:
            values = tuple(source.nodes[k].value for k in lanes)
            node = leaf(TABLE, tables.setdefault(values, len(tables)))
        elif node.op != ca.OP_CONST:
            node = replace(node, args=tuple(number[a] for a in gathered[lanes]))
        number[lanes] = known.setdefault(node, len(known))
    stores = tuple(number[s.lanes] for s in strands if isinstance(s, StoredRows))
    sums = tuple(number[s.lanes] for s in strands if isinstance(s, Sum))
    inside = frozenset(i for lanes in gathered if len(set(lanes)) > 1 for i in lanes)
    leaves = tuple(outer), tuple(truths), tuple(reads), tuple(tables)
    return Body(Graph(tuple(known), (stores, sums)), *leaves, inside)


def is_truth(source: Graph, i: int) -> bool:
    """Return True if a node is a condition and not a number."""
    node = source.nodes[i]
    if node.op == SELECT:
        return all(is_truth(source, k) for k in node.args[1:])
    return node.op in BOOLEAN
