"""The horizon of a controller: an interval as expressions, from a problem of one phase.

    x_(k+1) = F(x_k, u_k),   cost = sum_k h [sum_i w_i r_i^2 + L] + E(x_N),   v >= 0

Terms with inputs are evaluated at (x_k, u_k), terms of states alone at x_(k+1): the measured state
cannot be changed. Each bound is a row v >= 0 in units of its signal. Bounds on inputs
alone are hard; all others are soft, with the penalty rho s + sigma s^2 / 2 on a violation s, exact
if rho is larger than the multiplier: so every quadratic program has a solution.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import isfinite
from typing import final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ocp.formulation.expressions import Cost
from ocp.formulation.phase import Free, Row, Span
from ocp.formulation.problem import Problem
from symfric.foundation import checks
from symfric.foundation.variable import stacked
from symfric.integrator.stepper import flow
from symfric.model import Model

Array = NDArray[np.float64]

MOST_STEPS = 10_000
FLAT = 1e-6
"""Curvature added for an input without one in the cost, relative to the largest one."""


@final
@dataclass(frozen=True, eq=False)
class Limit:
    """A bound as a row v = sign (e - bound) / unit >= 0.

    Attributes:
        name: its subject, with "lower" or "upper" in front.
        bound: its value; a parameter at run time.
        soft: whether it may be violated with a penalty.
    """

    name: str
    expression: ca.SX
    sign: float
    bound: float
    unit: float
    soft: bool


@final
@dataclass(frozen=True, eq=False)
class Costs:
    """Value, gradient and Gauss-Newton Hessian of a share of the cost, in symbols `of`."""

    value: ca.SX
    gradient: ca.SX
    hessian: ca.SX


@final
@dataclass(frozen=True, eq=False)
class Horizon:
    """An interval and the end of the horizon in separate symbols.

    Attributes:
        model: of the controller.
        count: number of intervals N.
        step: their length h [s].
        references: names of the parameters that may differ from interval to interval.
        x, u, after: states at the beginning, inputs, states at the end, SX columns.
        t, r, r_after, p, b: time at the beginning, references at beginning and end, the other
            parameters, bounds of `limits` and `end_limits`.
        advance: one of the `substeps` of an interval, (x, u, r, p) -> x; F consists of all of them.
        early, late: cost in (x, u), and in `after`; `end` in `x`: at the end of the horizon.
        limits: rows of an interval; rows of states alone use `after`.
        end_limits: rows in `x` at the end of the horizon.
        curvature: smallest own curvature of the cost in an input, per nominal^2: the unit of
            residuals.
        weight: largest curvature of an interval, per nominal^2.
    """

    model: Model
    count: int
    step: float
    references: tuple[str, ...]
    x: ca.SX
    u: ca.SX
    after: ca.SX
    t: ca.SX
    r: ca.SX
    r_after: ca.SX
    p: ca.SX
    b: ca.SX
    advance: ca.Function
    substeps: int
    early: Costs
    late: Costs
    end: Costs
    limits: tuple[Limit, ...]
    end_limits: tuple[Limit, ...]
    curvature: float
    weight: float

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of `p`."""
        return tuple(v.name for v in self.model.p if v.name not in self.references)


@final
class Places:
    """Expressions in the symbols of a model, evaluated at the start or the end of an interval."""

    def __init__(self, model: Model, references: Sequence[str], step: float) -> None:
        self.x, self.u, self.after = (
            ca.SX.sym(name, len(group))
            for name, group in (("x", model.x), ("u", model.u), ("after", model.x))
        )
        self.t, self.p = ca.SX.sym("t"), ca.SX.sym("p", len(model.p) - len(references))
        self.r, self.r_after = (ca.SX.sym(n, len(references)) for n in ("r", "r_after"))
        self.references = tuple(references)
        self._model, self._step = model, step

    def parameters(self, r: ca.SX) -> ca.SX:
        """Return all parameters in the order of the model."""
        given = {name: r[i] for i, name in enumerate(self.references)}
        rest = iter(ca.vertsplit(self.p) if self.p.numel() else [])
        return stacked(given[v.name] if v.name in given else next(rest) for v in self._model.p)

    def early(self, expression: ca.SX) -> ca.SX:
        """Evaluate at the beginning, with the inputs of the interval."""
        return self._taken(expression, self.t, self.x, self.u, self.parameters(self.r))

    def late(self, expression: ca.SX) -> ca.SX:
        """Evaluate at the end of the interval; for expressions without inputs."""
        t = self.t + self._step
        return self._taken(expression, t, self.after, self.u, self.parameters(self.r_after))

    def _taken(self, expression: ca.SX, *values: ca.SX) -> ca.SX:
        model = self._model
        symbols = [model.t, *(model.vector(letter) for letter in "xup")]
        return ca.Function("taken", symbols, [expression])(*values)


