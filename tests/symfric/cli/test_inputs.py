"""Inputs from numbers and CSV columns."""

from pathlib import Path

import numpy as np
import pytest

from symfric import Linear
from symfric.cli.machines import input_from_text, read_column


def write(folder: Path, text: str) -> Path:
    path = folder / "f.csv"
    path.write_text(text, encoding="utf-8")
    return path


def test_a_number_is_a_constant() -> None:
    assert input_from_text("force", "-2.5", "N") == -2.5


def test_units_of_the_header_become_si(tmp_path: Path) -> None:
    """4f644ad read milliseconds as seconds and kilonewtons as newtons."""
    path = write(tmp_path, "t [ms];u [kN];torque [mN m]\n0;1;2000\n500;2;4000\n")
    samples = input_from_text("force", f"{path}:u", "N")
    assert isinstance(samples, Linear)
    np.testing.assert_allclose(samples.t, [0, 0.5])
    np.testing.assert_allclose(samples.values, [1000, 2000])
    torque = input_from_text("tau", f"{path}:torque", "N m")
    assert isinstance(torque, Linear)
    np.testing.assert_allclose(torque.values, [2, 4])


def test_a_column_is_read_by_name_with_or_without_unit(tmp_path: Path) -> None:
    path = write(tmp_path, "t [s],x [m],force [N]\n0,9,1\n0.5,9,2\n\n2,9,-4\n")
    for name in ("force", "force [N]"):
        samples = input_from_text("force", f"{path}:{name}", "N")
        assert isinstance(samples, Linear)
        np.testing.assert_array_equal(samples.t, [0, 0.5, 2])
        np.testing.assert_array_equal(samples.values, [1, 2, -4])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("t [s],force [N]\n0,1\n1,x\n", "column 'force [N]', row 3: expected a number, got 'x'"),
        ("t [s],force [N]\n0,1\n1\n", "column 'force [N]', row 3: expected a number, got ''"),
        ("t [s],force [N]\n0,1\n0,2\n", "expected increasing times"),
        ("t [s],force [N]\n", "t: expected increasing times [s], got none"),
        ("time,force\n0,nan\n", "values: expected finite numbers, got nan at 0"),
        ("t,forces\n0,1\n", "expected a column 'force [N]', got t, forces; check the header"),
        ("", "got an empty file"),
        ("t,force,force\n0,1,2\n", "expected one column for force, got 'force', 'force'"),
        (
            "t,force [m]\n0,1\n",
            "column 'force [m]': expected a unit of N, mN, kN in brackets, got m",
        ),
        ("t,force\n0,1,5\n", "row 2: expected 2 cells as in the header, got 3; write numbers with"),
        (f"t,force\n0,{'1' * 200_000}\n", "expected rows of short cells, got field larger"),
    ],
)
def test_files_that_cannot_be_used_are_refused_with_the_place(
    tmp_path: Path, text: str, message: str
) -> None:
    with pytest.raises(ValueError) as error:
        read_column(write(tmp_path, text), "force", "N")
    assert message in str(error.value)


@pytest.mark.parametrize("text", ["two", "file.csv", "file.csv:", ":force"])
def test_other_texts_are_refused(text: str) -> None:
    with pytest.raises(ValueError, match=r"expected a number or FILE\.csv:COLUMN"):
        input_from_text("force", text, "N")
