"""JSON form of a fit: all that a page shows, and the law, without data and equations.

Dataclasses are coded by the types of their fields. Arrays become lists. Non-finite numbers become
null if this is read as NaN, otherwise "inf" and "-inf". Pairs as keys become two levels, members
of an `Enum` their names. Laws and drives become class name, numbers, options and parts, because
their text (`law_name`) is not complete.
"""

import re
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from enum import Enum
from math import inf, isnan, nan
from pathlib import Path
from types import UnionType
from typing import Any, Union, get_args, get_origin

import numpy as np

from identification.result.outcome import FitFields
from symfric.foundation import checks, storable
from symfric.foundation.files import read_json
from symfric.foundation.parameters import Parametric
from symfric.laws import (
    ALL_LAWS,
    Asymmetric,
    Element,
    Law,
    Level,
    Neuron,
    Slider,
    Sum,
    Table,
    law_name,
)
from symfric.laws.catalogue import WRAPPERS
from symfric.scenes import Drive

INFINITE = {"inf": inf, "-inf": -inf}
DIGITS = 6
"""Significant digits of arrays, which are used only for drawing."""
KINDS: dict[str, type[Parametric]] = {
    **ALL_LAWS, **WRAPPERS, "sum": Sum, "asymmetric": Asymmetric, "table": Table,
    "element": Element, "slider": Slider, "level": Level, "neuron": Neuron, "drive": Drive,
}  # fmt: skip
"""Name -> class that can be restored from a file."""


def plain(value: Any) -> Any:
    """Return `value` as JSON-compatible data.

    A user-defined law is represented by the name of its class.

    Raises:
        TypeError: the value is neither a number, a text, a collection nor a dataclass.
    """
    if value is None or isinstance(value, str | bool | int):
        return value
    if isinstance(value, Enum):
        return value.name
    if isinstance(value, float):
        return None if isnan(value) else str(value) if value in (inf, -inf) else value
    if isinstance(value, np.generic):
        return plain(value.item())
    if isinstance(value, np.ndarray) and value.ndim == 1 and value.dtype.kind == "f":
        return [plain(float(f"{x:.{DIGITS}g}")) for x in value.tolist()]
    if isinstance(value, Mapping):
        found: dict[str, Any] = {}
        for key, one in value.items():  # pyright: ignore[reportUnknownVariableType]
            first, *second = map(str, key if isinstance(key, tuple) else (key,))  # pyright: ignore[reportUnknownArgumentType, reportUnknownVariableType]
            if second:
                found.setdefault(first, {})[second[0]] = plain(one)
            else:
                found[first] = plain(one)
        return found
    if isinstance(value, list | tuple | np.ndarray):
        return [plain(one) for one in value]  # pyright: ignore[reportUnknownVariableType]
    if not is_dataclass(value):
        raise TypeError(f"expected plain data, got {type(value).__name__}")
    given = {item.name: plain(getattr(value, item.name)) for item in fields(value) if item.init}
    if not isinstance(value, Parametric):
        return given
    name = next((n for n, kind in KINDS.items() if kind is type(value)), type(value).__name__)
    return {"kind": name, **given}


def revived(kind: Any, data: Any) -> Any:
    """Return the value of the type `kind` from the output of `plain`.

    Raises:
        ValueError, TypeError, KeyError: the data are not the output of `plain` for this type.
    """
    origin, inner = get_origin(kind), get_args(kind)
    meant = getattr(origin or kind, "__value__", None)  # NDArray is an alias since NumPy 2.5
    if meant is not None:
        return revived(meant, data)
    if origin in (Union, UnionType):  # a type or None
        return None if data is None else revived(inner[0], data)
    if origin is tuple:
        return tuple(revived(inner[0], one) for one in data)
    if origin is dict and get_origin(inner[0]) is tuple:
        return {(a, b): revived(inner[1], v) for a, part in data.items() for b, v in part.items()}
    if origin is dict:
        return {name: revived(inner[1], one) for name, one in data.items()}
    if origin is np.ndarray:
        return np.array(_real(data))
    if isinstance(kind, type) and issubclass(kind, Enum):
        return kind[data]
    if is_dataclass(kind):
        hints = storable.hints_of(kind)
        wanted = data.keys() & {item.name for item in fields(kind)}
        return kind(**{name: revived(hints[name], data[name]) for name in wanted})  # pyright: ignore[reportCallIssue]
    return float(_real(data)) if kind is float else data


