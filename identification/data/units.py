"""Units of measured signals in channels, headers and calls.

The grammar is that of `symfric.foundation.units`. In addition, recorders use words (`sec`,
`newton`), letters of either case, and speeds as `1/min`.
"""

import tomllib
from collections.abc import Mapping
from functools import cache
from math import isfinite
from pathlib import Path
from re import findall
from typing import Any

from symfric.foundation.units import WORDS, Unit, nearest, parsed, per_second, written

SPEEDS = ("1/min", "min^-1")
"""Spellings of revolutions per minute used by recorders."""
PURE = ("1", "%")
"""Dimensionless units; counts of a recorder have no size in SI units."""
PREFIXED = {"s": "num", "m": "numck", "N": "umckM", "rad": "um", "V": "umk", "A": "um", "W": "mk"}
COMMON = {
    *WORDS, *PREFIXED, *(p + s for s, prefixes in PREFIXED.items() for p in prefixes), "1", "%",
    "min", "h", "deg", "rev", "arcmin", "arcsec", "in", "ft", "g", "kg", "kgf", "lbf", "K", "rpm",
}  # fmt: skip
"""Symbols that denote units in a header even without brackets, as in `x_mm` but not in `tau_d`."""

CHANNELS: Mapping[str, Mapping[str, Any]] = tomllib.loads(
    Path(__file__).with_name("channels.toml").read_text("utf-8")
)
"""Channel -> SI units, aliases and examples of units."""
KINDS: Mapping[str, tuple[str, ...]] = {n: tuple(c["units"]) for n, c in CHANNELS.items()}
"""SI units of the canonical channels; the first one is for linear drives."""


@cache
def unit(text: str) -> Unit | None:
    """Return the unit denoted by `text`; None if it is not a unit of a signal."""
    plain = written(text)
    if plain.lower() in SPEEDS:
        plain = "rpm"
    found = parsed(plain) or parsed(nearest(plain) or "?")
    if found is None or not all(isfinite(power) for _, power in found.powers):
        return None
    known = found.powers or plain in (*PURE, "")
    return found if known and "degF" not in dict(found.powers) else None


def is_common(text: str) -> bool:
    """Return True if `text` denotes a unit even without brackets."""
    symbols = findall(r"[A-Za-z]+|[%1]", written(text))
    return unit(text) is not None and all(s in COMMON or s.lower() in WORDS for s in symbols)


def by_channel(where: str, text: str) -> dict[str, str]:
    """Return the units of the canonical channels from the short form `rad, N m`.

    Each unit applies to the channels that can have it. Velocity and acceleration follow the
    position unless their units are given: `mm, N` implies mm/s.

    Raises:
        ValueError: not a unit, a unit of no canonical channel, or two units for one channel.
    """
    found: dict[str, str] = {}
    for part in (p.strip() for p in text.split(",")):
        meant = unit(part) if part else None
        channels = [c for c, kinds in KINDS.items() if meant and meant.si in kinds and c != "N"]
        if not channels:
            raise ValueError(
                f"{where}: expected units of position and force such as 'rad, N m', got '{part}'; "
                "other signals take units={'name': 'unit'}"
            )
        if channels[0] in found:
            raise ValueError(
                f"{where}: expected one unit for {channels[0]}, got '{found[channels[0]]}' and "
                f"'{part}'"
            )
        found.update(dict.fromkeys(channels, part))
    if "x" in found:
        found.setdefault("v", per_second(found["x"]))
        found.setdefault("a", per_second(per_second(found["x"])))
    elif "v" in found:
        given = unit(found["v"])
        turning = given is not None and given.si.startswith("rad")
        found["x"] = "rad" if turning else "m"
        found.setdefault("a", f"{found['x']}/s^2")
    return found
