"""How a case is judged: against another method at a hundredth of its tolerance.

    tolerance of a state = rtol max|x| + atol,   error = max over states and times of
                                                         |run - reference| / tolerance

is at most RIGHT tolerances where a run is right. A larger error is not yet the run's fault: a
third run at a thousandth of rtol must agree with the reference, and the problem must not be one
that turns a tolerance at some time into much more at a later one (a block at the edge of
sticking, a chaotic pendulum). What no method can tell is "undecided", never "right". A method
that allows a tolerance in each step may be off by all of them together where nothing damps: the
steps are judged one by one then, each from where the run itself stood at its start.
"""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from itertools import pairwise
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from symfric.foundation.status import SolveError, Status
from symfric.integrator.arguments import chosen
from symfric.results.trajectory import Trajectory
from symfric.stress.cases import Case
from symfric.stress.peer import by_scipy
from symfric.stress.problem import TIMES, WORK, Problem, problem

Array = NDArray[np.float64]

CLASSES = {
    "right": "as the reference, within ten tolerances",
    "refused": "an error in a sentence: bad input, or a solve that failed",
    "loose": "off by up to a hundred tolerances, or what those of all steps add up to",
    "undecided": "references disagree or fail, or tolerances of steps grow or add up to much",
    "silent": "success, and wrong",
    "nan": "success, and a signal is not finite",
    "crash": "a foreign exception, or the process died",
    "hang": "no end within the limit",
}
"""Name -> what it means, in the order of the table."""

FAILING = ("silent", "nan", "crash", "hang")
"""Classes that must be empty."""

RIGHT, LOOSE = 10.0, 100.0
SENSITIVE = 1e-2
"""Relative error above which what steps add up to is no longer small; and relative size of what
becomes of one tolerance, above which a run says nothing."""
STRIDES = 100
"""Steps that a reference takes at least: what a run may leap over, a reference must not."""
PEER = 25
"""One in so many cases is compared with SciPy, too, where its equations are an ODE."""
RAW = ("Traceback", ".cpp:", "casadi::", "Assertion")
"""What no sentence for users contains."""


@final
@dataclass(frozen=True)
class Verdict:
    """What became of a case.

    Attributes:
        kind: one of `CLASSES`.
        reason: a sentence; empty where the run is right.
        group: what the reason is called in a table.
        error: error [tolerances], or None.
        steps: steps taken.
    """

    kind: str
    reason: str = ""
    group: str = ""
    error: float | None = None
    steps: int = 0

    def to_dict(self) -> dict[str, Any]:
        """For JSON."""
        return asdict(self)

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> "Verdict":
        """What `to_dict` wrote."""
        return cls(**data)


def judge(case: Case, work: int = WORK) -> Verdict:
    """Run a case and its references; a defect in symfric comes out as the exception it is.

    Args:
        work: attempts that a run may take, times its unknowns; a reference has ten times what the
            run took, and as many on top.
    """
    try:
        ready = problem(case, work)
    except ValueError as error:
        return _refused("input", str(error))
    try:
        run = ready.run(case.rtol, case.method, max_steps=ready.attempts, backend=case.backend)
    except ValueError as error:
        return _refused("start or input", str(error))
    except SolveError as error:
        return _failed(ready, error)
    broken = [name for name in run.units if not np.isfinite(run[name]).all()]
    if broken:
        return Verdict("nan", f"{', '.join(broken)}: not finite", "not finite")
    return _compared(ready, run)


def _refused(group: str, sentence: str, steps: int = 0) -> Verdict:
    raw = [text for text in RAW if text in sentence]
    if raw or not sentence.strip():
        return Verdict("crash", f"raw text instead of a sentence: {sentence}", "raw text")
    return Verdict("refused", sentence, group, steps=steps)


def _failed(ready: Problem, error: SolveError) -> Verdict:
    """A solve that says it failed; whether another method goes through is told beside it."""
    steps = error.partial.statistics.steps if isinstance(error.partial, Trajectory) else 0
    if error.status is Status.MAX_STEPS:
        return Verdict("undecided", str(error), "too many steps", steps=steps)
    case = ready.case
    other = _run(ready, case.rtol, _other(case), ready.attempts)
    through = isinstance(other, Trajectory)
    group = f"{error.status.name}{', another method goes through' if through else ''}"
    return _refused(group, str(error), steps)


