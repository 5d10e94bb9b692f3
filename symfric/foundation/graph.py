"""CasADi Functions as graphs of operations without duplicates, and groups of coupled rows."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.foundation.numeric import LEAVES, applied, walk
from symfric.foundation.variable import stacked

SELECT = -1
"""Operation code of an `if_else` node, which CasADi represents as a sum of two terms."""


@dataclass(frozen=True)
class Node:
    """Operation of a graph.

    Attributes:
        op: operation number of CasADi, or `SELECT`.
        args: numbers of the argument nodes, which precede this node.
        entry: (argument, row) of an input.
        value: value of a constant.
    """

    op: int
    args: tuple[int, ...] = ()
    entry: tuple[int, int] = (0, 0)
    value: float = 0.0


@dataclass(frozen=True)
class Graph:
    """Graph of operations.

    Attributes:
        nodes: nodes, each after its arguments.
        results: node number of each row of each result.
    """

    nodes: tuple[Node, ...]
    results: tuple[tuple[int, ...], ...]

    @property
    def operations(self) -> int:
        """Number of operations, not counting inputs and constants."""
        return sum(node.op not in LEAVES for node in self.nodes)

    def depends(self, arguments: Sequence[int]) -> list[bool]:
        """Return a list that is True for each node that depends on one of the `arguments`."""
        found: list[bool] = []
        for node in self.nodes:
            own = node.op == ca.OP_INPUT and node.entry[0] in arguments
            found.append(own or any(found[i] for i in node.args))
        return found


@dataclass
class Nodes:
    """Growing list of nodes without duplicates."""

    nodes: list[Node] = field(default_factory=list[Node])
    known: dict[Node, int] = field(default_factory=dict[Node, int])

    def keep(self, node: Node) -> int:
        """Return the number of a node, which is appended if it is new."""
        number = self.known.setdefault(node, len(self.nodes))
        if number == len(self.nodes):
            self.nodes.append(node)
        return number

    def add(self, op: int, *args: int, value: float = 0.0) -> int:
        """Return the number of an operation."""
        return self.keep(Node(op, args, value=value))

    def constant(self, value: float) -> int:
        """Return the number of a constant."""
        return self.keep(Node(ca.OP_CONST, value=value))

    def value(self, i: int) -> float | None:
        """Return the value of a node; None if it is not a constant."""
        node = self.nodes[i]
        return node.value if node.op == ca.OP_CONST else None


@final
@dataclass
class _Joined(Nodes):
    """Nodes in which a sum of two halves of a select is the select."""

    def keep(self, node: Node) -> int:
        if node.op == ca.OP_ADD:
            node = self._if_else(*node.args) or self._if_else(*reversed(node.args)) or node
        return super().keep(node)

    def _if_else(self, a: int, b: int) -> Node | None:
        """Return the node c ? x : y if a + b is (c ? x : 0) + (!c ? y : 0); else None.

        The values are equal except for the sign of zero.
        """
        yes, no = self.nodes[a], self.nodes[b]
        if not yes.op == no.op == ca.OP_IF_ELSE_ZERO:
            return None
        if self.nodes[no.args[0]] != Node(ca.OP_NOT, (yes.args[0],)):
            return None
        return Node(SELECT, (yes.args[0], yes.args[1], no.args[1]))


def graph(function: ca.Function) -> Graph:
    """Return the graph of an SX Function with dense arguments and results, without unused nodes.

    Raises:
        ValueError: the Function is not an SX Function, has free symbols, or has sparse arguments or
            results.
    """
    _check(function)
    builder = _Joined()

    def made(k: int, operands: list[int]) -> int:
        op, entry = function.instruction_id(k), function.instruction_input(k)
        if op == ca.OP_INPUT:
            return builder.keep(Node(op, entry=(entry[0], entry[1])))
        if op == ca.OP_CONST:
            return builder.keep(Node(op, value=function.instruction_constant(k)))
        return builder.keep(Node(op, tuple(operands)))

    return pruned(builder.nodes, [tuple(row) for row in walk(function, made)])


def _check(function: ca.Function) -> None:
    where = f"codegen '{function.name()}'"
    if not function.is_a("SXFunction"):
        raise ValueError(
            f"{where}: expected an SX function, got {function.class_name()}; expand it"
        )
    if function.has_free():
        raise ValueError(f"{where}: expected no free symbols, got {function.get_free()}")
    sides = [*map(function.sparsity_in, range(function.n_in()))]
    sides += map(function.sparsity_out, range(function.n_out()))
    if not all(sparsity.is_dense() for sparsity in sides):
        raise ValueError(f"{where}: expected dense arguments and results, got sparse ones; densify")


def pruned(nodes: Sequence[Node], results: Sequence[tuple[int, ...]]) -> Graph:
    """Return the graph of the given results without unused nodes."""
    used = {i for row in results for i in row}
    for i in reversed(range(len(nodes))):
        if i in used:
            used.update(nodes[i].args)
    number = {old: new for new, old in enumerate(sorted(used))}
    kept = (nodes[i] for i in sorted(used))
    return Graph(
        tuple(Node(n.op, tuple(number[i] for i in n.args), n.entry, n.value) for n in kept),
        tuple(tuple(number[i] for i in row) for row in results),
    )


def merged(source: Graph, instead: Mapping[int, int]) -> Graph:
    """Return the graph with each node in `instead` replaced by the given earlier node."""
    builder = _Joined()
    number: list[int] = []
    for i, node in enumerate(source.nodes):
        if i in instead:
            number.append(number[instead[i]])
        else:
            args = tuple(number[j] for j in node.args)
            number.append(builder.keep(replace(node, args=args)))
    return pruned(builder.nodes, [tuple(number[i] for i in r) for r in source.results])


def rebuild(
    source: Graph, arguments: Sequence[ca.SX], replacing: Mapping[int, ca.SX]
) -> list[ca.SX]:
    """Return the results as expressions of `arguments`, columns, with some nodes replaced.

    Unlike `casadi.substitute`, this can replace parts of an expression that are not symbols.
    """
    found: list[ca.SX] = []
    for i, node in enumerate(source.nodes):
        args = [found[j] for j in node.args]
        if i in replacing:
            found.append(replacing[i])
        elif node.op == ca.OP_INPUT:
            found.append(arguments[node.entry[0]][node.entry[1]])
        elif node.op == ca.OP_CONST:
            found.append(ca.SX(node.value))
        elif node.op == SELECT:
            condition, yes, no = args
            found.append(ca.if_else(condition, yes, no))
        else:
            found.append(applied(node.op, args))
    return [stacked(found[i] for i in row) for row in source.results]


def coupled(pattern: NDArray[np.bool_]) -> list[tuple[list[int], list[int]]]:
    """Return (columns, rows) of each group of rows that are coupled by common columns.

    Args:
        pattern: mask of the columns on which each row depends, shape (rows, columns).
    """
    left, found = set(range(pattern.shape[0])), list[tuple[list[int], list[int]]]()
    while left:
        rows, columns = {left.pop()}, set[int]()
        while True:
            columns |= {int(k) for row in rows for k in np.flatnonzero(pattern[row])}
            more = {row for row in left if pattern[row][sorted(columns)].any()}
            if not more:
                break
            rows |= more
            left -= more
        found.append((sorted(columns), sorted(rows)))
    return found
