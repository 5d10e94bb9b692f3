"""Sequential quadratic programs over the horizon, and how far their result is from optimal.

    1. linearise at the plan (X, U); residual <= tolerance: done
    2. change and multipliers by the quadratic program (`interior_point`)
    3. a step of 1, 1/2, 1/4, ... of it by the merit  cost + prices + nu |defects|_1

The Hessian is that of Gauss and Newton in the first two iterations of a cycle. Near rest, friction
bends more than the cost does, and these converge slowly; from the third one on the curvature of the
equations, weighted with their multipliers, is taken along wherever Riccati's recursion then finds
no negative pivot.

The residual is that of the conditions of Karush, Kuhn and Tucker at the plan that is handed out,
whose multipliers of the equations make the gradients in the states zero: the largest of

 * gradients in the inputs, per nominal and own curvature of the cost in an input: an input would
   move by no more than that share of its nominal;
 * defects of the equations per nominal of the state;
 * violations of rows in units of their signals; products of rows and multipliers, by the larger
   of multiplier and that curvature. A soft row may be violated instead where its multiplier is the
   price: what it is off, relative to the price, times the violation.

Source of the merit's weight: Nocedal and Wright, Numerical Optimization, 2nd ed., (18.36).
"""

from dataclasses import dataclass
from enum import IntEnum
from math import isfinite
from typing import final

import numpy as np
from numpy.typing import NDArray

from ocp.mpc.interior_point import Given, Move, Prices, Sweeps, solve_program, total

Array = NDArray[np.float64]

PLAIN = 2
"""Iterations without curvature of the equations, which has no meaning yet far from the optimum."""
ARMIJO = 1e-4
ROUNDING = 1e-12
"""Of the merit, relative: what a step may lose by it."""


class CycleStatus(IntEnum):
    """How a cycle ended; the numbers are those of the C."""

    CONVERGED = 0
    NOT_CONVERGED = 1
    BAD_INPUT = 2
    FAILED = 3

    @property
    def sentence(self) -> str:
        """What it means and what to try."""
        return {
            0: "converged",
            1: "not converged: the residual is above the tolerance after the last iteration; allow "
            "more of them, or let steps resolve the transition velocity",
            2: "bad input: a number is not finite; the plan of the last cycle goes on",
            3: "failed: numbers were not finite; the plan of the last cycle goes on, the next one "
            "starts afresh",
        }[int(self)]


@final
@dataclass(frozen=True)
class Settings:
    """Limits of the work in one cycle.

    Attributes:
        tolerance: residual at which a plan is optimal.
        iterations: quadratic programs at most; 1 is the real-time iteration.
        program: iterations of the interior point in each at most.
        halvings: of a step, at most.
    """

    tolerance: float = 1e-3
    iterations: int = 20
    program: int = 40
    halvings: int = 6


@final
@dataclass(frozen=True, eq=False)
class Plan:
    """States (N+1, nx), inputs (N, nu), and multipliers of all rows."""

    X: Array
    U: Array
    z: Array

    def shifted(self, sweeps: Sweeps) -> "Plan":
        """One interval later; the last one is repeated."""
        inner, last = sweeps.split(self.z)
        z = np.append(_later(inner).ravel(), last)
        return Plan(_later(self.X), _later(self.U), z)


@final
@dataclass(frozen=True)
class Report:
    """How a cycle went.

    Attributes:
        residual: of the plan that is handed out.
        violation: largest violation of a soft row, in units of its signal.
        iterations: quadratic programs.
        program: iterations of the interior point, over all of them.
    """

    status: CycleStatus
    residual: float
    violation: float
    iterations: int
    program: int


def _later(rows: Array) -> Array:
    return np.vstack([rows[1:], rows[-1:]])


def _curved(sweeps: Sweeps, plan: Plan, given: Given, L: Array, end: Array) -> Array:
    """L with the curvature of the equations, where the Hessian stays positive over the horizon."""
    _, multipliers = sweeps.adjoint(L, end, plan.z)
    E = sweeps.curvature(plan.X, plan.U, multipliers, given)
    found = L.copy()
    found[:, L.shape[1] - E.shape[1] :] = E
    pivots = sweeps.pivots(sweeps.matrix(found, end, np.zeros(plan.z.size)))
    return found if bool((pivots > 0.0).all()) else L


