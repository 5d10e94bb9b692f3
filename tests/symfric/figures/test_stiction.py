"""Friction of a block that is pulled to and fro."""

import numpy as np
import pytest

from symfric import ExactCoulomb, Viscous
from symfric.figures import stiction


def test_at_rest_friction_is_the_force_that_pulls() -> None:
    data = stiction(ExactCoulomb(), 10.0)
    curve = data.curves[0]
    still = (np.abs(curve["v"]) < 1e-9) & (np.abs(curve["F_e"]) < 1.49)
    assert still.sum() > 50
    assert curve["F"][still] == pytest.approx(curve["F_e"][still], abs=1e-6)
    assert np.abs(curve["F"][still]).max() == pytest.approx(1.5, rel=0.02)
    assert np.abs(curve["F_e"]).max() == pytest.approx(1.3 * 1.5, rel=1e-3)


def test_a_law_without_dry_friction_is_refused() -> None:
    with pytest.raises(ValueError, match="stiction of viscous: expected a law that shows"):
        stiction(Viscous())
