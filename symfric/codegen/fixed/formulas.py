"""C formulas of integers for the operations of `lowered`."""

from collections.abc import Sequence
from math import ceil
from typing import final

import casadi as ca

from symfric.codegen.fixed.operations import (
    ALIGN,
    BITS,
    CLAMP,
    DECAY,
    INEXACT,
    OPERATIONS,
    OWN,
    PHI1,
    PHI2,
    SCALE,
)
from symfric.emitter.c99 import ATOM, FORMS, INTEGER, PRODUCT, SIGN, Expression
from symfric.emitter.logic import COMPARISONS, logical
from symfric.foundation.graph import Graph

NAMES = {
    ca.OP_EXP: "exp", ca.OP_TANH: "tanh", ca.OP_SIN: "sin", ca.OP_FABS: "abs", ca.OP_FMIN: "min",
    ca.OP_FMAX: "max",
}  # fmt: skip
"""Functions of `fixed.c` whose only arguments are numbers."""
FOLLOWED = {
    ca.OP_ATAN: ("atan", BITS), DECAY: ("decay", 25), PHI1: ("phi1", 25), PHI2: ("phi2", 25),
}  # fmt: skip
"""Functions whose second argument is the format of the first, and its largest value."""


@final
class IntegerWriter:
    """Writer of nodes as formulas of integers in their formats.

    Attributes:
        names: names of nodes.
        logical: for each node, True if it is a bool.
        real: type of the numbers.
    """

    def __init__(self, source: Graph, formats: Sequence[int], prefix: str) -> None:
        self.source, self.formats, self.prefix = source, formats, prefix
        self.logical, self.real = logical(source.nodes), INTEGER
        self.names: dict[int, str] = {}

    def expression(self, i: int) -> Expression:
        """Return the value of a node, a bool or an integer in its format."""
        if i in self.names:
            return Expression(self.names[i], ATOM)
        nodes, bits = self.source.nodes, self.formats[i]
        op, args, value = nodes[i].op, nodes[i].args, nodes[i].value
        own = [self.formats[j] for j in args]
        if op == ca.OP_CONST:
            return self.at(i, bits)
        if op in (SCALE, INEXACT):
            return self.expression(args[0])
        if op in COMPARISONS:
            bits = min(self.formats[j] for j in args if nodes[j].op != ca.OP_CONST)
        kind = OPERATIONS.get(op)
        at = own if kind is None or kind.at == OWN else [min(kind.at, bits)] * len(args)
        if op in COMPARISONS:
            at = [bits] * len(args)
        texts = [
            self.expression(j) if self.logical[j] else self.at(j, k)
            for j, k in zip(args, at, strict=True)
        ]
        if op == ALIGN:
            return texts[0]
        if op in FORMS and op not in (ca.OP_MUL, ca.OP_DIV):
            pattern, binds, needs, _ = FORMS[op]
            operands = (one.within(least) for one, least in zip(texts, needs, strict=True))
            return Expression(pattern.format(*operands), binds)
        x = [one.text for one in texts]
        match op:
            case ca.OP_MUL:
                return self.call("mul", *x, sum(own) - bits)
            case ca.OP_DIV:
                return self.call("div", *x, bits - own[0] + own[1])
            case _ if op in FOLLOWED:
                name, most = FOLLOWED[op]
                at = min(own[0], most)
                return self.call(name, self.at(args[0], at).text, at)
            case ca.OP_SQRT:
                return self.call("sqrt", *x, 2 * bits - own[0])
            case ca.OP_LOG:
                return self.call("mul", self.call("log2", *x, own[0]).text, 744261118, 56 - bits)
            case ca.OP_CONSTPOW:
                return self.call("pow", *x, own[0], round(value * 2**24), bits)
            case _ if op == CLAMP:
                x, shift = [self.expression(args[0]).text], min(bits - own[0], 32)
                return self.call("limit", *x, shift, ceil(value * 2.0**bits))
            case _:
                return self.call(NAMES[op], *x)

    def call(self, name: str, *arguments: object) -> Expression:
        """Return the call of a function of `fixed.c`."""
        return Expression(f"{self.prefix}_{name}({', '.join(map(str, arguments))})", ATOM)

    def at(self, i: int, bits: int) -> Expression:
        """Return an integer in the format `bits`, rounded if this has fewer bits."""
        node = self.source.nodes[i]
        if node.op == ca.OP_CONST:
            value = round(node.value * 2.0**bits)
            return Expression(str(value), ATOM if value >= 0 else SIGN)
        shift = self.formats[i] - bits
        if shift > BITS:
            return Expression("0", ATOM)
        if shift > 0:
            return self.call("round", self.expression(i).text, shift)
        value = self.number(i)
        return value if shift == 0 else Expression(f"{value.within(ATOM)} * {1 << -shift}", PRODUCT)

    def number(self, i: int) -> Expression:
        """Return the value of a node as an integer."""
        return self.expression(i)

    def negation(self, i: int) -> Expression:
        """Return the negation of a bool."""
        return Expression(f"!{self.expression(i).within(ATOM)}", SIGN)

    def truth(self, i: int) -> Expression:
        """Return the value of a bool."""
        return self.expression(i)
