"""Clutch, drill string and nip against closed forms and other formulations."""

from math import atan, pi, sqrt

import numpy as np
import pytest
from mechanics import brown_mcphee
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from symfric import BrownMcPhee, Coulomb, ExactCoulomb, Linear, LuGre, Stribeck, Viscous, simulate
from symfric.integrator import Input
from symfric.scenes import Clutch, DrillString, Nip

J_1, J_2, T_1, T_2, W = 0.2, 0.64, 100.0, 20.0, 150.0
GRIP = 2 * 0.1 * 0.1 * 0.008 * pi
"""Torque [N m] of a pascal at mu = 0.1: two faces at 0.1 m."""
FREE, BOTH = T_1 / J_1 + T_2 / J_2, 1 / J_1 + 1 / J_2
DRY = ExactCoulomb(mu_s=0.1, mu_d=0.1)


@pytest.mark.parametrize("pressure", [4e5, 4e6, 4e8])
def test_full_pressure_locks_and_loses_what_the_closed_form_says(pressure: float) -> None:
    T = GRIP * pressure
    a = T * BOTH - FREE
    scene = Clutch(DRY, N_0=0.0)
    run = simulate(scene.model(), 3 * W / a, u={"pressure": pressure}, rtol=1e-9)
    (locked,) = (t for t, name in run.happened if name == "stick")
    assert locked == pytest.approx(W / a, rel=1e-9)
    assert run["heat"][-1] == pytest.approx(T * W * W / (2 * a), rel=1e-7)
    speed = (J_1 * W + (T_1 - T_2) * run.t[-1]) / (J_1 + J_2)  # momentum of both
    assert (run["w_2"][-1], run["w_1"][-1]) == pytest.approx((speed, speed), rel=1e-9)
    assert run["w_rel"][-1] == 0.0
    assert run["torque"][-1] == pytest.approx((J_2 * T_1 + J_1 * T_2) / (J_1 + J_2))


def test_a_ramp_of_pressure_locks_when_the_parabola_says() -> None:
    """slip = W + FREE t - BOTH GRIP p t^2 / 2 for the pressure p t."""
    rate = 4e6
    run = simulate(
        Clutch(DRY, N_0=0.0).model(), 0.6, u={"pressure": lambda t: rate * t}, rtol=1e-10
    )
    b = BOTH * GRIP * rate
    expected = (FREE + np.sqrt(FREE**2 + 2 * b * W)) / b
    assert run.happened[0][0] == pytest.approx(expected, rel=1e-8)
    t = np.linspace(0.0, expected, 4001)
    lost = np.trapezoid(GRIP * rate * t * (W + FREE * t - b * t * t / 2), t)
    assert run["heat"][-1] == pytest.approx(lost, rel=1e-6)


def test_a_locked_clutch_slips_again_where_the_pressure_no_longer_holds() -> None:
    """The torque that it must hold is known; static friction is half as much again."""
    law = ExactCoulomb(mu_s=0.15, mu_d=0.1)
    down: Input = Linear([0.0, 1.0, 2.0], [4e5, 4e5, 0.0])
    run = simulate(Clutch(law, N_0=0.0).model(), 2.0, u={"pressure": down}, rtol=1e-9)
    held = (J_2 * T_1 + J_1 * T_2) / (J_1 + J_2)
    expected = 1.0 + (1 - held / (1.5 * GRIP * 4e5))
    (slips,) = (t for t, name in run.happened if name == "slip")
    assert slips == pytest.approx(expected, abs=1e-6)
    assert run["w_rel"][-1] > 10.0


def test_power_is_what_becomes_heat_and_the_rest_stays_kinetic() -> None:
    scene = Clutch(LuGre())
    inputs = {n: given.function for n, given in scene.inputs.items()}
    run = simulate(scene.model(), scene.t_end, u=inputs, rtol=1e-8, samples=20001)
    assert np.trapezoid(run["power"], run.t) == pytest.approx(run["heat"][-1], rel=1e-4)
    kinetic = (J_1 * run["w_1"] ** 2 + J_2 * run["w_2"] ** 2) / 2
    work = np.trapezoid(T_1 * run["w_1"] - T_2 * run["w_2"], run.t)
    assert kinetic[-1] - kinetic[0] == pytest.approx(work - run["heat"][-1], rel=1e-4)


def test_an_open_clutch_has_its_drag_alone_also_below_zero() -> None:
    run = simulate(Clutch(Coulomb()).model(), 0.1, u={"pressure": -1e5})
    assert run["torque"] == pytest.approx(np.full(run.t.size, 0.02))
    assert simulate(Clutch(Viscous(), N_0=0.0).model(), 0.01).status.ok


Array = NDArray[np.float64]
J_BIT, J_STRING, K, C, C_B, R = 471.9698, 100.0, 861.5336, 172.3067, 50.0, 0.155575


def in_angles(n: int, w_top: float, N: float, times: Array) -> Array:
    """Speed of the bit and torque of the top, by absolute angles of top and lumps."""
    J = np.full(n, J_STRING / n)
    J[-1] = J_BIT + J_STRING / n / 2

    def torques(t: float, y: Array) -> Array:
        angle, speed = np.r_[w_top * t, y[:n]], np.r_[w_top, y[n:]]
        return -n * (K * np.diff(angle) + C * np.diff(speed))

    def rates(t: float, y: Array) -> Array:
        above = torques(t, y)
        below = np.r_[above[1:], R * N * brown_mcphee(R * y[-1], 0.15, 0.1, 0.01) + C_B * y[-1]]
        return np.r_[y[n:], (above - below) / J]

    run = solve_ivp(rates, (0.0, times[-1]), np.zeros(2 * n), "LSODA", times, rtol=1e-9, atol=1e-11)
    assert run.success
    top = [torques(t, y)[0] for t, y in zip(times, run.y.T, strict=True)]
    return np.array([run.y[-1], top])


