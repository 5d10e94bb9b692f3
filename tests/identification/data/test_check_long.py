"""Checks of a long record, of which statistics use blocks: faults anywhere are found."""

from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest

from identification.data.dataset import Dataset
from identification.data.record import BLOCKS, LONG, blocks

Array = np.ndarray
N, STEP = 400_001, 1e-3
INSIDE = blocks(N)[3].stop + 50
"""A sample that is in no block."""


def record(change: Callable[[Array, Array, Array], None] | None = None) -> Dataset:
    """Return a drive of 2 kg with Coulomb and viscous friction, changed in place by `change`."""
    t, rng = STEP * np.arange(N), np.random.default_rng(0)
    w = np.array([[np.pi], [3.1 * np.pi]])
    size = np.array([[0.05], [0.02]])
    x = np.sum(size * np.sin(w * t), axis=0)
    v, a = np.sum(size * w * np.cos(w * t), axis=0), -np.sum(size * w**2 * np.sin(w * t), axis=0)
    force = 2 * a + 5 * np.tanh(v / 1e-3) + 3 * v + 0.05 * rng.standard_normal(N)
    x = x + 1e-6 * rng.standard_normal(N)
    if change is not None:
        change(t, x, force)
    return Dataset.of(t=t, x=x, force=force)


def spike(t: Array, x: Array, force: Array) -> None:
    del t, x
    force[INSIDE] += 100.0


def frozen(t: Array, x: Array, force: Array) -> None:
    del t, force
    x[INSIDE : INSIDE + 12] = x[INSIDE]


def late(t: Array, x: Array, force: Array) -> None:
    del t, x
    force[7:] = force[:-7].copy()


def drift(t: Array, x: Array, force: Array) -> None:
    del x
    force += 4.0 * t / t[-1]


def hum(t: Array, x: Array, force: Array) -> None:
    del x
    force += np.sin(2 * np.pi * 50 * t)


def limited(t: Array, x: Array, force: Array) -> None:
    del t, x
    force[:] = np.clip(force, -5.5, 5.5)


def turned(t: Array, x: Array, force: Array) -> None:
    del t, x
    force *= -1


@pytest.mark.parametrize(
    ("change", "kind", "signal"),
    [
        (None, "", ""),
        (spike, "spikes", "force"),
        (frozen, "frozen", "x"),
        (late, "delay", "force"),
        (drift, "drift", "force"),
        (hum, "hum", "force"),
        (limited, "clipping", "force"),
        (turned, "sign", "force"),
    ],
)
def test_the_fault_alone_is_found(
    change: Callable[[Array, Array, Array], None] | None, kind: str, signal: str
) -> None:
    found = record(change).check()
    assert {(f.kind, f.signal) for f in found} == ({(kind, signal)} if kind else set()), str(found)
    if kind in ("spikes", "frozen"):
        assert found[0].begin == pytest.approx(STEP * INSIDE)
    if kind == "delay":
        assert "by about 0.007 s (7 samples)" in found[0].sentence


def test_blocks_are_even_and_disjoint() -> None:
    parts = blocks(N)
    assert len(parts) == BLOCKS and {p.stop - p.start for p in parts} == {LONG // BLOCKS + 1}
    assert (parts[0].start, parts[-1].stop) == (0, N)
    assert all(a.stop <= b.start for a, b in pairwise(parts))
    assert not any(p.start <= INSIDE < p.stop for p in parts)
    assert blocks(LONG) == [slice(0, LONG)]
