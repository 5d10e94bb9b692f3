"""Exact rest by modes, and the reset integrator."""

from collections.abc import Callable
from itertools import product

import casadi as ca
import numpy as np
import pytest
from oracles import StickSlip, rabinowicz_coulomb, rabinowicz_karnopp, rabinowicz_motion
from rigs import prescribed_motion, through

from symfric import Coulomb, Law, Sum, Viscous, drive, rabinowicz, simulate
from symfric.foundation.numeric import Scalar
from symfric.integrator import Linear
from symfric.laws import ExactCoulomb, HaessigFriedland, Karnopp, LeineSwitch
from symfric.laws.dynamic.element import ConstantStep
from symfric.scenes import Rabinowicz

LOAD = 0.8 * 9.81
BLOCK = (0.15, 0.1, 0.8, 2.1, 0.1, 9.81)
IDEAL = rabinowicz_coulomb(*BLOCK)
BLOCK_MODEL = drive(ExactCoulomb())


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
    for rtol in (1e-3, 1e-7, 1e-9):
        for v in (-0.4, 0.0, 0.25):
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
        model = drive(law)
        for load, instant in loads:
            run = simulate(model, instant + 1.0, u={"force": load}, rtol=1e-4, backend="vm")
            t, name = run.happened[0]
            assert name == "slip"
            assert t == pytest.approx(instant, abs=1e-9)


def test_load_at_the_static_level_or_falling_from_it_is_held() -> None:
    level = 0.15 * LOAD
    loads: tuple[Load, ...] = (lambda t: level + 0 * t, lambda t: level - 1e-3 * t, lambda t: 0 * t)
    for load in loads:
        run = simulate(BLOCK_MODEL, 5.0, u={"force": load})
        assert (run.happened, run.final["v"], run.final["x"]) == ((), 0.0, 0.0)


def test_long_rest_does_not_step_over_a_shaking_beyond_the_static_level() -> None:
    """At rest nothing moves; what error control sees of the overload is all that holds steps."""

    def shaken(t: ca.SX) -> ca.SX:
        return 1.3 * ca.sin(2 * np.pi * 2 * t) * (t > 8)

    run = simulate(BLOCK_MODEL, 20.0, u={"force": shaken}, backend="vm")
    first = 8 + np.arcsin(0.15 * LOAD / 1.3) / (4 * np.pi)
    assert run.happened[0] == (pytest.approx(first, abs=1e-9), "slip")
    seen = [ExactCoulomb().rate(0.0, LOAD, np.zeros(1), F_e=F)[0] for F in (1.17, -2.0, 2.0)]
    assert seen == pytest.approx([0.0, (0.15 * LOAD - 2) / 3, (2 - 0.15 * LOAD) / 3])


def test_contact_without_load_or_friction_slides_from_the_start() -> None:
    for model in (drive(ExactCoulomb(), N=0.0), drive(ExactCoulomb(mu_s=0.0, mu_d=0.0))):
        run = simulate(model, 1.0, u={"force": lambda t: ca.sin(3 * t)}, rtol=1e-9)
        assert run.happened[0] == (0.0, "slip")
        assert run.final["v"] == pytest.approx((1 - np.cos(3)) / 2.4, rel=1e-7)


def test_work_of_the_contact_is_what_the_block_loses() -> None:
    run = simulate(BLOCK_MODEL, 2.0, x0={"v": 1.0}, rtol=1e-9, samples=20_001)
    assert np.trapezoid(run["power"], run.t) == pytest.approx(0.4, rel=1e-6)


def test_regularised_coulomb_tends_to_it() -> None:
    exact = simulate(drive(ExactCoulomb(mu_s=0.1)), 2.0, x0={"v": 1.0}, rtol=1e-10)
    errors = [
        np.abs(simulate(drive(Coulomb(v_eps=e)), 2.0, x0={"v": 1.0}, rtol=1e-10)["x"] - exact["x"])
        for e in (1e-2, 1e-3, 1e-4)
    ]
    short = [e.max() for e in errors]
    assert short[0] > 8 * short[1] > 64 * short[2]


def test_sum_with_viscous_friction_keeps_its_switches() -> None:
    law = Sum((ExactCoulomb(), Viscous(sigma_2=0.8)))
    run = simulate(drive(law), 5.0, x0={"v": 1.0}, rtol=1e-10)
    level = 0.1 * LOAD
    assert [name for _, name in run.happened] == ["stick"]
    assert run.happened[0][0] == pytest.approx(np.log(1 + 0.8 / level), abs=1e-8)
    assert run.final["v"] == 0.0


