"""Optimality conditions linearised at a solution, for its derivatives and full precision.

With the active conditions A fixed, the optimality conditions are equations in w and the
multipliers. Their derivative by a parameter p is

    [H  A'] [dw  ]     [L_wp]
    [A  0 ] [dlam] = - [A_p ],     dJ*/dp = f_p + lam'g_p

with the Hessian H of the Lagrangian L on the unknowns that are not at bounds. Both terms with p are
central differences of fourth order of the exact first derivatives.

Source: Fiacco, Introduction to Sensitivity and Stability Analysis in Nonlinear Programming, 1983;
Nocedal and Wright, Numerical Optimization, 2006, 12.5, 16.1 (second-order conditions).
"""

from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from typing import NamedTuple, final

import casadi as ca
import numpy as np
import scipy.sparse as sp

from ocp.formulation.expressions import offered
from ocp.formulation.phase import Array, fixed
from ocp.solving.active import BoundStatus, Condition, Entry, Sensitivity, entries, status_of
from ocp.solving.equations import KktEquations
from ocp.solving.methods import Ipopt
from ocp.solving.motion import ScenarioMotion, at_times
from ocp.solving.optimum import STATIONARY, Optimum, Sparse
from ocp.transcription.blocks import Indices
from ocp.transcription.program import Iterate, worst_of
from ocp.transcription.unknowns import SpanPoints
from symfric.foundation.parameters import check_names

STEP = 1e-3
"""Step of differences relative to a parameter."""
LARGE = 1e11
"""Condition number above which active conditions count as dependent."""


class Change(NamedTuple):
    """Effect of a number on the program.

    Attributes:
        unit: unit of the number.
        gradient: derivative of the gradient of the Lagrangian, (n,).
        rows: derivative of the rows minus that of their bounds, (m,).
        bounds: derivative of the bounds of the unknowns, (n,).
        cost: derivative of the optimal cost.
    """

    unit: str
    gradient: Array
    rows: Array
    bounds: Array
    cost: float


