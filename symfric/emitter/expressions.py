"""Formulas of C99 for the operations of a graph."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import final

import casadi as ca

from symfric.emitter.c99 import ATOM, LOGIC, SIGN, TERNARY, Real, form
from symfric.emitter.logic import OPPOSITE
from symfric.foundation.graph import SELECT, Graph


@final
@dataclass(frozen=True)
class Expression:
    """A text and how tightly it binds."""

    text: str
    binds: int

    def within(self, least: int) -> str:
        """The text, in parentheses where it binds less tightly than `least`."""
        return self.text if self.binds >= least else f"({self.text})"


@final
class Writer:
    """Writes nodes as formulas of what has a name.

    Attributes:
        names: of nodes.
        logical: whether each node is a bool.
    """

    def __init__(self, source: Graph, logical: Sequence[bool], real: Real) -> None:
        self.source, self.real = source, real
        self.names: dict[int, str] = {}
        self.logical = logical
        self.constants = {"zero": real.literal(0.0), "one": real.literal(1.0)}
        self.constants["two"] = real.literal(2.0)

    def expression(self, i: int) -> Expression:
        """The value of a node, as it is."""
        if i in self.names:
            return Expression(self.names[i], ATOM)
        node = self.source.nodes[i]
        if node.op == ca.OP_CONST:
            text = self.real.literal(node.value)
            return Expression(text, SIGN if text.startswith("-") else ATOM)
        return self._operation(i, node.op)

    def _operation(self, i: int, op: int) -> Expression:
        """Operation `op` on the operands of node `i`."""
        args = self.source.nodes[i].args
        how = form(op, len(args), self.real)
        plain = len(args) if op == SELECT and self.logical[i] else how.conditions
        operands = [(self.expression if k < plain else self.number)(j) for k, j in enumerate(args)]
        pattern = how.pattern
        if op in MIRRORED and self.source.nodes[args[0]].op == ca.OP_CONST:
            operands.reverse()
            pattern = MIRRORED[op]
        text = pattern.format(
            *(operand.within(least) for operand, least in zip(operands, how.needs, strict=True)),
            **self.constants,
        )
        return Expression(text, how.binds)

    def number(self, i: int) -> Expression:
        """The value of a node; a bool as the number 1 or 0 that CasADi means."""
        value = self.expression(i)
        if not self.logical[i]:
            return value
        one, zero = self.constants["one"], self.constants["zero"]
        return Expression(f"{value.within(LOGIC)} ? {one} : {zero}", TERNARY)

    def negation(self, i: int) -> Expression:
        """The opposite of a bool."""
        node = self.source.nodes[i]
        if i not in self.names and node.op in OPPOSITE:
            return self._operation(i, OPPOSITE[node.op])
        if i not in self.names and node.op == ca.OP_NOT:
            return self.expression(node.args[0])
        return Expression(f"!{self.expression(i).within(ATOM)}", SIGN)

    def truth(self, i: int) -> Expression:
        """The value of a node that is a bool or one of the numbers 1 and 0."""
        node = self.source.nodes[i]
        if node.op == ca.OP_CONST:
            return Expression("true" if node.value else "false", ATOM)
        return self.expression(i)


MIRRORED = {ca.OP_LT: "{} > {}", ca.OP_LE: "{} >= {}", ca.OP_EQ: "{} == {}", ca.OP_NE: "{} != {}"}
"""Comparisons read from the right: x > 0 and not 0 < x."""
