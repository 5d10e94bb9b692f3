"""Positions that jump: a count that wraps, an encoder that lost its place."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from identification.data.check_spikes import median_of_five
from identification.data.findings import Finding
from identification.data.view import Array, View, count_of

FAR = 15.0
"""Step over that which 99.5 % of all stay below, and ..."""
NEAR = 8.0
"""... over the steps next to it: what moved fast before or after has not jumped."""
LEAST = 20
"""Counts of an encoder below which nothing can be told."""
WHITE = 0.5
"""Correlation of neighbours below which a position is noise."""
ALIKE = 0.05
"""Relative spread of jumps that are a period."""
FORCED = 5.0
"""Step of the force, over that which 90 % stay below, that goes with a true jump."""
OFTEN = 6
"""So many jumps of different sizes are stick-slip at a low sample rate rather than losses."""


def of_jumps(view: View) -> Iterator[Finding]:
    """Wrapped positions and lost ones."""
    x = view.signal("x")
    if x is None or view.record.t is None or x.size < 50 or np.ptp(x) <= LEAST * count_of(x):
        return
    lag = float(np.corrcoef(x[1:], x[:-1])[0, 1])
    if lag < WHITE:  # noise jumps all the time
        return
    name, unit = view.name("x"), view.record.units[view.name("x")]
    steady = median_of_five(x)
    steps = np.diff(steady)
    size = np.abs(steps)
    usual = max(float(np.quantile(size, 0.995)), count_of(x))
    beside = np.maximum(np.roll(size, 2), np.roll(size, -2))
    far = np.flatnonzero((size > FAR * usual) & (size > NEAR * np.maximum(beside, usual)))
    if not far.size:
        raw = np.abs(np.diff(x))  # a wrap of a fast drive: many jumps raise the usual step
        far = np.flatnonzero(raw > 0.5 * np.ptp(x))
        if far.size > 0.2 * x.size:
            return
        steps, size = np.diff(x), raw
    if not far.size:
        return
    heights, k = size[far], int(far[np.argmax(size[far])])
    period = _period(x, far)
    alike = float(np.quantile(heights, 0.9) - np.quantile(heights, 0.1)) <= ALIKE * heights.max()
    if alike and period > 0.8 * np.ptp(x):
        yield view.finding(
            "wrap",
            name,
            f"{name} jumps {far.size} time(s) by {period:.4g} {unit}, its whole range, first at "
            f"{view.at(int(far[0]))}: it is counted modulo a period; use "
            f"data.unwrapped({{'{name}': {period:.5g}}}).",
            "error",
            int(far[0]),
            int(far[-1]) + 1,
        )
        return
    pushed = _force_jumps(view, k)
    yield view.finding(
        "jump",
        name,
        f"{name} jumps {far.size} time(s), most by {size[k]:.3g} {unit} at {view.at(k)}: "
        + ("a motion too fast for the sample rate." if pushed else "a sensor that lost its place."),
        "warning" if pushed or far.size >= OFTEN else "error",
        int(far[0]),
        int(far[-1]) + 1,
    )


def _force_jumps(view: View, k: int) -> bool:
    """Whether the force jumps with the position: then the body did, as in a slip."""
    force = view.signal("force")
    if force is None:
        return False
    steps = np.abs(np.diff(force))
    near = steps[max(k - 1, 0) : k + 2]
    return bool(near.max() > FORCED * (np.quantile(steps, 0.9) + 1e-300))


def _period(x: Array, far: NDArray[np.intp]) -> float:
    """The jumps plus what the position moved on meanwhile, as it did before and after."""
    steps = np.diff(x)
    inner = far[(far > 4) & (far < steps.size - 5)]
    found: list[float] = []
    for k in inner.tolist():
        near = np.arange(k - 2, k + 3)
        at = int(near[np.argmax(np.abs(steps[near]))])
        beside = float(np.median(np.abs(steps[[at - 2, at - 1, at + 1, at + 2]])))
        found.append(abs(float(steps[at])) + beside)
    return float(np.median(found)) if found else float(np.ptp(x))
