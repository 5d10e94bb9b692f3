"""Cost of a simulation."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any


@dataclass(frozen=True)
class Statistics:
    """Cost of a simulation.

    Attributes:
        backend: what ran it.
        method: integration method.
        steps, rejections: accepted and rejected steps.
        evaluations, jacobians, factorisations: calls of the right-hand side, of its Jacobian, and
            LU factorisations.
        events: events that happened.
        smallest_step: smallest accepted step [s].
        build_time, compile_time, run_time: wall time [s] for making the integrator (0 where it is
            reused), compiling it, and running it.
        error: measured error relative to each state's magnitude, the largest; NaN if not requested.
        sensitivity_errors: measured error of derivatives by each requested name, relative
            to the largest value of each state's derivative, the largest; NaN where there is none.
    """

    backend: str
    method: str
    steps: int
    rejections: int
    evaluations: int
    jacobians: int
    factorisations: int
    events: int
    smallest_step: float
    build_time: float
    compile_time: float
    run_time: float
    error: float = float("nan")
    sensitivity_errors: Mapping[str, float] = field(default_factory=dict[str, float])

    def to_dict(self) -> dict[str, Any]:
        """The fields by name; errors that were not measured are left out."""
        return {k: v for k, v in asdict(self).items() if v == v and v != {}}
