"""What a solver's answer means: a status, and a sentence with the place and what to try."""

from collections.abc import Callable

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ocp.solvers.outcome import outside
from ocp.solvers.watch import FAR, FEASIBLE, Halt, Seen, Watch
from ocp.transcription.program import Place, Program
from symfric.foundation.status import Status

Array = NDArray[np.float64]

At = Callable[[Array, Place], str]
"""(w, place) -> when that is, in words."""

OVERDETERMINED = "Not_Enough_Degrees_Of_Freedom"
"""Ipopt's answer to a program with more equations than unknowns."""

HINTS: dict[str, str] = {
    OVERDETERMINED: (
        "There are more equations than unknowns; ask for fewer ends and via points, or give more "
        "intervals."
    ),
    "Insufficient_Memory": "The memory is used up; take fewer intervals.",
}
"""Answer -> what is wrong, where the status alone does not say it."""

TRIED = (
    "It happened at a point that the solver tried, not at an iterate; bound the states to where "
    "the equations are defined."
)


def sentence(
    program: Program,
    watch: Watch,
    point: Seen,
    status: Status,
    answer: str,
    solver: str,
    max_time: float | None,
    values: Array,
    at: At,
) -> str:
    """How the solve ended, what is worst at `point`, and what to try."""
    if status.ok:
        return status.value
    count = watch.iterations
    said = _reason(watch, status, answer, solver, max_time)
    if watch.halt is None:
        said += f" ({solver} after {count} iterations: {answer}.)"
    if status is Status.NOT_FINITE:
        tried = [seen for seen in (watch.last, point) if seen is not None]
        named = (not_finite(program, seen.w, values, at) for seen in tried)
        return f"{said} {next(filter(None, named), TRIED)}"
    if watch.cycles:
        said += " The last iterations go round without getting better, as they do at a kink."
    return f"{said} {worst(program, point, at)}"


def _reason(watch: Watch, status: Status, answer: str, solver: str, max_time: float | None) -> str:
    count = watch.iterations
    if watch.halt is Halt.ERROR:
        return f"Stopped by an exception in progress after {count} iterations: {watch.error!r}."
    if watch.halt is Halt.USER:
        return f"Stopped by the user after {count} iterations; the result is the best iterate."
    if status is Status.TIME_LIMIT:
        limit = "The time limit" if max_time is None else f"The time limit of {max_time:g} s"
        return (
            f"{limit} ended {solver} after {count} iterations; allow more time or go on from the "
            "result, which is the best iterate."
        )
    if watch.halt is Halt.FAR:
        size = f"{FAR:g} times their typical size"
        return f"{status.value} Unknowns were {size} after {count} iterations."
    return HINTS.get(answer, status.value)


def worst(program: Program, point: Seen, at: At) -> str:
    """The row or the bound that is violated most, or that there is none."""
    rows = outside(point.g, program.lower_g, program.upper_g)
    bounds = outside(point.w, program.lower_w, program.upper_w)
    far = point.violation
    if far <= FEASIBLE:
        return f"The best iterate satisfies all constraints, at a cost of {point.f:.6g}."
    if rows.max(initial=0.0) >= far:
        place = program.rows[int(np.argmax(rows))]
        name = place.name
    else:
        place = program.unknowns[int(np.argmax(bounds))]
        name = f"the bound on {place.name}"
    return f"Most violated is {name} {at(point.w, place)}, by {far:.3g} in scaled units."


def not_finite(program: Program, w: Array, values: Array, at: At) -> str:
    """Which equation, or derivative of one, is NaN or infinite at `w`; empty if none is."""
    cost, slope = program.gradient(w, values)
    g, jacobian = program.jacobian(w, values)
    rows, columns = (np.array(part) for part in jacobian.sparsity().get_triplet())
    bad = ~np.isfinite(g.full().ravel())
    if bad.any():
        place = program.rows[int(np.argmax(bad))]
        return f"It is {place.name} {at(w, place)}."
    if not np.isfinite(float(cost)):
        return "It is the cost."
    bad = ~np.isfinite(np.array(jacobian.nonzeros()))
    if bad.any():
        k = int(np.argmax(bad))
        row, unknown = program.rows[int(rows[k])], program.unknowns[int(columns[k])]
        return f"It is the derivative of {row.name} in {unknown.name} {at(w, row)}."
    bad = ~np.isfinite(ca.densify(slope).full().ravel())
    if bad.any():
        unknown = program.unknowns[int(np.argmax(bad))]
        return f"It is the derivative of the cost in {unknown.name} {at(w, unknown)}."
    return ""


def plainly(w: Array, place: Place) -> str:
    """When a place is, where no durations are known."""
    del w
    return f"at {place.fraction:.4g} of the duration"