def residual_of(
    sweeps: Sweeps, L: Array, end: Array, z: Array, prices: Prices
) -> tuple[float, float]:
    """The residual, and the largest violation of a soft row."""
    horizon = sweeps.horizon
    model, unit = horizon.model, horizon.curvature
    v = sweeps.rows_of(L, end)
    gradients, _ = sweeps.adjoint(L, end, z)
    gradients = np.abs(gradients * model.nominal("u")) / unit
    defects = np.abs(sweeps.defects_of(L)) / model.nominal("x")
    below, soft = np.maximum(-v, 0.0), prices.soft
    kept = np.maximum(below, np.abs(z * v) / np.maximum(z, unit))
    owed = prices.rho + prices.sigma * below - z
    paid = np.abs(owed * v) / np.where(soft, prices.rho, 1.0)
    rows = np.where(soft & (v < 0.0), np.minimum(kept, paid), kept)
    parts = (gradients, defects, rows)
    found = float(np.max([np.max(part, initial=0.0) for part in parts]))
    return found, float(np.max(np.where(soft, below, 0.0), initial=0.0))


def improved(
    sweeps: Sweeps, plan: Plan, given: Given, prices: Prices, settings: Settings
) -> tuple[Plan, Report]:
    """The plan after at most `settings.iterations` quadratic programs, and how it went."""
    unit, merit = sweeps.horizon.curvature, Merit(sweeps, given, prices)
    made = programs = 0
    nu = 0.0
    while True:
        L, end = sweeps.linear(plan.X, plan.U, given)
        residual, violation = residual_of(sweeps, L, end, plan.z, prices)
        done = residual <= settings.tolerance
        if done or made == settings.iterations or not isfinite(residual):
            break
        made += 1
        taken = _curved(sweeps, plan, given, L, end) if made > PLAIN else L
        move, z, count = solve_program(
            sweeps, taken, end, prices, warm=plan.z, unit=unit, most=settings.program
        )
        programs += count
        alpha, nu = _step(merit, plan, move, nu, settings.halvings)
        X, U = plan.X + alpha * move.X, plan.U + alpha * move.U
        plan = Plan(X, U, plan.z + alpha * (z - plan.z))
    status = CycleStatus.CONVERGED if done else CycleStatus.NOT_CONVERGED
    if not isfinite(residual):
        status = CycleStatus.FAILED
    return plan, Report(status, residual, violation, made, programs)


def _step(merit: "Merit", plan: Plan, move: Move, nu: float, halvings: int) -> tuple[float, float]:
    """How far to go along a change, and the weight of the defects, which does not fall again."""
    c, v, cost = merit.sweeps.value(plan.X, plan.U, merit.given)
    prices, gap = merit.prices, merit.gap(c)
    slope = total(move.costs[:, 0]) + (prices.of(v + move.D) - prices.of(v))
    if gap > 0.0:
        nu = max(nu, (slope + 0.5 * max(0.0, total(move.costs[:, 1]))) / (0.5 * gap))
    fall = slope - nu * gap
    before = total(cost) + prices.of(v) + nu * gap
    alpha = 1.0
    for _ in range(halvings):
        after = merit(plan.X + alpha * move.X, plan.U + alpha * move.U, nu)
        if after <= before + ARMIJO * alpha * fall + ROUNDING * abs(before):
            break
        alpha *= 0.5
    return alpha, nu


@final
@dataclass(frozen=True, eq=False)
class Merit:
    """Cost, prices of soft rows and weighted defects of a plan."""

    sweeps: Sweeps
    given: Given
    prices: Prices

    def gap(self, c: Array) -> float:
        """Sum of the defects per nominal."""
        return total((np.abs(c) / self.sweeps.horizon.model.nominal("x")).ravel())

    def __call__(self, X: Array, U: Array, nu: float) -> float:
        """Of states and inputs, with weight nu of the defects."""
        c, v, cost = self.sweeps.value(X, U, self.given)
        return total(cost) + self.prices.of(v) + nu * self.gap(c)
