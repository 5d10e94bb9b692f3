"""C99 and JavaScript text of CasADi's numbers, operations and expressions; comments, templates."""

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from re import search
from string import Template
from textwrap import wrap
from typing import Any, NamedTuple, final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.emitter.logic import OPPOSITE
from symfric.foundation.graph import SELECT, Graph, Node
from symfric.foundation.instructions import CODES

TERNARY, LOGIC, EQUAL, ORDER, SUM, PRODUCT, SIGN, ATOM = range(1, 9)
"""Precedence of C expressions."""


@dataclass(frozen=True)
class Real:
    """Floating-point type of C, or of JavaScript.

    Attributes:
        name: name in C.
        suffix: ending of the names of types and functions.
        letter: ending of literals and of the functions of math.h.
        size: size in bytes.
        script: True for JavaScript, whose declarations have no type.
        whole: True for integers.
    """

    name: str
    suffix: str
    letter: str
    size: int
    script: bool = False
    whole: bool = False

    @property
    def kind(self) -> Any:
        """The same type in NumPy."""
        if self.whole:
            return np.int32
        return np.float32 if self.size == 4 else np.float64

    def rounded(self, values: object) -> NDArray[np.float64]:
        """Return numbers rounded to this type, as doubles."""
        with np.errstate(over="ignore", under="ignore", invalid="ignore"):
            return np.asarray(values, float).astype(self.kind).astype(float)

    def literal(self, value: float) -> str:
        """Return the shortest literal that reads back as `value` rounded to this type.

        Raises:
            ValueError: NaN, or a number that overflows or vanishes in this type.
        """
        if self.whole:
            return f"{value:.0f}"
        with np.errstate(over="ignore", under="ignore"):
            rounded = self.kind(value)
        vanishes = bool(rounded == 0.0 and value != 0.0)
        if math.isnan(value) or vanishes or (math.isinf(rounded) and not math.isinf(value)):
            raise ValueError(
                f"codegen: expected constants within the range of {self.name}, got {value!r}"
                + ", which would become 0" * vanishes
            )
        if math.isinf(value):
            huge = "Infinity" if self.script else f"HUGE_VAL{self.letter.upper()}"
            return f"{'-' if value < 0 else ''}{huge}"
        if rounded == 0.0 or 1e-4 <= abs(rounded) < 1e7:
            return np.format_float_positional(rounded, trim="0") + self.letter
        return np.format_float_scientific(rounded, trim="0", exp_digits=1) + self.letter

    def declared(self, logical: bool = False, *, constant: bool = False) -> str:
        """Return the words before the name of a local, a number or a bool."""
        if self.script:
            return "const" if constant else "let"
        return "const " * constant + ("bool" if logical else self.name)

    def function(self, op: int) -> str:
        """Return the name by which generated code calls the function of an operation."""
        name = FUNCTIONS[op]
        if self.script:
            return SCRIPTED.get(name, f"Math.{name}")
        return f"{name}{self.letter}" if op in CHEAP else macro(name, self)


DOUBLE = Real("double", "f64", "", 8)
FLOAT = Real("float", "f32", "f", 4)
SCRIPT = Real("double", "js", "", 8, script=True)
INTEGER = Real("int32_t", "q31", "", 4, whole=True)
REALS = {real.name: real for real in (DOUBLE, FLOAT)}


class Form(NamedTuple):
    """C text of an operation: `pattern` with operands that bind as tightly as `needs`.

    Attributes:
        conditions: number of leading operands that are bools.
    """

    pattern: str
    binds: int
    needs: tuple[int, ...]
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
    ca.OP_LT: Form("{} < {}", ORDER, (SUM, SUM)),
    ca.OP_LE: Form("{} <= {}", ORDER, (SUM, SUM)),
    ca.OP_EQ: Form("{} == {}", EQUAL, (SUM, SUM)),
    ca.OP_NE: Form("{} != {}", EQUAL, (SUM, SUM)),
    ca.OP_NOT: Form("!{}", SIGN, (ATOM,), conditions=1),
    ca.OP_AND: Form("{} && {}", LOGIC, (EQUAL, EQUAL), conditions=2),
    ca.OP_OR: Form("{} || {}", LOGIC, (EQUAL, EQUAL), conditions=2),
    SELECT: Form("{} ? {} : {}", TERNARY, (LOGIC, LOGIC, LOGIC), conditions=1),
}

