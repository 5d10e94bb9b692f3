"""Conditions in a result: penalties of soft ones, and deviations in a re-simulation."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import isfinite
from typing import Any, NamedTuple, final

import casadi as ca
import numpy as np

from ocp.formulation.phase import Array, Row, Span
from ocp.formulation.problem import Posed, Problem
from ocp.solving.motion import along_points
from ocp.transcription.schemes import Scheme
from ocp.transcription.unknowns import SpanPoints, Values
from symfric.foundation.files import json_data
from symfric.foundation.shown import brief, spaced
from symfric.foundation.status import Status
from symfric.foundation.storable import agree
from symfric.results.trajectory import Trajectory


@final
@dataclass(frozen=True)
class Miss:
    """Condition and its value in the re-simulated motion.

    Attributes:
        what: kind of condition: "start", "end", "via", "joint" or "period" for a prescribed value,
            "bound" or "path" for a range at its worst violation, "motion" for the optimised value
            of a state at the end of a phase, "cost", or "local error" of the worst interval.
        name: name of the signal or of the condition.
        time: time [s].
        value: value in the simulation.
        wanted: nearest admissible value.
        size: reference magnitude of the difference.
        unit: unit of the values.
    """

    what: str
    name: str
    time: float
    value: float
    wanted: float
    size: float
    unit: str = ""

    @property
    def miss(self) -> float:
        """Difference between `value` and `wanted`."""
        return self.value - self.wanted

    @property
    def relative(self) -> float:
        """Magnitude of the difference in multiples of `size`; inf for NaN."""
        found = abs(self.miss) / self.size if self.size > 0 else abs(self.miss)
        return found if isfinite(found) else float("inf")

    @property
    def sentence(self) -> str:
        """Message with the condition, the time and the difference."""
        unit = spaced(self.unit)
        if self.what == "local error":
            return f"the interval at {self.time:.4g} s has a local error of {self.relative:.2g}"
        if self.what == "cost":
            return f"the cost is {self.value:.6g}, not {self.wanted:.6g}"
        amount = f"{abs(self.miss):.3g}{unit}"
        if self.what == "motion":
            return f"{self.name} is {amount} away from its optimised value at {self.time:.4g} s"
        if self.what in ("bound", "path"):
            return f"{self.name} is violated by {amount} at {self.time:.4g} s"
        return f"{self.name} misses {self.wanted:.4g}{unit} at {self.time:.4g} s by {amount}"


@final
@dataclass(frozen=True, eq=False)
class Verification:
    """Comparison of a solution with an accurate simulation of the user's model under its control.

    Attributes:
        tolerance: largest permitted relative miss.
        rtol: relative tolerance of the simulation.
        checked: all checked conditions, the worst first.
        local_errors: error of each interval, shape (N,), for each phase.
        trajectories: simulated motion of each phase, in order.
        cost: J of the simulated motion; NaN if it did not reach its end.
        failed: message of a simulation that did not reach its end; empty if all did.
        failure: status of this simulation.
        restarted: verification by simulations between the nodes in `restarts`, for a motion whose
            error growth makes a simulation from the start meaningless; otherwise None.
        restarts: times of restarts at nodes of the solution [s].
        growth: growth factor of local errors up to the end; NaN if not evaluated.
    """

    tolerance: float
    rtol: float
    checked: tuple[Miss, ...]
    local_errors: tuple[Array, ...]
    trajectories: tuple[Trajectory, ...]
    cost: float
    failed: str = ""
    failure: Status = Status.SUCCESS
    restarted: "Verification | None" = None
    restarts: tuple[float, ...] = ()
    growth: float = float("nan")

    __repr__ = brief

    def check_fields(self) -> None:
        """Raise an error if a file contains local errors that are not one number per interval."""
        agree("Verification", all(errors.ndim == 1 for errors in self.local_errors))

    @property
    def misses(self) -> tuple[Miss, ...]:
        """Conditions with a relative miss above the tolerance, the worst first."""
        return tuple(miss for miss in self.checked if not miss.relative <= self.tolerance)

    @property
    def ok(self) -> bool:
        """True if the simulated motion satisfies all conditions."""
        return not self.failed and not self.misses

    @property
    def worst(self) -> Miss | None:
        """Condition with the largest miss; None without conditions."""
        return self.checked[0] if self.checked else None

    @property
    def largest(self) -> float:
        """Largest relative miss; inf if the simulation did not reach its end."""
        if self.failed:
            return float("inf")
        return self.checked[0].relative if self.checked else 0.0

    @property
    def unstable(self) -> bool:
        """True if the verification fails only because of error growth; see `restarted`."""
        return not self.ok and self.restarted is not None and self.restarted.ok

    @property
    def status(self) -> Status:
        """Status that a solved problem has after this verification."""
        if self.ok:
            return Status.SUCCESS
        if self.unstable:
            return Status.UNSTABLE
        if self.failed:
            return self.failure
        kept = all(miss.what in ("bound", "path") for miss in self.misses)
        return Status.BOUND_MISS if kept else Status.TERMINAL_MISS

    @property
    def sentence(self) -> str:
        """Message with the largest misses or the failure; empty if all conditions are satisfied."""
        if self.ok:
            return ""
        if self.failed:
            return f"Its control could not be re-simulated: {self.failed}"
        missed = "; ".join(miss.sentence for miss in self.misses[:3])
        more = len(self.misses) - 3
        missed += f"; and {more} more" if more > 0 else ""
        if self.unstable and self.restarted is not None:
            shown = ", ".join(f"{t:.4g}" for t in self.restarts[:4])
            return (
                f"{self.status.value} Errors grow by a factor of {self.growth:.1g}, so under "
                f"the control alone {missed}. Restarted at {shown}"
                f"{', ...' if len(self.restarts) > 4 else ''} s it meets all conditions within "
                f"{self.restarted.largest:.1g}."
            )
        return f"{self.status.value} In the simulation {missed}."

    @property
    def table(self) -> str:
        """Table of all checked conditions."""
        head = f"{'what':<12}{'name':<28}{'t [s]':>9}{'value':>13}{'wanted':>13}{'relative':>10}"
        rows = [
            f"{m.what:<12}{m.name:<28}{m.time:>9.4g}{m.value:>13.6g}{m.wanted:>13.6g}"
            f"{m.relative:>10.1e}"
            for m in self.checked
        ]
        return "\n".join([head, *rows])

    def __str__(self) -> str:
        verdict = "verified" if self.ok else "not verified"
        text = f"{verdict} within {self.tolerance:g}: largest miss {self.largest:.1e}"
        return "\n".join([text, *([self.sentence] if self.sentence else []), self.table])

    def to_dict(self) -> dict[str, Any]:
        """Return the verification as plain data, with None for numbers that are not finite."""
        return json_data({
            "ok": self.ok,
            "tolerance": self.tolerance,
            "rtol": self.rtol,
            "sentence": self.sentence,
            "cost": self.cost,
            "growth": self.growth,
            "restarts": self.restarts,
            "checked": [
                {"what": m.what, "name": m.name}
                | {n: getattr(m, n) for n in ("time", "value", "wanted", "relative")}
                for m in self.checked
            ],
            "local_errors": [errors.tolist() for errors in self.local_errors],
            "restarted": None if self.restarted is None else self.restarted.to_dict(),
        })  # fmt: skip


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
    problem: Problem | Posed, scheme: Scheme, meshes: Sequence[Array], points: Values
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
    problem: Problem | Posed, scheme: Scheme, meshes: Sequence[Array], points: Values
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
    problem: Problem | Posed, scheme: Scheme, meshes: Sequence[Array], points: Values
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
