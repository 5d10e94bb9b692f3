"""What laws show, those inside others included."""

from typing import Any

import pytest

from symfric import LuGre, QuarterCarGeneral, figure, law_from_text
from symfric.figures.data import phenomena, require


def test_a_composed_law_shows_what_its_parts_show_in_the_order_of_the_list() -> None:
    assert phenomena(law_from_text("maxwell_slip+viscous")) == ["D", "V", "P", "M", "N"]


def test_one_of_the_phenomena_is_enough() -> None:
    require("drift", law_from_text("dahl"), "S", "P")
    with pytest.raises(ValueError, match=r"static friction .* or pre-sliding displacement, got"):
        require("drift", law_from_text("coulomb+viscous"), "S", "P")


def test_arguments_of_a_figure_that_changed_places_are_named() -> None:
    cases: tuple[tuple[Any, Any, str], ...] = (
        ("hysteresis", LuGre(), r"write figure\(law, 'hysteresis'\)"),
        ("lugre", "hysteresis", r"figure: expected a law .*use law_from_text\('lugre'\)"),
        (LuGre, "hysteresis", r"write LuGre\(\) with parentheses"),
        (LuGre(), 3, "figure: name: expected a text, got 3"),
        (LuGre(), "hysterese", "did you mean hysteresis"),
    )
    for law, name, said in cases:
        with pytest.raises(ValueError, match=said):
            figure(law, name)


def test_a_law_that_needs_more_than_a_block_has_is_told_so() -> None:
    with pytest.raises(
        ValueError, match=r"drift of quarter_car_general: .* x_rel, v_rel; a figure of"
    ):
        figure(QuarterCarGeneral(), "drift")
    assert figure(QuarterCarGeneral(), "profile").curves


@pytest.mark.filterwarnings("ignore:invalid value encountered in arcsin")
@pytest.mark.parametrize("name", ["profile", "steady_state"])
def test_a_force_that_is_no_number_anywhere_is_refused(name: str) -> None:
    """A strut of 4 mm does not reach where the figure slides it to."""
    with pytest.raises(ValueError, match=f"{name} of quarter_car_general: .* is none anywhere"):
        figure(QuarterCarGeneral(L_d=0.004, k_s=2.89e6), name, 10.0)
