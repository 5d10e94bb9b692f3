"""Prefixes make numbers readable and change nothing."""

import numpy as np
import pytest

from symfric.foundation.prefixes import readable


@pytest.mark.parametrize(
    ("unit", "top", "expected"),
    [
        ("m/s", 0.0024, "mm/s"),
        ("m", 3e-6, "µm"),
        ("m", 2e-9, "nm"),
        ("m", 1e-14, "nm"),
        ("N", 0.15, "N"),
        ("N", 1500.0, "N"),
        ("N", 3e4, "kN"),
        ("J", 2e7, "MJ"),
        ("1", 1e-9, "1"),
        ("", 1e-9, ""),
        ("m", 0.0, "m"),
    ],
)
def test_the_largest_magnitude_chooses_the_prefix(unit: str, top: float, expected: str) -> None:
    factor, found = readable(unit, [[0.0, -top], [0.1 * top, np.nan, np.inf]])
    assert found == expected
    size = {"mm/s": 1e-3, "µm": 1e-6, "nm": 1e-9, "kN": 1e3, "MJ": 1e6}.get(expected, 1.0)
    assert factor == pytest.approx(1 / size)


def test_nothing_at_all_stays_as_it_is() -> None:
    assert readable("m", []) == (1.0, "m")
    assert readable("m", [[]]) == (1.0, "m")
