"""Each fault is found, with its kind, severity and place, also in long records."""

from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from tables import sampled

from identification.data.dataset import Dataset
from identification.data.record import BLOCKS, LONG, blocks

Array = np.ndarray
LINES = Path(__file__).with_name("faults.txt").read_text("utf-8").splitlines()[1:]
FAULTS = {name: rest for name, *rest in (line.split(" => ") for line in LINES)}


def put(y: Array, rows: object, values: object) -> Array:
    y[rows] = values  # pyright: ignore[reportArgumentType, reportCallIssue]
    return y


def noise(n: int, size: float = 1.0) -> Array:
    return size * np.random.default_rng(0).standard_normal(n)


def spoiled(data: Dataset, fault: str) -> Dataset:
    t, x, f = (data[0][name].copy() for name in ("t", "x", "force"))
    names = {"np": np, "put": put, "noise": noise, "t": t, "x": x, "f": f}
    t, x, force = eval(FAULTS[fault][0], names)
    return Dataset.of(t=t, x=x, force=force)


@pytest.mark.parametrize("fault", FAULTS)
def test_fault_is_found(stage_data: Dataset, fault: str) -> None:
    severity, kind, signal = FAULTS[fault][1].split()
    found = spoiled(stage_data, fault).check()
    hits = [f for f in found if f.kind == kind and f.signal == signal]
    assert hits, str(found)
    assert {f.severity for f in hits} == {severity}
    assert severity == "error" or not found.errors, str(found)


def test_places_are_reported(stage_data: Dataset) -> None:
    def only(fault: str, kind: str) -> tuple[float, float, str]:
        (hit,) = [f for f in spoiled(stage_data, fault).check() if f.kind == kind]
        return hit.begin, hit.end, hit.sentence

    begin, end, text = only("frozen encoder", "frozen")
    assert (begin, end) == (1.5, 1.899)
    assert "for 400 samples from t = 1.5 s (sample 1500) on, then jumps by 0.0016 m" in text
    assert only("position glitch", "glitch")[:2] == (0.8, 0.8)
    assert only("lost counts", "jump")[:2] == pytest.approx((2.0, 2.001))
    assert only("gap", "gap")[:2] == pytest.approx((0.999, 1.5))
    assert "by about 0.007 s (7 samples)" in only("late force", "delay")[2]


def test_repairs_undo_what_was_found(stage_data: Dataset) -> None:
    record = stage_data[0]
    spiked = spoiled(stage_data, "force spikes").without_spikes()
    assert not spiked.check().errors
    assert np.abs(spiked[0]["force"] - record["force"]).max() < 20
    wrapped = spoiled(stage_data, "wrapped position")
    assert "data.unwrapped({'x': 0.02})" in str(wrapped.check())
    np.testing.assert_allclose(wrapped.unwrapped({"x": 0.02})[0]["x"], record["x"], atol=1e-12)
    flipped = spoiled(stage_data, "flipped force")
    assert not flipped.scaled({"force": -1}).check().errors
    volts = Dataset.of({"t": record.time, "u [V]": record["force"] / 5})
    newtons = volts.scaled({"u": 5.0}, units={"u": "N"}).renamed({"u": "force"})[0]
    np.testing.assert_allclose(newtons["force"], record["force"])
    assert newtons.unit("force") == "N"


@pytest.mark.parametrize(
    ("factor", "severity", "kind", "text"),
    [
        (-1.0, "error", "sign", "v is opposite to the slope of x"),
        (57.2958, "error", "units", "deg/s taken as rad/s"),
        (1e3, "error", "units", "mm/s taken as m/s"),
        (0.5, "warning", "units", "v is 0.5 times the slope of x"),
    ],
)
def test_velocity_is_held_against_the_position(
    stage_data: Dataset, factor: float, severity: str, kind: str, text: str
) -> None:
    t, x, force = (stage_data[0][key] for key in ("t", "x", "force"))
    found = Dataset.of(t=t, x=x, force=force, v=factor * np.gradient(x, t)).check()
    assert [(f.severity, f.kind) for f in found if text in f.sentence] == [(severity, kind)]


def test_roles_name_signals_that_are_called_otherwise(stage_data: Dataset) -> None:
    record = stage_data[0]
    data = Dataset.of({"t": record.time, "theta_2": record["x"], "tau_2": -record["force"]})
    assert not data.check().errors
    (error,) = data.check(x="theta_2", force="tau_2").errors
    assert (error.kind, error.signal) == ("sign", "tau_2")


def test_a_slide_with_a_torque_is_refused() -> None:
    t = np.arange(100) / 100
    data = Dataset.of(t=t, x=np.sin(9 * t), force=np.cos(9 * t), units={"force": "N m"})
    assert "x is in m and force in N m" in str(data.check())


