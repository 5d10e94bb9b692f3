"""What the figures say, against facts known from elsewhere."""

import numpy as np
import pytest

from symfric import LuGre, SelfTuning, law_from_text, with_values
from symfric.figures import (
    break_away,
    compare,
    drift,
    hysteresis,
    lag,
    profile,
    steady_state,
    sweep_b,
    sweep_c,
    sweep_e,
    transition,
)
from symfric.laws import GMS, ElastoPlastic, MaxwellSlip, SteadyStateLuGre


def test_break_away_of_lugre_falls_with_the_rate_as_computed_independently() -> None:
    curve = break_away(LuGre(), rates=(0.1, 1.0, 10.0))["lugre"]
    # SciPy's Radau on plain Python, seed 2's parameters
    assert curve["F"] == pytest.approx([1.166, 1.125, 0.961], abs=5e-4)


def test_break_away_of_a_static_law_does_not_know_the_rate() -> None:
    peak = break_away(law_from_text("brown_mcphee"))["brown_mcphee"]["F"]
    assert peak == pytest.approx(np.full(6, 0.9996 * 0.15 * 7.848), rel=1e-4)


def test_a_rate_of_zero_is_refused() -> None:
    with pytest.raises(ValueError, match="rates: expected numbers above 0 N/s"):
        break_away(LuGre(), rates=(0.0, 1.0))


@pytest.mark.parametrize("name", ["lugre", "gms", "leuven", "elasto_plastic", "armstrong"])
@pytest.mark.parametrize("case", ["2 Hz", "5 Hz", "10 Hz"])
def test_force_lags_so_it_is_higher_while_the_velocity_rises(name: str, case: str) -> None:
    curve = lag(law_from_text(name))[case]
    v, F = curve["v"], curve["F"]
    up = np.diff(v, append=v[-1]) > 0
    at = np.linspace(1e-3, 3e-3, 21)
    rising, falling = (
        np.interp(at, v[side][np.argsort(v[side])], F[side][np.argsort(v[side])])
        for side in (up, ~up)
    )
    assert (rising > falling).all()


def test_lag_of_lugre_lies_around_the_steady_curve_and_grows_with_the_frequency() -> None:
    data = lag(LuGre())
    areas = [abs(np.trapezoid(data[f]["F"], data[f]["v"])) for f in ("2 Hz", "5 Hz", "10 Hz")]
    assert areas == sorted(areas)
    assert data["steady"]["F"][[0, -1]] == pytest.approx(
        [7.848 * (0.1 + 0.05 * np.exp(-0.25)), 0.7848], rel=1e-6
    )


def test_maxwell_slip_draws_one_curve_at_every_speed() -> None:
    data = hysteresis(MaxwellSlip(form="event"))
    slow = data["1x"]["F"]
    for case in ("5x", "20x"):
        assert data[case]["F"] == pytest.approx(slow, abs=1e-4)


@pytest.mark.parametrize("law", [MaxwellSlip(form="event"), MaxwellSlip(), GMS(form="event")])
def test_non_local_memory_returns_to_the_force_of_each_turning_point(law: MaxwellSlip) -> None:
    curve = hysteresis(law, speeds=(1.0,))["1x"]
    F = curve["F"][::200]  # at the turning points 0, 2, -2, 1, -1, 1, -2, 2 stretches
    assert F[5] == pytest.approx(F[3], rel=0.01)  # the smooth form yields a little early
    assert F[6] == pytest.approx(F[2], rel=0.01)


def test_lugre_has_no_such_memory() -> None:
    F = hysteresis(LuGre(), speeds=(1.0,))["1x"]["F"][::200]
    assert abs(F[5] - F[3]) > 0.05


def test_virgin_curve_and_reversal_of_maxwell_slip_obey_masing() -> None:
    law = MaxwellSlip(form="event")
    curve = hysteresis(law, speeds=(1.0,))["1x"]
    k, limit = np.array([5e4, 2.5e4, 1.5e4, 1e4]), 0.025 * 7.848

    def virgin(x: np.ndarray) -> np.ndarray:
        return np.minimum(np.outer(np.abs(x), k), limit).sum(axis=1)

    first, back = slice(0, 201), slice(200, 401)
    assert curve["F"][first] == pytest.approx(virgin(curve["x"][first]), abs=1e-4)
    x, branch = curve["x"][back], curve["F"][back]
    assert branch == pytest.approx(branch[0] - 2 * virgin((x[0] - x) / 2), abs=1e-4)


