"""Stribeck curves."""

import numpy as np
import pytest

from symfric import LuGre
from symfric.figures import steady_state
from symfric.laws import SteadyStateLuGre


def test_steady_state_of_seed_4_has_its_minimum_where_the_table_says() -> None:
    curve = steady_state(SteadyStateLuGre())["steady_state_lugre"]
    v, F = curve["v"], curve["F"]
    sliding = v > 1e-4
    lowest = np.argmin(np.where(sliding, F, np.inf))
    assert F[lowest] == pytest.approx(3.1224, abs=2e-3)
    assert v[lowest] * 60000 == pytest.approx(129, abs=2)  # mm/min


def test_viscous_friction_adds_a_linear_tail_to_the_dry_curve() -> None:
    data = steady_state(LuGre(), shares=(0.0, 1.0))
    _, dry, wet = data.curves
    assert wet["F"] - dry["F"] == pytest.approx(0.7848 * wet["v"] / 1e-2)
