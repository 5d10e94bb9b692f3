"""What changes over a record that a rough drive does not know: drift of the offset, dead time."""

from collections.abc import Iterator

import numpy as np

from identification.data.findings import Finding
from identification.data.rough import Rough, explained_when_late, one_way
from identification.data.view import View

LARGE = 0.12
"""Drift over the robust spread of the force that is told."""
SURE = 4.5
LAGS = (-20, -10, -5, -3, -2, -1, 1, 2, 3, 5, 10, 20)
"""Delays that are tried, in samples, before those between the neighbours of the best one."""
BETTER = 0.88
"""Unexplained part that a delay leaves, over that without it, from which on it is told ..."""
WORSE = 1.05
"""... where the same lead leaves more."""


def of_drift(view: View, model: Rough | None, free: Rough | None) -> Iterator[Finding]:
    """A force that follows the time beside what a rough drive needs."""
    if model is None or not model.clean or model.explained < 0.5:
        return
    if free is None or one_way(model):
        return
    rise, sure = float(free.values[-1]), free.sure(-1)
    spread = float(np.ptp(np.quantile(model.force, (0.25, 0.75))))
    if abs(rise) > LARGE * spread and abs(sure) > SURE:
        name = view.name("force")
        yield view.finding(
            "drift",
            name,
            f"{name} drifts by {rise:.3g} {view.record.units[name]} from the first to the last "
            "sample against what a rough drive needs: a sensor without a fixed zero, or a drive "
            "that warms.",
            "warning",
        )


def of_dead_time(view: View, model: Rough | None, free: Rough | None) -> Iterator[Finding]:
    """A force that explains the motion better when it is moved in time."""
    if model is None or not model.clean or model.explained < 0.5 or abs(model.sure(0)) < 5:
        return
    if free is None:
        return
    now = max(1 - free.explained, 1e-9)

    def unexplained(lag: int) -> float:
        return (1 - explained_when_late(free, lag * model.step)) / now

    left = {lag: unexplained(lag) for lag in LAGS}
    best = min(left, key=lambda lag: left[lag])
    if left[best] < BETTER and left[-best] > WORSE and abs(best) > 1:
        k = LAGS.index(best)
        best = min(range(LAGS[max(k - 1, 0)], LAGS[min(k + 1, len(LAGS) - 1)] + 1), key=unexplained)
        name = view.name("force")
        word = "late" if best > 0 else "early"
        yield view.finding(
            "delay",
            name,
            f"{name} seems to be {word} by about {abs(best) * model.step:.3g} s ({abs(best)} "
            f"samples) against {view.name('x')}: estimate dead_time, or use data.delayed("
            f"{{'{name}': {-best * model.step:.3g}}}).",
            "warning",
        )
