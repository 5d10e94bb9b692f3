"""Results of an ensemble in memory or in a folder: resumed, distinguished, bounded in memory.

Tasks of an ensemble: plain data, written once, known by every digit, solved by any process.
"""

import gc
import signal
import weakref
from collections.abc import Callable
from concurrent.futures import Executor
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest
from differentiable import oscillator, switched
from ensembles import Inline, after, assert_same, explosive

import symfric as sf
import symfric.integrator.compiled.compiler as compiler
import symfric.integrator.many.members as module
import symfric.integrator.running.integrator as built
from symfric.foundation.programs import Compiler
from symfric.integrator.equations.initial import first_guess
from symfric.integrator.equations.inputs import input_data
from symfric.integrator.equations.system import system
from symfric.integrator.many.chunk import Solved
from symfric.integrator.many.member_data import Store
from symfric.integrator.many.members import Assembly
from symfric.scenes import Pendulum


def solved(first: int, size: int = 2, fails: bool = True) -> Solved:
    """Signals that show their member and their signal."""
    members = np.arange(first, first + size, dtype=float)
    signals = np.stack([members, 100 + members], axis=1)[:, None, :].repeat(3, axis=1)
    failed = {1: f"member {first + 1} failed at 2³ °C"} if fails else {}
    reach = np.stack([-members, members], axis=1)[:, :, None]
    return Solved(signals, members.astype(np.int64) + 1, members / 10, failed, reach)


def stored(folder: Path | None, members: int = 6) -> Store:
    return Store(folder, ["a", "b"], members, 3, 1)


def test_two_calls_at_once_share_a_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The other creates its files while this one creates its own; both see all results."""
    header, others = np.lib.format.write_array_header_1_0, list[Store]()

    def meanwhile(file: Any, content: dict[str, Any]) -> None:
        monkeypatch.undo()
        others.append(stored(tmp_path))
        header(file, content)

    monkeypatch.setattr(np.lib.format, "write_array_header_1_0", meanwhile)
    store = stored(tmp_path)
    store.put(0, solved(0))
    assert others[0].has(0)
    np.testing.assert_array_equal(store.signals["a"], others[0].signals["a"])
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.npy", "b.npy", "chunk-0.npz"]


def test_an_interrupted_run_is_resumed(tmp_path: Path) -> None:
    """With a failed member in the part that was finished before; the model is built anew."""
    p = np.linspace(0.0, 0.9, 20)
    p[1] = 2.0

    def run(executor: Executor, progress: Callable[[float], None] | None = None) -> sf.Ensemble:
        return sf.simulate_many(
            explosive(), 1.0, p={"p": p}, chunk=3, executor=executor, workers=1, out=tmp_path,
            progress=progress,
        )  # fmt: skip

    first, second, third = Inline(), Inline(), Inline()
    interrupted = run(first, after(3))
    assert interrupted.status is sf.Status.INTERRUPTED
    assert np.isfinite(interrupted["x"][:, 0]).sum() == 3 * 3 - 1
    reported: list[float] = []
    resumed = run(second, reported.append)
    assert resumed.status is sf.Status.SUCCESS
    assert second.tasks == 7 - 3
    assert len(reported) == 4
    assert reported[0] >= 11 / 20
    assert reported[-1] == 1.0
    assert_same(resumed, sf.simulate_many(explosive(), 1.0, p={"p": p}, executor="serial"))
    assert list(resumed.failed) == [1]
    assert_same(run(third), resumed)
    assert third.tasks == 0


def test_a_folder_holds_the_results_as_plain_arrays(tmp_path: Path) -> None:
    model, x0 = sf.rabinowicz(sf.LuGre()), {"v": np.linspace(-0.1, 0.1, 7)}
    given: dict[str, Any] = {"x0": x0, "t_eval": [0.5, 1.0], "chunk": 3}
    in_memory = sf.simulate_many(model, 1.0, **given)
    assert_same(in_memory, sf.simulate_many(model, 1.0, out=tmp_path, **given))
    (folder,) = tmp_path.iterdir()
    np.testing.assert_array_equal(np.load(folder / "x.npy"), in_memory["x"])
    (folder / "x.npy").unlink()
    with pytest.warns(UserWarning, match="out: 3 of 3 chunks in .* have been deleted"):
        assert_same(sf.simulate_many(model, 1.0, out=tmp_path, **given), in_memory)
    assert_same(sf.simulate_many(model, 1.0, out=tmp_path, **given), in_memory)


def constant(value: float, output: float = 1.0, bound: float = 0.0) -> sf.Model:
    """x' = value + p + u, an output, a start value that is an expression."""
    p, u = sf.Variable("p", "m/s", start=0.0), sf.Variable("u", "m/s", start=0.0)
    x = sf.Variable("x", "m", start=0.0)
    y = sf.Variable("y", "m", start=x.symbol + bound)
    return sf.Model(
        "constant", x=(x, y), p=(p,), u=(u,), ode=ca.vertcat(value + p.symbol + u.symbol, 0),
        outputs={"out": sf.Output(output * x.symbol, "m")},
    )  # fmt: skip


