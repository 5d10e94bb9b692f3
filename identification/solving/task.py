"""Weighted least-squares problem of residuals and unknowns.

    minimise over w   sum_signals [ n_s ln sigma_s ] + 1/2 sum_rows loss(r_i(p(w)) / sigma_s(i))

Noise levels are those of maximum likelihood; d_s are the degrees of freedom that the fit takes from
signal s:

    sigma_s^2 = sum r^2 / (n_s - d_s),   d_s = tr (J'J)^-1 J_s'J_s

Rows are reduced block by block to the triangle R of a QR factorisation (a sequential TSQR). Blocks
are so small that BLAS uses only one thread, and the bits do not depend on the number of threads.

Sources: Y. Bard, Nonlinear Parameter Estimation, 1974, section 4-9; J. Demmel, L. Grigori,
M. Hoemmen, J. Langou, SIAM J. Sci. Comput. 34, 2012.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import log
from typing import Any, final

import numpy as np

from identification.residuals.evaluation import (
    THRESHOLD,
    Array,
    Bias,
    Channel,
    Evaluation,
    Residuals,
    influence,
    shaped,
    unbiased,
)
from identification.unknowns.spec import Unknown
from identification.unknowns.unknowns import Unknowns
from symfric.foundation import checks

ENTRIES = 8192
"""Entries of a block and its triangle; OpenBLAS uses threads from 9216 entries on (gemv)."""
FEWEST = 32
"""Smallest number of new rows in a block, for any number of columns."""


def triangle(columns: Array) -> Array:
    """Return R of `columns` (rows, k), shape (k, k), upper triangular with a diagonal >= 0."""
    rows, k = columns.shape
    found = np.zeros((0, k))
    size = max(FEWEST, ENTRIES // max(k, 1) - k)
    for first in range(0, rows, size):
        block = np.vstack([found, columns[first : first + size]])
        found = np.asarray(np.linalg.qr(block, mode="r"))
    whole = np.zeros((k, k))
    whole[: found.shape[0]] = found
    sign = np.where(np.diag(whole) < 0, -1.0, 1.0)
    return whole * sign[:, None]


def square(x: Array) -> float:
    """Return the sum of squares without BLAS, which uses several threads for long sums."""
    return float(np.sum(x * x))


@final
@dataclass(frozen=True, eq=False)
class Triangles:
    """Residuals linear in their values, with the rows of each channel reduced to a triangle.

        |r_s(p)|^2 = |R_s [p; 1]|^2,   R_s = triangle of [J_s, r_s(0)]

    The channels keep their times and measured values.
    """

    names: tuple[str, ...]
    own: tuple[Unknown, ...]
    channels: tuple[Channel, ...]
    R: Array
    bias: Callable[[Array], Bias | None] | None

    @classmethod
    def of(cls, residuals: Residuals, values: Array) -> "Triangles | str":
        """Return the triangles of linear residuals evaluated at `values`, or a message."""
        found, k, bias = residuals.at(values), values.size, getattr(residuals, "bias", None)
        if isinstance(found, str):
            return found
        whole = np.column_stack([found.J, found.r - np.einsum("ij,j->i", found.J, values)])
        R = [triangle(whole[c.rows]) for c in residuals.channels]
        channels = tuple(
            replace(c, rows=slice(i * (k + 1), (i + 1) * (k + 1)), ordered=False)
            for i, c in enumerate(residuals.channels)
        )
        return cls(residuals.names, residuals.own, channels, np.vstack(R), bias)

    def at(self, values: Array) -> Evaluation:
        """Return residuals and derivatives."""
        J = self.R[:, :-1]
        return Evaluation(np.einsum("ij,j->i", J, values) + self.R[:, -1], J)


Guard = Callable[[Mapping[str, float]], object]


@final
@dataclass(frozen=True, eq=False)
class Point:
    """Coordinates with the residuals evaluated at them.

    Attributes:
        w: coordinates, shape (n,).
        values: values in the order of `names` of the residuals, shape (k,).
        evaluation: residuals in SI units with their derivatives by the values.
        sigma: noise level of every row in SI units, shape (rows,).
        slope: dvalues/dw, shape (k, n).
        loss: loss function.
    """

    w: Array
    values: Array
    evaluation: Evaluation
    sigma: Array
    slope: Array
    loss: str = "squares"

    @cached_property
    def r(self) -> Array:
        """Residuals relative to their noise level, shape (rows,)."""
        return self.evaluation.r / self.sigma

    @cached_property
    def J(self) -> Array:
        """Derivatives of `r` by w, shape (rows, n)."""
        return np.einsum("ik,kj->ij", self.evaluation.J / self.sigma[:, None], self.slope)

    @cached_property
    def weights(self) -> Array:
        """Weights of the rows in the normal equations: 1, less for outliers under a robust loss."""
        return influence(self.r, self.loss)

    @cached_property
    def reduced(self) -> tuple[Array, Array]:
        """Residuals (k + 1,) and derivatives (k + 1, n) with the same cost, gradient and J'J.

        With the loss-shaped rows e: |f|^2 = |e|^2 and J'f = J'e.
        """
        e, de = shaped(self.r, self.loss)
        J = self.evaluation.J * (de / self.sigma)[:, None]
        R = triangle(np.column_stack([J, e]))
        R[-1, -1] = np.sqrt(max(R[-1, -1] ** 2 + self.excess, 0.0))
        return R[:, -1], np.einsum("ik,kj->ij", R[:, :-1], self.slope)

    @cached_property
    def cost(self) -> float:
        """Sum of the losses; r'r for squares, with the excess of each channel."""
        return square(shaped(self.r, self.loss)[0]) + self.excess

    @property
    def excess(self) -> float:
        """Sum of the excess of the rows, for squares."""
        return float(np.sum(self.evaluation.excess / self.sigma**2)) * (self.loss == "squares")


