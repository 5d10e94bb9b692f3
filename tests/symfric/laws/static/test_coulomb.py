"""Smooth Coulomb and viscous friction."""

from math import atanh

import pytest

from symfric import Coulomb, Viscous


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
