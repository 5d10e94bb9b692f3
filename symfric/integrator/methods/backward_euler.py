"""Backward Euler with Newton's method, for plants in fixed steps."""

from dataclasses import dataclass
from typing import Any, final

from symfric.integrator.equations.blocks import blocks
from symfric.integrator.equations.pivots import Factors
from symfric.integrator.equations.system import System
from symfric.integrator.methods.method import Method, Trial, Trials


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class BackwardEuler(Method):
    """M (y_1 - y_0) = h f(y_1), by a fixed number of Newton iterations from y_0.

    The Jacobian is new in every iteration: where a contact changes between sticking and sliding,
    that of the start says nothing about the end.
    """

    iterations: int

    @property
    def diagonal(self) -> None:
        """No gamma: W of the fixed step is M / h - J."""

    def work(self, system: System) -> tuple[int, int, int]:
        """Right-hand sides, Jacobians and factorisations of a step."""
        return self.iterations, self.iterations, self.iterations

    def factors(self, system: System) -> tuple[Factors, ...]:
        """Of the iteration matrix."""
        return (blocks(system, 1.0).factors,)

    def trials(self, system: System) -> Trials:
        """Its steps on a system."""
        block = blocks(system, 1.0)

        def trial(y: Any, h: Any, d: Any) -> Trial:
            end, per_h = y, 1 / h
            for _ in range(self.iterations):
                lu = block.factor(end, h, d)
                end = end + block.solve(lu, block.f(end, d), (y - end) * per_h)
            return Trial(end)

        return trial
