"""C99 for CasADi's numbers, operations and expressions."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.emitter.logic import OPPOSITE
from symfric.foundation.graph import SELECT, Graph, Node

TERNARY, LOGIC, EQUAL, ORDER, SUM, PRODUCT, SIGN, ATOM = range(1, 9)
"""How tightly a C expression binds."""


@dataclass(frozen=True)
class Real:
    """Floating point type of C.

    Attributes:
        name: in C.
        suffix: ending of the names of types and functions.
        letter: ending of literals and of the functions of math.h.
        size: bytes.
    """

    name: str
    suffix: str
    letter: str
    size: int

    @property
    def kind(self) -> Any:
        """Same type in NumPy."""
        return np.float32 if self.size == 4 else np.float64

    def rounded(self, values: object) -> NDArray[np.float64]:
        """Numbers rounded to this type, as doubles."""
        with np.errstate(over="ignore", under="ignore", invalid="ignore"):
            return np.asarray(values, float).astype(self.kind).astype(float)

    def literal(self, value: float) -> str:
        """Return the shortest literal that reads back as `value` rounded to this type.

        Raises:
            ValueError: NaN, or a number that overflows or vanishes in this type.
        """
        with np.errstate(over="ignore", under="ignore"):
            rounded = self.kind(value)
        if math.isnan(value) or (math.isinf(rounded) and not math.isinf(value)):
            raise ValueError(
                f"codegen: expected constants within the range of {self.name}, got {value!r}"
            )
        if rounded == 0.0 and value != 0.0:
            raise ValueError(
                f"codegen: expected constants within the range of {self.name}, got {value!r}, "
                "which would become 0"
            )
        if math.isinf(value):
            return f"{'-' if value < 0 else ''}HUGE_VAL{self.letter.upper()}"
        if rounded == 0.0 or 1e-4 <= abs(rounded) < 1e7:
            return np.format_float_positional(rounded, trim="0") + self.letter
        return np.format_float_scientific(rounded, trim="0", exp_digits=1) + self.letter


DOUBLE = Real("double", "f64", "", 8)
FLOAT = Real("float", "f32", "f", 4)
REALS = {real.name: real for real in (DOUBLE, FLOAT)}


@dataclass(frozen=True)
class Form:
    """C text of an operation: `pattern` with operands that bind as tightly as `needs`.

    Attributes:
        logical: the result is a bool.
        conditions: leading operands that are bools.
    """

    pattern: str
    binds: int
    needs: tuple[int, ...]
    logical: bool = False
    conditions: int = 0


FORMS: dict[int, Form] = {
    ca.OP_ADD: Form("{} + {}", SUM, (SUM, PRODUCT)),
    ca.OP_SUB: Form("{} - {}", SUM, (SUM, PRODUCT)),
    ca.OP_MUL: Form("{} * {}", PRODUCT, (PRODUCT, SIGN)),
    ca.OP_DIV: Form("{} / {}", PRODUCT, (PRODUCT, SIGN)),
    ca.OP_NEG: Form("-{}", SIGN, (ATOM,)),
    ca.OP_SQ: Form("{0} * {0}", PRODUCT, (ATOM,)),
    ca.OP_TWICE: Form("{two} * {}", PRODUCT, (SIGN,)),
    ca.OP_INV: Form("{one} / {}", PRODUCT, (SIGN,)),
    ca.OP_SIGN: Form("{0} > {zero} ? {one} : ({0} < {zero} ? -{one} : {0})", TERNARY, (ATOM,)),
    ca.OP_LT: Form("{} < {}", ORDER, (SUM, SUM), logical=True),
    ca.OP_LE: Form("{} <= {}", ORDER, (SUM, SUM), logical=True),
    ca.OP_EQ: Form("{} == {}", EQUAL, (SUM, SUM), logical=True),
    ca.OP_NE: Form("{} != {}", EQUAL, (SUM, SUM), logical=True),
    ca.OP_NOT: Form("!{}", SIGN, (ATOM,), logical=True, conditions=1),
    ca.OP_AND: Form("{} && {}", LOGIC, (EQUAL, EQUAL), logical=True, conditions=2),
    ca.OP_OR: Form("{} || {}", LOGIC, (EQUAL, EQUAL), logical=True, conditions=2),
    SELECT: Form("{} ? {} : {}", TERNARY, (LOGIC, LOGIC, LOGIC), conditions=1),
}

CHEAP = {
    ca.OP_FABS: "fabs",
    ca.OP_SQRT: "sqrt",
    ca.OP_FLOOR: "floor",
    ca.OP_CEIL: "ceil",
    ca.OP_COPYSIGN: "copysign",
}
"""Functions of math.h that are an instruction or a few on most processors."""

TRANSCENDENTAL = {
    ca.OP_EXP: "exp",
    ca.OP_EXPM1: "expm1",
    ca.OP_LOG: "log",
    ca.OP_LOG1P: "log1p",
    ca.OP_POW: "pow",
    ca.OP_CONSTPOW: "pow",
    ca.OP_SIN: "sin",
    ca.OP_COS: "cos",
    ca.OP_TAN: "tan",
    ca.OP_ASIN: "asin",
    ca.OP_ACOS: "acos",
    ca.OP_ATAN: "atan",
    ca.OP_ATAN2: "atan2",
    ca.OP_SINH: "sinh",
    ca.OP_COSH: "cosh",
    ca.OP_TANH: "tanh",
    ca.OP_ASINH: "asinh",
    ca.OP_ACOSH: "acosh",
    ca.OP_ATANH: "atanh",
    ca.OP_ERF: "erf",
    ca.OP_HYPOT: "hypot",
    ca.OP_FMOD: "fmod",
    ca.OP_REMAINDER: "remainder",
}
"""Functions of math.h that cost tens of instructions."""

FUNCTIONS = CHEAP | TRANSCENDENTAL


def form(op: int, arity: int, real: Real) -> Form:
    """C text of the operation `op` with `arity` operands."""
    if op in FORMS:
        return FORMS[op]
    operands = ", ".join(["{}"] * arity)
    function = f"{FUNCTIONS[op]}{real.letter}" if op in CHEAP else macro(FUNCTIONS[op], real)
    return Form(f"{function}({operands})", ATOM, (TERNARY,) * arity)


def macro(function: str, real: Real) -> str:
    """Name of the macro through which the generated code calls a transcendental function."""
    return f"SF_{function}{real.letter}".upper()


def operation_name(op: int) -> str:
    """CasADi's name of an operation, in lower case."""
    return next(
        name[3:].lower() for name in dir(ca) if name.startswith("OP_") and getattr(ca, name) == op
    )


