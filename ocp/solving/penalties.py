"""Cost and violation of the conditions with a penalty in a solution."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple, final

import casadi as ca
import numpy as np

from ocp.formulation.phase import Array, Row, Span
from ocp.formulation.problem import Posed, Problem
from ocp.solving.motion import along_points
from ocp.transcription.schemes import Scheme
from ocp.transcription.unknowns import Points, SpanPoints


@final
@dataclass(frozen=True)
class Penalty:
    """Cost of a soft condition.

    Attributes:
        cost: share in J; with scenarios, in the cost of its scenario.
        violation: largest violation, in the unit of the condition.
        time: time of this violation [s].
    """

    cost: float
    violation: float
    time: float

    def __str__(self) -> str:
        return f"costs {self.cost:.4g}, largest violation {self.violation:.3g} at {self.time:.4g} s"


def penalties_of(
    problem: Problem | Posed, scheme: Scheme, meshes: Sequence[Array], points: Points
) -> dict[str, Penalty]:
    """Return condition -> its penalty at the collocation points, or at its time."""
    found: dict[str, Penalty] = {}
    if not any(span.softened or _soft_rows(span) for span in problem.spans):
        return found
    for at in _phases(problem, scheme, meshes, points):
        span = at.span
        scenario = problem.scenario_names[span.scenario : span.scenario + 1]
        label = ": ".join([*scenario, *[span.name] * (len(problem.chain) > 1), ""])
        for row in span.softened:
            violation, cost = at.of(row.violation), at.of(row.penalty)
            k = int(np.argmax(violation))
            total = float(at.weights @ cost)
            found[label + row.name] = Penalty(total, float(violation[k]), float(at.t[k]))
        for s, row in _soft_rows(span):
            off = ca.Function("off", [span.model.vector("x")], list(row.parts))
            size = max(0.0, float(off(at.own.nodes[:, -1])))  # a constant state
            cost = row.linear * size + row.quadratic * size**2
            found[label + row.name] = Penalty(cost, size, at.begin + s * at.own.T)
    return found


def _soft_rows(span: Span) -> list[tuple[float, Row]]:
    """Return the conditions at nodes with a penalty, with their fractions of T."""
    rows = [(s, row) for s, rows in span.rows_at.items() for row in rows]
    return [(s, row) for s, row in rows if row.linear or row.quadratic]


def largest_product(
    problem: Problem | Posed, scheme: Scheme, meshes: Sequence[Array], points: Points
) -> float:
    """Return the largest product of complementary signals, relative to its typical magnitude."""
    return max(
        float(at.of(row.parts[0] * row.parts[1]).max()) / row.nominal
        for at in _phases(problem, scheme, meshes, points)
        for row in at.span.path
        if row.is_product
    )


class _Phase(NamedTuple):
    """Phase of a solution, with the times and quadrature weights of its collocation points [s]."""

    span: Span
    own: SpanPoints
    begin: float
    t: Array
    weights: Array
    p: Array

    def of(self, expression: ca.SX) -> Array:
        """Return the values of an expression, shape (points,)."""
        return along_points(self.span, self.own, expression, t=self.t, p=self.p)[0]


def _phases(
    problem: Problem | Posed, scheme: Scheme, meshes: Sequence[Array], points: Points
) -> Iterator[_Phase]:
    made, begin = scheme.coefficients(), 0.0
    inside = made.nodes[1:] if made.degree else made.nodes
    for span, mesh, own in zip(problem.spans, meshes, points.spans, strict=True):
        begin = begin if span.phase else 0.0
        lengths = own.T * np.diff(mesh)[:, None]
        t = (begin + own.T * mesh[:-1, None] + lengths * inside).ravel()
        p = [points.chosen.get(v.name, x) for v, x in zip(span.model.p, span.p, strict=True)]
        weights = (lengths * made.weights).ravel()
        yield _Phase(span, own, begin, t, weights, np.array(p, dtype=float))
        begin += own.T
