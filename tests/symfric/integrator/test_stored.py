"""Runs in files and pickles: all results are equal to the bit."""

import pickle
from io import BytesIO
from pathlib import Path

import casadi as ca
import numpy as np
import pytest

from symfric.foundation import packed
from symfric.foundation.parameters import Variable
from symfric.integrator import Hold, load_run, simulate, simulate_by_peer
from symfric.integrator.running import run as running
from symfric.integrator.stored import RUN
from symfric.laws import BrownMcPhee, ExactCoulomb, LuGre
from symfric.model import Event, Model, Output
from symfric.results.trajectory import Trajectory
from symfric.scenes import Pendulum, drive, rabinowicz


def through_file(run: Trajectory, folder: Path) -> Trajectory:
    run.save(folder / "run.npz")
    return load_run(folder / "run.npz")


def assert_same(one: Trajectory, other: Trajectory) -> None:
    """Signals, details, steps and statistics are equal to the bit."""
    times = np.linspace(*one.span, 137)
    for a, b in ((one.at(times), other.at(times)), (one.signals, other.signals)):
        assert list(a) == list(b)
        for name in a:
            np.testing.assert_array_equal(a[name], b[name])
    for name in one.details:
        np.testing.assert_array_equal(one[name], other[name])
    np.testing.assert_array_equal(one.step_times, other.step_times)
    assert one.extremes == other.extremes
    assert one.final == other.final
    assert one.happened == other.happened
    assert one.statistics.steps == other.statistics.steps
    assert repr(one) == repr(other)
    assert one.to_dict()["signals"] == other.to_dict()["signals"]


def own_model() -> Model:
    """A model with a nested function, which pickle rejects."""
    x = Variable("x", "V", start=1.0)
    return Model(
        "own",
        x=(x,),
        ode=-x.symbol,
        events=(Event("half", x.symbol - 0.5, terminal=True),),
        details=lambda: {"twice": Output(2 * x.symbol, "V")},
    )


def implicit() -> Model:
    x, rate = Variable("x", "V", start=1.0), ca.SX.sym("rate")
    return Model("rc", x=(x,), xdot=rate, residual=rate + x.symbol)


def runs() -> dict[str, Trajectory]:
    push = {"force": Hold([0.0, 0.5], [1.0, 3.0])}
    pull = {"force": lambda t: 5 * ca.sin(3 * t)}  # pyright: ignore
    return {
        "events": simulate(rabinowicz(ExactCoulomb()), 6.0, samples=101, backend="vm"),
        "peer": simulate_by_peer(Pendulum(BrownMcPhee()).model(), 0.05, samples=51),
        "samples": simulate(drive(BrownMcPhee()), 1.0, u=push, samples=51, backend="vm"),
        "function": simulate(drive(BrownMcPhee()), 1.0, u=pull, samples=51, backend="vm"),
        "own": simulate(own_model(), 5.0, samples=51, backend="vm"),
        "implicit": simulate(implicit(), 1.0, samples=51, backend="vm"),
        "free": simulate(
            rabinowicz(LuGre(), free=["mu_s"]), 1.0, p={"mu_s": 0.2}, samples=51, backend="vm"
        ),
        "failed": simulate(rabinowicz(LuGre()), 6.0, max_steps=20, throw=False),
    }


def test_runs_come_back_to_the_bit_from_files_and_pickles(tmp_path: Path) -> None:
    for name, run in runs().items():
        try:
            loaded = through_file(run, tmp_path)
            assert_same(run, loaded)
            assert run.statistics.to_dict() == loaded.statistics.to_dict()
            if name == "events":
                assert_same(loaded, through_file(loaded, tmp_path))
            assert_same(run, pickle.loads(pickle.dumps(run)))
        except AssertionError as error:
            error.add_note(name)
            raise


def test_the_model_of_a_loaded_run_simulates_to_the_bit(tmp_path: Path) -> None:
    run = simulate(Pendulum(ExactCoulomb()).model(), 0.3, samples=51, backend="vm")
    loaded = through_file(run, tmp_path)
    assert_same(run, simulate(loaded.model, 0.3, samples=51, backend="vm"))
    balance = loaded.energy_balance()
    assert balance.to_dict() == run.energy_balance().to_dict()


