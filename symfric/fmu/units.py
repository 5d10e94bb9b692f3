"""SI units from text: "kg m^2/s" as exponents of base units, as FMI wants them."""

from re import fullmatch

BASE = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")
DERIVED: dict[str, dict[str, int]] = {
    "1": {},
    "N": {"kg": 1, "m": 1, "s": -2},
    "J": {"kg": 1, "m": 2, "s": -2},
    "W": {"kg": 1, "m": 2, "s": -3},
    "Pa": {"kg": 1, "m": -1, "s": -2},
    "Hz": {"s": -1},
    "V": {"kg": 1, "m": 2, "s": -3, "A": -1},
    "C": {"s": 1, "A": 1},
}
CELSIUS = "degC"
"""The only unit that counts from elsewhere than zero: 273.15 K."""


def exponents(text: str) -> dict[str, int] | None:
    """Exponents of the base units that `text` is made of; None where it is no product of units.

    Factors stand side by side, those behind the only "/" divide; parentheses group what divides.
    """
    numerator, slash, denominator = text.strip().partition("/")
    if "/" in denominator:
        return None
    found: dict[str, int] = {}
    for sign, part in ((1, numerator), (-1, denominator if slash else "1")):
        inner = part.strip()
        if inner.startswith("(") and inner.endswith(")"):
            inner = inner[1:-1]
        for factor in inner.split():
            match = fullmatch(r"([A-Za-z]+|1)(?:\^(-?\d+))?", factor)
            unit = match and ({match[1]: 1} if match[1] in BASE else DERIVED.get(match[1]))
            if not match or unit is None:
                return None
            for base, power in unit.items():
                found[base] = found.get(base, 0) + sign * power * int(match[2] or 1)
    return {base: found[base] for base in BASE if found.get(base)}


def per_second(text: str) -> str:
    """The unit of a rate."""
    numerator, slash, denominator = text.partition("/")
    if not slash:
        return f"{numerator}/s"
    return (
        f"{numerator}/s^2" if denominator == "s" else f"{numerator}/({denominator.strip('()')} s)"
    )
