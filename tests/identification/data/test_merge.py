"""Two recorders with a known shift between their clocks."""

from collections.abc import Callable

import numpy as np
import pytest

from identification.data.dataset import Dataset
from identification.data.merge import estimated_delay

Array = np.ndarray
Signal = Callable[[Array], Array]


def lively(seed: int) -> Signal:
    """Twelve sines of up to 2.5 Hz."""
    rng = np.random.default_rng(seed)
    size, w, phase = rng.normal(size=12), 2 * np.pi * rng.uniform(0.1, 2.5, 12), rng.random(12) * 6
    return lambda t: (size[:, None] * np.sin(w[:, None] * t + phase[:, None])).sum(0)


def pair(
    f: Signal,
    shift: float,
    rates: tuple[float, float] = (500.0, 500.0),
    drift: float = 0.0,
    noise: float = 0.0,
    gain: float = 1.0,
    end: float = 20.0,
    gap: tuple[float, float] = (0.0, 0.0),
) -> tuple[Dataset, Dataset]:
    """What two recorders write: y of both, z = cos 3 t (true time) of the second."""
    rng = np.random.default_rng(1)
    t, true = np.arange(0, end, 1 / rates[0]), np.arange(0.3, end - 0.2, 1 / rates[1])
    true = true[(true <= gap[0]) | (true >= gap[1])]
    clock = true - shift - drift * (true - t.mean())
    second = gain * f(true) + 3 + noise * rng.standard_normal(true.size)
    return (
        Dataset.of(t=t, x=f(t) + noise * rng.standard_normal(t.size), name="a"),
        Dataset.of({"t": clock, "y": second, "z": np.cos(3 * true)}, name="b"),
    )


@pytest.mark.parametrize(
    ("rates", "noise", "error"),
    [((1000, 1000), 0.0, 1e-4), ((1000, 137), 0.0, 1e-3), ((100, 1000), 0.0, 1e-3),
     ((500, 200), 0.1, 0.12)],
)  # fmt: skip
def test_shift_is_found_to_a_fraction_of_a_sample(
    rates: tuple[float, float], noise: float, error: float
) -> None:
    for seed, shift in enumerate((7.123456, -3.33333)):
        first, second = pair(lively(seed), shift, rates, noise=noise, gain=2.0)
        found = estimated_delay(first[0], second[0], ("x", "y"), drift=False)
        assert abs(found.shift - shift) * min(rates) < error
        assert abs(found.shift - shift) < 4 * found.shift_error
        record = first.merged(second, on=("x", "y"))[0]
        slack = 3 * abs(found.shift - shift) + 5e-4
        assert np.abs(record["z"] - np.cos(3 * record.time)).max() < slack


def test_drift_of_the_clocks_is_refused_or_estimated() -> None:
    first, second = pair(lively(1), 0.7654, (500, 200), drift=2e-4, noise=0.02, end=60.0)
    with pytest.raises(
        ValueError, match=r"got a drift of 20\d ppm, 0\.012 s over the record; pass"
    ):
        first.merged(second, on=("x", "y"))
    record = first.merged(second, on=("x", "y"), drift="estimate")[0]
    assert np.abs(record["z"] - np.cos(3 * record.time)).max() < 1e-3


@pytest.mark.parametrize(
    ("f", "noise", "gain", "message"),
    [
        (lambda t: np.sin(5 * t), 0.01, 1.0, "expected one delay, got a second one .* s away"),
        (
            lambda t: t,
            0.01,
            1.0,
            "expected signals that determine their delay, got .* shifts of 0.002",
        ),
        (lively(1), 3.0, 1.0, "expected two recordings of one quantity, got a correlation of"),
        (lambda t: np.sin(0.3 * t * t), 0.0, -1.0, "one of them has the opposite sign"),
        (lambda t: 0 * t, 0.0, 1.0, "expected a signal 'x' that changes"),
    ],
)
def test_what_tells_no_delay_is_refused(f: Signal, noise: float, gain: float, message: str) -> None:
    first, second = pair(f, 0.1, noise=noise, gain=gain)
    with pytest.raises(ValueError, match=message):
        first.merged(second, on=("x", "y"))
    assert len(first.merged(second, on=("x", "y"), shift=0.1)) == 1


def test_gaps_split_the_merged_record() -> None:
    first, second = pair(lively(1), 0.1, gap=(5.0, 6.0))
    data = first.merged(second, on=("x", "y"))
    assert [round(float(r.time[-1]), 1) for r in data] == [5.0, 19.8]
    for record in data:
        np.testing.assert_allclose(record["z"], np.cos(3 * record.time), atol=2e-5)


def test_names_and_times_must_fit() -> None:
    first, second = pair(lively(0), 0.1)
    with pytest.raises(ValueError, match="signals of different names, got x in both"):
        first.merged(second.renamed({"z": "x"}), on=("x", "y"))
    with pytest.raises(ValueError, match="expected a common time of both"):
        first.merged(second, on=("x", "y"), shift=100.0)
    with pytest.raises(ValueError, match="expected a signal 'q', got x"):
        first.merged(second, on=("q", "y"))
    same = first.merged(second.renamed({"y": "x"}), on=("x", "x"))[0]
    assert list(same.signals) == ["x", "z"]
