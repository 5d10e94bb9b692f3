"""Explicit Runge-Kutta pairs, for equations without stiffness."""

from dataclasses import dataclass
from typing import Any, ClassVar, final

import casadi as ca
import numpy as np

from symfric.integrator.equations.eliminated import Eliminated, eliminated
from symfric.integrator.equations.system import System
from symfric.integrator.methods.method import Array, Method, Trial, Trials, combination, need_ode


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class Explicit(Method):
    """An explicit Runge-Kutta pair.

        k_i = h f(y_0 + sum_j a_ij k_j),      i = 1 ... s

    y_1 is the last stage's argument, sum_j e_j k_j the error estimate. Accelerations and
    multipliers of mechanisms without friction from reactions are solved for at each stage
    (`eliminated`): they have no error estimate, and are interpolated linearly between steps.

    Attributes:
        A: strictly lower triangular, shape (s, s).
        E: error weights, shape (s,).
    """

    A: Array
    E: Array
    dae: ClassVar[bool] = False

    @property
    def stages(self) -> int:
        """Number of stages s."""
        return self.A.shape[0]

    @property
    def diagonal(self) -> None:
        """No gamma: an explicit method has no iteration matrix."""

    def work(self, system: System) -> tuple[int, int, int]:
        """Right-hand sides, Jacobians and factorisations of a step."""
        return self.stages, 0, 0 if system.is_ode else self.stages

    def trials(self, system: System) -> Trials:
        """Its steps on a system.

        Raises:
            ValueError: algebraic unknowns other than those of a mechanism in which they are
                linear, or a mass matrix.
        """
        linear = None if system.is_ode else eliminated(system)
        if linear is not None:
            return self._eliminating(linear)
        need_ode(system, self.name)
        f = system.in_steps(ca.Function("f", [system.y, system.d], [system.f], {"cse": True}))

        def trial(y: Any, h: Any, d: Any) -> Trial:
            k: list[Any] = []
            argument = y
            for i in range(self.stages):
                argument = y + combination(self.A[i, :i], k, type(y))
                k.append(h * f(argument, d))
            dense = tuple(combination(row, k, type(y)) for row in self.H)
            return Trial(argument, combination(self.E, k, type(y)), dense)

        return trial

    def _eliminating(self, linear: Eliminated) -> Trials:
        """Its steps on states, with algebraic unknowns solved for at each stage."""

        def trial(y: Any, h: Any, d: Any) -> Trial:
            k: list[Any] = []
            argument = y
            for i in range(self.stages):
                argument = linear.settle(y + combination(self.A[i, :i], k, type(y)), d)
                k.append(h * linear.rates(argument, d))
            dense = tuple(combination(row, k, type(y)) for row in self.H)
            return Trial(argument, combination(self.E, k, type(y)), dense)

        return trial


def shampine(b: Array, D: Array) -> Array:
    """Coefficients H of the quartic with the slopes k_1 and k_s at its ends.

    With the increment r = sum_j b_j k_j and the free term q = sum_j D_j k_j it is

        y_0 + theta [r + (1 - theta) (k_1 - r + theta (2 r - k_1 - k_s + (1 - theta) q))]
    """
    first, last = np.eye(b.size)[[0, -1]]
    return np.array([first - b, 2 * b - first - last + D, -D])
