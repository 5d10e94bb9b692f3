"""Classes that a file may name, and the check of their fields against their annotations."""

import tomllib
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import MISSING, Field, fields
from functools import cache, cached_property
from importlib import import_module
from pathlib import Path
from types import NoneType, UnionType
from typing import Any, Literal, TypeVar, Union, get_args, get_origin, get_type_hints

import numpy as np

OWN = ("symfric", "ocp", "identification")
"""Packages whose classes are known."""
OURS = tuple(f"{package}{mark}" for package in OWN for mark in ".:")


def path_of(named: Any) -> str:
    """Return module and name of a class or function."""
    return f"{named.__module__}:{named.__qualname__}"


@cache
def names() -> Mapping[str, Any]:
    """Return "modules", whose classes a file may name, and "moved", their older names."""
    return tomllib.loads(Path(__file__).with_name("stored_names.toml").read_text("utf-8"))


def current(path: str) -> str:
    """Return the present path of a class or function that a file may name by an older one."""
    place, _, name = path.partition(":")
    return f"{names()['moved'].get(place, place)}:{name}"


def found_at(path: str) -> Any:
    """Return the class or function of this path.

    Raises:
        ImportError, AttributeError, ValueError: there is none.
    """
    place, _, name = path.partition(":")
    found: Any = import_module(place)
    for part in name.split("."):
        found = getattr(found, part)
    return found


def may_hold(path: str) -> bool:
    """Return True if a file may name this class: one of "modules", or of another package."""
    inside = (path.startswith(m if m.endswith(".") else f"{m}:") for m in names()["modules"])
    return not path.startswith(OURS) or any(inside)


def checked(kind: type, values: dict[str, Any]) -> dict[str, Any]:
    """Return the checked fields of a symfric class, with defaults for missing ones."""
    known = {item.name: item for item in fields(kind)}
    for name, value in values.items():
        hint = _hint(kind, known.get(name), name)
        if not fits(value, hint):
            raise ValueError(f"{kind.__name__}.{name}: expected {hint}, got {value!r:.60}")
    for item in known.values():
        if item.name not in values:
            made_by = item.default_factory
            values[item.name] = item.default if made_by is MISSING else made_by()
        if values[item.name] is MISSING:
            raise ValueError(f"{kind.__name__}: expected {item.name}, got none")
    return values


def _hint(kind: type, item: "Field[Any] | None", name: str) -> Any:
    """Return the type of a field in a file, or of a cached property stored with the fields."""
    if item is not None:
        return item.metadata.get("packed", hints_of(kind)[name])
    if not isinstance(made := vars(kind).get(name), cached_property):
        raise ValueError(f"{kind.__name__}: expected its fields, got {name}")
    return hints_of(made.func)["return"]


ANYTHING = object()


@cache
def hints_of(kind: Any) -> Mapping[str, Any]:
    """Return the resolved annotations of a class or function."""
    return get_type_hints(kind)


def fits(value: Any, hint: Any) -> bool:
    """Return True if `value` is of the annotated type, down to the members of containers.

    A float may be an int, an array must have the annotated number type, and an object for a
    protocol must have its methods. `Any` and type variables accept everything.
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
    """Check that the fields of an object from a file are consistent.

    Raises:
        ValueError: one of the conditions is False.
    """
    if not all(conditions):
        raise ValueError(f"{what}: expected consistent fields, got contradictory ones")
