"""The slider-crank in Exudyn goes to our motion with its order 2."""

import numpy as np
import pytest

from symfric import simulate
from symfric.bench.exudyn_peer import slider_crank
from symfric.bench.multibody import CASES, CRANK
from symfric.scenes import SliderCrank

pytest.importorskip("exudyn", reason="needs Exudyn (extra 'bench')")


def test_order_2_towards_our_solution() -> None:
    what = CASES["slider_crank"]
    assert isinstance(what.scene, SliderCrank)
    exact = simulate(what.scene.model(), what.t_end, rtol=1e-10, t_eval=what.times)["slider"]
    errors: list[float] = []
    for count in (500, 1000):
        found, steps = slider_crank(what.scene, CRANK, what.times, count).solve()
        assert steps() == count
        errors.append(float(np.abs(found[0] - exact).max()))
    assert errors[1] < 1e-4
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.2)