def squares(terms: Iterable[tuple[float, ca.SX]], v: ca.SX) -> Costs:
    """Return the sum of weight r^2: value, gradient, and Hessian without the curvature of r."""
    value, gradient = ca.SX(0), ca.SX(v.numel(), 1)
    hessian = ca.SX(v.numel(), v.numel())
    for weight, r in terms:
        slope = ca.jacobian(r, v)
        value += weight * r**2
        gradient += 2 * weight * r * slope.T
        hessian += 2 * weight * (slope.T @ slope)
    return Costs(value, gradient, hessian)


def quadratic(where: str, expression: ca.SX, v: ca.SX) -> Costs:
    """Return the costs of a convex quadratic expression.

    Raises:
        ValueError: its Hessian is not constant or has a negative eigenvalue.
    """
    hessian, gradient = ca.hessian(expression, v)
    hessian = ca.simplify(hessian)
    if ca.symvar(hessian):
        raise ValueError(
            f"{where}: expected squares or a convex quadratic cost, got one whose second "
            "derivative varies; write it as track(name, reference, weight) or effort(name, weight)"
        )
    least = float(np.linalg.eigvalsh(ca.DM(hessian).full()).min(initial=0.0))
    if least < -1e-9 * float(np.abs(ca.DM(hessian).full()).max(initial=1e-300)):
        raise ValueError(f"{where}: expected a convex cost, got a second derivative of {least:g}")
    return Costs(expression, gradient, ca.sparsify(ca.SX(ca.DM(hessian))))


def total(costs: Iterable[Costs], n: int) -> Costs:
    """Return the sum of costs in the same n symbols."""
    found = Costs(ca.SX(0), ca.SX(n, 1), ca.SX(n, n))
    for c in costs:
        found = Costs(found.value + c.value, found.gradient + c.gradient, found.hessian + c.hessian)
    return found


def sides(row: Row, unit: float, *, soft: bool) -> list[Limit]:
    """Return the finite bounds of a row."""
    ends = (("lower", 1.0, row.lower), ("upper", -1.0, row.upper))
    return [
        Limit(f"{name} {row.name}", row.expression, sign, bound, unit, soft)
        for name, sign, bound in ends
        if isfinite(bound)
    ]


def box_rows(span: Span, fraction: float | None = None) -> list[tuple[Row, float]]:
    """Return (row, unit) of the bounds of states and inputs, or of states at a fraction of T."""
    found: list[tuple[Row, float]] = []
    model = span.model
    boxes: Mapping[str, tuple[float, float]] = (
        span.boxes if fraction is None else span.nodes.get(fraction, {})
    )
    for v in (*model.x, *model.u):
        low, high = boxes.get(v.name, (-np.inf, np.inf))
        if fraction is not None and (low, high) == span.boxes.get(v.name):
            continue  # enforced on the whole horizon
        half = 0.5 * (high - low)
        unit = half if isfinite(half) and half > 0.0 else v.nominal
        if low > -np.inf or high < np.inf:
            found.append((Row(f"bound on {v.name}", v.symbol, low, high), unit))
    return found


