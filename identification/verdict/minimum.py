"""The end of a fit as arrays, and the combinations of parameters that the data cannot tell.

A direction of the values along which the residuals do not change, in which two values grow by the
same factor, leaves their ratio; one in which they grow by the same amount, their difference. Where
both descriptions fit one point, the residuals are evaluated a little way along both.
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
"""Deviation from the usual step, over it, from which on the next row is no neighbour."""


def positions(channel: Channel, *, across_windows: bool = False) -> Count:
    """How many neighbours in time stand right before each row, shape (n,).

    0 starts a run: at the first row, at a break, where time jumps or stands still, and everywhere
    if the channel has no order. `across_windows` lets a run go on over the breaks of windows
    where time goes on: the noise of a sensor knows nothing of windows.
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
    """Number of each row on the grid of the usual step, shape (n,); rows of one time share it.

    Where the times are on no grid the rows are counted, with a place left out at every gap.
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
    """`signal` so many rows earlier; before the start of a run, the value at its start."""
    back = np.minimum(position, lag)
    return signal[np.arange(signal.shape[0]) - back]


def _step(t: Array) -> float:
    """The usual distance of two rows."""
    steps = np.diff(t)
    steps = steps[steps > 0]
    return float(np.median(steps)) if steps.size else 1.0


@final
@dataclass(frozen=True, eq=False)
class Minimum:
    """A minimum of weighted least squares over n coordinates w, with k values that depend on them.

    Attributes:
        channels: what the rows are.
        unknowns: what has a coordinate, shape (n,).
        names, values: of what the residuals take, shape (k,).
        slope: dvalues/dw, shape (k, n).
        held: coordinates at a bound, shape (n,).
        r: weighted residuals, with a robust loss its influence function of them, shape (rows,).
        J: dr/dw of the weighted residuals before the loss, shape (rows, n).
        gain: derivative of the influence function; one for squares, shape (rows,).
        raw: predicted - measured in SI units, shape (rows,).
        noise: standard deviation of the noise of signals for which it is known.
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
        """Name of a channel for a sentence."""
        records = {c.record for c in self.channels}
        return channel.signal if len(records) == 1 else f"{channel.signal}[{channel.record}]"


def minimum(task: Task, point: Point) -> Minimum:
    """The arrays of a solved task.

    The derivative of the influence function psi = rho' r is taken as its mean over a channel
    (Huber and Ronchetti, Robust Statistics, 2009, section 7.6), which is never negative in effect.
    """
    gain = np.ones(point.r.size)
    if point.loss != "squares":
        h = 1e-4
        above, below = (influence(r, point.loss) * r for r in (point.r + h, point.r - h))
        for channel in task.channels:
            rows = channel.rows
            gain[rows] = max(float(np.mean(above[rows] - below[rows])) / (2 * h), 0.05)
    known = {s: sigma for s, sigma in task.noise.items() if s not in task.estimated}
    return Minimum(
        channels=task.channels,
        unknowns=task.unknowns.unknowns,
        names=task.unknowns.names,
        values=point.values,
        slope=point.slope,
        held=task.unknowns.at_bound(point.w),
        r=point.weights * point.r,
        J=point.J,
        gain=gain,
        raw=point.evaluation.r,
        noise=known,
    )


def trace(task: Task, found: Minimum) -> Callable[[Array], float]:
    """How much weighted residuals change with the values: root of the sum of squares."""
    sigma = task.sigma

    def change(values: Array) -> float:
        there = task.residuals.at(values)
        if isinstance(there, str):
            return float("inf")
        return float(np.linalg.norm((there.r - found.raw) / sigma))

    return change


Trace = Callable[[Array], float]
"""Values -> how much the residuals change with them."""

SHARE = 1e-4
"""Share of a direction below which a value has no part in it."""
NEAR = 1e-2
"""Distance from whole numbers that counts as whole."""
STEP = 0.05
"""Relative change of values with which two descriptions are told apart."""


@final
@dataclass(frozen=True, eq=False)
class Lost:
    """A group of values of which the data tell fewer combinations than it has members.

    Attributes:
        members: numbers of the values.
        sentence: what is told of them.
    """

    members: tuple[int, ...]
    sentence: str


def lost(
    names: tuple[str, ...], values: Array, null: Array, size: Array, trace: Trace
) -> Iterator[Lost]:
    """Groups of values that the residuals do not determine.

    Args:
        names: of the values.
        values: at the minimum, shape (k,).
        null: independent directions of the values without a trace, shape (k, nullity).
        size: sensitivity of the residuals to each value alone, above zero, shape (k,).
        trace: asked at values a little way off.
    """
    scaled = null * size[:, None]
    scaled = scaled / np.maximum(np.linalg.norm(scaled, axis=0), 1e-300)
    basis, s, _ = np.linalg.svd(scaled, full_matrices=False)
    basis = basis[:, s > 1e-9]
    shared = np.abs(basis @ basis.T)
    touched = np.flatnonzero(np.diag(shared) > SHARE**2)
    for group in _connected(shared > SHARE, touched.tolist()):
        members = list(group)
        yield Lost(group, _sentence(_Group(names, values, members, basis, size), trace))


