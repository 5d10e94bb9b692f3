"""Where a test runs: in CasADi's virtual machine, as machine code, or in both."""

from collections.abc import Callable
from functools import cache

import numpy as np
import pytest

from symfric import Model, Trajectory
from symfric.foundation.programs import find_compiler

BACKENDS = ["vm"] + ["compiled"] * (find_compiler() is not None)
"""Those that run here."""

needs_compiler = pytest.mark.skipif(len(BACKENDS) < 2, reason="needs a C compiler")
each_backend = pytest.mark.parametrize(
    "backend", ["vm", pytest.param("compiled", marks=needs_compiler)]
)


@cache
def made(make: Callable[[], Model]) -> Model:
    """Return one model for all tests that ask for it; a model keeps its integrators."""
    return make()


def bits(run: Trajectory) -> list[bytes]:
    """Every bit of a run but how long it took and what ran it."""
    counts = run.statistics.steps, run.statistics.rejections, run.statistics.smallest_step
    said = f"{run.message} {run.happened} {counts}".encode()
    between = run.at(np.linspace(*run.span, 23))
    parts = run.t, run.step_times, *(run[n] for n in run.units), *between.values()
    return [said, *(np.ascontiguousarray(part).tobytes() for part in parts)]
