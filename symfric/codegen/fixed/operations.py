"""Operations of fixed-point C: ranges, sensitivities, errors and formats."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import ceil, e, inf, log, log2, pi
from typing import Any, final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.emitter.logic import COMPARISONS
from symfric.foundation.graph import Node

CLAMP, ALIGN, SCALE, INEXACT, DECAY, PHI1, PHI2 = range(-2, -9, -1)
"""Operations without counterpart in CasADi: clamp to +-value, change of format, product with a
power of two, the operand itself with a further error of `value` (both without code), and for x >= 0
exp(-x), (1 - exp(-x)) / x and (1 - PHI1(x)) / x."""

BITS = 30
"""Largest integers are 2^BITS, so that sums of two do not overflow."""
INVERSE, EXP, TANH, ATAN, SIN, LOG2, POWER = 1.1e-9, 3.1e-9, 3e-9, 1e-8, 6e-9, 1.1e-8, 5e-9
WEIGHT = 6e-9
"""Largest errors of the functions of `fixed.c` over all their arguments, found by exhaustion; that
of the inverse and the power of two relative, those of exp and tanh with the error of `LIMITS`."""

LIMITS = {ca.OP_EXP: 22.9, ca.OP_TANH: 11.5}
"""Arguments beyond which a function differs from its limit by at most 2.1e-10."""

Array = NDArray[Any]
Ends = tuple[Array, Array]
"""Lower and upper end of a range, in each box."""
Part = Array | float
OWN, RESULT = 1000, 1001
"""Formats of arguments: their own, or that of the result."""


def _one(*_: object) -> tuple[float]:
    return (1.0,)


@final
@dataclass(frozen=True)
class Operation:
    """Operation of fixed point on ranges x, y; y is x if there is one argument.

    Attributes:
        ends: function (value of the node, x, y) -> range.
        slopes: function (value, x, y) -> largest derivative by each argument.
        at: fractional bits of the arguments, or `OWN`, or `RESULT`; at most, for `FOLLOWED`.
        bits: fractional bits of the result; `OWN` if its range defines them.
        most: function (value, error of the first argument) -> largest error that this may cause.
        error: function (value, largest magnitude) -> error of the function.
        rounded: error of the result in its last bit.
        domain: arguments for which the C is correct.
    """

    ends: Callable[[float, Ends, Ends], Ends]
    slopes: Callable[[float, Ends, Ends], tuple[Part, ...]] = _one
    at: int = OWN
    bits: int = OWN
    most: Callable[[float, Array], Part] = lambda _, __: inf
    error: Callable[[float, Array], Part] = lambda _, __: 0.0
    rounded: float = 0.0
    domain: tuple[float, float] = (-inf, inf)


def bits_of(size: float) -> int:
    """Return the number of fractional bits with which |x| <= size is at most 2^BITS."""
    return BITS - ceil(log2(size) - 1e-12) if size > 0.0 else BITS


def _size(x: Ends) -> Array:
    return np.maximum(np.abs(x[0]), np.abs(x[1]))


def _least(x: Ends) -> Array:
    inside = (x[0] <= 0.0) & (x[1] >= 0.0)
    return np.where(inside, 0.0, np.minimum(np.abs(x[0]), np.abs(x[1])))


def _corners(corners: list[Array]) -> Ends:
    return np.minimum.reduce(corners), np.maximum.reduce(corners)


def _difference(_: float, x: Ends, y: Ends) -> Ends:
    return x[0] - y[1], x[1] - y[0]


def _product(_: float, x: Ends, y: Ends) -> Ends:
    low, high = _corners([a * b for a in x for b in y])
    return (_least(x) ** 2 if x is y else low), high


def _quotient(_: float, x: Ends, y: Ends) -> Ends:
    low, high = _corners([a / b for a in x for b in y])
    over = _least(y) == 0.0
    return np.where(over, -np.inf, low), np.where(over, np.inf, high)


def _sine(_: float, x: Ends, __: Ends) -> Ends:
    low, high = _corners([np.sin(x[0]), np.sin(x[1])])
    turns = np.ceil(x[0] / pi - 0.5) <= np.floor(x[1] / pi - 0.5)
    return np.where(turns, -1.0, low), np.where(turns, 1.0, high)


def _power(n: float, x: Ends, _: Ends) -> Ends:
    return _corners([np.maximum(end, 0.0) ** n for end in x])


def _power_error(n: float, size: Array) -> Array:
    """Return the error of s = x^n; an error d of n causes d s |log x| = (d / |n|) s |log s|."""
    quantised = abs(n - round(n * 2**24) / 2**24) / abs(n)
    own = abs(n) * LOG2 * log(2.0) + POWER + quantised * np.log(np.maximum(size, 1.0))
    return size * own + quantised / e


def _monotone(function: Callable[[Array], Array]) -> Callable[[float, Ends, Ends], Ends]:
    return lambda _, x, __: (function(x[0]), function(x[1]))


def _extreme(function: Callable[[Array, Array], Array]) -> Operation:
    return Operation(
        lambda _, x, y: (function(x[0], y[0]), function(x[1], y[1])),
        lambda _, __, ___: (1.0, 1.0),
        RESULT,
    )


def _weight(x: Array, order: int) -> Array:
    """Return exp(-x) or one of its weights; for small x, by a series of sufficient accuracy."""
    x = np.maximum(x, 0.0)
    found = np.exp(-x)
    for k in range(order):
        small = 1.0 - x / 2 + x * x / 6 if k == 0 else 0.5 - x / 6 + x * x / 24
        found = np.where(x < 1e-4, small, (1.0 - found) / np.maximum(x, 1e-4))
    return found


def _decay(order: int, error: float) -> Operation:
    """Return exp(-x) or one of its weights, whose slope is at most its own and 1, 1/2, 1/6."""
    steepest = (1.0, 1.0 / 2.0, 1.0 / 6.0)[order]
    return Operation(
        lambda _, x, __: (_weight(x[1], order), _weight(x[0], order)),
        lambda _, x, __: (np.minimum(_weight(x[0], order), steepest),),
        25, 30, error=lambda _, __: error, domain=(0.0, 2.0**29),
    )  # fmt: skip


def _positive(x: Array) -> Array:
    return np.maximum(x, 0.0)


OPERATIONS: dict[int, Operation] = {
    ca.OP_ADD: _extreme(np.add),
    ca.OP_SUB: replace(_extreme(np.add), ends=_difference),
    ca.OP_FMIN: _extreme(np.minimum),
    ca.OP_FMAX: _extreme(np.maximum),
    ca.OP_MUL: Operation(_product, lambda _, x, y: (_size(y), _size(x)), rounded=0.5),
    ca.OP_DIV: Operation(
        _quotient, lambda _, x, y: (1.0 / _least(y), _size(x) / _least(y) ** 2),
        error=lambda _, size: INVERSE * size, rounded=0.5,
    ),
    ca.OP_NEG: Operation(lambda _, x, __: (-x[1], -x[0])),
    ca.OP_FABS: Operation(lambda _, x, __: (_least(x), _size(x))),
    SCALE: Operation(lambda k, x, _: (k * x[0], k * x[1]), lambda k, _, __: (k,)),
    ALIGN: Operation(lambda _, x, __: x, at=RESULT),
    INEXACT: Operation(lambda _, x, __: x, error=lambda error, _: error),
    CLAMP: Operation(
        lambda most, x, _: (np.clip(x[0], -most, most), np.clip(x[1], -most, most)),
        at=RESULT, most=lambda most, _: 2.0 * most, rounded=1.0,
    ),
    ca.OP_EXP: Operation(
        _monotone(np.exp), lambda _, x, __: (np.exp(x[1]),), 25, 30, error=lambda _, __: EXP
    ),
    DECAY: _decay(0, EXP),
    PHI1: _decay(1, WEIGHT),
    PHI2: _decay(2, WEIGHT),
    ca.OP_TANH: Operation(
        _monotone(np.tanh), lambda _, x, __: (1.0 - np.tanh(_least(x)) ** 2,),
        26, 30, lambda _, __: 2.0, error=lambda _, __: TANH,
    ),
    ca.OP_SIN: Operation(_sine, at=28, bits=30, error=lambda _, __: SIN, domain=(-4.0, 4.0)),
    ca.OP_ATAN: Operation(
        _monotone(np.arctan), lambda _, x, __: (1.0 / (1.0 + _least(x) ** 2),),
        30, 29, error=lambda _, __: ATAN, domain=(-(2.0**29), 2.0**29),
    ),
    ca.OP_SQRT: Operation(
        lambda _, x, y: _power(0.5, x, y), lambda _, x, __: (0.5 / np.sqrt(_positive(x[0])),),
        most=lambda _, error: error**0.5, rounded=1.0, domain=(0.0, inf),
    ),
    ca.OP_LOG: Operation(
        _monotone(lambda x: np.log(_positive(x))), lambda _, x, __: (1.0 / _positive(x[0]),),
        error=lambda _, size: LOG2 + 2e-9 * size, rounded=0.5, domain=(0.0, inf),
    ),
    ca.OP_CONSTPOW: Operation(
        _power, lambda n, x, y: (abs(n) * _power(n - 1.0, x, y)[1],),
        most=lambda n, error: error**n if 0.0 < n < 1.0 else inf, error=_power_error,
        rounded=0.5, domain=(0.0, inf),
    ),
}  # fmt: skip
"""Operations of numbers."""
FOLLOWED = {ca.OP_ATAN: "atan", DECAY: "decay", PHI1: "phi1", PHI2: "phi2"}
"""Functions of `fixed.c` whose second argument is the format of the first."""


def operand_bits(nodes: Sequence[Node], formats: Sequence[int], i: int) -> list[int]:
    """Return the fractional bits in which the C of a node takes its arguments."""
    node, own = nodes[i], [formats[j] for j in nodes[i].args]
    if node.op in COMPARISONS:
        return [min(formats[j] for j in node.args if nodes[j].op != ca.OP_CONST)] * 2
    at = OPERATIONS[node.op].at if node.op in OPERATIONS else OWN
    if at == OWN:
        return own
    if node.op in FOLLOWED:
        return [min(at, own[0])]
    return [formats[i] if at == RESULT else at] * len(own)
