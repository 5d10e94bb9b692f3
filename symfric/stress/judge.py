"""Verdicts on cases, from a referee that shares no code with symfric, or from other methods.

    tolerance of a state = rtol max|x| + atol,   error = max over states and times of
                                                         |run - truth| / tolerance

The error of a right run is at most RIGHT tolerances. The truth is the motion of the referee if it
knows law and scene and if its error, the difference of two of its solves, is small. Otherwise it is
the motion of two other methods of symfric at a hundredth and a thousandth of the tolerance, which
must agree. A larger error may have other reasons than the run: the problem may amplify a tolerance
(a block at the limit of sticking, a chaotic pendulum), and without damping the errors of all steps
add up; the error then decreases with rtol. A case that no reference decides is "undecided", never
"right". A run that reports too many steps is refused, and its partial result is compared.
"""

from dataclasses import dataclass, replace
from typing import final

import numpy as np

from symfric import SolveError, Status, Trajectory
from symfric.stress.cases import Case
from symfric.stress.problem import (
    RIGHT,
    TIMES,
    WORK,
    Answer,
    CaseProblem,
    States,
    of,
    problem,
    table,
)

CLASSES = {
    "right": "equal to the reference within ten tolerances",
    "refused": "an error message: bad input, or a solve that failed",
    "loose": "off by up to a hundred tolerances, or by the sum of those of all steps",
    "undecided": "references disagree, fail or are too sensitive, and steps cannot be judged",
    "silent": "status of success, and wrong",
    "nan": "status of success, and a signal is not finite",
    "crash": "a foreign exception, or the process died",
    "hang": "no end within the limit",
}
"""Class -> meaning, in the order of the table."""

FAILING = ("silent", "nan", "crash", "hang")
"""Classes whose cases are failures."""

LOOSE = 100.0
SENSITIVE = 1e-2
"""Relative error above which the sum of errors is not small, so that each step is judged; and
relative growth of one tolerance above which the error of a step decides nothing."""
SUSPECT = "adds up over steps"
"""Group of undecided runs, which are silently wrong if a single step is wrong."""
LADDER, FINEST = (1e-2, 1e-5, 1e-1), 1e-13
"""Tolerances of the references relative to that of the case, and the smallest tolerance."""
DOUBT = RIGHT / 3
"""Largest error [tolerances] of the referee at which its solution is used."""
CHECKED = 3000
"""Largest number of steps of a stopped run that are compared."""
RAW = ("Traceback", ".cpp:", "casadi::", "Assertion")
"""Texts that messages to users must not contain."""


@final
@dataclass(frozen=True)
class Judgement:
    """Verdict on a case.

    Attributes:
        kind: one of `CLASSES`.
        reason: explanation; empty for a right run.
        group: short name of the reason for the table.
        error: error [tolerances], or None.
        steps: number of steps.
        by: "referee", which shares no code with symfric, or "methods" of symfric.
    """

    kind: str
    reason: str = ""
    group: str = ""
    error: float | None = None
    steps: int = 0
    by: str = "methods"