@pytest.mark.parametrize(
    ("v", "force", "kinds"),
    [
        (np.linspace(-1, 1, 21), lambda v: -np.sign(v) * (1 + v * v) + 0.2, {"sign"}),
        (np.linspace(0.1, 1, 21), lambda v: -1 - v * v, {"sign", "one-way"}),
        (np.linspace(0.1, 1, 21), lambda v: 1 + v * v, {"one-way"}),
        (np.linspace(-1, 1, 21), lambda v: np.sign(v) * (1 + v * v) + 0.2, set()),
        (np.linspace(-1, 1, 3), lambda v: np.sign(v), {"short"}),
        (np.full(9, 0.5), lambda v: 1 + np.arange(9), {"constant"}),
    ],
)
def test_points(v: Array, force: Callable[[Array], Array], kinds: set[str]) -> None:
    assert set(Dataset.of(v=v, F=force(v), points=True).check().kinds) == kinds


def test_findings_print_and_count(stage_data: Dataset) -> None:
    both = stage_data + spoiled(stage_data, "flipped force")
    found = both.check()
    assert (len(found), len(found.errors), found[0].record) == (1, 1, 1)
    assert "error: data: force brakes the motion that it drives" in str(found)
    assert found[0].to_dict()["kind"] == "sign"
    assert "no problems found" in str(stage_data.check())


def test_odd_signals_are_checked_without_a_crash() -> None:
    """Steps, noise, ramps and constants of any size and length; warnings of NumPy are errors."""
    rng = np.random.default_rng(1)
    forms: list[Callable[[Array], Array]] = [
        lambda t: 0 * t + 3,
        lambda t: rng.standard_normal(t.size),
        lambda t: np.cumsum(rng.standard_normal(t.size)),
        lambda t: np.sign(np.sin(20 * t)),
        lambda t: np.round(5 * np.sin(9 * t)),
        lambda t: np.where(rng.random(t.size) < 0.01, 1e6, 0.0),
        lambda t: np.exp(-5 * t) * np.cos(40 * t),
        lambda t: t,
    ]
    for _ in range(80):
        n = int(rng.choice([2, 3, 8, 20, 50, 60, 100, 300]))
        t = np.cumsum(rng.random(n) ** rng.integers(0, 3) + 1e-6)
        t, u = t * 10.0 ** rng.integers(-6, 4), t / t[-1]
        x, force, v = (
            forms[rng.integers(len(forms))](u) * 10.0 ** rng.integers(-9, 9) for _ in range(3)
        )
        found = Dataset.of(t=t, x=x, force=force, v=v).check()
        assert all(f.begin <= f.end for f in found)


N, STEP = 400_001, 1e-3
INSIDE = blocks(N)[3].stop + 50
"""A sample that is in no block."""


@pytest.fixture(scope="module")
def long() -> tuple[Array, Array, Array]:
    """Times, positions and forces of a drive of 2 kg with Coulomb and viscous friction."""
    t, rng = STEP * np.arange(N), np.random.default_rng(0)
    w = np.array([[np.pi], [3.1 * np.pi]])
    size = np.array([[0.05], [0.02]])
    x = np.sum(size * np.sin(w * t), axis=0)
    v, a = np.sum(size * w * np.cos(w * t), axis=0), -np.sum(size * w**2 * np.sin(w * t), axis=0)
    force = 2 * a + 5 * np.tanh(v / 1e-3) + 3 * v + 0.05 * rng.standard_normal(N)
    return t, x + 1e-6 * rng.standard_normal(N), force


CHANGES: dict[str, Callable[[Array, Array, Array], tuple[Array, Array]]] = {
    "": lambda t, x, f: (x, f),
    "drift force": lambda t, x, f: (x, f + 4.0 * t / t[-1]),
    "spikes force": lambda t, x, f: (x, put(f, INSIDE, f[INSIDE] + 100.0)),
    "hum force": lambda t, x, f: (x, f + np.sin(2 * np.pi * 50 * t)),
    "frozen x": lambda t, x, f: (put(x, slice(INSIDE, INSIDE + 12), x[INSIDE]), f),
    "clipping force": lambda t, x, f: (x, np.clip(f, -5.5, 5.5)),
    "delay force": lambda t, x, f: (x, put(f, slice(7, None), f[:-7].copy())),
    "sign force": lambda t, x, f: (x, -f),
}
"""Kind and signal of a fault -> position and force with it."""


@pytest.mark.parametrize("fault", sampled(CHANGES, of=2))
def test_the_fault_alone_is_found(long: tuple[Array, Array, Array], fault: str) -> None:
    t, x, force = long
    x, force = CHANGES[fault](t, x.copy(), force.copy())
    found = Dataset.of(t=t, x=x, force=force).check()
    assert [f"{f.kind} {f.signal}" for f in found] == [fault] * bool(fault), str(found)
    if fault in ("spikes force", "frozen x"):
        assert found[0].begin == pytest.approx(STEP * INSIDE)
    if fault == "delay force":
        assert "by about 0.007 s (7 samples)" in found[0].sentence


def test_blocks_are_even_and_disjoint() -> None:
    parts = blocks(N)
    assert len(parts) == BLOCKS and {p.stop - p.start for p in parts} == {LONG // BLOCKS + 1}
    assert (parts[0].start, parts[-1].stop) == (0, N)
    assert all(a.stop <= b.start for a, b in pairwise(parts))
    assert not any(p.start <= INSIDE < p.stop for p in parts)
    assert blocks(LONG) == [slice(0, LONG)]
