"""Whether there is motion: standstill, noise only, one way only, a force that never changes."""

from collections.abc import Iterator

import numpy as np

from identification.data.findings import Finding
from identification.data.rough import Rough, one_way
from identification.data.view import Array, View, count_of

MOVED = 6.0
"""Range of the position over its noise (standard deviation) below which nothing moved."""
COUNTS = 4
"""Counts of an encoder below which nothing moved."""
WHITE = 0.3
"""Correlation of neighbours below which a position is noise."""
ONE_WAY = 0.005
"""Share of the way in the other direction up to which the drive moves one way."""


def of_motion(view: View, model: Rough | None) -> Iterator[Finding]:
    """Signals that hold no motion."""
    x, force = view.signal("x"), view.signal("force")
    if x is not None and view.record.t is not None and x.size >= 20:
        yield from _still(view, x)
    if force is not None and force.size >= 20 and np.ptp(force) == 0:
        nothing = float(force[0]) == 0
        yield view.finding(
            "constant",
            view.name("force"),
            f"{view.name('force')} is {force[0]:g} {view.record.units[view.name('force')]} "
            "throughout: "
            + (
                "motion without a drive tells friction over mass only."
                if nothing
                else "nothing was measured there."
            ),
            "warning" if nothing else "error",
        )
    if model is not None and model.clean:
        yield from _one_way(view, model)


def _still(view: View, x: Array) -> Iterator[Finding]:
    name, unit = view.name("x"), view.record.units[view.name("x")]
    steps = np.diff(x)
    if np.ptp(x) == 0 or np.ptp(x) < COUNTS * count_of(x):
        yield view.finding(
            "standstill", name, f"{name} never changes by more than {np.ptp(x):.3g} {unit}: "
            "nothing moved.", "error",
        )  # fmt: skip
        return
    centred = x - x.mean()
    lag = float(centred[1:] @ centred[:-1] / (centred @ centred))
    noise = float(np.std(steps)) / np.sqrt(2)
    if lag < WHITE:
        yield view.finding(
            "noise", name, f"{name} is noise of {noise:.3g} {unit}: neighbouring samples have "
            "nothing to do with each other, and no body moves like that.", "error",
        )  # fmt: skip
    elif np.ptp(np.quantile(x, (0.02, 0.98))) < MOVED * _white(x):
        yield view.finding(
            "standstill", name, f"{name} moves by {np.ptp(np.quantile(x, (0.02, 0.98))):.3g} {unit}"
            " only, which its noise does, too.", "error",
        )  # fmt: skip


def _white(x: Array) -> float:
    """Standard deviation of the white part of the position."""
    return float(np.std(np.diff(x, 3))) / np.sqrt(20)


def _one_way(view: View, model: Rough) -> Iterator[Finding]:
    if one_way(model, ONE_WAY):
        direction = "forwards" if model.v.sum() > 0 else "backwards"
        yield view.finding(
            "one-way",
            view.name("x"),
            f"The drive moves {direction} only: friction cannot be told from a constant force, "
            "nor from gravity.",
            "warning",
        )
