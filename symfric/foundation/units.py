"""Units as strings: spelling, size in SI units, dimension and prefixes.

A unit is a product of symbols with prefixes and powers: `N s^2/m`, `kg m^2`, `1/(N m)`, `m s^-2`.
Other spellings are accepted: `N*s/m`, `kg·m²`, `m/s/s`, `m/s2`, `N.m`, `Nm`. All factors after a
slash are in the denominator. Newtons and radians are not replaced by base units, so that torque and
energy have different units.
"""

import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from re import Match, fullmatch, search, sub
from typing import Any, final
from warnings import warn

import numpy as np
from numpy.typing import ArrayLike

_DATA: dict[str, Any] = tomllib.loads(Path(__file__).with_name("units.toml").read_text("utf-8"))
PREFIXES: Mapping[str, float] = _DATA["prefixes"]
PREFIXED: Mapping[str, tuple[float, str]] = {
    **{symbol: (1.0, symbol) for symbol in _DATA["si"].split()},
    **{symbol: (size, unit) for symbol, (size, unit) in _DATA["prefixed"].items()},
}
"""Symbols that allow prefixes, with their size in an SI unit and this unit."""
_ALONE: Mapping[str, tuple[float, str]] = {
    **{symbol: (1.0, "1") for symbol in _DATA["counts"].split()},
    **{symbol: (size, si) for si, own in _DATA["alone"].items() for symbol, size in own.items()},
}
"""Symbols without prefixes, with their size in an SI unit and this unit; for counts it is 1."""
SPOKEN: Mapping[str, str] = {"u/min": "rpm", "r/min": "rpm"}
"""Complete units that are not products of symbols."""
WORDS: Mapping[str, str] = {
    word: unit for unit, words in _DATA["words"].items() for word in words.split()
}
"""Units by common words in lower case."""

_SIGNS = (
    ("µ", "u"), ("μ", "u"), ("°C", "degC"), ("°F", "degF"), ("°", "deg"), ("Ω", "Ohm"),
    ("Ω", "Ohm"), ("‰", "permille"), ("**", "^"), ("−", "-"), ("⋅", " "), ("·", " "), ("*", " "),
)  # fmt: skip
_RAISED = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻", "0123456789-")
_POWER = r"\^-?\d+(?:\.\d+)?|\^\(-?\d+(?:[./]\d+)?\)|\^[a-z]\b"
_doubted: set[str] = set()

_ORDER = ("kg", "N", "J", "V", "A", "K", "W", "", "rad", "m", "s")
"""Order of symbols in a product; "" is the position of all other symbols."""
BASE = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")
CELSIUS = "degC"
"""Temperature unit of FMI with an offset: 273.15 K."""


@final
@dataclass(frozen=True)
class Unit:
    """Unit; numbers times `factor` are in the SI unit that is the product of `powers`."""

    factor: float
    powers: tuple[tuple[str, float], ...]

    @property
    def si(self) -> str:
        """SI unit as a string."""

        def side(sense: int) -> list[str]:
            found = [(s, sense * power) for s, power in self.powers if sense * power > 0]
            return [s if power == 1 else f"{s}^{power:g}" for s, power in found]

        above, below = " ".join(side(1)) or "1", side(-1)
        if not below:
            return above
        return f"{above}/{below[0]}" if len(below) == 1 else f"{above}/({' '.join(below)})"


def checked(where: str, unit: str, stacklevel: int = 4) -> str:
    """Return `unit` in the spelling of `written`.

    An unknown unit causes a warning, once per unit, at the line `stacklevel` calls above.
    """
    text = written(unit)
    if in_si(text) is None and text not in _doubted:
        _doubted.add(text)
        meant = nearest(text)
        hint = f"write '{meant}'" if meant else "write '1' for counts and pure numbers"
        message = f"{where}: expected a unit such as 'm/s' or 'N s/m', got '{unit}'; {hint}"
        warn(message, UserWarning, stacklevel=stacklevel)
    return text


