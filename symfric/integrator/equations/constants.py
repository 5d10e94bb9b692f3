"""Numbers in an expression as data: another amplitude then means no other equations.

Each number becomes a symbol where it is read; what is left is the structure. Exponents of constant
powers stay, as they are structure: x^2 is x x, and x^0.5 has no slope at 0.

Limits: what CasADi leaves out is no number any more: sin(t) for 1 sin(t), 0 for 0 sin(t).
"""

from math import isfinite
from typing import Any, cast

import casadi as ca
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
MOST = 1000
"""Expressions with more numbers are tables, and stay as they are."""


def lifted(expression: ca.SX, known: ca.SX, name: str) -> tuple[ca.SX, ca.SX, Array]:
    """A scalar expression with symbols for its numbers, these symbols, and the numbers.

    Evaluated there it gives the same bits: the operations are the same, in the same order.

    Args:
        expression: in the symbols `known`.
        known: column of symbols.
        name: how the new symbols begin.
    """
    as_it_is = expression, ca.SX(0, 1), np.zeros(0)
    function = ca.Function("lift", [known], [expression])
    numbers, symbols = list[float](), list[ca.SX]()
    work: dict[int, ca.SX | float] = {}

    def number(value: float) -> ca.SX:
        numbers.append(value)
        symbols.append(ca.SX.sym(f"{name}_c{len(symbols)}"))
        return symbols[-1]

    def read(place: int) -> ca.SX:
        value = work[place]
        return number(value) if isinstance(value, float) and isfinite(value) else ca.SX(value)

    made = ca.SX(expression)
    for k in range(function.n_instructions()):
        op = function.instruction_id(k)
        places, to = function.instruction_input(k), function.instruction_output(k)
        if op == ca.OP_OUTPUT:
            made = read(places[0])
        elif op == ca.OP_INPUT:
            work[to[0]] = ca.SX(known[places[1]])
        elif op == ca.OP_CONST:
            work[to[0]] = float(function.instruction_constant(k))
        elif op == ca.OP_CONSTPOW:
            work[to[0]] = _applied(op, read(places[0]), ca.SX(work[places[1]]))
        elif op == ca.OP_TWICE:  # what CasADi makes of 2 x
            two, other = number(2.0), read(places[0])
            work[to[0]] = two * other
        elif len(places) in (1, 2) and len(to) == 1:
            work[to[0]] = _applied(op, *(read(place) for place in places))
        else:
            return as_it_is
    if len(numbers) > MOST:
        return as_it_is
    return made, ca.vertcat(ca.SX(0, 1), *symbols), np.array(numbers)


def _applied(op: int, *arguments: ca.SX) -> ca.SX:
    """One operation of CasADi's."""
    SX = cast(Any, ca.SX)
    return ca.SX(SX.unary(op, *arguments) if len(arguments) == 1 else SX.binary(op, *arguments))
