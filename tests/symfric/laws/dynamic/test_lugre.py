"""LuGre friction: against Dahl, in steady sliding, at break-away and in power."""

import casadi as ca
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from oracles import stribeck_curve
from rigs import prescribed_motion

from symfric import Dahl, LuGre, Trajectory, drive, rabinowicz, simulate
from symfric.laws import ElastoPlastic, LuGreNormalised, LuGrePassive

N = 7.848


@given(v=st.floats(-0.1, 0.1), z=st.floats(-1e-5, 1e-5))
def test_without_excess_damping_and_viscosity_it_is_dahl(v: float, z: float) -> None:
    law, dahl, state = LuGre(mu_s=0.1, sigma_1=0.0), Dahl(), np.array([z])
    assert law.force(v, N, state) == pytest.approx(dahl.force(v, N, state), rel=1e-14, abs=1e-300)
    expected = dahl.rate(v, N, state)[0]
    assert law.rate(v, N, state)[0] == pytest.approx(expected, rel=1e-12, abs=1e-14 * abs(v))


@pytest.mark.parametrize("v", [-0.2, -1e-3, 1e-5, 5e-4, 0.05])
@pytest.mark.parametrize("delta", [0.78, 1.0, 2.0])
def test_long_sliding_ends_on_the_stribeck_curve(v: float, delta: float) -> None:
    law = LuGre(delta=delta, sigma_2=0.4)
    run = simulate(prescribed_motion(law, N, lambda t: ca.SX(v)), 5e-4 / abs(v), rtol=1e-9)
    expected = stribeck_curve(v, N, 0.15, 0.1, 1e-3, delta, 0.4)
    assert run.final["friction"] == pytest.approx(expected, rel=1e-6 if delta == 2.0 else 1e-4)


def break_away(rate: float) -> Trajectory:
    """The block of the Rabinowicz scene, pulled from rest with a force rising at `rate` [N/s]."""
    model = drive(LuGre())
    return simulate(model, 2.4 / rate, u={"force": lambda t: rate * t}, rtol=1e-8, samples=20_001)


@pytest.mark.parametrize(("rate", "peak"), [(0.1, 1.166), (1.0, 1.125), (10.0, 0.961)])
def test_break_away_force_has_the_published_value(rate: float, peak: float) -> None:
    assert break_away(rate)["friction"].max() == pytest.approx(peak, abs=5.1e-4)


def test_break_away_force_falls_with_the_loading_rate() -> None:
    """Friction up to twice the Stribeck velocity; 0.636 and 0.445 N from an independent Radau."""
    found = []
    for rate in (0.1, 1.0, 10.0, 100.0, 1000.0):
        run = break_away(rate)
        found.append(run["friction"][: np.argmax(run["v"] > 2e-3) + 1].max())
    assert (np.diff(found) < 0).all()
    assert found[3:] == pytest.approx([0.636, 0.445], abs=1e-3)


def test_stiction_loads_the_bristle_like_a_spring() -> None:
    run = simulate(drive(LuGre()), 5.0, u={"force": 0.5}, rtol=1e-8)
    assert run.final["z"] == pytest.approx(0.5 / 1e5, rel=1e-6)
    assert run.final["friction"] == pytest.approx(0.5, rel=1e-6)
    assert abs(run.final["v"]) < 1e-9


def test_bristle_at_rest_keeps_its_load() -> None:
    assert LuGre().rate(0.0, N, np.array([1e-5]))[0] == 0.0
    assert LuGre(v_eps=0.0).rate(0.0, N, np.array([1e-5]))[0] == 0.0


@pytest.mark.parametrize("amplitude", [2e-6, 5e-3])
@pytest.mark.parametrize("frequency", [1.0, 10.0])
def test_settled_closed_cycle_dissipates(amplitude: float, frequency: float) -> None:
    w = 2 * np.pi * frequency
    model = prescribed_motion(LuGre(), N, lambda t: amplitude * w * ca.cos(w * t))
    ends = [simulate(model, k / frequency, rtol=1e-8, samples=2).final for k in (2, 3)]
    work = ends[1]["work"] - ends[0]["work"]
    stored = 0.5 * 1e5 * (ends[1]["z"] ** 2 - ends[0]["z"] ** 2)
    assert work > stored
    assert work > 0


def test_wide_cycle_takes_the_work_of_the_dynamic_level() -> None:
    w = 2 * np.pi
    model = prescribed_motion(LuGre(), N, lambda t: 5e-3 * w * ca.cos(w * t))
    ends = [simulate(model, k, rtol=1e-8, samples=2).final["work"] for k in (2.0, 3.0)]
    assert ends[1] - ends[0] == pytest.approx(4 * 5e-3 * 0.1 * N, rel=5e-3)


