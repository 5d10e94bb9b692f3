"""Elementary functions of floats, NumPy arrays and CasADi matrices, and evaluation of Functions.

CasADi's elementary functions convert an array to a DM column, and those of NumPy convert a DM to an
array; laws written with the functions of this module keep the type of their arguments.
"""

import ctypes
import sys
from collections.abc import Callable, Iterable, Sequence
from math import erf as erf_of_float
from numbers import Real
from typing import Any, TypeVar, cast

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike, NDArray

from symfric.foundation.symbolic import Symbolic
from symfric.foundation.vector import Vector, VectorRows

Array = NDArray[np.float64]
Scalar = Any
"""Real number: float, NumPy array (element-wise), SX, MX or DM; in isotropic laws also `Vector`."""

_CASADI = (ca.SX, ca.MX, ca.DM, Symbolic)


def is_symbolic(value: Scalar) -> bool:
    """Return True if `value` contains a CasADi symbol; numerical checks then do not apply."""
    if isinstance(value, ca.SX):
        return not value.is_constant()
    return isinstance(value, ca.MX | Symbolic)


def is_casadi(*values: Scalar) -> bool:
    """Return True if any of `values` is a CasADi matrix or a `Symbolic` object."""
    return any(isinstance(value, _CASADI) for value in values)


def is_number(value: Scalar) -> bool:
    """Return True if `value` is an int, a float, a real NumPy scalar or a 0-d array.

    The result is False for an int that is too large for a float.
    """
    if isinstance(value, np.ndarray):
        return value.ndim == 0 and value.dtype.kind in "iuf"
    if isinstance(value, int) and value.bit_length() >= sys.float_info.max_exp:
        return False
    return not isinstance(value, bool | np.bool_) and isinstance(value, Real)


def equals(value: Scalar, number: float) -> bool:
    """Return True if `value` is a plain number equal to `number`.

    The result is False for a symbol. Use it to simplify an expression while it is built.
    """
    return is_number(value) and float(value) == number


def reciprocal(value: Scalar) -> Scalar:
    """Return 1 / value, bit for bit, in a form for use in several products.

    CasADi rewrites a product with 1 / x as a division by x, which would repeat the division.
    """
    return 2 * (0.5 / value)


def _dispatch(name: str, numpy_name: str | None = None) -> Callable[..., Any]:
    of_casadi: Callable[..., Any] = getattr(ca, name)
    of_numpy: Callable[..., Any] = getattr(np, numpy_name or name)

    def function(*args: Scalar) -> Scalar:
        if isinstance(args[0], Vector):
            return args[0].apply(function, name)
        return of_casadi(*args) if is_casadi(*args) else of_numpy(*args)

    function.__name__ = name
    function.__doc__ = f"`{name}` of floats, arrays, SX, MX or DM."
    return function


exp = _dispatch("exp")
log = _dispatch("log")
sqrt = _dispatch("sqrt")
sin = _dispatch("sin")
cos = _dispatch("cos")
tan = _dispatch("tan")
atan = _dispatch("atan", "arctan")
asin = _dispatch("asin", "arcsin")
tanh = _dispatch("tanh")
asinh = _dispatch("asinh", "arcsinh")
expm1 = _dispatch("expm1")
both = _dispatch("logic_and", "logical_and")
either = _dispatch("logic_or", "logical_or")

_erf_of_numbers = np.vectorize(erf_of_float, otypes=[float])


def erf(x: Scalar) -> Scalar:
    """Return the error function of floats, arrays, SX, MX or DM."""
    if isinstance(x, Vector):
        return x.apply(erf, "erf")
    return ca.erf(x) if is_casadi(x) else _erf_of_numbers(x)[()]


def column(*rows: Scalar) -> Scalar:
    """Stack `rows` into a column: shape (n, 1) for CasADi, (n, ...) for arrays."""
    if any(isinstance(row, Vector) for row in rows):
        return VectorRows(rows)
    if is_casadi(*rows):
        return ca.vertcat(*rows)
    return np.stack(np.broadcast_arrays(*rows)) if rows else np.zeros(0)


def empty(like: Scalar) -> Scalar:
    """Return the empty column of states of a stateless law: DM (0, 1), or an array (0, ...).

    An empty DM can be concatenated with SX and MX columns and adds no operations.
    """
    if isinstance(like, Vector):
        return VectorRows()
    return ca.DM(0, 1) if is_casadi(like) else np.zeros((0, *np.shape(like)))


def smallest(*values: Scalar) -> Scalar:
    """Return the smallest of `values`."""
    least = values[0]
    for value in values[1:]:
        least = ca.fmin(least, value) if is_casadi(least, value) else np.minimum(least, value)
    return least


def total(terms: Iterable[Scalar]) -> Scalar:
    """Return the sum of one or more `terms`, added in their order."""
    first, *rest = terms
    return sum(rest, start=first)


