"""Prefixes make numbers readable and change nothing."""

import numpy as np
import pytest

from symfric.foundation.units import clock, readable


@pytest.mark.parametrize(
    ("unit", "top", "expected"),
    [
        ("m/s", 0.0024, "mm/s"),
        ("m", 3e-6, "µm"),
        ("m", 9e-5, "mm"),  # 0.09, not 90 of the next
        ("m", 7e-5, "µm"),
        ("m", 2e-9, "nm"),
        ("m", 1e-14, "nm"),
        ("N", 0.15, "N"),
        ("N", 1500.0, "N"),
        ("N", 3e4, "kN"),
        ("J", 2e7, "MJ"),
        ("Pa", 3.4e7, "MPa"),
        ("1", 1e-9, "1"),
        ("", 1e-9, ""),
        ("m", 0.0, "m"),
    ],
)
def test_the_largest_magnitude_chooses_the_prefix(unit: str, top: float, expected: str) -> None:
    factor, found = readable(unit, [[0.0, -top], [0.1 * top, np.nan, np.inf]])
    assert found == expected
    size = {"mm/s": 1e-3, "mm": 1e-3, "µm": 1e-6, "nm": 1e-9, "kN": 1e3, "MJ": 1e6, "MPa": 1e6}.get(
        expected, 1.0
    )
    assert factor == pytest.approx(1 / size)


def test_nothing_at_all_stays_as_it_is() -> None:
    assert readable("m", []) == (1.0, "m")
    assert readable("m", [[]]) == (1.0, "m")


@pytest.mark.parametrize(
    ("last", "expected", "told"),
    [
        (60.0, "s", 60.0),
        (2.1e4, "s", 2.1e4),
        (36000.0, "h", 10.0),
        (10 * 86400.0, "days", 10.0),
        (500 * 365.25 * 86400.0, "years", 500.0),
    ],
)
def test_long_times_are_told_in_hours_days_and_years(
    last: float, expected: str, told: float
) -> None:
    factor, unit = clock([0.0, np.nan, last])
    assert unit == expected
    assert factor * last == pytest.approx(told)
    assert clock([]) == (1.0, "s")
