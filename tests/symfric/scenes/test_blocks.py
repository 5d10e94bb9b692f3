"""Drive, block on a belt and coupled blocks against closed forms and other solvers."""

from functools import cache
from math import atan, pi, sqrt

import numpy as np
import pytest
from dry import blocks_on_belt
from mechanics import brown_mcphee
from oracles import StickSlip, rabinowicz_coulomb, rabinowicz_lugre
from scipy.integrate import solve_ivp
from stored import stored

import symfric as sf
from symfric import BrownMcPhee, Coulomb, ExactCoulomb, Linear, LuGre, Stribeck, Viscous, simulate
from symfric.foundation.numeric import Array
from symfric.integrator import Input
from symfric.scenes import Clutch, CoupledBlocks, DrillString, Drive, Nip


def test_coulomb_braking_takes_the_closed_form_time_and_distance() -> None:
    """From 1 m/s with mu g, the smoothing being far below the velocities that count."""
    run = sf.simulate(sf.drive(sf.Coulomb(mu_d=0.1, v_eps=1e-6)), 0.9, x0={"v": 1.0}, rtol=1e-8)
    deceleration = 0.1 * 9.81
    assert run["v"] == pytest.approx(1.0 - deceleration * run.t, abs=1e-6)
    assert run.final["x"] == pytest.approx(0.9 - deceleration * 0.9**2 / 2, abs=1e-6)


def test_offset_opposes_the_input() -> None:
    model = sf.drive(sf.Viscous(sigma_2=2.0), m=1.0, offset=3.0)
    assert sf.simulate(model, 20.0, u={"force": 5.0}).final["v"] == pytest.approx(1.0, rel=1e-5)


def test_axis_that_turns_has_the_equations_of_one_that_slides_and_its_own_units() -> None:
    free = ["m", "sigma_0"]
    slides, turns = Drive(sf.LuGre()).model(free), Drive(sf.LuGre(), turning=True).model(free)
    runs = [sf.simulate(m, 1.0, u={"force": 1.3}, backend="vm") for m in (slides, turns)]
    assert runs[0].final == runs[1].final
    assert turns.signals == {
        "x": "rad", "v": "rad/s", "z": "rad", "force": "N m", "friction": "N m", "power": "W",
    }  # fmt: skip
    assert [p.unit for p in turns.p] == ["kg m^2", "N m/rad"]
    assert sf.drive(sf.LuGre(), turning=True).signals == turns.signals


M, K, V_BELT, G = 0.8, 2.1, 0.1, 9.81


def ideal(mu_s: float = 0.15, mu_d: float = 0.1) -> StickSlip:
    return rabinowicz_coulomb(mu_s, mu_d, M, K, V_BELT, G)


def test_closed_form_has_the_published_numbers() -> None:
    found = ideal()
    assert found.stick_time == pytest.approx(3.737143, abs=5e-7)
    assert found.slip_time == pytest.approx(2.332852, abs=5e-7)
    assert found.period == pytest.approx(6.069995, abs=5e-7)
    assert (found.x_max, found.x_min) == pytest.approx((0.570501, 0.176927), abs=5e-7)


def test_belt_carries_the_block_along_while_friction_opposes_the_slip() -> None:
    for name, kind in sf.ALL_LAWS.items():
        if {i.name for i in kind().inputs} <= {"F_e"}:
            model = sf.rabinowicz(kind())
            at = 0.0, model.initial_state(), [], [], []
            assert float(model.function("v_rel")(*at)) == -V_BELT, name
            assert float(model.function("friction")(*at)) < 0, name
            assert float(model.function("ode")(*at)[1]) > 0, name


def energy(run: sf.Trajectory) -> np.ndarray:
    return 0.5 * M * run["v"] ** 2 + 0.5 * K * run["x"] ** 2


@pytest.mark.parametrize("law", [sf.BrownMcPhee(v_t=1e-2), sf.LuGre(), sf.Dahl()])
def test_energy_gained_is_work_of_the_belt_less_what_the_contact_takes(law: sf.Law) -> None:
    run = sf.simulate(sf.rabinowicz(law), 9.0, rtol=1e-8, samples=100_001)
    belt = np.trapezoid(-run["friction"] * V_BELT, run.t)
    contact = np.trapezoid(run["power"], run.t)
    gained = energy(run)[-1] - energy(run)[0]
    assert contact > 0
    assert belt > contact
    assert gained == pytest.approx(belt - contact, abs=2e-5 * belt)


