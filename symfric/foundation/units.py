"""Units as text: whether there is such a unit, how it is written here, how large it is in SI.

A product of symbols with prefixes and powers, `N s^2/m`, `kg m^2`, `1/(N m)`, `m s^-2`. Other ways
to write the same are taken: `N*s/m`, `kg·m²`, `m/s/s`, `m/s2`, `N.m`, `Nm`.
"""

from collections.abc import Mapping
from functools import cache
from math import pi
from re import fullmatch, search, sub
from warnings import warn

PREFIXES: Mapping[str, float] = {
    "": 1.0, "f": 1e-15, "p": 1e-12, "n": 1e-9, "u": 1e-6, "m": 1e-3, "c": 1e-2, "d": 0.1,
    "h": 100.0, "k": 1e3, "M": 1e6, "G": 1e9, "T": 1e12,
}  # fmt: skip

PREFIXED: Mapping[str, float] = {
    **dict.fromkeys("msAKNJWVFCSTH", 1.0), "mol": 1.0, "cd": 1.0, "Pa": 1.0, "Hz": 1.0, "Ohm": 1.0,
    "Wb": 1.0, "rad": 1.0, "sr": 1.0, "lm": 1.0, "lx": 1.0, "kat": 1.0, "VA": 1.0, "var": 1.0,
    "g": 1e-3, "L": 1e-3, "l": 1e-3, "bar": 1e5, "cal": 4.184, "Wh": 3600.0, "Ah": 3600.0,
}  # fmt: skip
"""Symbols that take a prefix, and their size in SI units."""

ALONE: Mapping[str, float] = {
    "1": 1.0, "%": 0.01, "permille": 1e-3, "ppm": 1e-6, "dB": 1.0, "degC": 1.0, "degF": 5 / 9,
    "deg": pi / 180, "arcmin": pi / 10800, "arcsec": pi / 648000, "gon": pi / 200,
    **dict.fromkeys(("rev", "turn", "turns", "rot", "cycle", "cycles"), 2 * pi),
    "rpm": pi / 30, "rps": 2 * pi,
    "min": 60.0, "h": 3600.0, "d": 86400.0, "day": 86400.0, "days": 86400.0, "week": 604800.0,
    **dict.fromkeys(("a", "yr", "year", "years"), 365.25 * 86400.0),
    "in": 0.0254, "ft": 0.3048, "lb": 0.45359237, "lbf": 4.4482216152605, "kgf": 9.80665,
    "psi": 6894.757293168, "atm": 101325.0, "mmHg": 133.322387415, "hp": 745.6998715822702,
    **dict.fromkeys(("count", "counts", "inc", "tick", "ticks", "step", "steps", "unit"), 1.0),
    **dict.fromkeys(("units", "LSB", "bit", "px", "pulse", "pulses", "pu", "sample"), 1.0),
    "t": 1000.0, "AU": 1.0, "arb": 1.0,
}  # fmt: skip
"""Symbols without prefixes; what counts things is 1."""

WORDS: Mapping[str, str] = {
    "sec": "s", "secs": "s", "second": "s", "seconds": "s", "msec": "ms", "usec": "us",
    "meter": "m", "meters": "m", "metre": "m", "metres": "m", "minute": "min", "minutes": "min",
    "mins": "min", "hour": "h", "hours": "h", "hr": "h", "newton": "N", "newtons": "N",
    "newtonmeter": "N m", "kilogram": "kg", "kilograms": "kg", "kilo": "kg", "gram": "g",
    "radian": "rad", "radians": "rad", "rads": "rad", "degree": "deg", "degrees": "deg",
    "degs": "deg", "volt": "V", "volts": "V", "amp": "A", "amps": "A", "ampere": "A",
    "watt": "W", "watts": "W", "joule": "J", "joules": "J", "pascal": "Pa", "hertz": "Hz",
    "kelvin": "K", "celsius": "degC", "ohm": "Ohm", "ohms": "Ohm", "percent": "%", "mps": "m/s",
    "kph": "km/h", "kmh": "km/h", "kmph": "km/h", "mm2": "mm^2", "inch": "in", "inches": "in",
    "none": "1", "kg": "kg", "kgs": "kg", "nm": "N m", "hz": "Hz", "pa": "Pa", "kpa": "kPa",
    "mpa": "MPa", "kn": "kN", "n": "N", "w": "W", "v": "V", "j": "J", "kgm": "kg m",
}  # fmt: skip
"""What people write instead, in lower letters, and the unit they mean."""

