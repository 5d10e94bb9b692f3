from math import pi

import pytest

from identification.data.units import by_channel, is_common, unit


@pytest.mark.parametrize(("text", "si", "factor"), [
    ("m", "m", 1.0), ("µm", "m", 1e-6), ("μm", "m", 1e-6), ("ms", "s", 1e-3), ("min", "s", 60.0),
    ("deg", "rad", pi / 180), ("°", "rad", pi / 180), ("°/s", "rad/s", pi / 180),
    ("mrad", "rad", 1e-3), ("rpm", "rad/s", 2 * pi / 60), ("1/min", "rad/s", 2 * pi / 60),
    ("rev/s", "rad/s", 2 * pi), ("mm/s", "m/s", 1e-3), ("mm s^-1", "m/s", 1e-3),
    ("m/s²", "m/s^2", 1.0), ("m/s2", "m/s^2", 1.0), ("m/s/s", "m/s^2", 1.0),
    ("deg/s^2", "rad/s^2", pi / 180), ("kN", "N", 1e3), ("N m", "N m", 1.0), ("Nm", "N m", 1.0),
    ("N*m", "N m", 1.0), ("N·m", "N m", 1.0), ("N mm", "N m", 1e-3), ("mNm", "N m", 1e-3),
    ("mN m", "N m", 1e-3), ("Ncm", "N m", 1e-2), ("N m s/rad", "N m s/rad", 1.0),
    ("kg m^2", "kg m^2", 1.0), ("1/s", "1/s", 1.0), ("%", "1", 0.01), ("N/(m/s)", "N s/m", 1.0),
    ("N/(mm/s)", "N s/m", 1e3), ("rad/(s K)", "rad/(K s)", 1.0), ("Pa", "Pa", 1.0),
    ("bar", "Pa", 1e5), ("J", "J", 1.0), ("krad", "rad", 1e3), ("u/min", "rad/s", 2 * pi / 60),
    ("Sec", "s", 1.0), ("-", "1", 1.0),
])  # fmt: skip
def test_unit_becomes_si(text: str, si: str, factor: float) -> None:
    found = unit(text)
    assert found.si == si
    assert found.factor == pytest.approx(factor, rel=1e-14)


def test_what_is_no_unit_is_none() -> None:
    strange = ("parsec", "counts", "N/", "mmm", "kmin", "x y", "3", "m^m", "degF", "N (s/m)^d")
    assert [*map(unit, strange)] == [None] * len(strange)


def test_short_form_reaches_every_canonical_channel() -> None:
    given = by_channel("read", "deg, N mm")
    assert given == {"x": "deg", "v": "deg/s", "a": "deg/s^2", "force": "N mm", "F": "N mm"}
    assert by_channel("read", "ms, mm, mm/s, kN")["t"] == "ms"
    assert by_channel("read", "rpm, N m")["x"] == "rad"


def test_units_need_no_brackets_unless_they_may_be_names() -> None:
    assert all(map(is_common, ("mm", "N", "Nm", "rad/s", "sec", "1/s")))
    assert not any(map(is_common, ("d", "a", "t", "T", "rot", "bar", "counts")))
