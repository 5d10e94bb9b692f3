"""Scenes of several bodies against equations in minimal coordinates and published numbers."""

import numpy as np
import pytest
from mechanics import (
    Rates,
    brown_mcphee,
    double_pendulum,
    four_mass,
    pendulum_box,
    pendulum_period,
    rocker_angle,
    slider_crank,
)
from scipy.integrate import solve_ivp
from stored import stored

import symfric as sf
from symfric.scenes import (
    Arm,
    DoublePendulum,
    FourBar,
    FourMass,
    Pendulum,
    PendulumBox,
    SliderCrank,
)

pytestmark = pytest.mark.heavy

SMOOTH = sf.Viscous(sigma_2=0.0)
"""No friction at all: a float zero leaves no term."""


def reference(name: str, rates: Rates, y0: list[float], times: np.ndarray) -> np.ndarray:
    """Minimal coordinates and their rates at `times`, by SciPy's Radau."""

    def compute() -> np.ndarray:
        run = solve_ivp(
            rates, (0.0, times[-1]), y0, method="Radau", rtol=1e-9, atol=1e-11, t_eval=times
        )
        assert run.success
        return run.y

    return stored(name, compute)


def constraints(run: sf.Trajectory) -> tuple[float, float, float]:
    """Largest violation on position, velocity and acceleration level."""
    return tuple(
        float(run[name].max())
        for name in ("constraint_position", "constraint_velocity", "constraint_acceleration")
    )  # type: ignore[return-value]


def test_pendulum_swings_with_the_elliptic_period() -> None:
    for amplitude in (0.1, 1.0, 3.0):
        period = pendulum_period(np.sqrt(9.81 * 0.5 / (1 / 12 + 0.25)), amplitude)
        model = Pendulum(SMOOTH, phi_0=amplitude).model()
        run = sf.simulate(model, 2 * period, rtol=1e-10, t_eval=[period, 2 * period])
        assert run["phi"] == pytest.approx([amplitude, amplitude], abs=1e-8)
        assert run["phi_rate"] == pytest.approx([0.0, 0.0], abs=1e-7)


def test_double_pendulum_agrees_with_the_textbook() -> None:
    times = np.linspace(0.1, 4.0, 40)
    a, b, *_ = reference(
        "double_pendulum", double_pendulum(1.0, 1.0, 9.81), [2.0, 2.0, 0.0, 0.0], times
    )
    run = sf.simulate(DoublePendulum(SMOOTH).model(), 4.0, rtol=1e-10, t_eval=times)
    assert run["phi_1"] == pytest.approx(a, abs=2e-6)
    assert run["phi_1"] + run["phi_2"] == pytest.approx(b, abs=2e-6)
    assert np.ptp(run["energy"]) < 1e-7


def test_pendulum_on_a_box_agrees_with_newtons_laws() -> None:
    law = sf.BrownMcPhee(mu_s=0.03, mu_d=0.02, v_t=0.02)
    times = np.linspace(0.1, 5.0, 25)

    def mu(v: float) -> float:
        return brown_mcphee(v, 0.03, 0.02, 0.02)

    start, rates = [0, np.pi / 6, 0, 0], pendulum_box(6.0, 20.0, 0.3, 0.05, 9.81, mu)
    expected = reference("pendulum_box", rates, start, times)
    run = sf.simulate(PendulumBox(law, R=0.05).model(), 5.0, rtol=1e-9, t_eval=times)
    for name, values in zip(("x", "phi", "x_rate", "phi_rate"), expected, strict=True):
        assert run[name] == pytest.approx(values, abs=1e-6), name


def four_mass_model(law: sf.Law | None) -> sf.Model:
    return FourMass(SMOOTH if law is None else law).model()


PEAK = sf.BrownMcPhee(mu_s=0.12, mu_d=0.1, v_t=0.01)


def test_frictionless_four_mass_meets_the_published_positions() -> None:
    """Section 5a of the reference: energy 387.936521 J."""
    run = sf.simulate(four_mass_model(None), 4.0, rtol=1e-11, t_eval=[4.0])
    found = [run[name][0] for name in ("x1", "y2", "z3", "x4")]
    assert found == pytest.approx([-0.54021178, 4.97073146, 4.92867414, -2.15971352], abs=1e-8)
    assert run["energy"][0] == pytest.approx(387.936521, abs=1e-6)
    assert max(constraints(run)) < 1e-11


def test_four_mass_with_the_self_tuning_law_meets_the_published_positions() -> None:
    law = sf.SelfTuning.from_peak_velocity(0.01, mu_s=0.12, mu_d=0.1)
    assert pytest.approx(1.37286, abs=1e-5) == law.C
    run = sf.simulate(four_mass_model(law), 4.0, rtol=1e-9, t_eval=[2.0, 4.0])
    found = np.array([run[name] for name in ("x1", "y2", "z3", "x4")])
    assert found[:, 0] == pytest.approx([0.753115, 4.942956, 4.956529, 2.497415], abs=1e-5)
    assert found[:, 1] == pytest.approx([-0.135846, 4.998154, 4.900863, 0.207150], abs=1e-5)
    assert run["energy"][1] == pytest.approx(304.772, abs=1e-3)


def test_slider_crank_with_the_self_tuning_law_meets_the_published_numbers() -> None:
    law = sf.SelfTuning.from_peak_velocity(0.01, mu_s=0.1, mu_d=0.08)
    run = sf.simulate(SliderCrank(law).model(), 0.25, rtol=1e-10)
    assert [run["crank_rate"][-1], run["crank"][-1]] == pytest.approx([84.3534, 25.2698], abs=1e-4)
    assert run["energy"][-1] == pytest.approx(741.108, abs=1e-2)