def evaluate(function: ca.Function, *arguments: Array) -> Array:
    """Return the first output of `function` as a flat array; arguments must be contiguous.

    This is five times faster than calling the Function, which copies each array to a matrix.
    """
    return evaluate_all(function, *arguments)[0].ravel(order="F")


def evaluate_all(function: ca.Function, *arguments: Array) -> list[Array]:
    """Return all outputs of `function` as matrices; outputs must be dense, see `evaluate`."""
    results = [np.zeros(function.size_out(i)[::-1]) for i in range(function.n_out())]
    bound(function, arguments, results)()
    return [result.T for result in results]


def bound(
    function: ca.Function, arguments: Sequence[Array], results: Sequence[Array]
) -> Callable[[], None]:
    """Return a call of `function` that reads and writes the given contiguous arrays in place."""
    buffer, call = cast(tuple[Any, Any], function.buffer())
    for place, arrays in ((buffer.set_arg, arguments), (buffer.set_res, results)):
        for i, array in enumerate(arrays):
            if array.size:
                place(i, memoryview(array.reshape(-1)))  # pyright: ignore

    def run(_alive: object = (function, buffer)) -> None:
        call()

    return run


class Buffered:
    """Calls of a Function with dense results, in buffers that are kept between calls.

    Threads and nested calls use separate buffers.
    """

    def __init__(self, function: ca.Function) -> None:
        self._function, self._spare = function, list[tuple[Any, list[Array], list[Array]]]()

    def __call__(self, *arguments: ArrayLike) -> list[Array]:
        """Return all results as flat arrays, matrices column by column."""
        try:
            call, given, results = self._spare.pop()
        except IndexError:
            f = self._function
            given = [np.zeros(f.numel_in(i)) for i in range(f.n_in())]
            results = [np.zeros(f.numel_out(i)) for i in range(f.n_out())]
            call = bound(f, given, results)
        for place, value in zip(given, arguments, strict=True):
            place[:] = value
        call()
        found = [result.copy() for result in results]
        self._spare.append((call, given, results))
        return found


def address(array: Array) -> int:
    """Return the memory address of the data of a contiguous array, for compiled code."""
    buffer: Any = array
    if buffer.flags.writeable and buffer.size:  # three times faster than below
        return ctypes.addressof(ctypes.c_char.from_buffer(buffer))
    return array.ctypes.data


def nonzeros(matrix: ca.SX) -> list[ca.SX]:
    """Return the structural nonzeros of a matrix, column by column."""
    found: Any = matrix.nonzeros()  # SX at run time
    return found


LEAVES = frozenset({ca.OP_INPUT, ca.OP_CONST})

Made = TypeVar("Made")


def walk(function: ca.Function, made: Callable[[int, list[Made]], Made]) -> list[list[Made]]:
    """Return a value for each nonzero of each result of an SX Function.

    Args:
        function: SX Function, whose instructions are processed in order.
        made: function that returns the value of instruction k, given the values of its operands;
            inputs and constants have no operands.
    """
    slots = dict[int, Made]()
    results = [dict[int, Made]() for _ in range(function.n_out())]
    for k in range(function.n_instructions()):
        op = function.instruction_id(k)
        into, of = function.instruction_output(k), function.instruction_input(k)
        if op == ca.OP_OUTPUT:
            results[into[0]][into[1]] = slots[of[0]]
        elif op == ca.OP_ASSIGN:
            slots[into[0]] = slots[of[0]]
        else:
            slots[into[0]] = made(k, [] if op in LEAVES else [slots[i] for i in of])
    return [[row[i] for i in range(len(row))] for row in results]


def applied(operation: int, operands: Sequence[ca.SX]) -> ca.SX:
    """Return the expression of one CasADi operation on its operands."""
    return (ca.SX.unary if len(operands) == 1 else ca.SX.binary)(operation, *operands)


NEAR = 1e-2
"""Largest |x| at which the series replaces the quotient; its next term is 4e-14 of the sum."""


def exp_phi1_phi2(x: ca.SX) -> tuple[ca.SX, ca.SX, ca.SX]:
    """Return exp x, phi1 = (exp(x) - 1) / x and phi2 = (phi1 - 1) / x, element by element.

    They are the weights of the rate in the end value and in the mean of a solution of
    dz/dt = a + b z over a step: z(h) = z + h phi1(b h) dz/dt, mean z = z + h phi2(b h) dz/dt.
    Values and derivatives are also correct at zero. Far below zero, exp is 0; its error is one unit
    in the last place of 1, not of exp itself.
    """
    near = ca.fabs(x) < NEAR
    divisor, beyond = ca.if_else(near, 1.0, x), ca.expm1(x)
    quotient = beyond / divisor
    series = 1 / 2 + x * (1 / 6 + x * (1 / 24 + x * (1 / 120 + x * (1 / 720))))
    phi2 = ca.if_else(near, series, (quotient - 1) / divisor)
    phi1 = ca.if_else(near, 1 + x * phi2, quotient)
    return ca.if_else(near, 1 + x * phi1, 1 + beyond), phi1, phi2
