"""Arcs put together again: a solution in the terms of the user's problem."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ocp.formulation.phase import Span
from ocp.formulation.problem import Problem
from ocp.friction.sequence import Leg, shown, tracks_of
from ocp.friction.solved import Solved
from ocp.result.motion import Motion, motion_of
from ocp.result.solution import Mode, Solution
from ocp.solvers.outcome import Iterate, SolverStatistics
from ocp.transcription.unknowns import Points, SpanPoints
from symfric.foundation.parameters import Variable

Array = NDArray[np.float64]

KINDS = {1: "slip+", 0: "stick", -1: "slip-"}


def whole_solution(
    problem: Problem, solved: Solved, statistics: Sequence[SolverStatistics]
) -> Solution:
    """The solution of `problem` that the arcs of `solved` are.

    States of laws that mode models do not have are zero in it.
    """
    points, meshes = _joined(problem, solved)
    t = solved.transcription
    spans = list(enumerate(problem.spans))
    motion = motion_of("", spans, points.spans, meshes, t.scheme.coefficients(), points.chosen)
    total = statistics[0]
    for later in statistics[1:]:
        total = total.then(later)
    outcome = solved.outcome
    return Solution(
        problem=problem,
        status=outcome.status,
        message=f"ocp '{problem.name}': modes {shown(solved.legs)}: {outcome.sentence}",
        cost=outcome.cost,
        motions=(_with_forces(motion, solved.known.motion),),
        chosen=dict(points.chosen),
        statistics=total,
        scheme=t.scheme,
        meshes=meshes,
        points=points,
        iterate=Iterate.cold(np.zeros(0), 0),  # its program is not that of the problem
        modes=modes_of(solved.legs),
        cause=outcome.cause,
    )


def modes_of(legs: Sequence[Leg]) -> dict[str, tuple[Mode, ...]]:
    """Contact -> what it does when."""
    return {
        contact: tuple(Mode(KINDS[run.mode], run.begin, run.end) for run in runs)
        for contact, runs in tracks_of(legs).items()
    }


def _joined(problem: Problem, solved: Solved) -> tuple[Points, tuple[Array, ...]]:
    """Points and meshes of the user's phases."""
    t, points = solved.transcription, solved.points
    arcs = list(zip(t.problem.spans, points.spans, t.meshes, strict=True))
    spans: list[SpanPoints] = []
    meshes: list[Array] = []
    for number, span in enumerate(problem.spans):
        legs = [leg for leg in solved.legs if leg.phase == number]
        count = sum(len(leg.arcs) for leg in legs)
        own, arcs = arcs[:count], arcs[count:]
        spans.append(_span_points(span, own))
        meshes.append(_mesh(problem, number, legs, [(p.T, mesh) for _, p, mesh in own]))
    return Points(tuple(spans), points.chosen), tuple(meshes)


def _span_points(span: Span, arcs: Sequence[tuple[Span, SpanPoints, Array]]) -> SpanPoints:
    """The points of one phase, of its model."""
    nodes = [_rows(span.model.x, own.model.x, p.nodes)[:, int(k > 0) :]
             for k, (own, p, _) in enumerate(arcs)]  # fmt: skip
    return SpanPoints(
        sum(p.T for _, p, _ in arcs),
        np.hstack(nodes),
        np.hstack([_rows(span.model.x, own.model.x, p.inner) for own, p, _ in arcs]),
        np.hstack([_rows(span.model.z, own.model.z, p.z) for own, p, _ in arcs]),
        np.hstack([_rows(span.model.u, own.model.u, p.u) for own, p, _ in arcs]),
    )


def _rows(wanted: Sequence[Variable], there: Sequence[Variable], values: Array) -> Array:
    """Rows of `values` by name; zero for what is not there."""
    rows = {v.name: row for v, row in zip(there, values, strict=True)}
    zero = np.zeros(values.shape[1])
    return np.array([rows.get(v.name, zero) for v in wanted]).reshape(-1, values.shape[1])


def _mesh(
    problem: Problem, number: int, legs: Sequence[Leg], arcs: Sequence[tuple[float, Array]]
) -> Array:
    """Fractions of the duration of a phase, with its via points exactly where they are."""
    fractions = [0.0, *sorted(problem.chain[number].via), 1.0]
    found = [np.zeros(1)]
    first = 0
    for leg, low, high in zip(legs, fractions[:-1], fractions[1:], strict=True):
        own = arcs[first : first + len(leg.arcs)]
        first += len(leg.arcs)
        whole, begin = sum(T for T, _ in own), 0.0
        for T, mesh in own:
            found.append(low + (high - low) * (begin + T * mesh[1:]) / whole)
            begin += T
        found[-1][-1] = high
    return np.concatenate(found)


def _with_forces(motion: Motion, arcs: Motion) -> Motion:
    """`motion` with the signals of the arcs, in which friction at rest is a reaction."""
    if motion.t.size != arcs.t.size:
        return motion
    signals = {name: arcs.signals.get(name, row) for name, row in motion.signals.items()}
    return replace(motion, signals=signals)
