"""Units from text."""

import pytest

from symfric.fmu.units import exponents


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
        ("m/s/s", None),
    ],
)
def test_products_of_units_have_exponents(text, expected):
    assert exponents(text) == expected