def judge(case: Case, work: int = WORK) -> Judgement:
    """Return the verdict on a case; exceptions due to defects of symfric are not caught.

    Args:
        case: data of the case.
        work: largest number of attempts of a run times its unknowns; a reference may take this
            number plus ten times the attempts of the run.
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
        return Judgement("nan", f"{', '.join(broken)}: not finite", "not finite")
    return _compared(ready, run)


def _refused(group: str, sentence: str, steps: int = 0) -> Judgement:
    raw = [text for text in RAW if text in sentence]
    if raw or not sentence.strip():
        return Judgement("crash", f"raw text instead of a sentence: {sentence}", "raw text")
    return Judgement("refused", sentence, group, steps=steps)


def _failed(ready: CaseProblem, error: SolveError) -> Judgement:
    """Judge a solve that reports a failure; the group states whether another method succeeds."""
    if error.status is Status.MAX_STEPS:
        return _stopped(ready, error)
    steps = error.partial.statistics.steps if isinstance(error.partial, Trajectory) else 0
    case = ready.case
    other = ready.attempt(case.rtol, ready.other, ready.attempts)
    through = isinstance(other, Trajectory)
    group = f"{error.status.name}{', another method succeeds' if through else ''}"
    return _refused(group, str(error), steps)


def _stopped(ready: CaseProblem, error: SolveError) -> Judgement:
    """Judge a run with too many steps, which is refused if its partial result is right."""
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


def _compared(ready: CaseProblem, run: Trajectory) -> Judgement:
    """Judge a run by the referee or by other methods; if they cannot decide, by each step."""
    answer = ready.answered()
    if answer is None or answer.doubt[1:].min() > DOUBT:
        verdict = by_methods(ready, run)
    else:
        verdict = _by_referee(ready, run, answer)
    if verdict.kind != "undecided":
        return verdict
    size = ready.tolerances(table(run, ready.times))
    step = ready.worst_step(run, size, ready.patience(run))
    text = f"{verdict.reason}, and the error of a single step is up to {step:.3g}"
    if step > RIGHT:
        kind = "silent" if verdict.group == SUSPECT else "undecided"
        return replace(verdict, kind=kind, reason=text)
    return replace(verdict, kind="loose", reason=text, group=f"{verdict.group}, each step is right")


def _by_referee(ready: CaseProblem, run: Trajectory, answer: Answer) -> Judgement:
    """Judge a run by the referee while its error is small, and by other methods afterwards."""
    sure = int(np.argmax(answer.doubt > DOUBT)) or TIMES
    over_time = ready.apart(table(run, ready.times), answer.states).max(0)
    error, steps = float(over_time[:sure].max()), run.statistics.steps
    if sure == TIMES and error <= RIGHT:
        return Judgement("right", "", "", error, steps, "referee")
    if error <= RIGHT:
        return by_methods(ready, run)
    if sure < TIMES:
        ready = replace(ready, case=replace(ready.case, t_end=float(ready.times[sure - 1])))
        answer = replace(answer, asked=replace(answer.asked, times=ready.times))
    return replace(_graded(ready, run, answer.states, error, answer), by="referee")


def by_methods(ready: CaseProblem, run: Trajectory) -> Judgement:
    """Judge a run by methods of other families at decreasing tolerances."""
    verdicts = list[Judgement]()
    for factor in LADDER:
        verdicts.append(_by_two(ready, run, max(factor * ready.case.rtol, FINEST)))
        if verdicts[-1].kind != "undecided" or verdicts[-1].group in ("sensitive", SUSPECT):
            return verdicts[-1]
    return verdicts[0]


def _by_two(ready: CaseProblem, run: Trajectory, rtol: float) -> Judgement:
    """Judge a run by a method at `rtol` and, if needed, another method at a tenth of it."""
    steps = run.statistics.steps
    limit = ready.patience(run)
    reference = ready.attempt(rtol, ready.other, limit)
    if not isinstance(reference, SolveError):
        error = ready.distance(run, of(reference))
        if error <= RIGHT:
            return Judgement("right", "", "", error, steps)
    third = ready.attempt(max(rtol / 10, FINEST), ready.third, limit)
    if isinstance(third, SolveError):
        failed = reference if isinstance(reference, SolveError) else third
        text = f"the reference failed: {failed}"
        return Judgement("undecided", text, f"reference: {failed.status.name}", None, steps)
    error = ready.distance(run, of(third))
    if error <= RIGHT:
        return Judgement("right", "", "", error, steps)
    if isinstance(reference, SolveError):
        text = f"{error:.3g} tolerances off one reference; the other failed: {reference}"
        return Judgement("undecided", text, f"reference: {reference.status.name}", error, steps)
    doubt = ready.distance(reference, of(third))
    if doubt > error / 3:
        text = f"{error:.3g} tolerances off, and the references disagree by {doubt:.3g}"
        return Judgement("undecided", text, "references disagree", error, steps)
    return _graded(ready, run, of(third), error)


def _graded(
    ready: CaseProblem,
    run: Trajectory,
    truth: States,
    error: float,
    answer: Answer | None = None,
) -> Judgement:
    """Judge a run with a large error by the growth of one tolerance in the problem."""
    steps, y = run.statistics.steps, truth(ready.times)
    grown = ready.amplification(y, ready.patience(run), answer)
    text = f"{error:.3g} tolerances off; the problem amplifies one to {grown:.3g}"
    if error <= LOOSE or ready.at_steps(run, truth) <= LOOSE:
        return _explained(ready, run, truth, Judgement("loose", text, "", error, steps), grown)
    if error <= max(LOOSE, steps) * grown:
        if error * ready.case.rtol < SENSITIVE:
            return _explained(ready, run, truth, Judgement("loose", text, "", error, steps), grown)
        group = "sensitive" if grown * ready.case.rtol > SENSITIVE else SUSPECT
        return Judgement("undecided", text, group, error, steps)
    return Judgement("silent", text, "", error, steps)


def _explained(
    ready: CaseProblem, run: Trajectory, truth: States, loose: Judgement, grown: float
) -> Judgement:
    """Return a loose verdict with the measured reason of its error."""
    error, text = loose.error or 0.0, loose.reason
    if error <= RIGHT * grown:
        return replace(loose, group="the problem amplifies tolerances")
    if (between := ready.at_steps(run, truth)) <= RIGHT:
        text += f", and the ends of its steps by {between:.3g}"
        return replace(loose, reason=text, group="between steps only")
    # the error at a corner varies by an order of magnitude with the position of the steps
    for divisor, share in ((10, 3), (100, 9)):
        rtol = max(ready.case.rtol / divisor, FINEST)
        finer = ready.attempt(rtol, ready.case.method, divisor * ready.attempts)
        if isinstance(finer, SolveError):
            break
        less = ready.distance(finer, truth)
        text += f", and {less:.3g} at rtol/{divisor}"
        if less <= error / share:
            return replace(loose, reason=text, group="adds up over steps, falls with rtol")
    return replace(loose, reason=text, group="unexplained")
