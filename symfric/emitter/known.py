"""Selects whose condition is known wherever they are used.

An expression that must have right derivatives guards what it does not take:

    near ? series : expm1(x) / (near ? 1 : x)

Here the inner select is used in the second branch alone and is x.
"""

from collections.abc import Iterator

import casadi as ca

from symfric.foundation.graph import SELECT, Graph, Node, merged

Fact = tuple[int, bool]
"""A node, and whether it is true."""


def settled(source: Graph) -> Graph:
    """The same results, without selects that only one of their branches can ever leave.

    A node is used in a branch alone if all its users are; in C, where a branch that is not taken is
    not computed, its condition then is a fact. Values are the same to the bit.
    """
    while True:
        facts = _facts(source)
        instead: dict[int, int] = {}
        for i, node in enumerate(source.nodes):
            if node.op in (SELECT, ca.OP_IF_ELSE_ZERO):
                holds = _holds(source, node.args[0], facts[i])
                if holds or (holds is False and node.op == SELECT):
                    instead[i] = node.args[1 if holds else 2]
        if not instead:
            return source
        source = merged(source, instead)


def _facts(source: Graph) -> list[frozenset[Fact]]:
    """What holds wherever the value of a node matters."""
    found: list[frozenset[Fact] | None] = [None] * len(source.nodes)
    for row in source.results:
        for i in row:
            found[i] = frozenset()
    for i in reversed(range(len(source.nodes))):
        known = found[i] or frozenset[Fact]()
        for j, new in _branches(source, source.nodes[i]):
            here, before = known | new, found[j]
            found[j] = here if before is None else before & here
    return [facts or frozenset() for facts in found]


def _branches(source: Graph, node: Node) -> Iterator[tuple[int, frozenset[Fact]]]:
    """The arguments of a node, each with the conditions under which its value matters."""
    conditions: tuple[Fact | None, ...] = (None,) * len(node.args)
    first = node.args[0] if node.args else 0
    if node.op == SELECT:
        conditions = None, (first, True), (first, False)
    elif node.op in (ca.OP_IF_ELSE_ZERO, ca.OP_AND):
        conditions = None, (first, True)
    elif node.op == ca.OP_OR:
        conditions = None, (first, False)
    for i, condition in zip(node.args, conditions, strict=True):
        yield i, frozenset(_implied(source, *condition)) if condition else frozenset()


def _implied(source: Graph, number: int, truth: bool) -> Iterator[Fact]:
    """The fact itself and those of the conditions that it is made of."""
    yield number, truth
    node = source.nodes[number]
    if node.op == ca.OP_NOT:
        yield from _implied(source, node.args[0], not truth)
    elif node.op == (ca.OP_AND if truth else ca.OP_OR):
        for i in node.args:
            yield from _implied(source, i, truth)


def _holds(source: Graph, number: int, facts: frozenset[Fact]) -> bool | None:
    """Whether a condition holds; None where the facts do not tell."""
    for truth in (True, False):
        if (number, truth) in facts:
            return truth
    node = source.nodes[number]
    if node.op == ca.OP_NOT:
        inner = _holds(source, node.args[0], facts)
        return None if inner is None else not inner
    if node.op in (ca.OP_AND, ca.OP_OR):
        either = node.op == ca.OP_OR
        parts = [_holds(source, i, facts) for i in node.args]
        if either in parts:
            return either
        return None if None in parts else not either
    return None
