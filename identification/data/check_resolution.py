"""Signals of few levels: an encoder or a converter that is too coarse for what is asked."""

from collections.abc import Iterator

import numpy as np

from identification.data.findings import Finding
from identification.data.rough import Rough
from identification.data.view import View, count_of

COARSE = 0.04
"""Step of a force over its range that is told."""
PER_SAMPLE = 0.5
"""Counts per sample at a usual speed below which velocities are guesses."""


def of_resolution(view: View, model: Rough | None) -> Iterator[Finding]:
    """Forces of few levels, positions of few counts at the speeds of the record."""
    force = view.signal("force")
    if force is not None and np.ptp(force) > 0:
        usual = float(np.ptp(np.quantile(force, (0.01, 0.99))))
        step, spread = count_of(force), usual or float(np.ptp(force))
        if step > COARSE * spread:
            name = view.name("force")
            yield view.finding(
                "resolution",
                name,
                f"{name} has steps of {step:.3g} {view.record.units[name]}, {step / spread:.0%} of "
                "its range: finer differences of friction cannot be told.",
                "warning",
            )
    x = view.signal("x")
    if x is None or model is None or not model.clean:
        return
    count = count_of(x)
    moved = np.abs(model.v[model.moving])
    if count > 0 and moved.size:
        slow = float(np.quantile(moved, 0.25)) * model.step
        if slow < PER_SAMPLE * count:
            name = view.name("x")
            yield view.finding(
                "resolution",
                name,
                f"{name} has counts of {count:.3g} {view.record.units[name]}, and a quarter of the "
                f"motion makes less than {slow / count:.2g} of one per sample: velocities there "
                "are averages over several.",
                "warning",
            )
