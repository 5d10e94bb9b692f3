"""C of a step with integers for the operations of `lowered`."""

from collections import Counter
from collections.abc import Mapping, Sequence
from math import ceil
from re import findall
from typing import final

import casadi as ca

from symfric.codegen.blocks.block import TEMPLATES, Block
from symfric.codegen.fixed.operations import (
    ALIGN,
    BITS,
    CLAMP,
    FOLLOWED,
    INEXACT,
    SCALE,
    operand_bits,
)
from symfric.emitter.c99 import (
    ATOM,
    FORMS,
    INTEGER,
    PRODUCT,
    SIGN,
    Expression,
    Formulas,
    filled,
    needed,
)
from symfric.emitter.emit import Code, StatementWriter
from symfric.emitter.logic import logical
from symfric.foundation.graph import Graph

NAMES = {
    ca.OP_EXP: "exp", ca.OP_TANH: "tanh", ca.OP_SIN: "sin", ca.OP_FABS: "abs", ca.OP_FMIN: "min",
    ca.OP_FMAX: "max",
}  # fmt: skip
"""Functions of `fixed.c` whose arguments are numbers in formats of their own."""
LARGEST = 2**31 - 1
"""Largest integer; a greater constant has no effect where it is compared or is a limit."""


@final
class IntegerWriter(Formulas):
    """Author of the statements of a step, with integers in the `formats` of their nodes.

    Attributes:
        prefix: beginning of the names of the functions of `fixed.c`.
        block: block with real numbers.
        limits: lowest and highest integer of each state and input by name.
    """

    def __init__(
        self, source: Graph, formats: Sequence[int], prefix: str, block: Block,
        limits: Mapping[str, tuple[int, int]],
    ) -> None:  # fmt: skip
        super().__init__(source, logical(source.nodes), INTEGER)
        self.formats, self.prefix, self.block, self.limits = formats, prefix, block, limits

    def code(self, targets: Sequence[Sequence[str]], loads: Mapping[tuple[int, int], str]) -> Code:
        """Return the statements; states and inputs are clamped to their ranges."""
        names = [[v.name for v in group] for group in self.block.groups.values()]

        def clamped(name: str, place: str) -> str:
            return self.call("clamp", place, *self.limits[name]).text

        given = {(i, j): clamped(names[i][j], place) for (i, j), place in loads.items()}
        body = StatementWriter(self.source, names, targets, self, given)
        own = [names[2][j] for i, j in sorted(body.used) if (i, j) not in loads]
        lines = [*(f"{name} = {clamped(name, name)};" for name in own), *body.region(0)]
        return Code(frozenset(body.used), tuple(lines), Counter(), 0)

    def helpers(self, text: str) -> str:
        """Return the functions and tables of `fixed.c` that `text` needs."""
        whole = filled(TEMPLATES / "fixed.c", name=self.prefix).rstrip().split("\n\n")
        return needed({findall(r"\nstatic .*?(\w+)[(\[]", part)[0]: part for part in whole}, text)

    def formula(self, i: int) -> Expression:
        """Return the formula of a node: a bool, or an integer in its format."""
        bits, node = self.formats[i], self.source.nodes[i]
        op, args, value = node.op, node.args, node.value
        if op == ca.OP_CONST:
            return self.at(i, bits)
        if op in (SCALE, INEXACT):
            return self.expression(args[0])
        own, at = [self.formats[j] for j in args], operand_bits(self.source.nodes, self.formats, i)
        if op == CLAMP:
            limit = min(ceil(value * 2.0**bits), LARGEST)
            return self.call("limit", self.expression(args[0]).text, min(bits - own[0], 32), limit)
        operands = [
            self.expression(j) if self.logical[j] else self.at(j, k)
            for j, k in zip(args, at, strict=True)
        ]
        if op == ALIGN:
            return operands[0]
        if op in FORMS and op not in (ca.OP_MUL, ca.OP_DIV):
            pattern, binds, needs, _ = FORMS[op]
            texts = (one.within(least) for one, least in zip(operands, needs, strict=True))
            return Expression(pattern.format(*texts), binds)
        x = [one.text for one in operands]
        match op:
            case ca.OP_MUL:
                return self.call("mul", *x, sum(own) - bits)
            case ca.OP_DIV:
                return self.call("div", *x, bits - own[0] + own[1])
            case ca.OP_SQRT:
                return self.call("sqrt", *x, 2 * bits - own[0])
            case ca.OP_LOG:
                return self.call("log", *x, own[0], 56 - bits)
            case ca.OP_CONSTPOW:
                return self.call("pow", *x, own[0], round(value * 2**24), bits)
            case _ if op in FOLLOWED:
                return self.call(FOLLOWED[op], *x, *at)
            case _:
                return self.call(NAMES[op], *x)

    def call(self, name: str, *arguments: object) -> Expression:
        """Return the call of a function of `fixed.c`."""
        return Expression(f"{self.prefix}_{name}({', '.join(map(str, arguments))})", ATOM)

    def at(self, i: int, bits: int) -> Expression:
        """Return an integer in the format `bits`, rounded if this has fewer bits."""
        node = self.source.nodes[i]
        if node.op == ca.OP_CONST:
            value = max(-LARGEST, min(round(node.value * 2.0**bits), LARGEST))
            return Expression(str(value), ATOM if value >= 0 else SIGN)
        shift = self.formats[i] - bits
        value = self.expression(i)
        if shift > BITS:  # 0, by a function so that the local of the value has a use
            return self.call("limit", value.text, -shift, 0)
        if shift > 0:
            return self.call("round", value.text, shift)
        return value if shift == 0 else Expression(f"{value.within(ATOM)} * {1 << -shift}", PRODUCT)
