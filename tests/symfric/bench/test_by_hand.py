"""The C by hand is RADAU5: right, of its order, and as economical as it is known to be."""

import numpy as np
import pytest
from backends import needs_compiler

from symfric import BrownMcPhee, LuGre, simulate
from symfric.bench.contenders import ByHand, collocation
from symfric.scenes import Rabinowicz

TIMES = np.linspace(0.0, 20.0, 41)[1:]


@needs_compiler
def test_error_follows_the_tolerance_in_steps_of_order_five() -> None:
    scene = Rabinowicz(BrownMcPhee())
    run = ByHand(scene)
    exact = simulate(scene.model(), 20.0, x0={"v": 0.03}, rtol=1e-11, t_eval=TIMES)["x"]
    errors, steps = [], []
    for rtol in (1e-4, 1e-6, 1e-8):
        (x, _), count = run(0.03, TIMES, rtol)
        errors.append(np.abs(x - exact).max() / np.abs(exact).max())
        steps.append(count)
    assert errors[0] < 1e-3
    assert errors[2] < 1e-7
    assert steps[0] < steps[1] < steps[2] < steps[0] * 1e4**0.25


def test_blocks_of_the_method_are_those_of_the_literature() -> None:
    """Hairer and Wanner, IV.8: gamma = (6 + 81^(1/3) - 9^(1/3)) / 30 inverted, and its pair."""
    a, b = 81 ** (1 / 3), 9 ** (1 / 3)
    alpha, beta = (12 - a + b) / 60, (a + b) * 3**0.5 / 60
    found = collocation()
    assert found["gamma"] == pytest.approx(30 / (6 + a - b), rel=1e-13)
    assert found["alpha"] == pytest.approx(alpha / (alpha**2 + beta**2), rel=1e-13)
    assert found["beta"] == pytest.approx(beta / (alpha**2 + beta**2), rel=1e-13)


def test_other_laws_are_refused() -> None:
    with pytest.raises(ValueError, match="expected BrownMcPhee"):
        ByHand(Rabinowicz(LuGre()))