def force_after_a_jump(law: LuGre) -> float:
    """Force at 0.1 m/s with the bristle as it was in creep."""
    return float(law.force(0.1, N, law.steady_state(1e-5, N)))


def test_jump_in_velocity_shows_where_the_law_is_passive() -> None:
    bound = 190.0 * (0.15 - 0.1) / 0.1
    assert force_after_a_jump(LuGre()) < 0
    assert force_after_a_jump(LuGre(sigma_2=bound)) > 0


def test_smoothing_above_the_creep_stretches_the_bristle_beyond_break_away() -> None:
    """The limit that the docstring states: v_eps belongs well below the creep."""
    limit = 0.15 * N
    creep = 2e-6
    for v_eps, expected in ((1e-9, 1.0), (creep, 1 / np.tanh(1.0))):
        model = prescribed_motion(LuGre(v_eps=v_eps), N, lambda t: ca.SX(creep))
        run = simulate(model, 200.0, rtol=1e-8, samples=2)
        assert run.final["z"] * 1e5 == pytest.approx(expected * limit, rel=1e-4)


@given(v=st.floats(-0.1, 0.1), z=st.floats(-1e-5, 1e-5), load=st.floats(0.1, 100.0))
def test_normalised_form_is_lugre_with_coefficients_times_the_load(
    v: float, z: float, load: float
) -> None:
    normalised = LuGreNormalised(sigma_0=1e4, sigma_1=20.0, sigma_2=0.3)
    law = LuGre(sigma_0=1e4 * load, sigma_1=20.0 * load, sigma_2=0.3 * load)
    state = np.array([z])
    rate = law.rate(v, load, state)[0]
    assert normalised.rate(v, load, state)[0] == pytest.approx(rate, rel=1e-12, abs=1e-13 * abs(v))
    scale = load * (1e4 * abs(z) + abs(v))
    force = law.force(v, load, state)
    assert normalised.force(v, load, state) == pytest.approx(force, rel=1e-10, abs=1e-10 * scale)


def test_lifting_off_while_stuck_lets_go_in_the_normalised_form_only() -> None:
    law = LuGreNormalised()
    z = 0.9 * law.steady_state(1e-6, N)
    assert law.force(0.0, N, z) == pytest.approx(0.9 * 0.15 * N, rel=1e-6)
    assert law.force(0.0, 0.0, z) == 0.0
    assert law.force(0.1, 0.0, z) == 0.0
    stuck = 0.9 * LuGre().steady_state(1e-6, N)
    assert LuGre().force(0.0, 1e-9, stuck) == pytest.approx(0.9 * 0.15 * N, rel=1e-6)


@pytest.mark.parametrize("v", [0.05, 0.1, 1.0])
def test_fading_damping_keeps_the_force_from_pointing_forward(v: float) -> None:
    z = LuGre().steady_state(1e-4, N)
    for share in np.linspace(0.0, 1.0, 11):
        assert LuGrePassive().force(v, N, share * z) >= 0
    assert LuGre().force(v, N, z) < -1.0


@given(v=st.floats(-0.1, 0.1), share=st.floats(-1.0, 1.0))
def test_passive_form_never_gives_more_than_it_stores(v: float, share: float) -> None:
    """F v - d(sigma_0 z^2 / 2)/dt >= 0 in every state of the invariant set."""
    law, z = LuGrePassive(v_eps=0.0), np.array([share * 0.15 * N / 1e5])
    stored = 1e5 * z[0] * law.rate(v, N, z)[0]
    assert law.force(v, N, z) * v - stored >= -1e-15


def test_slow_fading_is_lugre() -> None:
    z = np.array([5e-6])
    expected = LuGre(sigma_2=0.4).force(0.02, N, z)
    assert LuGrePassive(sigma_2=0.4, v_d=1e9).force(0.02, N, z) == expected


def test_passivity_is_warned_about_with_the_bound() -> None:
    (warning,) = LuGre().warnings()
    assert "sigma_2 = 0 is below sigma_1 (mu_s - mu_d) / mu_d = 95" in warning
    assert LuGre(sigma_2=95.1).warnings() == ()
    assert LuGrePassive().warnings() == ()
    assert len(LuGreNormalised().warnings()) == 1
    assert LuGre(sigma_1=ca.SX.sym("sigma_1")).warnings() == ()


def test_slow_belts_take_the_block_to_the_static_level_and_no_further() -> None:
    """The default width of |v| was above the creep: 1.35 mu_s N at 1e-5 m/s, 1.6 at 1e-6."""
    for law in (LuGre(), LuGreNormalised(), LuGrePassive(), ElastoPlastic()):
        for belt in (1e-5, 1e-6, 1e-8):
            run = simulate(rabinowicz(law, v_belt=belt), 0.9 / belt, samples=20_001, backend="vm")
            assert np.abs(run["friction"]).max() == pytest.approx(0.15 * N, rel=1e-4)