def _compared(ready: Problem, run: Trajectory) -> Verdict:
    case, steps = ready.case, run.statistics.steps
    limit = 10 * (steps + run.statistics.rejections) + ready.attempts
    fine, finest = max(case.rtol / 100, 1e-13), max(case.rtol / 1000, 1e-13)
    reference = _run(ready, fine, _other(case), limit)
    if isinstance(reference, SolveError):
        return _without_reference(ready, run, reference, finest, limit)
    error = distance(ready, run, reference)
    if error <= RIGHT:
        return _peered(ready, run, reference, error)
    third = _run(ready, finest, _third(case), limit)
    if isinstance(third, SolveError):
        text = f"{error:.3g} tolerances off; a third run at rtol/1000 failed: {third}"
        return Verdict("undecided", text, "third run failed", error, steps)
    doubt = distance(ready, reference, third)
    error = distance(ready, run, third)
    if error <= RIGHT:
        return Verdict("right", "", "", error, steps)
    if doubt > error / 3:
        text = f"{error:.3g} tolerances off, and the references disagree by {doubt:.3g}"
        return Verdict("undecided", text, "references disagree", error, steps)
    return _graded(ready, run, third, error, limit)


def _graded(
    ready: Problem, run: Trajectory, reference: Trajectory, error: float, limit: int
) -> Verdict:
    """Loose or silently wrong, by what the problem itself makes of a tolerance."""
    steps = run.statistics.steps
    grown = amplification(ready, reference, limit)
    text = f"{error:.3g} tolerances off; the problem makes {grown:.3g} of one"
    if error <= LOOSE:
        return Verdict("loose", text, "", error, steps)
    if at_steps(ready, run, reference) <= LOOSE:
        return Verdict("loose", text, "between steps only", error, steps)
    if error <= max(LOOSE, steps) * grown:
        if error * ready.case.rtol < SENSITIVE:
            return Verdict("loose", text, "adds up over steps", error, steps)
        if grown * ready.case.rtol > SENSITIVE:
            return Verdict("undecided", text, "sensitive", error, steps)
        if (step := worst_step(ready, run, reference, limit)) <= RIGHT:
            text += f", but no step is off by more than {step:.3g}"
            return Verdict("undecided", text, "adds up over steps", error, steps)
    return Verdict("silent", text, "", error, steps)


def _peered(ready: Problem, run: Trajectory, reference: Trajectory, error: float) -> Verdict:
    """Right, unless SciPy, which shares no code with symfric, says otherwise."""
    steps = run.statistics.steps
    if ready.case.number % PEER == 0:
        other = by_scipy(ready)
        if other is not None:
            apart = _largest(ready, _table(reference, ready.times), other, reference)
            if apart > LOOSE:
                text = f"SciPy is {apart:.3g} tolerances away from two of our methods"
                return Verdict("undecided", text, "SciPy differs", error, steps)
    return Verdict("right", "", "", error, steps)


def _without_reference(
    ready: Problem, run: Trajectory, first: SolveError, finest: float, limit: int
) -> Verdict:
    """The reference failed: another one judges, and two that fail at one place are believed."""
    steps = run.statistics.steps
    second = _run(ready, finest, _third(ready.case), limit)
    if isinstance(second, Trajectory):
        error = distance(ready, run, second)
        if error <= RIGHT:
            return Verdict("right", "", "", error, steps)
        if error <= LOOSE:
            return Verdict("loose", f"{error:.3g} tolerances off", "", error, steps)
    group = f"reference: {first.status.name}"
    return Verdict("undecided", f"the reference failed: {first}", group, None, steps)


def _run(
    ready: Problem,
    rtol: float,
    method: str,
    limit: int,
    x0: Mapping[str, float] | None = None,
    times: Array | None = None,
) -> Trajectory | SolveError:
    try:
        span = ready.case.t_end - ready.case.t_start
        return ready.run(
            rtol, method, max_steps=limit, x0=x0, t_eval=times, max_step=span / STRIDES
        )
    except SolveError as error:
        return error


def _other(case: Case) -> str:
    """A method of another family than that of the case."""
    return "rodas5p" if chosen("case", case.method, case.rtol).name == "radau5" else "radau5"


def _third(case: Case) -> str:
    """The method that is not the reference's."""
    return "radau5" if _other(case) == "rodas5p" else "rodas5p"