def _real(value: Any) -> Any:
    """Return a number or a list of numbers from the output of `plain`."""
    if isinstance(value, list):
        return [_real(one) for one in value]  # pyright: ignore[reportUnknownVariableType]
    return nan if value is None else INFINITE[value] if isinstance(value, str) else value


def source_of(law: Law) -> str:
    """Return Python code that creates the law, with an import if the class is in symfric."""
    text = repr(law)
    known = sorted({kind.__name__ for kind in KINDS.values()})
    names = [name for name in known if re.search(rf"\b{name}\(", text)]
    imported = f"from symfric import {', '.join(names)}\n\n" if names else ""
    return f"{imported}law = {text}\n"


def known(data: Any, own: Mapping[str, type[Parametric]]) -> bool:
    """Return True if all classes in the output of `plain` are in `KINDS` or in `own`."""
    if isinstance(data, Mapping):
        named = data.get("kind") in KINDS or data.get("kind") in own  # pyright: ignore
        return named and all(known(one, own) for one in data.values())  # pyright: ignore
    return not isinstance(data, list) or all(known(one, own) for one in data)  # pyright: ignore


def from_data(data: Any, own: Mapping[str, type[Parametric]] | None = None) -> Any:
    """Return the law or drive, or a part of it, from the output of `plain`.

    Args:
        data: output of `plain`.
        own: further classes by name.

    Raises:
        ValueError: an unknown class or field, or refused numbers.
    """
    if isinstance(data, list):
        return tuple(from_data(one, own) for one in data)  # pyright: ignore[reportUnknownVariableType]
    if not isinstance(data, Mapping):
        return data
    known = {**KINDS, **(own or {})}
    given = checks.named("law from data", data)
    name = given.pop("kind", None)
    kind = known[checks.choice("law from data: kind", name, known)]
    names = [item.name for item in fields(kind) if item.init]
    checks.check_names(f"law from data: {name}", given, names)
    return kind(**{field: from_data(value, own) for field, value in given.items()})


FILE = "symfric fit"
FORMAT = 1
"""Format number, increased when older programs cannot read the file or would misread it."""

APART = ("law", "machine", "live", "asked")
"""Fields that are not stored as plain data."""
NEWER = {"sides"}
"""Fields that files of earlier versions do not have."""


def to_dict(fit: FitFields) -> dict[str, Any]:
    """Return all fields except the problem, with the law as text and as data, and the drive."""
    data = {f.name: plain(getattr(fit, f.name)) for f in fields(fit) if f.name not in APART}
    return {
        "file": FILE,
        "format": FORMAT,
        **data,
        "law": None if fit.law is None else law_name(fit.law),
        "law_data": _plain_or_none(fit.law),
        "machine": _plain_or_none(fit.drive),
    }


def _plain_or_none(held: Parametric | None) -> dict[str, Any] | None:
    """Return a law or a drive as data; None for a user-defined class with more than numbers."""
    try:
        return plain(held)
    except TypeError:
        return None


def read(
    kind: type[FitFields], path: str | Path, own: Mapping[str, type[Parametric]] | None
) -> Any:
    """Read a fit that was written to `path`; see `Fitted.from_json`."""
    what = "a file that fit.to_json(path) wrote"
    data = read_json("fit", path, what)
    if data.get("file") != FILE:
        raise ValueError(f"fit '{path}': expected {what}, got something else")
    if data.get("format") != FORMAT:
        raise ValueError(
            f"fit '{path}': expected format {FORMAT}, got {checks.shown(data.get('format'))}; it "
            "was written by another version of symfric"
        )
    try:
        return _made(kind, data, own)
    except (KeyError, TypeError, ValueError, AttributeError, IndexError) as error:
        raise ValueError(
            f"fit '{path}': expected the output of fit.to_json(path), got a modified file: {error}"
        ) from None


def _made(kind: type[FitFields], data: dict[str, Any], own: Mapping[str, type[Parametric]] | None):
    hints = storable.hints_of(kind)
    values: dict[str, Any] = {
        f.name: revived(hints[f.name], data[f.name])
        for f in fields(kind)
        if f.name not in (*APART, *(NEWER - data.keys()))
    }
    law, machine = (
        from_data(data[key], own) if known(data[key], own or {}) else None
        for key in ("law_data", "machine")
    )
    made = kind(**values, law=law, machine=machine)
    for name, value in values.items():
        if not storable.fits(value, hints[name]):
            raise ValueError(f"{name} of another type")
    made.check_fields()
    return made