SMALLEST_FLOAT = float(np.finfo(np.float32).tiny)
"""What keeps a divisor from zero in single precision where in double a smaller number does."""


def representable(whole: Graph, real: Real) -> Graph:
    """Constants that vanish in single precision as the smallest ones that do not.

    What a robot's file holds as 1e-67 instead of 0 is no reason to refuse it, and what divides must
    not become 0.
    """

    def one(node: Node) -> Node:
        if not 0.0 < abs(node.value) < SMALLEST_FLOAT:
            return node
        return replace(node, value=float(np.copysign(SMALLEST_FLOAT, node.value)))

    return whole if real.size == 8 else Graph(tuple(map(one, whole.nodes)), whole.results)


@final
@dataclass(frozen=True)
class Expression:
    """Text and how tightly it binds."""

    text: str
    binds: int

    def within(self, least: int) -> str:
        """Return the text, in parentheses where it binds less tightly than `least`."""
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
        """Return the value of a node, as it is."""
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
        """Return the value of a node; a bool as the number 1 or 0 that CasADi means."""
        value = self.expression(i)
        if not self.logical[i]:
            return value
        one, zero = self.constants["one"], self.constants["zero"]
        return Expression(f"{value.within(LOGIC)} ? {one} : {zero}", TERNARY)

    def negation(self, i: int) -> Expression:
        """Return the opposite of a bool."""
        node = self.source.nodes[i]
        if i not in self.names and node.op in OPPOSITE:
            return self._operation(i, OPPOSITE[node.op])
        if i not in self.names and node.op == ca.OP_NOT:
            return self.expression(node.args[0])
        return Expression(f"!{self.expression(i).within(ATOM)}", SIGN)

    def truth(self, i: int) -> Expression:
        """Return the value of a node that is a bool or one of the numbers 1 and 0."""
        node = self.source.nodes[i]
        if node.op == ca.OP_CONST:
            return Expression("true" if node.value else "false", ATOM)
        return self.expression(i)


MIRRORED = {ca.OP_LT: "{} > {}", ca.OP_LE: "{} >= {}", ca.OP_EQ: "{} == {}", ca.OP_NE: "{} != {}"}
"""Comparisons read from the right: x > 0 and not 0 < x."""