@final
@dataclass(frozen=True, eq=False)
class Linearised:
    """Optimality conditions of a solution with its active conditions fixed.

    Attributes:
        optimum: the solution.
        changed: indices of unknowns, then of rows, that count as active although the distance from
            their bound exceeds their multiplier, or as inactive although it does not.
        source: optimum of an interior-point method, if `optimum` is a more precise one.

    Raises:
        ValueError: the point does not satisfy the optimality conditions.
    """

    optimum: Optimum
    changed: Indices = field(default_factory=lambda: np.zeros(0, np.int64))
    source: Optimum | None = None

    def __post_init__(self) -> None:
        optimum, program = self.optimum, self.optimum.transcription.program
        violation = worst_of(program, optimum.iterate.w, optimum.rows[0])
        if not max(optimum.residual, violation) <= STATIONARY:
            raise ValueError(
                f"{self.name}: expected a solution that satisfies the optimality conditions, got a "
                f"residual of {optimum.residual:.1g} and a violation of {violation:.1g}; solve "
                "again from this guess"
            )

    @property
    def name(self) -> str:
        """Subject of messages."""
        return f"solution of '{self.optimum.transcription.problem.name}'"

    @cached_property
    def central(self) -> Optimum:
        """Optimum with the multipliers of the interior-point method if they are not unique.

        They are in the middle of the possible ones.
        """
        if self.source is None or not self.weak:
            return self.optimum
        return replace(self.optimum, iterate=replace(self.source.iterate, w=self.optimum.iterate.w))

    @cached_property
    def status(self) -> BoundStatus:
        """Status of all unknowns and rows, with the conditions `changed`."""
        found = status_of(self.optimum)
        found.active[self.changed] ^= True
        return found

    @cached_property
    def free(self) -> Indices:
        """Indices of unknowns that are not at bounds."""
        return np.flatnonzero(~self.status.active[: self.optimum.iterate.w.size])

    @cached_property
    def held(self) -> Indices:
        """Indices of the active rows."""
        return np.flatnonzero(self.status.active[self.optimum.iterate.w.size :])

    @cached_property
    def entries(self) -> list[Entry]:
        """Restricted unknowns and rows by name."""
        return [*entries(self.optimum)]

    @cached_property
    def weak(self) -> tuple[str, ...]:
        """Names of conditions that may or may not be active."""
        uncertain = (e.name for e in self.entries if self.status.weak[e.number])
        return tuple(dict.fromkeys(uncertain))

    @cached_property
    def hessian(self) -> Sparse:
        """Hessian of the Lagrangian, divided by `size`, (n, n)."""
        made, iterate = self.optimum.transcription, self.optimum.iterate
        H = made.program.hessian(iterate.w, self.optimum.values, 1.0, iterate.lam_g)
        upper = sp.csc_matrix(ca.DM(H).sparse())
        return (upper + sp.triu(upper, 1).T) / self.optimum.size

    @cached_property
    def equations(self) -> KktEquations:
        """Linear equations in the free unknowns and the multipliers of the active rows."""
        active = sp.csr_matrix(self.optimum.rows[1])[self.held][:, self.free]
        return KktEquations(self.hessian[self.free][:, self.free], active)

    def stepped(self) -> Optimum | None:
        """Return the optimum after a Newton step with these active conditions, None without one."""
        optimum, (lower, upper) = self.optimum, self.optimum.transcription.program.bounds
        (g, J), status, n = optimum.rows, self.status, self.free.size
        bounds, wanted = np.split(np.where(status.upper, upper, lower), [optimum.iterate.w.size])
        at_bound = status.active[: bounds.size]
        moved = np.where(at_bound, bounds - optimum.iterate.w, 0.0)
        first = optimum.slope / optimum.size + self.hessian @ moved
        last = (J @ moved)[self.held] + (g - wanted)[self.held]
        found = self.equations.solved(-np.concatenate([first[self.free], last]))
        if found is None:
            return None
        lam_g, moved[self.free] = np.zeros(g.size), found[:n]
        lam_g[self.held] = found[n:] * optimum.size
        slope = optimum.slope + optimum.size * (self.hessian @ moved) + J.T @ lam_g
        lam_w = np.where(at_bound, -slope, 0.0)
        return replace(optimum, iterate=Iterate(optimum.iterate.w + moved, lam_w, lam_g))

    @cached_property
    def numbers(self) -> dict[str, tuple[str, Indices]]:
        """Name -> unit and indices in the values of the program: parameters, fixed durations."""
        made = self.optimum.transcription
        found: dict[str, tuple[str, list[int]]] = {}
        for number, (span, own) in enumerate(
            zip(made.problem.spans, made.layout.spans, strict=True)
        ):
            first, n = self.optimum.offset(number), len(span.model.p)
            for i, v in enumerate(span.model.p):
                if v.name not in span.chosen:
                    found.setdefault(v.name, (v.unit, []))[1].append(first + i)
            if own.T < 0:
                name = "T" if len(made.problem.chain) == 1 else f"T of {span.name}"
                found.setdefault(name, ("s", []))[1].append(first + n)
        return {name: (unit, np.array(at)) for name, (unit, at) in found.items()}

    @cached_property
    def conditions(self) -> dict[str, list[tuple[Entry, bool]]]:
        """Name -> restricted unknowns and rows, and whether the name means their upper bound."""
        lower, upper = self.optimum.transcription.program.bounds
        found: dict[str, list[tuple[Entry, bool]]] = {}
        for entry in self.entries:
            if lower[entry.number] == upper[entry.number]:
                name = "T" if entry.name == "the duration" else entry.name
                found.setdefault(name, []).append((entry, True))
                continue
            short = entry.name.removeprefix("the ")
            for side, bounds in (("lower", lower), ("upper", upper)):
                if np.isfinite(bounds[entry.number]):
                    pair = entry, side == "upper"
                    found.setdefault(f"{side} {short}", []).append(pair)
        return found

    def by_condition(self, name: str) -> Change:
        """Return the effect of a prescribed value or of a bound."""
        n, iterate = self.optimum.iterate.w.size, self.central.iterate
        active, high, _, equal, _ = self.status
        lam, shift, cost = iterate.multipliers, np.zeros(active.size), 0.0
        for entry, upper in self.conditions[name]:
            k, scale = entry.number, entry.place.scale
            cost -= (lam[k] if equal[k] or (lam[k] > 0) == upper else 0.0) / scale
            if active[k] and (equal[k] or bool(high[k]) == upper):
                shift[k] = 1.0 / scale
        unit = self.conditions[name][0][0].unit
        return Change(unit, np.zeros(n), -shift[n:], shift[:n], float(cost))

    def by_number(self, name: str) -> Change:
        """Return the effect of a parameter or of a fixed duration.

        Raises:
            ValueError: derivatives that are not finite, or a parameter that changes the start of a
                mechanism with loops.
        """
        optimum, (unit, at) = self.central, self.numbers[name]
        program, iterate = optimum.transcription.program, optimum.iterate
        now = optimum.values[at]
        sizes = (v.nominal for span in optimum.transcription.problem.spans for v in span.model.p
                 if v.name == name)  # fmt: skip
        h = STEP * (float(np.abs(now).max()) or next(sizes, 1.0))

        def lagrangian(times: int) -> Array:
            values = optimum.values.copy()
            values[at] += times * h
            f, slope = program.gradient(iterate.w, values)
            g, J = program.jacobian(iterate.w, values)
            total = ca.vec(ca.densify(slope)) + J.T @ iterate.lam_g
            return np.concatenate([np.array(part).ravel() for part in (f, total, g)])

        one, two = (lagrangian(k) - lagrangian(-k) for k in (1, 2))
        rate = (8.0 * one - two) / (12.0 * h)
        if not np.isfinite(rate).all():
            raise ValueError(
                f"{self.name}: expected finite derivatives by {name}, got others within "
                f"{2 * h:.3g} {unit} of its value"
            )
        n, bounds = iterate.w.size, self._starts(name)
        cost = float(rate[0] + iterate.lam_g @ rate[n + 1 :] - iterate.lam_w @ bounds)
        return Change(unit, rate[1 : n + 1], rate[n + 1 :], bounds, cost)

    def _starts(self, name: str) -> Array:
        """Return the derivative of the bounds of w by a parameter on which start values depend."""
        made = self.optimum.transcription
        bounds = np.zeros(made.layout.size)
        for span, own in zip(made.problem.spans, made.layout.spans, strict=True):
            p = {v.name: value for v, value in zip(span.model.p, span.p, strict=True)}
            if span.phase or name not in p:
                continue
            mechanics, i = span.model.holonomic, [*p].index(name)
            if mechanics and ca.depends_on(mechanics.phi, span.model.p[i].symbol):
                raise ValueError(
                    f"{self.name}: expected a parameter that leaves closed loops closed, got {name}"
                )
            given = {n: span.nodes[0.0][n][0] for n in made.problem.chain[0].start
                     if n in span.nodes[0.0] and fixed(span.nodes[0.0][n])}  # fmt: skip
            slopes = span.model.start_slopes(given, p)[0][:, i]
            for k, v in enumerate(span.model.x):
                if v.name not in made.problem.chain[0].start and fixed(span.nodes[0.0][v.name]):
                    bounds[own.nodes[k, 0]] = slopes[k]
        return bounds / made.program.scale

    def by(self, name: str) -> tuple[Change, Array]:
        """Return the effect of a number and the derivative of the scaled unknowns by it.

        The derivative is NaN if the linear equations have no unique solution.

        Raises:
            ValueError: an unknown name, or derivatives that are not finite.
        """
        names = offered([*self.numbers, *self.conditions], [name])
        check_names("sensitivity", [name], names)
        change = self.by_condition(name) if name in self.conditions else self.by_number(name)
        moved = change.bounds.copy()
        right = change.gradient / self.optimum.size + self.hessian @ moved
        rows = change.rows + self.optimum.rows[1] @ moved
        right = -np.concatenate([right[self.free], rows[self.held]])
        found = self.equations.solved(right)
        moved[self.free] = np.nan if found is None else found[: self.free.size]
        return change, moved

    def sensitivity(self, name: str, motion: ScenarioMotion) -> Sensitivity:
        """Return the derivatives by a parameter or a prescribed value, at times of `motion`."""
        change, moved = self.by(name)
        made, moved = self.optimum.transcription, moved * self.optimum.transcription.program.scale
        changed = self.numbers[name][1] if name in self.numbers else ()
        parts: list[SpanPoints] = []
        for number, own in enumerate(made.layout.spans):
            T = self.optimum.offset(number) + len(made.problem.spans[number].model.p)
            rate = moved[own.T] if own.T >= 0 else float(T in changed)
            groups = (own.nodes, own.inner, own.z, own.u)
            parts.append(SpanPoints(float(rate), *(moved[columns] for columns in groups)))
        rates = self.optimum.over_time(parts, "xzu")
        times = self.optimum.over_time(self.optimum.points.spans, "")["t"]
        rates = at_times(motion, times, rates)
        chosen = zip(made.problem.chosen, moved[made.layout.chosen].tolist(), strict=True)
        return Sensitivity(
            name, change.unit, change.cost, float(rates["t"][-1]),
            {choice.name: rate for choice, rate in chosen},
            rates["t"], {n: row for n, row in rates.items() if n in motion.signals}, self.doubts,
        )  # fmt: skip

    @property
    def regular(self) -> bool:
        """True if the linear equations have a unique solution, at a strict minimum."""
        return self.equations.number < LARGE and self.equations.sufficient

    @property
    def doubts(self) -> tuple[str, ...]:
        """Reasons why derivatives may be wrong."""
        weak = (f"weakly active: {', '.join(self.weak)}",) if self.weak else ()
        if not self.equations.sufficient:
            return *weak, "second-order conditions not met: the motion may not be unique"
        many = "active conditions depend on each other: multipliers are not unique"
        return (*weak, many) if self.equations.number > LARGE else weak

    @property
    def condition(self) -> Condition:
        """Condition of the optimum."""
        size, free, held = self.optimum.iterate.w.size, self.free.size, self.held.size
        known = size, held + size - free, free - held, self.optimum.residual
        equations = self.equations
        return Condition(*known, equations.number, equations.sufficient, self.weak)


