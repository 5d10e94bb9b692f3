"""Figures of a contact under a given velocity: steady curves, hysteresis, lag, jumps, dwell."""

from functools import cache
from itertools import product

import numpy as np
import pytest

import symfric as sf
from symfric.figures import (
    Curve,
    FigureData,
    break_away,
    drift,
    dwell,
    hysteresis,
    lag,
    push,
    steady_state,
    stiction,
    sweep_b,
    sweep_c,
    sweep_e,
    transition,
    velocity_step,
)
from symfric.figures.motion import scales
from symfric.figures.pushing import over_period
from symfric.laws import GMS, ElastoPlastic, MaxwellSlip, SteadyStateLuGre


def test_sweeps_change_stiffness_shape_and_curvature_alone() -> None:
    slow, fast = sweep_b(sf.SelfTuning(), values=(0.5, 1.0)).curves
    assert slow["F"].max() == pytest.approx(fast["F"].max(), rel=1e-3)
    peaks = [curve["v"][curve["F"].argmax()] for curve in (slow, fast)]
    assert peaks[0] == pytest.approx(2 * peaks[1], rel=0.02)
    data = sweep_c(sf.SelfTuning())
    assert data.title.startswith("profiles for values of the shape factor C")
    assert data.note.startswith("C up to 1 gives a plateau")
    assert not data["C = 0"]["F"].any()
    for c in ("0.5", "1", "1.2", "1.4", "1.6", "1.8", "2"):
        assert bool(np.diff(data[f"C = {c}"]["F"]).min() > 0) is (float(c) <= 1), c
    middle = [curve["F"][599:602] for curve in sweep_e(sf.SelfTuning()).curves]
    slopes = [F[2] - F[0] for F in middle]
    assert slopes == pytest.approx(np.full(len(slopes), slopes[0]), rel=1e-3)


def test_steady_state_of_seed_4_has_the_minimum_of_the_table() -> None:
    curve = steady_state(SteadyStateLuGre())["steady_state_lugre"]
    v, F = curve["v"], curve["F"]
    sliding = v > 1e-4
    lowest = np.argmin(np.where(sliding, F, np.inf))
    assert F[lowest] == pytest.approx(3.1224, abs=2e-3)
    assert v[lowest] * 60000 == pytest.approx(129, abs=2)  # mm/min


def test_viscous_friction_adds_a_linear_tail_to_the_dry_curve() -> None:
    data = steady_state(sf.LuGre(), shares=(0.0, 1.0))
    _, dry, wet = data.curves
    assert wet["F"] - dry["F"] == pytest.approx(0.7848 * wet["v"] / 1e-2)


@cache
def of_maxwell() -> FigureData:
    return hysteresis(MaxwellSlip(form="event"))


def test_maxwell_slip_draws_one_curve_at_every_speed() -> None:
    data = of_maxwell()
    slow = data["1x"]["F"]
    for case in ("5x", "20x"):
        assert data[case]["F"] == pytest.approx(slow, abs=1e-4)


def test_non_local_memory_returns_to_the_force_of_each_turning_point() -> None:
    others = (hysteresis(law, speeds=(1.0,)) for law in (MaxwellSlip(), GMS(form="event")))
    for data in (of_maxwell(), *others):
        F = data["1x"]["F"][::200]  # at the turning points 0, 2, -2, 1, -1, 1, -2, 2 stretches
        assert F[5] == pytest.approx(F[3], rel=0.01)  # the smooth form yields a little early
        assert F[6] == pytest.approx(F[2], rel=0.01)


def test_lugre_has_no_such_memory() -> None:
    F = hysteresis(sf.LuGre(), speeds=(1.0,))["1x"]["F"][::200]
    assert abs(F[5] - F[3]) > 0.05


def test_virgin_curve_and_reversal_of_maxwell_slip_obey_masing() -> None:
    curve = of_maxwell()["1x"]
    k, limit = np.array([5e4, 2.5e4, 1.5e4, 1e4]), 0.025 * 7.848

    def virgin(x: np.ndarray) -> np.ndarray:
        return np.minimum(np.outer(np.abs(x), k), limit).sum(axis=1)

    first, back = slice(0, 201), slice(200, 401)
    assert curve["F"][first] == pytest.approx(virgin(curve["x"][first]), abs=1e-4)
    x, branch = curve["x"][back], curve["F"][back]
    assert branch == pytest.approx(branch[0] - 2 * virgin((x[0] - x) / 2), abs=1e-4)