def test_lugre_drifts_and_the_elasto_plastic_law_does_not() -> None:
    elastic = ElastoPlastic(z_ba=0.7 * 0.7848 / 1e5)
    data = compare({"elasto-plastic": elastic, "LuGre": LuGre()}, "drift")
    assert abs(data["elasto-plastic"]["x"][-1]) < 3e-7
    assert data["LuGre"]["x"][-1] > 1e-4


def test_drift_of_lugre_is_that_of_an_independent_integration() -> None:
    assert drift(LuGre())["lugre"]["x"][-1] == pytest.approx(2.43e-4, rel=5e-3)  # SciPy's LSODA


@pytest.mark.parametrize("name", ["maxwell_slip", "gms", "leuven", "haessig_friedland"])
def test_laws_with_hysteresis_settle_instead_of_drifting(name: str) -> None:
    curve = drift(law_from_text(name))[name]
    t, x = curve["t"], curve["x"]
    early, late = (np.mean(x[(t >= a) & (t < a + 1)]) for a in (3.0, 7.0))
    assert abs(late - early) < 2e-6  # LuGre: 1.6e-4


def test_the_block_is_pushed_below_break_away_at_first_and_in_the_end() -> None:
    F_e = drift(LuGre())["lugre"]["F_e"]
    assert F_e.max() == pytest.approx(0.8 * 0.7848, rel=1e-3)
    assert F_e.min() == pytest.approx(0.2 * 0.7848, rel=1e-3)


def test_profile_of_the_self_tuning_law_peaks_at_mu_s_N() -> None:
    F = profile(SelfTuning(), N=2.0)["self_tuning"]["F"]
    assert F.max() == pytest.approx(0.3, rel=1e-4)
    assert -F[::-1] == pytest.approx(F)


def test_sweep_of_B_moves_the_peak_and_keeps_its_height() -> None:
    data = sweep_b(SelfTuning(), values=(0.5, 1.0))
    slow, fast = data.curves
    assert slow["F"].max() == pytest.approx(fast["F"].max(), rel=1e-3)
    assert slow["v"][slow["F"].argmax()] == pytest.approx(
        2 * fast["v"][fast["F"].argmax()], rel=0.02
    )


def test_sweep_of_C_is_flat_at_zero_monotone_to_one_and_peaked_beyond() -> None:
    data = sweep_c(SelfTuning())
    assert not data["C = 0"]["F"].any()
    assert (np.diff(data["C = 1"]["F"]) > 0).all()
    assert (np.diff(data["C = 0.5"]["F"]) > 0).all()
    falls = [np.diff(data[f"C = {c}"]["F"]).min() < 0 for c in ("1.2", "1.4", "1.6", "1.8", "2")]
    assert all(falls)


def test_sweep_of_E_keeps_the_slope_at_rest() -> None:
    middle = [curve["F"][599:602] for curve in sweep_e(SelfTuning()).curves]
    slopes = [F[2] - F[0] for F in middle]
    assert slopes == pytest.approx(np.full(len(slopes), slopes[0]), rel=1e-3)


def test_steady_state_of_seed_4_has_its_minimum_where_the_table_says() -> None:
    curve = steady_state(SteadyStateLuGre())["steady_state_lugre"]
    v, F = curve["v"], curve["F"]
    sliding = v > 1e-4
    lowest = np.argmin(np.where(sliding, F, np.inf))
    assert F[lowest] == pytest.approx(3.1224, abs=2e-3)
    assert v[lowest] * 60000 == pytest.approx(129, abs=2)  # mm/min


def test_viscous_friction_adds_a_linear_tail_to_the_dry_curve() -> None:
    data = steady_state(LuGre(), shares=(0.0, 1.0))
    _, dry, wet = data.curves
    assert wet["F"] - dry["F"] == pytest.approx(0.7848 * wet["v"] / 1e-2)


def test_transition_settles_on_the_dynamic_level_on_both_sides() -> None:
    curve = transition(LuGre())["2 Hz"]
    assert curve["F"][curve["v"].argmax()] == pytest.approx(0.7848, rel=1e-2)
    assert curve["F"][curve["v"].argmin()] == pytest.approx(-0.7848, rel=1e-2)


def test_excitation_follows_the_parameters_of_the_law() -> None:
    stiff = with_values(LuGre(), {"sigma_0": 1e6})
    x, other = (hysteresis(law, speeds=(1.0,))["1x"]["x"] for law in (LuGre(), stiff))
    assert x.max() == pytest.approx(10 * other.max(), rel=1e-6)
    assert x.max() == pytest.approx(2 * 0.15 * 7.848 / 1e5, rel=1e-6)
