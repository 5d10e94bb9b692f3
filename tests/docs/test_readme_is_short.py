"""The README is one look."""

from pathlib import Path


def test_the_readme_has_at_most_130_lines() -> None:
    assert len((Path(__file__).parents[2] / "README.md").read_text("utf-8").splitlines()) <= 130
