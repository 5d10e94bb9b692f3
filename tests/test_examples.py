"""Every example runs as it stands, headless, from anywhere, and leaves pictures."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

EXAMPLES = sorted((Path(__file__).parents[1] / "examples").glob("*.py"))


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.stem)
def test_example_runs_and_leaves_a_picture(example: Path, tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-W", "error", str(example), "results"],
        cwd=tmp_path,
        env=os.environ | {"MPLBACKEND": "Agg"},
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    pictures = list((tmp_path / "results").glob("*.png"))
    assert pictures
    assert all(picture.read_bytes().startswith(b"\x89PNG") for picture in pictures)


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.stem)
def test_example_is_short(example: Path) -> None:
    assert len(example.read_text(encoding="utf-8").splitlines()) < 120


def test_the_stick_slip_example_brackets_the_closed_form(tmp_path: Path) -> None:
    example = next(path for path in EXAMPLES if path.stem == "rabinowicz")
    done = subprocess.run(
        [sys.executable, str(example), str(tmp_path)],
        env=os.environ | {"MPLBACKEND": "Agg"},
        capture_output=True,
        text=True,
        check=True,
    )
    rows = [line.split("│")[1:3] for line in done.stdout.splitlines() if "│" in line]
    period = {name.strip(): float(value) for name, value in rows}
    assert period["LuGre"] < 6.069995 < period["Brown-McPhee"]
    assert period["Brown-McPhee"] - period["LuGre"] < 0.2
