"""Optimum of full precision from that of an interior-point method, by active sets."""

import numpy as np

from ocp.solving.linearised import Linearised
from ocp.solving.optimum import STATIONARY, Optimum
from ocp.transcription.program import worst_of

STEPS = 10
CONVERGED, CLOSE = 1e-8, 1e-5
"""Change of scaled unknowns by the last step, and largest relative change of the cost."""
NEAREST = 1e-3
"""Least ratio of multiplier and distance of a condition that may count as active."""


def determined(optimum: Optimum) -> Linearised:
    """Return the optimality conditions with enough active conditions for a strict minimum.

    Near a switch of a bang-bang control both multiplier and distance from the bound are small. If
    the second-order conditions are not met, the conditions nearest to active ones are added.
    """
    plain = Linearised(optimum)
    ratio = np.concatenate([status.ratio for status in plain.status])
    ratio[np.concatenate([status.active for status in plain.status])] = 0.0
    order = np.argsort(-ratio)[: max(0, plain.free.size - plain.held.size)]
    order = order[ratio[order] > NEAREST]
    few, many = 0, order.size
    if plain.regular or not Linearised(optimum, order).regular:
        return plain
    while many - few > 1:
        middle = (few + many) // 2
        enough = Linearised(optimum, order[:middle]).regular
        few, many = (few, middle) if enough else (middle, many)
    return Linearised(optimum, order[:many])


def polished(optimum: Optimum) -> Linearised:
    """Return the optimality conditions at an optimum of full precision.

    A primal-dual active set method makes a condition active where it is violated, and inactive
    where its multiplier has the wrong sign. If this does not converge, or changes the cost, the
    optimum of the solver is kept.

    Source: Hintermueller, Ito and Kunisch, SIAM J. Optimization 13(3), 2002, 865-888.

    Raises:
        ValueError: the point does not satisfy the optimality conditions.
    """
    first = now = determined(optimum)
    for _ in range(STEPS):
        if (step := now.stepped()) is None or not step.residual <= STATIONARY:
            break
        later, change = determined(step), np.abs(step.iterate.w - now.optimum.iterate.w).max()
        same = np.array_equal(now.free, later.free) and np.array_equal(now.held, later.held)
        if same and change < CONVERGED:
            violation = worst_of(step.transcription.program, step.iterate.w, step.rows[0])
            near = abs(step.cost - optimum.cost) <= CLOSE * max(abs(optimum.cost), optimum.size)
            return later if near and violation < CLOSE else first
        now = later
    return first