@final
@dataclass(frozen=True, eq=False)
class Task:
    """Weighted least-squares problem.

    Attributes:
        residuals: residuals of the model on the data.
        unknowns: coordinates of the fitted values.
        noise: signal -> present standard deviation [SI].
        estimated: signals whose noise level is estimated.
        loss: "squares", or a robust loss: "huber", "soft_l1", "cauchy", "arctan".
        guard: function of the values by name that raises ValueError if they are inadmissible.
        easier: problems of the same parameters that distant starts solve first.
    """

    residuals: Residuals
    unknowns: Unknowns
    noise: dict[str, float]
    estimated: tuple[str, ...] = ()
    loss: str = "squares"
    guard: Guard | None = None
    easier: "tuple[Task, ...]" = ()

    @property
    def channels(self) -> Sequence[Channel]:
        """Channels of the rows."""
        return self.residuals.channels

    @cached_property
    def sigma(self) -> Array:
        """Noise level of every row [SI], shape (rows,)."""
        found = np.ones(max(c.rows.stop for c in self.channels))
        for channel in self.channels:
            found[channel.rows] = self.noise[channel.signal]
        return found

    @property
    def rows(self) -> int:
        """Number of compared values."""
        return sum(c.t.size for c in self.channels)

    def reduced(self, w: Array) -> "Task":
        """Return the same problem with few rows if it is linear, evaluated at the coordinates w."""
        if self.loss != "squares" or not getattr(self.residuals, "linear", False):
            return self
        found = Triangles.of(self.residuals, self.unknowns.values(self.unknowns.inside(w)))
        return self if isinstance(found, str) else replace(self, residuals=found)

    @property
    def part(self) -> "Task":
        """The same problem on part of the rows of long records, if it is not linear."""
        linear = getattr(self.residuals, "linear", False)
        found = None if linear else getattr(self.residuals, "part", None)
        return self if found is None else replace(self, residuals=found)

    def with_noise(self, noise: Mapping[str, float]) -> "Task":
        """Return the problem with other noise levels."""
        return replace(self, noise=dict(noise))

    def at(self, w: Array) -> Point | str:
        """Return the point at `w`, or a message on failure."""
        w = np.array(w, float)
        values, names = self.unknowns.values(w), self.unknowns.names
        if not np.isfinite(values).all():
            return f"with {_shown(names, values)}: a value is not finite"
        if self.guard is not None:
            try:
                own = {u.name for u in self.residuals.own}
                given = zip(names, values.tolist(), strict=True)
                self.guard({name: value for name, value in given if name not in own})
            except ValueError as error:
                return f"with {_shown(names, values)}: {error}"
        found = unbiased(self.residuals, values)
        if isinstance(found, str):
            return found
        if not (np.isfinite(found.r).all() and np.isfinite(found.J).all()):
            return f"with {_shown(names, values)}: residuals or derivatives are not finite"
        return Point(w, values, found, self.sigma, self.unknowns.slope(w), self.loss)

    def is_linear(self, w: Array) -> bool:
        """Return True if the residuals are linear in the values or coordinates: one minimum.

        Bounds and orders of values are convex. Tied values need not be linear in the others.
        """
        if self.loss != "squares" or len(self.estimated) > 1:
            return False
        if getattr(self.residuals, "linear", False):
            return len(self.unknowns.names) == len(self.unknowns.fitted)
        wide = np.minimum(1.0, self.unknowns.upper - self.unknowns.lower)
        here, there = (self.at(self.unknowns.inside(w + share * wide)) for share in (0.0, 0.4))
        if isinstance(here, str) or isinstance(there, str):
            return False
        return bool(np.allclose(here.J, there.J, rtol=1e-9, atol=1e-12 * np.abs(here.J).max()))

    def again(self, point: Point) -> Point:
        """Return the point with the noise levels of this task."""
        return replace(point, sigma=self.sigma)

    def spread(self, signal: str) -> float:
        """Return the standard deviation of a measured signal, the largest of all records.

        If the signal is constant, return its magnitude.
        """
        values = [c.measured for c in self.channels if c.signal == signal]
        spread = max(float(np.std(v)) for v in values)
        return spread or max(float(np.abs(v).max()) for v in values) or 1.0


