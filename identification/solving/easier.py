"""From a start far off by way of easier problems of the same parameters.

A motion that is simulated over a whole record has many minima far from the truth, one that starts
again from the data in every window has few. Residuals may therefore bring `easier` ones; what those
find is where the descent on the residuals proper begins. The first start goes straight: it is the
one that data or user have chosen.

Source: H. G. Bock, in Modelling of Chemical Reaction Systems, Springer, 1981 (multiple shooting).
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from identification.solving.descent import Start, Tell, descend
from identification.solving.task import Task
from symfric.foundation.status import Status

Array = NDArray[np.float64]

ENOUGH = 40
"""Evaluations on an easier problem: it need not end at its minimum."""
REACH = 100.0
"""Largest factor by which it may change a positive value."""


def descend_by_way(
    task: Task, w0: Array, number: int, evaluations: int, tell: Tell | None = None
) -> Start:
    """`descend`, for all but the first start by way of the easier problems of the task."""
    w, spent = w0, 0
    for other in task.easier if number else ():
        shared = set(task.unknowns.fitted) & set(other.unknowns.fitted)
        here = _parameters(task, w, shared)
        first = other.unknowns.of(here)
        end = descend(_near(other, first), first, number, min(evaluations, ENOUGH), tell)
        spent += end.evaluations
        if end.status is Status.INTERRUPTED:
            return replace(end, w0=w0, w=w, cost=np.inf, objective=np.inf)
        if np.isfinite(end.cost):
            w = task.unknowns.of(_parameters(other, end.w, shared))
    found = descend(task, w, number, evaluations, tell)
    return replace(found, w0=w0, evaluations=found.evaluations + spent)


def _near(task: Task, w: Array) -> Task:
    """The problem with logarithmic values within a factor of `REACH` of those at `w`.

    Parts of a record may be fitted as well by something that vanishes or grows without bound.
    """
    box = task.unknowns
    free = np.array([np.log(REACH) if u.logarithmic else np.inf for u in box.unknowns])
    near = replace(
        box, lower=np.maximum(box.lower, w - free), upper=np.minimum(box.upper, w + free)
    )
    return replace(task, unknowns=near)


def _parameters(task: Task, w: Array, shared: set[str]) -> dict[str, float]:
    """Values of what both problems fit, without what belongs to records and windows."""
    values, own = task.unknowns.named(w), set(task.unknowns.nuisance)
    return {name: x for name, x in values.items() if name in shared and name not in own}