def test_a_route_is_gone_through() -> None:
    route = (0.0, 1.5e-6, 0.2e-6, 1.1e-6)
    curve = hysteresis(MaxwellSlip(), speeds=(1.0,), route=route).curves[0]
    turns = [int(np.argmin(np.abs(curve["t"] - 8.0 * k / 3))) for k in range(4)]
    assert np.allclose(curve["x"][turns], route, atol=1e-11)


def test_force_lags_so_it_is_higher_while_the_velocity_rises() -> None:
    at = np.linspace(1e-3, 3e-3, 21)
    for name, case in product(("lugre", "leuven", "armstrong"), ("2 Hz", "10 Hz")):
        curve = lag(sf.law_from_text(name), frequencies=(float(case[:-3]),))[case]
        v, F = curve["v"], curve["F"]
        up = np.diff(v, append=v[-1]) > 0
        rising, falling = (
            np.interp(at, v[side][np.argsort(v[side])], F[side][np.argsort(v[side])])
            for side in (up, ~up)
        )
        assert (rising > falling).all(), (name, case)


def test_lag_of_lugre_lies_around_the_steady_curve_and_grows_with_the_frequency() -> None:
    data = lag(sf.LuGre())
    areas = [abs(np.trapezoid(data[f]["F"], data[f]["v"])) for f in ("2 Hz", "5 Hz", "10 Hz")]
    assert areas == sorted(areas)
    assert data["steady"]["F"][[0, -1]] == pytest.approx(
        [7.848 * (0.1 + 0.05 * np.exp(-0.25)), 0.7848], rel=1e-6
    )


def test_transition_settles_on_the_dynamic_level_on_both_sides() -> None:
    curve = transition(sf.LuGre())["2 Hz"]
    assert curve["F"][curve["v"].argmax()] == pytest.approx(0.7848, rel=1e-2)
    assert curve["F"][curve["v"].argmin()] == pytest.approx(-0.7848, rel=1e-2)


def test_rate_and_state_jumps_by_a_and_falls_by_b() -> None:
    law, N = sf.RateAndState(), 2.0
    curve = velocity_step(law, N, factor=10.0).curves[0]
    F, x, fast = curve["F"], curve["x"], curve["v"] > 2 * curve["v"][0]
    before, peak, settled = F[~fast][0], F[fast].max(), F[fast][-1]
    a, b = float(law.a), float(law.b)
    assert peak - before == pytest.approx(a * np.log(10.0) * N, rel=0.01)
    assert peak - settled == pytest.approx(b * np.log(10.0) * N, rel=0.01)
    at = x[fast] - x[fast][0]  # slip law and ageing law: 1/e of the fall over about D_c
    fallen = at[np.argmax(F[fast] < settled + (peak - settled) / np.e)]
    assert 0.3 * float(law.D_c) < fallen < 3 * float(law.D_c)


def test_friction_heals_with_the_logarithm_of_the_dwell_time() -> None:
    """At rest the age grows with time: the peak rises by b ln(10) N a decade."""
    law = sf.RateAndState()
    data = dwell(law, 2.0, holds=(1e3, 1e4, 1e5))
    rise = np.diff(data.curves[0]["F"])
    expected = 2.0 * float(law.b) * np.log(10.0)
    assert rise == pytest.approx(expected, rel=0.03)


def test_viscous_block_approaches_its_speed() -> None:
    curve = push(sf.Viscous(sigma_2=4.0), force=2.0, t_end=1.0, mass=0.5, samples=11).curves[0]
    assert np.allclose(curve["v"], 0.5 * (1 - np.exp(-8 * curve["t"])), atol=2e-5)
    assert np.allclose(curve["F"], 4 * curve["v"], atol=1e-9)


def test_random_contacts_take_the_momentum_that_is_missing() -> None:
    law = sf.GenericAsperity(k=1e5, count=50)
    curve = push(law, 1.0, force=0.5, t_end=0.1, mass=0.5, samples=4001).curves[0]
    left = np.trapezoid(curve["F_e"] - curve["F"], curve["t"])
    assert abs(0.5 * curve["v"][-1] / left - 1) < 1e-3
    assert 0.04 < curve["F"][-1] < 0.5


