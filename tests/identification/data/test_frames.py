"""Columns held in Python, and rows in which a channel has no number."""

from pathlib import Path
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


GERMAN = """Messung;;;
Zeit;Winkel;Moment;Bemerkung
s;°;Nm;
0,00;0,0;1,0;
0,01;90,0;;Stoss
0,02;180,0;3,0;
0,03;;4,0;
0,04;360,0;5,0;
"""
NAMES = {"t": "Zeit", "x": "Winkel", "force": "Moment"}


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "messung.csv"
    path.write_text(GERMAN, "latin-1")
    return path


def test_rows_without_a_number_are_left_out_with_their_times(file: Path) -> None:
    (found,) = Dataset.read(file, columns=NAMES, missing="drop")
    assert found.t is not None
    np.testing.assert_array_equal(found.t, [0.0, 0.02, 0.04])
    np.testing.assert_allclose(found["x"], [0.0, np.pi, 2 * np.pi], rtol=1e-15)
    np.testing.assert_array_equal(found["force"], [1.0, 3.0, 5.0])
    assert "Bemerkung" in found.left_out  # nobody asked for it, so its gaps cost no row


def test_the_error_names_cell_and_way_out(file: Path) -> None:
    with pytest.raises(ValueError, match=r"row 7: expected a number, got ''.*missing='drop'"):
        Dataset.read(file, columns=NAMES)


def test_the_time_is_suggested_by_its_unit(file: Path) -> None:
    with pytest.raises(ValueError, match=r"columns=\{'t': 'Zeit'\} \(--column t=Zeit\)"):
        Dataset.read(file)


def test_a_file_whose_columns_are_all_left_out_says_why(file: Path) -> None:
    with pytest.raises(ValueError, match=r"got none: column 'Winkel', row 7: .*column 'Moment'"):
        Dataset.read(file, columns={"t": "Zeit"})


def test_what_is_no_number_is_not_missing(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    path.write_text("t [s],x [m],force [N]\n0,0,1\n1,,2\n2,3,error\n3,4,5\n")
    with pytest.raises(ValueError, match=r"row 4: expected a number, got 'error'"):
        Dataset.read(path, missing="drop")
    path.write_text("t [s],x [m],force [N]\n0,0,1\n1,,2\n2,3,inf\n3,4,5\n")
    with pytest.raises(ValueError, match="expected a finite number, got inf"):
        Dataset.read(path, missing="drop")


def test_samples_of_a_step_keep_their_times() -> None:
    x = np.array([0.0, np.nan, 2.0, 3.0])
    (found,) = Dataset.of(x=x, force=x + 1, step=0.5, missing="drop")
    np.testing.assert_array_equal(found.t, [0.0, 1.0, 1.5])


def test_no_row_with_numbers_is_an_error() -> None:
    bad = [np.nan, 1.0], [1.0, np.nan]
    with pytest.raises(ValueError, match="expected a row with numbers in 'x', 'force', got none"):
        Dataset.of(t=[0.0, 1.0], x=bad[0], force=bad[1], missing="drop")


def test_unknown_words_are_refused() -> None:
    with pytest.raises(ValueError, match="missing: expected one of refuse, drop"):
        Dataset.of(t=[0.0], x=[1.0], missing="skip")  # pyright: ignore[reportArgumentType]


TWICE = "t [s],x [m],force [N]\n0,0,1\n1,1,2\n1,1,2\n2,1,2\n3,4,5\n"


def test_rows_written_twice_are_left_out_and_standstill_stays(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    path.write_text(TWICE)
    (found,) = Dataset.read(path, missing="drop")
    np.testing.assert_array_equal(found.time, [0.0, 1.0, 2.0, 3.0])
    np.testing.assert_array_equal(found["x"], [0.0, 1.0, 1.0, 4.0])  # at rest is not twice


@pytest.mark.parametrize(
    ("rows", "way_out"),
    [
        (TWICE, r"row 4: .*missing='drop' \(--missing drop\) leaves out repeated rows"),
        (TWICE.replace("1,1,2\n1,1,2", "1,1,2\n1,2,2"), r"row 4: .*clock is too coarse, .*step="),
        (TWICE.replace("1,1,2\n1,1,2", "1,1,2\n0.5,1,2"), r"got 0.5 s after 1 s \(1 such rows\)$"),
    ],
)
def test_times_that_stand_still_say_what_to_do(tmp_path: Path, rows: str, way_out: str) -> None:
    path = tmp_path / "run.csv"
    path.write_text(rows)
    with pytest.raises(ValueError, match=way_out):
        Dataset.read(path)
