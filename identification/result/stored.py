"""A fit in a file: everything that a page needs and the law, without data and equations."""

from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Any, get_type_hints

from identification.result.coding import plain, revived
from identification.result.law_data import from_data, known, to_data
from symfric.foundation import checks, typed
from symfric.foundation.files import read_json
from symfric.foundation.parameters import Parametric
from symfric.laws import law_name

if TYPE_CHECKING:
    from identification.result.fitted import Fitted

FILE = "symfric fit"
FORMAT = 1
"""Raised whenever older programs could not read the file or would misread it."""

APART = ("law", "machine", "live", "asked")
"""Fields that are no plain data."""


def to_dict(fit: "Fitted") -> dict[str, Any]:
    """All but the problem; the law as its text and as data that make it again, and the drive."""
    data = {f.name: plain(getattr(fit, f.name)) for f in fields(fit) if f.name not in APART}
    return {
        "file": FILE,
        "format": FORMAT,
        **data,
        "law": None if fit.law is None else law_name(fit.law),
        "law_data": _data(fit.law),
        "machine": _data(fit.drive),
    }


def _data(held: Parametric | None) -> dict[str, Any] | None:
    """A law or a drive as data; None of a class of your own that holds more than numbers."""
    try:
        return None if held is None else to_data(held)
    except ValueError:
        return None


def read(kind: "type[Fitted]", path: str | Path, own: Mapping[str, type[Parametric]] | None) -> Any:
    """The fit that was written to `path`; see `Fitted.from_json`."""
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
            f"fit '{path}': expected what fit.to_json(path) wrote, got it changed: {error}"
        ) from None


def _made(kind: "type[Fitted]", data: dict[str, Any], own: Mapping[str, type[Parametric]] | None):
    hints = get_type_hints(kind)
    plain_ones = {
        f.name: revived(hints[f.name], data[f.name]) for f in fields(kind) if f.name not in APART
    }
    law, machine = data["law_data"], data["machine"]
    made = kind(**plain_ones, law=_known(law, own), machine=_known(machine, own))
    for name, value in plain_ones.items():
        if not typed.fits(value, hints[name]):
            raise ValueError(f"{name} of another type")
    made.check_fields()
    return made


def _known(data: Any, own: Mapping[str, type[Parametric]] | None) -> Any:
    """The law or machine, None where its class, or that of a part of it, is not known here."""
    return None if data is None or not known(data, own or {}) else from_data(data, own)
