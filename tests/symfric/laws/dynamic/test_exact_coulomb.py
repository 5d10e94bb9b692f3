"""Coulomb friction by modes: closed forms, and the truth that regularised laws tend to."""

from collections.abc import Callable

import casadi as ca
import numpy as np
import pytest
from oracles import rabinowicz_coulomb, rabinowicz_motion

from symfric import Coulomb, Stribeck, Sum, Viscous, drive, rabinowicz, simulate
from symfric.foundation.numeric import Scalar
from symfric.integrator import Linear
from symfric.laws import ExactCoulomb, Karnopp, LeineSwitch

LOAD = 0.8 * 9.81
BLOCK = (0.15, 0.1, 0.8, 2.1, 0.1, 9.81)
IDEAL = rabinowicz_coulomb(*BLOCK)


def test_stick_slip_has_the_closed_form_to_ten_digits() -> None:
    run = simulate(rabinowicz(ExactCoulomb()), 26.0, rtol=1e-11, samples=26_001)
    slips = [t for t, name in run.happened if name == "slip"]
    sticks = [t for t, name in run.happened if name == "stick"]
    assert np.diff(slips) == pytest.approx(IDEAL.period, abs=1e-9)
    assert sticks[1] - slips[0] == pytest.approx(IDEAL.slip_time, abs=1e-9)
    settled = run["x"][run.t > 7.0]
    assert (settled.max(), settled.min()) == pytest.approx((IDEAL.x_max, IDEAL.x_min), abs=1e-6)


def test_it_is_exact_to_a_tenth_of_a_micron_at_every_tolerance() -> None:
    """It broke away on the bend of the dense output: 6 mm off at 1e-6, 0.15 m at 1e-3.

    And listed 127 break-aways where there were 78.
    """
    model = rabinowicz(ExactCoulomb())
    for rtol in (1e-3, 1e-5, 1e-6, 1e-7, 1e-9):
        for v in (-0.4, -0.13, 0.0, 0.1, 0.25):
            run = simulate(model, 20.0, x0={"v": v}, rtol=rtol, backend="vm")
            x, breaks = rabinowicz_motion(v, 20.0, BLOCK)
            assert run.final["x"] == pytest.approx(x, abs=1e-7), (rtol, v)
            names = [name for _, name in run.happened]
            assert (names.count("slip"), set(names)) == (breaks, {"stick", "slip"}), (rtol, v)


Load = Callable[[ca.SX], Scalar]


def test_every_way_of_loading_breaks_away_at_its_instant() -> None:
    level = 0.15 * LOAD
    loads: tuple[tuple[Load | Linear, float], ...] = (
        (Linear([0.0, 20.0], [0.0, 4.0]), level / 0.2),
        (lambda t: 2 * ca.sin(np.pi * t), np.arcsin(level / 2) / np.pi),
        (lambda t: 0.05 * t * t, np.sqrt(level / 0.05)),
        (lambda t: 0.1 * (ca.exp(t / 3) - 1), 3 * np.log(1 + level / 0.1)),
        (lambda t: level + 0.1 * t, 0.0),
        (lambda t: -2.0 + 0 * t, 0.0),
    )
    for law in (ExactCoulomb(), Karnopp(form="event"), LeineSwitch(form="event")):
        for load, instant in loads:
            run = simulate(drive(law), 9.0, u={"force": load}, rtol=1e-4, backend="vm")
            t, name = run.happened[0]
            assert name == "slip"
            assert t == pytest.approx(instant, abs=1e-9)


def test_load_at_the_static_level_or_falling_from_it_is_held() -> None:
    level = 0.15 * LOAD
    loads: tuple[Load, ...] = (lambda t: level + 0 * t, lambda t: level - 1e-3 * t, lambda t: 0 * t)
    for load in loads:
        run = simulate(drive(ExactCoulomb()), 5.0, u={"force": load})
        assert (run.happened, run.final["v"], run.final["x"]) == ((), 0.0, 0.0)


def test_long_rest_does_not_step_over_a_shaking_beyond_the_static_level() -> None:
    """At rest nothing moves; what error control sees of the overload is all that holds steps."""

    def shaken(t: ca.SX) -> ca.SX:
        return 1.3 * ca.sin(2 * np.pi * 2 * t) * (t > 8)

    run = simulate(drive(ExactCoulomb()), 20.0, u={"force": shaken}, backend="vm")
    first = 8 + np.arcsin(0.15 * LOAD / 1.3) / (4 * np.pi)
    assert run.happened[0] == (pytest.approx(first, abs=1e-9), "slip")
    seen = [ExactCoulomb().rate(0.0, LOAD, np.zeros(1), F_e=F)[0] for F in (1.17, -2.0, 2.0)]
    assert seen == pytest.approx([0.0, (0.15 * LOAD - 2) / 3, (2 - 0.15 * LOAD) / 3])


def test_contact_without_load_or_friction_slides_from_the_start() -> None:
    for model in (drive(ExactCoulomb(), N=0.0), drive(ExactCoulomb(mu_s=0.0, mu_d=0.0))):
        run = simulate(model, 1.0, u={"force": lambda t: ca.sin(3 * t)}, rtol=1e-9)
        assert run.happened[0] == (0.0, "slip")
        assert run.final["v"] == pytest.approx((1 - np.cos(3)) / 2.4, rel=1e-7)


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
