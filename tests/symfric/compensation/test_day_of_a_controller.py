"""The C of compensators and observers through what a controller meets: nothing dies."""

import numpy as np
import pytest

from symfric import BoucWen, LuGre, Stribeck
from symfric.codegen import Block
from symfric.compensation import compensator, disturbance_observer, gms_observer, lugre_observer
from symfric.compensation.loop import Members
from symfric.laws import GMS

BAD = np.array([0.0, np.nan, np.inf, -np.inf, 5e-324, 1e-310, 1e300, -1e300, 1e30, 1e-30, -1e3])
FULL = {
    "N": "input", "dead_zone": 1e-3, "inertia": 1.0, "delay": 1e-3, "error_gain": 20.0,
    "hold": (1e-5, 1e-3), "stick": (1.0, 0.1, 1e-3), "dither": (0.1, 100.0), "limit": 5.0,
    "slew": 100.0, "offset": 0.1,
}  # fmt: skip
BLOCKS = [
    compensator(LuGre(), scales=["coulomb", "stribeck", "viscous", "bristle"], **FULL),
    compensator(Stribeck(), build_up=1e-4, **FULL),
    compensator(BoucWen(), N="input"),
    lugre_observer(LuGre(), 10.0),
    gms_observer(GMS(form="event"), 10.0),
    disturbance_observer(1.0, 100.0, order=2),
]
LAST_RESORT = 16


@pytest.mark.heavy
@pytest.mark.parametrize("real", ["double", "float"])
@pytest.mark.parametrize("block", BLOCKS, ids=lambda block: f"{block.name}, {len(block.states)}")
def test_a_hundred_thousand_bad_steps_leave_nothing_that_is_not_finite(
    block: Block, real: str, compiler
) -> None:
    """A tenth of all inputs NaN, infinite, denormal, huge or zero; steps of 1 us to 1 s."""
    members, random = Members(block, [{}] * 200, real, compiler), np.random.default_rng(0)
    h = [v.name for v in block.parameters].index("h")
    shape = members.input.shape
    for _ in range(500):
        usual = random.standard_normal(shape) * 10.0 ** random.integers(-9, 2, shape)
        with np.errstate(over="ignore", under="ignore"):
            members.input[:] = np.where(
                random.random(shape) < 0.1, random.choice(BAD, shape), usual
            )
        members.param[:, h] = 10.0 ** random.uniform(-6, 0, shape[0])
        members.step()
        assert np.isfinite(members.output).all()
        assert np.isfinite(members.state).all()
    assert members.status.all()
    assert not (members.status & LAST_RESORT).any()


@pytest.mark.heavy
@pytest.mark.parametrize("block", BLOCKS, ids=lambda block: f"{block.name}, {len(block.states)}")
def test_what_is_valid_is_not_touched_by_the_guards(block: Block, compiler) -> None:
    """The same bits as in CasADi, which has no guards, and no status."""
    pair = Members(block, [{}] * 50, "double", compiler), Members(block, [{}] * 50)
    random = np.random.default_rng(1)
    lower = np.array([max(v.lower, -1e3) for v in block.inputs])
    for _ in range(200):
        x = 0.1 * random.standard_normal((50, lower.size))
        for members in pair:
            members.input[:] = np.where(lower >= 0, np.abs(x), x)
            members.step()
        assert (pair[0].output == pair[1].output).all()
        assert (pair[0].state == pair[1].state).all()
    assert not pair[0].status.any()
