"""Numbers with more digits than they deserve are found, others are let alone."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import pytest
from steady import NUDGES, Piece, findings, printed, runs_of, unit

from docs.machine.pages import ROOT, written_pages
from symfric import LuGre, rabinowicz, simulate

HERE, BITS, LOOSER = "as it is", "last bits", "rtol + 4 %"


def piece(text: str, *values: tuple[str, float]) -> Piece:
    return Piece("code", text, "x 1.234 m, 634 steps", values)


def differences(one: Piece, other: Piece, under: str) -> Sequence[str]:
    return [found.what for found in findings("page", {HERE: [one], under: [other]})]


def test_a_changed_number_is_reported_and_a_changed_count_only_under_rounding() -> None:
    good = piece("x 1.234 m, 634 steps")
    assert differences(good, good, BITS) == []
    assert differences(good, piece("x 1.235 m, 634 steps"), LOOSER) == ["1.234 is 1.235"]
    assert differences(good, piece("x 1.234 m, 640 steps"), LOOSER) == []
    assert differences(good, piece("x 1.234 m, 640 steps"), BITS) == ["634 is 640"]
    below = Piece("code", "-634 steps", "-634 steps", ())
    assert differences(below, replace(below, printed="-640 steps"), LOOSER) == []
    assert differences(good, piece("x -0.0 m"), BITS) == ["the text of a block is another"]


def test_a_number_close_to_changing_is_reported_with_its_value() -> None:
    text = "x 1.234 m, 634 steps"
    inside, moved = piece(text, ("1.234", 1.2340)), piece(text, ("1.234", 1.2341))
    assert differences(inside, moved, LOOSER) == []
    edge, near = piece(text, ("1.234", 1.23445)), piece(text, ("1.234", 1.23441))
    (found,) = findings("page", {HERE: [edge], LOOSER: [near]})
    assert found.moved == pytest.approx(0.04) and found.room == pytest.approx(0.05)
    farther = piece(text, ("1.234", 1.2344))
    runs = {HERE: [edge], LOOSER: [farther], BITS: [near]}
    assert [(f.moved, f.under) for f in findings("page", runs)] == [(pytest.approx(0.05), LOOSER)]
    unseen = Piece("code", text, "x 1.2... m, 634 steps", edge.values)
    assert differences(unseen, near, LOOSER) == []


def test_the_value_of_the_last_digit_follows_the_text() -> None:
    assert [unit(t) for t in ("12", "1.50", "2e-05", "1.5e+3")] == [1, 0.01, 1e-5, 100]


def test_tolerances_of_a_page_are_nudged_and_what_it_formats_is_heard(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text(
        "```python\nfrom symfric import LuGre, rabinowicz, simulate\n"
        "run = simulate(rabinowicz(LuGre()), 5.0, backend='vm')\n"
        "print(f'{run.final[\"x\"]:.3f} {run.statistics.steps} {run.scene!r} {1.5:>6.2f}')\n```\n"
        "```text\n0.500 ...\n```\n"
        "```python\nprint(f'{2.5:.1f}')\n```\n"
    )
    (plain, second), (other, _) = (printed(page, factor) for factor in (1.0, 0.5))
    assert second.values == (("2.5", 2.5),)
    run = simulate(rabinowicz(LuGre()), 5.0, backend="vm")
    assert plain.printed == f"{run.final['x']:.3f} {run.statistics.steps} 'rabinowicz'   1.50\n"
    assert plain.values == ((f"{run.final['x']:.3f}", run.final["x"]), ("1.50", 1.5))
    assert int(other.printed.split()[1]) > run.statistics.steps


@pytest.mark.slow
@pytest.mark.parametrize(
    "page", list(written_pages()), ids=lambda page: str(page.relative_to(ROOT))
)
def test_every_number_of_every_page_is_steady(page: Path) -> None:
    assert len(NUDGES) >= 5
    assert not [str(found) for found in findings(page.name, runs_of(page))]