def test_four_mass_agrees_with_minimal_coordinates_and_published_positions() -> None:
    times = np.linspace(0.1, 4.0, 40)

    def mu(v: float) -> float:
        return brown_mcphee(v, 0.12, 0.1, 0.01)

    th, x4, *_ = reference("four_mass", four_mass(mu), [np.arctan2(3, 4), 5.0, 0.0, -1.0], times)
    run = sf.simulate(four_mass_model(PEAK), 4.0, rtol=1e-9, t_eval=times)
    found = np.array([run[name] for name in ("x1", "y2", "z3", "x4")])[:, [19, 39]]  # as published
    assert found[:, 0] == pytest.approx([0.765030, 4.941126, 4.958354, 2.484775], abs=1e-5)
    assert found[:, 1] == pytest.approx([-0.134542, 4.998190, 4.900827, 0.212878], abs=1e-5)
    assert run["energy"][-1] == pytest.approx(304.733, abs=1e-3)
    assert run["x1"] == pytest.approx(5 * np.cos(th), abs=1e-6)
    assert run["y2"] == pytest.approx(5 * np.sin(th), abs=1e-6)
    assert run["z3"] == pytest.approx(np.sqrt(49 - 25 * np.sin(th) ** 2), abs=1e-6)
    assert run["x4"] == pytest.approx(x4, abs=1e-6)
    assert run["constraint_position"].max() < 1e-11
    assert run["constraint_velocity"].max() < 1e-13
    assert run["constraint_acceleration"].max() < 1e-11
    assert (np.diff(run["energy"]) < 1e-9).all()


def test_frictionless_slider_crank_keeps_its_energy_and_meets_the_published_numbers() -> None:
    run = sf.simulate(SliderCrank(SMOOTH).model(), 0.25, rtol=1e-11)
    last = [run[name][-1] for name in ("crank_rate", "crank", "slider")]
    assert last == pytest.approx([120.8896, 30.1022, 0.20990], abs=5e-5)
    th = run["crank"]
    py, pz = 0.1 - 0.08 * np.sin(th), 0.1 + 0.08 * np.cos(th)
    x = np.sqrt(0.09 - py**2 - pz**2)
    slope = (0.08 * np.cos(th) * py + 0.08 * np.sin(th) * pz) / x
    closed = 120.0 * np.sqrt((0.2 + 5 * slope[0] ** 2) / (0.2 + 5 * slope**2))
    assert run["slider"] == pytest.approx(x, abs=1e-12)
    assert run["crank_rate"] == pytest.approx(closed, abs=1e-6)


CRANK = sf.BrownMcPhee(mu_s=0.1, mu_d=0.08, v_t=0.01)


def test_slider_crank_agrees_with_the_crank_angle_alone_and_published_numbers() -> None:
    times = np.linspace(0.01, 0.25, 25)

    def mu(v: float) -> float:
        return brown_mcphee(v, 0.1, 0.08, 0.01)

    th, w = reference("slider_crank", slider_crank(mu), [0.0, 120.0], times)
    run = sf.simulate(SliderCrank(CRANK).model(), 0.25, rtol=1e-10, t_eval=[0.0, *times])
    assert run["crank"][1:] == pytest.approx(th, abs=1e-6)
    assert run["crank_rate"][1:] == pytest.approx(w, abs=1e-4)
    assert run["crank_N"][0] == pytest.approx(4724.36, abs=5e-3)
    assert -run["crank_power"][0] == pytest.approx(-4535.4, abs=0.05)
    last = [run[name][-1] for name in ("crank_rate", "crank", "slider")]
    assert last == pytest.approx([84.363452, 25.271674, 0.2235396], abs=5e-6)
    assert constraints(run) < (1e-13, 1e-13 * 120, 1e-12 * 1e4)


def test_four_bar_closes_by_the_freudenstein_equation() -> None:
    scene = FourBar(sf.Coulomb(v_eps=0.02))
    run = sf.simulate(scene.model(), 3.0, rtol=1e-8)
    expected = [rocker_angle(0.1, 0.35, 0.3, 0.4, th) for th in run["theta_crank"]]
    off = np.abs(np.exp(1j * run["theta_rocker"]) - np.exp(1j * np.array(expected)))
    assert off.max() < 1e-11
    assert (np.diff(run["energy"]) < 1e-9).all()


def test_arm_loses_what_friction_takes() -> None:
    model = Arm(sf.LuGreNormalised()).model()
    assert (len(model.x), len(model.z)) == (18, 6)
    run = sf.simulate(model, 0.1, rtol=1e-8, samples=4001)
    dissipated = sum(run[f"q{i}_power"] for i in range(1, 7))
    work = np.trapezoid(dissipated, run.t)
    assert run["energy"][0] - run["energy"][-1] == pytest.approx(work, rel=1e-5)
    assert min(run[f"q{i}_N"].min() for i in range(1, 7)) > 0


def test_another_parameter_closes_the_loop_again() -> None:
    """A longer rod than the model was written for: the start is assembled."""
    model = SliderCrank(CRANK).model(["l"])
    run = sf.simulate(model, 0.01, p={"l": 0.35}, rtol=1e-8)
    assert run["constraint_position"].max() < 1e-12
    assert run["slider"][0] == pytest.approx(np.sqrt(0.35**2 - 0.1**2 - 0.18**2))
