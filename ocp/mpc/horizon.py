"""Horizon of a controller: expressions of one interval, derived from a problem of one phase.

    x_(k+1) = F(x_k, u_k),   cost = sum_k h [sum_i w_i r_i^2 + L] + E(x_N),   v >= 0

Terms with inputs are evaluated at (x_k, u_k), and terms without inputs at x_(k+1), because the
measured state cannot be changed. Each bound is a row v >= 0 in units of its signal. Bounds that
depend only on inputs are hard. Other bounds are soft, so that each quadratic program has a
solution; the penalty rho s + sigma s^2 / 2 of a violation s is exact if rho exceeds the multiplier.
"""

from collections.abc import Iterable
from math import inf, isfinite
from typing import NamedTuple, final

import casadi as ca
import numpy as np

from ocp.formulation.phase import Free, Row, Span
from ocp.formulation.problem import Problem
from symfric.foundation import checks
from symfric.foundation.variable import stacked
from symfric.integrator.stepper import flow
from symfric.model import Model

Terms = Iterable[tuple[float, ca.SX]]

MOST_STEPS = 10_000
FLAT = 1e-6
"""Curvature, relative to the largest one, that is added for an input without curvature."""


class Limit(NamedTuple):
    """Bound as a row v = sign (e - bound) / unit >= 0.

    Attributes:
        name: "lower" or "upper", and the subject of the bound.
        expression: e in the symbols of the horizon.
        sign: 1 for a lower bound, -1 for an upper one.
        bound: default value of the bound, which is a parameter at run time.
        unit: typical magnitude by which the row is divided.
        soft: True if a violation is only penalised.
    """

    name: str
    expression: ca.SX
    sign: float
    bound: float
    unit: float
    soft: bool


class Costs(NamedTuple):
    """Value, gradient and Gauss-Newton Hessian of a part of the cost."""

    value: ca.SX
    gradient: ca.SX
    hessian: ca.SX