def horizon_of(problem: Problem, step: float, *, method: str, steps: int) -> Horizon:
    """Return the horizon of a problem of one phase.

    Args:
        problem: with a fixed duration T, an integer multiple of `step`.
        step: [s].
        method, steps: of `flow`, for one interval.

    Raises:
        ValueError: all unsupported features, at once.
    """
    step = checks.number("to_mpc: step", step, unit="s", above=0.0)
    steps = checks.count("to_mpc: steps", steps)
    span, count = _span(problem, step)
    model = span.model
    followed = {name for cost in _costs(problem) for name in cost.references}
    references = tuple(v.name for v in model.p if v.name in followed)
    at = Places(model, references, step)
    inputs = model.vector("u")
    terms = [(w * step, e) for w, e in span.squares]
    rest = [(w * step, e) for w, e in _others(problem, span)]
    where = f"to_mpc '{model.name}'"
    early, late = _split(where, at, inputs, terms, rest)
    end = quadratic(f"{where}: end", at.early(span.end), at.x)
    curvature, weight = _curvatures(at, model, early, late, end)
    small = FLAT * weight / model.nominal("u") ** 2
    own = ca.diag(early.hessian)[len(model.x) :]
    bare = [i for i in range(len(model.u)) if own[i].is_zero()]
    for i in bare:
        k = len(model.x) + i
        early.hessian[k, k] = small[i]
    limits = _limits(span)
    end_limits = _limits(span, 1.0)
    return Horizon(
        model=model,
        count=count,
        step=step,
        references=references,
        x=at.x,
        u=at.u,
        after=at.after,
        t=at.t,
        r=at.r,
        r_after=at.r_after,
        p=at.p,
        b=ca.SX.sym("b", len(limits) + len(end_limits)),
        advance=_advance(at, model, method, step / steps),
        substeps=steps,
        early=early,
        late=late,
        end=end,
        limits=tuple(_placed(limit, at, inputs) for limit in limits),
        end_limits=tuple(_placed(limit, at, None) for limit in end_limits),
        curvature=curvature,
        weight=weight,
    )


def _split(
    where: str,
    at: Places,
    inputs: ca.SX,
    squared: list[tuple[float, ca.SX]],
    others: list[tuple[float, ca.SX]],
) -> tuple[Costs, Costs]:
    """Return the costs of an interval: terms with inputs at its begin, the others at its end."""

    def share(moving: bool, place: Callable[[ca.SX], ca.SX], v: ca.SX) -> Costs:
        mine = [(w, place(e)) for w, e in squared if ca.depends_on(e, inputs) == moving]
        rest = [(w, place(e)) for w, e in others if ca.depends_on(e, inputs) == moving]
        return total([squares(mine, v), *(quadratic(where, w * e, v) for w, e in rest)], v.numel())

    return share(True, at.early, ca.vertcat(at.x, at.u)), share(False, at.late, at.after)


def _advance(at: Places, model: Model, method: str, h: float) -> ca.Function:
    """Return (x, u, r, p) -> x after a step of h [s] of `flow`, as an SX Function.

    Accelerations of a mechanism are explicit, not unknowns that need a start.

    Raises:
        ValueError: see `flow`.
    """
    if model.holonomic is not None:
        x, u, p, ode = model.x, model.u, model.p, model.ode
        model = Model(model.name, x, (), u, p, ode, events=model.events, t=model.t)
    following = flow(model, steps=1, method=method).expand()
    found = following(at.x, at.u, at.parameters(at.r), h)
    return ca.Function("advance", [at.x, at.u, at.r, at.p], [ca.densify(found)], {"cse": True})


