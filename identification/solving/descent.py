"""Descents from one or many starts to a minimum, with a status of each result.

The trust-region method of SciPy (`least_squares`, method "trf") keeps iterates inside the bounds,
scales by the derivatives and is deterministic. Robust losses and weights are applied to the rows
before these are reduced to a triangle; its linear algebra therefore has n + 1 rows.

The end is accepted as a minimum by the predicted gain of a full Gauss-Newton step:

    fall = max over s of  f'f - |f + J s|^2     in the coordinates not held by a bound

A simulation over a whole record has many minima far from the truth; a simulation that restarts from
the data in every window has few. All starts except the first therefore begin on the `easier`
problems of the task (multiple shooting) and end on the task itself.

Results of many starts are processed in the order of the start numbers, on any executor. The search
ends early if the best start leaves only white noise, or if `AGREE` starts find the same lowest
minimum. Further results are dropped, so that the outcome is bit-identical on every executor.

Sources: M. A. Branch, T. F. Coleman, Y. Li, SIAM J. Sci. Comput. 21, 1999; J. Nocedal, S. J.
Wright, Numerical Optimization, 2nd ed., 2006, chapter 10; H. G. Bock, in Modelling of Chemical
Reaction Systems, Springer, 1981.
"""

from collections.abc import Callable, Generator, Sequence
from concurrent.futures import BrokenExecutor, Executor
from dataclasses import dataclass, replace
from functools import partial
from importlib import import_module
from typing import Any, final

import numpy as np

from identification.residuals.evaluation import Array
from identification.solving.task import (
    Point,
    Task,
    change,
    is_white,
    levels,
    objective,
    remaining,
    variance,
)
from symfric.foundation.executors import in_order
from symfric.foundation.status import SolveError, Status

Tell = Callable[[int], None]

GAIN, NEAR = 1e-6, 1e-2
"""Predicted fall of the cost relative to the variance: at a minimum, and at an acceptable end (a
tenth of a standard error).
"""
KINKS = 1.0
"""Acceptable predicted fall that no step achieves because of kinks of a law with switches."""
NOWHERE = 1e-13
"""Largest change of a coordinate that is not a step."""
ROUNDS = 12
"""Largest number of estimates of the noise levels."""
SETTLED = 0.02
"""Change of the noise levels below which the weights have converged."""
ROUGH = 0.1
"""Fall relative to the variance that is sufficient while noise levels still change."""


@final
@dataclass(frozen=True, eq=False)
class Start:
    """Start with the end of its descent.

    Attributes:
        number: number of the start in order of generation.
        w: coordinates at the end, shape (n,).
        cost: sum of the losses at the end, with the noise levels of the best start.
        status, message: status of the end.
        evaluations: number of evaluations of the residuals.
        noise: noise levels at the end [SI].
        objective: -2 log-likelihood, by which starts are compared.
    """

    number: int
    w: Array
    cost: float
    status: Status
    message: str
    evaluations: int
    noise: dict[str, float]
    objective: float


class _EndedError(Exception):
    """End of a search that cannot gain more."""


@final
@dataclass(eq=False)
class _Search:
    """Search by SciPy that keeps the evaluated points, also for interruptions."""

    task: Task
    best: Point
    left: int
    tell: Tell | None
    goal: float = GAIN
    why: str = ""
    count: int = 1
    last: Point | str = ""
    interrupted: bool = False

    def at(self, w: Array) -> Point | str:
        for known in (self.best, self.last):
            if isinstance(known, Point) and np.array_equal(known.w, w):
                return known
        near = not np.abs(w - self.best.w).max() > NOWHERE  # region shrunk by failures, or NaN
        if self.left <= 0 or near:
            raise _EndedError
        self.left -= 1
        self.count += 1
        if self.tell is not None:
            self.tell(self.count)
        self.last = self.task.at(w)
        if isinstance(self.last, str):
            self.why = self.last
        elif self.last.cost < self.best.cost:
            self.best = self.last
        return self.last

    def residuals(self, w: Array) -> Array:
        """Return the reduced residuals; infinite on failure, for which SciPy shrinks the step."""
        found = self.at(w)
        if isinstance(found, str):
            return np.full(len(self.task.unknowns.names) + 1, np.inf)
        return found.reduced[0]

    def slopes(self, w: Array) -> Array:
        """Return the derivatives of the reduced residuals, or end the search at a minimum.

        SciPy calls this only at accepted points.
        """
        found = self.at(w)
        if isinstance(found, str):  # unreachable: residuals are finite at accepted points
            raise _EndedError
        if remaining(self.task, found) <= self.goal * variance(self.task, found):
            raise _EndedError
        return found.reduced[1]

    def run(self) -> None:
        """Minimise from `best` under the noise levels of the task."""
        optimize: Any = import_module("scipy.optimize")  # slow to import
        box = self.task.unknowns
        try:
            with np.errstate(all="ignore"):  # for a trust region of zero size
                optimize.least_squares(
                    self.residuals, self.best.w, self.slopes, bounds=(box.lower, box.upper),
                    x_scale="jac", ftol=1e-15, xtol=1e-12, gtol=1e-15, max_nfev=self.left + 9,
                )  # fmt: skip
        except _EndedError:
            pass
        except KeyboardInterrupt:
            self.interrupted = True


