"""Results of an ensemble: kept in memory or in a folder, chunk by chunk."""

from pathlib import Path

import numpy as np
import pytest

from symfric.integrator.chunk import Solved
from symfric.integrator.store import Store


def solved(first: int, size: int = 2) -> Solved:
    """Signals that say which member and which signal they are of."""
    members = np.arange(first, first + size, dtype=float)
    signals = np.stack([members, 100 + members], axis=1)[:, None, :].repeat(3, axis=1)
    attempts = members.astype(np.int64) + 1
    return Solved(signals, attempts, members / 10, {1: f"member {first + 1} failed at 2³ °C"})


@pytest.mark.parametrize("folder", [False, True])
def test_chunks_go_where_their_members_are(folder: bool, tmp_path: Path) -> None:
    store = Store(tmp_path if folder else None, ["a", "b"], 5, 3)
    store.put(2, solved(2))
    np.testing.assert_array_equal(store.signals["a"][2:4], [[2.0] * 3, [3.0] * 3])
    np.testing.assert_array_equal(store.signals["b"][3], [103.0] * 3)
    assert np.isnan(store.signals["a"][[0, 1, 4]]).all()
    assert store.attempts.tolist() == [0, 0, 3, 4, 0]
    assert store.reached[2:4].tolist() == [0.2, 0.3]
    assert np.isnan(store.reached[[0, 1, 4]]).all()
    assert store.failed == {3: "member 3 failed at 2³ °C"}


def test_folder_tells_a_later_store_what_is_complete(tmp_path: Path) -> None:
    Store(tmp_path, ["a", "b"], 4, 3).put(2, solved(2))
    later = Store(tmp_path, ["a", "b"], 4, 3)
    assert (later.has(0), later.has(2)) == (False, True)
    np.testing.assert_array_equal(later.signals["b"][2], [102.0] * 3)
    assert later.attempts.tolist() == [0, 0, 3, 4]
    assert later.reached[2:].tolist() == [0.2, 0.3]
    assert later.failed == {3: "member 3 failed at 2³ °C"}


def test_memory_remembers_nothing() -> None:
    store = Store(None, ["a", "b"], 4, 3)
    store.put(2, solved(2))
    assert not store.has(2)


def test_signals_of_a_folder_are_mapped_not_loaded(tmp_path: Path) -> None:
    store = Store(tmp_path, ["a"], 4, 3)
    assert isinstance(store.signals["a"], np.memmap)
    assert np.load(tmp_path / "a.npy").shape == (4, 3)


def test_chunk_without_failures_is_complete_too(tmp_path: Path) -> None:
    none = Solved(np.zeros((2, 3, 1)), np.ones(2, dtype=np.int64), np.ones(2), {})
    Store(tmp_path, ["a"], 2, 3).put(0, none)
    later = Store(tmp_path, ["a"], 2, 3)
    assert later.has(0)
    assert later.failed == {}
