"""Lag, temperature and normalised load around a law."""

import casadi as ca
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rigs import prescribed_motion

from symfric import (
    Asymmetric,
    Coulomb,
    LoadDependent,
    LuGre,
    Stribeck,
    Sum,
    Viscous,
    parameters,
    rabinowicz,
    simulate,
)
from symfric.foundation.parameters import with_values
from symfric.foundation.status import SolveError, Status
from symfric.laws import (
    ALL_LAWS,
    GMS,
    Bittencourt,
    ExactCoulomb,
    HaessigFriedland,
    Karnopp,
    Lagged,
    LoadNormalised,
    LuGreNormalised,
    Table,
    TemperatureDependent,
)
from symfric.laws.composed.wrap import Wrapper
from symfric.scenes import FourBar, SliderCrank

N = 7.848


@given(v=st.floats(-0.1, 0.1), w=st.floats(-0.1, 0.1))
def test_lagged_force_is_that_of_the_velocity_it_follows(v: float, w: float) -> None:
    law, z = Lagged(Stribeck(), tau_L=0.02), np.array([w])
    assert law.force(v, N, z) == Stribeck().force(w, N)
    assert law.rate(v, N, z)[0] == pytest.approx((v - w) / 0.02)
    assert law.force(v, N, law.steady_state(v, N)) == Stribeck().force(v, N)


def test_force_lags_behind_a_swinging_velocity_as_a_filter_does() -> None:
    """Viscous friction shows the velocity that it follows, in closed form."""
    w, tau = 2 * np.pi * 5, 0.02
    law = Lagged(Viscous(sigma_2=2.0), tau_L=tau)
    model = prescribed_motion(law, N, lambda t: 0.1 * ca.sin(w * t))
    run = simulate(model, 1.0, rtol=1e-9, samples=5001)
    late = run.t > 0.5
    expected = 0.2 * np.sin(w * run.t - np.arctan(w * tau)) / np.hypot(1, w * tau)
    assert run["friction"][late] == pytest.approx(expected[late], abs=1e-6)


def test_lag_opens_a_loop_around_the_stribeck_curve() -> None:
    law = Lagged(Stribeck(v_s=1e-3), tau_L=5e-3)
    model = prescribed_motion(law, N, lambda t: 3e-3 + 2e-3 * ca.sin(20 * t))
    run = simulate(model, 1.0, rtol=1e-8, samples=5001)
    speeding = np.gradient(run["v"], run.t) > 0
    near = (np.abs(run["v"] - 2e-3) < 2e-5) & (run.t > 0.3)
    up, down = run["friction"][near & speeding].mean(), run["friction"][near & ~speeding].mean()
    assert up > Stribeck(v_s=1e-3).force(2e-3, N) > down


def test_lagged_law_runs_in_a_scene() -> None:
    run = simulate(rabinowicz(Lagged(Coulomb(), tau_L=1e-4)), 5.0, rtol=1e-6)
    assert run["x"].max() == pytest.approx(0.4354, abs=0.01)


def test_law_with_states_is_not_lagged() -> None:
    with pytest.raises(ValueError, match="Lagged: expected a law without states, got LuGre"):
        Lagged(LuGre())
    assert [i.name for i in Lagged(Karnopp()).inputs] == ["F_e"]


@given(T=st.floats(253.15, 353.15), v=st.floats(-0.1, 0.1))
def test_coefficients_fall_exponentially_with_the_temperature(T: float, v: float) -> None:
    parts = Sum((Coulomb(mu_d=0.1), Viscous(sigma_2=3.0)))
    law = TemperatureDependent(parts, T=T, k_dry=0.002, k_wet=0.03)
    rise = T - 293.15
    expected = Coulomb(mu_d=0.1).force(v, N) * np.exp(-0.002 * rise)
    expected += 3.0 * v * np.exp(-0.03 * rise)
    assert law.force(v, N) == pytest.approx(expected, rel=1e-12, abs=1e-300)


@given(v=st.floats(-0.1, 0.1), z=st.floats(-1e-5, 1e-5))
def test_at_the_reference_temperature_it_is_the_law(v: float, z: float) -> None:
    law, state = LuGre(sigma_2=0.4), np.array([z])
    wrapped = TemperatureDependent(law)
    assert wrapped.force(v, N, state) == law.force(v, N, state)
    assert wrapped.rate(v, N, state) == law.rate(v, N, state)


def test_steady_state_and_names_are_those_of_the_law() -> None:
    law = TemperatureDependent(LuGre(), T=313.15, k_dry=0.01)
    assert law.steady_state(0.1, N)[0] == pytest.approx(0.1 * N / 1e5 * np.exp(-0.2))
    assert list(parameters(law))[:4] == ["T", "T_0", "k_dry", "k_wet"]
    assert [s.name for s in law.states] == ["z"]


def test_temperature_may_be_a_symbol() -> None:
    T = ca.SX.sym("T")
    law = TemperatureDependent(Viscous(sigma_2=2.0), T=T)
    F = ca.Function("F", [T], [law.force(0.1, N)])
    assert float(F(303.15)) == pytest.approx(0.2 * np.exp(-0.3))


def test_every_law_feels_the_temperature_by_the_roles_of_its_parameters() -> None:
    """Chosen by docstrings before: laws with F_S, C_e, K_v or mu_v in s/m felt nothing."""
    for name, kind in ALL_LAWS.items():
        law = kind()
        warm = TemperatureDependent(law, T=303.15, k_dry=0.01, k_wet=0.03).inner
        share = {"level": np.exp(-0.1), "viscous": np.exp(-0.3)}
        for key, p in parameters(law).items():
            expected = float(p.value) * share.get(p.role, 1.0)
            assert float(parameters(warm)[key].value) == pytest.approx(expected), (name, key)
        assert {"level", "viscous"} & {p.role for p in parameters(law).values()}, name
    kept = parameters(TemperatureDependent(Bittencourt(), k_dry=0.1, T=300.0).inner)
    assert kept["T"].value == Bittencourt().T  # a temperature of the law is no coefficient