def turned(unit: str) -> str:
    """Return the rotary unit for a translational one: rad for m, N m for N, kg m^2 for kg.

    For rotation about an axis, the slip of a law is in rad/s instead of m/s and its force in N m
    instead of N. A unit that already contains rad or N m is unchanged.
    """
    if search(r"\brad\b|\bN m\b", unit):
        return unit
    for of_sliding, of_turning in (("m", "rad"), ("N", "N m"), ("kg", "kg m^2")):
        unit = sub(rf"\b{of_sliding}\b", of_turning, unit)
    return unit


@cache
def written(text: str) -> str:
    """Return a unit in the spelling of symfric: spaces between factors and `^` before powers."""
    text = text.strip()
    for sign, plain in _SIGNS:
        text = text.replace(sign, plain)
    text = sub(r"[⁻⁰¹²³⁴-⁹]+", lambda raised: "^" + raised[0].translate(_RAISED), text)
    text = sub(r"(?:√|sqrt)\s*\(?([A-Za-z]+)\)?", r"\1^0.5", "1" if text == "-" else text)
    text = sub(r"(?<=[A-Za-z\d)])\.(?=[A-Za-z(])", " ", text)
    text = sub(r"(?<![\d.A-Za-z])([A-Za-z]+)(-?\d)", r"\1^\2", text)
    text = sub(r"[A-Za-z]+", lambda word: _apart(word[0]), text)
    return sub(r"\s+", " ", sub(r"\s*/\s*", "/", text)).strip()


def _apart(word: str) -> str:
    """Return `Nm` as `N m` and `kgm` as `kg m`; known symbols are unchanged."""
    if _symbol(word) is None and (pair := fullmatch(r"([mkMu]?N|kg|V|A|W)([mcu]?m|s|h)(s?)", word)):
        return " ".join(part for part in pair.groups() if part)
    return word


@cache
def parsed(text: str) -> Unit | None:
    """Return the unit of `text`; None if it is not a unit.

    Angles are in radians, counts are 1, and a degree Celsius has the size of a kelvin. A power that
    is a letter is NaN.
    """
    plain = written(text)
    found, rest = _quotient(SPOKEN.get(plain.lower(), plain))
    if found is None or rest:
        return None
    places = {symbol: k for k, symbol in enumerate(_ORDER)}
    powers = [(s, power) for s, power in found[1].items() if power]
    powers.sort(key=lambda pair: places.get(pair[0], places[""]))
    return Unit(found[0], tuple(powers))


def in_si(text: str) -> float | None:
    """Return the factor from the unit `text` to SI units; None if it is not a unit."""
    found = parsed(text)
    return None if found is None else found.factor


def exponents(text: str) -> dict[str, int] | None:
    """Return the exponents of the base units in `text`; None if it is not a product of SI units.

    The result is also None for units of another size, such as mm, and for non-integer powers.
    """
    unit, found = parsed(text), dict[str, int]()
    if unit is None or unit.factor != 1.0:
        return None
    for symbol, power in unit.powers:
        base = {symbol: 1} if symbol in BASE else exponents(_DATA["derived"].get(symbol, "?"))
        if base is None or power != round(power, 0):
            return None
        for name, inner in base.items():
            found[name] = found.get(name, 0) + inner * int(power)
    return {name: found[name] for name in BASE if found.get(name)}


def per_second(unit: str) -> str:
    """Return the unit of a time derivative: m/s for m, m/s^2 for m/s."""
    numerator, slash, denominator = unit.partition("/")
    if not slash:
        return f"{numerator}/s"
    if denominator == "s":
        return f"{numerator}/s^2"
    return f"{numerator}/({denominator.strip('()')} s)"


_Size = tuple[float, dict[str, float]]
"""Factor to SI units and powers of the symbols."""


def _quotient(text: str) -> tuple[_Size | None, str]:
    """Return the size of a product with slashes, and the remaining text from ")" on."""
    size, powers, sense, text = 1.0, dict[str, float](), 1, text.strip()
    while text and text[0] != ")":
        if text[0] == "/":
            sense, text = -1, text[1:].lstrip()
        factor, text = _factor(text)
        if factor is None:
            return None, text
        size *= factor[0] ** sense
        for symbol, power in factor[1].items():
            powers[symbol] = powers.get(symbol, 0) + sense * power
        text = text.lstrip()
    return (size, powers), text


