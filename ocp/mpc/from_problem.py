"""The horizon of a controller from a problem; parts that no controller takes are refused."""

from collections.abc import Callable

import casadi as ca
import numpy as np

from ocp.formulation.bounds import Free
from ocp.formulation.expressions import Cost
from ocp.formulation.phase import Row, Span
from ocp.formulation.problem import Problem
from ocp.mpc.horizon import (
    FLAT,
    Costs,
    Horizon,
    Limit,
    Places,
    box_rows,
    quadratic,
    sides,
    squares,
    step_function,
    total,
)
from symfric.foundation import checks
from symfric.model import Model

MOST_STEPS = 10_000


def horizon_of(problem: Problem, step: float, *, method: str, steps: int) -> Horizon:
    """The horizon of a problem of one phase.

    Args:
        problem: with a fixed duration T, a whole number of times `step`.
        step: [s].
        method, steps: of `flow`, for one interval.

    Raises:
        ValueError: all that a controller cannot take, at once.
    """
    step = checks.number("to_mpc: step", step, unit="s", above=0.0)
    steps = checks.count("to_mpc: steps", steps)
    span, count = _span(problem, step)
    references = _references(problem, span)
    model = span.model
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
    end_limits = _end_limits(span)
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
        advance=_advance(at, step_function(model, method), step / steps),
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
    """Costs of an interval: those with inputs in them at its begin, the others at its end."""

    def share(moving: bool, place: Callable[[ca.SX], ca.SX], v: ca.SX) -> Costs:
        mine = [(w, place(e)) for w, e in squared if ca.depends_on(e, inputs) == moving]
        rest = [(w, place(e)) for w, e in others if ca.depends_on(e, inputs) == moving]
        return total([squares(mine, v), *(quadratic(where, w * e, v) for w, e in rest)], v.numel())

    return share(True, at.early, ca.vertcat(at.x, at.u)), share(False, at.late, at.after)


def _advance(at: Places, following: ca.Function, h: float) -> ca.Function:
    """A step of h [s] with references and other parameters apart."""
    arguments = [at.x, at.u, at.r, at.p]
    found = following(at.x, at.u, at.parameters(at.r), h)
    return ca.Function("advance", arguments, [ca.densify(found)], {"cse": True})


def _span(problem: Problem, step: float) -> tuple[Span, int]:
    """The only span of the problem, and its number of intervals."""
    spans = problem.spans
    span = spans[0]
    model, problems = span.model, list[str]()
    if len(spans) > 1:
        problems.append(f"expected one phase and no scenarios, got {len(spans)} spans")
    if span.chosen:
        problems.append(f"expected no chosen parameters, got {', '.join(span.chosen)}")
    if problem.periodic:
        problems.append("expected nothing periodic, which has no meaning from a measured state")
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
    """The costs that make up the only span's share."""
    return [cost for cost in (problem.cost, problem.chain[0].cost) if cost is not None]


def _references(problem: Problem, span: Span) -> tuple[str, ...]:
    """Parameters that costs follow, in the order of the model."""
    named = {name for cost in _costs(problem) for name in cost.references}
    return tuple(v.name for v in span.model.p if v.name in named)


def _others(problem: Problem, span: Span) -> list[tuple[float, ca.SX]]:
    """What of the running cost is no square."""
    rest = span.running - sum((w * e**2 for w, e in span.squares), ca.SX(0))
    if not any(cost.running for cost in _costs(problem)):
        return []
    return [(1.0, ca.simplify(rest))]


def _curvatures(
    at: Places, model: Model, early: Costs, late: Costs, end: Costs
) -> tuple[float, float]:
    """Smallest own curvature in an input, and largest of all, per nominal^2 at the start."""
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


def _limits(span: Span) -> list[Limit]:
    rows = box_rows(span) + [(row, row.nominal) for row in span.path]
    symbols = {v.symbol.__hash__() for v in span.model.u}
    found: list[Limit] = []
    for row, unit in rows:
        hard = all(s.__hash__() in symbols for s in ca.symvar(row.expression))
        found += sides(row, unit, soft=not hard)
    return found


def _end_limits(span: Span) -> list[Limit]:
    rows: list[tuple[Row, float]] = box_rows(span, 1.0)
    rows += [(row, row.nominal) for row in span.rows_at.get(1.0, ())]
    return [limit for row, unit in rows for limit in sides(row, unit, soft=True)]


def _placed(limit: Limit, at: Places, inputs: ca.SX | None) -> Limit:
    """The limit at the place of the interval where it holds."""
    moving = inputs is None or ca.depends_on(limit.expression, inputs)
    placed = (at.early if moving else at.late)(limit.expression)
    return Limit(limit.name, placed, limit.sign, limit.bound, limit.unit, limit.soft)
