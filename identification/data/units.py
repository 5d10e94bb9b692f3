"""Units of measured signals: what a header or a call says, as an SI unit and a factor.

A unit is a product of symbols with prefixes and whole powers, at most one slash before what it is
divided by: `mm/s`, `N m`, `mN*m`, `deg/s^2`, `m s^-1`. Newtons stay newtons (`N`, `N m`), radians
stay radians, so that a torque is no energy and a shaft no slide.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from math import pi
from re import fullmatch, split, sub
from typing import final

BASES = ("kg", "N", "V", "A", "K", "W", "rad", "m", "s")
"""Base symbols, in the order in which a unit is written."""

PREFIXES = {"": 1.0, "n": 1e-9, "u": 1e-6, "m": 1e-3, "c": 1e-2, "k": 1e3, "M": 1e6}
PREFIXED = {"s": "num", "m": "numck", "N": "umckM", "rad": "um", "V": "umk", "A": "um", "W": "mk"}
"""Prefixes that a base symbol may have."""

OTHERS = {
    "min": (60.0, "s"),
    "h": (3600.0, "s"),
    "deg": (pi / 180, "rad"),
    "rev": (2 * pi, "rad"),
    "arcmin": (pi / 180 / 60, "rad"),
    "arcsec": (pi / 180 / 3600, "rad"),
    "in": (0.0254, "m"),
    "ft": (0.3048, "m"),
    "g": (1e-3, "kg"),
    "kg": (1.0, "kg"),
    "kgf": (9.80665, "N"),
    "lbf": (4.4482216152605, "N"),
    "K": (1.0, "K"),
}
"""Symbols without prefixes: factor and base."""

WORDS = {
    "sec": "s",
    "second": "s",
    "seconds": "s",
    "meter": "m",
    "metre": "m",
    "meters": "m",
    "metres": "m",
    "newton": "N",
    "newtons": "N",
    "degree": "deg",
    "degrees": "deg",
    "radian": "rad",
    "radians": "rad",
    "inch": "in",
    "volt": "V",
    "ampere": "A",
    "msec": "ms",
    "rpm": "rev/min",
    "r/min": "rev/min",
    "u/min": "rev/min",
    "1/min": "rev/min",
    "min^-1": "rev/min",
    "rps": "rev/s",
    "": "1",
    "-": "1",
}
"""Other ways to write a unit, in lower letters."""


@final
@dataclass(frozen=True)
class Unit:
    """A unit: numbers times `factor` are in `si`."""

    si: str
    factor: float


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
    """The unit that `text` means; None for what is no unit."""
    plain = sub("[µμ]", "u", text.strip().replace("°", "deg"))
    for sign, ascii_ in (("²", "^2"), ("³", "^3"), ("⁻¹", "^-1"), ("⁻²", "^-2"), ("**", "^")):
        plain = plain.replace(sign, ascii_)
    plain = WORDS.get(plain.lower(), plain)
    if plain in ("1", "%"):
        return Unit("1", 1.0 if plain == "1" else 0.01)
    above, *below = plain.split("/")
    factor, powers = 1.0, dict[str, int]()
    for part, sense in ((above, 1), *((p, -1) for p in below)):
        for token in split(r"[\s*·⋅.()]+", part.strip(" ()")):
            found = _token(token) if token != "1" or part is not above else (1.0, {})
            if found is None:
                return None
            factor *= found[0] ** sense
            for base, power in found[1].items():
                powers[base] = powers.get(base, 0) + sense * power
    return Unit(_written(powers), factor)


def _token(token: str) -> tuple[float, dict[str, int]] | None:
    """One symbol with its power, or the `Nm` of those who leave no space."""
    match = fullmatch(r"([A-Za-z]+)\^?(-?\d)?", token)
    if not match:
        return None
    symbol, power = WORDS.get(match[1].lower(), match[1]), int(match[2] or 1)
    one = _symbol(symbol)
    if one is not None:
        return one[0] ** power, {one[1]: power}
    torque = fullmatch(r"([umckM]?N)([umc]?m)", symbol)
    if torque and power == 1:
        force, arm = _symbol(torque[1]), _symbol(torque[2])
        if force and arm:
            return force[0] * arm[0], {"N": 1, "m": 1}
    return None


def _symbol(symbol: str) -> tuple[float, str] | None:
    if symbol in OTHERS:
        return OTHERS[symbol]
    for base, prefixes in PREFIXED.items():
        if symbol.endswith(base):
            prefix = symbol.removesuffix(base)
            if prefix == "" or (len(prefix) == 1 and prefix in prefixes):
                return PREFIXES[prefix], base
    return None


def _written(powers: Mapping[str, int]) -> str:
    def side(sense: int) -> str:
        found = [(b, sense * powers.get(b, 0)) for b in BASES if sense * powers.get(b, 0) > 0]
        return " ".join(b if p == 1 else f"{b}^{p}" for b, p in found)

    above, below = side(1), side(-1)
    return f"{above or '1'}/{below}" if below else above or "1"


def derivative(of: str, order: int) -> str:
    """The unit of a time derivative: `mm` once by time is `mm/s`, twice `mm/s^2`."""
    return f"{of}/s" if order == 1 else f"{of}/s^{order}"


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
        for channel, order in (("v", 1), ("a", 2)):
            found.setdefault(channel, derivative(found["x"], order))
    elif "v" in found:
        given = unit(found["v"])
        turning = given is not None and given.si.startswith("rad")
        found["x"] = "rad" if turning else "m"
        found.setdefault("a", derivative(found["x"], 2))
    return found