def test_at_rest_friction_is_the_force_that_pulls() -> None:
    data = stiction(sf.ExactCoulomb(), 10.0)
    curve = data.curves[0]
    still = (np.abs(curve["v"]) < 1e-9) & (np.abs(curve["F_e"]) < 1.49)
    assert still.sum() > 50
    assert curve["F"][still] == pytest.approx(curve["F_e"][still], abs=1e-6)
    assert np.abs(curve["F"][still]).max() == pytest.approx(1.5, rel=0.02)
    assert np.abs(curve["F_e"]).max() == pytest.approx(1.3 * 1.5, rel=1e-3)


@cache
def of_lugre() -> Curve:
    return drift(sf.LuGre())["lugre"]


def test_lugre_drifts_and_the_elasto_plastic_law_does_not() -> None:
    elastic = ElastoPlastic(z_ba=0.7 * 0.7848 / 1e5)
    assert abs(drift(elastic)["elasto_plastic"]["x"][-1]) < 3e-7
    assert of_lugre()["x"][-1] == pytest.approx(2.43e-4, rel=5e-3)  # SciPy's LSODA
    F_e = of_lugre()["F_e"]  # pushed below break-away at first and in the end
    assert (F_e.min(), F_e.max()) == pytest.approx((0.2 * 0.7848, 0.8 * 0.7848), rel=1e-3)


def test_the_vibration_starts_from_rest() -> None:
    """The elasto-plastic law "drifted" 9 cm at data where the push goes on for a second."""
    given = {"mu_s": 1.05, "mu_d": 0.2, "v_s": 98e-6, "delta": 0.78, "sigma_0": 1.6e5}
    data = drift(ElastoPlastic(z_ba=0.61e-6, sigma_1=0.08, **given), N=1.0)
    assert np.ptp(data.curves[0]["x"]) < 2e-6


SETTLING = ("maxwell_slip", *(pytest.param(n, marks=pytest.mark.slow) for n in ("gms", "leuven")))


@pytest.mark.parametrize("name", SETTLING)
def test_laws_with_hysteresis_settle_instead_of_drifting(name: str) -> None:
    curve = drift(sf.law_from_text(name))[name]
    t, x = curve["t"], curve["x"]
    early, late = (np.mean(x[(t >= a) & (t < a + 1)]) for a in (3.0, 7.0))
    assert abs(late - early) < 2e-6  # LuGre: 1.6e-4


def test_a_mean_over_a_period_forgets_its_sine_and_keeps_a_line() -> None:
    t = np.linspace(0.0, 1.0, 401)
    found = over_period(t, 2 * t + np.sin(2 * np.pi * 10 * t), 0.1)
    inner = (t > 0.06) & (t < 0.94)
    assert found[inner] == pytest.approx(2 * t[inner], abs=1e-3)
    assert found[0] == pytest.approx(0.1, abs=1e-3)


def test_break_away_of_lugre_falls_with_the_rate_as_computed_independently() -> None:
    curve = break_away(sf.LuGre(), rates=(0.1, 1.0, 10.0))["lugre"]
    # SciPy's Radau on plain Python, seed 2's parameters
    assert curve["F"] == pytest.approx([1.166, 1.125, 0.961], abs=5e-4)


def test_break_away_ends_at_the_kinetic_level_whatever_the_stiffness() -> None:
    """By LSODA on plain Python for sigma_0 = 1e4 and no damping: 0.9322, then F_C."""
    F_C = 0.1 * 7.848
    soft = break_away(sf.LuGre(sigma_0=1e4, sigma_1=0.0), rates=(1.0, 30.0))
    assert soft.curves[0]["F"] == pytest.approx([0.9322, F_C], abs=5e-4)
    rates = (3.0, 100.0)
    for law in (sf.LuGre(sigma_0=1e3), sf.LuGre(sigma_0=1e6, sigma_1=0.0), sf.Dahl(sigma_0=1e3)):
        assert (break_away(law, rates=rates).curves[0]["F"] > 0.9999 * F_C).all()


def test_scales_of_another_law_do_not_end_the_elastic_motion() -> None:
    """The scales of a contact ten times as stiff are given, as those of a whole comparison are."""
    stiff = scales(sf.LuGre(sigma_0=1e6))
    given = break_away(sf.LuGre(sigma_0=1e4, sigma_1=0.0), given=stiff, rates=(30.0,))
    assert given.curves[0]["F"][0] == pytest.approx(0.7848, abs=5e-4)


def test_break_away_of_a_static_law_does_not_know_the_rate() -> None:
    peak = break_away(sf.law_from_text("brown_mcphee"), rates=(0.1, 10.0))["brown_mcphee"]["F"]
    assert peak == pytest.approx(np.full(2, 0.9996 * 0.15 * 7.848), rel=1e-4)
