"""Break-away force against the loading rate."""

import numpy as np
import pytest

from symfric import Dahl, LuGre, law_from_text
from symfric.figures import break_away
from symfric.figures.motion import scales


def test_break_away_of_lugre_falls_with_the_rate_as_computed_independently() -> None:
    curve = break_away(LuGre(), rates=(0.1, 1.0, 10.0))["lugre"]
    # SciPy's Radau on plain Python, seed 2's parameters
    assert curve["F"] == pytest.approx([1.166, 1.125, 0.961], abs=5e-4)


def test_break_away_ends_at_the_kinetic_level_whatever_the_stiffness() -> None:
    """By LSODA on plain Python for sigma_0 = 1e4 and no damping: 1.0544, 0.9322, then F_C."""
    F_C = 0.1 * 7.848
    soft = break_away(LuGre(sigma_0=1e4, sigma_1=0.0), rates=(0.3, 1.0, 3.0, 30.0, 100.0))
    known = [1.0544, 0.9322, F_C, F_C, F_C]
    assert soft.curves[0]["F"] == pytest.approx(known, abs=5e-4)
    rates = (0.1, 3.0, 100.0)
    for law in (LuGre(sigma_0=1e3), LuGre(sigma_0=1e6, sigma_1=0.0), Dahl(sigma_0=1e3)):
        assert (break_away(law, rates=rates).curves[0]["F"] > 0.9999 * F_C).all()


def test_scales_of_another_law_do_not_end_the_elastic_motion() -> None:
    """The scales of a contact ten times as stiff are given, as those of a whole comparison are."""
    stiff = scales(LuGre(sigma_0=1e6))
    given = break_away(LuGre(sigma_0=1e4, sigma_1=0.0), given=stiff, rates=(30.0,))
    assert given.curves[0]["F"][0] == pytest.approx(0.7848, abs=5e-4)


def test_break_away_of_a_static_law_does_not_know_the_rate() -> None:
    peak = break_away(law_from_text("brown_mcphee"))["brown_mcphee"]["F"]
    assert peak == pytest.approx(np.full(6, 0.9996 * 0.15 * 7.848), rel=1e-4)


def test_a_rate_of_zero_is_refused() -> None:
    with pytest.raises(ValueError, match="rates: expected numbers above 0 N/s"):
        break_away(LuGre(), rates=(0.0, 1.0))
