"""Results of single solves, their comparison, and their conversion to solutions."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, final

import casadi as ca
import numpy as np

from ocp.formulation.phase import Array, Span
from ocp.solving.methods import Fatrop, Ipopt, Sqp
from ocp.solving.motion import along_points, motions_of
from ocp.solving.optimum import Optimum
from ocp.solving.solution import Solution
from ocp.transcription.program import Outcome
from ocp.transcription.transcribe import Transcription
from ocp.transcription.unknowns import Points, SpanPoints
from symfric.foundation import checks
from symfric.foundation.parameters import parameters
from symfric.foundation.status import Status
from symfric.model.contact import Contact

Solver = Ipopt | Fatrop | Sqp
NARROW = 0.02
"""Smoothing width, relative to the largest sliding velocity, below which Newton's method may step
over the layer."""
NAMED = 3
"""Largest number of contacts in a message."""
FINALISTS = 3
"""Number of coarse solutions that are continued."""
ALIKE = 1e-3
"""Relative difference of J below which motions count as equal."""


@dataclass(frozen=True, eq=False)
class Solved:
    """Transcription of a problem, and the result of a solver."""

    transcription: Transcription
    outcome: Outcome

    @cached_property
    def points(self) -> Points:
        """Unknowns of the motion in SI units."""
        return self.transcription.unpack(self.outcome.iterate.w)

    @property
    def ok(self) -> bool:
        """True if the solver found a solution."""
        return self.outcome.status.ok

    @property
    def solution(self) -> Solution:
        """Result as a `Solution`, without verification."""
        made, outcome, points = self.transcription, self.outcome, self.points
        stuck = outcome.status in (Status.MAX_ITERATIONS, Status.NO_STEP) or outcome.cycles
        kinks = narrow_widths(made, points) if stuck and not outcome.status.ok else ""
        return Solution(
            problem=made.problem,
            status=outcome.status,
            message=f"ocp '{made.problem.name}': {outcome.sentence} {kinks}".rstrip(),
            cost=outcome.cost,
            motions=motions_of(made.problem, made.meshes, made.scheme.coefficients(), points),
            chosen=dict(points.chosen),
            statistics=outcome.statistics,
            scheme=made.scheme,
            meshes=made.meshes,
            points=points,
            iterate=outcome.iterate,
            cause=outcome.cause,
            optimum=Optimum(made, outcome.iterate, made.program.values),
        )


@final
@dataclass(frozen=True, eq=False)
class Step(Solved):
    """Solve with the smoothing width `level` and the `values` of all parameters.

    Attributes:
        accepted: False if the solve jumped to a worse motion.
        error: largest local error of an interval.
        errors: local errors of each interval, (N,) for each phase.
    """

    values: Array
    level: float
    accepted: bool = True
    error: float = np.inf
    errors: tuple[Array, ...] = ()

    @property
    def good(self) -> bool:
        """True if the homotopy can continue from this step."""
        return self.accepted and self.ok

    @property
    def ended(self) -> bool:
        """True if the user or the time limit has stopped the solver."""
        return self.outcome.status.stopped


def rank(outcome: Outcome) -> tuple[bool, bool, float]:
    """Return the order of outcomes: a stopped one, then by cost, or by violation if not solved."""
    ok = outcome.status.ok
    return not outcome.status.stopped, not ok, outcome.cost if ok else outcome.violation


def least(steps: Sequence[Step]) -> Step:
    """Return the stopped step, or the cheapest one, or the least violated if none is solved."""
    return min(steps, key=lambda step: rank(step.outcome))


def same_cost(a: Outcome, b: Outcome) -> bool:
    """Return True if the costs of two outcomes indicate the same motion."""
    return abs(a.cost - b.cost) <= ALIKE * abs(b.cost)


def finalists(steps: Sequence[Step]) -> list[Step]:
    """Return the best steps with different costs, which indicate different motions."""
    kept: list[Step] = []
    for step in sorted(steps, key=lambda one: (not one.good, one.outcome.cost)):
        new = not any(same_cost(step.outcome, one.outcome) for one in kept)
        if not kept or (new and step.good and len(kept) < FINALISTS):
            kept.append(step)
    return kept


def narrow_widths(transcription: Transcription, points: Points) -> str:
    """Return a message about contacts with narrow smoothing widths, or "" if there are none.

    It names contacts that stick or reverse, and contacts whose widths smooth a quantity other than
    the sliding velocity.
    """
    messages: dict[str, str] = {}
    for span, at in zip(transcription.problem.spans, points.spans, strict=True):
        for contact in span.model.contacts:
            widths = list(_narrow(contact, span, at))
            if widths and contact.name not in messages:
                messages[contact.name] = f"contact '{contact.name}' has {' and '.join(widths)}"
    if not messages:
        return ""
    names = checks.listed(list(messages.values()), NAMED)
    return f"Friction is smoothed over a small width: {names}; raise it or use friction='auto'."


def _narrow(contact: Contact, span: Span, at: SpanPoints) -> Iterator[str]:
    """Yield the widths of a contact that are small relative to its motion, with their values."""

    def number(value: Any) -> float:  # parameters of a law may be parameters of the model
        return float(ca.Function("number", [span.model.vector("p")], [ca.SX(value)])(span.p))

    slip = along_points(span, at, contact.slip)[0]
    fastest = float(np.abs(slip).max(initial=0.0))
    turns = slip.size > 0 and bool(slip.min() <= 0.0 <= slip.max())
    law: Any = contact.law  # type Parametric
    known = parameters(law)
    for name, exponent in law.widths.items():
        value = number(known[name].value)
        if turns and 0.0 < value**exponent < NARROW * fastest:
            unit = contact.unit(known[name].unit)
            yield f"{name} = {value:.3g} {unit}".removesuffix(" 1")
    for name, variable in contact.widths.items():
        yield f"{name} = {number(variable.start):.3g} {variable.unit}"