def distance(ready: Problem, run: Trajectory, reference: Trajectory) -> float:
    """Largest difference of a state [tolerances].

    Where the model has events the run may be early or late by rtol of the span: regimes jump.
    """
    return _largest(ready, _table(run, ready.times), _table(reference, ready.times), reference)


def at_steps(ready: Problem, run: Trajectory, reference: Trajectory) -> float:
    """Largest difference at times [tolerances] where the run's own steps end.

    An implicit step may go over a fast transient and end right, and its polynomial leads there by
    another way.
    """
    times = run.step_times[:: 1 + run.step_times.size // TIMES]
    size = tolerances(ready, _table(reference, ready.times))
    return float((np.abs(_table(run, times) - _table(reference, times)) / size).max())


def _largest(ready: Problem, y: Array, z: Array, reference: Trajectory) -> float:
    low = high = z
    if ready.model.events:
        late = ready.case.rtol * (ready.times[-1] - ready.times[0])
        shifted = [np.clip(ready.times + s * late, *ready.times[[0, -1]]) for s in (-1, 1)]
        near = np.stack([z, *(_table(reference, times) for times in shifted)])
        low, high = near.min(0), near.max(0)
    apart = np.maximum(0.0, np.maximum(y - high, low - y))
    return float((apart / tolerances(ready, z)).max())


def tolerances(ready: Problem, z: Array) -> Array:
    """Tolerances rtol max|x| + atol of each state, shape (nx, 1); z (nx, times) are the states."""
    rtol, nominal = ready.case.rtol, ready.model.nominal("x")[:, None]
    return rtol * np.abs(z).max(1, keepdims=True) + 0.1 * rtol * nominal


def _table(run: Trajectory, times: Array) -> Array:
    """States over time, shape (nx, times)."""
    values = run.states(times)
    return np.stack([values[v.name] for v in run.model.x])


def amplification(ready: Problem, reference: Trajectory, limit: int) -> float:
    """What becomes of one tolerance [tolerances], put in at the start or on the way."""
    names, y = [v.name for v in ready.model.x], _table(reference, ready.times)
    size, worst = tolerances(ready, y), 1.0
    for k in STATIONS:
        times, ends = ready.times[k:], list[Array]()
        for added in (0.0, 1.0):
            start = dict(zip(names, (y[:, k] + added * size[:, 0]).tolist(), strict=True))
            try:
                run = _run(ready, ready.case.rtol / 100, _third(ready.case), limit, start, times)
            except ValueError:  # no algebraic unknowns found for the states on the way
                return float("inf")
            if isinstance(run, SolveError):
                return float("inf")
            ends.append(_table(run, times))
        worst = max(worst, float((np.abs(ends[1] - ends[0]) / size).max()))
    return worst


def worst_step(ready: Problem, run: Trajectory, reference: Trajectory, limit: int) -> float:
    """Largest error of a single step [tolerances], from where the run stood at its start.

    Stretches of steps are followed by another method, and those off by more than `RIGHT` halved
    until one step is left; the first such step is returned, or else the largest error of a
    stretch. Infinite where no other method can start or go on. What is damped within a stretch
    is not seen: it adds nothing to the error of the run.
    """
    t = run.step_times
    y, size = _table(run, t), tolerances(ready, _table(reference, ready.times))
    cuts = np.unique(np.linspace(0, t.size - 1, STRIDES + 1).astype(int)).tolist()
    stretches, worst = list(pairwise(cuts)), 0.0
    while stretches:
        first, last = stretches.pop()
        span = t[[first, last]]
        part = replace(ready, case=replace(ready.case, t_end=float(span[1])))
        start = dict(zip((v.name for v in ready.model.x), y[:, first].tolist(), strict=True))
        try:
            other = _run(part, ready.case.rtol / 100, _other(ready.case), limit, start, span)
        except ValueError:  # no algebraic unknowns found for the states on the way
            return float("inf")
        if isinstance(other, SolveError):
            return float("inf")
        error = float((np.abs(y[:, [last]] - _table(other, span[1:])) / size).max())
        if error > RIGHT and last - first > 1:
            middle = (first + last) // 2
            stretches += [(first, middle), (middle, last)]
        elif error > RIGHT:
            return error
        else:
            worst = max(worst, error)
    return worst


STATIONS = (0, TIMES // 3, 2 * TIMES // 3)
"""Times, by number, at which a tolerance is put in."""
