"""Inputs from numbers and CSV columns."""

from pathlib import Path

import numpy as np
import pytest

from symfric import Linear
from symfric.cli.inputs import input_from_text, read_column


def write(folder: Path, text: str) -> Path:
    path = folder / "f.csv"
    path.write_text(text, encoding="utf-8")
    return path


def test_a_number_is_a_constant() -> None:
    assert input_from_text("force", "-2.5") == -2.5


def test_a_column_is_read_by_name_with_or_without_unit(tmp_path: Path) -> None:
    path = write(tmp_path, "t [s],x [m],force [N]\n0,9,1\n0.5,9,2\n\n2,9,-4\n")
    for name in ("force", "force [N]"):
        samples = input_from_text("force", f"{path}:{name}")
        assert isinstance(samples, Linear)
        np.testing.assert_array_equal(samples.t, [0, 0.5, 2])
        np.testing.assert_array_equal(samples.values, [1, 2, -4])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("t [s],force [N]\n0,1\n1,x\n", "line 3, column force: expected a finite number, got 'x'"),
        ("t [s],force [N]\n0,1\n1\n", "line 3, column force: expected a finite number, got ''"),
        ("t [s],force [N]\n0,1\n0,2\n", "expected increasing times"),
        ("t [s],force [N]\n", "got only a header"),
        ("time,force\n0,1\n", "got t;"),
        ("t,forces\n0,1\n", "did you mean forces"),
        ("", "got t, force"),
    ],
)
def test_files_that_cannot_be_used_are_refused_with_the_place(
    tmp_path: Path, text: str, message: str
) -> None:
    with pytest.raises(ValueError) as error:
        read_column(write(tmp_path, text), "force")
    assert message in str(error.value)


@pytest.mark.parametrize("text", ["two", "file.csv", "file.csv:", ":force"])
def test_other_texts_are_refused(text: str) -> None:
    with pytest.raises(ValueError, match=r"expected a number or FILE\.csv:COLUMN"):
        input_from_text("force", text)
