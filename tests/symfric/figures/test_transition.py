"""From pre-sliding to sliding."""

import pytest

from symfric import LuGre
from symfric.figures import transition


def test_transition_settles_on_the_dynamic_level_on_both_sides() -> None:
    curve = transition(LuGre())["2 Hz"]
    assert curve["F"][curve["v"].argmax()] == pytest.approx(0.7848, rel=1e-2)
    assert curve["F"][curve["v"].argmin()] == pytest.approx(-0.7848, rel=1e-2)
