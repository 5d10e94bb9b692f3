"""How far off a run is: by how much it differs from one that is made more carefully."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from symfric.integrator.running.sizes import own_scale
from symfric.model import Model
from symfric.results.trajectory import Trajectory

Array = NDArray[np.float64]
NOTHING = 1e-9
"""Derivatives smaller than this in nominal values are rounding of none."""


def difference(model: Model, one: Trajectory, other: Trajectory) -> float:
    """Largest difference of a state over both runs, relative to its magnitude.

    That is its nominal value, or its largest value where that is larger or tiny (`own_scale`).
    """
    n = min(one.t.size, other.t.size)
    worst = 0.0
    for v in model.x:
        a, b = one[v.name][:n], other[v.name][:n]
        size, nominal = np.abs(b).max(), np.array(v.nominal)
        scale = np.maximum(size, own_scale(size, nominal))
        worst = max(worst, float(np.abs(a - b).max() / scale))
    return worst


def differences_of_derivatives(
    model: Model, names: Sequence[str], one: Trajectory, other: Trajectory
) -> dict[str, float]:
    """For each name, the largest difference of the derivative of a state over both runs.

    It is relative to the largest value of that derivative. Derivatives jump at events: where one
    run has an event behind it that the other has still before it, they are not compared.

    Returns:
        Name -> relative difference; NaN for all of them where an event has no derivative, which
        `Trajectory.sensitivities` then says.
    """
    try:
        found, finer = one.sensitivities, other.sensitivities
    except ValueError:
        return dict.fromkeys(names, float("nan"))
    n = min(one.t.size, other.t.size)
    same = _on_the_same_side(one, other)[:n]
    known = {v.name: v for v in model.p} | {f"x0.{v.name}": v for v in model.x}
    worst = dict.fromkeys(names, 0.0)
    for name in names:
        for v in model.x:
            a, b = found[name][v.name][:n], finer[name][v.name][:n]
            size = max(float(np.abs(b).max()), NOTHING * v.nominal / known[name].nominal)
            off = float(np.abs(a - b)[same].max(initial=0.0)) / size
            worst[name] = max(worst[name], off)
    return worst


def _on_the_same_side(one: Trajectory, other: Trajectory) -> NDArray[np.bool_]:
    """Times of `one` with equally many events of both runs before; all where numbers differ."""
    times = [np.array([t for t, _ in run.happened]) for run in (one, other)]
    if times[0].size != times[1].size:
        return np.ones(one.t.size, dtype=bool)
    before = [np.searchsorted(found, one.t, side="right") for found in times]
    return before[0] == before[1]