@cache
def cycle(law: sf.Law) -> tuple[float, float, float]:
    """Period, largest and smallest elongation of the settled stick-slip."""
    run = sf.simulate(sf.rabinowicz(law), 26.0, rtol=1e-9, samples=26_001)
    settled, x = run.t > 7.0, run["x"] - ideal().x_centre
    falling = np.flatnonzero((x[:-1] > 0) & (x[1:] <= 0))
    share = x[falling] / (x[falling] - x[falling + 1])
    crossings = run.t[falling] + share * np.diff(run.t)[falling]
    inside = run["x"][settled]
    return float(np.diff(crossings)[-1]), float(inside.max()), float(inside.min())


def brown_mcphee_peak() -> float:
    """Its peak misses the static level, which is what its stick-slip tends to."""
    x = np.linspace(0.9, 1.1, 200_001)
    return float(np.max(sf.BrownMcPhee(v_t=1.0).force(x, 1.0)))


WIDTHS = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6)


@cache
def errors(kind: str) -> np.ndarray:
    """Distance of period, x_max and x_min to the closed form, a row per width."""
    if kind == "brown_mcphee":
        target, laws = ideal(mu_s=brown_mcphee_peak()), [sf.BrownMcPhee(v_t=w) for w in WIDTHS]
    else:
        target, laws = ideal(), [sf.SelfTuning.from_peak_velocity(w) for w in WIDTHS]
    expected = target.period, target.x_max, target.x_min
    return np.abs(np.array([cycle(law) for law in laws]) - expected)


KINDS = ["brown_mcphee", pytest.param("self_tuning", marks=pytest.mark.slow)]


@pytest.mark.parametrize("kind", KINDS)
def test_stick_slip_approaches_the_closed_form_with_the_width(kind: str) -> None:
    """Its period with the power 2/3."""
    period, turning = errors(kind)[:, 0], errors(kind)[2:, 1:]
    assert (np.diff(period) < 0).all()
    rates = np.log10(period[:-1] / period[1:])
    assert rates[-2:] == pytest.approx(2 / 3, abs=0.03)
    assert period[-1] < 1.1e-3
    assert (np.diff(turning, axis=0) < 0).all()
    assert turning[-1] == pytest.approx(0.0, abs=6e-5)


def test_seed_widths_of_brown_mcphee_come_as_close_as_stated() -> None:
    """Against the plain closed form: 1e-5 hits it by chance, between its two errors."""
    periods = [cycle(sf.BrownMcPhee(v_t=w))[0] for w in WIDTHS]
    assert [round(p - ideal().period, 3) for p in periods] == [0.48, 0.097, 0.017, 0.0, -0.003]


@cache
def reference() -> tuple[np.ndarray, np.ndarray]:
    """Times and (x, v, z) of LuGre stick-slip by SciPy's Radau at 1e-12."""
    t = np.linspace(0.0, 8.0, 161)

    def compute() -> np.ndarray:
        run = solve_ivp(
            rabinowicz_lugre(),
            (0.0, 8.0),
            [0.0, 0.0, -0.1 * M * G / 1e5],
            method="Radau",
            rtol=1e-12,
            atol=[1e-15, 1e-15, 1e-19],
            t_eval=t,
        )
        assert run.success
        return run.y

    return t, stored("rabinowicz_lugre", compute)


def test_lugre_agrees_with_an_independent_integrator_if_smoothed_below_its_creep() -> None:
    """The creep while sticking is k v_belt / sigma_0 = 2.1e-6 m/s."""
    t, expected = reference()
    for v_eps, rtol, error in (
        (0.0, 1e-6, 2e-4), (0.0, 1e-10, 2e-8), (1e-9, 1e-10, 2e-8), (1e-6, 1e-10, 1e-6),
    ):  # fmt: skip
        run = sf.simulate(sf.rabinowicz(sf.LuGre(v_eps=v_eps)), 8.0, t_eval=t, rtol=rtol)
        assert np.abs(run["x"] - expected[0]).max() < error
        assert v_eps or np.abs(run["v"] - expected[1]).max() < error
        assert v_eps or np.abs(run["z"] - expected[2]).max() < error * 1e-4
    with pytest.warns(sf.OverloadWarning, match="times its static level"):
        run = sf.simulate(sf.rabinowicz(sf.LuGre(v_eps=1e-5)), 8.0, t_eval=t, rtol=1e-8)
    assert np.abs(run["x"] - expected[0]).max() > 0.1


