"""Descent from one start to a minimum, with a status of the result.

The trust-region method of SciPy (`least_squares`, method "trf") keeps iterates inside the bounds,
scales by the derivatives and is deterministic. Robust losses and weights are applied to the rows
before these are reduced to a triangle; its linear algebra therefore has n + 1 rows.

The end is accepted as a minimum by the predicted gain of a full Gauss-Newton step:

    fall = max over s of  f'f - |f + J s|^2     in the coordinates not held by a bound

A simulation over a whole record has many minima far from the truth; a simulation that restarts from
the data in every window has few. All starts except the first therefore begin on the `easier`
problems of the task (multiple shooting) and end on the task itself.

Sources: M. A. Branch, T. F. Coleman, Y. Li, SIAM J. Sci. Comput. 21, 1999; J. Nocedal, S. J.
Wright, Numerical Optimization, 2nd ed., 2006, chapter 10; H. G. Bock, in Modelling of Chemical
Reaction Systems, Springer, 1981.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from importlib import import_module
from typing import Any, final

import numpy as np

from identification.residuals.evaluation import Array
from identification.solving.task import NOISELESS, Point, Task, change, levels, objective
from symfric.foundation.status import Status

Tell = Callable[[int], None]

GAIN, NEAR = 1e-6, 1e-2
"""Predicted fall of the cost relative to the variance: at a minimum, and at an acceptable end (a
tenth of a standard error).
"""
KINKS = 1.0
"""Acceptable predicted fall that no step achieves because of kinks of a law with switches."""
FAR = 15.0
"""Largest trusted step; for a logarithmic coordinate a factor of three million."""
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
    """Replace values that count as zero or infinite by finite limits if the cost permits it.

    Return the number of evaluations that this takes.
    """
    box, old = search.task.unknowns, search.best
    w = np.clip(old.w, *box.limits)
    if np.array_equal(w, old.w):
        return 0
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


def variance(task: Task, point: Point) -> float:
    """Return the variance of the weighted residuals; at least 1 if a noise level is given."""
    freedom = max(1, task.rows - point.w.size)
    least = 1.0
    if set(task.noise) == set(task.estimated):
        least = max((NOISELESS * task.spread(s) / task.noise[s]) ** 2 for s in task.noise)
    return max(least, point.cost / freedom)


def remaining(task: Task, point: Point) -> float:
    """Return the fall of the cost that a Gauss-Newton step in the free coordinates predicts.

    The step is limited to `FAR` in any principal direction. Beyond, derivatives are not reliable,
    and a coordinate without influence would need an unlimited step.
    """
    f, J = point.reduced
    g, box = np.einsum("ij,i->j", J, f), task.unknowns
    near = box.at_bound(point.w)
    low = near & (point.w - box.lower < box.upper - point.w)
    free = ~((low & (g > 0)) | (near & ~low & (g < 0)))
    u, s, _ = np.linalg.svd(J[:, free], full_matrices=False)
    part = np.abs(u.T @ f)
    reached = np.minimum(part, FAR * s)
    return float(((2 * part - reached) * reached).sum())


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
