"""Units of measured signals: those of the channels, and what a header or a call says.

The grammar is that of `symfric.foundation.units`; recorders also write words (`sec`, `newton`),
letters of any case, and speeds as `1/min`.
"""

from collections.abc import Mapping
from functools import cache
from math import isfinite
from re import findall

from symfric.foundation.units import WORDS, Unit, nearest, parsed, per_second, written

SPEEDS = ("1/min", "min^-1")
"""How recorders write revolutions per minute."""
PURE = ("1", "%")
"""Units without a dimension; counts of a recorder have no size in SI units."""
PREFIXED = {"s": "num", "m": "numck", "N": "umckM", "rad": "um", "V": "umk", "A": "um", "W": "mk"}
COMMON = {
    *WORDS, *PREFIXED, *(p + s for s, prefixes in PREFIXED.items() for p in prefixes), "1", "%",
    "min", "h", "deg", "rev", "arcmin", "arcsec", "in", "ft", "g", "kg", "kgf", "lbf", "K", "rpm",
}  # fmt: skip
"""Symbols that stand for units in a header even without brackets: `x_mm`, but not `tau_d`."""

KINDS: Mapping[str, tuple[str, ...]] = {
    "t": ("s",),
    "x": ("m", "rad"),
    "v": ("m/s", "rad/s"),
    "a": ("m/s^2", "rad/s^2"),
    "force": ("N", "N m"),
    "F": ("N", "N m"),
    "N": ("N",),
}
"""SI units that the canonical channels may have; the first one is that of a slide."""

EXAMPLES: Mapping[str, str] = {
    "t": "s, ms, us, min",
    "x": "m, cm, mm, um, rad, mrad, deg, rev",
    "v": "m/s, mm/s, rad/s, deg/s, rpm",
    "a": "m/s^2, mm/s^2, rad/s^2, deg/s^2",
    "force": "N, mN, kN, N m, N mm, mN m",
    "F": "N, mN, kN, N m, N mm, mN m",
    "N": "N, mN, kN",
}
"""Of the same, for messages."""


@cache
def unit(text: str) -> Unit | None:
    """The unit that `text` means; None for what is no unit of a signal."""
    plain = written(text)
    if plain.lower() in SPEEDS:
        plain = "rpm"
    found = parsed(plain) or parsed(nearest(plain) or "?")
    if found is None or not all(isfinite(power) for _, power in found.powers):
        return None
    known = found.powers or plain in (*PURE, "")
    return found if known and "degF" not in dict(found.powers) else None


def is_common(text: str) -> bool:
    """Whether `text` is a unit even where nothing says that it is one."""
    symbols = findall(r"[A-Za-z]+|[%1]", written(text))
    return unit(text) is not None and all(s in COMMON or s.lower() in WORDS for s in symbols)


def by_channel(where: str, text: str) -> dict[str, str]:
    """Units of the canonical channels from the short form `rad, N m`.

    Each unit goes to the channel that can have it; velocity and acceleration follow the position
    where they are not named: `mm, N` gives mm/s.

    Raises:
        ValueError: no unit, one that belongs to no canonical channel, two for the same.
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