_SIGNS = (
    ("µ", "u"), ("μ", "u"), ("°C", "degC"), ("°F", "degF"), ("°", "deg"), ("Ω", "Ohm"),
    ("Ω", "Ohm"), ("‰", "permille"), ("**", "^"), ("−", "-"), ("⋅", " "), ("·", " "), ("*", " "),
)  # fmt: skip
_RAISED = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻", "0123456789-")
_POWER = r"\^-?\d+(?:\.\d+)?|\^\(-?\d+(?:[./]\d+)?\)|\^[a-z]\b"
_doubted: set[str] = set()


def checked(where: str, unit: str, stacklevel: int = 4) -> str:
    """`unit` as it is `written` here.

    Warns of one that is none, once a unit, in the line that is `stacklevel` calls above.
    """
    text = written(unit)
    if in_si(text) is None and text not in _doubted:
        _doubted.add(text)
        meant = nearest(text)
        hint = f"write '{meant}'" if meant else "write '1' for what counts or has none"
        message = f"{where}: expected a unit such as 'm/s' or 'N s/m', got '{unit}'; {hint}"
        warn(message, UserWarning, stacklevel=stacklevel)
    return text


def turned(unit: str) -> str:
    """The unit that `unit` becomes where a contact turns: m is rad, N is N m, kg is kg m^2.

    A law knows the slip in m/s and the force in N; about an axis the same numbers are rad/s and
    N m. A unit that has rad or N m already stays.
    """
    if search(r"\brad\b|\bN m\b", unit):
        return unit
    for of_sliding, of_turning in (("m", "rad"), ("N", "N m"), ("kg", "kg m^2")):
        unit = sub(rf"\b{of_sliding}\b", of_turning, unit)
    return unit


@cache
def written(text: str) -> str:
    """A unit in the way it is written here: spaces between factors, `^` before powers."""
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
    """`Nm` as `N m`, `kgm` as `kg m`; what is a symbol stays one."""
    if _symbol(word) is None and (pair := fullmatch(r"([mkMu]?N|kg|V|A|W)([mcu]?m|s|h)(s?)", word)):
        return " ".join(part for part in pair.groups() if part)
    return word


@cache
def in_si(text: str) -> float | None:
    """What a number in the unit `text` is multiplied by in SI units; None for what is no unit.

    Angles are radians, counts are 1, and degrees Celsius are as large as kelvins.
    """
    found, rest = _quotient(written(text))
    return found if found is not None and not rest else None


def _quotient(text: str) -> tuple[float | None, str]:
    """The size of a product with slashes, and what follows: a bracket that closes, or nothing."""
    size, sense, text = 1.0, 1.0, text.strip()
    while text and text[0] != ")":
        if text[0] == "/":
            sense, text = -1.0, text[1:].lstrip()
        factor, text = _factor(text)
        if factor is None:
            return None, text
        size *= factor**sense
        text = text.lstrip()
    return size, text


def _factor(text: str) -> tuple[float | None, str]:
    """The size of one factor with its power, and what follows."""
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


def _raised(size: float, power: str) -> float | None:
    """A size to a power; one that is a letter leaves SI units as they are."""
    if power.isalpha():
        return 1.0 if size == 1.0 else None
    above, _, below = power.partition("/")
    return size ** (float(above) / float(below or 1))


def _symbol(text: str) -> float | None:
    if text in ALONE:
        return ALONE[text]
    if text[:1].isdigit():
        return float(text)
    for symbol, size in PREFIXED.items():
        if text.endswith(symbol) and text.removesuffix(symbol) in PREFIXES:
            return size * PREFIXES[text.removesuffix(symbol)]
    return None


def nearest(text: str) -> str:
    """The unit that is meant by a text that is none; "" where nobody knows."""
    meant = sub(r"[A-Za-z]+", lambda word: _meant(word[0]), sub(r"[\[\]]", "", written(text)))
    meant = sub(r"(?<=[A-Za-z])-(?=[A-Za-z])", " ", sub(r"\s+per\s+", "/", meant))
    return written(meant) if in_si(meant) is not None else ""


def _meant(word: str) -> str:
    if _symbol(word) is not None:
        return word
    return WORDS.get(word.lower(), word)