KEPT = 2
"""Number of optima whose conditions are cached, as several properties of a solution need them."""
STEPS = 10
CONVERGED, CLOSE = 1e-8, 1e-5
"""Change of scaled unknowns by the last step, and largest relative change of the cost."""
MOST = 2
"""Number of conditions that may be given up, in multiples of the number that are too many."""
SHARP, MOST_ITERATIONS = 1e-11, 30
"""Tolerance and most iterations of a repeated solve if conditions are uncertain."""
NEAREST = 1e-3
"""Least ratio of multiplier and distance of a condition that may count as active."""


def determined(optimum: Optimum) -> Linearised:
    """Return the optimality conditions with active conditions that determine a strict minimum.

    Near a switch of a bang-bang control both multiplier and distance from the bound are small. If
    active conditions are too few or too many, those that are nearest to the limit are changed.
    """
    plain = Linearised(optimum)
    if plain.regular:
        return plain
    active, _, _, fixed, ratio = plain.status
    spare = plain.free.size - plain.held.size
    near = ~active & (ratio > NEAREST) if spare > 0 else active & ~fixed
    order = np.argsort(np.where(near, -ratio if spare > 0 else ratio, np.inf))
    order = order[: min(int(near.sum()), max(spare, -MOST * spare))]
    few, many = 0, order.size
    if not Linearised(optimum, order).regular:
        return plain
    while many - few > 1:
        middle = (few + many) // 2
        enough = Linearised(optimum, order[:middle]).regular
        few, many = (few, middle) if enough else (middle, many)
    return Linearised(optimum, order[:many])