def test_string_agrees_with_absolute_angles() -> None:
    lumps, times = 3, np.linspace(1.0, 15.0, 15)
    bit, top = in_angles(lumps, 0.3, 97347.0, times)
    scene = DrillString(BrownMcPhee(v_t=0.01), lumps=lumps)
    run = simulate(scene.model(), 15.0, u={"w_top": 0.3}, t_eval=times, rtol=1e-9)
    assert run["w_bit"] == pytest.approx(bit, abs=1e-6)
    assert run["torque_top"] == pytest.approx(top, rel=1e-6)


def test_one_inertia_without_damping_sticks_and_slips_with_the_period_of_dry_friction() -> None:
    """As a block on a belt: 2 A/w_top + 2 (pi - atan(A w/w_top))/w with A half the fall."""
    law, w_top = ExactCoulomb(mu_s=0.15, mu_d=0.1), 0.5
    scene = DrillString(law, lumps=1, J_string=0.0, c=0.0, c_b=0.0)
    run = simulate(scene.model(), 60.0, u={"w_top": w_top}, rtol=1e-10)
    A, w = 0.05 * 97347.0 * R / K, sqrt(K / J_BIT)
    period = 2 * A / w_top + 2 * (pi - atan(A * w / w_top)) / w
    slips = [t for t, name in run.happened if name == "slip"]
    assert len(slips) > 3
    assert np.diff(slips)[1:] == pytest.approx(period, rel=1e-7)
    peak = 0.1 * 97347.0 * R + K * sqrt(A * A + (w_top / w) ** 2)
    assert run["torque_top"].max() == pytest.approx(peak, rel=1e-4)


@pytest.mark.parametrize(("w_top", "sticks"), [(3.0, True), (8.0, False)])
def test_rock_of_the_paper_sticks_at_low_speed_only(w_top: float, sticks: bool) -> None:
    run = simulate(
        DrillString.preset("navarro_lopez", Stribeck()).model(), 60.0, u={"w_top": w_top}
    )
    late = run["w_bit"][run.t > 40]
    assert bool(late.min() < 1e-2) is sticks
    if not sticks:
        assert late == pytest.approx(w_top, rel=5e-3)
        rock = 97347.0 * R * (0.5 + 0.3 * np.exp(-0.9 * w_top))  # as the paper writes it
        assert run["torque_top"][-1] == pytest.approx(rock + C_B * w_top, rel=5e-3)


J, RADIUS, SHAFT, D, LAG = 0.2, 0.1, 200.0, 0.5, 0.015


def plain(times: Array) -> Array:
    """Speeds of line and roller and torque of the shaft, in the speed of the roller itself."""

    def load(t: float) -> float:
        return 1.0 + 500 + 25 * np.sin(5 * t)

    def rates(t: float, y: Array) -> Array:
        line, w, twist = y
        w_0 = (1 - LAG) * line / RADIUS
        friction = load(t) * brown_mcphee(line - RADIUS * w, 0.15, 0.1, 0.01)
        shaft = SHAFT * twist + D * (w_0 - w)
        return np.array(
            [(0.125 * min(t, 4.0) - line) / 0.1, (RADIUS * friction + shaft) / J, w_0 - w]
        )

    run = solve_ivp(
        rates, (0.0, times[-1]), np.zeros(3), "Radau", times, rtol=1e-9, atol=1e-12, max_step=0.1
    )
    assert run.success
    return run.y


def test_nip_agrees_with_its_equations_in_speeds() -> None:
    times = np.linspace(0.1, 3.9, 20)  # the ramp ends at 4 s
    line, w, twist = plain(times)
    scene = Nip(BrownMcPhee(v_t=0.01))
    inputs = {n: given.function for n, given in scene.inputs.items()}
    run = simulate(scene.model(), 3.9, u=inputs, t_eval=times, rtol=1e-9)
    for name, values in (("v_line", line), ("w_roller", w), ("twist", twist)):
        assert run[name] == pytest.approx(values, abs=1e-6), name


def test_far_from_the_fall_of_the_curve_the_web_slips_by_the_lag() -> None:
    law = Stribeck(sigma_2=50.0, v_s=1e-4)
    run = simulate(Nip(law, d=20.0).model(), 20.0, u={"v_set": 0.5, "load": 300.0})
    slip = LAG * 0.5
    friction = 301.0 * 0.1 + 50.0 * slip
    assert run["v_rel"][-1] == pytest.approx(slip, rel=1e-4)
    assert run["friction"][-1] == pytest.approx(friction, rel=1e-4)
    assert run["torque"][-1] == pytest.approx(-RADIUS * friction, rel=1e-4)


def test_a_web_that_carries_the_roller_winds_up_its_shaft_to_the_static_level() -> None:
    """At constant line speed the shaft winds by lag v_line / R a second, up to mu_s N R / k."""
    law = ExactCoulomb(mu_s=0.15, mu_d=0.1)
    scene = Nip(law, d=0.0)
    x0 = {"v_line": 0.5, "v_rel": 0.0, "twist": 0.0}
    run = simulate(scene.model(), 1.0, x0=x0, u={"v_set": 0.5, "load": 499.0}, rtol=1e-9)
    breaks = next(t for t, name in run.happened if name == "slip" and t > 0)
    assert breaks == pytest.approx((0.15 * 500.0 * RADIUS / SHAFT) / (LAG * 0.5 / RADIUS), rel=1e-7)
