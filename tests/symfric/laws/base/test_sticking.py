"""Laws whose rest is a mode: published and closed-form cycles, rest, overload, turning around."""

import numpy as np
import pytest
from oracles import StickSlip, rabinowicz_coulomb, rabinowicz_karnopp

from symfric import Law, drive, simulate
from symfric.laws import ExactCoulomb, Karnopp, LeineSwitch
from symfric.scenes import Rabinowicz

LOAD = 0.8 * 9.81
BLOCK = (0.15, 0.1, 0.8, 2.1, 0.1, 9.81)
EXACT: dict[str, Law] = {
    "exact_coulomb": ExactCoulomb(),
    "karnopp": Karnopp(form="event"),
    "leine_switch": LeineSwitch(form="event"),
}
each_law = pytest.mark.parametrize("law", EXACT.values(), ids=EXACT.keys())


def times(happened: tuple[tuple[float, str], ...], name: str) -> np.ndarray:
    return np.array([t for t, found in happened if found == name])


def test_leine_switch_runs_the_published_shooting_cycle() -> None:
    """Period, slip and turning points as published, two of them corrected by DOP853 at 1e-13."""
    law = LeineSwitch(mu_s=1.0, delta=3.0, form="event")
    scene = Rabinowicz(law, m=1.0, k=1.0, v_belt=0.2, g=1.0)
    run = simulate(scene.model(), 60.0, rtol=1e-10)
    slips, sticks = times(run.happened, "slip"), times(run.happened, "stick")
    assert len(run.happened) == 11
    assert np.diff(slips) == pytest.approx(12.001031, abs=2e-6)
    assert sticks[-1] - slips[-1] == pytest.approx(4.296000, abs=2e-6)
    assert slips[-1] - sticks[-2] == pytest.approx(7.705032, abs=2e-6)
    cycle = run.at(np.linspace(slips[-2], slips[-1], 200_001))
    assert cycle["x"].max() == pytest.approx(1.133945, abs=1e-6)
    assert cycle["x"].min() == pytest.approx(-0.55543269, abs=1e-8)
    assert cycle["v"].min() == pytest.approx(-0.83990205, abs=1e-8)
    assert run.at(sticks[-1])["x"][0] == pytest.approx(-0.541006, abs=1e-6)


def karnopp_cycle(D_v: float) -> StickSlip:
    run = simulate(Rabinowicz(Karnopp(D_v=D_v, form="event")).model(), 26.0, rtol=1e-11)
    slips, stops = times(run.happened, "slip"), times(run.happened, "stop")
    assert set(np.diff(np.searchsorted(stops, slips))) == {1}
    cycle = run.at(np.linspace(slips[-2], slips[-1], 100_001))["x"]
    period, slip = slips[-1] - slips[-2], stops[2] - slips[1]
    middle = (cycle.max() + cycle.min()) / 2
    return StickSlip(period, period - slip, slip, cycle.max(), cycle.min(), middle)


@pytest.mark.parametrize("D_v", [1e-2, 1e-3, 1e-4])
def test_karnopp_has_its_closed_form_cycle(D_v: float) -> None:
    found, ideal = karnopp_cycle(D_v), rabinowicz_karnopp(*BLOCK, D_v)
    assert found.period == pytest.approx(ideal.period, abs=1e-8)
    assert found.slip_time == pytest.approx(ideal.slip_time, abs=1e-8)
    assert found.x_max == pytest.approx(ideal.x_max, abs=1e-8)
    assert found.x_min == pytest.approx(ideal.x_min, abs=1e-8)


def test_karnopp_tends_to_coulomb_with_stiction_like_the_root_of_its_band() -> None:
    ideal = rabinowicz_coulomb(*BLOCK)
    errors = [abs(karnopp_cycle(D_v).period - ideal.period) for D_v in (1e-4, 1e-6)]
    assert errors[0] / errors[1] == pytest.approx(10.0, rel=0.1)


@each_law
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_rest_is_exact_below_the_static_level_and_ends_above(law: Law, sign: float) -> None:
    runs = [simulate(drive(law), 1.0, u={"force": sign * F}) for F in (1.17, 1.19)]
    assert runs[0].happened == ()
    assert runs[0].final["v"] == 0.0
    assert runs[0].final["friction"] == sign * 1.17
    assert sign * runs[1].final["v"] > 0.0


@each_law
@pytest.mark.parametrize("v", [0.1, 5e-4])
def test_weak_load_stops_for_good(law: Law, v: float) -> None:
    run = simulate(drive(law), 5.0, x0={"v": v}, u={"force": 0.5}, rtol=1e-9)
    assert run.final["v"] == 0.0
    assert run.final["friction"] == 0.5
    assert len(run.happened) == 1


@each_law
def test_strong_load_turns_the_motion_around(law: Law) -> None:
    run = simulate(drive(law), 2.0, x0={"v": -0.5}, u={"force": 2.0}, rtol=1e-9)
    assert run.final["v"] > 1.0
    assert len(run.happened) <= 2


@each_law
def test_contact_takes_power_and_stays_below_its_static_level(law: Law) -> None:
    run = simulate(Rabinowicz(law).model(), 20.0, rtol=1e-8, samples=20_001)
    assert run["power"].min() > -1e-8
    assert np.abs(run["friction"]).max() <= 0.15 * LOAD * (1 + 1e-9)
    resting = run["mode"] == 0
    assert 0.3 < resting.mean() < 0.8
    assert np.abs(run["v_rel"][resting]).max() < 1e-8


def test_other_forms_have_no_modes() -> None:
    for law in (Karnopp(), Karnopp(form="original"), LeineSwitch(), LeineSwitch(form="original")):
        assert law.states == ()
        assert law.switches(0.1, 5.0, F_e=0.3) == ()
