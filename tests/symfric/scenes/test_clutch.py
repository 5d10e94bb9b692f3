"""The clutch against closed forms: when it locks, what it loses, when it breaks away again."""

from math import pi

import numpy as np
import pytest

from symfric import Coulomb, ExactCoulomb, Linear, LuGre, Viscous, simulate
from symfric.integrator import Input
from symfric.results.kinds import main
from symfric.scenes import Clutch

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


def test_smooth_friction_creeps_on_by_what_the_held_torque_needs() -> None:
    """tanh(v / v_eps) = held / T once the speeds of both sides grow alike."""
    law = Coulomb(mu_d=0.1, v_eps=1e-3)
    run = simulate(Clutch(law, N_0=0.0).model(), 0.6, u={"pressure": 4e5}, rtol=1e-9)
    held = (J_2 * T_1 + J_1 * T_2) / (J_1 + J_2)
    assert run["v_rel"][-1] == pytest.approx(1e-3 * np.arctanh(held / (GRIP * 4e5)), rel=1e-6)
    T = GRIP * 4e5
    assert run["heat"][-1] == pytest.approx(T * W * W / (2 * (T * BOTH - FREE)), rel=1e-3)


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
    with pytest.raises(ValueError, match="expected a normal force above 0 N"):
        Clutch(LuGre(), N_0=0.0).model()
    assert simulate(Clutch(Viscous(), N_0=0.0).model(), 0.01).status.ok


def test_a_picture_shows_speeds_where_nothing_is_a_position() -> None:
    model = Clutch(Coulomb()).model()
    groups = main(model, {name: unit for name, unit in simulate(model, 0.01).units.items()})
    assert (groups[0].title, set(groups[0].names)) == ("speed", {"w_rel", "w_1", "w_2"})
