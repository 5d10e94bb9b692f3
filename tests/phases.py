"""Small problems in phases, for tests of what comes behind their text."""

from typing import Any

from motions import double_integrator, stage

from ocp.formulation.expressions import TIME, integral
from ocp.formulation.phase import Free, Phase
from ocp.formulation.problem import Problem

UNIT = double_integrator()


def unit_move(**more: Any) -> Problem:
    """Unit move from rest to rest in 1 s with least integral of a^2: 12."""
    phase = {"T": 1.0, "end": {"x": 1.0, "v": 0.0}} | more
    cost = phase.pop("cost", integral(lambda s: s.a**2))
    problem = {k: phase.pop(k) for k in ("scenarios", "shared", "choose") if k in phase}
    return Problem(Phase(phase.pop("model", UNIT), **phase), cost, **problem)


def there_and_back(**more: Any) -> Problem:
    """1 m out in 1 s and back in the next one: two phases."""
    out = Phase(UNIT, 1.0, end={"x": 1.0}, name="out")
    back = Phase(UNIT, 1.0, end={"x": 0.0, "v": 0.0}, name="back")
    return Problem(out >> back, integral(lambda s: s.a**2), **more)


def fastest_move(v_t: float = 1e-3) -> Problem:
    """1 m from rest to rest with |force| <= 20 N in the shortest time, against friction."""
    phase = Phase(stage(v_t), Free(0.1, 10.0, guess=1.0), end={"x": 1.0, "v": 0.0})
    return Problem(phase, TIME, bounds={"force": (-20.0, 20.0)})
