"""Frozen dataclasses as JSON and back, by the types of their fields.

Arrays become lists; numbers that are not finite become null where that reads back as NaN, else
"inf" and "-inf"; pairs as keys become two levels. Members of an `Enum` are their names.
"""

from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from enum import Enum
from math import inf, isnan, nan
from types import NoneType, UnionType
from typing import Any, Literal, Union, get_args, get_origin, get_type_hints

import numpy as np

INFINITE = {"inf": inf, "-inf": -inf}
DIGITS = 6
"""Digits of arrays: they are drawn, not computed with."""


def plain(value: Any) -> Any:
    """`value` as what JSON takes.

    Raises:
        TypeError: something that is neither a number, a text, a collection nor a dataclass.
    """
    if value is None or isinstance(value, str | bool | int):
        return value
    if isinstance(value, Enum):
        return value.name
    if isinstance(value, float | np.floating):
        return _number(float(value))
    if isinstance(value, np.integer | np.bool_):
        return value.item()
    if isinstance(value, np.ndarray):
        return _array(value)  # pyright: ignore[reportUnknownArgumentType]
    if isinstance(value, Mapping):
        return _mapping(value)  # pyright: ignore[reportUnknownArgumentType]
    if isinstance(value, list | tuple):
        return [plain(one) for one in value]  # pyright: ignore[reportUnknownVariableType]
    if is_dataclass(value):
        return {item.name: plain(getattr(value, item.name)) for item in fields(value)}
    raise TypeError(f"expected plain data, got {type(value).__name__}")


def _number(value: float) -> Any:
    if isnan(value):
        return None
    return str(value) if value in (inf, -inf) else value


def _array(value: np.ndarray[Any, Any]) -> Any:
    if value.ndim != 1 or value.dtype.kind != "f":
        return [plain(one) for one in value]
    return [_number(float(f"{x:.{DIGITS}g}")) for x in value.tolist()]


def _mapping(value: Mapping[Any, Any]) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for key, one in value.items():
        if isinstance(key, tuple):
            first, second = key  # pyright: ignore[reportUnknownVariableType]
            found.setdefault(str(first), {})[str(second)] = plain(one)  # pyright: ignore[reportUnknownArgumentType]
        else:
            found[str(key)] = plain(one)
    return found


def revived(kind: Any, data: Any) -> Any:
    """What `plain` wrote of a value of the type `kind`.

    Raises:
        ValueError, TypeError, KeyError: data that `plain` did not write of such a value.
    """
    origin, inner = get_origin(kind), get_args(kind)
    meant = getattr(origin or kind, "__value__", None)  # NDArray is an alias since NumPy 2.5
    if meant is not None:
        return revived(meant, data)
    if kind is Any or origin is Literal:
        return data
    if origin in (Union, UnionType):
        return _one_of(inner, data)
    if origin is tuple:
        if len(inner) == 2 and inner[1] is Ellipsis:
            return tuple(revived(inner[0], one) for one in data)
        return tuple(revived(t, one) for t, one in zip(inner, data, strict=True))
    if origin is list:
        return [revived(inner[0], one) for one in data]
    if origin is not None and isinstance(origin, type) and issubclass(origin, Mapping):
        if get_origin(inner[0]) is tuple:
            return {
                (a, b): revived(inner[1], v) for a, part in data.items() for b, v in part.items()
            }
        return {name: revived(inner[1], one) for name, one in data.items()}
    if kind is np.ndarray or origin is np.ndarray:
        return _revived_array(data)
    return _single(kind, data)


def _one_of(kinds: tuple[Any, ...], data: Any) -> Any:
    if data is None and NoneType in kinds:
        return None
    others = [kind for kind in kinds if kind is not NoneType]
    matching = [kind for kind in others if isinstance(kind, type) and isinstance(data, kind)]
    return revived((matching or others)[0], data)


def _revived_array(data: Any) -> Any:
    if data and isinstance(data[0], list):
        return np.array([_revived_array(row) for row in data])
    return np.array([_real(x) for x in data])


def _real(value: Any) -> Any:
    if value is None:
        return nan
    return INFINITE[value] if isinstance(value, str) else value


def _single(kind: Any, data: Any) -> Any:
    if isinstance(kind, type) and issubclass(kind, Enum):
        return kind[data]
    if is_dataclass(kind):
        hints = get_type_hints(kind)
        wanted = {item.name for item in fields(kind) if item.init}
        given = {name: revived(hints[name], one) for name, one in data.items() if name in wanted}
        return kind(**given)  # pyright: ignore[reportCallIssue]
    if kind is float:
        return float(_real(data))
    return data
