"""Texts of options: what they mean and what is refused."""

from pathlib import Path

import pytest

from symfric.cli.options import any_with, assignments, check_folder, check_outputs, numbers
from symfric.foundation.parameters import parameters


def test_assignments_keep_text_after_the_first_equals_sign() -> None:
    assert assignments("--input", ["force = a=b.csv:f"]) == {"force": "a=b.csv:f"}


def test_numbers_are_floats_by_name() -> None:
    assert numbers("--set", ["mu_s=2e-1", "m=3"]) == {"mu_s": 0.2, "m": 3.0}


def test_nothing_given_is_nothing_set() -> None:
    assert numbers("--set", None) == {}


@pytest.mark.parametrize("text", ["mu_s", "=1", "mu_s=", ""])
def test_an_assignment_needs_name_and_value(text: str) -> None:
    with pytest.raises(ValueError, match="expected NAME=VALUE"):
        assignments("--set", [text])


def test_set_reaches_the_terms_of_a_sum() -> None:
    law = any_with("coulomb+viscous", ["sigma_2=7"])
    assert parameters(law)["sigma_2"].value == 7.0


def test_outputs_that_can_be_made_pass(tmp_path: Path) -> None:
    check_outputs(tmp_path / "new" / "x.csv", "-", None, picture=tmp_path / "x.PNG")
    assert list(tmp_path.iterdir()) == []


def test_a_file_cannot_hold_files(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(ValueError, match="got the file"):
        check_folder(tmp_path / "file" / "below")
