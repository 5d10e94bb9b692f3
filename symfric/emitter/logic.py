"""Simplification of a graph for C: conditions as bools, minima and maxima as comparisons.

CasADi's bools are the numbers 1 and 0, and its selects are sums of two halves; its `fmin` and
`fmax` are functions of about thirty instructions on a Cortex-M4F. `simplified` returns a graph of
the same values in which

* conditions (of selects, and in and, or, not) are comparisons and combinations of them, never
  numbers that are compared with 0; negations are innermost and constants are folded;
* `if_else_zero`, `fmin` and `fmax` are selects;
* 2 (0.5 / x), by which `reciprocal` keeps CasADi from dividing again, is 1 / x, with the same bits
  for |x| below 2e307 (4e37 in float).

All finite numbers and infinities keep their bits, except for the sign of a zero, which C leaves to
the library in fmin(0, -0). If x is NaN, `fmin(x, c)` is c, as in CasADi, if c is known to be a
number (a constant, or a value clipped to one), so a clip to constant bounds is never NaN. For other
operands, `fmin(x, NaN)` is NaN here and x in CasADi. The derivative of `fmin(x, y)` at NaN is that
of one side and not NaN.

`settled` then removes selects whose condition is known wherever they are used. An expression with
correct derivatives guards the branch that is not taken:

    near ? series : expm1(x) / (near ? 1 : x)

Only the second branch uses the inner select, which is therefore x.
"""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from operator import eq, le, lt, ne
from typing import final

import casadi as ca

from symfric.foundation.graph import SELECT, Graph, Node, Nodes, merged, pruned

COMPARISONS = {ca.OP_LT: lt, ca.OP_LE: le, ca.OP_EQ: eq, ca.OP_NE: ne}
OPPOSITE = {ca.OP_EQ: ca.OP_NE, ca.OP_NE: ca.OP_EQ}
"""Comparisons that are the negation of each other for every number, including NaN."""
BOOLEAN = frozenset({*COMPARISONS, ca.OP_NOT, ca.OP_AND, ca.OP_OR})
COMMUTING = frozenset({ca.OP_ADD, ca.OP_MUL, ca.OP_EQ, ca.OP_NE, ca.OP_AND, ca.OP_OR})
TRUTHFUL = frozenset({ca.OP_SIGN, ca.OP_NEG, ca.OP_FABS})
"""Operations that are zero only if their operand is zero."""
LOWERED = frozenset({ca.OP_FMIN, ca.OP_FMAX, ca.OP_IF_ELSE_ZERO})
"""Operations without counterpart in a simplified graph."""


def simplified(
    source: Graph, conditions: Collection[int] = (), truths: Collection[int] = ()
) -> Graph:
    """Return a simplified graph with the same values; a simplified graph is unchanged.

    Args:
        source: graph of numbers.
        conditions: arguments that are bools.
        truths: results that become bools.
    """
    made, found = _Algebra(conditions=conditions), list[int]()
    for node in source.nodes:
        found.append(made.of(node, [found[i] for i in node.args]))
    rows = [
        tuple(made.truth(found[i]) if k in truths else found[i] for i in row)
        for k, row in enumerate(source.results)
    ]
    return pruned(made.nodes, rows)


def logical(nodes: Sequence[Node], conditions: Collection[int] = ()) -> list[bool]:
    """Return for each node True if it is a bool."""
    found: list[bool] = []
    for node in nodes:
        found.append(is_logical(node, found, conditions))
    return found


def is_logical(node: Node, before: Sequence[bool], conditions: Collection[int]) -> bool:
    """Return True if a node is a bool, given the results `before` of the earlier nodes."""
    if node.op == ca.OP_INPUT:
        return node.entry[0] in conditions
    if node.op == SELECT:
        return all(before[i] for i in node.args[1:])
    return node.op in BOOLEAN


