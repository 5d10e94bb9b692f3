"""Inverse dynamics, with forward dynamics as the oracle of the balance."""

import pickle
from typing import Any

import numpy as np
import pytest
from fits import check_slopes, evaluated
from numpy.typing import NDArray

from identification.data.dataset import Dataset
from identification.data.filters import Filter
from identification.fit import Fit
from identification.residuals.balance import balance, coordinates
from identification.residuals.inverse import ENOUGH, InverseDynamics, InverseRows
from identification.solving.task import Point
from identification.unknowns.subject import Subject, subject
from symfric import LuGre, Stribeck, rabinowicz, simulate
from symfric.foundation.parameters import with_values
from symfric.integrator import Linear
from symfric.model import Model
from symfric.scenes import Arm
from symfric.scenes.blocks import Drive
from symfric.scenes.linkages import FourBar

Array = NDArray[np.float64]

LAW = Stribeck(mu_s=0.15, mu_d=0.1, v_s=0.05, sigma_2=2.0)
COUNT = 8


def forward(model: Model, x: Array, u: Array, p: Array) -> Array:
    """Rates of the states at one point, algebraic unknowns found by Newton's method."""
    alg, ode = model.function("alg"), model.function("ode")
    slope = alg.jacobian()
    z = np.array([float(v.start) if isinstance(v.start, float) else 10.0 for v in model.z])
    for _ in range(50):
        if not z.size:
            break
        g = alg(0, x, z, u, p).full().ravel()
        J = slope(0, x, z, u, p, g)[2].full()
        z = z - np.linalg.solve(J, g)
    return ode(0, x, z, u, p).full().ravel()


def points(model: Model) -> tuple[Array, Array, list[Array], Array]:
    """States, inputs and rates at random points, and the parameters."""
    rng = np.random.default_rng(0)
    x = rng.uniform(-1, 1, (COUNT, len(model.x)))
    u = rng.uniform(-10, 10, (COUNT, len(model.u)))
    p = model.values("p")
    return x, u, [forward(model, a, b, p) for a, b in zip(x, u, strict=True)], p


@pytest.mark.parametrize(
    ("model", "signals"),
    [
        (Drive(LAW).model(["m", "mu_d", "sigma_2"]), ["force"]),
        (Arm(LAW).model(["load", "mu_d", "sigma_2"]), [f"tau{i}" for i in range(1, 7)]),
        (rabinowicz(LAW, free=["m", "mu_d"]), ["balance of v"]),
    ],
    ids=["drive", "arm", "block"],
)
def test_forward_dynamics_leaves_nothing(model: Model, signals: list[str]) -> None:
    found = coordinates(model, "test")
    names = [v.name for v in model.p]
    x, u, rates, p = points(model)
    places = {v.name: k for k, v in enumerate(model.x)}
    columns: list[Array] = []
    for state, force, rate in zip(x, u, rates, strict=True):
        q = [0.0 if c.position is None else state[places[c.position.name]] for c in found]
        v = [state[places[c.rate.name]] for c in found]
        a = [rate[places[c.rate.name]] for c in found]
        columns.append(np.array([*q, *v, *a, *force, 0.0]))
    w = np.column_stack(columns)
    made = balance(model, names, found, w, "test")
    assert [row.signal for row in made.rows] == signals
    path = made.equations.along(w, 1.0, p)
    np.testing.assert_allclose(path.rows, 0.0, atol=1e-8)
    other = made.equations.along(w, 1.0, 1.2 * p)
    assert (np.abs(other.rows) > 1e-3).any()


def test_only_friction_of_a_row_switches_it_off() -> None:
    model = Arm(LAW).model(["mu_d"])
    made = balance(model, ["mu_d"], coordinates(model, "test"), np.ones((3 * 6 + 6 + 1, 1)), "test")
    assert [row.slips for row in made.rows] == [(i,) for i in range(6)]


