"""Rows in which a channel has no number: refused with the way out, or left out on request."""

from pathlib import Path

import numpy as np
import pytest

from identification.data.dataset import Dataset

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