def _factor(text: str) -> tuple[_Size | None, str]:
    """Return the size of one factor with its power, and the remaining text."""
    if text.startswith("("):
        size, text = _quotient(text[1:])
        if size is None or not text.startswith(")"):
            return None, text
        text = text[1:]
    elif symbol := search(r"^(?:[A-Za-z]+|%|\d+(?:\.\d*)?(?:e[+-]?\d+)?)", text):
        size, text = _symbol(symbol[0]), text[symbol.end() :]
    else:
        return None, text
    power = search(f"^(?:{_POWER})", text)
    if size is None or not power:
        return size, text
    return _raised(size, power[0].lstrip("^").strip("()")), text[power.end() :]


def _raised(size: _Size, power: str) -> _Size | None:
    """Return a size raised to a power; a letter is allowed as the power of SI units only."""
    if power.isalpha():
        return (1.0, dict.fromkeys(size[1], float("nan"))) if size[0] == 1.0 else None
    above, _, below = power.partition("/")
    n = float(above) / float(below or 1)
    return size[0] ** n, {symbol: n * inner for symbol, inner in size[1].items()}


def _symbol(text: str) -> _Size | None:
    if text[:1].isdigit():
        return float(text), {}
    found = _ALONE.get(text)
    if found is None:
        for symbol, (size, unit) in PREFIXED.items():
            if text.endswith(symbol) and text.removesuffix(symbol) in PREFIXES:
                found = size * PREFIXES[text.removesuffix(symbol)], unit
                break
        else:
            return None
    size, unit = found
    if unit == text or unit.isalpha():
        return size, {unit: 1.0}
    return size, {} if unit == "1" else dict((parsed(unit) or Unit(1.0, ())).powers)


def nearest(text: str) -> str:
    """Return the unit that an invalid string probably means; "" if unknown."""

    def meant(word: Match[str]) -> str:
        return word[0] if _symbol(word[0]) is not None else WORDS.get(word[0].lower(), word[0])

    known = sub(r"[A-Za-z]+", meant, sub(r"[\[\]]", "", written(text)))
    known = sub(r"(?<=[A-Za-z])-(?=[A-Za-z])", " ", sub(r"\s+per\s+", "/", known))
    return written(known) if in_si(known) is not None else ""


SHOWN_WITH = (
    "m", "m/s", "m/s^2", "N", "N m", "N/s", "rad", "rad/s", "rad/s^2", "s", "J", "W", "Pa",
)  # fmt: skip
"""Units to which `readable` may add a prefix."""

STEPS = ((1e9, "G"), (1e6, "M"), (1e3, "k"), (1.0, ""), (1e-3, "m"), (1e-6, "µ"), (1e-9, "n"))
LEAST, MOST = 0.08, 2e4
"""Range of the largest magnitude in which `readable` adds no prefix."""

CLOCKS = tuple((_ALONE[unit][0], unit) for unit in ("years", "days", "h"))
"""Sizes [s] and names of units for long times, used from three units on, hours from six."""


def clock(times: ArrayLike) -> tuple[float, str]:
    """Return a factor and a readable unit for an axis of `times` [s] multiplied by the factor."""
    t = np.asarray(times, dtype=float)
    span = float(np.ptp(t[np.isfinite(t)])) if np.isfinite(t).any() else 0.0
    for size, unit in CLOCKS:
        if span >= (6 if unit == "h" else 3) * size:
            return 1 / size, unit
    return 1.0, "s"


def readable(unit: str, values: Iterable[ArrayLike]) -> tuple[float, str]:
    """Return a factor from `unit` to a readable unit for `values`, and this unit.

    The unit is unchanged if the largest magnitude is zero or between 0.08 and 20000, or if the unit
    allows no prefix. Otherwise, the largest scaled magnitude is between 0.08 and 80.
    """
    sizes = [np.abs(np.asarray(v, dtype=float)) for v in values]
    top = max((float(np.max(s[np.isfinite(s)], initial=0.0)) for s in sizes), default=0.0)
    if unit not in SHOWN_WITH or top == 0.0 or LEAST <= top < MOST:
        return 1.0, unit
    for size, letter in STEPS:
        if top >= LEAST * size:
            return 1 / size, letter + unit
    size, letter = STEPS[-1]
    return 1 / size, letter + unit
