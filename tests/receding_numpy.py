"""A reference in NumPy for the C of controllers: cycles with the same bits."""

from dataclasses import dataclass
from math import inf, isfinite
from typing import final

import numpy as np
from numpy.typing import NDArray
from receding_program import Move, Sweeps, price_of, solve_program, total

from ocp.mpc.design import CycleData, CycleStatus, Design, Plan, Prices, Settings
from ocp.mpc.source import ARMIJO, PLAIN, ROUNDING

Array = NDArray[np.float64]


@final
@dataclass(frozen=True)
class Report:
    """Result of a cycle.

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


def shifted(plan: Plan, sweeps: Sweeps) -> Plan:
    """One interval later; the last one is repeated."""
    inner, last = sweeps.split(plan.z)
    z = np.append(_later(inner).ravel(), last)
    return Plan(_later(plan.X), _later(plan.U), z)


def _later(rows: Array) -> Array:
    return np.vstack([rows[1:], rows[-1:]])


def _curved(sweeps: Sweeps, plan: Plan, given: CycleData, L: Array, end: Array) -> Array:
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
    sweeps: Sweeps, plan: Plan, given: CycleData, prices: Prices, settings: Settings
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
    """Step length along a change, and the weight of the defects, which never falls."""
    c, v, cost = merit.sweeps.value(plan.X, plan.U, merit.given)
    prices, gap = merit.prices, merit.gap(c)
    slope = total(move.costs[:, 0]) + (price_of(prices, v + move.D) - price_of(prices, v))
    if gap > 0.0:
        nu = max(nu, (slope + 0.5 * max(0.0, total(move.costs[:, 1]))) / (0.5 * gap))
    fall = slope - nu * gap
    before = total(cost) + price_of(prices, v) + nu * gap
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
    given: CycleData
    prices: Prices

    def gap(self, c: Array) -> float:
        """Sum of the defects per nominal."""
        return total((np.abs(c) / self.sweeps.horizon.model.nominal("x")).ravel())

    def __call__(self, X: Array, U: Array, nu: float) -> float:
        """Of states and inputs, with weight nu of the defects."""
        c, v, cost = self.sweeps.value(X, U, self.given)
        return total(cost) + price_of(self.prices, v) + nu * self.gap(c)


@final
class NumpyCycles:
    """The loops in NumPy, the kernels in CasADi's virtual machine."""

    def __init__(self, design: Design) -> None:
        self._design = design
        self._sweeps = Sweeps(design.horizon, design.kernels)
        self.forget()

    def forget(self) -> None:
        """Start afresh, from a plan that rests."""
        design = self._design
        n = design.horizon.count
        self._warm = False
        self._plan = Plan(
            np.tile(design.x0, (n + 1, 1)),
            np.tile(design.u0, (n, 1)),
            np.zeros(design.prices.soft.size),
        )

    @property
    def plan(self) -> Plan:
        """A copy of the plan."""
        return Plan(self._plan.X.copy(), self._plan.U.copy(), self._plan.z.copy())

    def cycle(
        self, measured: Array, given: CycleData, tolerance: float, iterations: int
    ) -> tuple[Array, Report]:
        """One cycle, as the C goes through it."""
        design = self._design
        if self._warm:
            self._plan = shifted(self._plan, self._sweeps)
        numbers = (measured, given.R, given.t, given.p, given.b, np.array([tolerance]))
        if not all(np.isfinite(n).all() for n in numbers):
            report = Report(CycleStatus.BAD_INPUT, inf, 0.0, 0, 0)
            return self._shown(given), report
        X = self._plan.X.copy()
        X[0, list(design.measured)] = measured
        if not self._warm:
            X[1:] = X[0]
        self._plan = Plan(X, self._plan.U, self._plan.z)
        u = self._shown(given)
        with np.errstate(all="ignore"):
            settings = design.settings._replace(tolerance=tolerance, iterations=iterations)
            plan, report = improved(self._sweeps, self._plan, given, design.prices, settings)
        self._plan, self._warm = plan, report.status is not CycleStatus.FAILED
        if self._warm:
            u = self._shown(given)
        else:
            self.forget()
        return u, report

    def _shown(self, given: CycleData) -> Array:
        plan = self._plan
        return np.array([c.of(plan.X, plan.U, given.b) for c in self._design.controls])
