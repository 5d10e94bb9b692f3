"""What rounding to a type makes of a block: its operations one by one in NumPy, in that type."""

from collections.abc import Callable
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.foundation.graph import SELECT, graph

Array = NDArray[Any]


def _twice(x: Array) -> Array:
    return x + x


OPERATIONS: dict[int, Callable[..., Any]] = {
    ca.OP_ADD: np.add,
    ca.OP_SUB: np.subtract,
    ca.OP_MUL: np.multiply,
    ca.OP_DIV: np.divide,
    ca.OP_NEG: np.negative,
    ca.OP_SQ: np.square,
    ca.OP_TWICE: _twice,
    ca.OP_INV: np.reciprocal,
    ca.OP_SIGN: np.sign,
    ca.OP_LT: np.less,
    ca.OP_LE: np.less_equal,
    ca.OP_EQ: np.equal,
    ca.OP_NE: np.not_equal,
    ca.OP_NOT: np.logical_not,
    ca.OP_AND: np.logical_and,
    ca.OP_OR: np.logical_or,
    ca.OP_FABS: np.abs,
    ca.OP_FMIN: np.fmin,
    ca.OP_FMAX: np.fmax,
    ca.OP_SQRT: np.sqrt,
    ca.OP_FLOOR: np.floor,
    ca.OP_CEIL: np.ceil,
    ca.OP_COPYSIGN: np.copysign,
    ca.OP_EXP: np.exp,
    ca.OP_EXPM1: np.expm1,
    ca.OP_LOG: np.log,
    ca.OP_LOG1P: np.log1p,
    ca.OP_POW: np.power,
    ca.OP_CONSTPOW: np.power,
    ca.OP_SIN: np.sin,
    ca.OP_COS: np.cos,
    ca.OP_TAN: np.tan,
    ca.OP_ASIN: np.arcsin,
    ca.OP_ACOS: np.arccos,
    ca.OP_ATAN: np.arctan,
    ca.OP_ATAN2: np.arctan2,
    ca.OP_SINH: np.sinh,
    ca.OP_COSH: np.cosh,
    ca.OP_TANH: np.tanh,
    ca.OP_ASINH: np.arcsinh,
    ca.OP_ACOSH: np.arccosh,
    ca.OP_ATANH: np.arctanh,
    ca.OP_HYPOT: np.hypot,
    ca.OP_FMOD: np.fmod,
}
"""Those of C99 that NumPy has, by CasADi's numbers."""


def in_type(
    function: ca.Function,
    arguments: list[Array],
    kind: str,
    random: np.random.Generator | None = None,
) -> Array | None:
    """The results of a function, below each other, with every operation rounded to a type.

    Args:
        function: of SX, with dense arguments and results.
        arguments: rows of numbers, shape (rows, size of the argument).
        kind: NumPy's name of the type, such as "f4".
        random: rounds each result that is not exact up or down by chance, one of the last bits on
            both sides of it, instead of to the nearest. What differs between runs is rounding.
            Source: Vignes, Mathematics and Computers in Simulation 35 (1993), CESTAC.

    Returns:
        Shape (rows, results), in double; None where NumPy lacks an operation (erf, remainder).
    """
    source, found = graph(function), list[Array]()
    count = len(arguments[0])
    with np.errstate(all="ignore"):
        for node in source.nodes:
            given = [found[i] for i in node.args]
            if node.op == ca.OP_INPUT:
                value = arguments[node.entry[0]][:, node.entry[1]]
            elif node.op == ca.OP_CONST:
                value = np.full(count, node.value)
            elif node.op in (SELECT, ca.OP_IF_ELSE_ZERO):
                value = np.where(given[0] != 0, given[1], given[2] if len(given) > 2 else 0.0)
            elif node.op not in OPERATIONS:
                return None
            elif random is None:
                value = OPERATIONS[node.op](*given)
            else:
                exact = np.asarray(OPERATIONS[node.op](*(x.astype(float) for x in given)), float)
                value = _up_or_down(exact, kind, random)
            found.append(np.asarray(value).astype(kind))
    return np.column_stack([found[i] for row in source.results for i in row]).astype(float)


def _up_or_down(exact: Array, kind: str, random: np.random.Generator) -> Array:
    """Numbers of the type on a side of each number taken by chance, or the number where it is one.

    The double nearest to a result of an operation on floats stands for the result itself.
    """
    nearest = exact.astype(kind)
    beyond = np.where(exact > nearest, np.inf, -np.inf).astype(kind)
    other = (exact != nearest) & (random.random(exact.shape) < 0.5)
    return np.where(other, np.nextafter(nearest, beyond), nearest)
