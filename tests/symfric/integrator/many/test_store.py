"""Results of an ensemble in memory or in a folder: resumed, told apart, bounded in memory."""

import signal
import tracemalloc
from collections.abc import Callable
from concurrent.futures import Executor
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest
from differentiable import oscillator
from ensembles import Inline, after, assert_same, explosive

from symfric import (
    Ensemble,
    Hold,
    LuGre,
    Model,
    Output,
    Status,
    Variable,
    rabinowicz,
    simulate_many,
)
from symfric.integrator.many.chunk import Solved
from symfric.integrator.many.store import Store


def solved(first: int, size: int = 2) -> Solved:
    """Signals that say which member and which signal they are of."""
    members = np.arange(first, first + size, dtype=float)
    signals = np.stack([members, 100 + members], axis=1)[:, None, :].repeat(3, axis=1)
    attempts = members.astype(np.int64) + 1
    return Solved(signals, attempts, members / 10, {1: f"member {first + 1} failed at 2³ °C"},
                  np.stack([-members, members], axis=1)[:, :, None])  # fmt: skip


@pytest.mark.parametrize("folder", [False, True])
def test_chunks_go_where_their_members_are(folder: bool, tmp_path: Path) -> None:
    store = Store(tmp_path if folder else None, ["a", "b"], 5, 3, 1)
    store.put(2, solved(2))
    np.testing.assert_array_equal(store.signals["a"][2:4], [[2.0] * 3, [3.0] * 3])
    np.testing.assert_array_equal(store.signals["b"][3], [103.0] * 3)
    assert np.isnan(store.signals["a"][[0, 1, 4]]).all()
    assert store.attempts.tolist() == [0, 0, 3, 4, 0]
    assert store.reached[2:4].tolist() == [0.2, 0.3]
    assert np.isnan(store.reached[[0, 1, 4]]).all()
    assert store.failed == {3: "member 3 failed at 2³ °C"}


def test_folder_tells_a_later_store_what_is_complete(tmp_path: Path) -> None:
    Store(tmp_path, ["a", "b"], 4, 3, 1).put(2, solved(2))
    later = Store(tmp_path, ["a", "b"], 4, 3, 1)
    assert (later.has(0), later.has(2)) == (False, True)
    np.testing.assert_array_equal(later.signals["b"][2], [102.0] * 3)
    assert later.attempts.tolist() == [0, 0, 3, 4]
    assert later.reached[2:].tolist() == [0.2, 0.3]
    assert later.reach[2:, :, 0].tolist() == [[-2.0, 2.0], [-3.0, 3.0]]
    assert later.failed == {3: "member 3 failed at 2³ °C"}


