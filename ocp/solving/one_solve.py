"""One solve: a problem on meshes, a solver and a start make a solution, as it is.

Nothing is refined, sharpened or verified here; `ocp.solve` does these by calling this.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import partial
from time import perf_counter
from typing import Any, final

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike, NDArray

from ocp.formulation.phase import Span
from ocp.formulation.problem import Problem
from ocp.solving.methods import Fatrop, Ipopt, Sqp
from ocp.solving.motion import Motion, motion_of
from ocp.solving.outcome import Iterate, Outcome, Report, in_stage
from ocp.solving.prepared import Prepared
from ocp.solving.solution import Solution
from ocp.solving.starts import Start, start_of
from ocp.transcription.program import Place
from ocp.transcription.schemes import Radau, Scheme, make_meshes
from ocp.transcription.transcribe import discretise
from ocp.transcription.transcription import Transcription
from ocp.transcription.unknowns import (
    Points,
    SpanPoints,
)
from symfric.foundation import checks
from symfric.foundation.parameters import parameters
from symfric.foundation.status import Status
from symfric.model.contact import Contact

LEAST = 1e-3
"""A solver is given some time at least [s], and stops at once."""
Array = NDArray[np.float64]
NARROW = 0.02
"""A width below this share of the largest sliding velocity is one that Newton steps jump over."""
NAMED = 3
"""Contacts that a sentence names."""
Solver = Ipopt | Fatrop | Sqp


@final
@dataclass(frozen=True)
class Clock:
    """Runs from when it is made.

    Attributes:
        allowed: wall time [s] for all, or None for any.
    """

    allowed: float | None = None
    started: float = field(default_factory=perf_counter)

    @property
    def left(self) -> float | None:
        """What is left [s]; None for any."""
        if self.allowed is None:
            return None
        return max(LEAST, self.allowed - (perf_counter() - self.started))

    @property
    def over(self) -> bool:
        """Whether nothing is left."""
        return self.left == LEAST

    def within(self, prepared: Prepared) -> Prepared:
        """`prepared` with what is left as its limit, if that is less than its own."""
        left = self.left
        if left is None or (prepared.max_time is not None and prepared.max_time <= left):
            return prepared
        return replace(prepared, max_time=left, told_time=self.allowed)

    def run(
        self,
        transcription: Transcription,
        prepared: Prepared,
        start: Iterate,
        progress: Report | None,
        stage: str,
        values: ArrayLike | None = None,
    ) -> Outcome:
        """One solve within what is left, whose progress is that of a `stage`."""
        at = partial(when, transcription)
        return self.within(prepared).run(start, values, in_stage(progress, stage), at=at)


def narrow_widths(transcription: Transcription, points: Points) -> str:
    """A sentence that names contacts with narrow widths; empty if there are none.

    Named are contacts that come to rest or turn round on the way, or whose widths smooth something
    else than their sliding velocity.
    """
    found: dict[str, str] = {}
    for span, at in zip(transcription.problem.spans, points.spans, strict=True):
        for contact in span.model.contacts:
            widths = list(_narrow(contact, span, at))
            if widths and contact.name not in found:
                found[contact.name] = f"contact '{contact.name}' has {' and '.join(widths)}"
    if not found:
        return ""
    names = checks.listed(list(found.values()), NAMED)
    return f"Friction is smoothed over a small width: {names}; raise it or use friction='auto'."


def _narrow(contact: Contact, span: Span, at: SpanPoints) -> Iterator[str]:
    """Widths of a contact that are small against how it moves, each with its number."""
    slip = _along(span, at, contact.slip)
    fastest = float(np.abs(slip).max(initial=0.0))
    turns = slip.size > 0 and bool(slip.min() <= 0.0 <= slip.max())
    law: Any = contact.law  # which is Parametric
    known = parameters(law)
    for name, exponent in law.widths.items():
        value = _width_number(known[name].value, span)
        width = value if exponent > 0 else 1.0 / value
        if turns and 0.0 < width < NARROW * fastest:
            unit = contact.unit(known[name].unit)
            yield f"{name} = {value:.3g} {unit}".removesuffix(" 1")
    for name, variable in contact.widths.items():
        yield f"{name} = {_width_number(variable.start, span):.3g} {variable.unit}"


def _width_number(value: Any, span: Span) -> float:
    """The number of a parameter of a law, which may be one of the model."""
    function = ca.Function("number", [span.model.vector("p")], [ca.SX(value)])
    return float(function(span.p))


def _along(span: Span, at: SpanPoints, expression: ca.SX) -> Array:
    """An expression at the collocation points, or at the nodes where there are none."""
    inner = at.inner.shape[1]
    x, n = (at.inner, inner) if inner else (at.nodes[:, :-1], at.u.shape[1])
    u = np.repeat(at.u, n // at.u.shape[1], axis=1)
    z = at.z if at.z.shape[1] == n else np.zeros((at.z.shape[0], n))
    p = np.tile(span.p[:, None], (1, n))
    function = ca.Function("along", span.symbols, [expression])
    return function.map(n)(np.zeros((1, n)), x, z, u, p).full().ravel()


def solve_once(
    problem: Problem,
    intervals: int | ArrayLike = 50,
    scheme: Scheme | None = None,
    solver: Solver | None = None,
    guess: Start = None,
    progress: Report | None = None,
) -> Solution:
    """Solve `problem` on one mesh; a solve that fails is a solution whose status says so.

    Args:
        problem: what to solve.
        intervals: number of equal intervals of each phase, fractions of T, or one of these for
            each phase.
        scheme: `Radau(3)` if none.
        solver: `Ipopt()` if none.
        guess: see `ocp.solving.starts`.
        progress: called with a `Progress` after each iteration.

    Raises:
        ValueError: bad input.
    """
    begin = perf_counter()
    scheme = Radau() if scheme is None else scheme
    transcription = discretise(problem, scheme).on(make_meshes(problem, intervals))
    prepared = (Ipopt() if solver is None else solver).prepared(transcription.program)
    written = perf_counter() - begin
    solution = solve_on(transcription, prepared, guess, progress)
    statistics = solution.statistics
    return replace(
        solution, statistics=replace(statistics, build_time=statistics.build_time + written)
    )


def solve_on(
    transcription: Transcription,
    prepared: Prepared,
    guess: Start = None,
    progress: Report | None = None,
    values: ArrayLike | None = None,
    warm: bool | None = None,
) -> Solution:
    """Solve a program that is there already, which may be done many times.

    Args:
        transcription: the problem on meshes.
        prepared: a solver that holds `transcription.program`, or that of another transcription by
            the same `Discretisation` on as many intervals.
        guess, progress: as in `solve_once`.
        values: numbers of the parameters, `transcription.values(...)`; its own if none.
        warm: use the multipliers of the guess; None does where it has some that fit.
    """
    start, fits = start_of(transcription, guess)
    numbers = transcription.program.values if values is None else values
    outcome = prepared.run(
        start,
        numbers,
        progress,
        fits if warm is None else warm and fits,
        partial(when, transcription),
    )
    return solution_of(transcription, outcome)


def solution_of(transcription: Transcription, outcome: Outcome) -> Solution:
    """The outcome of a solver by name."""
    problem = transcription.problem
    points = transcription.unpack(outcome.iterate.w)
    return Solution(
        problem=problem,
        status=outcome.status,
        message=_message(transcription, outcome, points),
        cost=outcome.cost,
        motions=motions_of(transcription, points),
        chosen=dict(points.chosen),
        statistics=outcome.statistics,
        scheme=transcription.scheme,
        meshes=transcription.meshes,
        points=points,
        iterate=outcome.iterate,
        cause=outcome.cause,
    )


def _message(transcription: Transcription, outcome: Outcome, points: Points) -> str:
    """The sentence of the solver, and the friction that may have stopped it."""
    said = f"ocp '{transcription.problem.name}': {outcome.sentence}"
    stuck = outcome.status in (Status.MAX_ITERATIONS, Status.NO_STEP) or outcome.cycles
    kinks = narrow_widths(transcription, points) if stuck and not outcome.status.ok else ""
    return f"{said} {kinks}".rstrip()


def motions_of(transcription: Transcription, points: Points) -> tuple[Motion, ...]:
    """What moves, for each scenario."""
    problem, phases = transcription.problem, len(transcription.problem.chain)
    names = problem.scenario_names or ("",)
    scheme = transcription.scheme.coefficients()
    found: list[Motion] = []
    for k, name in enumerate(names):
        part = slice(k * phases, (k + 1) * phases)
        spans = [(number, problem.spans[number]) for number in range(part.start, part.stop)]
        meshes = transcription.meshes[part]
        found.append(motion_of(name, spans, points.spans[part], meshes, scheme, points.chosen))
    return tuple(found)


def when(transcription: Transcription, w: Array, place: Place) -> str:
    """The time of a place, in words; its phase and scenario where there are several."""
    problem = transcription.problem
    span, phases = problem.spans[place.span], len(problem.chain)
    words: list[str] = []
    if np.isfinite(place.fraction):
        durations = [part.T for part in transcription.unpack(w).spans]
        begin = sum(durations[place.span - span.phase : place.span])
        words.append(f"at t = {begin + place.fraction * durations[place.span]:.4g} s")
    if phases > 1:
        words.append(f"in {span.name}")
    if problem.scenario_names:
        words.append(f"of scenario {problem.scenario_names[span.scenario]}")
    return " ".join(words)