@lru_cache(KEPT)
def polished(optimum: Optimum) -> Linearised:
    """Return the optimality conditions at an optimum of full precision.

    A primal-dual active set method makes a condition active where it is violated, and inactive
    where its multiplier has the wrong sign. If active conditions do not determine a strict minimum,
    if this does not converge, or if it changes the cost, the optimum of the solver is kept.

    Source: Hintermueller, Ito and Kunisch, SIAM J. Optimization 13(3), 2002, 865-888.

    Raises:
        ValueError: the point does not satisfy the optimality conditions.
    """
    first = determined(optimum)
    if first.weak or not first.regular:
        first = determined(_sharper(optimum))
    now = first
    for _ in range(STEPS if first.regular else 0):
        if (step := now.stepped()) is None or not step.residual <= STATIONARY:
            break
        later, change = determined(step), np.abs(step.iterate.w - now.optimum.iterate.w).max()
        same = np.array_equal(now.free, later.free) and np.array_equal(now.held, later.held)
        if same and change < CONVERGED:
            violation = worst_of(step.transcription.program, step.iterate.w, step.rows[0])
            near = abs(step.cost - optimum.cost) <= CLOSE * max(abs(optimum.cost), optimum.size)
            return replace(later, source=first.optimum) if near and violation < CLOSE else first
        now = later
    return first


def _sharper(optimum: Optimum) -> Optimum:
    """Return the optimum with smaller errors, in which more conditions are certain."""
    program = optimum.transcription.program
    solver = Ipopt(tol=SHARP, obj_scaling_factor=1.0 / optimum.size, max_iter=MOST_ITERATIONS)
    outcome = solver.prepared(program).run(optimum.iterate, optimum.values, warm=True)
    return replace(optimum, iterate=outcome.iterate) if outcome.status.ok else optimum
