"""The sampled engine against closed forms, differences and adaptive simulations."""

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from fits import evaluated
from tables import sampled

import symfric as sf
from identification.data.dataset import Dataset
from identification.residuals import stepper
from identification.residuals.shooting import Shooting
from identification.residuals.shots import means, sampled_motion
from identification.residuals.stepper import SteppedMotion
from identification.unknowns.subject import Subject, subject
from symfric.foundation.parameters import Variable
from symfric.foundation.programs import find_compiler
from symfric.model import Model
from symfric.scenes import Drive

STEP = 1e-3


@pytest.fixture(autouse=True)
def _no_compiler(monkeypatch: pytest.MonkeyPatch) -> None:
    """Short runs are not worth a compiler, and have the same bits without it."""
    monkeypatch.setattr(stepper, "find_compiler", lambda: None)


def run(model: Model, force: np.ndarray, p: list[float], start: list[float], **how: object):
    t = np.arange(force.size) * how.pop("step", STEP)  # type: ignore[operator]
    motion = sampled_motion(model, t, force, np.array(p), np.array(start), **how)  # type: ignore[arg-type]
    return motion


LAW = sf.Sum((sf.Stribeck(mu_s=3.0, mu_d=2.0, v_s=0.05, v_eps=1e-5), sf.Viscous(1.0)))
TIMES = STEP * np.arange(2001)
FORCE = 5 * np.sin(2 * np.pi * TIMES) + 2 * np.sin(4.6 * np.pi * TIMES)
"""A drive that slides both ways, stops, is held and breaks away; two seconds."""


def stick_slip() -> tuple[Model, list[float]]:
    known = sf.parameters(LAW)
    viscous = [name for name in known if name.startswith("sigma_2")][-1]
    values = {"m": 1.5, "offset": -0.4, "mu_s": 3.0, "mu_d": 2.0, "v_s": 0.05, viscous: 1.0}
    model = sf.drive(LAW, m=1.5, N=1.0, free=[*values])
    return model, [values[v.name] for v in model.p]


def test_coulomb_and_viscous_friction_are_exact_at_any_step() -> None:
    m, s, c, f = 2.0, 30.0, 4.0, 10.0
    model = sf.drive(sf.Sum((sf.Coulomb(c, v_eps=1e-9), sf.Viscous(s))), m=m, N=1.0)
    for step in (1e-3, 0.05):  # s step / m up to 0.75
        motion = run(model, np.full(5, f), [], [0.0, 1.0], step=step, substeps=1)
        end, rate = (f - c) / s, s / m
        expected = end + (1 - end) * np.exp(-rate * step * np.arange(5))
        np.testing.assert_allclose(motion.states[:, 1], expected, rtol=1e-13)


def test_a_thrown_block_stops_at_the_place_of_the_closed_form() -> None:
    model = sf.drive(sf.Coulomb(mu_d=4.0, v_eps=1e-9), m=2.0, N=1.0, free=["m", "mu_d"])
    motion = run(model, np.zeros(2001), [2.0, 4.0], [0.0, 1.0])
    x, v = motion.states[-1]
    # x = m v^2 / (2 F): slopes by m, F, x0, v0
    assert x == pytest.approx(2.0 / 8.0, rel=1e-6)
    assert v == 0.0
    np.testing.assert_allclose(motion.slopes[-1, 0], [0.125, -0.0625, 1.0, 0.5], rtol=2e-3)
    assert not motion.slopes[-1, 1].any()


@pytest.mark.parametrize("v_eps", [0.0, 1e-12, 1e-6, 1e-2])
def test_a_loaded_block_is_held_at_any_stiffness(v_eps: float) -> None:
    model = sf.drive(sf.Coulomb(mu_d=4.0, v_eps=v_eps), m=2.0, N=1.0)
    motion = run(model, np.full(1000, 3.0), [], [0.0, 0.0])
    assert motion.states[-1, 1] == pytest.approx(v_eps * np.arctanh(0.75), rel=1e-6, abs=1e-12)


@pytest.mark.parametrize("v_eps", [0.0, 1e-9, 1e-4])
def test_a_loaded_block_breaks_away_at_any_stiffness(v_eps: float) -> None:
    model = sf.drive(sf.Coulomb(mu_d=4.0, v_eps=v_eps), m=2.0, N=1.0)
    force = np.where(np.arange(1001) < 500, 3.9, 5.0)
    motion = run(model, force, [], [0.0, 0.0], hold="held")
    assert abs(motion.states[500, 1]) < 4 * v_eps + 1e-12
    assert motion.states[-1, 1] == pytest.approx(0.5 * 0.5, rel=5e-3)