def task(
    residuals: Residuals,
    unknowns: Unknowns,
    noise: object = "estimate",
    loss: object = "squares",
    guard: Guard | None = None,
) -> Task:
    """Return the problem with noise levels: "estimate", or signal -> standard deviation [SI].

    Noise levels of signals that are not in `noise` are estimated.

    Raises:
        ValueError: an unknown loss or signal, or a noise level that is not above 0.
    """
    chosen = checks.choice("Fit: loss", loss, THRESHOLD)
    signals = list(dict.fromkeys(c.signal for c in residuals.channels))
    given: dict[str, Any] = {}
    if noise != "estimate":
        if isinstance(noise, str):
            raise checks.refused("Fit: noise", "'estimate' or noise levels by signal", noise)
        given = checks.named("Fit: noise", noise, signals)
    levels = {s: checks.number(f"Fit: noise: {s}", x, above=0.0) for s, x in given.items()}
    made = Task(
        residuals, unknowns, {}, tuple(s for s in signals if s not in levels), chosen, guard
    )
    return made.with_noise({s: levels[s] if s in levels else made.spread(s) for s in signals})


def _shown(names: Sequence[str], values: Array) -> str:
    return ", ".join(f"{n} = {x:.5g}" for n, x in zip(names, values.tolist(), strict=True))


NOISELESS = 1e-8
"""Least noise level relative to the spread of a signal, the accuracy limit of simulations."""
FAR = 15.0
"""Largest trusted step; for a logarithmic coordinate a factor of three million."""
NORMAL = 1.4826
"""Ratio of the standard deviation of normal noise to the median of its magnitude."""


