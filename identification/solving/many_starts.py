"""Descents from many starts on any executor, with bit-identical results.

Starts are a Latin hypercube around the first one. Positive values are multiplied by factors up to
`REACH`, values bounded by the user cover their range, and values of either sign change by up to
half their magnitude; start values of records are unchanged.

Results are processed in the order of the start numbers. The search ends early if the best start
leaves only white noise, or if `AGREE` starts find the same lowest minimum. Further results are
dropped, so that the outcome does not depend on the executor.

Source: M. D. McKay, R. J. Beckman, W. J. Conover, Technometrics 21, 1979.
"""

from collections.abc import Callable, Generator, Sequence
from concurrent.futures import BrokenExecutor, Executor
from dataclasses import replace
from functools import partial

import numpy as np

from identification.residuals.evaluation import Array
from identification.solving.descent import Start, descend, descend_easier_first
from identification.solving.task import Point, Task, square
from identification.unknowns.spec import Unknown
from identification.unknowns.unknowns import Unknowns
from symfric.foundation.executors import in_order
from symfric.foundation.status import SolveError, Status

REACH = 5.0
"""Largest factor by which a positive value is changed."""
WIDE = 1e3
"""Ratio of bounds up to which the whole range is searched; wider bounds are natural limits."""


def scattered(at: Unknowns, centre: Array, count: int, seed: int = 0) -> list[Array]:
    """Return `count` starts, the first at `centre`, deterministic for a given `seed`.

    Args:
        at: unknowns with their box.
        centre: coordinates, shape (n,).
        count: number of starts.
        seed: seed of the random numbers.
    """
    rng = np.random.default_rng(seed)
    n, others = centre.size, max(count - 1, 0)
    cells = np.stack([rng.permutation(others) for _ in range(n)], axis=1).reshape(others, n)
    shares = (cells + rng.random((others, n))) / max(others, 1)
    box = at.unknowns, *(x.tolist() for x in (centre, at.lower, at.upper))
    moved = (np.array([*map(_moved, *box, row)], float) for row in shares.tolist())
    return [at.inside(w) for w in (centre, *moved)]


def _moved(unknown: Unknown, w: float, lower: float, upper: float, share: float) -> float:
    """Return one coordinate moved according to `share` in (0, 1)."""
    side, bounded = 2 * share - 1, np.isfinite(upper) and np.isfinite(lower)
    if unknown.nuisance and not bounded:
        return w
    narrow = upper - lower < np.log(WIDE) or not unknown.logarithmic or unknown.above
    if bounded and narrow:
        return lower + share * (upper - lower)
    if unknown.logarithmic or unknown.above:
        return w + side * np.log(REACH)
    if lower >= 0 and w > 0:
        return w * REACH**side
    return w + 0.5 * side * abs(w)


Progress = Callable[[str, float], None]
"""Callback that is given the current activity and the completed fraction."""

AGREE = 3
"""Number of starts that must find the same lowest minimum for an early end."""
SAME = 1.0
"""Difference of minus twice the log-likelihood below which two minima are the same."""
WHITE = 3.0
"""Correlation of neighbours, relative to its standard deviation, rarely exceeded by white noise."""
LARGEST = 6.0
"""Residual, relative to the root mean square, rarely exceeded by normal noise of 1e6 samples."""


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


def is_white(task: Task, point: Point) -> bool:
    """Return True if the residuals of each channel are uncorrelated at several lags, without peaks.

    A law that misses a short part of the motion leaves few large residuals.
    """
    for channel in task.channels:
        r = point.r[channel.rows]
        if not channel.ordered or r.size < 20:
            return False
        if np.abs(r).max() > LARGEST * np.sqrt(np.mean(r**2)):
            return False
        for lag in (1, 2, 4):
            pairs = float(np.sum(r[lag:] * r[:-lag])) / max(square(r), 1e-300)
            if abs(pairs) > WHITE / np.sqrt(r.size):
                return False
    return True
