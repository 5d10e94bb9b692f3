"""Simulated motions against measured ones: rows, names, exact derivatives, start values."""

import pickle
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from casadi import SX
from fits import check_slopes, evaluated

from identification.data.dataset import Dataset
from identification.residuals.shooting import Shooting
from identification.residuals.shots import Shots
from identification.unknowns.subject import subject
from symfric import BrownMcPhee, LuGre, Model, simulate
from symfric.foundation.parameters import Variable
from symfric.integrator import Hold, Linear
from symfric.scenes import Drive, Pendulum

SLIDE = Drive(BrownMcPhee(mu_s=1.2, mu_d=1.0, v_t=0.05), m=2.0, N=1.0)
FREE = ["m", "mu_d"]
T = np.linspace(0.0, 1.0, 201)
FORCE = 3 * np.sin(2 * np.pi * 1.3 * T) + 0.5


def slide(seed: int = 0, noise: float = 1e-5, tau: float = 0.0, **x0: float) -> Any:
    """A record of the sliding mass; its force acts `tau` late."""
    run = simulate(
        SLIDE.model(free=FREE), 1.0, t_eval=T, rtol=1e-10, x0={"x": 0.0, "v": 0.0, **x0},
        u={"force": Linear(T + tau, FORCE)},
    )  # fmt: skip
    x = run["x"] + noise * np.random.default_rng(seed).standard_normal(T.size)
    return Dataset.of(t=T, x=x, force=FORCE, units={"x": "m", "force": "N"}, name=f"r{seed}")


def shots(kind: Shooting, data: Dataset, what: object = SLIDE) -> Shots:
    made = subject(what, free=FREE, fixed="others")
    return kind.prepare(made, data, {u.name: u.start for u in made.unknowns})


def start(found: Shots, **parameters: float) -> Any:
    given = {"m": 2.0, "mu_d": 1.0} | parameters
    return np.array([*(given[n] for n in found.parameters), *(u.start for u in found.own)])


def test_at_the_truth_only_the_noise_is_left() -> None:
    found = shots(Shooting(x0="given"), slide() + slide(1))
    r = evaluated(found, start(found)).r
    assert found.names == ("m", "mu_d")
    assert [c.record for c in found.channels] == [0, 1]
    assert np.std(r) == pytest.approx(1e-5, rel=0.1)


def test_a_clock_that_began_long_ago_changes_nothing() -> None:
    since = 1e9
    late = slide().each(lambda r: replace(r, t=since + r.time))
    found, usual = shots(Shooting(), late), shots(Shooting(), slide())
    r, expected = evaluated(found, start(found)).r, evaluated(usual, start(usual)).r
    assert r == pytest.approx(expected, abs=1e-6)  # such a time is right to 1.2e-7 s
    assert found.channels[0].t[0] == since


def test_a_model_that_depends_on_time_sees_that_of_the_record() -> None:
    x, a, t = Variable("x", "m"), Variable("a", "m/s", start=1.0), SX.sym("t")
    ramp = Model(name="ramp", x=(x,), p=(a,), ode=a.symbol * t, t=t)
    data = Dataset.of(t=T + 2, x=((T + 2) ** 2 - 4) / 2, units={"x": "m"})
    made = subject(ramp)
    found = Shooting(x0="given").prepare(made, data, {"a": 1.0})
    assert np.abs(evaluated(found, np.array([1.0])).r).max() < 1e-6


def test_derivatives_by_parameters_starts_and_dead_time() -> None:
    kind = Shooting(windows=0.35, dead_time=(0.0, 0.02), rtol=1e-9)
    found = shots(kind, slide(v=0.1))
    assert found.names[2:] == ("dead_time", *(f"x0.{s}[0,{w}]" for w in range(3) for s in "xv"))
    values = start(found, mu_d=1.1)
    values[2] = 0.0033
    check_slopes(found, values, least=1e-2)


@pytest.mark.parametrize(("noise", "rtol"), [(0.0, 1e-7), (1e-8, 1e-7), (1e-5, 1e-6)])
def test_the_tolerance_follows_the_noise_of_the_data(noise: float, rtol: float) -> None:
    """Data without noise count as accurate to a share of their size."""
    assert shots(Shooting(x0="given", engine="simulate"), slide(noise=noise)).rtol == rtol


