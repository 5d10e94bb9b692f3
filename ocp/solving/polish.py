"""Optimum of full precision from that of an interior-point method, by active sets."""

from dataclasses import replace
from functools import lru_cache

import numpy as np

from ocp.solving.active import BoundStatus
from ocp.solving.linearised import Linearised
from ocp.solving.methods import Ipopt
from ocp.solving.optimum import STATIONARY, Optimum
from ocp.transcription.program import worst_of

KEPT = 2
"""Number of optima whose conditions are cached, as several properties of a solution need them."""
STEPS = 10
CONVERGED, CLOSE = 1e-8, 1e-5
"""Change of scaled unknowns by the last step, and largest relative change of the cost."""
MOST = 2
"""Number of conditions that may be given up, in multiples of the number that are too many."""
SHARP, MOST_ITERATIONS = 1e-11, 30
"""Tolerance and most iterations of a repeated solve if conditions are uncertain."""
NEAREST = 1e-3
"""Least ratio of multiplier and distance of a condition that may count as active."""


def determined(optimum: Optimum) -> Linearised:
    """Return the optimality conditions with active conditions that determine a strict minimum.

    Near a switch of a bang-bang control both multiplier and distance from the bound are small. If
    active conditions are too few or too many, those that are nearest to the limit are changed.
    """
    plain = Linearised(optimum)
    if plain.regular:
        return plain
    active, _, _, fixed, ratio = BoundStatus.joined(*plain.status)
    spare = plain.free.size - plain.held.size
    near = ~active & (ratio > NEAREST) if spare > 0 else active & ~fixed
    order = np.argsort(np.where(near, -ratio if spare > 0 else ratio, np.inf))
    order = order[: min(int(near.sum()), max(spare, -MOST * spare))]
    few, many = 0, order.size
    if not Linearised(optimum, order).regular:
        return plain
    while many - few > 1:
        middle = (few + many) // 2
        enough = Linearised(optimum, order[:middle]).regular
        few, many = (few, middle) if enough else (middle, many)
    return Linearised(optimum, order[:many])


@lru_cache(KEPT)
def polished(optimum: Optimum) -> Linearised:
    """Return the optimality conditions at an optimum of full precision.

    A primal-dual active set method makes a condition active where it is violated, and inactive
    where its multiplier has the wrong sign. If active conditions do not determine a strict minimum,
    if this does not converge, or if it changes the cost, the optimum of the solver is kept.

    Source: Hintermueller, Ito and Kunisch, SIAM J. Optimization 13(3), 2002, 865-888.

    Raises:
        ValueError: the point does not satisfy the optimality conditions.
    """
    first = determined(optimum)
    if first.weak or not first.regular:
        first = determined(_sharper(optimum))
    now = first
    for _ in range(STEPS if first.regular else 0):
        if (step := now.stepped()) is None or not step.residual <= STATIONARY:
            break
        later, change = determined(step), np.abs(step.iterate.w - now.optimum.iterate.w).max()
        same = np.array_equal(now.free, later.free) and np.array_equal(now.held, later.held)
        if same and change < CONVERGED:
            violation = worst_of(step.transcription.program, step.iterate.w, step.rows[0])
            near = abs(step.cost - optimum.cost) <= CLOSE * max(abs(optimum.cost), optimum.size)
            return replace(later, source=first.optimum) if near and violation < CLOSE else first
        now = later
    return first


def _sharper(optimum: Optimum) -> Optimum:
    """Return the optimum with smaller errors, in which more conditions are certain."""
    program = optimum.transcription.program
    solver = Ipopt(tol=SHARP, obj_scaling_factor=1.0 / optimum.size, max_iter=MOST_ITERATIONS)
    outcome = solver.prepared(program).run(optimum.iterate, optimum.values, warm=True)
    return replace(optimum, iterate=outcome.iterate) if outcome.status.ok else optimum