CHEAP = {CODES[name]: name for name in ("fabs", "sqrt", "floor", "ceil", "copysign")}
"""Functions of math.h that take one or a few instructions on most processors."""

TRANSCENDENTAL = {ca.OP_CONSTPOW: "pow"} | {
    CODES[name]: name
    for name in (
        *("exp", "expm1", "log", "log1p", "pow", "sin", "cos", "tan", "asin", "acos", "atan"),
        *("atan2", "sinh", "cosh", "tanh", "asinh", "acosh", "atanh", "erf", "hypot"),
        *("fmod", "remainder"),
    )
}
"""Functions of math.h that take tens of instructions."""

FUNCTIONS = CHEAP | TRANSCENDENTAL

SCRIPTED = {"fabs": "Math.abs"} | {
    name: name for name in ("copysign", "erf", "fmod", "pow", "remainder")
}
"""Functions of math.h that JavaScript names otherwise, or has in `functions.js` only."""


def form(op: int, arity: int, real: Real) -> Form:
    """Return the text of the operation `op` with `arity` operands."""
    if op in FORMS:
        return FORMS[op]
    operands = ", ".join(["{}"] * arity)
    return Form(f"{real.function(op)}({operands})", ATOM, (TERNARY,) * arity)


def macro(function: str, real: Real) -> str:
    """Return the macro through which generated code calls a transcendental function."""
    return f"SF_{function}{real.letter}".upper()


def operation_name(op: int) -> str:
    """Return CasADi's name of an operation, in lower case."""
    names = (name for name in dir(ca) if name.startswith("OP_"))
    return next(name[3:].lower() for name in names if getattr(ca, name) == op)


SMALLEST_FLOAT = float(np.finfo(np.float32).tiny)
"""Smallest normal number in single precision."""


def representable(whole: Graph, real: Real) -> Graph:
    """Return the graph without constants that vanish in single precision.

    They become the smallest normal number of their sign: robot files contain 1e-67 for 0, and a
    divisor must not become 0.
    """

    def kept(node: Node) -> Node:
        if not 0.0 < abs(node.value) < SMALLEST_FLOAT:
            return node
        return replace(node, value=float(np.copysign(SMALLEST_FLOAT, node.value)))

    return whole if real.size == 8 else Graph(tuple(map(kept, whole.nodes)), whole.results)


class Expression(NamedTuple):
    """Text of an expression and its precedence."""

    text: str
    binds: int

    def within(self, least: int) -> str:
        """Return the text, in parentheses if it binds less tightly than `least`."""
        return self.text if self.binds >= least else f"({self.text})"


class Formulas(ABC):
    """Writer of nodes as C formulas, in which other nodes appear by name.

    Attributes:
        names: names of nodes.
        logical: for each node, True if it is a bool.
        real: type of the numbers.
    """

    def __init__(self, source: Graph, logical: list[bool], real: Real) -> None:
        self.source, self.logical, self.real = source, logical, real
        self.names: dict[int, str] = {}

    def expression(self, i: int) -> Expression:
        """Return the value of a node, a bool or a number."""
        return Expression(self.names[i], ATOM) if i in self.names else self.formula(i)

    @abstractmethod
    def formula(self, i: int) -> Expression:
        """Return the formula of a node without a name."""

    def number(self, i: int) -> Expression:
        """Return the value of a node as a number."""
        return self.expression(i)

    def negation(self, i: int) -> Expression:
        """Return the negation of a bool."""
        return Expression(f"!{self.expression(i).within(ATOM)}", SIGN)

    def truth(self, i: int) -> Expression:
        """Return the value of a node as a bool."""
        return self.expression(i)


