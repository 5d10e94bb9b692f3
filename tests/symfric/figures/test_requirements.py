"""What laws show, those inside others included."""

import pytest

from symfric import law_from_text
from symfric.figures.requirements import phenomena, require


def test_a_composed_law_shows_what_its_parts_show_in_the_order_of_the_list() -> None:
    assert phenomena(law_from_text("maxwell_slip+viscous")) == ["D", "V", "P", "M", "N"]


def test_one_of_the_phenomena_is_enough() -> None:
    require("drift", law_from_text("dahl"), "S", "P")
    with pytest.raises(ValueError, match=r"static friction .* or pre-sliding displacement, got"):
        require("drift", law_from_text("coulomb+viscous"), "S", "P")
