from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from identification import Dataset, read_data

T = np.linspace(0.0, 1.0, 101)
X = np.sin(3 * T)
F = np.cos(3 * T)


def record(**changes: object) -> Dataset:
    return Dataset(**{"name": "log", "t": T, "x": X, "force": F} | changes)  # type: ignore[arg-type]


def spoilt(values: np.ndarray, k: int, value: float) -> np.ndarray:
    copy = values.copy()
    copy[k] = value
    return copy


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (
            {"x": X[:-1]},
            r"data 'log': expected columns of one length, got t: \(101,\), x: \(100,\)",
        ),
        ({"v": X[:7]}, r"one length.*v: \(7,\)"),
        ({"x": spoilt(X, 7, np.nan)}, "column x, sample 7: expected a finite number, got nan"),
        ({"force": spoilt(F, 5, np.inf), "first_row": 2}, "column force, row 7: expected a finite"),
        ({"t": spoilt(T, 9, 0.0)}, "column t, sample 9: expected increasing times, got 0 s after"),
        ({"x": 0 * X + 0.25}, "column x: expected a signal that changes, got 0.25 m throughout"),
        ({"force": 0 * F}, "column force: expected a signal that changes, got 0 N throughout"),
        ({"t": T[:9], "x": X[:9], "force": F[:9]}, "expected at least 50 samples, got 9"),
    ],
)
def test_bad_record_is_refused_with_its_place(changes: dict[str, object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        record(**changes)


def test_all_bad_columns_are_named_at_once() -> None:
    with pytest.raises(ValueError, match=r"column x, sample 3.*column force, sample 4"):
        record(x=spoilt(X, 3, np.nan), force=spoilt(F, 4, np.nan))


def test_uneven_samples_are_refused_with_the_way_out() -> None:
    uneven = record(t=spoilt(T, 40, T[40] + 0.002), first_row=2)
    with pytest.raises(ValueError, match=r"column t, row 42: .*Dataset\.resampled"):
        uneven.uniform()


def test_small_jitter_counts_as_uniform() -> None:
    jittered = record(t=T + 2e-5 * np.sin(17 * T))
    assert jittered.uniform() is jittered


def test_resampling_is_of_third_order_in_the_position() -> None:
    errors: list[float] = []
    for n in (200, 400, 800):
        u = np.linspace(0.0, 1.0, n)
        t = u + 0.05 * np.sin(2 * np.pi * u)
        even = record(t=t, x=np.sin(3 * t), force=np.cos(3 * t)).resampled(1 / 997)
        assert np.ptp(np.diff(even.t)) < 1e-12
        inside = slice(20, -20)
        errors.append(float(np.abs(even.x - np.sin(3 * even.t))[inside].max()))
    assert errors[0] / errors[1] == pytest.approx(8, rel=0.35)
    assert errors[1] / errors[2] == pytest.approx(8, rel=0.35)


def test_resampling_step_must_be_positive() -> None:
    with pytest.raises(ValueError, match=r"resampled: step: expected a number > 0 \[s\], got -1"):
        record().resampled(-1)


def test_csv_holds_every_digit(tmp_path: Path) -> None:
    written = replace(record(), v=F * np.pi)
    written.to_csv(tmp_path / "log.csv")
    back = read_data(tmp_path / "log.csv")
    for key, values in written.signals().items():
        np.testing.assert_array_equal(back.signals()[key], values)