def test_states_of_laws_are_no_coordinates() -> None:
    (one,) = coordinates(Drive(LuGre()).model(), "test")
    assert (one.position.name, one.rate.name) == ("x", "v")


PLAIN = Filter(60.0, 4)
T = np.linspace(0.0, 3.0, 3001)


def starts(one: Subject) -> Array:
    known = {v.name: float(v.start) for v in one.model.p}
    return np.array([known[n] for n in one.names])


def moved(drive: Drive, t: Array = T, turning: bool = False) -> Dataset:
    """A drive that follows two sines exactly: the force is what its balance needs."""
    w1, w2 = 2 * np.pi * 0.9, 2 * np.pi * 0.37
    x = 0.05 * np.sin(w1 * t) + 0.1 * np.cos(w2 * t)
    v = 0.05 * w1 * np.cos(w1 * t) - 0.1 * w2 * np.sin(w2 * t)
    a = -0.05 * w1**2 * np.sin(w1 * t) - 0.1 * w2**2 * np.cos(w2 * t)
    force = drive.m * a + drive.law.force(v, drive.N) + drive.offset
    units = {"x": "rad", "force": "N m"} if turning else {"x": "m", "force": "N"}
    return Dataset.of(t=t, x=x, force=force, units=units)


DRIVE = Drive(Stribeck(mu_s=3.0, mu_d=2.0, v_s=0.02, sigma_2=5.0), m=4.0, N=1.0, offset=-0.5)
FREE = ["m", "offset", "mu_s", "mu_d", "v_s", "sigma_2"]


ONE = subject(DRIVE, free=FREE)
TRUE = starts(ONE)


def plain(data: Dataset, one: Subject = ONE, **how: Any) -> InverseRows:
    return InverseDynamics(**{"filter": PLAIN, **how}).prepare(one, data)


def test_a_drive_leaves_nothing_at_the_true_values() -> None:
    rows, values = plain(moved(DRIVE)), TRUE
    found = evaluated(rows, values)
    (channel,) = rows.channels
    assert (channel.signal, channel.unit) == ("force", "N")
    assert np.abs(found.r).max() < 2e-3 * np.abs(channel.measured).max()
    check_slopes(rows, values * 1.1)


def test_records_stand_below_each_other_with_their_own_filters() -> None:
    long, short = moved(DRIVE), moved(DRIVE, np.linspace(0.0, 2.0, 1001))
    rows, values = plain(long + short, filter=None), TRUE * 1.2
    alone = [evaluated(plain(d, filter=None), values).r for d in (long, short)]
    both = evaluated(rows, values).r
    np.testing.assert_array_equal(both, np.concatenate(alone))
    assert [c.record for c in rows.channels] == [0, 1]
    assert rows.channels[1].rows == slice(alone[0].size, both.size)


def test_equations_at_reversals_are_left_out_of_static_laws_only() -> None:
    static = plain(data := moved(DRIVE))
    whole = plain(data, filter=Filter(60.0, 4, v_min=0.0))
    law = LuGre(mu_s=3.0, mu_d=2.0, v_s=0.02, sigma_0=1e4, sigma_1=10.0)
    dynamic = plain(data, subject(Drive(law, N=1.0)))
    sizes = [r.channels[0].t.size for r in (static, whole, dynamic)]
    assert sizes[0] < sizes[1] == sizes[2]
    assert len(static.channels[0].breaks) >= 3
    assert whole.channels[0].breaks == ()


def test_a_noisy_velocity_beside_the_position_spoils_nothing() -> None:
    data = moved(DRIVE)
    noise = np.random.default_rng(0).standard_normal((2, T.size))
    x = data[0]["x"] + 1e-6 * noise[0]
    signals = {"t": T, "x": x, "force": data[0]["force"]}
    units = {"x": "m", "force": "N"}
    alone = Dataset.of(signals, units=units)
    signals["v"] = np.gradient(data[0]["x"], T) + 0.1 * noise[1]
    both = Dataset.of(signals, units={**units, "v": "m/s"})
    sizes = [np.std(evaluated(plain(d), TRUE).r) for d in (alone, both)]
    assert sizes[1] < 1.1 * sizes[0]


