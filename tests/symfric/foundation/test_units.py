"""Units as text, and those of contacts that turn."""

from dataclasses import replace
from math import pi, sqrt

import numpy as np
import pytest
from scipy import constants

from symfric import ALL_LAWS, Output, Variable, parameters
from symfric.foundation.units import clock, in_si, nearest, readable, turned, written
from symfric.scenes import ALL_SCENES


def test_every_unit_of_sliding_has_one_of_turning() -> None:
    """Joints that turn showed m/s and N for rad/s and N m, in the header of their C, too."""
    known = {
        "m/s": "rad/s", "N": "N m", "N s/m": "N m s/rad", "N/m": "N m/rad", "m": "rad",
        "s/m": "s/rad", "1/m": "1/rad", "m/s^2": "rad/s^2", "N s^2/m^2": "N m s^2/rad^2",
        "N (s/m)^d": "N m (s/rad)^d", "N/s": "N m/s", "kg": "kg m^2", "1": "1", "s": "s", "W": "W",
        "rad/s": "rad/s", "N m": "N m", "1/(N m)": "1/(N m)", "N m s/rad": "N m s/rad", "K": "K",
    }  # fmt: skip
    assert {unit: turned(unit) for unit in known} == known
    units = {p.unit for kind in ALL_LAWS.values() for p in parameters(kind()).values()}
    for unit in units - {"1", "s", "K", "degC", "rad", "1/s", "Pa s"}:
        assert "rad" in turned(unit) or "N m" in turned(unit), unit
        assert turned(turned(unit)) == turned(unit)


SI = (
    "m", "m/s", "m/s^2", "N", "N m", "N s/m", "N s^2/m", "N s^2/m^2", "kg", "kg m^2", "1", "",
    "1/s", "1/(N m)", "rad/(s K)", "N (s/m)^d", "m s^-2", "Pa/m", "mol", "degC", "K", "V", "Ohm",
    "V s/rad", "W/(m K)", "N/Hz^0.5", "m^(1/2)", "J", "counts", "LSB", "1/rad",
)  # fmt: skip


def test_units_of_the_si_are_one_and_written_as_they_are() -> None:
    for text in SI:
        assert (in_si(text), written(text)) == (1.0, text)


def test_other_ways_to_write_a_unit_are_taken() -> None:
    for text, same in (
        ("N*s/m", "N s/m"), ("kg·m²", "kg m^2"), ("Nm", "N m"), ("Nms/rad", "N m s/rad"),
        ("m/s2", "m/s^2"), ("kg.m2", "kg m^2"), ("N.m/rad", "N m/rad"), ("m·s⁻¹", "m s^-1"),
        ("m**2", "m^2"), ("µm", "um"), ("°C", "degC"), ("°/s", "deg/s"), ("V/√Hz", "V/Hz^0.5"),
        (" N  m / s ", "N m/s"), ("-", "1"), ("kgm^2", "kg m^2"), ("As", "A s"),
    ):  # fmt: skip
        assert written(text) == same
        assert in_si(text) == in_si(same) is not None


def test_sizes_are_those_of_the_prefixes() -> None:
    for text, size in (
        ("mm/s", 1e-3), ("um", 1e-6), ("%", 0.01), ("rpm", pi / 30), ("deg/s^2", pi / 180),
        ("km/h", 1 / 3.6), ("N/mm^2", 1e6), ("m/s/ms", 1e3), ("1/min", 1 / 60), ("mol/L", 1e3),
        ("mN m", 1e-3), ("10 N", 10.0), ("1e-3 m", 1e-3), ("ms", 1e-3), ("min", 60.0),
        ("mm^(1/2)", sqrt(1e-3)), ("mm^(2/1)", 1e-6),
        ("u/min", pi / 30),
    ):  # fmt: skip
        assert in_si(text) == pytest.approx(size, rel=1e-14), text


