"""Two recorders with a known shift between their clocks."""

import numpy as np
import pytest
from recorders import Signal, lively, pair

from identification.data.merge import estimated_delay

Array = np.ndarray


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
    with pytest.raises(ValueError, match=r"a drift of 20\d ppm, 0\.012 s over the record; pass"):
        first.merged(second, on=("x", "y"))
    record = first.merged(second, on=("x", "y"), drift="estimate")[0]
    assert np.abs(record["z"] - np.cos(3 * record.time)).max() < 1e-3


@pytest.mark.parametrize(("f", "noise", "gain", "message"), [
    (lambda t: np.sin(5 * t), 0.01, 1.0, "expected one delay, got a second one .* s away"),
    (lambda t: t, 0.01, 1.0, "expected signals that determine their delay, got .* shifts of 0.002"),
    (lively(1), 3.0, 1.0, "expected two recordings of one quantity, got a correlation of"),
    (lambda t: np.sin(0.3 * t * t), 0.0, -1.0, "one of them has the opposite sign"),
    (lambda t: 0 * t, 0.0, 1.0, "expected a signal 'x' that changes"),
])  # fmt: skip
def test_undetermined_delays_are_refused(
    f: Signal, noise: float, gain: float, message: str
) -> None:
    first, second = pair(f, 0.1, noise=noise, gain=gain)
    with pytest.raises(ValueError, match=message):
        first.merged(second, on=("x", "y"))
    assert len(first.merged(second, on=("x", "y"), shift=0.1)) == 1


def test_neighbouring_samples_count_as_one_in_short_records() -> None:
    """The smoothing makes samples dependent, so a short record determines its delay less well."""
    first, second = pair(lambda t: np.sin(t * (t + 2) / 2), 0.1, noise=0.008, end=1.2)
    with pytest.raises(ValueError, match=r"signals that determine their delay, got 5\d sh"):
        first.merged(second, on=("x", "y"))


def test_gaps_split_the_merged_record() -> None:
    first, second = pair(lively(1), 0.1, gap=(5.0, 6.0))
    data = first.merged(second, on=("x", "y"))
    assert [round(float(r.time[-1]), 1) for r in data] == [5.0, 19.8]
    for record in data:
        np.testing.assert_allclose(record["z"], np.cos(3 * record.time), atol=2e-5)


def test_names_and_times_must_fit() -> None:
    first, second = pair(lively(0), 0.1)
    same = first.merged(second.renamed({"y": "x"}), on=("x", "x"))[0]
    assert list(same.signals) == ["x", "z"]