@final
@dataclass(frozen=True, eq=False)
class _Group:
    """Members of a group, and the directions of all values without a trace, scaled by `size`."""

    all_names: tuple[str, ...]
    all_values: Array
    members: list[int]
    basis: Array
    size: Array

    @property
    def names(self) -> list[str]:
        return [self.all_names[i] for i in self.members]

    @property
    def values(self) -> Array:
        return self.all_values[self.members]

    @property
    def nullity(self) -> int:
        return int((np.linalg.svd(self.basis[self.members], compute_uv=False) > 1e-6).sum())

    def gradient(self) -> Array:
        """Of the one combination that is told, shape (d,)."""
        U, _, _ = np.linalg.svd(self.basis[self.members], full_matrices=True)
        return U[:, len(self.members) - 1] * self.size[self.members]

    def moved(self, change: Array) -> Array:
        """All values, those of the members changed."""
        there = self.all_values.copy()
        there[self.members] += change
        return there


def _sentence(group: _Group, trace: Trace) -> str:
    """What is told of a group."""
    names, told = group.names, len(group.members) - group.nullity
    if told == 0:
        which = "has" if len(names) == 1 else "have"
        return f"{_and(names)} {which} no influence on what was measured."
    if told > 1:
        return f"Of {_and(names)} only {told} combinations are told, not each."
    return f"Only {_told(group, trace)} is told, not {_and(names)} each."


def _told(group: _Group, trace: Trace) -> str:
    """The one combination g'values that is told."""
    names, here, g = group.names, group.values, group.gradient()
    powers, weights = _whole(g * here), _whole(g)
    if powers is not None and weights is not None:
        factor = np.array([STEP / powers[0], -STEP / powers[1]])
        amount = STEP * here[0] * np.array([1 / weights[0], -1 / weights[1]])
        rest = np.zeros(here.size - 2)
        by_factor = group.moved(here * np.expm1(np.append(factor, rest)))
        by_amount = group.moved(np.append(amount, rest))
        if trace(by_factor) < trace(by_amount):
            weights = None
        else:
            powers = None
    if powers is not None:
        return _product(names, powers)
    if weights is not None:
        return _sum(names, weights)
    g = g / g[np.argmax(np.abs(g))]
    terms = " + ".join(f"{c:.3g} {n}" for n, c in zip(names, g, strict=True)).replace("+ -", "- ")
    return f"{terms} (close to what was found)"


def _whole(g: Array) -> Array | None:
    """G over its smallest entry if that makes small whole numbers, the first one positive."""
    smallest = float(np.abs(g).min())
    if not smallest > 1e-12 * float(np.abs(g).max()):
        return None
    scaled = g / smallest * np.sign(g[0])
    nearest = np.rint(scaled)
    return nearest if np.abs(scaled - nearest).max() < NEAR and np.abs(nearest).max() <= 3 else None


def _product(names: list[str], powers: Array) -> str:
    def factor(name: str, power: float) -> str:
        return name if power == 1 else f"{name}^{power:g}"

    above = [factor(n, p) for n, p in zip(names, powers, strict=True) if p > 0]
    below = [factor(n, -p) for n, p in zip(names, powers, strict=True) if p < 0]
    if not below:
        return f"the product {' '.join(above)}"
    under = below[0] if len(below) == 1 else f"({' '.join(below)})"
    return f"the ratio {' '.join(above)} / {under}"


def _sum(names: list[str], weights: Array) -> str:
    def term(name: str, weight: float) -> str:
        return name if abs(weight) == 1 else f"{abs(weight):g} {name}"

    text = "".join(
        f" {'+' if w > 0 else '-'} {term(n, w)}" for n, w in zip(names, weights, strict=True)
    )
    kind = "sum" if (weights > 0).all() else "difference" if len(names) == 2 else "combination"
    return f"the {kind} {text[3:]}"


def _and(names: list[str]) -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"


def _connected(linked: NDArray[np.bool_], members: list[int]) -> Iterator[tuple[int, ...]]:
    """Connected sets of `members`."""
    left = set(members)
    while left:
        group, edge = set[int](), {min(left)}
        while edge:
            group |= edge
            edge = {
                j for i in edge for j in np.flatnonzero(linked[i]).tolist() if j in left
            } - group
        yield tuple(sorted(group))
        left -= group