def test_an_invalid_unit_is_reported_with_the_intended_one() -> None:
    for text, meant in (
        ("m/sec", "m/s"), ("newton", "N"), ("Newton meters", "N m"), ("rad/sec", "rad/s"),
        ("meters per second", "m/s"), ("Kg", "kg"), ("N-m", "N m"), ("[m/s]", "m/s"), ("hz", "Hz"),
        ("degrees", "deg"), ("furlong", ""), ("m//s", ""), ("(m", ""), ("N/", ""), ("m,s", ""),
        ("m)", ""), ("N (mm/s)^d", ""),
    ):  # fmt: skip
        assert in_si(text) is None
        assert nearest(text) == meant


SCIPY = {
    "degF": "degree_Fahrenheit", "deg": "degree", "arcmin": "arcmin", "arcsec": "arcsec",
    "min": "minute", "h": "hour", "d": "day", "week": "week", "year": "Julian_year", "in": "inch",
    "ft": "foot", "lb": "pound", "lbf": "lbf", "kgf": "kgf", "psi": "psi", "atm": "atm",
    "mmHg": "mmHg", "hp": "hp", "bar": "bar", "cal": "calorie", "L": "liter", "t": "metric_ton",
}  # fmt: skip


def test_units_outside_the_si_are_as_large_as_scipy_has_them() -> None:
    for text, name in SCIPY.items():
        assert in_si(text) == pytest.approx(getattr(constants, name), rel=1e-6), text


def test_a_misspelt_unit_is_warned_of_once_in_the_line_that_has_it() -> None:
    with pytest.warns(
        UserWarning, match=r"variable 'v': .*got 'm/seconds'; write 'm/s'"
    ) as reported:
        v = Variable("v", "m/seconds")
    assert reported[0].filename == __file__
    replace(v, start=1.0)  # a second warning would be an error here
    with pytest.warns(UserWarning, match="Output: .*got 'smoots'; write '1' for counts"):
        Output(v, "smoots")


def test_all_units_of_the_package_are_si() -> None:
    units = {p.unit for kind in ALL_LAWS.values() for p in parameters(kind()).values()}
    units |= {s.unit for kind in ALL_LAWS.values() for s in (*kind().states, *kind().inputs)}
    for scene in ALL_SCENES.values():
        units |= {p.unit for p in parameters(scene(ALL_LAWS["brown_mcphee"]())).values()}
    assert {unit for unit in units if in_si(unit) != 1.0 or written(unit) != unit} == set()


@pytest.mark.parametrize(
    ("unit", "top", "expected", "size"),
    [
        ("m/s", 0.0024, "mm/s", 1e-3), ("m", 3e-6, "µm", 1e-6), ("m", 7e-5, "µm", 1e-6),
        ("m", 9e-5, "mm", 1e-3),  # 0.09, not 90 of the next
        ("m", 2e-9, "nm", 1e-9), ("m", 1e-14, "nm", 1e-9), ("N", 0.15, "N", 1.0),
        ("N", 1500.0, "N", 1.0), ("N", 3e4, "kN", 1e3), ("J", 2e7, "MJ", 1e6),
        ("Pa", 3.4e7, "MPa", 1e6), ("1", 1e-9, "1", 1.0), ("", 1e-9, "", 1.0), ("m", 0.0, "m", 1.0),
    ],
)  # fmt: skip
def test_the_largest_magnitude_chooses_the_prefix(
    unit: str, top: float, expected: str, size: float
) -> None:
    factor, found = readable(unit, [[0.0, -top], [0.1 * top, np.nan, np.inf]])
    assert (found, factor) == (expected, pytest.approx(1 / size))
    assert readable("m", []) == readable("m", [[]]) == (1.0, "m")


def test_long_times_are_printed_in_hours_days_and_years() -> None:
    for last, expected, reported in (
        (60.0, "s", 60.0), (2.1e4, "s", 2.1e4), (36000.0, "h", 10.0), (864000.0, "days", 10.0),
        (500 * 365.25 * 86400.0, "years", 500.0),
    ):  # fmt: skip
        factor, unit = clock([0.0, np.nan, last])
        assert (unit, factor * last) == (expected, pytest.approx(reported))
    assert clock([]) == (1.0, "s")
