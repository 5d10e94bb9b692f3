"""Least and greatest values of signals over all accepted steps, not over samples alone.

A run may rest for years and slip for a second: its steps go there, equally spaced samples do not.
"""

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Evaluate = Callable[[Array], Mapping[str, Array]]
ROUNDS, PARTS = 2, 16
"""How often the neighbourhood of an extreme is looked at again, and in how many parts."""


def looks(t: Array, steps: Array, jumps: Array) -> Array:
    """Times that show all of a run: `t`, ends and middles of `steps`, just before `jumps` [s]."""
    middles = (steps[:-1] + steps[1:]) / 2
    before = np.nextafter(jumps, -np.inf)
    every = np.unique(np.concatenate([t, steps, middles, before]))
    return every[(every >= steps[0]) & (every <= steps[-1])]


def extremes(times: Array, values: Mapping[str, Array], evaluate: Evaluate) -> dict[str, Array]:
    """Name -> least and greatest value, shape (2,), refined between the `times` of the `values`.

    A signal that is NaN somewhere has NaN for both.
    """
    names = list(values)
    best = np.array([[v.min(), v.max()] for v in values.values()])
    found = np.array([[np.argmin(v), np.argmax(v)] for v in values.values()])
    low, high = times[np.maximum(found - 1, 0)], times[np.minimum(found + 1, times.size - 1)]
    for _ in range(ROUNDS):
        at = np.linspace(low, high, PARTS + 1)
        every = evaluate(at.ravel())
        looked = np.array([every[name].reshape(at.shape)[:, i] for i, name in enumerate(names)])
        for i in range(len(names)):
            for k, (pick, better) in enumerate(((np.argmin, np.less), (np.argmax, np.greater))):
                row = looked[i, :, k]
                j = int(pick(row))
                low[i, k], high[i, k] = at[max(j - 1, 0), i, k], at[min(j + 1, PARTS), i, k]
                if better(row[j], best[i, k]):
                    best[i, k] = row[j]
    return dict(zip(names, best, strict=True))