MANY = np.zeros(1100)
"""Long enough for NumPy to leave most of it out of what it prints."""


def changed(row: int) -> Any:
    array = MANY.copy()
    array[row] = 1e-9
    return array


CHANGES: list[dict[str, Any]] = [
    {"x0": {"x": changed(500)}}, {"x0": {"y": changed(500)}}, {"p": {"p": changed(500)}},
    {"p": {"p": 1e-12}}, {"u": {"u": 1e-12}}, {"u": {"u": sf.Hold([0.0], [2e-12])}},
    {"u": {"u": lambda t: 1e-12 * t}}, {"rtol": 2e-6}, {"method": "rodas4p"},
    {"max_steps": 9_999_999}, {"t_eval": [1.0 - 1e-12]}, {"t_end": 1.0 + 1e-12, "t_eval": [1.0]},
    {"t_start": 1e-12}, {"max_step": 0.01}, {"times": [0.5]}, {"backend": "vm"},
    {"chunk": 550}, {"model": constant(1.0 + 1e-15)}, {"model": constant(1.0, output=2.0)},
    {"model": constant(1.0, bound=1e-12)},
]  # fmt: skip


def test_results_of_other_arguments_are_never_used(tmp_path: Path) -> None:
    model = constant(1.0)
    given: dict[str, Any] = {"t_end": 1.0, "x0": {"x": MANY}, "chunk": 1100}

    def tasks(change: dict[str, Any]) -> int:
        executor = Inline()
        arguments = {"model": model} | given | change
        sf.simulate_many(**arguments, executor=executor, out=tmp_path)
        return executor.tasks

    assert [tasks({}), tasks({"model": constant(1.0)})] == [1, 0]
    for change in CHANGES:
        assert tasks(change) == 1100 // change.get("chunk", 1100), change


def test_only_a_few_chunks_exist_at_once(tmp_path: Path) -> None:
    executor = Inline()
    given: dict[str, Any] = {"x0": {"x": np.ones(200)}, "chunk": 2, "workers": 2, "out": tmp_path}
    sf.simulate_many(oscillator(), 0.1, executor=executor, **given)
    assert executor.tasks == 100
    assert executor.most <= 2 * 2 + 1