def test_dead_time_is_that_of_the_input() -> None:
    data = slide(tau=0.012, noise=0.0)
    late, early = (shots(Shooting(x0="given", dead_time=tau), data) for tau in (0.012, 0.0))
    assert np.abs(evaluated(late, start(late)).r).max() < 1e-8
    assert np.abs(evaluated(early, start(early)).r).max() > 1e-4


def test_start_values_come_from_the_data_within_a_few_times_their_noise() -> None:
    x0, v0 = (u.start for u in shots(Shooting(), slide(v=0.2)).own)
    assert abs(x0) < 4e-5
    assert v0 == pytest.approx(0.2, abs=6e-3)


def test_windows_cover_every_sample_once() -> None:
    found = shots(Shooting(windows=0.2), slide())
    (channel,) = found.channels
    assert np.array_equal(channel.t, T)
    assert (len(channel.breaks), len(found.own)) == (4, 2 * 5)
    assert np.abs(evaluated(found, start(found)).r).max() < 1e-3
    later = shots(Shooting(windows=0.5, x0="given"), slide())  # the first starts as the model says
    assert later.names[2:] == ("x0.x[0,1]", "x0.v[0,1]")


def test_thinned_outputs_are_rows_of_the_full_ones() -> None:
    data = slide()
    full, thin = (shots(Shooting(x0="given", every=k, rtol=1e-8), data) for k in (1, 5))
    assert np.array_equal(evaluated(full, start(full)).r[::5], evaluated(thin, start(thin)).r)


def test_held_inputs_stay_until_the_next_sample() -> None:
    u = {"force": Hold(T, FORCE)}
    x = simulate(SLIDE.model(), 1.0, t_eval=T, u=u, rtol=1e-10)["x"]
    data = Dataset.of(t=T, x=x, force=FORCE, units={"x": "m", "force": "N"})
    found = shots(Shooting(x0="given", interpolation="hold"), data)
    assert np.abs(evaluated(found, start(found)).r).max() < 1e-8


def test_a_copy_in_another_process_gives_the_same_bits() -> None:
    found = shots(Shooting(dead_time=(0.0, 0.01)), slide())
    one, other = (evaluated(x, start(found)) for x in (found, pickle.loads(pickle.dumps(found))))
    assert np.array_equal(one.r, other.r) and np.array_equal(one.J, other.J)


def test_the_bristle_of_a_law_with_one_is_unknown() -> None:
    found = shots(Shooting(), slide(), Drive(LuGre(mu_s=1.2, mu_d=1.0), m=2.0, N=1.0))
    assert [u.name for u in found.own] == ["x0.x[0]", "x0.v[0]", "x0.z[0]"]
    assert found.own[2].start == 0.0


def test_records_may_lack_signals() -> None:
    one = slide()
    other = Dataset.of(t=T, v=0 * T, force=FORCE, units={"v": "m/s", "force": "N"})
    found = shots(Shooting(x0="given"), one + other)
    assert [(c.record, c.signal) for c in found.channels] == [(0, "x"), (1, "v")]


def test_a_motion_that_cannot_be_simulated_is_a_sentence() -> None:
    x, rate = Variable("x", "m", start=1.0), Variable("rate", "1/s", start=1.0)
    burst = Model("burst", x=(x,), p=(rate,), ode=rate.symbol * x.symbol**2)
    data = Dataset.of(t=T, x=1 / (1 - 0.5 * T), units={"x": "m"})
    found = Shooting(x0="given").prepare(subject(burst), data, {"rate": 0.5})
    assert np.abs(evaluated(found, np.array([0.5])).r).max() < 1e-6
    assert "rate = 1.5" in found.at(np.array([1.5]))


def test_coordinates_and_rates_of_a_mechanism() -> None:
    scene, t = Pendulum(BrownMcPhee(mu_s=0.3, mu_d=0.2, v_t=0.02)), np.linspace(0.0, 1.0, 101)
    run = simulate(scene.model(free=["mu_d"]), 1.0, t_eval=t, rtol=1e-9)
    data = Dataset.of(t=t, phi=run["phi"], units={"phi": "rad"})
    found = Shooting().prepare(subject(scene, free=["mu_d"], fixed="others"), data, {"mu_d": 0.2})
    assert [u.name for u in found.own] == ["x0.phi[0]", "x0.phi_rate[0]"]


def test_samples_of_an_input_cover_the_record() -> None:
    assert shots(Shooting(inputs={"force": Linear(T[::5], FORCE[::5])}), slide()).rows == T.size
