"""Threlfall friction and its modification: end values, jump and slope."""

from math import exp

import casadi as ca
import pytest
from hypothesis import given
from hypothesis import strategies as st

from symfric import Coulomb, Law
from symfric.laws import ModifiedThrelfall, Threlfall

ORIGINALS = [Threlfall(0.2, v_r=2e-3, form="original"), ModifiedThrelfall(0.2, 2e-3, "original")]


def slope_at_rest(law: Law) -> float:
    v = ca.SX.sym("v")
    return float(ca.Function("slope", [v], [ca.gradient(law.force(v, 5.0), v)])(0.0))


def test_original_never_reaches_the_level_and_jumps_at_the_velocity_error() -> None:
    law = Threlfall(1.0, form="original")
    assert law.force(1e-3, 1.0) == pytest.approx(1 - exp(-3), rel=1e-13)
    jump = law.force(1.000001e-3, 1.0) - law.force(1e-3, 1.0)
    assert jump == pytest.approx(-2.13e-4, abs=1e-6)
    assert law.force(1e3, 1.0) == 0.95


def test_modified_law_reaches_the_level_without_a_jump() -> None:
    law = ModifiedThrelfall(1.0, form="original")
    assert law.force(1e-3, 1.0) == pytest.approx(1.0, rel=1e-13)
    assert law.force(-5.0, 1.0) == pytest.approx(-1.0, rel=1e-13)


@pytest.mark.parametrize(
    ("law", "slope"),
    [
        (ORIGINALS[0], 3.0),
        (ORIGINALS[1], 3.0 / (1 - exp(-3))),
        (Threlfall(0.2, v_r=2e-3), 3.0),
        (ModifiedThrelfall(0.2, v_r=2e-3), 3.0),
    ],
)
def test_slope_at_rest_is_exact_although_the_equation_has_a_modulus(law: Law, slope: float) -> None:
    assert slope_at_rest(law) == pytest.approx(slope * 1.0 / 2e-3, rel=1e-12)


@pytest.mark.parametrize("kind", [Threlfall, ModifiedThrelfall])
@given(v=st.floats(-1.0, 1.0))
def test_smooth_form_is_smooth_coulomb_of_a_third_of_the_width(
    kind: type[Threlfall], v: float
) -> None:
    expected = Coulomb(0.2, v_eps=1e-3).force(v, 5.0)
    assert kind(0.2, v_r=3e-3).force(v, 5.0) == pytest.approx(expected, rel=1e-13, abs=1e-300)
