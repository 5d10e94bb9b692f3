"""Operations of fixed-point C, and the graph of a function in these operations.

A function that saturates (exp, tanh) gets a clamped argument. If its argument follows from a single
input, a copy of the input is clamped where the function has its limit, so that fewer bits of all
values in between hold the range, and more hold the fraction.
"""

from collections.abc import Mapping, Sequence
from functools import cache
from math import exp, frexp
from typing import final

import casadi as ca

from symfric.codegen.fixed.operations import (
    ALIGN,
    CLAMP,
    DECAY,
    INEXACT,
    LIMITS,
    OPERATIONS,
    PHI1,
    PHI2,
    SCALE,
)
from symfric.emitter.c99 import operation_name
from symfric.emitter.logic import BOOLEAN, settled
from symfric.foundation.graph import LEAVES, SELECT, Graph, Node, Nodes, graph, pruned, rebuild
from symfric.foundation.numeric import NEAR, exp_phi1_phi2

Hull = tuple[float, float]
WEIGHTS = (DECAY, PHI1, PHI2)
"""exp(-x) and its weights, in the order of `exp_phi1_phi2`."""


@final
class _Lowered(Nodes):
    """Unique nodes in the operations of fixed point."""

    def product(self, a: int, b: int) -> int:
        """Return a b; powers of two cost nothing, and factors are collected."""
        k, other = (self.value(a), b) if self.value(a) is not None else (self.value(b), a)
        if k is None:
            return self.power(a, b) or self.add(ca.OP_MUL, a, b)
        if (c := self.value(other)) is not None:
            return self.constant(k * c)
        inner = self.nodes[other]
        if inner.op == ca.OP_MUL and (c := self.value(inner.args[0])) is not None:
            return self.product(self.constant(k * c), inner.args[1])
        if inner.op == SCALE:
            return self.product(self.constant(k * inner.value), inner.args[0])
        if abs(frexp(k)[0]) == 0.5:
            scaled = other if abs(k) == 1.0 else self.add(SCALE, other, value=abs(k))
            return scaled if k > 0 else self.add(ca.OP_NEG, scaled)
        return self.constant(0.0) if k == 0.0 else self.add(ca.OP_MUL, self.constant(k), other)

    def power(self, a: int, b: int) -> int | None:
        """Return |x|^n for the smooth power x^2 (x^2 + c)^(n/2 - 1), which differs by c^(n/2)."""
        square, smooth = self.nodes[a], self.nodes[b]
        if square.op != ca.OP_MUL or smooth.op != ca.OP_CONSTPOW or not -1.0 < smooth.value < 0.0:
            return None
        total = self.nodes[smooth.args[0]]
        if total.op != ca.OP_ADD or a not in total.args or square.args[0] != square.args[1]:
            return None
        c = self.value(total.args[0]) or self.value(total.args[1]) or -1.0
        size, half = self.add(ca.OP_FABS, square.args[0]), 1.0 + smooth.value
        power = size if half == 0.5 else self.add(ca.OP_CONSTPOW, size, value=2.0 * half)
        return self.add(INEXACT, power, value=c**half) if c > 0.0 else None

    def quotient(self, a: int, b: int) -> int:
        """Return a / b; a product as divisor is divided by in turn, as its range is wide."""
        divisor = self.value(b)
        if divisor is not None:
            return self.product(a, self.constant(1.0 / divisor))
        node = self.nodes[b]
        if node.op == ca.OP_MUL:
            first, second = node.args
            return self.quotient(self.quotient(a, first), second)
        if node.op == SCALE:
            return self.product(self.constant(1.0 / node.value), self.quotient(a, node.args[0]))
        factor = self.nodes[a]
        if factor.op == ca.OP_MUL and self.value(factor.args[0]) is not None:
            return self.product(factor.args[0], self.quotient(factor.args[1], b))
        return self.add(ca.OP_DIV, a, b)

    def select(self, condition: int, yes: int, no: int) -> int:
        """Return a select, whose sides get its format; other selects have sides of their own."""
        own = float(len(self.nodes))
        sides = (self.add(ALIGN, side, value=own) for side in (yes, no))
        return self.add(SELECT, condition, *sides)

    def made(self, node: Node, args: Sequence[int]) -> int:
        """Return the number of a node with the value of `node`."""
        match node.op:
            case ca.OP_SQ:
                return self.product(args[0], args[0])
            case ca.OP_TWICE:
                return self.product(self.constant(2.0), args[0])
            case ca.OP_MUL:
                return self.product(*args)
            case ca.OP_DIV:
                return self.quotient(*args)
            case ca.OP_INV:
                return self.quotient(self.constant(1.0), args[0])
            case ca.OP_NEG if self.value(args[0]) is not None:
                return self.constant(-self.nodes[args[0]].value)
            case ca.OP_EXPM1:
                return self.add(ca.OP_SUB, self.add(ca.OP_EXP, *args), self.constant(1.0))
            case ca.OP_SIGN:
                zero, (x,) = self.constant(0.0), args
                low = self.select(self.add(ca.OP_LT, x, zero), self.constant(-1.0), zero)
                return self.select(self.add(ca.OP_LT, zero, x), self.constant(1.0), low)
            case ca.OP_IF_ELSE_ZERO:
                return self.select(args[0], args[1], self.constant(0.0))
            case _ if node.op == SELECT:
                return self.select(*args)
            case ca.OP_CONSTPOW:
                return self.add(node.op, args[0], value=self.nodes[args[1]].value)
            case _ if node.op in WEIGHTS:
                return self.add(node.op, self.product(self.constant(-node.value), args[0]))
            case _:
                return self.keep(Node(node.op, tuple(args), node.entry, node.value))