EXACT: dict[str, Law] = {
    "exact_coulomb": ExactCoulomb(),
    "karnopp": Karnopp(form="event"),
    "leine_switch": LeineSwitch(form="event"),
}
MODELS = {name: drive(law) for name, law in EXACT.items()}


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
    cycle = run.at(np.linspace(slips[-2], slips[-1], 50_001))
    assert cycle["x"].max() == pytest.approx(1.133945, abs=1e-6)
    assert cycle["x"].min() == pytest.approx(-0.55543269, abs=1e-8)
    assert cycle["v"].min() == pytest.approx(-0.83990205, abs=1e-8)
    assert run.at(sticks[-1])["x"][0] == pytest.approx(-0.541006, abs=1e-6)


def karnopp_cycle(D_v: float) -> StickSlip:
    run = simulate(Rabinowicz(Karnopp(D_v=D_v, form="event")).model(), 26.0, rtol=1e-11, samples=2)
    slips, stops = times(run.happened, "slip"), times(run.happened, "stop")
    assert set(np.diff(np.searchsorted(stops, slips))) == {1}
    cycle = run.at(np.linspace(slips[-2], slips[-1], 20_001))["x"]
    period, slip = slips[-1] - slips[-2], stops[2] - slips[1]
    middle = (cycle.max() + cycle.min()) / 2
    return StickSlip(period, period - slip, slip, cycle.max(), cycle.min(), middle)


def test_karnopp_has_its_closed_form_cycle_and_tends_to_coulomb_with_the_root_of_its_band() -> None:
    limit, errors = rabinowicz_coulomb(*BLOCK).period, []
    for D_v in (1e-2, 1e-4, 1e-6):
        found, ideal = karnopp_cycle(D_v), rabinowicz_karnopp(*BLOCK, D_v)
        for part in ("period", "slip_time", "x_max", "x_min"):
            assert getattr(found, part) == pytest.approx(getattr(ideal, part), abs=1e-8), part
        errors.append(abs(found.period - limit))
    assert errors[1] / errors[2] == pytest.approx(10.0, rel=0.1)


def test_rest_is_exact_below_the_static_level_and_ends_above() -> None:
    for name, model in MODELS.items():
        for side in (1.0, -1.0):
            runs = [simulate(model, 1.0, u={"force": side * F}) for F in (1.17, 1.19)]
            assert runs[0].happened == (), name
            assert (runs[0].final["v"], runs[0].final["friction"]) == (0.0, side * 1.17), name
            assert side * runs[1].final["v"] > 0.0, name


def test_weak_load_stops_for_good_and_a_strong_one_turns_the_motion_around() -> None:
    for name, model in MODELS.items():
        for v in (0.1, 5e-4):
            run = simulate(model, 2.0, x0={"v": v}, u={"force": 0.5}, rtol=1e-9)
            assert (run.final["v"], run.final["friction"]) == (0.0, 0.5), name
            assert len(run.happened) == 1, name
        run = simulate(model, 2.0, x0={"v": -0.5}, u={"force": 2.0}, rtol=1e-9)
        assert run.final["v"] > 1.0, name
        assert len(run.happened) <= 2, name
    weak, strong = (0.1 * LOAD - 0.5) / 0.8, (2.0 + 0.1 * LOAD) / 0.8  # decelerations [m/s^2]
    run = simulate(BLOCK_MODEL, 2.0, x0={"v": 0.1}, u={"force": 0.5}, rtol=1e-9)
    assert run.final["x"] == pytest.approx(0.1**2 / 2 / weak, rel=1e-8)
    run = simulate(BLOCK_MODEL, 2.0, x0={"v": -0.5}, u={"force": 2.0}, rtol=1e-9)
    assert run.happened == ((pytest.approx(0.5 / strong, abs=1e-9), "stick"),)
    after = (2.0 - 0.1 * LOAD) / 0.8 * (2.0 - 0.5 / strong)
    assert run.final["v"] == pytest.approx(after, rel=1e-8)


def test_contact_takes_power_and_stays_below_its_static_level() -> None:
    for name, law in EXACT.items():
        run = simulate(Rabinowicz(law).model(), 20.0, rtol=1e-8, samples=5001)
        assert run["power"].min() > -1e-8, name
        assert np.abs(run["friction"]).max() <= 0.15 * LOAD * (1 + 1e-9), name
        resting = run["mode"] == 0
        assert 0.3 < resting.mean() < 0.8, name
        assert np.abs(run["v_rel"][resting]).max() < (1e-15 if name == "exact_coulomb" else 1e-8)
        assert run["friction"][resting] == pytest.approx(-2.1 * run["x"][resting], abs=1e-7), name