@final
@dataclass
class _Algebra(Nodes):
    """Unique nodes, and facts about their values."""

    conditions: Collection[int] = ()
    logical: list[bool] = field(default_factory=list[bool])
    number: list[bool] = field(default_factory=list[bool])
    """True for constants and bools, which are never NaN."""

    def of(self, node: Node, args: Sequence[int]) -> int:
        """Return the number of a node with the value of `node` for these arguments."""
        match node.op:
            case ca.OP_FMIN | ca.OP_FMAX:
                return self.extreme(node.op, *args)
            case ca.OP_IF_ELSE_ZERO:
                return self.select(args[0], args[1], self.constant(0.0))
            case _ if node.op == SELECT:
                return self.select(*args)
            case ca.OP_NOT:
                return self.negated(self.truth(args[0]))
            case ca.OP_AND | ca.OP_OR:
                return self.joined(node.op, self.truth(args[0]), self.truth(args[1]))
            case _ if node.op in COMPARISONS:
                return self.compared(node.op, *args)
            case ca.OP_TWICE if self.nodes[args[0]].op == ca.OP_DIV:
                half, divisor = self.nodes[args[0]].args
                if self.value(half) == 0.5:
                    return self.add(ca.OP_INV, divisor)
                return self.add(node.op, *args)
            case ca.OP_DIV:
                return self.weight_of_side(*args) or self.add(node.op, *args)
            case _:
                return self.keep(Node(node.op, tuple(args), node.entry, node.value))

    def keep(self, node: Node) -> int:
        if node.op in COMMUTING and node not in self.known:
            swapped = Node(node.op, node.args[::-1])
            node = swapped if swapped in self.known else node
        place = super().keep(node)
        if place == len(self.logical):
            self.logical.append(is_logical(node, self.logical, self.conditions))
            self.number.append(self.logical[-1] or self._is_number(node))
        return place

    def _is_number(self, node: Node) -> bool:
        if node.op == SELECT:
            condition, yes, no = node.args
            compared = self.nodes[condition]
            held = compared.op in (ca.OP_LT, ca.OP_LE) and yes in compared.args
            return self.number[no] and (held or self.number[yes])
        return node.op == ca.OP_CONST or (node.op in TRUTHFUL and self.number[node.args[0]])

    def truth(self, i: int) -> int:
        """Return a node that is true if a number is not 0: a bool or a constant."""
        return i if self.logical[i] else self.compared(ca.OP_NE, i, self.constant(0.0))

    def negated(self, i: int) -> int:
        """Return the negation of a bool, moved into `and` or `or` if this saves a negation."""
        node, value = self.nodes[i], self.value(i)
        if value is not None:
            return self.constant(float(value == 0.0))
        if node.op == ca.OP_NOT:
            return node.args[0]
        if node.op in OPPOSITE:
            return self.add(OPPOSITE[node.op], *node.args)
        turning = any(self.nodes[k].op in (ca.OP_NOT, *OPPOSITE) for k in node.args)
        if turning and node.op in (ca.OP_AND, ca.OP_OR):
            other = ca.OP_OR if node.op == ca.OP_AND else ca.OP_AND
            return self.joined(other, *map(self.negated, node.args))
        return self.add(ca.OP_NOT, i)

    def joined(self, op: int, a: int, b: int) -> int:
        """Return `and` or `or` of two bools."""
        neutral = float(op == ca.OP_AND)
        for one, other in ((a, b), (b, a)):
            value = self.value(one)
            if value is not None:
                return other if (value != 0.0) == neutral else self.constant(1.0 - neutral)
        if a == b:
            return a
        if Node(ca.OP_NOT, (a,)) == self.nodes[b] or Node(ca.OP_NOT, (b,)) == self.nodes[a]:
            return self.constant(1.0 - neutral)
        return self.add(op, a, b)

    def select(self, condition: int, yes: int, no: int) -> int:
        """Return `yes` if the condition holds, else `no`."""
        condition = self.truth(condition)
        known = self.value(condition)
        if known is not None:
            return yes if known != 0.0 else no
        if self.nodes[condition].op == ca.OP_NOT:
            return self.select(self.nodes[condition].args[0], no, yes)
        yes, no = self._settled(condition, yes, 1), self._settled(condition, no, 2)
        if yes == no:
            return yes
        first, second = self.value(yes), self.value(no)
        if self._is_boolean(yes) and self._is_boolean(no):
            if first is not None:
                opposite = condition if first else self.negated(condition)
                return self.joined(ca.OP_OR if first else ca.OP_AND, opposite, no)
            if second is not None:
                opposite = self.negated(condition) if second else condition
                return self.joined(ca.OP_OR if second else ca.OP_AND, opposite, yes)
        return self.add(SELECT, condition, yes, no)

    def _settled(self, condition: int, side: int, taken: int) -> int:
        """Return a side of a select, or the branch `taken` of a select on the same condition."""
        node = self.nodes[side]
        return node.args[taken] if node.op == SELECT and node.args[0] == condition else side

    def _is_boolean(self, i: int) -> bool:
        """Return True if node `i` is a bool or one of the numbers 1 and 0."""
        return self.logical[i] or self.value(i) in (0.0, 1.0)

    def compared(self, op: int, a: int, b: int) -> int:
        """Return a comparison; for a select of constants and a constant, a condition."""
        x, y = self.value(a), self.value(b)
        if x is not None and y is not None:
            return self.constant(float(COMPARISONS[op](x, y)))
        if x is None and y is None:
            return self.add(op, a, b)
        varying = self.nodes[a if x is None else b]

        def against(side: int) -> int:
            return self.compared(op, side, b) if x is None else self.compared(op, a, side)

        if self.logical[a if x is None else b]:
            yes, no = against(self.constant(1.0)), against(self.constant(0.0))
            return self.select(a if x is None else b, yes, no)
        if varying.op == SELECT:
            condition, yes, no = varying.args
            if all(self.logical[i] or self.value(i) is not None for i in (yes, no)):
                return self.select(condition, against(yes), against(no))
        alike = varying.op == ca.OP_SIGN or (varying.op in TRUTHFUL and op in OPPOSITE)
        if alike and 0.0 in (x, y):
            return against(varying.args[0])
        return self.add(op, a, b)

    def extreme(self, op: int, a: int, b: int) -> int:
        """Return the smaller (`fmin`) or the larger (`fmax`) of two numbers."""
        if a == b:
            return a
        if self.number[a] and not self.number[b]:
            a, b = b, a
        return self._clip(op, a, b) or self._first_if(op, a, b)

    def _first_if(self, op: int, a: int, b: int) -> int:
        """Return the extreme as a select; if equal, it is `b` if known as a number, else `a`."""
        if not self.number[b]:
            a, b = b, a
        order = (a, b) if op == ca.OP_FMIN else (b, a)
        return self.select(self.compared(ca.OP_LT, *order), a, b)

    def _clip(self, op: int, a: int, b: int) -> int | None:
        """Return the clip x > low ? (x < high ? x : high) : low to constants; None otherwise."""
        node, bound = self.nodes[a], self.value(b)
        if bound is None or node.op != SELECT:
            return None
        condition, x, other = node.args
        if self.value(other) is None or self.nodes[condition].op != ca.OP_LT:
            return None
        low, high = (b, other) if op == ca.OP_FMAX else (other, b)
        before = (x, high) if op == ca.OP_FMAX else (low, x)
        ordered = (self.value(low) or 0.0) <= (self.value(high) or 0.0)
        if self.nodes[condition].args != before or not ordered:
            return None
        return self.add(SELECT, condition, self._first_if(op, x, b), other)

    def weight_of_side(self, a: int, b: int) -> int | None:
        """Return (p <= q) / ((p <= q) + (q <= p)), the weight of a side in derivatives of fmin.

        It is 1, 1/2 or 0. Returns None for other quotients. `fmax` has the same weights.
        """
        total, one = self.nodes[b], self.nodes[a]
        if one.op != ca.OP_LE or total.op != ca.OP_ADD or a not in total.args:
            return None
        (other,) = {*total.args} - {a} or {a}
        if self.nodes[other] != Node(ca.OP_LE, one.args[::-1]):
            return None
        inner = self.add(SELECT, other, self.constant(0.5), self.constant(1.0))
        return self.add(SELECT, a, inner, self.constant(0.0))


