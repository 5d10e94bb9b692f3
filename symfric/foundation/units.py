"""Units of contacts that turn."""

from re import search, sub


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
