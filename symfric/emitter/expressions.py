"""Formulas of C99 for the operations of a graph."""

from collections.abc import Collection
from dataclasses import dataclass
from typing import final

import casadi as ca

from symfric.emitter.c99 import ATOM, LOGIC, SIGN, TERNARY, Real, form
from symfric.emitter.logic import logical
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

    def __init__(self, source: Graph, real: Real, conditions: Collection[int]) -> None:
        self.source, self.real = source, real
        self.names: dict[int, str] = {}
        self.logical = logical(source.nodes, conditions)

    def expression(self, i: int) -> Expression:
        """The value of a node, as it is."""
        if i in self.names:
            return Expression(self.names[i], ATOM)
        node, real = self.source.nodes[i], self.real
        if node.op == ca.OP_CONST:
            text = real.literal(node.value)
            return Expression(text, SIGN if text.startswith("-") else ATOM)
        how = form(node.op, len(node.args), real)
        plain = how.conditions if not (node.op == SELECT and self.logical[i]) else len(node.args)
        operands = [
            (self.expression if k < plain else self.number)(j) for k, j in enumerate(node.args)
        ]
        pattern = how.pattern
        if node.op in MIRRORED and self.source.nodes[node.args[0]].op == ca.OP_CONST:
            operands.reverse()
            pattern = MIRRORED[node.op]
        text = pattern.format(
            *(operand.within(least) for operand, least in zip(operands, how.needs, strict=True)),
            zero=real.literal(0.0),
            one=real.literal(1.0),
            two=real.literal(2.0),
        )
        return Expression(text, how.binds)

    def number(self, i: int) -> Expression:
        """The value of a node; a bool as the number 1 or 0 that CasADi means."""
        value = self.expression(i)
        if not self.logical[i]:
            return value
        one, zero = self.real.literal(1.0), self.real.literal(0.0)
        return Expression(f"{value.within(LOGIC)} ? {one} : {zero}", TERNARY)

    def truth(self, i: int) -> Expression:
        """The value of a node that is a bool or one of the numbers 1 and 0."""
        node = self.source.nodes[i]
        if node.op == ca.OP_CONST:
            return Expression("true" if node.value else "false", ATOM)
        return self.expression(i)


MIRRORED = {ca.OP_LT: "{} > {}", ca.OP_LE: "{} >= {}", ca.OP_EQ: "{} == {}", ca.OP_NE: "{} != {}"}
"""Comparisons read from the right: x > 0 and not 0 < x."""
