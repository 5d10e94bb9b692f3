"""Smooth Coulomb and viscous friction."""

from math import atanh, inf, pi, sqrt

import casadi as ca
import pytest
from hypothesis import given
from hypothesis import strategies as st

from symfric import Coulomb, Viscous
from symfric.laws import PowerLawViscous


@pytest.mark.parametrize("share", [0.1, 0.5, 0.9])
def test_a_load_below_the_level_is_carried_at_the_stated_creep(share: float) -> None:
    creep = 1e-3 * atanh(share)
    assert Coulomb(mu_d=0.2, v_eps=1e-3).force(creep, 5.0) == pytest.approx(share, rel=1e-14)


@pytest.mark.parametrize("v", [-1e-2, 1e-2])
def test_level_is_reached_as_the_smoothing_shrinks(v: float) -> None:
    forces = [Coulomb(mu_d=0.2, v_eps=eps).force(v, 5.0) for eps in (1e-2, 3e-3, 1e-4)]
    errors = [abs(abs(F) - 1.0) for F in forces]
    assert errors[0] > errors[1] > errors[2] == 0.0
    assert forces[-1] * v > 0


@pytest.mark.parametrize("N", [0.0, 1.0, 1e3])
def test_viscous_friction_does_not_see_the_load(N: float) -> None:
    assert Viscous(sigma_2=3.0).force(-0.5, N) == -1.5


@pytest.mark.parametrize(
    ("shape", "slope", "far"),
    [
        ("tanh", 1.0, 1.0),
        ("atan", 2 / pi, 0.937),
        ("erf", 2 / sqrt(pi), 1.0),
        ("sqrt", 1.0, 0.995),
        ("saturation", 1.0, 1.0),
        ("quadratic", 2.0, 1.0),
    ],
)
def test_shape_has_the_tabulated_slope_and_reach(shape: str, slope: float, far: float) -> None:
    v = ca.SX.sym("v")
    law = Coulomb(mu_d=0.2, v_eps=1e-3, shape=shape)
    found = ca.Function("slope", [v], [ca.gradient(law.force(v, 5.0), v)])
    assert float(found(0.0)) == pytest.approx(slope * 1.0 / 1e-3, rel=1e-14)
    assert law.force(1e-2, 5.0) == pytest.approx(far, abs=6e-4)


@pytest.mark.parametrize("shape", ["tanh", "atan", "quadratic"])
def test_without_width_it_is_the_sign_itself(shape: str) -> None:
    law = Coulomb(mu_d=0.2, v_eps=0.0, shape=shape)
    assert [law.force(v, 5.0) for v in (-1e-300, 0.0, 1e-9, 7.0)] == [-1.0, 0.0, 1.0, 1.0]
    assert law.velocity_scale == inf


def test_unknown_shape_is_refused() -> None:
    with pytest.raises(ValueError, match=r"Coulomb: shape: expected one of tanh, atan, .* 'cubic'"):
        Coulomb(shape="cubic")


@given(v=st.floats(-1e3, 1e3), N=st.floats(0.0, 100.0))
def test_exponent_one_is_linear_viscous_friction(v: float, N: float) -> None:
    assert PowerLawViscous(0.4, d=1.0).force(v, N) == Viscous(0.4).force(v, 1.0)


@pytest.mark.parametrize("d", [0.5, 1.5, 2.0, 3.0])
@pytest.mark.parametrize("v", [-0.1, 1e-2])
def test_power_law_misses_the_original_by_the_stated_part(d: float, v: float) -> None:
    F = PowerLawViscous(0.4, d=d, v_eps=1e-4).force(v, 1.0)
    ratio = abs(F) / (0.4 * abs(v) ** d)
    assert ratio - 1 == pytest.approx((d - 1) / 2 * (1e-4 / v) ** 2, rel=1e-3)
    assert F * v > 0
