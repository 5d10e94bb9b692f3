"""Figures of a contact under a given velocity: steady curves, hysteresis, lag, jumps, dwell."""

from functools import cache

import numpy as np
import pytest

from symfric import Coulomb, LuGre, RateAndState, SelfTuning, law_from_text
from symfric.figures import (
    FigureData,
    dwell,
    hysteresis,
    lag,
    profile,
    steady_state,
    sweep_b,
    sweep_c,
    sweep_e,
    transition,
    velocity_step,
)
from symfric.laws import GMS, MaxwellSlip, SteadyStateLuGre


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
    F = hysteresis(LuGre(), speeds=(1.0,))["1x"]["F"][::200]
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


def test_transition_settles_on_the_dynamic_level_on_both_sides() -> None:
    curve = transition(LuGre())["2 Hz"]
    assert curve["F"][curve["v"].argmax()] == pytest.approx(0.7848, rel=1e-2)
    assert curve["F"][curve["v"].argmin()] == pytest.approx(-0.7848, rel=1e-2)


def test_rate_and_state_jumps_by_a_and_falls_by_b() -> None:
    law, N = RateAndState(), 2.0
    curve = velocity_step(law, N, factor=10.0).curves[0]
    F, x, fast = curve["F"], curve["x"], curve["v"] > 2 * curve["v"][0]
    before, peak, settled = F[~fast][0], F[fast].max(), F[fast][-1]
    a, b = float(law.a), float(law.b)
    assert peak - before == pytest.approx(a * np.log(10.0) * N, rel=0.01)
    assert peak - settled == pytest.approx(b * np.log(10.0) * N, rel=0.01)
    at = x[fast] - x[fast][0]  # slip law and ageing law: 1/e of the fall over about D_c
    fallen = at[np.argmax(F[fast] < settled + (peak - settled) / np.e)]
    assert 0.3 * float(law.D_c) < fallen < 3 * float(law.D_c)


def test_the_way_is_the_same_at_each_velocity_and_ends_where_it_began() -> None:
    """Half as much before; behind the second jump the contact is as old as at first."""
    law = RateAndState()
    curve = velocity_step(law, 2.0, factor=10.0).curves[0]
    F, x, v = curve["F"], curve["x"], curve["v"]
    fast = np.flatnonzero(v > 2 * v[0])
    way = 20 * float(law.D_c)
    jumps = x[fast[0]], x[fast[-1]], x[-1]
    assert jumps == pytest.approx((0.5 * way, 1.5 * way, 2.5 * way), rel=1e-2)  # to a sample
    assert v[-1] == pytest.approx(v[0])
    assert F[-1] == pytest.approx(F[0], rel=1e-6)


def test_a_law_without_lag_is_refused() -> None:
    with pytest.raises(ValueError, match="velocity_step of coulomb: expected a law that shows"):
        velocity_step(Coulomb())


def test_friction_heals_with_the_logarithm_of_the_dwell_time() -> None:
    """At rest the age grows with time: the peak rises by b ln(10) N a decade."""
    law = RateAndState()
    data = dwell(law, 2.0, holds=(1e3, 1e4, 1e5))
    rise = np.diff(data.curves[0]["F"])
    expected = 2.0 * float(law.b) * np.log(10.0)
    assert rise == pytest.approx(expected, rel=0.03)


def test_a_law_without_dwell_is_refused() -> None:
    with pytest.raises(ValueError, match="dwell of lugre: expected a law that shows static"):
        dwell(LuGre())