@final
class Horizon:
    """One interval and the end of the horizon, in symbols of their own.

    Attributes:
        model: model of the controller.
        step, count: length h [s] and number N of the intervals.
        references: names of the parameters that may vary from interval to interval.
        parameters: names of the other parameters.
        x, u, after: states at the beginning, inputs, and states at the end of an interval.
        t, r, r_after, p: time at the beginning, references at beginning and end, parameters.
        advance: function (x, u, r, p) -> x of one of the `substeps` of F.
        early, late: cost as a function of (x, u), and of `after`.
        end: cost at the end of the horizon as a function of `x`.
        limits: rows of an interval; rows without inputs are functions of `after`.
        end_limits: rows of the end of the horizon as functions of `x`.
        b: bounds of `limits` and `end_limits`.
        v, v_end: values of these rows.
        curvature: smallest own curvature of the cost in an input, per nominal^2, which is the unit
            of residuals.
        weight: largest own curvature of an interval, per nominal^2.
    """

    def __init__(self, problem: Problem, step: float, *, method: str, steps: int) -> None:
        """Derive the horizon from a problem of one phase with a fixed duration.

        Args:
            problem: problem whose duration is an integer multiple of `step`.
            step: length of an interval [s].
            method, steps: method and number of steps of `flow` for one interval.

        Raises:
            ValueError: all unsupported features.
        """
        self.step = step = checks.number("to_mpc: step", step, unit="s", above=0.0)
        self.substeps = checks.count("to_mpc: steps", steps)
        span, self.count = _checked(problem, step)
        self.model = model = span.model
        costs = [cost for cost in (problem.cost, problem.chain[0].cost) if cost is not None]
        varying = {name for cost in costs for name in cost.references}
        self.references = tuple(v.name for v in model.p if v.name in varying)
        self.parameters = tuple(v.name for v in model.p if v.name not in varying)
        self.x, self.after = ca.SX.sym("x", len(model.x)), ca.SX.sym("after", len(model.x))
        self.u, self.t = ca.SX.sym("u", len(model.u)), ca.SX.sym("t")
        self.p = ca.SX.sym("p", len(self.parameters))
        self.r, self.r_after = (ca.SX.sym(n, len(self.references)) for n in ("r", "r_after"))
        self.advance = self._advance(method, step / self.substeps)
        squares = [(w * step, e) for w, e in span.squares]
        rest = span.running - sum((w * e**2 for w, e in span.squares), ca.SX(0))
        others = [(step, ca.simplify(rest))] if any(cost.running for cost in costs) else []
        where, inputs = f"to_mpc '{model.name}'", model.vector("u")
        parts: list[Costs] = []
        for with_inputs, place, v in (
            (True, self._early, ca.vertcat(self.x, self.u)),
            (False, self._late, self.after),
        ):
            both = (
                [(w, place(e)) for w, e in terms if ca.depends_on(e, inputs) == with_inputs]
                for terms in (squares, others)
            )
            parts.append(_costs(where, v, *both))
        self.early, self.late = parts
        self.end = _costs(f"{where}: end", self.x, (), [(1.0, self._early(span.end))])
        self.curvature, self.weight = self._curvatures()
        own = ca.diag(self.early.hessian)
        for i, nominal in enumerate(model.nominal("u"), start=len(model.x)):
            if own[i].is_zero():
                self.early.hessian[i, i] = FLAT * self.weight / nominal**2
        self.limits, self.end_limits = self._limits(span, at_end=False), self._limits(span, True)
        both = (*self.limits, *self.end_limits)
        self.b = ca.SX.sym("b", len(both))
        rows = [a.sign * (a.expression - self.b[i]) / a.unit for i, a in enumerate(both)]
        first = len(self.limits)
        self.v, self.v_end = stacked(rows[:first]), stacked(rows[first:])

    def __repr__(self) -> str:
        return f"<horizon of '{self.model.name}', {self.count} intervals of {self.step:g} s>"

    @property
    def all_limits(self) -> tuple[Limit, ...]:
        """Rows of an interval and of the end."""
        return *self.limits, *self.end_limits

    def _all_parameters(self, r: ca.SX) -> ca.SX:
        """Return all parameters in the order of the model, with references from `r`."""
        values = {name: r[i] for i, name in enumerate(self.references)}
        values |= {name: self.p[i] for i, name in enumerate(self.parameters)}
        return stacked(values[v.name] for v in self.model.p)

    def _early(self, expression: ca.SX) -> ca.SX:
        """Return an expression at the beginning of the interval, with its inputs."""
        return self._at(expression, self.t, self.x, self.u, self._all_parameters(self.r))

    def _late(self, expression: ca.SX) -> ca.SX:
        """Return an expression without inputs at the end of the interval."""
        t, p = self.t + self.step, self._all_parameters(self.r_after)
        return self._at(expression, t, self.after, self.u, p)

    def _at(self, expression: ca.SX, *values: ca.SX) -> ca.SX:
        symbols = [self.model.t, *(self.model.vector(letter) for letter in "xup")]
        return ca.Function("at", symbols, [expression])(*values)

    def _advance(self, method: str, h: float) -> ca.Function:
        """Return (x, u, r, p) -> x after a step of h [s] of `flow`, as an SX Function.

        Accelerations of a mechanism are explicit, because unknowns would need a start.

        Raises:
            ValueError: see `flow`.
        """
        m = self.model
        if m.holonomic is not None:
            m = Model(m.name, m.x, (), m.u, m.p, m.ode, events=m.events, t=m.t)
        after = flow(m, steps=1, method=method).expand()
        after = ca.densify(after(self.x, self.u, self._all_parameters(self.r), h))
        return ca.Function("advance", [self.x, self.u, self.r, self.p], [after], {"cse": True})

    def _curvatures(self) -> tuple[float, float]:
        """Return the smallest own curvature in an input and the largest one, per nominal^2."""
        model, nx, nu = self.model, len(self.model.x), len(self.model.u)
        nominal = np.concatenate([model.nominal(letter) for letter in "xuxx"])
        diagonal = ca.vertcat(*(ca.diag(c.hessian) for c in (self.early, self.late, self.end)))
        symbols = [self.x, self.u, self.after, self.r, self.r_after, self.p, self.t]
        start, p = model.initial_state(), model.values("p")
        varying = [i for i, v in enumerate(model.p) if v.name in self.references]
        r, rest = p[varying], np.delete(p, varying)
        values = ca.Function("diagonal", symbols, [ca.densify(diagonal)]).call(
            [start, model.values("u"), start, r, r, rest, 0.0]
        )[0]
        scaled = np.abs(values.full().ravel() * nominal**2)
        largest = float(scaled.max(initial=0.0)) or 1.0
        return max(float(scaled[nx : nx + nu].min()), FLAT * largest), largest

    def _limits(self, span: Span, at_end: bool) -> tuple[Limit, ...]:
        """Return the bounds over an interval, or at the end; only bounds on inputs are hard."""
        model, limits = span.model, list[Limit]()
        boxes = span.nodes.get(1.0, {}) if at_end else span.boxes
        rows: list[tuple[Row, float]] = []
        for v in (*model.x, *model.u):
            low, high = boxes.get(v.name, (-inf, inf))
            if at_end and (low, high) == span.boxes.get(v.name):
                continue  # enforced on the whole horizon
            half = 0.5 * (high - low)
            unit = half if isfinite(half) and half > 0.0 else v.nominal
            rows.append((Row(f"bound on {v.name}", v.symbol, low, high), unit))
        rows += [(row, row.nominal) for row in (span.rows_at.get(1.0, ()) if at_end else span.path)]
        inputs, others = model.vector("u"), ca.vertcat(model.t, *map(model.vector, "xp"))
        for row, unit in rows:
            early = at_end or ca.depends_on(row.expression, inputs)
            expression = (self._early if early else self._late)(row.expression)
            soft = at_end or ca.depends_on(row.expression, others)
            for side, sign, bound in (("lower", 1.0, row.lower), ("upper", -1.0, row.upper)):
                if isfinite(bound):
                    name = f"{side} {row.name}"
                    limits.append(Limit(name, expression, sign, bound, unit, soft))
        return tuple(limits)


