"""Bootstrap of a fit: values fitted again to data with resampled residuals.

    measured* = predicted - r*,     r* = blocks of neighbouring residuals, drawn with replacement

Blocks keep the autocorrelation of the residuals. The intervals need no linearisation, unlike those
of `Covariance`, and no normal distribution.
Sources: H. R. Kuensch, Ann. Statist. 17(3), 1989 (moving blocks); B. Efron, R. J. Tibshirani, An
Introduction to the Bootstrap, 1993.
"""

from collections.abc import Mapping
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from math import ceil
from typing import final

import numpy as np

from identification.residuals.evaluation import Array, Extended
from identification.solving.descent import descend
from identification.solving.task import Point, Task
from symfric.foundation import checks
from symfric.foundation.executors import in_order
from symfric.foundation.shown import brief

LENGTH = 3.0
"""Length of a block in rows per effective sample."""
EVALUATIONS = 40
"""Largest number of evaluations of a fit."""


@final
@dataclass(frozen=True, eq=False)
class Bootstrap:
    """Values fitted to resampled data.

    Attributes:
        names: names of the values.
        best: values of the fit, shape (k,).
        samples: values of the resampled fits, shape (n, k).
        blocks: channel -> length of its blocks [rows].
        failed: number of resampled fits without residuals, which are left out.
    """

    names: tuple[str, ...]
    best: Array
    samples: Array
    blocks: Mapping[str, int]
    failed: int

    __repr__ = brief

    @property
    def standard_errors(self) -> dict[str, float]:
        """Standard deviations of the samples."""
        found = self.samples.std(axis=0, ddof=1).tolist()
        return dict(zip(self.names, found, strict=True))

    def interval(self, name: str, level: float = 0.95) -> tuple[float, float]:
        """Return the percentile interval of a value.

        Raises:
            ValueError: an unknown name, or a level outside 0 to 1.
        """
        checks.check_names("interval", [name], self.names)
        level = checks.number("interval: level", level, above=0.0, upper=1.0)
        column = self.samples[:, self.names.index(name)]
        low, high = np.quantile(column, [(1 - level) / 2, (1 + level) / 2]).tolist()
        return low, high

    def __str__(self) -> str:
        lines = [f"bootstrap: {len(self.samples)} fits to residuals in blocks"]
        for name, value in zip(self.names, self.best.tolist(), strict=True):
            low, high = self.interval(name)
            lines.append(f"  {name}: {value:.5g}, 95 %: {low:.5g} to {high:.5g}")
        return "\n".join(lines)


def bootstrap(
    task: Task,
    point: Point,
    effective: Mapping[str, float],
    count: int = 200,
    seed: int = 0,
    executor: Executor | None = None,
) -> Bootstrap:
    """Fit `count` resampled data sets, each from the values of the fit.

    Args:
        task, point: problem and its minimum.
        effective: channel -> number of independent samples, in the order of the channels.
        count: number of data sets; 200 for standard errors, 1000 or more for intervals.
        seed: random seed.
        executor: executor of the fits; the result is bit-identical.

    Raises:
        ValueError: a count below 2.
    """
    count = checks.count("bootstrap: count", count, least=2)
    random = np.random.default_rng(checks.count("bootstrap: seed", seed, least=0))
    rows = {name: c.t.size for name, c in zip(effective, task.channels, strict=True)}
    blocks = {n: max(ceil(size ** (1 / 3)), ceil(LENGTH * size / effective[n]))
              for n, size in rows.items()}  # fmt: skip
    r = point.evaluation.r
    wide = np.sqrt(r.size / max(r.size - point.w.size, 1))
    calls = list[tuple[Array, Array]]()
    for _ in range(count):
        shift = -r.copy()
        for name, channel in zip(effective, task.channels, strict=True):
            left = r[channel.rows] - r[channel.rows].mean()
            shift[channel.rows] += wide * _drawn(left, blocks[name], random)
        calls.append((point.w, shift))
    ends = (_fitted(task, *call) for call in calls)
    if executor is not None:
        ends = in_order(executor, _fitted, task, calls)
    found = [end for end in ends if end is not None]
    samples = np.array(found).reshape(-1, point.values.size)
    return Bootstrap(task.unknowns.names, point.values, samples, blocks, count - len(found))


def _drawn(r: Array, length: int, random: np.random.Generator) -> Array:
    """Return residuals of the shape of r, made of blocks of neighbours of r."""
    length = min(length, r.size)
    first = random.integers(0, r.size - length + 1, ceil(r.size / length))
    return r[(first[:, None] + np.arange(length)).ravel()[: r.size]]


def _fitted(task: Task, w: Array, shift: Array) -> Array | None:
    """Return the values fitted to resampled data; None without residuals."""
    changed = Extended(task.residuals, (), np.zeros((shift.size, 0)), shift)
    again = replace(task, residuals=changed, easier=())
    end = descend(again, w, 0, EVALUATIONS)
    return again.unknowns.values(end.w) if np.isfinite(end.cost) else None
