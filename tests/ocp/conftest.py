"""Solutions that several files share."""

import pytest

from ocp import Solution, solve, strategies
from ocp.friction.homotopy import Sharp, sharpened
from ocp.problems import out_and_back
from ocp.solving.one_solve import Task

SHARP = 1e-5
"""Width of the law [m/s]."""


@pytest.fixture(scope="session")
def steps() -> tuple[Sharp, ...]:
    """Out and back with smooth friction, from wide to narrow."""
    return tuple(sharpened(Task(out_and_back(SHARP)), starts=2))


@pytest.fixture(scope="session")
def by_modes(steps: tuple[Sharp, ...]) -> Solution:
    """Out and back by modes, from `steps`."""
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(strategies, "sharpened", lambda *_, **__: iter(steps))
        return solve(out_and_back(SHARP))