def test_damaged_chunks_are_computed_again(tmp_path: Path) -> None:
    def remove(path: Path) -> None:
        path.unlink()

    def cut(path: Path) -> None:
        content = path.read_bytes()
        path.unlink()  # it is mapped
        path.write_bytes(content[:-20])

    def flip(path: Path) -> None:
        content = bytearray(path.read_bytes())
        content[len(content) // 2] ^= 1
        path.write_bytes(content)

    def other_header(path: Path) -> None:
        values = np.load(path)
        path.unlink()
        np.save(path, values.T)

    def text(path: Path) -> None:
        path.unlink()
        path.write_text("no array")

    cases = [("a.npy", remove, 0), ("b.npy", cut, 0), ("a.npy", flip, 2), ("a.npy", text, 0),
             ("b.npy", other_header, 0), ("chunk-2.npz", cut, 2), ("chunk-4.npz", text, 2),
             ("chunk-0.npz", flip, 2)]  # fmt: skip
    for k, (name, damage, kept) in enumerate(cases):
        folder, store = tmp_path / str(k), stored(tmp_path / str(k))
        for first in (0, 2, 4):
            store.put(first, solved(first))
        damage(folder / name)
        store = stored(folder)
        known = [store.has(first) for first in (0, 2, 4)]
        assert sum(known) == kept, (name, damage.__name__)
        assert store.damaged == [2 * i for i, whole in enumerate(known) if not whole]
        for first in store.damaged:
            store.put(first, solved(first))
        np.testing.assert_array_equal(store.signals["a"][:, 0], np.arange(6.0))
        np.testing.assert_array_equal(np.load(folder / "b.npy")[:, 2], 100 + np.arange(6.0))
        assert all(stored(folder).has(first) for first in (0, 2, 4))


def test_a_full_disk_is_a_sentence(tmp_path: Path) -> None:
    resource = pytest.importorskip("resource")
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    try:
        resource.setrlimit(resource.RLIMIT_FSIZE, (2**20, before[1]))
        message = r"out: expected 8 MB of disk space for '.*a.npy', got File"
        with pytest.raises(ValueError, match=message):
            Store(tmp_path / "large", ["a"], 10_000, 100, 1)
        small = stored(tmp_path / "small")
        small.put(0, solved(0))
        resource.setrlimit(resource.RLIMIT_FSIZE, (10, before[1]))
        message = r"expected disk space for members from 2 on .* got File too large"
        with pytest.raises(ValueError, match=message):
            small.put(2, solved(2))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
        signal.signal(signal.SIGXFSZ, handler)
    assert list((tmp_path / "large").iterdir()) == []
    later = stored(tmp_path / "small")
    assert (later.has(0), later.has(2)) == (True, False)


def test_disk_space_is_allocated_with_the_files(tmp_path: Path) -> None:
    Store(tmp_path, ["a"], 3000, 100, 1)
    assert (tmp_path / "a.npy").stat().st_blocks * 512 >= 3000 * 100 * 8
    assert np.isnan(np.load(tmp_path / "a.npy")).all()


@pytest.mark.parametrize("make", [oscillator, switched])
def test_another_call_builds_writes_and_compiles_nothing(
    make: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    made: list[str] = []

    def counted(place: Any, name: str) -> None:
        real = getattr(place, name)

        def call(*arguments: Any, **options: Any) -> Any:
            made.append(name)
            return real(*arguments, **options)

        monkeypatch.setattr(place, name, call)

    for place, name in (
        (built, "Integrator"), (module, "with_code"), (compiler, "opened"), (Compiler, "run"),
    ):  # fmt: skip
        counted(place, name)
    model = make()
    first = sf.simulate_many(model, 1.0, x0={"x": [0.5, 1.0]}, backend="compiled")
    assert made[:2] == ["Integrator", "with_code"]
    made.clear()
    again = sf.simulate_many(model, 1.0, x0={"x": [1.0, 0.5]}, u={"u": 0.0}, backend="compiled")
    sf.simulate(model, 1.0, backend="vm")
    assert made == []
    np.testing.assert_array_equal(again["x"], first["x"][::-1])
    sf.simulate_many(model, 1.0, method="rodas4p", backend="compiled")
    assert made[:2] == ["Integrator", "with_code"]
    gone = weakref.ref(model)
    del model
    gc.collect()
    assert gone() is None  # programs die with their model


def test_each_member_has_the_charts_of_its_own_start() -> None:
    """Bases of the tangent space of a pendulum in absolute coordinates."""
    model = Pendulum(sf.BrownMcPhee()).mechanism().build(formulation="absolute")
    whole = system(model, input_data(model, None, 0.0, 1.0))
    manifold, d = whole.manifold, np.tile(model.values("p"), (3, 1))
    assert manifold is not None and manifold.charted
    guess = first_guess(whole, model, model.initial_state(None, None, 0.0), 0.0)
    y, closed = Assembly(manifold, whole.nx)(np.outer([1.0, 1.01, 0.99], guess), d)
    assert closed.all()
    n, m = manifold.n, manifold.m
    for row in y:
        slope, V = manifold.slope(row, d[0]).full(), row[manifold.basis].reshape(n - m, n)
        assert pytest.approx(np.eye(n - m), abs=1e-12) == V @ V.T
        assert slope[n : n + m, :n] @ V.T == pytest.approx(np.zeros((m, n - m)), abs=1e-12)
