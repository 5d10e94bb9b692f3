"""What exact Coulomb friction with stiction makes of an optimised control.

A law with a width, or a bristle, is verified with itself (`ocp.checking.verify`). This is the other
question: whether the control does what was asked for with the friction that they stand for, whose
contacts rest and slide. The motion is that of `ocp.friction.exact`, of the user's model and from
its own start through all phases; what is asked of it is what is asked of any.
"""

from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np

from ocp.checking.arcs import Arc, arcs_of
from ocp.checking.conditions import at_nodes, between_nodes, joined, periodic
from ocp.checking.resimulate import Run
from ocp.checking.verification import Miss, Verification
from ocp.checking.verify import cost_of
from ocp.formulation.problem import Problem
from ocp.friction.exact import set_valued
from ocp.friction.pieces import SetValued
from ocp.result.solution import Solution
from symfric import Hold
from symfric.foundation import checks
from symfric.foundation.status import SolveError, Status
from symfric.foundation.symbols import stacked

TOLERANCE = 1e-4
RTOL = 1e-9


def verify_exactly(
    solution: Solution, tolerance: float = TOLERANCE, rtol: float = RTOL
) -> Verification:
    """The verification of `solution` with exact friction in the place of its laws.

    Start, via points, end, joints, periodicity, bounds, path conditions and cost; what is asked of
    an expression in which a law itself stands, as of an output "friction", is looked at with the
    law. `Verification.trajectories` are those of exact friction; `motions` gives their modes.

    Args:
        solution: of a problem whose models have contacts.
        tolerance: relative miss that is allowed.
        rtol: of the motion.

    Raises:
        ValueError: no solution, or a law without a sliding force and a static level.
    """
    checks.kind("verify_exactly", solution, Solution, "a solution, such as solve(...)")
    tolerance = checks.number("verify_exactly: tolerance", tolerance, above=0.0)
    problem = solution.problem
    arcs = arcs_of(problem, solution.meshes, solution.points)
    found, failed = _followed(arcs, rtol)
    runs = [Run(arc, motion.trajectory, arc.end) for arc, motion in found]
    value = float("nan") if failed else cost_of(problem, runs)
    checked = list(_asked(problem, runs))
    if not failed:
        size = max(abs(value), abs(solution.cost)) or 1.0
        checked.append(Miss("cost", "the cost", runs[-1].end, value, solution.cost, size))
    return Verification(
        tolerance=tolerance,
        rtol=rtol,
        checked=tuple(sorted(checked, key=lambda miss: -miss.relative)),
        local_errors=(),
        trajectories=tuple(run.trajectory for run in runs),
        cost=value,
        failed=failed,
        failure=Status.SOLVER_FAILED if failed else Status.SUCCESS,
    )


def motions(solution: Solution, rtol: float = RTOL) -> tuple[SetValued, ...]:
    """The exact motion of each span, with the modes of its contacts, as far as it can be followed.

    Raises:
        ValueError: as `verify_exactly`.
    """
    arcs = arcs_of(solution.problem, solution.meshes, solution.points)
    return tuple(motion for _, motion in _followed(arcs, rtol)[0])


def _followed(arcs: Sequence[Arc], rtol: float) -> tuple[list[tuple[Arc, SetValued]], str]:
    """Arcs with their motions, one after the other, and why that of one has no end."""
    found: list[tuple[Arc, SetValued]] = []
    failed = ""
    for arc in arcs:
        before = found[-1] if arc.span.phase and found else None
        if arc.span.phase and (before is None or before[0].number != arc.number - 1):
            continue
        rows = zip(arc.span.model.u, arc.u, strict=True)
        try:
            motion = set_valued(
                arc.span.model, arc.end, t_start=float(arc.times[0]), x0=_start(arc, before),
                u={v.name: Hold(arc.times[:-1], row) for v, row in rows}, p=arc.parameters(),
                t_eval=arc.times, rtol=rtol,
            )  # fmt: skip
        except SolveError as error:
            failed = failed or str(error)
            continue
        found.append((arc, motion))
    return found, failed


def _start(arc: Arc, before: tuple[Arc, SetValued] | None) -> dict[str, float]:
    """Where the model starts: as the links of its phase say, else where it was optimised."""
    start = arc.state(0)
    if before is not None and arc.span.links:
        motion = before[1]
        column = stacked(link.expression for link in arc.span.links)
        ends = motion.trajectory.of(column, np.array([motion.span[1]]))
        start |= {link.state: float(x) for link, x in zip(arc.span.links, ends[:, 0], strict=True)}
    return {name: x for name, x in start.items() if np.isfinite(x)}


def _asked(problem: Problem, runs: Sequence[Run]) -> Iterator[Miss]:
    """Everything that the runs were to do."""
    for run in runs:
        yield from at_nodes(run)
        yield from between_nodes([run])
    for before, after in pairwise(runs):
        if after.arc.span.phase and before.arc.number == after.arc.number - 1:
            yield from joined(before, after)
    if problem.periodic:
        last = {run.arc.number: run for run in runs}
        for first in (run for run in runs if run.arc.span.phase == 0):
            end = last.get(first.arc.number + len(problem.chain) - 1)
            yield from periodic(problem, first, end) if end is not None else ()