def test_a_drive_that_turns_has_its_units() -> None:
    drive = with_values(DRIVE, {"m": 0.3})
    rows = plain(moved(drive, turning=True), subject(drive.law, turning=True))
    assert rows.channels[0].unit == "N m"


def test_states_of_a_law_follow_the_measured_velocity() -> None:
    law = LuGre(mu_s=3.0, mu_d=2.0, v_s=0.02, sigma_0=2e3, sigma_1=10.0, sigma_2=5.0)
    drive = Drive(law, m=4.0, N=1.0)
    force = 8 * np.sin(2 * np.pi * 1.1 * T) + 6 * np.sin(2 * np.pi * 0.4 * T)
    run = simulate(drive.model(), T[-1], u={"force": Linear(T, force)}, t_eval=T, rtol=1e-9)
    data = Dataset.of(t=T, x=run["x"], force=force, units={"x": "m", "force": "N"})
    one = subject(drive, free=["m", "mu_s", "mu_d", "v_s", "sigma_0", "sigma_1", "sigma_2"])
    rows = plain(data, one, filter=Filter(100.0, 4))
    assert rows.names == (*one.names, "preload[0]")
    values = np.append(starts(one), [u.start for u in rows.own])
    r = evaluated(rows, values).r
    assert np.sqrt(np.mean(r**2)) < 5e-3 * np.sqrt(np.mean(force**2))
    check_slopes(rows, values * 1.05)


def test_the_dead_time_of_the_force_is_an_own_unknown() -> None:
    late = moved(DRIVE, T + 4e-3)[0]["force"]
    data = Dataset.of(t=T, x=moved(DRIVE)[0]["x"], force=late, units={"x": "m", "force": "N"})
    rows = plain(data, dead_time=(0.0, 0.02))
    assert rows.names == (*ONE.names, "dead_time[0]")
    right, wrong = (np.append(TRUE, d) for d in (4e-3, 0.0))
    sizes = [np.median(np.abs(evaluated(rows, values).r)) for values in (right, wrong)]
    assert sizes[0] < 0.02 * sizes[1]
    check_slopes(rows, np.append(TRUE, 2.3e-3))


def test_motion_without_force_is_balanced_by_itself() -> None:
    law = Stribeck(mu_s=0.15, mu_d=0.1, v_s=0.05)
    model, other = (rabinowicz(law, free=p, v_belt=0.3) for p in (["mu_d"], ["mu_d", "v_belt"]))
    run = simulate(model, 3.0, t_eval=T, rtol=1e-9, x0={"x": 0.4})
    data = Dataset.of(t=T, x=run["x"], units={"x": "m"})
    rows = InverseDynamics(filter=Filter(60.0, 4)).prepare(subject(model), data)
    (channel,) = rows.channels
    assert (channel.signal, channel.unit) == ("balance of v", "m/s^2")
    free_belt = InverseDynamics(filter=Filter(60.0, 4)).prepare(subject(other), data)
    assert free_belt.channels[0].t.size == channel.t.size  # reversals are those of the start value
    values = starts(subject(model))
    a = channel.regressors["a"]
    assert np.abs(evaluated(rows, values).r).max() < 5e-3 * np.abs(a).max()
    check_slopes(rows, values)