def variance(task: Task, point: Point) -> float:
    """Return the variance of the weighted residuals; at least 1 if a noise level is given."""
    freedom = max(1, task.rows - point.w.size)
    least = 1.0
    if set(task.noise) == set(task.estimated):
        least = max((NOISELESS * task.spread(s) / task.noise[s]) ** 2 for s in task.noise)
    return max(least, (point.cost - point.excess) / freedom)


def remaining(task: Task, point: Point) -> float:
    """Return the fall of the cost that a Gauss-Newton step in the free coordinates predicts.

    The step is limited to `FAR` in any principal direction. Beyond, derivatives are not reliable,
    and a coordinate without influence would need an unlimited step.
    """
    f, J = point.reduced
    g, box = np.einsum("ij,i->j", J, f), task.unknowns
    near = box.at_bound(point.w)
    low = near & (point.w - box.lower < box.upper - point.w)
    free = ~((low & (g > 0)) | (near & ~low & (g < 0)))
    u, s, _ = np.linalg.svd(J[:, free], full_matrices=False)
    part = np.abs(u.T @ f)
    reached = np.minimum(part, FAR * s)
    return float(((2 * part - reached) * reached).sum())


def levels(task: Task, point: Point) -> dict[str, float]:
    """Return signal -> noise level [SI]: the given levels, and estimates from the residuals."""
    found = dict(task.noise)
    shares = _shares(task, point)
    for signal in task.estimated:
        r = np.concatenate([point.evaluation.r[c.rows] for c in _of(task, signal)])
        if task.loss == "squares":
            rows = sum(c.t.size for c in _of(task, signal))
            level = float(np.sqrt(square(r) / max(rows - shares[signal], 1.0)))
        else:
            level = NORMAL * float(np.median(np.abs(r)))
        found[signal] = max(level, NOISELESS * task.spread(signal))
    return found


def change(old: dict[str, float], new: dict[str, float]) -> float:
    """Return the largest change of a noise level, as a logarithm."""
    return max((abs(log(new[s] / old[s])) for s in new), default=0.0)


def objective(task: Task, point: Point) -> float:
    """Return -2 log-likelihood without its constant; lower is more likely."""
    rows = {s: sum(c.t.size for c in _of(task, s)) for s in task.noise}
    return point.cost + sum(2 * n * log(task.noise[s]) for s, n in rows.items())


def _of(task: Task, signal: str) -> list[Channel]:
    return [c for c in task.channels if c.signal == signal]


def _shares(task: Task, point: Point) -> dict[str, float]:
    """Return the degrees of freedom that the fit takes from each signal."""
    _, J = point.reduced
    _, s, vt = np.linalg.svd(J, full_matrices=False)
    kept = s > 1e-10 * s.max(initial=1e-300)
    directions = vt[kept].T / s[kept]
    whitened = np.einsum("ij,jk->ik", point.J, directions)
    return {
        signal: sum(square(whitened[c.rows]) for c in _of(task, signal)) for signal in task.noise
    }


WHITE = 3.0
"""Correlation of neighbours, relative to its standard deviation, rarely exceeded by white noise."""
LARGEST = 6.0
"""Residual, relative to the root mean square, rarely exceeded by normal noise of 1e6 samples."""


def is_white(task: Task, point: Point) -> bool:
    """Return True if the residuals of each channel are uncorrelated at several lags, without peaks.

    A law that misses a short part of the motion leaves few large residuals.
    """
    for channel in task.channels:
        r = point.r[channel.rows]
        if not channel.ordered or r.size < 20:
            return False
        if np.abs(r).max() > LARGEST * np.sqrt(np.mean(r**2)):
            return False
        for lag in (1, 2, 4):
            pairs = float(np.sum(r[lag:] * r[:-lag])) / max(square(r), 1e-300)
            if abs(pairs) > WHITE / np.sqrt(r.size):
                return False
    return True
