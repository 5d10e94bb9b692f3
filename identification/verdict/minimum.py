"""Arrays at the minimum of a fit, and the combinations of parameters that are not identifiable.

The residuals do not change along a null direction. If two values grow by the same factor along it,
only their ratio is identifiable; if they grow by the same amount, only their difference is. If both
descriptions fit at one point, the residuals are evaluated a small distance away along both.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import NDArray

from identification.residuals.evaluation import Array, Channel
from identification.solving.task import Point, Task, influence
from identification.unknowns.spec import Unknown

Count = NDArray[np.int64]

JITTER = 0.5
"""Relative deviation from the usual step above which consecutive rows are not neighbours."""


def positions(channel: Channel, *, across_windows: bool = False) -> Count:
    """Return the number of consecutive neighbours in time before each row, shape (n,).

    A run starts with 0: at the first row, at a break, where time jumps or repeats, and everywhere
    if the channel is unordered. With `across_windows`, a run continues over the breaks of windows
    if time continues, because the noise of a sensor does not depend on windows.
    """
    n = channel.t.size
    if not channel.ordered:
        return np.zeros(n, dtype=np.int64)
    starts = np.zeros(n, dtype=bool)
    starts[:1] = True
    starts[1:] = ~(np.abs(np.diff(channel.t) / _step(channel.t) - 1) < JITTER)
    if not across_windows:
        starts[[b for b in channel.breaks if 0 < b < n]] = True
    here = np.arange(n, dtype=np.int64)
    return here - np.maximum.accumulate(np.where(starts, here, 0))


def places(channel: Channel) -> Count:
    """Return the index of each row on the grid of the usual step, shape (n,).

    Rows of equal time have the same index. If the times are not on a grid, rows are counted, with
    one index left out at every gap.
    """
    n = channel.t.size
    if not channel.ordered or n < 2:
        return np.arange(n, dtype=np.int64)
    steps = (channel.t - channel.t[0]) / _step(channel.t)
    grid = np.rint(steps)
    if np.abs(steps - grid).max() < 0.2 and steps.min() >= 0 and grid.max() < 20 * n:
        return grid.astype(np.int64)
    return np.cumsum(1 + (positions(channel, across_windows=True) == 0)).astype(np.int64) - 2


def lagged(signal: Array, position: Count, lag: int) -> Array:
    """Return `signal` delayed by `lag` rows; before the start of a run it has its first value."""
    back = np.minimum(position, lag)
    return signal[np.arange(signal.shape[0]) - back]


def _step(t: Array) -> float:
    """Return the usual step between consecutive rows."""
    steps = np.diff(t)
    steps = steps[steps > 0]
    return float(np.median(steps)) if steps.size else 1.0


@final
@dataclass(frozen=True, eq=False)
class Minimum:
    """Minimum of weighted least squares over n coordinates w, with k values that depend on them.

    Attributes:
        channels: groups of rows.
        unknowns: one for each coordinate, shape (n,).
        names, values: arguments of the residuals, shape (k,).
        slope: dvalues/dw, shape (k, n).
        held: mask of coordinates at a bound, shape (n,).
        r: weighted residuals; with a robust loss, their influence function, shape (rows,).
        J: dr/dw of the weighted residuals before the loss, shape (rows, n).
        gain: derivative of the influence function; one for squares, shape (rows,).
        raw: predicted - measured in SI units, shape (rows,).
        noise: signal -> standard deviation of its noise, if given.
    """

    channels: Sequence[Channel]
    unknowns: tuple[Unknown, ...]
    names: tuple[str, ...]
    values: Array
    slope: Array
    held: NDArray[np.bool_]
    r: Array
    J: Array
    gain: Array
    raw: Array
    noise: Mapping[str, float]

    def label(self, channel: Channel) -> str:
        """Return the name of a channel for messages."""
        records = {c.record for c in self.channels}
        return channel.signal if len(records) == 1 else f"{channel.signal}[{channel.record}]"


def minimum(task: Task, point: Point) -> Minimum:
    """Return the arrays of a solved task.

    The derivative of the influence function psi = rho' r is averaged over each channel (Huber and
    Ronchetti, Robust Statistics, 2009, section 7.6) and bounded below by 0.05.
    """
    gain = np.ones(point.r.size)
    if point.loss != "squares":
        h = 1e-4
        above, below = (influence(r, point.loss) * r for r in (point.r + h, point.r - h))
        for channel in task.channels:
            rows = channel.rows
            gain[rows] = max(float(np.mean(above[rows] - below[rows])) / (2 * h), 0.05)
    known, box = {s: x for s, x in task.noise.items() if s not in task.estimated}, task.unknowns
    return Minimum(
        task.channels, box.unknowns, box.names, point.values, point.slope, box.at_bound(point.w),
        point.weights * point.r, point.J, gain, point.evaluation.r, known,
    )  # fmt: skip


def shift(task: Task, found: Minimum) -> Callable[[Array], float]:
    """Return a function of the values: the norm of the change of the weighted residuals."""

    def change(values: Array) -> float:
        there = task.residuals.at(values)
        failed = isinstance(there, str)
        return np.inf if failed else float(np.linalg.norm((there.r - found.raw) / task.sigma))

    return change


Shift = Callable[[Array], float]
"""Function from values to the norm of the change of the residuals."""

SHARE = 1e-4
"""Component of a direction below which a value does not take part in it."""
NEAR = 1e-2
"""Deviation from integers that is ignored."""
STEP = 0.05
"""Relative change of values at which two descriptions are compared."""


def groups(
    names: tuple[str, ...], values: Array, null: Array, size: Array, change: Shift
) -> Iterator[tuple[tuple[str, ...], str]]:
    """Yield each group of values that the residuals do not determine, with a message.

    Args:
        names: names of the values.
        values: values at the minimum, shape (k,).
        null: independent directions of the values that leave the residuals unchanged, (k, nullity).
        size: sensitivity of the residuals to each value alone, above zero, shape (k,).
        change: norm of the change of the residuals, a function of the values.
    """
    scaled = null * size[:, None]
    scaled = scaled / np.maximum(np.linalg.norm(scaled, axis=0), 1e-300)
    basis, s, _ = np.linalg.svd(scaled, full_matrices=False)
    basis = basis[:, s > 1e-9]
    shared = np.abs(basis @ basis.T)
    left = set(np.flatnonzero(np.diag(shared) > SHARE**2).tolist())
    while left:
        members, edge = set[int](), {min(left)}
        while edge:
            members |= edge
            linked = np.flatnonzero((shared[[*edge]] > SHARE).any(axis=0)).tolist()
            edge = left.intersection(linked) - members
        left -= members
        group = np.array(sorted(members))
        called = tuple(names[i] for i in group)
        U, s, _ = np.linalg.svd(basis[group], full_matrices=True)
        known, text = group.size - int((s > 1e-6).sum()), " and ".join(called[-2:])
        text = ", ".join([*called[:-2], text])
        if known == 0:
            which = "has" if group.size == 1 else "have"
            yield called, f"{text} {which} no influence on the measured signals."
        elif known > 1:
            yield called, f"Of {text} only {known} combinations are identifiable."
        else:
            g = U[:, -1] * size[group]  # gradient of the only identifiable combination

            def moved(step: Array, group: NDArray[np.int64] = group) -> float:
                there = values.copy()
                there[group] += step
                return change(there)

            only = _combination(called, values[group], g, moved)
            yield called, f"Only {only} is identifiable, not {text} each."


def _combination(names: Sequence[str], here: Array, g: Array, moved: Shift) -> str:
    """Return as text the combination whose gradient at the values `here` is g."""
    powers, weights = _small_integers(g * here), _small_integers(g)
    if powers is not None and weights is not None:
        factor, amount = np.zeros(here.size), np.zeros(here.size)
        factor[:2] = np.array([STEP, -STEP]) / powers[:2]
        amount[:2] = STEP * here[0] * np.array([1.0, -1.0]) / weights[:2]
        if moved(here * np.expm1(factor)) < moved(amount):
            weights = None
        else:
            powers = None
    if powers is not None:
        above, below = (
            [n if p == 1 else f"{n}^{p:g}" for n, p in zip(names, part, strict=True) if p > 0]
            for part in (powers, -powers)
        )
        if not below:
            return f"the product {' '.join(above)}"
        under = below[0] if len(below) == 1 else f"({' '.join(below)})"
        return f"the ratio {' '.join(above)} / {under}"
    if weights is not None:
        terms = [
            n if abs(w) == 1 else f"{abs(w):g} {n}" for n, w in zip(names, weights, strict=True)
        ]
        signs = ["+" if w > 0 else "-" for w in weights]
        text = "".join(f" {sign} {term}" for sign, term in zip(signs, terms, strict=True))
        kind = "difference" if len(names) == 2 else "combination"
        return f"the {'sum' if (weights > 0).all() else kind} {text[3:]}"
    g = g / g[np.argmax(np.abs(g))]
    terms = " + ".join(f"{c:.3g} {n}" for n, c in zip(names, g, strict=True)).replace("+ -", "- ")
    return f"{terms} (near the estimate)"


def _small_integers(g: Array) -> Array | None:
    """Return g over its smallest entry if all are small integers, the first one positive."""
    smallest = float(np.abs(g).min())
    if not smallest > 1e-12 * float(np.abs(g).max()):
        return None
    scaled = g / smallest * np.sign(g[0])
    nearest = np.rint(scaled)
    return nearest if np.abs(scaled - nearest).max() < NEAR and np.abs(nearest).max() <= 3 else None