@pytest.mark.slow
def test_friction_of_a_loop_is_balanced_at_its_input() -> None:
    """A four-bar has one input and constraints: reactions are solved for at every sample."""
    model = FourBar(Stribeck(mu_s=0.15, mu_d=0.1, v_s=0.2)).model(["mu_d"])
    run = simulate(model, 1.0, t_eval=np.linspace(0, 1, 1001), rtol=1e-9)
    signals = {v.name: run[v.name] for v in model.x[: model.holonomic.n]}  # type: ignore[union-attr]
    units = {v.name: v.unit for v in model.x}
    data = Dataset.of({"t": run.t, **signals}, units={n: units[n] for n in signals})
    one = subject(model)
    rows = InverseDynamics(filter=Filter(80.0, 4)).prepare(one, data)
    values = starts(one)
    sizes = [np.sqrt(np.mean(evaluated(rows, values * s).r ** 2)) for s in (1.0, 1.5)]
    assert sizes[0] < 0.05 * sizes[1]
    check_slopes(rows, values)


def test_residuals_pickle() -> None:
    rows, values = plain(moved(DRIVE)), TRUE * 1.1
    again = pickle.loads(pickle.dumps(rows))
    np.testing.assert_array_equal(evaluated(again, values).r, evaluated(rows, values).r)


def test_a_motion_that_often_turns_round_is_thinned_less() -> None:
    t = np.linspace(0.0, 20.0, 20_001)
    data = moved(DRIVE, t)
    noise = np.random.default_rng(0).standard_normal((2, t.size))
    signals = {"x": data[0]["x"] + 1e-6 * noise[0], "force": data[0]["force"] + 0.05 * noise[1]}
    rows = InverseDynamics().prepare(subject(DRIVE), Dataset.of(t=t, **signals))
    assert rows.channels[0].t.size >= ENOUGH


def test_every_record_has_its_dead_time() -> None:
    one = subject(DRIVE, free=["m"], fixed="others")
    rows = plain(moved(DRIVE) + moved(DRIVE), one, dead_time=(0.0, 0.02))
    assert rows.names == ("m", "dead_time[0]", "dead_time[1]")
    check_slopes(rows, np.array([4.0, 1e-3, 2.3e-3]))


def test_the_noise_of_the_motion_has_its_size_in_the_residuals() -> None:
    """Of the true values only the noise of the position is left, white or of rounding."""
    clean, random = moved(DRIVE)[0], np.random.default_rng(3)
    steps = 2e-5 * random.standard_normal(clean.size)
    for x in (clean["x"] + steps, 5e-5 * np.rint((clean["x"] + steps) / 5e-5)):
        data = Dataset.of(t=clean.time, x=x, force=clean["force"])
        rows = plain(data)
        left = float(np.sqrt(np.mean(evaluated(rows, TRUE).r ** 2)))
        assert np.sqrt(rows.bias(TRUE).squares[0] / rows.channels[0].t.size) == pytest.approx(
            left, rel=0.15
        )


@pytest.mark.parametrize("law", ["coulomb+viscous", "stribeck"])
def test_the_cost_without_the_noise_of_the_motion_has_the_gradient_of_its_residuals(
    law: str,
) -> None:
    noise = 3e-5 * np.random.default_rng(0).standard_normal(moved(DRIVE)[0].size)
    record = moved(DRIVE)[0]
    data = Dataset.of(t=record.time, x=record["x"] + noise, force=record["force"])
    asked = Fit(InverseDynamics(), law, data).prepared()
    task = asked.task.with_noise({"force": 0.5})
    points = [task, task.reduced(asked.centre)]
    for one in points:
        here = one.at(asked.centre)
        assert isinstance(here, Point) and here.excess != 0.0
        f, J = here.reduced
        assert f @ f == pytest.approx(here.cost, rel=1e-9)
        for k, step in enumerate(1e-5 * np.eye(here.w.size)):
            low, high = (one.at(here.w + side * step) for side in (-1, 1))
            assert isinstance(low, Point) and isinstance(high, Point)
            slope = (high.cost - low.cost) / 2e-5
            assert 2 * here.J[:, k] @ here.r == pytest.approx(slope, rel=1e-5, abs=1e-6 * here.cost)
            assert 2 * J[:, k] @ f == pytest.approx(slope, rel=1e-5, abs=1e-6 * here.cost)
