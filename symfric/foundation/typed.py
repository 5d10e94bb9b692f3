"""Values against type annotations: for objects whose fields come from a file."""

from collections.abc import Callable, Collection, Iterable, Mapping
from functools import cache
from types import NoneType, UnionType
from typing import Any, Literal, TypeVar, Union, get_args, get_origin, get_type_hints

import numpy as np

ANYTHING = object()


@cache
def hints_of(kind: Any) -> Mapping[str, Any]:
    """Return the resolved annotations of a class or function."""
    return get_type_hints(kind)


def fits(value: Any, hint: Any) -> bool:
    """Return True if `value` is of the annotated type, down to the members of containers.

    A float may be an int, an array has the annotated kind of numbers, and an object that stands
    for a protocol has its methods. `Any` and type variables accept everything.
    """
    origin, of = get_origin(hint), get_args(hint)
    kind = origin or hint
    kind = getattr(kind, "__value__", kind)  # NDArray is an alias since NumPy 2.5
    if kind is Any or isinstance(kind, TypeVar):
        return True
    if kind in (Union, UnionType):
        return any(fits(value, one) for one in of)
    if kind is Literal:
        return any(type(value) is type(one) and value == one for one in of)
    if kind is None or kind is NoneType:
        return value is None
    if kind is np.ndarray or get_origin(kind) is np.ndarray:
        return isinstance(value, np.ndarray) and _of_numbers(value, of)
    if kind is Callable or getattr(kind, "__name__", "") == "Callable":
        held: Any = vars(value).get("value", ANYTHING) if hasattr(value, "__dict__") else ANYTHING
        return callable(value) and (held is ANYTHING or fits(held, of[-1]))
    if getattr(kind, "_is_protocol", False) and not issubclass(kind, Collection):
        has = {*dir(type(value)), *getattr(value, "__dict__", ())}
        return has.issuperset(name for name in vars(kind) if not name.startswith("_"))
    if kind is float:
        return isinstance(value, float | int) and not isinstance(value, bool)
    if kind is int:
        return isinstance(value, int) and not isinstance(value, bool)
    if not isinstance(value, kind):
        return False
    if issubclass(kind, tuple) and of and of[-1] is not Ellipsis:
        return len(value) == len(of) and all(map(fits, value, of))
    if issubclass(kind, Mapping) and of:
        return _all(value, of[0]) and _all(value.values(), of[1])
    return not (isinstance(value, Collection) and of) or _all(value, of[0])


def _all(values: Iterable[Any], hint: Any) -> bool:
    return all(fits(value, hint) for value in values)


def _of_numbers(array: np.ndarray[Any, Any], of: tuple[Any, ...]) -> bool:
    """Return True if the array holds the annotated kind of numbers."""
    wanted: Any = (get_args(of[-1]) or of)[-1] if of else np.generic
    return not isinstance(wanted, type) or issubclass(array.dtype.type, wanted)


def agree(what: str, *conditions: bool) -> None:
    """Refuse an object out of a file whose fields contradict each other.

    Raises:
        ValueError: one of the conditions is False.
    """
    if not all(conditions):
        raise ValueError(f"{what}: expected fields that fit each other, got others")