def test_a_run_of_many_steps_is_stored_whole(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    model = rabinowicz(LuGre())
    whole = simulate(model, 6.0, samples=11, backend="vm")
    monkeypatch.setattr(running, "MOST_BYTES", 10_000)
    cut = simulate(model, 6.0, samples=11, backend="vm")
    loaded = through_file(cut, tmp_path)
    monkeypatch.undo()
    assert loaded.step_times.size == whole.step_times.size == whole.statistics.steps + 1
    times = np.linspace(0.0, 6.0, 500)
    np.testing.assert_array_equal(loaded.at(times)["v"], whole.at(times)["v"])


def test_derivatives_at_the_times_of_the_result_are_stored(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Neither they nor the signals are computed again."""
    model, weights = rabinowicz(LuGre(), free=["mu_s"]), {"x": 1.0, "v": np.linspace(0.0, 1.0, 21)}
    run = simulate(model, 1.0, sensitivities=["mu_s", "x0.v"], samples=21)
    loaded, gradient = through_file(run, tmp_path), run.gradient(weights)
    monkeypatch.setattr("symfric.integrator.stored.built", None)
    np.testing.assert_array_equal(loaded["friction"], run["friction"])
    for name, slopes in run.sensitivities.items():
        assert {*loaded.sensitivities[name]} == {*run.signals}
        for signal, values in slopes.items():
            np.testing.assert_array_equal(loaded.sensitivities[name][signal], values)
        assert loaded.event_sensitivities[name].size == 0
    assert loaded.gradient(weights) == pytest.approx(gradient, rel=1e-9)


def test_derivatives_between_the_times_of_the_result_are_found_again(tmp_path: Path) -> None:
    between = np.linspace(0.0, 2.0, 97)
    models = {
        "events": (rabinowicz(ExactCoulomb(), free=["mu_s"]), ["mu_s", "x0.v"]),
        "mechanism": (Pendulum(BrownMcPhee()).model(free=["mu_d"]), ["mu_d"]),
    }
    for name, (model, wanted) in models.items():
        run = simulate(model, 2.0, sensitivities=wanted, samples=7, backend="vm")
        pickled = name == "events"
        loaded = pickle.loads(pickle.dumps(run)) if pickled else through_file(run, tmp_path)
        assert run.differentiate is not None
        one, other = (r.differentiate(between) for r in (run, loaded))
        for seed, slopes in one.items():
            for signal, values in slopes.items():
                np.testing.assert_array_equal(other[seed][signal], values, f"{name} {signal}")
        assert through_file(loaded, tmp_path).differentiate is not None


def test_a_stored_run_without_derivatives_reports_the_reason(tmp_path: Path) -> None:
    """An event at a jump of an input: the motion after it depends on their order."""
    x, u = Variable("x", "m"), Variable("u", "m/s")
    done = Event("done", x.symbol - 1.0, terminal=True)
    model = Model("filled", x=(x,), u=(u,), ode=u.symbol, events=(done,))
    push = {"u": Hold([0.0, 1.0], [1.0, 2.0])}
    run = simulate(model, 2.0, u=push, samples=3, sensitivities=["x0.x"])
    loaded = through_file(run, tmp_path)
    for requested in ("sensitivities", "event_sensitivities"):
        reported = list[str]()
        for one in (run, loaded):
            with pytest.raises(ValueError, match="apart from the jumps of the inputs") as error:
                getattr(one, requested)
            reported.append(str(error.value))
        assert reported[0] == reported[1]


def test_foreign_and_damaged_files_are_refused(tmp_path: Path) -> None:
    path, folder = tmp_path / "bad.npz", tmp_path / "folder"
    folder.mkdir()
    simulate(rabinowicz(BrownMcPhee()), 1.0, samples=11).save(path)
    good, arrays = path.read_bytes(), BytesIO()
    np.savez(arrays, a=np.zeros(3))
    for bad in (b"", b"text", good[: len(good) // 2], arrays.getvalue()):
        path.write_bytes(bad)
        with pytest.raises(ValueError, match=r"load_run '.*bad.npz': expected a file that symf"):
            load_run(path)
    with path.open("wb") as file:
        packed.dump(file, LuGre(), RUN.kind, RUN.number)
    for place, got in ((tmp_path / "none", "no such file"), (folder, "a folder"), (path, "LuGre")):
        with pytest.raises(ValueError, match=f"expected a saved run, got {got}"):
            load_run(place)