def test_other_forms_have_no_modes() -> None:
    for law in (Karnopp(), Karnopp(form="original"), LeineSwitch(), LeineSwitch(form="original")):
        assert law.states == ()
        assert law.switches(0.1, 5.0, F_e=0.3) == ()


N = 10.0
BACK_AND_FORTH = through([0.0, 3e-5, -3e-5], 1.0)


def test_event_form_has_the_published_peak_and_levels() -> None:
    """Limit 1e-5 m and gradient 0.3: stick up to 1.3 N, slip at 1 N, -1 N after the reversal."""
    law = HaessigFriedland(mu_s=0.13, sigma_1=0.0, form="event")
    run = simulate(prescribed_motion(law, N, BACK_AND_FORTH), 2.0, rtol=1e-9, samples=20_001)
    assert run["friction"].max() == pytest.approx(1.3, abs=2e-3)
    assert np.interp(0.9, run.t, run["friction"]) == pytest.approx(1.0, rel=1e-9)
    assert run["friction"][-2] == pytest.approx(-1.0, rel=1e-9)
    assert [name for _, name in run.happened][:3] == ["slip_begins", "reversal", "slip_begins"]


def test_smooth_form_tends_to_the_event_form() -> None:
    points = np.linspace(0.0, 2.0, 2001)
    exact = HaessigFriedland(sigma_1=0.0, form="event")
    model = prescribed_motion(exact, N, BACK_AND_FORTH)
    expected = simulate(model, 2.0, t_eval=points, rtol=1e-9)["friction"]
    errors = []
    for n, knee in ((20.0, 0.1), (100.0, 0.02), (500.0, 0.004)):
        law = HaessigFriedland(sigma_1=0.0, n=n, knee=knee)
        model = prescribed_motion(law, N, BACK_AND_FORTH)
        found = simulate(model, 2.0, t_eval=points, rtol=1e-9)["friction"]
        errors.append(np.abs(found - expected).mean())
    assert errors[0] > 2 * errors[1] > 4 * errors[2]


def test_stick_is_a_spring_with_the_stiction_gradient_and_damping() -> None:
    law = HaessigFriedland()
    assert law.force(0.0, N, np.array([2e-6])) == pytest.approx(1.5 * 0.2)
    assert law.force(1e-4, N, np.array([0.0])) == pytest.approx(0.019)


K, LIMIT, H = 2.0, 1.0, 0.5


def fine(F: float, v: float, count: int = 4000) -> tuple[float, float]:
    """End and mean of the load in many small steps, cut at the limit in the way of the motion."""
    mean = 0.0
    for _ in range(count):
        before = F
        F += K * v * H / count
        F = min(F, LIMIT) if v > 0 else max(F, -LIMIT) if v < 0 else F
        mean += (before + F) / 2 / count
    return F, mean


def test_end_and_mean_of_a_held_step_are_those_of_small_steps() -> None:
    for v, F in product((0.0, 0.3, -0.3, 0.9, -1.1, 2.5, -2.5), (0.0, 0.4, -0.4, 0.999, -1.0)):
        end, mean, mode = ConstantStep.over(v, H).yielded(F, 0.25, K, LIMIT)
        exact = fine(F, v)
        assert end == pytest.approx(exact[0], abs=1e-12)
        assert mean == pytest.approx(exact[1], abs=1e-4)
        assert mode == (0.25 if v == 0 else float(abs(exact[0]) == LIMIT and exact[0] * v > 0))
    # an element beyond its limit returns at once when it is moved on
    assert ConstantStep.over(0.1, H).yielded(3.0, 0.0, K, LIMIT) == (LIMIT, LIMIT, 1.0)


def test_derivatives_of_a_held_step_are_those_of_the_course_that_is_taken() -> None:
    F, speed, k = (ca.SX.sym(name) for name in ("F", "v", "k"))
    rows = ca.vertcat(*ConstantStep.over(speed, H).yielded(F, ca.SX(0), k, LIMIT)[:2])
    given = ca.vertcat(F, speed, k)
    derivative = ca.Function("d", [given], [ca.jacobian(rows, given)])
    for v in (0.0, 0.3, 2.5):
        gap, way = LIMIT - 0.2, K * v * H
        expected = [[1.0, K * H, v * H], [1.0, K * H / 2, v * H / 2]]
        if 0.2 + way >= LIMIT:
            slope = gap**2 / (2 * way**2)
            expected = [[0.0, 0.0, 0.0], [gap / way, slope * K * H, slope * v * H]]
        found = derivative([0.2, v, K]).full()
        assert np.allclose(found, expected, rtol=1e-12, atol=1e-12)
