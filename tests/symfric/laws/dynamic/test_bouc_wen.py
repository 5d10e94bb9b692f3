"""Bouc-Wen element: virgin curves, Dahl, Maxwell element, dissipation, refusals."""

from math import tanh

import casadi as ca
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rigs import prescribed_motion, through

from symfric import Dahl, simulate
from symfric.laws import BoucWen, MaxwellSlip, Slider

N, LEVEL, REACH = 7.848, 0.7848, 7.848e-6


@pytest.mark.parametrize(("n", "share"), [(1.0, 0.632), (2.0, 0.762), (10.0, 0.937), (50.0, 0.986)])
def test_virgin_curve_has_the_published_shares_at_the_corner(n: float, share: float) -> None:
    model = prescribed_motion(BoucWen(n=n), N, lambda t: ca.SX(REACH))
    assert simulate(model, 1.0, rtol=1e-9).final["z"] == pytest.approx(share, abs=5.1e-4)


@given(x=st.floats(0.01, 3.0))
def test_virgin_curve_of_exponent_two_is_a_hyperbolic_tangent(x: float) -> None:
    model = prescribed_motion(BoucWen(), N, lambda t: ca.SX(REACH))
    run = simulate(model, x, rtol=1e-9, samples=2)
    assert run.final["friction"] == pytest.approx(LEVEL * tanh(x), rel=1e-6)


@given(v=st.floats(-0.1, 0.1), z=st.floats(-1.2, 1.2))
def test_without_gamma_and_with_exponent_one_it_is_dahl(v: float, z: float) -> None:
    law = BoucWen(n=1.0, beta=1.0, gamma=0.0, z_eps=1e-12)
    rate = REACH * law.rate(v, N, np.array([z]))[0]
    assert rate == pytest.approx(Dahl().rate(v, N, np.array([z * REACH]))[0], abs=1e-11 * abs(v))


def test_unloading_is_elastic_with_equal_shares() -> None:
    for z in (0.1, 0.5, 1.0):
        assert BoucWen().rate(-0.02, N, np.array([z]))[0] * REACH == pytest.approx(-0.02, rel=1e-12)


def test_steady_state_follows_the_scale() -> None:
    law = BoucWen(A=2.0, beta=0.9, gamma=0.1, n=3.0)
    run = simulate(prescribed_motion(law, N, lambda t: ca.SX(-1e-4)), 1.0, rtol=1e-9)
    assert run.final["z"] == pytest.approx(-(2.0 ** (1 / 3)), rel=1e-8)


def test_sharp_element_is_one_of_maxwell_slip() -> None:
    velocity = through([0.0, 3e-5, -1e-5, 2e-5], 1.0)
    element = MaxwellSlip((Slider(1e5, 0.1),), n=100.0)
    one, other = (
        simulate(prescribed_motion(law, N, velocity), 3.0, rtol=1e-9)["friction"]
        for law in (BoucWen(n=100.0), element)
    )
    assert one == pytest.approx(other, abs=1e-7)


@pytest.mark.parametrize("gamma", [-0.4, 0.0, 0.5])
@pytest.mark.parametrize("amplitude", [1e-6, 3e-5])
def test_settled_cycle_dissipates(gamma: float, amplitude: float) -> None:
    points = [0.0, *4 * [amplitude, -amplitude], amplitude]
    model = prescribed_motion(BoucWen(gamma=gamma), N, through(points, 1.0))
    run = simulate(model, 9.0, t_eval=[7.0, 9.0], rtol=1e-10)
    stored = LEVEL * REACH * run["z"] ** 2 / 2
    assert run["work"][1] - run["work"][0] > abs(stored[1] - stored[0])


def test_shape_that_gives_energy_is_refused() -> None:
    with pytest.raises(ValueError, match=r"-beta < gamma <= beta, got gamma = 0.7 and beta = 0.5"):
        BoucWen(gamma=0.7)
    with pytest.raises(ValueError, match=r"gamma = -0\.6"):
        BoucWen(gamma=-0.6)