def descend(
    task: Task, w0: Array, number: int = 0, evaluations: int = 200, tell: Tell | None = None
) -> Start:
    """Descend from `w0` to a minimum, and estimate the noise levels that were not given.

    `tell` is called with the number of each evaluation before it.

    The best point is always returned, also after an interruption or if the start has no residuals;
    see `status` and `message`.
    """
    try:
        first = task.at(task.unknowns.inside(w0))
        status = Status.NOT_FINITE
    except KeyboardInterrupt:
        first, status = "interrupted by the user before the first residuals", Status.INTERRUPTED
    if isinstance(first, str):
        return Start(number, w0, np.inf, status, first, 1, task.noise, np.inf)
    search = _Search(task, first, evaluations - 1, tell)
    if task.estimated:
        _renew(search)
    for count in range(ROUNDS if task.estimated else 1):
        search.goal = GAIN if count or not task.estimated else ROUGH
        search.run()
        if search.interrupted or search.left <= 0 or not task.estimated:
            break
        moved = _renew(search)
        settled = moved < SETTLED or (len(search.task.noise) == 1 and task.loss == "squares")
        fall = remaining(search.task, search.best)
        if settled and (fall <= GAIN * variance(search.task, search.best) or count):
            break
    spent = evaluations - search.left + _back(search)
    end, noise = search.best, search.task.noise
    likelihood = objective(search.task, end)
    return Start(number, end.w, end.cost, *_verdict(search), spent, noise, likelihood)


def _back(search: _Search) -> int:
    """Move values to a bound that they nearly reach if the cost permits it; the others adapt.

    Values that count as zero or infinite are replaced by finite limits. Return the number of
    evaluations that this takes.
    """
    box, old = search.task.unknowns, search.best
    linear = np.array([not u.logarithmic for u in box.unknowns])
    bound = np.where(old.w - box.lower < box.upper - old.w, box.lower, box.upper)
    near = box.at_bound(old.w) & linear & np.isfinite(bound)
    w = np.where(near, bound, np.clip(old.w, *box.limits))
    if np.array_equal(w, old.w):
        return 0
    J = old.reduced[1]
    adapted = np.linalg.lstsq(J[:, ~near], J[:, near] @ (old.w - w)[near])[0]
    w[~near] = np.clip(w[~near] + adapted, box.lower[~near], box.upper[~near])
    there = search.task.at(w)
    if isinstance(there, Point) and there.cost - old.cost <= NEAR * variance(search.task, old):
        search.best = there
    return 1


def _renew(search: _Search) -> float:
    """Estimate the noise levels at the best point, and return their change."""
    old = search.task.noise
    search.task = search.task.with_noise(levels(search.task, search.best))
    search.best = search.task.again(search.best)
    search.last = ""
    return change(old, search.task.noise)


def _verdict(search: _Search) -> tuple[Status, str]:
    """Return the status of the search and a message."""
    task, point = search.task, search.best
    fall = remaining(task, point) / variance(task, point)
    if search.interrupted:
        return Status.INTERRUPTED, "interrupted by the user; best result so far"
    if fall <= 1e2 * GAIN:
        return Status.SOLVED, ""
    if fall <= NEAR:
        return Status.ACCEPTABLE, ""
    if search.left <= 0:
        return Status.MAX_ITERATIONS, f"a step would still gain {fall:.3g} of the variance"
    if search.why:
        return Status.NO_DESCENT, f"the last failed trial: {search.why}"
    message = f"a step should gain {fall:.3g} of the variance, but none does"
    if fall <= KINKS:
        return Status.ACCEPTABLE, f"{message}: less than a standard error, as at kinks of a law"
    return Status.NO_DESCENT, message


ENOUGH = 40
"""Number of evaluations on an easier problem, which need not converge."""
REACH = 100.0
"""Largest factor by which an easier problem may change a logarithmic value."""


def descend_easier_first(
    task: Task, w0: Array, number: int, evaluations: int, tell: Tell | None = None
) -> Start:
    """Descend to a minimum; all starts except the first solve the task's easier problems first."""
    w, spent = w0, 0
    for other in task.easier if number else ():
        shared = set(task.unknowns.fitted) & set(other.unknowns.fitted)
        here = _parameters(task, w, shared)
        first, box = other.unknowns.of(here), other.unknowns
        # parts of a record may be fitted equally well by values that vanish or grow without bound
        free = np.array([np.log(REACH) if u.logarithmic else np.inf for u in box.unknowns])
        lower, upper = np.maximum(box.lower, first - free), np.minimum(box.upper, first + free)
        near = replace(other, unknowns=replace(box, lower=lower, upper=upper))
        end = descend(near, first, number, min(evaluations, ENOUGH), tell)
        spent += end.evaluations
        if end.status is Status.INTERRUPTED:
            return replace(end, w=w, cost=np.inf, objective=np.inf)
        if np.isfinite(end.cost):
            w = task.unknowns.of(_parameters(other, end.w, shared))
    found = descend(task, w, number, evaluations, tell)
    return replace(found, evaluations=found.evaluations + spent)


