"""One interval of the horizon as expressions: where it leads, what it costs, what it keeps.

    x_(k+1) = F(x_k, u_k),   cost = sum_k h [sum_i w_i r_i^2 + L] + E(x_N),   v >= 0

Terms with inputs in them are taken at (x_k, u_k), those of states alone at x_(k+1): what has been
measured cannot be changed. Each bound is a row v >= 0 in units of its signal. Bounds on inputs
alone are hard; all others are soft, with the penalty rho s + sigma s^2 / 2 on a violation s, exact
where rho is larger than the multiplier: so every quadratic program has a solution.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import isfinite
from typing import final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ocp.formulation.phase import Row, Span
from symfric.foundation.symbols import stacked
from symfric.integrator.flow import flow
from symfric.model import Model

Array = NDArray[np.float64]

FLAT = 1e-6
"""Curvature of the cost in an input that has none of its own, relative to the largest one."""


@final
@dataclass(frozen=True, eq=False)
class Limit:
    """A bound as a row v = sign (e - bound) / unit >= 0.

    Attributes:
        name: what it is about, with "lower" or "upper" in front.
        bound: its number; a parameter at run time.
        soft: whether it may be violated at a price.
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
    """An interval and the end of the horizon in symbols of their own.

    Attributes:
        model: whose equations the controller believes.
        count: number of intervals N.
        step: their length h [s].
        references: names of the parameters that may differ from interval to interval.
        x, u, after: states at the beginning, inputs, states at the end, SX columns.
        t, r, r_after, p, b: time at the beginning, references at beginning and end, the other
            parameters, bounds of `limits` and `end_limits`.
        advance: one of the `substeps` of an interval, (x, u, r, p) -> x; F are all of them.
        early, late: cost in (x, u), and in `after`; `end` in `x`: at the end of the horizon.
        limits: rows of an interval; those of states alone are about `after`.
        end_limits: rows about `x` at the end of the horizon.
        curvature: smallest own curvature of the cost in an input, per nominal^2: what residuals
            are measured with.
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
    """Expressions in the symbols of a model, taken at the beginning or the end of an interval."""

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
        """All parameters in the order of the model."""
        given = {name: r[i] for i, name in enumerate(self.references)}
        rest = iter(ca.vertsplit(self.p) if self.p.numel() else [])
        return stacked(given[v.name] if v.name in given else next(rest) for v in self._model.p)

    def early(self, expression: ca.SX) -> ca.SX:
        """At the beginning, with the inputs of the interval."""
        return self._taken(expression, self.t, self.x, self.u, self.parameters(self.r))

    def late(self, expression: ca.SX) -> ca.SX:
        """At the end of the interval; for expressions without inputs."""
        t = self.t + self._step
        return self._taken(expression, t, self.after, self.u, self.parameters(self.r_after))

    def _taken(self, expression: ca.SX, *values: ca.SX) -> ca.SX:
        model = self._model
        symbols = [model.t, *(model.vector(letter) for letter in "xup")]
        return ca.Function("taken", symbols, [expression])(*values)


def step_function(model: Model, method: str) -> ca.Function:
    """(x, u, p, h) -> x after h: one step of `flow` as an SX Function.

    Accelerations of a mechanism are written out, and are no unknowns whose start must be found.

    Raises:
        ValueError: see `flow`.
    """
    if model.holonomic is not None:
        x, u, p, ode = model.x, model.u, model.p, model.ode
        model = Model(model.name, x, (), u, p, ode, events=model.events, t=model.t)
    return flow(model, steps=1, method=method).expand()


def squares(terms: Iterable[tuple[float, ca.SX]], v: ca.SX) -> Costs:
    """Sum of weight r^2: value, gradient, and Hessian without the curvature of r."""
    value, gradient = ca.SX(0), ca.SX(v.numel(), 1)
    hessian = ca.SX(v.numel(), v.numel())
    for weight, r in terms:
        slope = ca.jacobian(r, v)
        value += weight * r**2
        gradient += 2 * weight * r * slope.T
        hessian += 2 * weight * (slope.T @ slope)
    return Costs(value, gradient, hessian)


def quadratic(where: str, expression: ca.SX, v: ca.SX) -> Costs:
    """A convex quadratic expression.

    Raises:
        ValueError: its Hessian depends on something or has a negative eigenvalue.
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
    """Their sum in the same n symbols."""
    found = Costs(ca.SX(0), ca.SX(n, 1), ca.SX(n, n))
    for c in costs:
        found = Costs(found.value + c.value, found.gradient + c.gradient, found.hessian + c.hessian)
    return found


def sides(row: Row, unit: float, *, soft: bool) -> list[Limit]:
    """The finite bounds of a row."""
    ends = (("lower", 1.0, row.lower), ("upper", -1.0, row.upper))
    return [
        Limit(f"{name} {row.name}", row.expression, sign, bound, unit, soft)
        for name, sign, bound in ends
        if isfinite(bound)
    ]


def box_rows(span: Span, fraction: float | None = None) -> list[tuple[Row, float]]:
    """(row, unit) of the bounds of states and inputs, or of states at a fraction of T."""
    found: list[tuple[Row, float]] = []
    model = span.model
    boxes: Mapping[str, tuple[float, float]] = (
        span.boxes if fraction is None else span.nodes.get(fraction, {})
    )
    for v in (*model.x, *model.u):
        low, high = boxes.get(v.name, (-np.inf, np.inf))
        if fraction is not None and (low, high) == span.boxes.get(v.name):
            continue  # kept on the whole horizon
        half = 0.5 * (high - low)
        unit = half if isfinite(half) and half > 0.0 else v.nominal
        if low > -np.inf or high < np.inf:
            found.append((Row(f"bound on {v.name}", v.symbol, low, high), unit))
    return found
