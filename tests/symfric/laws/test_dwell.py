"""Friction with memory of the time in stick: Armstrong, and rate and state."""

from math import asinh, log

import casadi as ca
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rigs import prescribed_motion
from scipy.integrate import solve_ivp

from symfric import drive, simulate
from symfric.laws import Armstrong, RateAndState
from symfric.scenes import FourMass, Pendulum, PendulumBox

N = 8.0


def test_dwell_follows_its_closed_form() -> None:
    model, t = prescribed_motion(Armstrong(), N, lambda t: ca.SX(0.0)), np.array([0.05, 0.2, 1.0])
    run = simulate(model, 1.0, x0={"q": 0.0}, rtol=1e-10, t_eval=t)
    assert run["q"] == pytest.approx(t / (t + 0.2), rel=1e-7)


def test_force_after_a_step_of_velocity_follows_the_filtered_one() -> None:
    """The lag is that of a first-order filter on the velocity in the Stribeck term."""
    law = Armstrong(mu_a=0.05, mu_inf=0.05, k_t=1e8)
    jump = lambda t: ca.if_else(t < 1.0, ca.SX(1e-3), 5e-3)  # noqa: E731
    run = simulate(prescribed_motion(law, N, jump), 1.1, rtol=1e-9, t_eval=[0.999, 1.01, 1.03])
    w = 5e-3 + (1e-3 - 5e-3) * np.exp(-np.array([0.01, 0.03]) / 0.02)
    expected = N * (0.1 + 0.05 / (1 + (w / 1e-3) ** 2))
    assert run["friction"][0] == pytest.approx(N * 0.125, rel=1e-6)
    assert run["friction"][1:] == pytest.approx(expected, rel=2e-3)


def break_away(rest: float) -> float:
    """Peak of the friction after a rest of the given duration, pulled up within 20 ms."""
    pull = {"force": lambda t: ca.fmin(ca.fmax((t - rest) / 0.02, 0), 1) * 2}
    run = simulate(drive(Armstrong(), N=N), rest + 0.05, u=pull, x0={"q": 0.0}, rtol=1e-8)
    return float(run["friction"].max())


def test_break_away_grows_with_the_rest() -> None:
    peaks = [break_away(rest) for rest in (0.02, 0.2, 2.0)]
    assert (np.diff(peaks) > 0.02).all()
    assert peaks[0] > N * 0.105
    assert peaks[-1] < N * 0.15


ROCK = {"mu_0": 0.6, "a": 0.005, "b": 0.01, "v_0": 1e-6, "D_c": 1e-5}


@given(e=st.floats(-9.0, -1.0), sign=st.sampled_from([1.0, -1.0]))
def test_steady_force_falls_with_the_logarithm_of_the_velocity(e: float, sign: float) -> None:
    law, v = RateAndState(**ROCK), sign * 10.0**e
    force = law.force(v, 2.0, law.steady_state(v, 2.0))
    assert force == pytest.approx(sign * 2.0 * (0.6 - 0.005 * log(abs(v) / 1e-6)), abs=1e-7)


@pytest.mark.parametrize("evolution", ["ageing", "slip"])
def test_velocity_step_raises_by_a_and_settles_by_b(evolution: str) -> None:
    law = RateAndState(**ROCK, evolution=evolution)
    before = law.steady_state(1e-6, 1.0)
    jump = law.force(1e-5, 1.0, before) - law.force(1e-6, 1.0, before)
    assert jump == pytest.approx(0.011513, abs=5e-7)
    model = prescribed_motion(law, 1.0, lambda t: ca.SX(1e-5))
    run = simulate(model, 50.0, x0={"psi": float(before[0])}, rtol=1e-9)
    assert run["friction"][0] == pytest.approx(0.611513, abs=5e-7)
    assert run.final["friction"] == pytest.approx(0.588487, abs=5e-7)


def test_ageing_and_slip_evolution_relax_as_their_closed_forms() -> None:
    """theta = D_c/v + (theta_0 - D_c/v) exp(-v t/D_c);  ln(v theta/D_c) ~ exp(-v t/D_c)."""
    t, v = 0.7, 1e-5
    decay = np.exp(-v * t / 1e-5)
    expected = {"ageing": log(0.1 * (1 + 9 * decay)), "slip": log(0.1) + log(10) * decay}
    for evolution, psi in expected.items():
        law = RateAndState(**ROCK, evolution=evolution)
        model = prescribed_motion(law, 1.0, lambda t: ca.SX(v))
        run = simulate(model, t, x0={"psi": 0.0}, rtol=1e-10)
        assert run.final["psi"] == pytest.approx(psi, rel=1e-7)


def test_rest_heals_with_the_logarithm_of_time_in_the_ageing_law_only() -> None:
    for evolution, healed in (("ageing", log(1 + 100.0 / 10.0)), ("slip", 0.0)):
        law = RateAndState(**ROCK, evolution=evolution)
        model = prescribed_motion(law, 1.0, lambda t: ca.SX(0.0))
        run = simulate(model, 100.0, x0={"psi": 0.0}, rtol=1e-10)
        assert run.final["psi"] == pytest.approx(healed, abs=1e-3)


@given(v=st.floats(-1e-3, 1e-3), psi=st.floats(-5.0, 5.0))
def test_regularised_form_is_odd_and_agrees_with_the_logarithm(v: float, psi: float) -> None:
    law, z = RateAndState(**ROCK), np.array([psi])
    assert law.force(-v, 1.0, z) == -law.force(v, 1.0, z)
    if abs(v) > 1e-12:
        expected = 0.6 + 0.005 * log(abs(v) / 1e-6) + 0.01 * psi
        assert abs(law.force(v, 1.0, z)) == pytest.approx(expected, abs=1e-12)


def test_creep_under_load_is_that_of_an_independent_integrator() -> None:
    """0.8 kg pulled with 0.9 of its steady strength, for ten seconds."""
    law = RateAndState(mu_0=0.12, a=0.005, b=0.01)
    N, pull = 7.848, 0.9 * 0.12 * 7.848

    def rates(t: float, y: np.ndarray) -> list[float]:
        _, v, psi = y
        mu = 0.005 * asinh(v / 2e-6 * np.exp((0.12 + 0.01 * psi) / 0.005))
        return [v, (pull - N * mu) / 0.8, 0.1 * (np.exp(-psi) - abs(v) / 1e-6)]

    other = solve_ivp(rates, (0, 10), [0, 0, 0], "Radau", rtol=1e-10, atol=[1e-16, 1e-16, 1e-10])
    run = simulate(drive(law), 10.0, x0={"psi": 0.0}, u={"force": pull}, rtol=1e-10)
    assert run.final["x"] == pytest.approx(other.y[0, -1], rel=1e-4)
    assert 0 < run.final["x"] < 1e-5


def test_machines_that_are_let_go_from_rest_run_with_defaults() -> None:
    """They stopped at once: the start was an age of months, with a slope of 1e25 N s/m at rest."""
    for scene in (Pendulum, PendulumBox, FourMass):
        run = simulate(scene(RateAndState()).model(), 0.2, samples=2, backend="vm")
        assert run.status.ok, scene
    assert RateAndState().steady_state(0.0, 1.0)[0] == 0.0
    assert RateAndState().steady_state(-1e-9, 1.0)[0] == pytest.approx(np.log(1e3))
