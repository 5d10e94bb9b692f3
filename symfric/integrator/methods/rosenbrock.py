"""Rosenbrock methods: linearly implicit stages with one factorisation a step."""

from dataclasses import dataclass
from typing import Any, final

from symfric.foundation.numeric import reciprocal
from symfric.integrator.equations.blocks import at_rest, blocks
from symfric.integrator.equations.pivots import Factors
from symfric.integrator.equations.system import System
from symfric.integrator.methods.method import Array, Method, Trial, Trials, combination


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class Rosenbrock(Method):
    """A stiffly accurate Rosenbrock method in the transformed form of Hairer and Wanner (IV.7).

    With W = M / (gamma h) - J at the start of the step,

        W k_i = f(y_0 + sum_j a_ij k_j) + M sum_j (c_ij / h) k_j,      i = 1 ... s

    y_1 is the last stage's argument plus k_s, and k_s is the error estimate.

    Attributes:
        gamma: diagonal coefficient.
        A, C: strictly lower triangular, shape (s, s).
    """

    gamma: float
    A: Array
    C: Array

    @property
    def diagonal(self) -> float:
        """gamma, the same for all stages, so that one factorisation serves them."""
        return self.gamma

    @property
    def stages(self) -> int:
        """Number of stages s."""
        return self.A.shape[0]

    def work(self, system: System) -> tuple[int, int, int]:
        """Right-hand sides, Jacobians and factorisations of a step."""
        return self.stages, 1, 1

    def factors(self, system: System) -> tuple[Factors, ...]:
        """Of the iteration matrix, and for a tiny step."""
        return blocks(system, self.gamma).factors, at_rest(system)[1]

    def trials(self, system: System) -> Trials:
        """Its steps on a system."""
        block, A, C = blocks(system, self.gamma), self.A, self.C

        def trial(y: Any, h: Any, d: Any) -> Trial:
            lu, per_h = block.factor(y, h, d), reciprocal(h)
            k: list[Any] = []
            argument = y
            for i in range(self.stages):
                argument, memory = y, type(y).zeros(y.numel())
                for j in range(i):
                    if A[i, j] != 0:
                        argument = argument + A[i, j] * k[j]
                    if C[i, j] != 0:
                        memory = memory + C[i, j] * k[j]
                k.append(block.solve(lu, block.f(argument, d), memory * per_h))
            dense = tuple(combination(row, k, type(y)) for row in self.H)
            return Trial(argument + k[-1], k[-1], dense)

        return trial
