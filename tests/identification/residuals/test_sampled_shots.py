import pickle
from dataclasses import replace

import numpy as np
import pytest

from identification.data.dataset import Dataset
from identification.residuals import stepper
from identification.residuals.shooting import Shooting
from identification.residuals.shots import means
from identification.unknowns.subject import Subject, subject
from symfric import Coulomb, Dahl, Linear, Stribeck, simulate
from symfric.scenes import Drive

NOISE = 1e-3 * np.random.default_rng(2).standard_normal(801)


@pytest.fixture(autouse=True)
def _no_compiler(monkeypatch: pytest.MonkeyPatch) -> None:
    """Short runs are not worth a compiler, and have the same bits without it."""
    monkeypatch.setattr(stepper, "find_compiler", lambda: None)


@pytest.fixture(scope="module")
def machine() -> Subject:
    law = Stribeck(mu_s=3.0, mu_d=2.0, v_s=0.1, v_eps=1e-2, sigma_2=1.0)
    return subject(Drive(law, m=1.5, N=1.0), free=["m", "mu_s", "mu_d", "sigma_2"], fixed="others")


@pytest.fixture(scope="module")
def data(machine: Subject) -> Dataset:
    t = np.arange(801) * 2e-3
    force = 5 * np.sin(2 * np.pi * t) + 2 * np.sin(2 * np.pi * 2.3 * t)
    x = simulate(machine.model, 1.6, u={"force": Linear(t, force)}, rtol=1e-9, t_eval=t)["x"]
    x = x + 1e-5 * np.random.default_rng(1).standard_normal(t.size)
    return Dataset.of(t=t, x=x, force=force, units={"x": "m", "force": "N"}, name="made")


@pytest.mark.parametrize(
    "how",
    [{}, {"windows": 0.4, "every": 3}, {"interpolation": "hold"}, {"dead_time": (0.0, 0.01)}],
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
    one, two = exact.at(values), fast.at(values)
    assert not isinstance(one, str)
    assert not isinstance(two, str)
    assert np.abs(one.r - two.r).max() < 2e-5
    for i in range(values.size):
        size = np.abs(one.J[:, i]).max()
        assert np.abs(one.J - two.J)[:, i].max() < 5e-2 * size, exact.names[i]


def test_auto_takes_it_for_static_laws_alone(machine: Subject, data: Dataset) -> None:
    noisy = data.each(lambda r: replace(r, signals={**r.signals, "x": r["x"] + NOISE}))
    assert Shooting().prepare(machine, noisy, {}).substeps > 1
    assert Shooting(engine="simulate").prepare(machine, data, {}).substeps == 0
    bristle = subject(Drive(Dahl(sigma_0=1e4, mu_d=2.0), m=1.5, N=1.0))
    with pytest.raises(ValueError, match="a friction law without states"):
        Shooting(engine="sampled").prepare(bristle, data, {})


def test_coarse_samples_are_left_to_simulate(data: Dataset) -> None:
    """A mass that comes to rest within a sample: friction over it is not resolved."""
    quick = subject(Drive(Coulomb(2.0), m=1.5, N=1.0))
    noiseless = Dataset.of(
        t=np.arange(40) * 0.05, x=np.zeros(40), force=3 * (-1.0) ** np.arange(40),
        units={"x": "m", "force": "N"}, name="coarse",
    )  # fmt: skip
    assert Shooting().prepare(quick, noiseless, {}).substeps == 0


def test_residuals_go_to_other_processes(machine: Subject, data: Dataset) -> None:
    rows = Shooting(windows=0.4, engine="sampled").prepare(machine, data, {})
    values = np.array([v.start for v in machine.model.p] + [u.start for u in rows.own])
    one, two = (r.at(values) for r in (rows, pickle.loads(pickle.dumps(rows))))
    assert not isinstance(one, str)
    assert not isinstance(two, str)
    np.testing.assert_array_equal(one.r, two.r)
    np.testing.assert_array_equal(one.J, two.J)


def test_means_of_inputs_are_exact() -> None:
    t, u = np.array([0.0, 1.0, 3.0]), np.array([1.0, 3.0, -1.0])
    at = np.array([-1.0, 0.0, 0.5, 2.0, 3.0, 4.0])
    # linear: 1 | 1.5 | (2.5 * .5 + 2 * 1) / 1.5 | 0 | -1
    np.testing.assert_allclose(means(t, u, at, False), [1.0, 1.5, 3.25 / 1.5, 0.0, -1.0])
    # held: 1 | 1 | (1 * .5 + 3 * 1) / 1.5 | 3 | -1
    np.testing.assert_allclose(means(t, u, at, True), [1.0, 1.0, 3.5 / 1.5, 3.0, -1.0])
