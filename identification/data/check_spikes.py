"""Single samples, or two, far off their neighbours."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from identification.data.findings import Finding
from identification.data.view import Array, View, count_of

FAR = 12.0
"""Distance from the running median, over that of the farthest 5 %, that is a spike."""
RANGE = 0.2
"""... and over the range that 98 % of the signal have."""
BACK = 3.0
"""... and over the difference of the samples three before and three behind."""
MANY = 0.02
"""Share of the samples from which on they are no exceptions."""
HEAVY = 0.5
"""Share of a signal's variance that lies in its spikes and spoils any least squares."""


def of_spikes(view: View) -> Iterator[Finding]:
    """Spikes of every signal; those that outweigh the signal are an error."""
    named = view.roles.values()
    for signal, y in view.known():
        if view.record.t is None:
            continue
        far, off = spike_samples(y, position=signal == view.name("x"))
        if not far.size:
            continue
        k = int(far[np.argmax(off[far])])
        weight = float((off[far] ** 2).sum() / (((y - np.median(y)) ** 2).sum() + 1e-300))
        position, heavy = signal == view.name("x"), weight > HEAVY and signal in named
        unit = view.record.units[signal]
        yield view.finding(
            "glitch" if position else "spikes",
            signal,
            f"{signal} is far off its neighbours in {far.size} sample(s), most at {view.at(k)} by "
            f"{off[k]:.3g} {unit}: take them out with data.without_spikes().",
            "error" if position or heavy else "warning",
            int(far[0]),
            int(far[-1]),
        )


def spike_samples(y: Array, *, position: bool) -> tuple[NDArray[np.intp], Array]:
    """The samples that are spikes, and the distance of all samples from their neighbours."""
    none = np.zeros(0, dtype=np.intp)
    if y.size < 50 or np.ptp(y) == 0:
        return none, np.zeros(y.size)
    off = np.abs(y - median_of_five(y))
    usual = max(float(np.quantile(off, 0.95)), count_of(y))
    limit = max(FAR * usual, RANGE * float(np.ptp(np.quantile(y, (0.01, 0.99)))))
    if position:  # smooth: much less is a glitch
        limit = max(FAR * usual, 3 * float(np.quantile(np.abs(np.diff(y)), 0.9)))
    through = np.abs(np.roll(y, -3) - np.roll(y, 3))  # what moves on has no spike
    through[:3] = through[-3:] = 0.0
    far = np.flatnonzero((off > limit) & (off > BACK * through))
    return (far if limit > 0 and far.size <= MANY * y.size else none), off


def median_of_five(y: Array) -> Array:
    """The running median, which single samples and pairs do not move."""
    padded = np.pad(y, 2, mode="edge")
    return np.asarray(np.median(np.lib.stride_tricks.sliding_window_view(padded, 5), axis=1))
