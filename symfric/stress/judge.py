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

from symfric.foundation.status import SolveError, Status
from symfric.integrator.arguments import chosen
from symfric.results.trajectory import Trajectory
from symfric.stress.cases import Case
from symfric.stress.problem import TIMES, WORK, Array, Problem, problem
from symfric.stress.refereed import Answer, States, answered

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
LADDER, FINEST = (1e-2, 1e-5, 1e-1), 1e-13
"""Tolerances of the references over that of the case, and the smallest one."""
PROBLEMS = ("sensitive", "adds up over steps")
"""Undecided for reasons that no better reference takes away."""
DOUBT = RIGHT / 3
"""Own error [tolerances] of the referee up to which it judges."""
CHECKED = 3000
"""Steps of which a run that was stopped is compared."""
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
        by: who judged: the referee, which shares no code with symfric, or its other methods.
    """

    kind: str
    reason: str = ""
    group: str = ""
    error: float | None = None
    steps: int = 0
    by: str = "methods"

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
    if error.status is Status.MAX_STEPS:
        return _stopped(ready, error)
    steps = error.partial.statistics.steps if isinstance(error.partial, Trajectory) else 0
    case = ready.case
    other = _run(ready, case.rtol, _other(case), ready.attempts)
    through = isinstance(other, Trajectory)
    group = f"{error.status.name}{', another method goes through' if through else ''}"
    return _refused(group, str(error), steps)


def _stopped(ready: Problem, error: SolveError) -> Verdict:
    """A run whose steps were used up: refused, if the beginning that it hands out is right."""
    run, case = error.partial, ready.case
    if not isinstance(run, Trajectory) or run.step_times.size < 2:
        return _refused("too many steps", str(error))
    reached = float(run.step_times[min(run.step_times.size - 1, CHECKED)])
    if reached - case.t_start < 1e-9 * (case.t_end - case.t_start):
        return _refused("too many steps at the start", str(error), run.statistics.steps)
    part = replace(ready, case=replace(case, t_end=reached))
    begun = _compared(part, run)
    text = f"{error} Its motion up to {reached:g} s is {begun.kind}. {begun.reason}"
    kind, group = "refused", "too many steps, right so far"
    if begun.kind == "undecided":
        group = "too many steps, motion so far not judged"
    elif begun.kind not in ("right", "loose"):
        kind, group = "undecided", "too many steps, motion so far wrong"
    return replace(begun, kind=kind, reason=text, group=group)


def _compared(ready: Problem, run: Trajectory) -> Verdict:
    """The referee's verdict; that of other methods where it has none, or is in doubt."""
    answer = answered(ready, lambda y, states: apart(ready, y, states).max(0))
    if answer is None or answer.doubt[1:].min() > DOUBT:
        return _by_methods(ready, run)
    sure = int(np.argmax(answer.doubt > DOUBT)) or TIMES
    y = _table(run, ready.times)
    over_time = apart(ready, y, answer.states).max(0)
    error, steps = float(over_time[:sure].max()), run.statistics.steps
    if error > RIGHT:
        limit = 10 * (steps + run.statistics.rejections) + ready.attempts
        if sure < TIMES:
            ready = replace(ready, case=replace(ready.case, t_end=float(ready.times[sure - 1])))
            answer = replace(answer, asked=replace(answer.asked, times=ready.times))
        verdict = _graded(ready, run, answer.states, error, limit, answer)
    elif sure == TIMES:
        verdict = Verdict("right", "", "", error, steps)
    else:
        verdict = _by_methods(ready, run)
        if verdict.kind != "undecided":
            return verdict
        text = f"right up to {ready.times[sure - 1]:g} s, where the referee's error grows as well"
        verdict = Verdict("undecided", text, "sensitive", error, steps)
    return replace(verdict, by="referee")


def _by_methods(ready: Problem, run: Trajectory) -> Verdict:
    """The verdict of symfric's own methods of other families, at smaller and smaller tolerances."""
    verdicts = list[Verdict]()
    for factor in LADDER:
        verdicts.append(_by_two(ready, run, max(factor * ready.case.rtol, FINEST)))
        if verdicts[-1].kind != "undecided" or verdicts[-1].group in PROBLEMS:
            return verdicts[-1]
    return verdicts[0]


def _by_two(ready: Problem, run: Trajectory, rtol: float) -> Verdict:
    """The verdict of two methods, one at `rtol` and, where needed, the other at a tenth of it."""
    case, steps = ready.case, run.statistics.steps
    limit = 10 * (steps + run.statistics.rejections) + ready.attempts
    reference = _run(ready, rtol, _other(case), limit)
    if not isinstance(reference, SolveError):
        error = distance(ready, run, _of(reference))
        if error <= RIGHT:
            return Verdict("right", "", "", error, steps)
    third = _run(ready, max(rtol / 10, FINEST), _third(case), limit)
    if isinstance(third, SolveError):
        failed = reference if isinstance(reference, SolveError) else third
        text = f"the reference failed: {failed}"
        return Verdict("undecided", text, f"reference: {failed.status.name}", None, steps)
    error = distance(ready, run, _of(third))
    if error <= RIGHT:
        return Verdict("right", "", "", error, steps)
    if isinstance(reference, SolveError):
        text = f"{error:.3g} tolerances off one reference; the other failed: {reference}"
        return Verdict("undecided", text, f"reference: {reference.status.name}", error, steps)
    doubt = distance(ready, reference, _of(third))
    if doubt > error / 3:
        text = f"{error:.3g} tolerances off, and the references disagree by {doubt:.3g}"
        return Verdict("undecided", text, "references disagree", error, steps)
    return _graded(ready, run, _of(third), error, limit)


