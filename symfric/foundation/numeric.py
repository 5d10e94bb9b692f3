"""Elementary functions that accept floats, NumPy arrays and CasADi SX, MX and DM; evaluation of
CasADi functions and walks through their instructions.

CasADi's own functions turn an array into a DM column, and NumPy's turn a DM into an array; a law
written with these keeps the type of its arguments.
"""

import ctypes
import sys
from collections.abc import Callable, Iterable, Sequence
from math import erf as erf_of_float
from numbers import Real
from typing import Any, TypeVar, cast

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.foundation.symbolic import Symbolic
from symfric.foundation.vector import Rows, Vector

Scalar = Any
"""Real number: float, NumPy array (element-wise), SX, MX or DM; a `Vector` where laws accept it."""

_CASADI = (ca.SX, ca.MX, ca.DM, Symbolic)


def is_symbolic(value: Scalar) -> bool:
    """Return True if `value` contains a CasADi symbol, so that numerical checks do not apply."""
    if isinstance(value, ca.SX):
        return not value.is_constant()
    return isinstance(value, ca.MX | Symbolic)


def is_casadi(*values: Scalar) -> bool:
    """Return True if any of `values` is a CasADi matrix, or stands for one."""
    return any(isinstance(value, _CASADI) for value in values)


def is_number(value: Scalar) -> bool:
    """Return True for a plain number: int, float, NumPy's scalars and 0-d arrays of them.

    An int too large for a float does not count.
    """
    if isinstance(value, np.ndarray):
        return value.ndim == 0 and value.dtype.kind in "iuf"
    if isinstance(value, int) and value.bit_length() >= sys.float_info.max_exp:
        return False
    return not isinstance(value, bool | np.bool_) and isinstance(value, Real)


def equals(value: Scalar, number: float) -> bool:
    """Return True if `value` is the plain number `number`, so that a special case may be built in.

    False for a symbol, whose value is unknown when the expression is built.
    """
    return is_number(value) and float(value) == number


def reciprocal(value: Scalar) -> Scalar:
    """Return 1 / value, bit for bit, for a value that divides several others.

    CasADi turns a product with 1 / x into a quotient by x, and so one division into many.
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
        return Rows(rows)
    if is_casadi(*rows):
        return ca.vertcat(*rows)
    return np.stack(np.broadcast_arrays(*rows)) if rows else np.zeros(0)


def empty(like: Scalar) -> Scalar:
    """Return the empty column of a stateless law: DM (0, 1), or an array (0, ...).

    Concatenation of a DM with SX and MX columns leaves no trace, so absent states cost nothing.
    """
    if isinstance(like, Vector):
        return Rows()
    return ca.DM(0, 1) if is_casadi(like) else np.zeros((0, *np.shape(like)))


def smallest(*values: Scalar) -> Scalar:
    """Return the smallest of `values`."""
    least = values[0]
    for value in values[1:]:
        least = ca.fmin(least, value) if is_casadi(least, value) else np.minimum(least, value)
    return least


def total(terms: Iterable[Scalar]) -> Scalar:
    """Return the sum of `terms`, at least one, in their order."""
    first, *rest = terms
    return sum(rest, start=first)


def evaluate(function: ca.Function, *arguments: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the first output of `function`, flat, at contiguous arrays, without conversions.

    Five times faster than calling the Function with arrays, which copies each into a matrix.
    """
    return evaluate_all(function, *arguments)[0].ravel(order="F")


def evaluate_all(
    function: ca.Function, *arguments: NDArray[np.float64]
) -> list[NDArray[np.float64]]:
    """Return all outputs of `function`, which must be dense, as matrices; see `evaluate`."""
    results = [np.zeros(function.size_out(i)[::-1]) for i in range(function.n_out())]
    bound(function, arguments, results)()
    return [result.T for result in results]


def bound(
    function: ca.Function,
    arguments: Sequence[NDArray[np.float64]],
    results: Sequence[NDArray[np.float64]],
) -> Callable[[], None]:
    """Bind `function` to contiguous arrays that CasADi reads and writes without copies."""
    buffer, call = cast(tuple[Any, Any], function.buffer())
    for place, arrays in ((buffer.set_arg, arguments), (buffer.set_res, results)):
        for i, array in enumerate(arrays):
            if array.size:
                place(i, memoryview(array.reshape(-1)))  # pyright: ignore

    def run(_alive: object = (function, buffer)) -> None:
        call()

    return run


def address(array: NDArray[np.float64]) -> int:
    """Return the address of the numbers of a contiguous array, for compiled code."""
    if array.flags.writeable and array.size:  # three times faster than below
        return ctypes.addressof(ctypes.c_char.from_buffer(cast(Any, array)))
    return array.ctypes.data


LEAVES = frozenset({ca.OP_INPUT, ca.OP_CONST})

Made = TypeVar("Made")


def walk(function: ca.Function, made: Callable[[int, list[Made]], Made]) -> list[list[Made]]:
    """Return the nonzeros of each result of an SX function, from its instructions in order.

    Args:
        function: of SX.
        made: value of instruction k from those of its operands, none for inputs and constants.
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
    """Apply one CasADi operation."""
    return (ca.SX.unary if len(operands) == 1 else ca.SX.binary)(operation, *operands)
