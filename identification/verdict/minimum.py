"""Arrays at the minimum of a fit, and the combinations of parameters that are not identifiable.

The residuals do not change along a null direction. If two values grow by the same factor along it,
only their ratio is identifiable; if they grow by the same amount, only their difference is. If both
descriptions fit at one point, the residuals are evaluated a small distance away along both.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import NamedTuple, final

import numpy as np
from numpy.typing import NDArray

from identification.residuals.evaluation import (
    Array,
    Blocks,
    Channel,
    Extended,
    influence,
    unbiased,
)
from identification.solving.task import Point, Task
from identification.unknowns.spec import Unknown
from identification.verdict.colour import Colour, colour, places, positions

Shift = Callable[[Array], float]
"""Function from values to the norm of the change of the residuals."""

RANK = 1e-7
"""Smallest nonzero singular value of the scaled sensitivities, relative to the largest."""


class Sandwich(NamedTuple):
    """Linearised uncertainty of k values that depend on n coordinates.

    Directions that the residuals do not determine are listed in `null` and do not contribute. If
    the residuals are larger in the rows that determine a value, the variances follow from the
    squares of the residuals in these rows, r^2 / (1 - leverage), and their number.
    Sources: MacKinnon and White, J. Econometrics 29(3), 1985 (HC2); Imbens and Kolesar, Rev. Econ.
    Stat. 98(4), 2016 (degrees of freedom).

    Attributes:
        coloured: covariance of the values with the autocorrelation of each channel, shape (k, k).
        white: the same for white residuals with the variance of each channel.
        freedom: effective degrees of freedom of the variances on the diagonal (Satterthwaite,
            including the uncertainty of the estimated autocorrelation), shape (k,).
        null: directions of the coordinates along which the residuals do not change, (n, nullity).
        colours: autoregressive models of the channels.
        uneven: mask of the values determined by rows with larger residuals, shape (k,).
    """

    coloured: Array
    white: Array
    freedom: Array
    null: Array
    colours: tuple[Colour, ...]
    uneven: NDArray[np.bool_]

    @property
    def widening(self) -> float:
        """Largest ratio of the standard errors with and without autocorrelation."""
        white = np.diag(self.white)
        ratio = np.divide(np.diag(self.coloured), white, out=np.ones(white.size), where=white > 0)
        return float(np.sqrt(ratio.max(initial=1.0)))


PART = 2**15
"""Number of grid points that are transformed at once; correlations between parts are neglected."""


def _meat(found: Colour, bread: Array, place: NDArray[np.int64]) -> tuple[Array, Array]:
    """Return B' Sigma B of one channel, and the variances of its estimated diagonal.

    var c_ii = 2 c_ii^2 / freedom + (dc_ii/dphi)' cov(phi) (dc_ii/dphi)
    """
    if not found.order:
        flat = found.variance * bread.T @ bread
        return flat, 2 * np.diag(flat) ** 2 / found.freedom
    rows, k = int(place.max()) + 1, bread.shape[1]
    on_grid = np.zeros((rows, k))
    np.add.at(on_grid, place, bread)
    points = 1 << (2 * min(rows, PART)).bit_length()
    both = np.full(points // 2 + 1, 2.0 / points)  # of the frequencies w and -w
    both[[0, -1]] /= 2
    S, slopes = (part[..., : both.size] * both for part in found.spectrum(points))
    sums, slope = np.zeros((k, k)), np.zeros((found.order, k))
    for first in range(0, rows, PART):
        waves = np.fft.rfft(on_grid[first : first + PART], points, axis=0)
        sums += np.real(waves.conj().T @ (S[:, None] * waves))
        slope += slopes @ np.abs(waves) ** 2
    spread = np.einsum("pi,pq,qi->i", slope, found.doubt, slope)
    return sums, 2 * np.diag(sums) ** 2 / found.freedom + spread


UNEVEN = 0.01
"""Level of the test for larger residuals in the rows that determine a value."""


def _local(found: Colour, bread: Array, squares: Array) -> tuple[Array, Array]:
    """Return the variances by local squares of residuals relative to those by their mean, (k,).

    The second array holds the variances of the first for residuals of equal size.
    """
    S = found.spectrum(2**10)[0]
    alike = float(np.mean(S**2) / np.mean(S) ** 2)  # correlated squares are worth fewer
    share = bread**2 / np.maximum(np.sum(bread**2, axis=0), 1e-300)
    return share.T @ squares / found.white, 2 * alike * np.sum(share**2, axis=0)


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
        change: norm of the change of the weighted residuals, a function of the values.
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
    change: Shift

    def label(self, channel: Channel) -> str:
        """Return the name of a channel for messages."""
        records = {c.record for c in self.channels}
        return channel.signal if len(records) == 1 else f"{channel.signal}[{channel.record}]"

    @cached_property
    def short(self) -> "Minimum":
        """Minimum with part of the rows of long channels, see `shortened`."""
        return shortened(self)

    @cached_property
    def colours(self) -> tuple[Colour, ...]:
        """Autoregressive models of the channels, of long ones from the rows of `short`."""
        if self.short is not self:
            both = zip(self.channels, self.short.colours, strict=True)
            sizes = ((c, channel.t.size) for channel, c in both)
            return tuple(c._replace(rows=n, freedom=c.freedom + n - c.rows) for c, n in sizes)
        J = self.J * ~self.held * self.gain[:, None]
        return tuple(
            colour(self.r[c.rows], J[c.rows], positions(c, across_windows=True))
            for c in self.channels
        )

    @cached_property
    def sandwich(self) -> Sandwich:
        """Linearised uncertainty of the values, with independent noise in the channels."""
        from scipy.special import chdtrc  # noqa: PLC0415  (slow to import)

        free = ~self.held
        size = np.linalg.norm(self.J * free, axis=0)
        size = np.where(size > 0, size, 1.0)
        scaled = self.J / size * free
        U, s, Vt = np.linalg.svd(scaled * np.sqrt(self.gain)[:, None], full_matrices=False)
        kept = s > RANK * max(float(s[0]) if s.size else 0.0, 1e-300)
        inverse = (Vt[kept].T / s[kept] ** 2) @ Vt[kept]
        bread = scaled @ (inverse @ (self.slope / size).T)  # (rows, k)
        reach = np.abs(bread).max(axis=0, initial=0.0)
        reach = np.where(reach > 0, reach, 1.0)  # scaling; variances of variances would overflow
        bread = bread / reach
        squares = self.r**2 / np.maximum(1 - np.sum(U[:, kept] ** 2, axis=1), 1e-6)
        k = len(self.names)
        coloured, white, spread = np.zeros((k, k)), np.zeros((k, k)), np.zeros(k)
        local, chance = np.zeros(k), np.zeros(k)
        for channel, seen in zip(self.channels, self.colours, strict=True):
            B = bread[channel.rows]
            C, wide = _meat(seen, B, places(channel))
            coloured, white, spread = coloured + C, white + seen.white * B.T @ B, spread + wide
            ratio, varies = _local(seen, B, squares[channel.rows])
            local, chance = local + np.diag(C) * ratio, chance + np.diag(C) ** 2 * varies
        total = np.diag(coloured) ** 2
        freedom, rows = (
            2 * np.divide(total, part, where=part > 0, out=np.ones(k)) for part in (spread, chance)
        )
        ratio = np.divide(local, np.diag(coloured), where=total > 0, out=np.ones(k))
        uneven = chdtrc(rows, rows * ratio) < UNEVEN / max(np.count_nonzero(total), 1)
        if uneven.any():
            wider = np.sqrt(np.maximum(ratio, 1.0))
            coloured, freedom = np.outer(wider, wider) * coloured, np.minimum(freedom, rows)
        inside = Vt[kept][:, free]  # free directions orthogonal to `inside` are null
        null = np.zeros((free.size, inside.shape[1] - inside.shape[0]))
        null[free] = np.linalg.svd(inside, full_matrices=True)[2][inside.shape[0] :].T
        back = np.outer(reach, reach)
        coloured, white = back * coloured, back * white
        freedom = np.maximum(freedom, 1.0)
        return Sandwich(coloured, white, freedom, null / size[:, None], self.colours, uneven)


LONG, BLOCKS = 50_000, 20
"""Number of rows of a channel that are tested, and number of blocks that contain them."""


def shortened(found: Minimum) -> Minimum:
    """Return a minimum whose long channels have only the rows of evenly spaced blocks.

    The tests of residuals need neighbours, but not all rows of a long record. Points have every
    n-th row.
    """
    some = [_tested(channel) for channel in found.channels]
    ends = np.cumsum([0, *(rows.size for rows in some)]).tolist()
    if ends[-1] == found.r.size:
        return found
    channels = list[Channel]()
    for channel, rows, begin, end in zip(found.channels, some, ends, ends[1:], strict=False):
        regressors = {name: y[rows] for name, y in channel.regressors.items()}
        breaks = tuple(np.flatnonzero(np.isin(rows, channel.breaks)).tolist())
        t, measured, place = channel.t[rows], channel.measured[rows], slice(begin, end)
        channels.append(
            replace(
                channel, rows=place, t=t, measured=measured, regressors=regressors, breaks=breaks
            )
        )
    rows = np.concatenate([c.rows.start + k for c, k in zip(found.channels, some, strict=True)])
    parts = {name: getattr(found, name)[rows] for name in ("r", "J", "gain", "raw")}
    return replace(found, channels=channels, **parts)


def _tested(channel: Channel) -> NDArray[np.int64]:
    """Return the rows of a channel that are tested."""
    n = channel.t.size
    if n <= LONG:
        return np.arange(n, dtype=np.int64)
    if not channel.ordered:
        return np.linspace(0, n - 1, LONG).astype(np.int64)
    size = LONG // BLOCKS
    starts = np.linspace(0, n - size, BLOCKS).astype(np.int64)
    return (starts[:, None] + np.arange(size)).ravel()


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
    raw = point.evaluation.r
    change = partial(_change, task, raw)
    channels, residuals = task.channels, task.residuals
    bias = residuals.bias(point.values) if isinstance(residuals, Blocks | Extended) else None
    if bias is not None:
        each = zip(channels, bias.squares.tolist(), strict=True)
        channels = [replace(c, motion_noise=(x / max(c.t.size, 1)) ** 0.5) for c, x in each]
    return Minimum(
        channels, box.unknowns, box.names, point.values, point.slope, box.at_bound(point.w),
        point.weights * point.r, point.J, gain, raw, known, change,
    )  # fmt: skip


def _change(task: Task, raw: Array, values: Array) -> float:
    """Return the norm of the change of the weighted residuals from `raw` to other values."""
    there = unbiased(task.residuals, values)
    if isinstance(there, str):
        return np.inf
    return float(np.linalg.norm((there.r - raw) / task.sigma))


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
