"""What laws show, those inside others included."""

from typing import Any

import pytest

from symfric import LuGre, figure, law_from_text
from symfric.figures.requirements import phenomena, require


def test_a_composed_law_shows_what_its_parts_show_in_the_order_of_the_list() -> None:
    assert phenomena(law_from_text("maxwell_slip+viscous")) == ["D", "V", "P", "M", "N"]


def test_one_of_the_phenomena_is_enough() -> None:
    require("drift", law_from_text("dahl"), "S", "P")
    with pytest.raises(ValueError, match=r"static friction .* or pre-sliding displacement, got"):
        require("drift", law_from_text("coulomb+viscous"), "S", "P")


def test_arguments_of_a_figure_that_changed_places_are_named() -> None:
    cases: tuple[tuple[Any, Any, str], ...] = (
        ("hysteresis", LuGre(), r"write figure\(law, 'hysteresis'\)"),
        ("lugre", "hysteresis", r"figure: expected a law .*law_from_text\('lugre'\) makes one"),
        (LuGre, "hysteresis", r"write LuGre\(\) with parentheses"),
        (LuGre(), 3, "figure: name: expected a text, got 3"),
        (LuGre(), "hysterese", "did you mean hysteresis"),
    )
    for law, name, said in cases:
        with pytest.raises(ValueError, match=said):
            figure(law, name)
