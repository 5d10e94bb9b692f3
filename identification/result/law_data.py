"""Laws and drives as plain data, and back: class by name, numbers, options, what they hold.

The text of a law (`law_name`) says its kind but not the number of its elements, its options or
what differs between its two sides; this says all of it.
"""

import re
from collections.abc import Mapping
from dataclasses import fields
from typing import Any

from symfric.foundation import checks
from symfric.foundation.numeric import is_symbolic
from symfric.foundation.parameters import Parametric
from symfric.laws import ALL_LAWS, Asymmetric, Element, Law, Slider, Sum, Table
from symfric.laws.catalogue import WRAPPERS
from symfric.scenes import Drive

KINDS: dict[str, type[Parametric]] = {
    **ALL_LAWS, **WRAPPERS, "sum": Sum, "asymmetric": Asymmetric, "table": Table,
    "element": Element, "slider": Slider, "drive": Drive,
}  # fmt: skip
"""What can be made again from a file, by name."""


def to_data(held: Parametric) -> dict[str, Any]:
    """A law or a drive with numbers as a dictionary that JSON takes.

    One of a class of your own is written by the name of its class.

    Raises:
        ValueError: a parameter that is a symbol.
    """
    name = next((name for name, kind in KINDS.items() if kind is type(held)), type(held).__name__)
    return {"kind": name} | {
        item.name: _plain(f"{name}: {item.name}", getattr(held, item.name))
        for item in fields(held)
        if item.init
    }


def _plain(where: str, value: Any) -> Any:
    if isinstance(value, Parametric):
        return to_data(value)
    if isinstance(value, tuple | list):
        return [_plain(where, one) for one in value]  # pyright: ignore[reportUnknownVariableType]
    if is_symbolic(value):
        raise checks.refused(where, "a number", value, "a fitted law holds no symbols")
    if isinstance(value, str | bool):
        return value
    return checks.number(where, value)


def source_of(law: Law) -> str:
    """Python that makes this law; its class stands in symfric, unless it is your own."""
    text = repr(law)
    known = sorted({kind.__name__ for kind in KINDS.values()})
    names = [name for name in known if re.search(rf"\b{name}\(", text)]
    imported = f"from symfric import {', '.join(names)}\n\n" if names else ""
    return f"{imported}law = {text}\n"


def known(data: Any, own: Mapping[str, type[Parametric]]) -> bool:
    """Whether the classes of what `to_data` wrote are all known, here or among `own`."""
    if isinstance(data, Mapping):
        named = data.get("kind") in KINDS or data.get("kind") in own  # pyright: ignore
        return named and all(known(one, own) for one in data.values())  # pyright: ignore
    return not isinstance(data, list) or all(known(one, own) for one in data)  # pyright: ignore


def from_data(data: Any, own: Mapping[str, type[Parametric]] | None = None) -> Parametric:
    """The law or drive that `to_data` wrote.

    Args:
        data: what was written.
        own: further classes by name.

    Raises:
        ValueError: no such class or field, or numbers that it refuses.
    """
    known = {**KINDS, **(own or {})}
    given = checks.named("law from data", data)
    name = given.pop("kind", None)
    kind = known[checks.choice("law from data: kind", name, known)]
    names = [item.name for item in fields(kind) if item.init]
    checks.check_names(f"law from data: {name}", given, names)
    return kind(**{field: _made(value, known) for field, value in given.items()})


def _made(value: Any, known: Mapping[str, type[Parametric]]) -> Any:
    if isinstance(value, Mapping):
        return from_data(value, known)  # pyright: ignore[reportUnknownArgumentType]
    if isinstance(value, list):
        return tuple(_made(one, known) for one in value)  # pyright: ignore[reportUnknownVariableType]
    return value