def _costs(where: str, v: ca.SX, squares: Terms, others: Terms) -> Costs:
    """Return the sum of w r^2 and of w e as a function of v, with convex quadratic e.

    The Hessian does not contain the curvature of r.

    Raises:
        ValueError: the Hessian of an e is not constant or has a negative eigenvalue.
    """
    value, gradient, hessian = ca.SX(0), ca.SX(v.numel(), 1), ca.SX(v.numel(), v.numel())
    for weight, r in squares:
        slope = ca.jacobian(r, v)
        value += weight * r**2
        gradient += 2 * weight * r * slope.T
        hessian += 2 * weight * (slope.T @ slope)
    for weight, e in others:
        second, slope = ca.hessian(weight * e, v)
        second = ca.simplify(second)
        if ca.symvar(second):
            raise ValueError(
                f"{where}: expected squares or a convex quadratic cost, got one whose second "
                "derivative varies; write it as track(name, reference, weight) or effort(name, "
                "weight)"
            )
        H = ca.DM(second)
        least = float(np.linalg.eigvalsh(H.full()).min(initial=0.0))
        if least < -1e-9 * float(np.abs(H.full()).max(initial=1e-300)):
            text = f"{where}: expected a convex cost, got a second derivative of {least:g}"
            raise ValueError(text)
        value, gradient = value + weight * e, gradient + slope
        hessian += ca.sparsify(ca.SX(H))
    return Costs(value, gradient, hessian)


def _checked(problem: Problem, step: float) -> tuple[Span, int]:
    """Return the only phase of the problem, and its number of intervals.

    Raises:
        ValueError: all unsupported features, at once.
    """
    spans, problems, count = problem.spans, list[str](), 0
    span = spans[0]
    model, T = span.model, span.T
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
    kinds = {
        "absolute(...)": span.absolutes,
        "soft conditions": span.softened,
        "totals": problem.totals,
        "largest(...) or complementary(...)": [row for row in span.path if row.parts],
        "soft ends": [row for rows in span.rows_at.values() for row in rows if row.parts],
    }
    if unable := [kind for kind, found in kinds.items() if found]:
        problems.append(f"expected none of {', '.join(kinds)}, got {', '.join(unable)}")
    costs = (problem.cost, problem.chain[0].cost)
    if not any(cost and (cost.squares or cost.running or cost.end) for cost in costs):
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
    if isinstance(T, Free):
        problems.append("expected a fixed duration T, which is the horizon, got Free")
    else:
        count = round(T / step)
        if count < 1 or count > MOST_STEPS or abs(count * step - T) > 1e-6 * T:
            problems.append(
                f"expected T as a whole number of steps, got {T:g} s and a step of {step:g} s"
            )
    if problems:
        raise ValueError(f"to_mpc '{model.name}': " + "; ".join(problems))
    return span, count
