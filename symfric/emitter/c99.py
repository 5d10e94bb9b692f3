"""How CasADi's operations and numbers are written in C99."""

import math
from dataclasses import dataclass

import casadi as ca
import numpy as np

from symfric.foundation.graph import SELECT

TERNARY, LOGIC, EQUAL, ORDER, SUM, PRODUCT, SIGN, ATOM = range(1, 9)
"""How tightly a C expression binds."""


@dataclass(frozen=True)
class Real:
    """A floating point type of C.

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

    def literal(self, value: float) -> str:
        """The shortest literal that reads back as `value` rounded to this type.

        Raises:
            ValueError: NaN, or a number that overflows or vanishes in this type.
        """
        with np.errstate(over="ignore", under="ignore"):
            rounded = np.float32(value) if self.size == 4 else np.float64(value)
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
    """How an operation is written: `pattern` with operands that bind as tightly as `needs`.

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
    """How the operation `op` with `arity` operands is written."""
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