Fact = tuple[int, bool]
"""Condition, and True if it holds or False if it does not."""

NEEDED: Mapping[int, tuple[bool | None, ...]] = {
    SELECT: (None, True, False), ca.OP_IF_ELSE_ZERO: (None, True), ca.OP_AND: (None, True),
    ca.OP_OR: (None, False),
}  # fmt: skip
"""Value of the first argument for which each argument is needed; None if it is always needed."""


def settled(source: Graph) -> Graph:
    """Return the graph without selects whose condition is known wherever they are used.

    A node belongs to a branch if all its users do. Since C does not compute a branch that is not
    taken, the condition of the branch is then known. Values keep all their bits.
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
    """Return the facts that hold wherever the value of a node matters."""
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
    """Yield the arguments of a node, each with the conditions under which its value matters."""
    needed = NEEDED.get(node.op, (None,) * len(node.args))
    for i, truth in zip(node.args, needed, strict=True):
        facts = () if truth is None else _implied(source, node.args[0], truth)
        yield i, frozenset(facts)


def _implied(source: Graph, number: int, truth: bool) -> Iterator[Fact]:
    """Yield the fact itself and the facts about its operands that it implies."""
    yield number, truth
    node = source.nodes[number]
    if node.op == ca.OP_NOT:
        yield from _implied(source, node.args[0], not truth)
    elif node.op == (ca.OP_AND if truth else ca.OP_OR):
        for i in node.args:
            yield from _implied(source, i, truth)


def _holds(source: Graph, number: int, facts: frozenset[Fact]) -> bool | None:
    """Return the truth of a condition; None if the facts do not determine it."""
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