def _parameters(task: Task, w: Array, shared: set[str]) -> dict[str, float]:
    """Return the values that both problems fit, except those of single records and windows."""
    values, own = task.unknowns.named(w), set(task.unknowns.nuisance)
    return {name: x for name, x in values.items() if name in shared and name not in own}


Progress = Callable[[str, float], None]
"""Callback that is given the current activity and the completed fraction."""

AGREE = 3
"""Number of starts that must find the same lowest minimum for an early end."""
SAME = 1.0
"""Difference of minus twice the log-likelihood below which two minima are the same."""


def many_starts(
    task: Task,
    starts: Sequence[Array],
    executor: Executor | None = None,
    progress: Progress | None = None,
    evaluations: int = 120,
    agree: int = AGREE,
) -> tuple[Start, ...]:
    """Descend from each of `starts`, shape (n,) each.

    Args:
        task: the problem; it must be picklable if there is an executor.
        starts: coordinates of the starts.
        executor: executor of threads or processes; None: one start after the other in this thread.
        progress: called after each start; without an executor also before each evaluation.
        evaluations: limit of residual evaluations for each start; if the best start reaches the
            limit, it continues with as many again.
        agree: number of starts that must find the same minimum for an early end; 0: never.

    Returns:
        The ends in the order of the start numbers, with costs for the noise levels of the best
        one. One end if the residuals are linear, because there is only one minimum. After Ctrl-C,
        the starts finished so far and the state of the interrupted start.
    """
    done: list[Start] = []
    if len(starts) > 1 and task.is_linear(starts[0]):
        starts = starts[:1]
    task = task.reduced(starts[0])
    found = _in_turn(task, starts, executor, progress, evaluations)
    try:
        for start in found:
            done.append(start)
            if progress is not None:
                progress(f"start {len(done)} of {len(starts)}", len(done) / len(starts))
            if start.status is Status.INTERRUPTED or (agree and _enough(task, done, agree)):
                break
    except BrokenExecutor as error:
        why = f"a worker process ended after {len(done)} of {len(starts)} starts (killed, or out "
        why += "of memory); fewer workers need less memory"
        if not done:
            raise SolveError(f"fit: {why}", Status.INTERRUPTED) from error
        _mark_interrupted(done, why)
    except KeyboardInterrupt:
        if not done:
            raise
        _mark_interrupted(done, f"interrupted by the user after {len(done)} starts")
    finally:
        found.close()
    best = best_of(done)
    interrupted = any(start.status is Status.INTERRUPTED for start in done)
    if best.status is Status.MAX_ITERATIONS and not interrupted:
        more = descend(task, best.w, best.number, evaluations)
        if more.objective <= best.objective:
            spent = best.evaluations + more.evaluations
            done[done.index(best)] = best = replace(more, evaluations=spent)
    if not np.isfinite(best.objective):
        return tuple(done)
    return tuple(replace(s, cost=best.cost + s.objective - best.objective) for s in done)


def _mark_interrupted(done: list[Start], why: str) -> None:
    """Mark the best start as interrupted, unless it is at a minimum."""
    best = best_of(done)
    if not best.status.ok:
        message = f"{why}; best result so far"
        done[done.index(best)] = replace(best, status=Status.INTERRUPTED, message=message)


def best_of(starts: Sequence[Start]) -> Start:
    """Return the start with the highest likelihood, the first one if several are equal."""
    return min(starts, key=lambda s: (s.objective, s.number))


def _in_turn(
    task: Task,
    starts: Sequence[Array],
    executor: Executor | None,
    progress: Progress | None,
    evaluations: int,
) -> Generator[Start]:
    """Yield the ends in the order of the start numbers."""
    if executor is None:
        for number, w in enumerate(starts):
            tell = None if progress is None else partial(_tell, progress, number, len(starts))
            yield descend_easier_first(task, w, number, evaluations, tell)
        return
    calls = [(w, number, evaluations) for number, w in enumerate(starts)]
    yield from in_order(executor, descend_easier_first, task, calls)


def _tell(progress: Progress, number: int, count: int, evaluation: int) -> None:
    progress(f"start {number + 1} of {count}, evaluation {evaluation}", number / count)


def _enough(task: Task, done: Sequence[Start], agree: int) -> bool:
    """Return True if no further start is needed."""
    best = best_of(done)
    same = [s for s in done if s.status.ok and s.objective - best.objective < SAME]
    if best.status.ok and len(same) >= agree:
        return True
    if not best.status.ok or best is not done[-1]:
        return False
    point = task.with_noise(best.noise).at(best.w)
    return isinstance(point, Point) and is_white(task, point)