def test_law_without_levels_has_no_temperature() -> None:
    with pytest.raises(ValueError, match=r"expected a law with a dry level .* got Table"):
        TemperatureDependent(Table((0.0, 1.0), (0.1, 0.2)))


def test_wrappers_hand_on_all_members_of_the_law_inside() -> None:
    law = GMS(form="event", sigma_2=0.4)
    z, v, load, h = law.steady_state(0.01, N) * 0.5, 0.01, N, 1e-3
    around: tuple[Wrapper, ...] = (
        Asymmetric(law, with_values(law, {})),
        LoadDependent(law, N_eps=0.0),
        TemperatureDependent(law),
    )
    for wrapper in around:
        assert wrapper.states == law.states
        assert wrapper.inputs == law.inputs
        assert wrapper.velocity_scale == law.velocity_scale
        assert wrapper.warnings() == law.warnings()
        assert wrapper.force(v, load, z) == law.force(v, load, z)
        assert (wrapper.rate(v, load, z) == law.rate(v, load, z)).all()
        assert (wrapper.steady_state(v, load) == law.steady_state(v, load)).all()
        steps = wrapper.held_step(v, load, z, h), law.held_step(v, load, z, h)
        assert all((a == b).all() for a, b in zip(*steps, strict=True))  # type: ignore[arg-type]
        for one, other in zip(wrapper.switches(v, load, z), law.switches(v, load, z), strict=True):
            assert (one.name, one.direction) == (other.name, other.direction)
            assert one.expression == other.expression
    lagged = Lagged(Karnopp(), tau_L=0.01)
    assert (lagged.inputs, lagged.velocity_scale) == (Karnopp().inputs, Karnopp().velocity_scale)
    assert lagged.switches(v, load, np.array([v])) == ()
    assert lagged.held_step(v, load, np.array([v]), h) is None


def test_lugre_becomes_its_own_load_normalised_form() -> None:
    ours = LoadNormalised(LuGre(sigma_2=0.4), N_0=5.0)
    other = LuGreNormalised(sigma_0=1e5 / 5, sigma_1=190.0 / 5, sigma_2=0.4 / 5)
    for v, N, z in ((0.01, 3.0, 1e-6), (-0.3, 700.0, 2e-5), (1e-4, 0.0, -1e-6)):
        assert float(ours.force(v, N, z)) == pytest.approx(float(other.force(v, N, z)), rel=1e-12)
        assert ours.rate(v, N, z)[0] == pytest.approx(other.rate(v, N, z)[0], rel=1e-12)
        assert ours.steady_state(v, N)[0] == pytest.approx(other.steady_state(v, N)[0], rel=1e-12)
        assert ours.sliding(v, N, 1) == pytest.approx(other.sliding(v, N, 1), rel=1e-12)
        assert ours.static_level(N) == pytest.approx(other.static_level(N), rel=1e-12)


def test_at_its_load_it_is_the_law_itself_and_a_proportional_static_law_anywhere() -> None:
    law = GMS(form="event", sigma_2=0.4)
    ours, v = LoadNormalised(law, N_0=8.0), 0.01
    z = 0.5 * law.steady_state(v, 8.0)
    assert ours.force(v, 8.0, z) == law.force(v, 8.0, z)
    assert (ours.rate(v, 8.0, z) == law.rate(v, 8.0, z)).all()
    assert [s.name for s in ours.switches(v, 8.0, z)] == [s.name for s in law.switches(v, 8.0, z)]
    dry = Stribeck()
    speeds = np.linspace(-0.1, 0.1, 7)
    np.testing.assert_allclose(
        LoadNormalised(dry, N_0=3.0).force(speeds, 70.0), dry.force(speeds, 70.0), rtol=1e-12
    )


def test_laws_that_rest_by_the_applied_force_are_refused() -> None:
    with pytest.raises(ValueError, match="LoadNormalised: expected a law of v and N, got ExactC"):
        LoadNormalised(ExactCoulomb())
    with pytest.raises(ValueError, match="expected a law such as LuGre"):
        LoadNormalised("lugre")  # type: ignore[arg-type]


def test_bristles_that_stop_a_crank_go_on() -> None:
    for law in (LuGre(), HaessigFriedland()):
        with pytest.raises(SolveError):
            simulate(SliderCrank(law).model(), 0.02)
        run = simulate(SliderCrank(LoadNormalised(law, N_0=4700.0)).model(), 0.02)
        assert run.status is Status.SUCCESS, law
        assert np.abs(run["crank_friction"] / run["crank_N"]).max() < 0.3


def test_the_advice_for_bristles_stands_once_and_can_be_copied() -> None:
    run = simulate(FourBar(LuGre()).model(), 0.1, throw=False)
    assert not run.status.ok
    assert run.message.count("keep the deflection") == 1
    assert "joints theta_crank, theta_coupler, theta_rocker" in run.message
    begin = run.message.index("LoadNormalised(")
    line = run.message[begin : run.message.index(" for LuGre", begin)].replace("...", "")
    advised = eval(line, {"LoadNormalised": LoadNormalised, "LuGre": LuGre})
    assert simulate(FourBar(advised).model(), 0.1).status is Status.SUCCESS
