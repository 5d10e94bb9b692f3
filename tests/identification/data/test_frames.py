"""Columns held in Python, and rows in which a channel has no number."""

from pathlib import Path

import numpy as np
import pytest
from recorders import GERMAN, Frame

from identification.data.dataset import Dataset

T = np.arange(100) / 100


def test_arrays_are_si_unless_units_are_given() -> None:
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
    for absent in (0, 7):
        stamps[absent] = "NaT"
        record = Dataset.of(time=stamps, x=T, force=T, missing="drop")[0]
        np.testing.assert_allclose(record.time, record["x"] - record["x"][0], atol=1e-9)


def test_masked_samples_were_not_measured() -> None:
    whole = Dataset.of(t=[0, 1, 2], x=np.ma.array([1, 2, 3]))
    assert whole[0]["x"].tolist() == [1.0, 2.0, 3.0]


NAMES = {"t": "Zeit", "x": "Winkel", "force": "Moment"}


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "messung.csv"
    path.write_text(GERMAN, "latin-1")
    return path


def test_rows_without_a_number_are_left_out_with_their_times(file: Path) -> None:
    (found,) = Dataset.read(file, columns=NAMES, missing="drop")
    np.testing.assert_array_equal(found.t, [0.0, 0.02, 0.04])
    np.testing.assert_allclose(found["x"], [0.0, np.pi, 2 * np.pi], rtol=1e-15)
    np.testing.assert_array_equal(found["force"], [1.0, 3.0, 5.0])
    assert "Bemerkung" in found.left_out  # not requested, so its gaps remove no row


def test_samples_of_a_step_keep_their_times() -> None:
    x = np.array([0.0, np.nan, 2.0, 3.0])
    (found,) = Dataset.of(x=x, force=x + 1, step=0.5, missing="drop")
    np.testing.assert_array_equal(found.t, [0.0, 1.0, 1.5])


TWICE = "t [s],x [m],force [N]\n0,0,1\n1,1,2\n1,1,2\n2,1,2\n3,4,5\n"


def test_duplicate_rows_are_left_out_and_standstill_stays(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    path.write_text(TWICE)
    (found,) = Dataset.read(path, missing="drop")
    np.testing.assert_array_equal(found.time, [0.0, 1.0, 2.0, 3.0])
    np.testing.assert_array_equal(found["x"], [0.0, 1.0, 1.0, 4.0])  # at rest is not twice
