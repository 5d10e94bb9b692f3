"""Coulomb friction by modes: closed forms, and the truth that regularised laws tend to."""

import numpy as np
import pytest
from oracles import rabinowicz_coulomb

from symfric import Coulomb, Stribeck, Sum, Viscous, drive, rabinowicz, simulate
from symfric.laws import ExactCoulomb

LOAD = 0.8 * 9.81
IDEAL = rabinowicz_coulomb(0.15, 0.1, 0.8, 2.1, 0.1, 9.81)


def test_stick_slip_has_the_closed_form_to_ten_digits() -> None:
    run = simulate(rabinowicz(ExactCoulomb()), 26.0, rtol=1e-11, samples=26_001)
    slips = [t for t, name in run.happened if name == "slip"]
    sticks = [t for t, name in run.happened if name == "stick"]
    assert np.diff(slips) == pytest.approx(IDEAL.period, abs=1e-9)
    assert sticks[1] - slips[0] == pytest.approx(IDEAL.slip_time, abs=1e-9)
    settled = run["x"][run.t > 7.0]
    assert (settled.max(), settled.min()) == pytest.approx((IDEAL.x_max, IDEAL.x_min), abs=1e-6)


def test_sticking_is_exact() -> None:
    run = simulate(rabinowicz(ExactCoulomb()), 20.0, rtol=1e-8, samples=20_001)
    stuck = run["mode"] == 0
    assert 0.4 < stuck.mean() < 0.7
    assert np.abs(run["v_rel"][stuck]).max() < 1e-15
    assert run["friction"][stuck] == pytest.approx(-2.1 * run["x"][stuck])
    assert np.abs(run["friction"]).max() <= 0.15 * LOAD * (1 + 1e-9)


def test_ramp_breaks_away_at_the_static_level() -> None:
    run = simulate(drive(ExactCoulomb()), 3.0, u={"force": lambda t: 0.5 * t}, rtol=1e-9)
    ((t, name),) = run.happened
    assert name == "slip"
    assert t == pytest.approx(0.15 * LOAD / 0.5, abs=1e-8)
    rest = 3.0 - t
    gained = ((0.15 - 0.1) * LOAD * rest + 0.25 * rest**2) / 0.8
    assert run.final["v"] == pytest.approx(gained, rel=1e-7)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_load_beyond_the_static_level_moves_from_the_start(sign: float) -> None:
    run = simulate(drive(ExactCoulomb()), 1.0, u={"force": sign * 2.0}, rtol=1e-9)
    assert run.final["v"] == pytest.approx(sign * (2.0 - 0.1 * LOAD) / 0.8, rel=1e-8)
    held = simulate(drive(ExactCoulomb()), 1.0, u={"force": sign * 1.17})
    assert held.final["v"] == 0.0


def test_strong_load_turns_the_motion_around_without_stick() -> None:
    run = simulate(drive(ExactCoulomb()), 2.0, x0={"v": -1.0}, u={"force": 2.0}, rtol=1e-9)
    stop = 0.8 * 1.0 / (2.0 + 0.1 * LOAD)
    assert [name for _, name in run.happened] == ["stick"]
    assert run.happened[0][0] == pytest.approx(stop, abs=1e-9)
    assert run.final["v"] == pytest.approx((2.0 - 0.1 * LOAD) / 0.8 * (2.0 - stop), rel=1e-8)


def test_weak_load_stops_for_good() -> None:
    run = simulate(drive(ExactCoulomb()), 5.0, x0={"v": 1.0}, u={"force": 0.5}, rtol=1e-9)
    deceleration = (0.1 * LOAD - 0.5) / 0.8
    assert run.final["v"] == 0.0
    assert run.final["x"] == pytest.approx(0.5 / deceleration, rel=1e-8)
    assert run.final["friction"] == 0.5


def test_work_of_the_contact_is_what_the_block_loses() -> None:
    run = simulate(drive(ExactCoulomb()), 2.0, x0={"v": 1.0}, rtol=1e-9, samples=20_001)
    assert np.trapezoid(run["power"], run.t) == pytest.approx(0.4, rel=1e-6)


def test_regularised_coulomb_tends_to_it() -> None:
    exact = simulate(drive(ExactCoulomb(mu_s=0.1)), 2.0, x0={"v": 1.0}, rtol=1e-10)
    errors = [
        np.abs(simulate(drive(Coulomb(v_eps=e)), 2.0, x0={"v": 1.0}, rtol=1e-10)["x"] - exact["x"])
        for e in (1e-2, 1e-3, 1e-4)
    ]
    short = [e.max() for e in errors]
    assert short[0] > 8 * short[1] > 64 * short[2]


def test_regularised_stiction_tends_to_its_break_away() -> None:
    exact = simulate(rabinowicz(ExactCoulomb()), 4.0, rtol=1e-10)["x"].max()
    narrow = (Stribeck(v_s=w, v_eps=w / 10) for w in (1e-3, 1e-4))
    errors = [abs(simulate(rabinowicz(law), 4.0, rtol=1e-8)["x"].max() - exact) for law in narrow]
    assert errors[0] > errors[1]


def test_sum_with_viscous_friction_keeps_its_switches() -> None:
    law = Sum((ExactCoulomb(), Viscous(sigma_2=0.8)))
    run = simulate(drive(law), 5.0, x0={"v": 1.0}, rtol=1e-10)
    level = 0.1 * LOAD
    assert [name for _, name in run.happened] == ["stick"]
    assert run.happened[0][0] == pytest.approx(np.log(1 + 0.8 / level), abs=1e-8)
    assert run.final["v"] == 0.0
