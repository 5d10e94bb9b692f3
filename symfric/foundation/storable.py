"""Checks of untrusted files: arrays, classes that a file may name, and types of their fields."""

import tomllib
from collections.abc import Callable, Collection, Mapping
from dataclasses import MISSING, fields
from functools import cache, cached_property
from importlib import import_module
from io import BytesIO
from math import prod
from pathlib import Path
from types import UnionType
from typing import IO, Any, Literal, TypeVar, Union, get_args, get_origin, get_type_hints
from zipfile import ZIP_STORED, ZipFile

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

OWN = ("symfric", "ocp", "identification")
"""Packages whose classes are known."""
ARRAYS = "biufU"
"""NumPy kinds of numbers and strings that arrays may contain; objects would be pickles."""
OURS = tuple(f"{package}{mark}" for package in OWN for mark in ".:")


def path_of(named: Any) -> str:
    """Return the path "module:name" of a class or function."""
    return f"{named.__module__}:{named.__qualname__}"


@cache
def names() -> Mapping[str, Any]:
    """Return "modules", whose classes a file may name, and "moved", their names in older files."""
    return tomllib.loads(Path(__file__).with_name("stored_names.toml").read_text("utf-8"))


def current(path: str) -> str:
    """Return the current path of a class or function, given a current or an older path."""
    moved, (place, _, name) = names()["moved"], path.partition(":")
    return moved.get(path) or f"{moved.get(place, place)}:{name}"


def found_at(path: str) -> Any:
    """Return the class or function with this path.

    Raises:
        ImportError, AttributeError, ValueError: the path does not exist.
    """
    place, _, name = path.partition(":")
    found: Any = import_module(place)
    for part in name.split("."):
        found = getattr(found, part)
    return found


def importable(named: Any) -> bool:
    """Return True if the path of a class or function leads to it."""
    try:
        return found_at(path_of(named)) is named
    except (ImportError, AttributeError, ValueError):
        return False


def may_hold(path: str) -> bool:
    """Return True if a file may name the class: it is in "modules" or in another package."""
    inside = (path.startswith(m if m.endswith(".") else f"{m}:") for m in names()["modules"])
    return not path.startswith(OURS) or any(inside)


def checked(kind: type, values: dict[str, Any]) -> dict[str, Any]:
    """Check the fields of a symfric class and return them, with defaults for missing fields."""
    known = {item.name: item for item in fields(kind)}
    for name, value in values.items():
        if name in known:
            hint = known[name].metadata.get("packed", hints_of(kind)[name])
        elif isinstance(made := vars(kind).get(name), cached_property):  # stored with the fields
            hint = hints_of(made.func)["return"]
        else:
            raise ValueError(f"{kind.__name__}: expected its fields, got {name}")
        if not fits(value, hint):
            raise ValueError(f"{kind.__name__}.{name}: expected {hint}, got {value!r:.60}")
    for item in known.values():
        if item.name not in values:
            made_by = item.default_factory
            values[item.name] = item.default if made_by is MISSING else made_by()
        if values[item.name] is MISSING:
            raise ValueError(f"{kind.__name__}: expected {item.name}, got none")
    return values


ANYTHING = object()


@cache
def hints_of(kind: Any) -> Mapping[str, Any]:
    """Return the resolved annotations of a class or function."""
    return get_type_hints(kind)


def fits(value: Any, hint: Any) -> bool:
    """Return True if `value` has the annotated type, including the members of containers.

    For float, an int is accepted. An array must have the annotated number type, and an object must
    have the methods of an annotated protocol. `Any` and type variables accept every value.
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
    if kind is np.ndarray or get_origin(kind) is np.ndarray:
        wanted: Any = (get_args(of[-1]) or of)[-1] if of else np.generic
        numbers: Any = value.dtype.type if isinstance(value, np.ndarray) else None
        return numbers is not None and (not isinstance(wanted, type) or issubclass(numbers, wanted))
    if kind is Callable or getattr(kind, "__name__", "") == "Callable":
        held: Any = vars(value).get("value", ANYTHING) if hasattr(value, "__dict__") else ANYTHING
        return callable(value) and (held is ANYTHING or fits(held, of[-1]))
    if getattr(kind, "_is_protocol", False) and not issubclass(kind, Collection):
        has = {*dir(type(value)), *getattr(value, "__dict__", ())}
        return has.issuperset(name for name in vars(kind) if not name.startswith("_"))
    if kind in (float, int):
        return isinstance(value, (kind, int)) and not isinstance(value, bool)
    if not isinstance(value, kind):
        return False
    if issubclass(kind, tuple) and of and of[-1] is not Ellipsis:
        return len(value) == len(of) and all(map(fits, value, of))
    if issubclass(kind, Mapping) and of:
        return all(fits(key, of[0]) and fits(held, of[1]) for key, held in value.items())
    return not (isinstance(value, Collection) and of) or all(fits(one, of[0]) for one in value)


def agree(what: str, *conditions: bool) -> None:
    """Check that the fields of an object from a file are consistent.

    Raises:
        ValueError: a condition is False.
    """
    if not all(conditions):
        raise ValueError(f"{what}: expected consistent fields, got contradictory ones")


def arrays(file: IO[bytes]) -> dict[str, NDArray[Any]]:
    """Return the arrays of an archive that `numpy.savez` wrote, by name.

    The arrays do not need more memory than the size of the file: compressed members, overlapping
    members, and headers that announce more data than follow are rejected.

    Args:
        file: file that is open for reading.

    Raises:
        ValueError: the file is not an archive, or a member is rejected or is not an array of
            numbers or strings.
    """
    try:
        size = file.seek(0, 2)
        with ZipFile(file) as archive:
            members = archive.infolist()
            if sum(member.file_size for member in members) > size:
                raise ValueError("expected members that do not overlap")
            if any(member.compress_type != ZIP_STORED for member in members):
                raise ValueError("expected members that are not compressed")
            return {m.filename.removesuffix(".npy"): _array(archive.read(m), size) for m in members}
    except Exception as error:  # zipfile and NumPy raise various errors on damaged bytes
        raise ValueError(f"expected an archive of arrays, got another file: {error}") from error


def _array(content: bytes, most: int) -> NDArray[Any]:
    """Return the array in a member; no dimension may exceed `most`."""
    stream = BytesIO(content)
    if npy.read_magic(stream) != (1, 0):
        raise ValueError("expected format 1.0 of NumPy's arrays")
    shape, by_columns, dtype = npy.read_array_header_1_0(stream)
    data = stream.read()
    if dtype.kind not in ARRAYS or not dtype.itemsize or not all(0 <= n <= most for n in shape):
        raise ValueError("expected an array of numbers or texts")
    if prod(shape) * dtype.itemsize != len(data):
        raise ValueError("expected an array as long as its header says")
    array = np.frombuffer(data, dtype).reshape(shape, order="F" if by_columns else "C")
    return array.astype(dtype.newbyteorder("="))
