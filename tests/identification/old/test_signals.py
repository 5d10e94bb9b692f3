from dataclasses import replace

import numpy as np
import pytest

from identification import Dataset, Filter, differentiate
from identification.old.signals import filter_of

T = np.arange(4001) * 1e-3
W = 2 * np.pi * 1.5
WAVE = Dataset("wave", T, np.sin(W * T), np.cos(W * T))


def test_velocity_and_acceleration_of_a_sine() -> None:
    found = differentiate(WAVE, Filter(100.0, 5))
    np.testing.assert_allclose(found.v, W * np.cos(W * found.t), atol=1e-4 * W)
    np.testing.assert_allclose(found.a, -(W**2) * np.sin(W * found.t), atol=1e-3 * W**2)


def test_measured_velocity_is_used() -> None:
    found = differentiate(replace(WAVE, v=7 * np.cos(W * T)), Filter(100.0, 5))
    np.testing.assert_allclose(found.v, 7 * np.cos(W * found.t), atol=1e-3)
    np.testing.assert_allclose(found.a, -7 * W * np.sin(W * found.t), atol=1e-2)


def test_ends_are_cut_by_five_filter_times() -> None:
    found = differentiate(WAVE, Filter(100.0, 5))
    assert (found.t[0], found.t[-1]) == (T[50], T[-51])


def test_slow_equations_are_left_out() -> None:
    kept = differentiate(WAVE, Filter(100.0, 5, v_min=0.5))
    every = differentiate(WAVE, Filter(100.0, 5))
    assert 0 < kept.kept.size < every.kept.size
    speed = np.abs(W * np.cos(W * kept.times))
    assert speed.min() > 0.5
    lost = np.setdiff1d(every.times, kept.times)
    near = np.arcsin(0.5 / W) / W + 2 * 5e-3
    assert np.abs(np.cos(W * lost)).max() < np.sin(W * near) + 0.01


def test_equations_and_matrix_are_the_same_map() -> None:
    found = differentiate(WAVE, Filter(100.0, 5, v_min=0.5))
    np.testing.assert_allclose(
        (found.matrix @ found.force).full().ravel(), found.equations(found.force), atol=1e-13
    )


def test_filter_of_the_record_wins() -> None:
    own = Filter(33.0, 3)
    assert filter_of(replace(WAVE, filter=own)) is own


@pytest.mark.parametrize(
    ("data", "filter", "message"),
    [
        (
            WAVE,
            Filter(100.0, 300),
            r"data 'wave': expected enough samples.*decimation 300.*got 4001",
        ),
        (WAVE, Filter(100.0, 5, v_min=99.0), "lower the decimation or v_min"),
        (WAVE, Filter(1.0, 5), "raise the cut-off"),
        (replace(WAVE, t=T**1.1), None, "expected equal intervals"),
    ],
)
def test_records_too_short_or_uneven_are_refused(
    data: Dataset, filter: Filter | None, message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        differentiate(data, filter)
