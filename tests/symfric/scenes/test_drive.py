"""The positioning drive: closed forms and power."""

import numpy as np
import pytest

from symfric import Coulomb, LuGre, Stribeck, Sum, Viscous, drive, simulate
from symfric.scenes import Drive


def test_coulomb_braking_takes_the_closed_form_time_and_distance() -> None:
    """From 1 m/s with mu g, the smoothing being far below the velocities that count."""
    run = simulate(drive(Coulomb(mu_d=0.1, v_eps=1e-6)), 0.9, x0={"v": 1.0}, rtol=1e-8)
    deceleration = 0.1 * 9.81
    assert run["v"] == pytest.approx(1.0 - deceleration * run.t, abs=1e-6)
    assert run.final["x"] == pytest.approx(0.9 - deceleration * 0.9**2 / 2, abs=1e-6)


def test_offset_opposes_the_input() -> None:
    model = drive(Viscous(sigma_2=2.0), m=1.0, offset=3.0)
    assert simulate(model, 20.0, u={"force": 5.0}).final["v"] == pytest.approx(1.0, rel=1e-5)


def test_load_of_one_newton_reads_coefficients_as_forces() -> None:
    law = Sum((Coulomb(mu_d=20.0), Viscous(sigma_2=240.0)))
    run = simulate(drive(law, m=95.0, N=1.0), 10.0, u={"force": 44.0})
    assert run.final["v"] == pytest.approx(0.1, rel=1e-4)
    assert run.final["friction"] == pytest.approx(44.0, rel=1e-4)


@pytest.mark.parametrize("law", [Stribeck(), LuGre()])
def test_input_work_is_kinetic_energy_plus_what_friction_takes(law: Stribeck | LuGre) -> None:
    run = simulate(drive(law), 2.0, u={"force": 2.0}, rtol=1e-8, samples=20_001)
    kinetic = 0.5 * 0.8 * run.final["v"] ** 2
    taken = np.trapezoid(run["power"], run.t)
    assert 2.0 * run.final["x"] == pytest.approx(kinetic + taken, rel=1e-6)
    assert taken > 0


def test_units_and_names_of_the_signals() -> None:
    assert drive(LuGre()).signals == {
        "x": "m",
        "v": "m/s",
        "z": "m",
        "force": "N",
        "friction": "N",
        "power": "W",
    }


def test_axis_that_turns_has_the_equations_of_one_that_slides_and_its_own_units() -> None:
    free = ["m", "sigma_0"]
    slides, turns = Drive(LuGre()).model(free), Drive(LuGre(), turning=True).model(free)
    runs = [simulate(m, 1.0, u={"force": 1.3}, backend="vm") for m in (slides, turns)]
    assert runs[0].final == runs[1].final
    assert turns.signals == {
        "x": "rad", "v": "rad/s", "z": "rad", "force": "N m", "friction": "N m", "power": "W",
    }  # fmt: skip
    assert [p.unit for p in turns.p] == ["kg m^2", "N m/rad"]
    assert drive(LuGre(), turning=True).signals == turns.signals
    with pytest.raises(ValueError, match="Drive: turning: expected True or False, got 1"):
        Drive(LuGre(), turning=1)  # type: ignore[arg-type]
