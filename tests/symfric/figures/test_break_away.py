"""Break-away force against the loading rate."""

import numpy as np
import pytest

from symfric import LuGre, law_from_text
from symfric.figures import break_away


def test_break_away_of_lugre_falls_with_the_rate_as_computed_independently() -> None:
    curve = break_away(LuGre(), rates=(0.1, 1.0, 10.0))["lugre"]
    # SciPy's Radau on plain Python, seed 2's parameters
    assert curve["F"] == pytest.approx([1.166, 1.125, 0.961], abs=5e-4)


def test_break_away_of_a_static_law_does_not_know_the_rate() -> None:
    peak = break_away(law_from_text("brown_mcphee"))["brown_mcphee"]["F"]
    assert peak == pytest.approx(np.full(6, 0.9996 * 0.15 * 7.848), rel=1e-4)


def test_a_rate_of_zero_is_refused() -> None:
    with pytest.raises(ValueError, match="rates: expected numbers above 0 N/s"):
        break_away(LuGre(), rates=(0.0, 1.0))