def test_slopes_are_those_of_finite_differences_through_stick() -> None:
    model, p = stick_slip()
    at = np.array([*p, 0.01, 0.2])

    def moved(at: np.ndarray) -> SteppedMotion:
        return run(model, FORCE, at[:-2].tolist(), at[-2:].tolist())

    base = moved(at)
    still = np.abs(base.states[:, 1]) < 1e-4
    assert still.sum() > 100 and np.abs(np.diff(np.sign(base.states[~still, 1]))).sum() >= 4
    for i, value in enumerate(at):
        d = 1e-7 * max(1.0, abs(value)) * np.eye(at.size)[i]
        slope = (moved(at + d).states - moved(at - d).states) / (2 * d[i])
        error = np.abs(slope - base.slopes[:, :, i]).max(axis=0)
        assert (error <= 1e-5 * np.abs(base.slopes[:, :, i]).max(axis=0) + 1e-8).all()


def test_agrees_with_the_adaptive_simulation() -> None:
    model = sf.drive(LAW, m=1.5, N=1.0, offset=-0.4)
    t = np.arange(FORCE.size) * STEP
    exact = sf.simulate(model, 2.0, u={"force": sf.Linear(t, FORCE)}, rtol=1e-9, t_eval=t)
    motion = run(model, FORCE, [], [0.0, 0.0])
    assert np.abs(motion.states[:, 0] - exact["x"]).max() < 5e-4 * np.ptp(exact["x"])


def test_the_step_is_of_second_order_where_the_mass_slides() -> None:
    model = sf.drive(
        sf.Stribeck(mu_s=3.0, mu_d=1.0, v_s=0.5, v_eps=1e-6, sigma_2=4.0), m=1.0, N=1.0
    )

    def end(n: int) -> np.ndarray:
        return run(model, np.full(n + 1, 6.0), [], [0.0, 0.4], step=0.4 / n, substeps=1).states[-1]

    fine = end(4096)
    errors = np.array([np.abs(end(n) - fine) for n in (32, 64, 128)])
    np.testing.assert_allclose(errors[:-1] / errors[1:], 4.0, rtol=0.15)


def test_virtual_machine_and_compiler_give_the_same_bits(monkeypatch: pytest.MonkeyPatch) -> None:
    model, p = stick_slip()
    again = run(model, FORCE[:300], p, [0.0, 0.0])
    monkeypatch.setattr(stepper, "find_compiler", find_compiler)
    compiled = run(model, FORCE[:300], p, [0.0, 0.0])
    np.testing.assert_array_equal(compiled.states, again.states)
    np.testing.assert_array_equal(compiled.slopes, again.slopes)


def test_a_pendulum_is_one_mass_too() -> None:
    x, v = Variable("phi", "rad"), Variable("omega", "rad/s")
    wave = Variable("w", "1/s^2")
    ode = ca.vertcat(v.symbol, -wave.symbol * ca.sin(x.symbol))
    model = Model("pendulum", x=(x, v), p=(wave,), ode=ode)
    t = np.linspace(0.0, 3.0, 3001)
    motion = sampled_motion(model, t, np.zeros((t.size, 0)), np.array([9.0]), np.array([1.0, 0.0]))
    exact = sf.simulate(model, 3.0, x0={"phi": 1.0}, p={"w": 9.0}, t_eval=t, rtol=1e-10)
    assert np.abs(motion.states[:, 0] - exact["phi"]).max() < 1e-5


@pytest.mark.parametrize("text", ["stribeck", "specker", "asymmetric(coulomb+viscous)"])
def test_static_laws_are_solved_in_the_given_number_of_evaluations(text: str) -> None:
    law = sf.law_from_text(text)
    widths = {
        n: 1e-6 for n, p in sf.parameters(law).items() if p.role == "width" and p.unit == "m/s"
    }
    model = sf.drive(sf.with_values(law, widths), m=1.0, N=1.0)
    t = np.arange(2001) * STEP
    motion = run(model, 0.6 * np.sin(6 * t) * t, [], [0.0, 0.0])
    assert motion.gap < 1e-6


