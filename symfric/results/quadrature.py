"""Extremes and integrals of signals over all accepted steps of a run.

A run may contain years of rest and a second of slip: steps resolve the slip, equally spaced samples
do not.
"""

from collections.abc import Callable, Mapping

import casadi as ca
import numpy as np

from symfric.foundation.numeric import Array

Evaluate = Callable[[Array], Mapping[str, Array]]
Of = Callable[[ca.SX, Array], Array]
"""Function that returns the values of an expression at times."""
ROUNDS, PARTS = 2, 16
"""Number of refinements around an extreme, and number of parts in each refinement."""
NODES, WEIGHTS = np.polynomial.legendre.leggauss(5)
"""Gauss quadrature on (-1, 1), exact up to degree 9, which exceeds that of all dense outputs."""
EXACT, HALVINGS = 1e-12, 24
"""Relative difference between the integral of a step and those of its halves above which the step
is halved, and largest number of halvings."""


def looks(t: Array, steps: Array, jumps: Array) -> Array:
    """Return times that resolve a run: `t`, ends and middles of `steps`, and before `jumps`."""
    middles = (steps[:-1] + steps[1:]) / 2
    before = np.nextafter(jumps, -np.inf)
    every = np.sort(np.concatenate([t, steps, middles, before]))
    every = every[np.append(True, np.diff(every) > 0)]  # np.unique would load numpy.ma
    return every[(every >= steps[0]) & (every <= steps[-1])]


def extremes(times: Array, values: Mapping[str, Array], evaluate: Evaluate) -> dict[str, Array]:
    """Return the smallest and largest value of each signal by name, shape (2,).

    The search is refined between the `times`. Both values are NaN if a signal is NaN at any time.
    """
    names, sense = list(values), np.array([1.0, -1.0])  # the largest is the smallest of -values
    every = np.array([values[name] for name in names])[:, None] * sense[:, None]
    found, best = every.argmin(axis=2), every.min(axis=2)
    low, high = times[np.maximum(found - 1, 0)], times[np.minimum(found + 1, times.size - 1)]
    for _ in range(ROUNDS):
        at = np.linspace(low, high, PARTS + 1)
        seen = evaluate(at.ravel())
        rows = [seen[name].reshape(at.shape)[:, i] for i, name in enumerate(names)]
        looked = np.stack(rows, axis=1) * sense
        j = looked.argmin(axis=0)[None]
        least = np.take_along_axis(looked, j, axis=0)[0]
        best = np.where(least < best, least, best)
        low, high = (
            np.take_along_axis(at, np.clip(j + side, 0, PARTS), axis=0)[0] for side in (-1, 1)
        )
    return dict(zip(names, best * sense, strict=True))


def integrals(ends: Array, of: Of, expression: ca.SX, times: Array) -> Array:
    """Return the integrals of the rows of a column from the start to `times`, shape (rows, times).

    `ends` are the ends of steps. The integrand is smooth in each step, because steps end at events
    and at jumps of inputs.
    """
    k = np.clip(np.searchsorted(ends, times, side="right") - 1, 0, ends.size - 2)
    whole = _pieces(of, expression, ends[:-1], ends[1:])
    before = np.concatenate([np.zeros((whole.shape[0], 1)), np.cumsum(whole, axis=1)], axis=1)
    return before[:, k] + _pieces(of, expression, ends[k], times)


def integral_between(ends: Array, of: Of, expression: ca.SX, a: float, b: float) -> float:
    """Return the integral of one expression from time a to b.

    Steps between `ends` are halved until the integrals of the halves agree with the whole.
    """
    cuts = np.unique(np.concatenate([[a], ends[(ends > a) & (ends < b)], [b]]))
    left, right, done = cuts[:-1], cuts[1:], 0.0
    for _ in range(HALVINGS):
        middle = (left + right) / 2
        halves = _pieces(of, expression, left, middle) + _pieces(of, expression, middle, right)
        off = np.abs(halves - _pieces(of, expression, left, right))[0]
        rough = off > EXACT * (abs(done) + np.abs(halves).sum())
        done += float(halves[0, ~rough].sum())
        left, middle, right = left[rough], middle[rough], right[rough]
        left, right = np.concatenate([left, middle]), np.concatenate([middle, right])
    return done + float(_pieces(of, expression, left, right).sum())


def _pieces(of: Of, expression: ca.SX, a: Array, b: Array) -> Array:
    """Return the integrals from a to b, each within one step, shape (rows, intervals)."""
    half = (b - a)[:, None] / 2
    at = (a + b)[:, None] / 2 + half * NODES
    if not at.size:
        return np.zeros((expression.numel(), 0))
    values = np.atleast_2d(of(expression, at.ravel()))
    return np.einsum("rkg,g,k->rk", values.reshape(-1, *at.shape), WEIGHTS, half[:, 0])