def test_two_calls_at_once_share_a_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The other makes its files while this one makes its own; both see what either writes."""
    header, others = np.lib.format.write_array_header_1_0, list[Store]()

    def meanwhile(file: Any, content: dict[str, Any]) -> None:
        monkeypatch.undo()
        others.append(Store(tmp_path, ["a", "b"], 4, 3, 1))
        header(file, content)

    monkeypatch.setattr(np.lib.format, "write_array_header_1_0", meanwhile)
    store = Store(tmp_path, ["a", "b"], 4, 3, 1)
    store.put(0, solved(0))
    assert others[0].has(0)
    np.testing.assert_array_equal(store.signals["a"], others[0].signals["a"])
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.npy", "b.npy", "chunk-0.npz"]


def test_memory_remembers_nothing() -> None:
    store = Store(None, ["a", "b"], 4, 3, 1)
    store.put(2, solved(2))
    assert not store.has(2)


def test_signals_of_a_folder_are_mapped_not_loaded(tmp_path: Path) -> None:
    store = Store(tmp_path, ["a"], 4, 3, 1)
    assert isinstance(store.signals["a"], np.memmap)
    assert np.load(tmp_path / "a.npy").shape == (4, 3)


def test_chunk_without_failures_is_complete_too(tmp_path: Path) -> None:
    none = Solved(
        np.zeros((2, 3, 1)), np.ones(2, dtype=np.int64), np.ones(2), {}, np.zeros((2, 2, 1))
    )
    Store(tmp_path, ["a"], 2, 3, 1).put(0, none)
    later = Store(tmp_path, ["a"], 2, 3, 1)
    assert later.has(0)
    assert later.failed == {}


def test_interrupted_run_is_resumed_where_it_stopped(tmp_path: Path) -> None:
    """With a failed member in the part that was finished before; the model is built anew."""
    p = np.linspace(0.0, 0.9, 20)
    p[1] = 2.0

    def run(executor: Executor, progress: Callable[[float], None] | None = None) -> Ensemble:
        return simulate_many(
            explosive(), 1.0, p={"p": p}, chunk=3, executor=executor, workers=1, out=tmp_path,
            progress=progress,
        )  # fmt: skip

    first, second, third = Inline(), Inline(), Inline()
    interrupted = run(first, after(3))
    assert interrupted.status is Status.INTERRUPTED
    assert np.isfinite(interrupted["x"][:, 0]).sum() == 3 * 3 - 1
    told: list[float] = []
    resumed = run(second, told.append)
    assert resumed.status is Status.SUCCESS
    assert second.tasks == 7 - 3
    assert len(told) == 4
    assert told[0] >= 11 / 20
    assert told[-1] == 1.0
    assert_same(resumed, simulate_many(explosive(), 1.0, p={"p": p}, executor="serial"))
    assert list(resumed.failed) == [1]
    assert_same(run(third), resumed)
    assert third.tasks == 0


def test_folder_holds_the_same_results_as_plain_arrays(tmp_path: Path) -> None:
    model, x0 = rabinowicz(LuGre()), {"v": np.linspace(-0.1, 0.1, 7)}
    times = [0.5, 1.0]
    in_memory = simulate_many(model, 1.0, x0=x0, t_eval=times, chunk=3)
    on_disk = simulate_many(model, 1.0, x0=x0, t_eval=times, chunk=3, out=tmp_path)
    assert_same(in_memory, on_disk)
    assert isinstance(on_disk["x"], np.memmap)
    (folder,) = tmp_path.iterdir()
    np.testing.assert_array_equal(np.load(folder / "x.npy"), in_memory["x"])


def constant(value: float, output: float = 1.0, bound: float = 0.0) -> Model:
    """x' = value + p + u, an output, a start value that is an expression."""
    p, u = Variable("p", "m/s", start=0.0), Variable("u", "m/s", start=0.0)
    x = Variable("x", "m", start=0.0)
    y = Variable("y", "m", start=x.symbol + bound)
    return Model(
        "constant",
        x=(x, y),
        p=(p,),
        u=(u,),
        ode=ca.vertcat(value + p.symbol + u.symbol, 0),
        outputs={"out": Output(output * x.symbol, "m")},
    )


MANY = np.zeros(2500)
"""Long enough for NumPy to leave most of it out of what it prints."""


def changed(row: int) -> Any:
    array = MANY.copy()
    array[row] = 1e-9
    return array


@pytest.mark.parametrize(
    "change",
    [
        {"x0": {"x": changed(1250)}},
        {"x0": {"y": changed(1250)}},
        {"p": {"p": changed(1250)}},
        {"p": {"p": 1e-12}},
        {"u": {"u": 1e-12}},
        {"u": {"u": Hold([0.0], [1e-12])}},
        {"u": {"u": lambda t: 1e-12 * t}},
        {"rtol": 2e-6},
        {"method": "rodas4p"},
        {"max_steps": 9_999_999},
        {"t_eval": [1.0 - 1e-12]},
        {"t_end": 1.0 + 1e-12, "t_eval": [1.0]},
        {"t_start": 1e-12},
        {"max_step": 0.01},
        {"times": [0.5]},
        {"backend": "vm"},
        {"chunk": 1250},
        {"model": constant(1.0 + 1e-15)},
        {"model": constant(1.0, output=2.0)},
        {"model": constant(1.0, bound=1e-12)},
    ],
    ids=lambda changed: str(changed).partition(" at 0x")[0],  # workers must agree
)
def test_other_arguments_never_take_these_results(change: dict[str, Any], tmp_path: Path) -> None:
    arguments: dict[str, Any] = {"t_end": 1.0, "x0": {"x": MANY}, "chunk": 2500}
    first, again, other = Inline(), Inline(), Inline()
    simulate_many(constant(1.0), **arguments, executor=first, out=tmp_path)
    simulate_many(constant(1.0), **arguments, executor=again, out=tmp_path)
    assert (first.tasks, again.tasks) == (1, 0)
    arguments = {"model": constant(1.0)} | arguments | change
    simulate_many(**arguments, executor=other, out=tmp_path)
    assert other.tasks == 2500 // arguments["chunk"]


def test_only_a_few_chunks_are_alive_at_once(tmp_path: Path) -> None:
    executor = Inline()
    simulate_many(
        oscillator(), 0.1, x0={"x": np.ones(200)}, chunk=2, executor=executor, workers=2,
        out=tmp_path,
    )  # fmt: skip
    assert executor.tasks == 100
    assert executor.most <= 2 * 2 + 1


