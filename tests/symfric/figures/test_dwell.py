"""Static friction after a rest."""

import numpy as np
import pytest

from symfric import LuGre, RateAndState
from symfric.figures import dwell


def test_friction_heals_with_the_logarithm_of_the_dwell_time() -> None:
    """At rest the age grows with time: the peak rises by b ln(10) N a decade."""
    law = RateAndState()
    data = dwell(law, 2.0, holds=(1e3, 1e4, 1e5))
    rise = np.diff(data.curves[0]["F"])
    expected = 2.0 * float(law.b) * np.log(10.0)
    assert rise == pytest.approx(expected, rel=0.03)


def test_a_law_without_dwell_is_refused() -> None:
    with pytest.raises(ValueError, match="dwell of lugre: expected a law that shows static"):
        dwell(LuGre())
