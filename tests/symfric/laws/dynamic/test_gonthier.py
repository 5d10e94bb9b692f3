"""Gonthier friction: dwell, saturation, sliding at the level, what the original does."""

from math import exp

import casadi as ca
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rigs import prescribed_motion

from symfric import OverloadWarning, rabinowicz, simulate
from symfric.laws import Gonthier

LOAD = 7.848


@given(v=st.floats(7e-3, 1.0), share=st.floats(-1.0, 1.0), s_dw=st.floats(0.0, 1.0))
def test_in_slip_the_force_is_the_level_whatever_the_bristle(
    v: float, share: float, s_dw: float
) -> None:
    law, level = Gonthier(), LOAD * (0.1 + 0.05 * s_dw)
    z = np.array([share * level / 1e5, s_dw])
    assert law.force(v, LOAD, z) == pytest.approx(level, rel=1e-12)
    assert law.force(-v, LOAD, z) == pytest.approx(-level, rel=1e-12)


@pytest.mark.parametrize("rest", [0.02, 0.1, 0.3, 1.0])
def test_memory_grows_with_the_rest_as_stated(rest: float) -> None:
    law = Gonthier()
    model = prescribed_motion(law, LOAD, lambda t: ca.SX(0.0))
    run = simulate(model, rest, x0={"s_dw": 0.0}, rtol=1e-10, samples=2)
    assert run.final["s_dw"] == pytest.approx(1 - exp(-rest / 0.1), abs=1e-3)


@pytest.mark.parametrize("rest", [0.05, 0.2, 1.0])
def test_break_away_force_follows_the_rest(rest: float) -> None:
    """At rest, then pulled at 1 cm/s: the peak is the level that the rest has reached."""
    velocity = lambda t: ca.if_else(t < rest, ca.SX(0.0), 1e-2)  # noqa: E731
    model = prescribed_motion(Gonthier(), LOAD, velocity)
    run = simulate(model, rest + 0.05, x0={"s_dw": 0.0}, rtol=1e-8, samples=20_001)
    expected = LOAD * (0.1 + 0.05 * (1 - exp(-rest / 0.1)))
    # the memory begins to fade, within sigma_1/sigma_0 = 1.9 ms, as soon as the block slips
    assert run["friction"].max() == pytest.approx(expected, rel=0.02)
    assert run.final["friction"] == pytest.approx(0.1 * LOAD, rel=1e-3)


def test_equal_levels_know_no_rest() -> None:
    z = [np.array([5e-6, s]) for s in (0.0, 1.0)]
    one, other = (Gonthier(mu_s=0.1).force(1e-4, LOAD, x) for x in z)
    assert one == other


def test_creep_is_bounded_by_the_saturation_and_unbounded_without() -> None:
    bent = np.array([190.0 * 1e-6 / (1e-6 * 1e5), 1.0])
    assert Gonthier().force(1e-6, LOAD, bent) == pytest.approx(0.15 * LOAD * 1.001)
    assert Gonthier(kappa=0.0).force(1e-6, LOAD, bent) == pytest.approx(190.0, rel=1e-3)


def test_stick_slip_has_the_published_reach() -> None:
    run = simulate(rabinowicz(Gonthier()), 20.0, x0={"z": 0.0, "s_dw": 0.0}, rtol=1e-8)
    assert run["x"].max() == pytest.approx(0.5745, abs=1e-3)


def test_without_saturation_the_block_is_carried_along_for_ever() -> None:
    model = rabinowicz(Gonthier(kappa=0.0))
    with pytest.warns(OverloadWarning, match="times its static level"):
        run = simulate(model, 20.0, x0={"z": 0.0, "s_dw": 0.0}, rtol=1e-6)
    assert run["x"].max() == pytest.approx(1.99, abs=0.02)


def test_long_dwell_constant_lowers_the_reach() -> None:
    law = Gonthier(tau_dw=5.0)
    run = simulate(rabinowicz(law), 20.0, x0={"z": 0.0, "s_dw": 0.0}, rtol=1e-8)
    assert run["x"].max() == pytest.approx(0.51, abs=0.01)


def test_direction_velocity_above_the_stribeck_velocity_is_refused() -> None:
    with pytest.raises(ValueError, match=r"v_d < v_s, got v_d = 0.001 and v_s = 1e-05"):
        Gonthier(v_d=1e-3, v_s=1e-5)


def test_steady_state_is_what_long_creep_ends_in() -> None:
    """Below v_d it was 0.178 N at 1e-5 m/s where the law goes on to 1.178 N."""
    law = Gonthier()
    for v in (1e-5, -5e-5, 2e-4, 1e-2):
        model = prescribed_motion(law, LOAD, lambda t, v=v: ca.SX(v) + 0 * t)
        rest = {"z": 0.0, "s_dw": 1.0}
        run = simulate(model, 2.0 + 3e-5 / abs(v), x0=rest, rtol=1e-8, samples=2)
        force = law.force(v, LOAD, law.steady_state(v, LOAD))
        assert force == pytest.approx(run.final["friction"], rel=2 * law.kappa)
    stiff = Gonthier(sigma_1=1e-9)  # without damping the bristle rests on the printed branch
    assert stiff.force(5e-5, LOAD, stiff.steady_state(5e-5, LOAD)) == pytest.approx(
        0.15 * LOAD * 0.6875, rel=1e-2
    )
    assert (law.steady_state(0.0, LOAD)[0], law.force(0.0, LOAD, np.array([0.0, 1.0]))) == (0, 0)