@pytest.mark.slow
def test_memory_stays_bounded_for_a_hundred_thousand_members(tmp_path: Path) -> None:
    members, times = 100_000, np.linspace(0.0, 0.1, 50)
    tracemalloc.start()
    many = simulate_many(
        oscillator(), 0.1, x0={"x": np.linspace(0.0, 1.0, members)}, t_eval=times, out=tmp_path
    )
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    whole = sum(values.nbytes for values in many.signals.values())
    assert whole == 4 * 50 * 8 * members
    assert most < whole / 4
    assert not many.failed
    end = many["x"][:, -1]
    assert np.diff(end) == pytest.approx(np.full(members - 1, np.diff(end).mean()), rel=1e-3)


def finished(folder: Path) -> Path:
    """A store of three chunks, complete."""
    store = Store(folder, ["a", "b"], 6, 3, 1)
    for first in (0, 2, 4):
        store.put(first, solved(first))
    return folder


def left(folder: Path) -> list[bool]:
    """Which chunks a later store takes over; the others are put again and must be right then."""
    store = Store(folder, ["a", "b"], 6, 3, 1)
    kept = [store.has(first) for first in (0, 2, 4)]
    assert store.damaged == [2 * k for k, whole in enumerate(kept) if not whole]
    for first in np.flatnonzero(~np.array(kept)) * 2:
        store.put(int(first), solved(int(first)))
    np.testing.assert_array_equal(store.signals["a"][:, 0], np.arange(6.0))
    np.testing.assert_array_equal(np.load(folder / "b.npy")[:, 2], 100 + np.arange(6.0))
    assert all(Store(folder, ["a", "b"], 6, 3, 1).has(first) for first in (0, 2, 4))
    return kept


def test_what_is_damaged_is_computed_again(tmp_path: Path) -> None:
    """4f644ad gave NaN for a deleted file, other values for one cut short, and said SUCCESS."""

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
        folder = finished(tmp_path / str(k))
        damage(folder / name)
        assert sum(left(folder)) == kept, (name, damage.__name__)


def test_damage_is_told_and_the_results_are_right(tmp_path: Path) -> None:
    def run() -> Ensemble:
        return simulate_many(
            oscillator(), 0.1, x0={"x": np.linspace(0.0, 1.0, 6)}, chunk=2, out=tmp_path,
            executor="serial", backend="vm",
        )  # fmt: skip

    first = run()
    (folder,) = tmp_path.iterdir()
    (folder / "x.npy").unlink()
    with pytest.warns(UserWarning, match="out: 3 of 3 chunks in .* have been deleted"):
        assert_same(run(), first)
    assert_same(run(), first)


def test_results_on_disk_cannot_be_changed_by_accident(tmp_path: Path) -> None:
    store = Store(finished(tmp_path), ["a", "b"], 6, 3, 1)
    with pytest.raises(ValueError, match="read-only"):
        store.signals["a"] *= 2


def test_a_full_disk_is_a_sentence(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """4f644ad ended by SIGBUS, having reserved nothing."""
    resource = pytest.importorskip("resource")
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    try:
        resource.setrlimit(resource.RLIMIT_FSIZE, (2**20, before[1]))
        with pytest.raises(
            ValueError, match=r"out: expected 8 MB of disk space for '.*a.npy', got File"
        ):
            Store(tmp_path / "large", ["a"], 10_000, 100, 1)
        small = Store(tmp_path / "small", ["a", "b"], 6, 3, 1)
        small.put(0, solved(0))
        resource.setrlimit(resource.RLIMIT_FSIZE, (10, before[1]))
        with pytest.raises(
            ValueError, match=r"expected disk space for members from 2 on .* got File too large"
        ):
            small.put(2, solved(2))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
        signal.signal(signal.SIGXFSZ, handler)
    assert list((tmp_path / "large").iterdir()) == []
    later = Store(tmp_path / "small", ["a", "b"], 6, 3, 1)
    assert (later.has(0), later.has(2)) == (True, False)


def test_room_is_taken_when_the_files_are_made(tmp_path: Path) -> None:
    Store(tmp_path, ["a"], 3000, 100, 1)
    assert (tmp_path / "a.npy").stat().st_blocks * 512 >= 3000 * 100 * 8
    assert np.isnan(np.load(tmp_path / "a.npy")).all()