def test_motions_that_cannot_be_stepped_are_reported() -> None:
    """Friction that supplies power, and friction that jumps down with speed."""
    model = sf.drive(sf.Viscous(1.0), m=1.0, free=["sigma_2"])
    away = sampled_motion(model, np.arange(400.0), np.ones(400), [-50.0], [0.0, 1.0])
    assert isinstance(away, str)
    t = np.arange(2001) * STEP
    model = sf.drive(sf.law_from_text("karnopp"), m=1.0, N=1.0)
    jumps = sampled_motion(model, t, 0.6 * np.sin(6 * t) * t, np.zeros(0), np.zeros(2))
    assert "steps did not converge" in jumps


NOISE = 1e-3 * np.random.default_rng(2).standard_normal(801)


@pytest.fixture(scope="module")
def machine() -> Subject:
    law = sf.Stribeck(mu_s=3.0, mu_d=2.0, v_s=0.1, v_eps=1e-2, sigma_2=1.0)
    return subject(Drive(law, m=1.5, N=1.0), free=["m", "mu_s", "mu_d", "sigma_2"], fixed="others")


@pytest.fixture(scope="module")
def data(machine: Subject) -> Dataset:
    t = np.arange(801) * 2e-3
    force = 5 * np.sin(2 * np.pi * t) + 2 * np.sin(2 * np.pi * 2.3 * t)
    x = sf.simulate(machine.model, 1.6, u={"force": sf.Linear(t, force)}, rtol=1e-9, t_eval=t)["x"]
    x = x + 1e-5 * np.random.default_rng(1).standard_normal(t.size)
    return Dataset.of(t=t, x=x, force=force, units={"x": "m", "force": "N"}, name="made")


@pytest.mark.parametrize(
    "how",
    sampled(
        [{"windows": 0.4, "every": 3}, {}, {"dead_time": (0.0, 0.01)}, {"interpolation": "hold"}],
        of=2,
    ),
)
def test_the_sampled_engine_agrees_with_simulate(
    machine: Subject, data: Dataset, how: dict[str, object]
) -> None:
    kind = Shooting(rtol=1e-9, engine="simulate", **how)  # type: ignore[arg-type]
    exact = kind.prepare(machine, data, {})
    fast = replace(kind, engine="sampled", rtol=None).prepare(machine, data, {})
    assert fast.substeps > 0 and exact.substeps == 0
    assert fast.names == exact.names
    values = np.array([v.start for v in machine.model.p] + [u.start for u in exact.own])
    one, two = evaluated(exact, values), evaluated(fast, values)
    assert np.abs(one.r - two.r).max() < 2e-5
    for i in range(values.size):
        size = np.abs(one.J[:, i]).max()
        assert np.abs(one.J - two.J)[:, i].max() < 5e-2 * size, exact.names[i]


def test_auto_takes_it_for_static_laws_alone(machine: Subject, data: Dataset) -> None:
    noisy = data.each(lambda r: replace(r, signals={**r.signals, "x": r["x"] + NOISE}))
    assert Shooting().prepare(machine, noisy, {}).substeps > 1
    assert Shooting(engine="simulate").prepare(machine, data, {}).substeps == 0


def test_coarse_samples_are_left_to_simulate(data: Dataset) -> None:
    """A mass that comes to rest within a sample: friction over it is not resolved."""
    quick = subject(Drive(sf.Coulomb(2.0), m=1.5, N=1.0))
    noiseless = Dataset.of(
        t=np.arange(40) * 0.05, x=np.zeros(40), force=3 * (-1.0) ** np.arange(40),
        units={"x": "m", "force": "N"}, name="coarse",
    )  # fmt: skip
    assert Shooting().prepare(quick, noiseless, {}).substeps == 0


def test_means_of_inputs_are_exact() -> None:
    t, u = np.array([0.0, 1.0, 3.0]), np.array([1.0, 3.0, -1.0])
    at = np.array([-1.0, 0.0, 0.5, 2.0, 3.0, 4.0])
    # linear: 1 | 1.5 | (2.5 * .5 + 2 * 1) / 1.5 | 0 | -1
    np.testing.assert_allclose(means(t, u, at, False), [1.0, 1.5, 3.25 / 1.5, 0.0, -1.0])
    # held: 1 | 1 | (1 * .5 + 3 * 1) / 1.5 | 3 | -1
    np.testing.assert_allclose(means(t, u, at, True), [1.0, 1.0, 3.5 / 1.5, 3.0, -1.0])
