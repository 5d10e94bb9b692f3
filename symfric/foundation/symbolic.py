"""Base class of objects that represent a symbol in CasADi functions and in arithmetic."""

import operator
from collections.abc import Callable, Mapping
from dataclasses import fields, replace
from typing import Any, TypeVar, final

import casadi as ca
import numpy as np

EXPRESSIONS = (ca.SX, ca.MX, ca.DM, int, float, np.generic, np.ndarray)
"""Types whose equality with a symbolic object is an expression."""
ORDERS = (operator.lt, operator.le, operator.gt, operator.ge)


T = TypeVar("T")


def plain(value: Any) -> Any:
    """Return `value` with symbolic objects, also in containers, replaced by their symbols."""
    if isinstance(value, Symbolic):
        return value.symbol
    if isinstance(value, Equality):
        return ca.SX(value)
    if type(value) in (list, tuple):
        return type(value)(map(plain, value))
    if isinstance(value, Mapping) and any(isinstance(v, Symbolic) for v in value.values()):
        return {name: plain(v) for name, v in value.items()}
    return value


def take_symbols(given: object, *names: str) -> None:
    """Replace symbolic objects in the named fields of a frozen dataclass by their symbols."""
    for name in names:
        object.__setattr__(given, name, plain(getattr(given, name)))


def with_symbols(given: T) -> T:
    """Return a frozen dataclass with symbolic objects in its fields replaced by their symbols."""
    known = {item.name: getattr(given, item.name) for item in fields(given)}  # pyright: ignore
    changed = {name: plain(value) for name, value in known.items() if _stands(value)}
    return replace(given, **changed) if changed else given  # pyright: ignore


def _stands(value: Any) -> bool:
    if isinstance(value, list | tuple):
        return any(map(_stands, value))
    return isinstance(value, Symbolic)


def _written(operate: Callable[..., Any], *operands: Any) -> Any:
    """Return the expression of an operator with the given operands."""
    if any(isinstance(value, ca.MX) for value in operands):
        name = next(value.symbol for value in operands if isinstance(value, Symbolic))
        raise ValueError(
            f"variable '{name}': expected SX or numbers as operands, got MX; models are written "
            "with casadi.SX, and Opti takes them through model.function(...), flow or stepper"
        )
    found = operate(*map(plain, operands))
    return SymbolicComparison(found) if operate in ORDERS and type(found) is ca.SX else found


@final
class SymbolicComparison(ca.SX):
    """Comparison with a symbol; `if`, `and` and `max` of Python raise an error for it."""

    def __bool__(self) -> bool:
        if self.is_constant():
            return bool(ca.SX(self))
        raise ValueError(
            f"expected a number, got the condition {self}, which is true or false only once its "
            "symbols have values; write casadi.if_else(condition, a, b)"
        )


Operator = Callable[["Symbolic", Any], Any]


def _both(operate: Callable[..., Any]) -> tuple[Operator, Operator]:
    """Return the methods of an operator with the object on the left and on the right."""
    return (
        lambda self, other: _written(operate, self, other),
        lambda self, other: _written(operate, other, self),
    )


class Symbolic:
    """Object with an SX symbol, which represents the object in equations.

        ca.sin(v),  ca.vertcat(s, v),  50 * s - v**2,  np.array([1.0, 2.0]) * v,  v > 0,  v == 0

    are SX. For two of these objects, `==` is True if they are the same object, and an expression
    where CasADi uses the result, as in `ca.if_else(v == s, ...)`. The objects can therefore be
    found in tuples and used as dictionary keys.

    Raises:
        ValueError: the other operand of an operator is MX.
    """

    symbol: ca.SX

    def __SX__(self) -> ca.SX:
        return self.symbol

    __add__, __radd__ = _both(operator.add)
    __sub__, __rsub__ = _both(operator.sub)
    __mul__, __rmul__ = _both(operator.mul)
    __truediv__, __rtruediv__ = _both(operator.truediv)
    __floordiv__, __rfloordiv__ = _both(operator.floordiv)
    __mod__, __rmod__ = _both(operator.mod)
    __pow__, __rpow__ = _both(operator.pow)
    __matmul__, __rmatmul__ = _both(operator.matmul)
    __lt__, __le__ = _both(operator.lt)[0], _both(operator.le)[0]
    __gt__, __ge__ = _both(operator.gt)[0], _both(operator.ge)[0]

    def __neg__(self) -> ca.SX:
        return -self.symbol

    def __pos__(self) -> ca.SX:
        return self.symbol

    def __abs__(self) -> ca.SX:
        return ca.fabs(self.symbol)

    def __eq__(self, other: object) -> Any:
        return _compared(operator.eq, self, other)

    def __ne__(self, other: object) -> Any:
        return _compared(operator.ne, self, other)

    __hash__ = object.__hash__

    def __array_ufunc__(self, ufunc: Any, method: str, *given: Any, **named: Any) -> Any:
        return getattr(ufunc, method)(*map(plain, given), **named)

    def __array_function__(
        self, function: Callable[..., Any], _: Any, given: Any, named: Mapping[str, Any]
    ) -> Any:
        return function(*map(plain, given), **named)


@final
class Equality:
    """Result of `a == b` or `a != b` for symbolic objects: a bool, and an expression in CasADi."""

    __slots__ = ("a", "b", "compare")

    def __init__(self, compare: Callable[..., Any], a: Symbolic, b: Symbolic) -> None:
        self.compare, self.a, self.b = compare, a, b

    def __bool__(self) -> bool:
        return self.compare(id(self.a), id(self.b))

    def __SX__(self) -> ca.SX:
        return ca.SX(self.compare(self.a.symbol, self.b.symbol))

    def __repr__(self) -> str:
        return repr(bool(self))


def _compared(compare: Callable[..., Any], this: Symbolic, other: object) -> Any:
    if isinstance(other, Symbolic):
        return Equality(compare, this, other)
    return _written(compare, this, other) if isinstance(other, EXPRESSIONS) else NotImplemented
