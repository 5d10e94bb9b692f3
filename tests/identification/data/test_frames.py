"""Columns held in Python; a frame is what looks like one (pandas is no dependency)."""

from typing import Any

import numpy as np
import pytest

from identification.data.dataset import Dataset

T = np.arange(100) / 100


class Frame:
    """What pandas and polars have in common."""

    def __init__(self, columns: dict[str, Any]) -> None:
        self.columns = list(columns)
        self._held = columns

    def __getitem__(self, key: str) -> Any:
        return self._held[key]


def test_arrays_are_si_unless_they_say_more() -> None:
    record = Dataset.of(t=T, x=list(T), force=T[:, None], name="rig")[0]
    assert (record.name, record.unit("x"), record.unit("force")) == ("rig", "m", "N")
    record = Dataset.of({"t [ms]": T, "x": T, "tau_1 [N mm]": T}, units="deg, N m")[0]
    np.testing.assert_allclose(record.time, 1e-3 * T)
    np.testing.assert_allclose(record["x"], T * np.pi / 180)
    np.testing.assert_allclose(record["tau_1"], 1e-3 * T)


def test_frames_are_taken_by_their_columns() -> None:
    frame = Frame({"time [s]": T, "q [deg]": T, "tau [N m]": T, "mode": np.array(["on"] * 100)})
    record = Dataset.of(frame)[0]
    np.testing.assert_allclose(record["x"], T * np.pi / 180)
    assert record.left_out["mode"].startswith("sample 0: expected a number")
    stamps = np.datetime64("2026-05-01T12:00:00") + (1000 * T).astype("timedelta64[ms]")
    record = Dataset.of(Frame({"time": stamps, "q": T, "tau": T}), units="rad, N m")[0]
    np.testing.assert_allclose(record.time, T, atol=1e-9)


@pytest.mark.parametrize(
    ("frame", "arrays", "message"),
    [
        (3, {}, r"arrays by name or a frame, got 3; write Dataset.of\(t=t"),
        (None, {}, "expected columns such as t="),
        (None, {"t": T, "x": T[:5]}, "columns of one length, got t: 100, x: 5"),
        (None, {"t": T, "x": "abc"}, "x: expected a vector of numbers, got 'abc'"),
        (None, {"t": T, "x": T * np.nan}, r"'x', sample 0: .*finite number, got nan \(100 such"),
        (None, {"x": T}, "expected a column of time"),
        ({"t": T}, {"t": T}, "expected every column once, got t, t"),
        (Frame({"t [s]": T, "x": T}), {}, "data 'data': column 'x': .*got none; pass units"),
        (None, {"t": T[::-1], "x": T}, "column t, sample 1: expected increasing times"),
    ],
)
def test_what_is_none_is_told(frame: Any, arrays: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Dataset.of(frame, **arrays)


def test_masked_samples_were_not_measured() -> None:
    with pytest.raises(
        ValueError, match=r"column 'x', sample 1: expected a finite number, got nan"
    ):
        Dataset.of(t=[0, 1, 2], x=np.ma.array([1, 2, 3], mask=[0, 1, 0]))
    whole = Dataset.of(t=[0, 1, 2], x=np.ma.array([1, 2, 3]))
    assert whole[0]["x"].tolist() == [1.0, 2.0, 3.0]