def _graded(
    ready: Problem,
    run: Trajectory,
    truth: States,
    error: float,
    limit: int,
    answer: Answer | None = None,
) -> Verdict:
    """Loose or silently wrong, by what the problem itself makes of a tolerance."""
    steps, y = run.statistics.steps, truth(ready.times)
    grown = amplification(ready, y, limit, answer)
    text = f"{error:.3g} tolerances off; the problem makes {grown:.3g} of one"
    if error <= LOOSE or at_steps(ready, run, truth) <= LOOSE:
        return _explained(ready, run, truth, Verdict("loose", text, "", error, steps), grown)
    if error <= max(LOOSE, steps) * grown:
        if error * ready.case.rtol < SENSITIVE:
            return _explained(ready, run, truth, Verdict("loose", text, "", error, steps), grown)
        if grown * ready.case.rtol > SENSITIVE:
            return Verdict("undecided", text, "sensitive", error, steps)
        if (step := worst_step(ready, run, tolerances(ready, y), limit)) <= RIGHT:
            text += f", but no step is off by more than {step:.3g}"
            return Verdict("undecided", text, "adds up over steps", error, steps)
    return Verdict("silent", text, "", error, steps)


def _explained(
    ready: Problem, run: Trajectory, truth: States, loose: Verdict, grown: float
) -> Verdict:
    """A loose verdict with the reason that a measurement gives for its error."""
    error, text = loose.error or 0.0, loose.reason
    if error <= RIGHT * grown:
        return replace(loose, group="the problem amplifies tolerances")
    if (between := at_steps(ready, run, truth)) <= RIGHT:
        text += f", and the ends of its steps are off by {between:.3g}"
        return replace(loose, reason=text, group="between steps only")
    finer = _run(ready, max(ready.case.rtol / 10, 1e-13), ready.case.method, 10 * ready.attempts)
    if isinstance(finer, SolveError):
        return replace(loose, group="unexplained")
    less = distance(ready, finer, truth)
    text += f", and {less:.3g} are left at rtol/10"
    group = "adds up over steps, falls with rtol" if less <= error / 3 else "unexplained"
    return replace(loose, reason=text, group=group)


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


def distance(ready: Problem, run: Trajectory, truth: States) -> float:
    """Largest difference of a state [tolerances], see `apart`."""
    return float(apart(ready, _table(run, ready.times), truth).max())


def at_steps(ready: Problem, run: Trajectory, truth: States) -> float:
    """Largest difference at times [tolerances] where the run's own steps end.

    An implicit step may go over a fast transient and end right, and its polynomial leads there by
    another way.
    """
    times = run.step_times[run.step_times <= ready.case.t_end]
    times = times[:: 1 + times.size // TIMES]
    size = tolerances(ready, truth(ready.times))
    return float((np.abs(_table(run, times) - truth(times)) / size).max())


def apart(ready: Problem, y: Array, truth: States) -> Array:
    """Differences of states y at the times of the problem [tolerances], shape (nx, times).

    Where the model has events y may be early or late by rtol of the span: regimes jump.
    """
    if not ready.model.events:
        z = truth(ready.times)
        return np.abs(y - z) / tolerances(ready, z)
    late = ready.case.rtol * (ready.times[-1] - ready.times[0])
    shifted = [np.clip(ready.times + s * late, *ready.times[[0, -1]]) for s in (-1, 0, 1)]
    near = truth(np.concatenate(shifted)).reshape(y.shape[0], 3, -1)
    off = np.maximum(0.0, np.maximum(y - near.max(1), near.min(1) - y))
    return off / tolerances(ready, near[:, 1])


def _of(run: Trajectory) -> States:
    return lambda times: _table(run, times)


def tolerances(ready: Problem, z: Array) -> Array:
    """Tolerances rtol max|x| + atol of each state, shape (nx, 1); z (nx, times) are the states."""
    rtol, nominal = ready.case.rtol, ready.model.nominal("x")[:, None]
    return rtol * np.abs(z).max(1, keepdims=True) + 0.1 * rtol * nominal


def _table(run: Trajectory, times: Array) -> Array:
    """States over time, shape (nx, times)."""
    values = run.states(times)
    return np.stack([values[v.name] for v in run.model.x])


def amplification(ready: Problem, y: Array, limit: int, answer: Answer | None = None) -> float:
    """What becomes of one tolerance [tolerances], put in at the start or on the way of y."""
    size, worst = tolerances(ready, y), 1.0
    for k in STATIONS:
        times, ends = ready.times[k:], list[Array]()
        for added in (0.0, 1.0):
            start = y[:, k] + added * size[:, 0]
            if answer is not None and not ready.model.events:
                end = answer.onward(times, start)
            else:
                end = _onward(ready, times, start, limit)
            if end is None:
                return float("inf")
            ends.append(end)
        worst = max(worst, float((np.abs(ends[1] - ends[0]) / size).max()))
    return worst


def _onward(ready: Problem, times: Array, y: Array, limit: int) -> Array | None:
    """States at `times` of the motion that begins at the first of them with y, if it ends."""
    start = dict(zip((v.name for v in ready.model.x), y.tolist(), strict=True))
    try:
        run = _run(ready, ready.case.rtol / 100, _third(ready.case), limit, start, times)
    except ValueError:  # no algebraic unknowns found for the states on the way
        return None
    return None if isinstance(run, SolveError) else _table(run, times)


def worst_step(ready: Problem, run: Trajectory, size: Array, limit: int) -> float:
    """Largest error of a single step [tolerances], from where the run stood at its start.

    Stretches of steps are followed by another method, and those off by more than `RIGHT` halved
    until one step is left; the first such step is returned, or else the largest error of a
    stretch. Infinite where no other method can start or go on. What is damped within a stretch
    is not seen: it adds nothing to the error of the run.
    """
    t = run.step_times
    y = _table(run, t)
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
