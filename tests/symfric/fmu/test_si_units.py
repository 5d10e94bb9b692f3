"""Units from text."""

import pytest

from symfric.foundation.units import exponents, per_second


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("1", {}),
        ("N", {"kg": 1, "m": 1, "s": -2}),
        ("kg m^2", {"kg": 1, "m": 2}),
        ("N m s/rad", {"kg": 1, "m": 2, "s": -1, "rad": -1}),
        ("1/(N m)", {"kg": -1, "m": -2, "s": 2}),
        ("rad/(s K)", {"s": -1, "K": -1, "rad": 1}),
        ("N s^2/m^2", {"kg": 1, "m": -1}),
        ("(m)/s", {"m": 1, "s": -1}),
        ("N (s/m)^d", None),
        ("furlong", None),
        ("m/s/s", {"m": 1, "s": -2}),
    ],
)
def test_products_of_units_have_exponents(text, expected):
    assert exponents(text) == expected


@pytest.mark.parametrize(
    ("text", "same"),
    [
        ("J", "N m"), ("W", "J/s"), ("Pa", "N/m^2"), ("Hz", "1/s"), ("V", "W/A"), ("C", "A s"),
        ("N", "kg m/s^2"),
    ],
)  # fmt: skip
def test_names_of_units_are_what_they_stand_for(text, same):
    assert exponents(text) == exponents(same)


@pytest.mark.parametrize(
    ("text", "expected"),
    [("m", "m/s"), ("m/s", "m/s^2"), ("1", "1/s"), ("rad/(s K)", "rad/(s K s)")],
)
def test_units_of_rates_are_units(text, expected):
    assert per_second(text) == expected
    assert exponents(per_second(text)) is not None
