"""Iteration matrix and solutions with it against NumPy."""

import casadi as ca
import numpy as np
import pytest
from closed_forms import assemble, smooth_dae

from symfric import BrownMcPhee, LuGre, Model, rabinowicz
from symfric.integrator.equations.blocks import at_rest, blocks, refinement, signs, slopes
from symfric.scenes import FourBar


@pytest.mark.parametrize("model", [rabinowicz(LuGre()), smooth_dae().model], ids=lambda m: m.name)
@pytest.mark.parametrize(("gamma", "h"), [(1.0, 0.1), (0.25, 1e-6), (0.5, 10.0)])
def test_solution_satisfies_its_equation(model: Model, gamma: float, h: float) -> None:
    system = assemble(model)
    block = blocks(system, gamma)
    rng = np.random.default_rng(0)
    y, right, memory = (rng.random(system.n) for _ in range(3))
    if system.n == 3 and system.nx == 3:
        y[2] *= 1e-5
    k = block.solve(block.factor(y, h, []), right, memory).full().ravel()
    J = ca.Function("J", [system.y, system.d], [ca.jacobian(system.f, system.y)])(y, []).full()
    M = ca.DM(system.mass).full()
    W = M / (gamma * h) - J
    expected = np.linalg.solve(W, right + M @ memory)
    assert k == pytest.approx(expected, rel=1e-10 * np.linalg.cond(W) ** 0.25)


def test_factors_that_are_kept_longer_than_their_slopes_still_fit() -> None:
    """Caches of few systems forget at different times; what one keeps has symbols of its own."""
    first = assemble(FourBar(BrownMcPhee()).model())
    at_rest(first)
    for other in (rabinowicz(LuGre()), smooth_dae().model, rabinowicz(BrownMcPhee())):
        slopes(assemble(other))
    assert refinement(first).n_instructions() > 0
    y = np.zeros(first.n)
    assert len(signs(first, 0.25)(y, 0.1, np.zeros(first.d.numel()))) == 3