def _span(problem: Problem, step: float) -> tuple[Span, int]:
    """Return the only phase of the problem, and its number of intervals."""
    spans = problem.spans
    span = spans[0]
    model, problems = span.model, list[str]()
    if len(spans) > 1:
        problems.append(
            f"expected one phase and no scenarios, got {len(spans)} phases in all scenarios"
        )
    if span.chosen:
        problems.append(f"expected no chosen parameters, got {', '.join(span.chosen)}")
    if problem.periodic:
        problems.append("expected no periodic states, which are meaningless from a measured state")
    if set(span.nodes) | set(span.rows_at) > {0.0, 1.0}:
        problems.append("expected no via points: the horizon moves; use a reference over time")
    held = sorted({n for at in span.inputs_at.values() for n in at if at[n] != span.boxes.get(n)})
    if held:
        problems.append(f"expected no values of inputs at the ends, got {', '.join(held)}")
    if not any(c.squares or c.running or c.end for c in _costs(problem)):
        problems.append("expected a cost, such as track(name, reference, weight), got none")
    if model.z:
        names = ", ".join(v.name for v in model.z)
        problems.append(f"expected no algebraic variables, got {names}; eliminate them")
    if not model.u:
        problems.append("expected a model with inputs, got none")
    if not model.x or model.ode is None:
        problems.append("expected an explicit model with states")
    elif ca.depends_on(model.ode, model.t):
        problems.append(
            "expected equations without time, got some that depend on it; make time a state"
        )
    count = 0
    if isinstance(span.T, Free):
        problems.append("expected a fixed duration T, which is the horizon, got Free")
    else:
        count = round(span.T / step)
        if count < 1 or count > MOST_STEPS or abs(count * step - span.T) > 1e-6 * span.T:
            problems.append(
                f"expected T as a whole number of steps, got {span.T:g} s and a step of {step:g} s"
            )
    if problems:
        raise ValueError(f"to_mpc '{model.name}': " + "; ".join(problems))
    return span, count


def _costs(problem: Problem) -> list[Cost]:
    """Return the costs of the only phase."""
    return [cost for cost in (problem.cost, problem.chain[0].cost) if cost is not None]


def _others(problem: Problem, span: Span) -> list[tuple[float, ca.SX]]:
    """Return terms of the running cost that are not squares."""
    rest = span.running - sum((w * e**2 for w, e in span.squares), ca.SX(0))
    if not any(cost.running for cost in _costs(problem)):
        return []
    return [(1.0, ca.simplify(rest))]


def _curvatures(
    at: Places, model: Model, early: Costs, late: Costs, end: Costs
) -> tuple[float, float]:
    """Return the smallest own curvature in an input, and the largest of all, per nominal^2."""
    nominal = np.concatenate([model.nominal("x"), model.nominal("u"), *2 * [model.nominal("x")]])
    diagonal = ca.vertcat(*(ca.diag(c.hessian) for c in (early, late, end)))
    symbols = [at.x, at.u, at.after, at.r, at.r_after, at.p, at.t]
    start, p = model.initial_state(), model.values("p")
    goals = [i for i, v in enumerate(model.p) if v.name in at.references]
    r, rest = p[goals], np.delete(p, goals)
    values = ca.Function("diagonal", symbols, [ca.densify(diagonal)]).call(
        [start, model.values("u"), start, r, r, rest, 0.0]
    )[0]
    scaled = values.full().ravel() * nominal**2
    largest = float(np.abs(scaled).max(initial=0.0)) or 1.0
    own = np.abs(scaled[len(model.x) : len(model.x) + len(model.u)])
    return max(float(own.min()), FLAT * largest), largest


def _limits(span: Span, fraction: float | None = None) -> list[Limit]:
    """Return bounds over an interval, hard for inputs alone; or at a fraction of T, soft."""
    further = span.path if fraction is None else span.rows_at.get(fraction, ())
    symbols = {v.symbol.__hash__() for v in span.model.u}
    found: list[Limit] = []
    for row, unit in [*box_rows(span, fraction), *((row, row.nominal) for row in further)]:
        inputs = all(s.__hash__() in symbols for s in ca.symvar(row.expression))
        found += sides(row, unit, soft=fraction is not None or not inputs)
    return found


def _placed(limit: Limit, at: Places, inputs: ca.SX | None) -> Limit:
    """Return the limit at its place in the interval."""
    moving = inputs is None or ca.depends_on(limit.expression, inputs)
    placed = (at.early if moving else at.late)(limit.expression)
    return Limit(limit.name, placed, limit.sign, limit.bound, limit.unit, limit.soft)