@final
class Writer(Formulas):
    """Writer of formulas of floating-point numbers."""

    def __init__(self, source: Graph, logical: list[bool], real: Real) -> None:
        super().__init__(source, logical, real)
        values = {"zero": 0.0, "one": 1.0, "two": 2.0}
        self.constants = {name: real.literal(value) for name, value in values.items()}

    def formula(self, i: int) -> Expression:
        """Return a literal, or the formula of an operation."""
        node = self.source.nodes[i]
        if node.op == ca.OP_CONST:
            text = self.real.literal(node.value)
            return Expression(text, SIGN if text.startswith("-") else ATOM)
        return self._operation(i, node.op)

    def _operation(self, i: int, op: int) -> Expression:
        """Return the operation `op` on the operands of node `i`."""
        args = self.source.nodes[i].args
        pattern, binds, needs, conditions = form(op, len(args), self.real)
        plain = len(args) if op == SELECT and self.logical[i] else conditions
        operands = [(self.expression if k < plain else self.number)(j) for k, j in enumerate(args)]
        if op in MIRRORED and self.source.nodes[args[0]].op == ca.OP_CONST:
            operands.reverse()
            pattern = MIRRORED[op]
        texts = (operand.within(least) for operand, least in zip(operands, needs, strict=True))
        return Expression(pattern.format(*texts, **self.constants), binds)

    def number(self, i: int) -> Expression:
        """Return the value of a node as a number; a bool becomes 1 or 0."""
        value = self.expression(i)
        if not self.logical[i]:
            return value
        one, zero = self.constants["one"], self.constants["zero"]
        return Expression(f"{value.within(LOGIC)} ? {one} : {zero}", TERNARY)

    def negation(self, i: int) -> Expression:
        """Return the negation of a bool, without `!` where possible."""
        node = self.source.nodes[i]
        if i not in self.names and node.op in OPPOSITE:
            return self._operation(i, OPPOSITE[node.op])
        if i not in self.names and node.op == ca.OP_NOT:
            return self.expression(node.args[0])
        return super().negation(i)

    def truth(self, i: int) -> Expression:
        """Return the value of a node (a bool, or the number 1 or 0) as a bool."""
        node = self.source.nodes[i]
        if node.op == ca.OP_CONST:
            return Expression("true" if node.value else "false", ATOM)
        return self.expression(i)


MIRRORED = {ca.OP_LT: "{} > {}", ca.OP_LE: "{} >= {}", ca.OP_EQ: "{} == {}", ca.OP_NE: "{} != {}"}
"""Comparisons that move a constant from the left to the right, such as x > 0 for 0 < x."""


WIDTH = 100
"""Largest width of a line [columns]."""


class _AtTemplate(Template):
    """Template with placeholders @name, since $ has a meaning in CMake."""

    delimiter = "@"


def filled(template: Path, **values: object) -> str:
    """Return the text of a template file with a value in each placeholder @name."""
    return _AtTemplate(template.read_text(encoding="utf-8")).substitute(values)


def needed(parts: dict[str, str], text: str) -> str:
    """Return the `parts`, by the name that they define, that `text` or a later one of them uses."""
    found = ""
    for name, part in reversed(parts.items()):
        if search(rf"\b{name}\b", text + found):
            found = f"{part}\n\n{found}"
    return found


def indented(lines: Sequence[str], depth: int = 1) -> str:
    """Return lines of C, indented by `depth` levels."""
    return "\n".join("    " * depth + line for line in lines)


def block_comment(lines: Sequence[str]) -> str:
    """Return lines of text as one C comment."""
    return "/* " + "\n".join(f" * {comment(line)}".rstrip() for line in lines)[3:] + "\n */"


def comment(text: str) -> str:
    """Return `text` without character pairs that begin or end a C comment."""
    return text.replace("*/", "* /").replace("/*", "/ *")


def folded(line: str, margin: str) -> str:
    """Return a long line wrapped at blanks; the continuation lines are indented further."""
    text = line.lstrip(" ")
    margin += " " * (len(line) - len(text))
    lines = wrap(
        text, WIDTH, initial_indent=margin, subsequent_indent=f"{margin}    ",
        break_long_words=False, break_on_hyphens=False,
    )  # fmt: skip
    return "\n".join(lines)
