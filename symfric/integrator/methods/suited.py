"""The same system with pivots that are sound for the numbers at hand."""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from symfric.integrator.equations.initial import consistent, first_guess
from symfric.integrator.equations.lu import Order
from symfric.integrator.equations.pivots import SOUND, Factors, backward_error, best_order, regular
from symfric.integrator.equations.system import System
from symfric.integrator.methods.method import Method
from symfric.model import Model

Array = NDArray[np.float64]
Point = tuple[Array, Array]
"""Unknowns y and run data d."""

STEPS = (1e-8, 1e-5, 1e-2)
"""Steps relative to the span at which matrices are looked at: the first one, and usual ones."""
ASIDE = 1e-2
"""How far from a point its samples lie: what vanishes there alone is no reason for an order."""


def suited(system: System, method: Method, points: Sequence[Point], span: float) -> System:
    """`system`, with other pivots where its own are not sound at the last of `points`.

    Orders that are sound stay: they fill least. Those of differential equations alone (1/(gamma h)
    dominates for small steps) and of mechanisms (definite matrices) need no numbers.

    Args:
        system: what is integrated.
        method: how; it says which matrices its steps solve with.
        points: where a run has to get through, the newest last.
        span: its length [s].
    """
    if system.manifold is not None or system.is_ode:
        return system
    found: dict[str, Order] = {}
    for factors in method.factors(system):
        newest = _samples(factors, points[-1:], span)
        before = backward_error(newest, factors.order)
        if before <= SOUND or not any(regular(A) for A in newest):
            continue
        beside = [(_aside(system, y, sign), d) for y, d in points for sign in (-1.0, 1.0)]
        order = best_order(factors.pattern, _samples(factors, [*points, *beside], span))
        if backward_error(newest, order) < before:
            found[factors.name] = order
    return replace(system, orders={**system.orders, **found}) if found else system


def suited_to_start(system: System, method: Method, model: Model) -> System:
    """`system` with pivots that are sound at the model's own start, for fixed steps.

    Args:
        system: whose run data are parameters and inputs.
        method: as in `suited`.
        model: its equations and start values; where these are not consistent nothing changes.
    """
    if system.manifold is not None or system.is_ode:
        return system
    y = first_guess(system, model, model.initial_state())
    d = np.concatenate([model.values("p"), model.values("u")])
    with suppress(ValueError):
        return suited(system, method, [(consistent(system, "start", y, d), d)], 1.0)
    return system


def _samples(factors: Factors, points: Sequence[Point], span: float) -> Array:
    """The matrix at points and steps (samples, n, n), where it is finite."""
    every = np.stack([factors.at(y, step * span, d) for y, d in points for step in STEPS])
    return every[np.isfinite(every).all(axis=(1, 2))]


def _aside(system: System, y: Array, sign: float) -> Array:
    """`y` with every unknown but time a little changed, each by another share."""
    share = sign * ASIDE * np.sin(1.0 + np.arange(system.n))
    size = np.abs(y)
    size[: system.nx] = np.maximum(size[: system.nx], system.nominal)
    if system.timed:
        size[-1] = 0.0
    return y + share * size
