"""Steps of laws whose states yield: at levels that others make, and under loads that fall."""

from collections.abc import Iterable

import casadi as ca
import numpy as np
import pytest

from symfric.codegen.blocks.from_law import law_block
from symfric.laws import Armstrong, ElastoPlastic, Law, MaxwellSlip

Given = tuple[float, float, float]


def stepped(law: Law, given: Iterable[Given]) -> np.ndarray:
    """States after each step, rows, for velocities, loads and step sizes."""
    block = law_block(law)
    p = [float(v.start) for v in block.parameters if v.name != "h"]
    assert block.parameters[-1].name == "h"
    z, rows = ca.DM.zeros(len(block.states)), list[np.ndarray]()
    for v, N, h in given:
        z, _ = block.step(z, [*p, h], [v, N])
        rows.append(z.full().ravel())
    return np.array(rows)


@pytest.mark.parametrize("h", [1e-6, 1e-3, 1.0, 1e3])
def test_armstrongs_spring_yields_at_the_level_of_its_filter_and_dwell(h: float) -> None:
    random, load = np.random.default_rng(0), 8.0
    v = 10.0 ** random.uniform(-6, 3, 500) * random.choice([-1.0, 1.0], 500)
    xi, w, q = stepped(Armstrong(), ((float(x), load, h) for x in v)).T
    assert 0.1 * load / 1e5 < np.abs(xi).max() <= 0.15 * load / 1e5 * (1 + 1e-6)
    assert np.abs(w).max() <= np.abs(v).max() * (1 + 1e-12)
    assert (q >= 0).all()
    assert (q <= 1).all()


@pytest.mark.parametrize("law", [MaxwellSlip(), ElastoPlastic(), Armstrong()])
def test_loads_that_fall_by_decades_leave_every_state_a_number(law: Law) -> None:
    random = np.random.default_rng(0)
    v = random.choice([0.0, 1e-6, 1e-4, 1e-2, 1.0, 10.0], 1500) * random.choice([-1.0, 1.0], 1500)
    N, h = (
        random.choice([1e-3, 1.0, 10.0, 60.0], 1500),
        random.choice([1e-4, 1e-3, 0.1, 10.0], 1500),
    )
    assert np.isfinite(stepped(law, zip(v, N, h, strict=True))).all()
