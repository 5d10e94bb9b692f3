"""What judges measure: errors in tolerances, what a problem makes of one, and single steps."""

from collections.abc import Mapping
from dataclasses import replace
from itertools import pairwise

import numpy as np

from symfric.foundation.status import SolveError
from symfric.integrator.arguments import chosen
from symfric.results.trajectory import Trajectory
from symfric.stress.cases import Case
from symfric.stress.problem import TIMES, Array, Problem
from symfric.stress.refereed import Answer, States

RIGHT = 10.0
"""Tolerances up to which a run is right."""
STATIONS = (0, TIMES // 3, 2 * TIMES // 3)
"""Times, by number, at which a tolerance is put in."""
STRIDES = 100
"""Steps that a reference takes at least: what a run may leap over, a reference must not."""


def attempt(
    ready: Problem,
    rtol: float,
    method: str,
    limit: int,
    x0: Mapping[str, float] | None = None,
    times: Array | None = None,
) -> Trajectory | SolveError:
    """One run as a reference, in short steps; a failure is returned.

    Args:
        limit: of attempts.
    """
    try:
        span = ready.case.t_end - ready.case.t_start
        return ready.run(
            rtol, method, max_steps=limit, x0=x0, t_eval=times, max_step=span / STRIDES
        )
    except SolveError as error:
        return error


def other_method(case: Case) -> str:
    """A method of another family than that of the case."""
    return "rodas5p" if chosen("case", case.method, case.rtol).name == "radau5" else "radau5"


def third_method(case: Case) -> str:
    """The method that is not the reference's."""
    return "radau5" if other_method(case) == "rodas5p" else "rodas5p"


def distance(ready: Problem, run: Trajectory, truth: States) -> float:
    """Largest difference of a state [tolerances], see `apart`."""
    return float(apart(ready, table(run, ready.times), truth).max())


def at_steps(ready: Problem, run: Trajectory, truth: States) -> float:
    """Largest difference at times [tolerances] where the run's own steps end.

    An implicit step may go over a fast transient and end right, and its polynomial leads there by
    another way.
    """
    times = run.step_times[run.step_times <= ready.case.t_end]
    times = times[:: 1 + times.size // TIMES]
    size = tolerances(ready, truth(ready.times))
    return float((np.abs(table(run, times) - truth(times)) / size).max())


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


def of(run: Trajectory) -> States:
    """The states of a run over time."""
    return lambda times: table(run, times)


def tolerances(ready: Problem, z: Array) -> Array:
    """Tolerances rtol max|x| + atol of each state, shape (nx, 1); z (nx, times) are the states."""
    rtol, nominal = ready.case.rtol, ready.model.nominal("x")[:, None]
    return rtol * np.abs(z).max(1, keepdims=True) + 0.1 * rtol * nominal


def table(run: Trajectory, times: Array) -> Array:
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
                end = onward(ready, times, start, limit)
            if end is None:
                return float("inf")
            ends.append(end)
        worst = max(worst, float((np.abs(ends[1] - ends[0]) / size).max()))
    return worst


def onward(ready: Problem, times: Array, y: Array, limit: int) -> Array | None:
    """States at `times` of the motion that begins at the first of them with y, if it ends."""
    start = dict(zip((v.name for v in ready.model.x), y.tolist(), strict=True))
    try:
        run = attempt(ready, ready.case.rtol / 100, third_method(ready.case), limit, start, times)
    except ValueError:  # no algebraic unknowns found for the states on the way
        return None
    return None if isinstance(run, SolveError) else table(run, times)


def worst_step(ready: Problem, run: Trajectory, size: Array, limit: int) -> float:
    """Largest error of a single step [tolerances], from where the run stood at its start.

    Stretches of steps are followed by another method, and those off by more than `RIGHT` halved
    until one step is left; the first such step is returned, or else the largest error of a
    stretch. Infinite where no other method can start or go on. What is damped within a stretch
    is not seen: it adds nothing to the error of the run.
    """
    t = run.step_times[run.step_times <= ready.case.t_end]
    y = table(run, t)
    cuts = np.unique(np.linspace(0, t.size - 1, STRIDES + 1).astype(int)).tolist()
    stretches, worst = list(pairwise(cuts)), 0.0
    while stretches:
        first, last = stretches.pop()
        span = t[[first, last]]
        part = replace(ready, case=replace(ready.case, t_end=float(span[1])))
        start = dict(zip((v.name for v in ready.model.x), y[:, first].tolist(), strict=True))
        try:
            other = attempt(
                part, ready.case.rtol / 100, other_method(ready.case), limit, start, span
            )
        except ValueError:  # no algebraic unknowns found for the states on the way
            return float("inf")
        if isinstance(other, SolveError):
            return float("inf")
        error = float((np.abs(y[:, [last]] - table(other, span[1:])) / size).max())
        if error > RIGHT and last - first > 1:
            middle = (first + last) // 2
            stretches += [(first, middle), (middle, last)]
        elif error > RIGHT:
            return error
        else:
            worst = max(worst, error)
    return worst