def recognised(function: ca.Function) -> Graph:
    """Return the graph of a function with the weights of an exponential step as operations.

    A select by |x| < `NEAR` becomes an operation of |x| if it has the same graph as a result of
    `exp_phi1_phi2` for x or -x. The value of the node is 1 for x <= 0, and -1 for x >= 0.
    """
    source, selects = graph(function), dict[int, list[int]]()
    arguments = [ca.SX.sym("x", function.size1_in(k)) for k in range(function.n_in())]
    nodes = list(source.nodes)
    for i, node in enumerate(nodes):
        if node.op == SELECT and nodes[node.args[0]].op == ca.OP_LT:
            size, most = (nodes[j] for j in nodes[node.args[0]].args)
            if size.op == ca.OP_FABS and most.value == NEAR:
                selects.setdefault(size.args[0], []).append(i)
    for x, of in selects.items():
        cut, factor = x, 1.0
        if nodes[x].op == ca.OP_MUL and nodes[nodes[x].args[0]].op == ca.OP_CONST:
            cut, factor = nodes[x].args[1], nodes[nodes[x].args[0]].value  # CasADi joins constants
        y = ca.SX.sym("y")
        known = {
            graph(ca.Function("weight", [y], [weight])): Node(op, (x,), value=sign)
            for sign, product in ((1.0, factor * y), (-1.0, -(factor * y)))
            for op, weight in zip(WEIGHTS, exp_phi1_phi2(product), strict=True)
        }
        (made,) = rebuild(Graph(source.nodes, (tuple(of),)), arguments, {cut: y})
        for i, weight in zip(of, ca.vertsplit(made), strict=True):
            own = ca.Function("weight", [y], [weight], {"allow_free": True})
            if not own.has_free():
                nodes[i] = known.get(graph(own), nodes[i])
    return Graph(tuple(nodes), source.results)


def lowered(source: Graph, limits: Sequence[float], where: str) -> Graph:
    """Return the graph of a step in the operations of fixed point.

    Args:
        source: graph of a step, whose first result is the states.
        limits: largest magnitude of each state, to which its result is clamped.
        where: beginning of messages.

    Raises:
        ValueError: operations without counterpart in fixed point; the message names them all.
    """
    build, found = _Lowered(), list[int]()
    source = settled(source)
    for node in source.nodes:
        found.append(build.made(node, [found[i] for i in node.args]))
    states, *outputs = source.results
    ends = [build.add(CLAMP, found[i], value=x) for i, x in zip(states, limits, strict=True)]
    rows = [ends, *([found[i] for i in row] for row in outputs)]
    rows = [tuple(build.add(ALIGN, i) for i in row) for row in rows]
    result = pruned(build.nodes, rows)
    wrong = {n.op for n in result.nodes} - {*OPERATIONS, *BOOLEAN, SELECT, *LEAVES}
    if wrong:
        got = ", ".join(sorted(map(operation_name, wrong)))
        raise ValueError(f"{where}: expected operations that fixed point has, got {got}")
    return result


Cone = tuple[tuple[int, int], float]
"""(argument, row) of an input, and its largest magnitude that matters."""


def narrowed(source: Graph, hulls: Sequence[Hull], cones: Mapping[int, Cone]) -> Graph:
    """Return the graph with clamped arguments of functions that saturate.

    Args:
        source: a lowered graph.
        hulls: range of each of its nodes.
        cones: function -> the input from which alone its argument follows, and the magnitude of it
            beyond which the function has its limit.
    """
    build = _Lowered()

    @cache
    def made(i: int, cone: Cone | None) -> int:
        node = source.nodes[i]
        if node.op == ca.OP_INPUT and cone is not None and cone[0] == node.entry:
            return build.add(CLAMP, build.keep(node), value=cone[1])
        args = tuple(made(j, cone or cones.get(i)) for j in node.args)
        if node.op in LIMITS:
            return saturating(node.op, args[0], *hulls[node.args[0]])
        return build.keep(Node(node.op, args, node.entry, node.value))

    def saturating(op: int, x: int, low: float, high: float) -> int:
        limit, shift = LIMITS[op], 0.0
        if op == ca.OP_EXP and high > 0.0:  # exp(x) = exp(high) exp(x - high)
            shift = high
            x = build.add(ca.OP_SUB, x, build.constant(high))
        if max(abs(low - shift), abs(high - shift)) > limit:
            x = build.add(CLAMP, x, value=limit)
        found = build.add(op, x)
        return build.product(build.constant(exp(shift)), found) if shift else found

    rows = [tuple(made(i, None) for i in row) for row in source.results]
    return pruned(build.nodes, rows)