UNIT = {"m_1": 1.0, "m_2": 1.0, "g": 1.0, "start_2": 0.0}


@pytest.mark.parametrize("v_belt", [0.1, 0.3])
def test_blocks_stick_and_slip_as_the_matrix_exponential(v_belt: float) -> None:
    laws = sf.ExactCoulomb(mu_s=1.0, mu_d=0.7), sf.ExactCoulomb(mu_s=1.3, mu_d=0.9)
    K = np.array([[1.0 + 1.2, -1.2], [-1.2, 0.8 + 1.2]])
    happened, last = blocks_on_belt(K, (1.0, 1.3), (0.7, 0.9), v_belt, 40.0)
    scene = CoupledBlocks(
        laws[0], block_2=laws[1], k_1=1.0, k_2=0.8, k_c=1.2, v_belt=v_belt, **UNIT
    )
    run = sf.simulate(scene.model(), 40.0, rtol=1e-10)
    found = [(t, int(name[6]) - 1, name[8:]) for t, name in run.happened]
    assert len(happened) > 10
    assert [(i, what) for _, i, what in found] == [(i, what) for _, i, what in happened]
    assert [t for t, _, _ in found] == pytest.approx([t for t, _, _ in happened], abs=1e-7)
    final = [run[name][-1] for name in ("x_1", "x_2", "v_1", "v_2")]
    assert final == pytest.approx(last, abs=1e-7)
    x, v = (np.array([run[f"{name}_{i}"][[0, -1]] for i in (1, 2)]) for name in "xv")
    stored_energy = (np.sum(v * v, axis=0) + np.sum(x * (K @ x), axis=0)) / 2
    force, heat = (
        sum(run.integral(f"{name}_{i}")[-1] for i in (1, 2)) for name in ("friction", "power")
    )
    assert np.diff(stored_energy) == pytest.approx(-v_belt * force - heat, abs=1e-6)


J_1, J_2, T_1, T_2, W = 0.2, 0.64, 100.0, 20.0, 150.0
GRIP = 2 * 0.1 * 0.1 * 0.008 * pi
"""Torque [N m] of a pascal at mu = 0.1: two faces at 0.1 m."""
FREE, BOTH = T_1 / J_1 + T_2 / J_2, 1 / J_1 + 1 / J_2
DRY = ExactCoulomb(mu_s=0.1, mu_d=0.1)


@pytest.mark.parametrize("pressure", [4e5, 4e6, 4e8])
def test_full_pressure_locks_with_the_loss_of_the_closed_form(pressure: float) -> None:
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


def test_a_ramp_of_pressure_locks_at_the_time_of_the_parabola() -> None:
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


J_BIT, J_STRING, STIFFNESS, C, C_B, R = 471.9698, 100.0, 861.5336, 172.3067, 50.0, 0.155575


def in_angles(n: int, w_top: float, N: float, times: Array) -> Array:
    """Speed of the bit and torque of the top, by absolute angles of top and lumps."""
    J = np.full(n, J_STRING / n)
    J[-1] = J_BIT + J_STRING / n / 2

    def torques(t: float, y: Array) -> Array:
        angle, speed = np.r_[w_top * t, y[:n]], np.r_[w_top, y[n:]]
        return -n * (STIFFNESS * np.diff(angle) + C * np.diff(speed))

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
    A, w = 0.05 * 97347.0 * R / STIFFNESS, sqrt(STIFFNESS / J_BIT)
    period = 2 * A / w_top + 2 * (pi - atan(A * w / w_top)) / w
    slips = [t for t, name in run.happened if name == "slip"]
    assert len(slips) > 3
    assert np.diff(slips)[1:] == pytest.approx(period, rel=1e-7)
    peak = 0.1 * 97347.0 * R + STIFFNESS * sqrt(A * A + (w_top / w) ** 2)
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
