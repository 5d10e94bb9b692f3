"""Test whether residuals depend on inputs and motion: added variables under coloured noise.

Inputs, and the motion that the model predicts (the measured one shares its noise with the
residuals), give families of columns. A right model leaves none of them in the residuals; each
family is what one kind of error leaves:

| family | columns | what is missing |
|---|---|---|
| response to a regressor | it, now and earlier | dynamics, delay, mass, viscous |
| direction of motion | sign v, v abs(v), v^3, abs(v) | Coulomb level, asymmetry, viscous terms |
| speed | bins of abs(v), each way | shape of the friction curve: Stribeck |
| time or distance since reversal | bins, each way | pre-sliding, hysteresis, dwell |
| place | harmonics of the position | ripple, cogging, gravity |

Residuals and columns are whitened by an autoregressive model, what the fit could still take up (J)
is projected out of both, and the rest is regressed on the columns:

    F = (explained / q) / (rest / (n - k - q))  ~  F(q, n - k - q)     if there is no dependence

For one column this is a cross-correlation with the variance of Bartlett's formula. The
autoregressive model is first that of the residuals, which takes a missing harmonic for colour; so
unless F is large already, it is that of what the columns leave of the residuals.
Sources: Haugh, J. Am. Stat. Assoc. 71, 1976; Godfrey, Econometrica 46(6), 1978 (added variables);
Ljung, System Identification, 1999, section 16.6.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal, final

import numpy as np

from identification.residuals.evaluation import Array, Channel
from identification.verdict.colour import Colour, span, whitened
from identification.verdict.colour import colour as autoregressive
from identification.verdict.minimum import Count, Minimum, lagged, positions

Kind = Literal["position", "velocity", "acceleration", ""]

DELAYS = (0, 1, 2, 4, 8, 16, 32)
"""Samples by which a regressor may act late."""
BINS = 8
"""Bins of speed and of the distance since a reversal, each way."""
HARMONICS = 12
"""Of the position over its range."""
ROWS_EACH = 12
"""Rows that a column needs at least."""
MOVING = 1e-3
"""Share of the largest speed below which there is no direction."""


@final
@dataclass(frozen=True, eq=False)
class Clue:
    """A signal that residuals may depend on, shape (n,), and what it is."""

    name: str
    signal: Array
    kind: Kind = ""


@final
@dataclass(frozen=True, eq=False)
class Family:
    """Columns of one kind.

    Attributes:
        what: what they are functions of, for a sentence: "the residuals of x depend on ...".
        hint: what such a dependence means.
        columns: shape (n, q).
        smoothed: whether they come from a signal that had to be smoothed, which leaves traces.
    """

    what: str
    hint: str
    columns: Array
    smoothed: bool = False


def families(clues: Sequence[Clue], position: Count) -> Iterator[Family]:
    """The families that `clues` give; those with too many columns for the rows are thinned."""
    n = position.size
    delays = DELAYS if position.max(initial=0) > 2 * DELAYS[-1] else DELAYS[:1]
    for clue in clues:
        name, signal = clue.name, clue.signal
        if not np.ptp(signal) > 0:
            continue
        if clue.kind == "position":
            yield _of_place(name, signal, n)
            continue
        columns = np.column_stack([lagged(signal, position, d) for d in delays])
        hint = f"dynamics or a delay from {name} is missing"
        yield Family(f"{name} and its past", hint, columns, clue.kind == "acceleration")
        if clue.kind == "velocity":
            yield from _of_speed(name, signal, n)
            if position.any():
                since = _since_reversal(signal, position)
                yield Family(
                    f"the path since {name} last changed its sign",
                    "hysteresis or pre-sliding is not described",
                    _bins(since, _way(signal), _count(n)),
                )


def _of_place(name: str, x: Array, n: int) -> Family:
    turns = 2 * np.pi * (x - x.min()) / np.ptp(x)
    orders = np.arange(1, max(1, min(HARMONICS, n // (2 * ROWS_EACH))) + 1) / 2
    waves = np.outer(turns, orders)
    return Family(
        f"the place {name}",
        "something changes along the way: ripple, cogging, a spring, gravity",
        np.column_stack([np.cos(waves), np.sin(waves)]),
    )


def _count(n: int) -> int:
    """Bins each way that n rows allow."""
    return max(2, min(BINS, n // (2 * ROWS_EACH)))


def _of_speed(name: str, v: Array, n: int) -> Iterator[Family]:
    size = np.abs(v).max()
    yield Family(
        f"the direction and size of {name}",
        "friction of another level or another power of the speed is there",
        np.column_stack([_way(v), v * np.abs(v) / size**2, (v / size) ** 3, np.abs(v) / size]),
    )
    yield Family(
        f"the speed {name}",
        "the friction curve has another shape, such as a Stribeck peak",
        _bins(np.abs(v), _way(v), _count(n)),
    )


def _way(v: Array) -> Array:
    """Sign of v; 0 at standstill."""
    return np.where(np.abs(v) > MOVING * np.abs(v).max(), np.sign(v), 0.0)


def _bins(signal: Array, way: Array, count: int) -> Array:
    """One column for each bin of equal shares of `signal` and each way, (n, up to 2 count)."""
    moving = way != 0
    if not moving.any():
        return np.zeros((signal.size, 0))
    edges = np.quantile(signal[moving], np.linspace(0, 1, count + 1)[1:-1])
    bin_of = np.searchsorted(edges, signal)
    columns = [(bin_of == b) & (way == side) for b in range(count) for side in (-1, 1)]
    return np.column_stack([c for c in columns if c.any()]).astype(float)


def _since_reversal(v: Array, position: Count) -> Array:
    """Sum of abs(v) over the samples since v changed its sign or a run began."""
    way = np.sign(v)
    turned = np.ones(v.size, dtype=bool)
    turned[1:] = (way[1:] != way[:-1]) | (position[1:] == 0)
    path = np.cumsum(np.abs(v))
    last = np.maximum.accumulate(np.where(turned, np.arange(v.size), 0))
    return path - path[last]


POSITIONS, VELOCITIES = ("m", "rad"), ("m/s", "rad/s")


def clues_of(found: Minimum, channel: Channel) -> list[Clue]:
    """The regressors of a channel, and the motion that was simulated for its record."""
    clues = {n: Clue(n, s, _kind(n)) for n, s in channel.regressors.items()}
    for other in found.channels:
        if other.record != channel.record or not _same_times(other, channel):
            continue
        predicted = other.measured + found.raw[other.rows]
        if other.unit in VELOCITIES:
            clues.setdefault(other.signal, Clue(other.signal, predicted, "velocity"))
        elif other.unit in POSITIONS and other.ordered:
            clues.setdefault(other.signal, Clue(other.signal, predicted, "position"))
            rate = "v" if other.signal == "x" else f"the rate of {other.signal}"
            speed = _rate(predicted, other.t, positions(other))
            clues.setdefault(rate, Clue(rate, speed, "velocity"))
    return list(clues.values())


def _kind(name: str) -> Kind:
    """What a regressor is by its name."""
    stem = name.replace(".", "_").replace("[", "_").split("_")[0]
    kinds: dict[str, Kind] = {"x": "position", "v": "velocity", "a": "acceleration"}
    return kinds.get(stem, "")


def _same_times(one: Channel, other: Channel) -> bool:
    return one.t.size == other.t.size and bool(np.array_equal(one.t, other.t))


def _rate(x: Array, t: Array, position: Count) -> Array:
    """Slope of x over time, inside each run."""
    slope = np.zeros_like(x)
    starts = np.flatnonzero(position == 0)
    for first, last in zip(starts, [*starts[1:], x.size], strict=True):
        if last - first > 1:
            slope[first:last] = np.gradient(x[first:last], t[first:last])
    return slope


SURE, UNSURE = 1e-6, 0.02
"""p below which the first test needs no second one, and the second one a better one."""

MANY = 25
"""Rows for each column, from which on a model of what the columns leave can be believed."""


@final
@dataclass(frozen=True, eq=False)
class Dependence:
    """What one family explains of the residuals of one channel.

    Attributes:
        what, hint: see `Family`.
        statistic: F.
        columns: q.
        p: the chance of a larger F without dependence.
        size: root mean square of the part of the residuals that the family explains, in their unit.
        share: its square over that of the residuals.
        smoothed: see `Family`.
    """

    what: str
    hint: str
    statistic: float
    columns: int
    p: float
    size: float
    share: float
    smoothed: bool


def dependences(
    r: Array, J: Array, colour: Colour, clues: Sequence[Clue], position: Count
) -> Iterator[Dependence]:
    """Test of every family that `clues` give.

    Args:
        r: residuals, shape (n,).
        J: sensitivities, shape (n, k), of any rank.
        colour: of r.
        clues: what it may depend on.
        position: neighbours before each row, see `positions`.
    """
    if not np.any(r):
        return
    basis = span(J)
    power = float(r @ r) / r.size
    for family in families(clues, position):
        columns = family.columns - family.columns.mean(axis=0)
        columns = columns / np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
        found = _added(r, basis, columns, colour.partial, position)
        if found is None:
            continue
        both = span(np.column_stack([basis, columns]), 1e-6)
        if found.p > SURE and r.size >= MANY * both.shape[1]:
            rest = _without(both, r)
            other = autoregressive(rest, both, position, refine=False)
            found = _added(r, basis, columns, other.partial, position) or found
            if found.p < UNSURE and other.order:
                other = autoregressive(rest, both, position)
                found = _added(r, basis, columns, other.partial, position) or found
        share = found.size**2 / power
        yield Dependence(
            what=family.what,
            hint=family.hint,
            statistic=found.statistic,
            columns=found.q,
            p=found.p,
            size=found.size,
            share=share,
            smoothed=family.smoothed,
        )


@final
@dataclass(frozen=True, eq=False)
class _Added:
    """F of added columns, its p, their number, and the size of what they explain."""

    statistic: float
    p: float
    q: int
    size: float


def _added(
    r: Array, basis: Array, columns: Array, partial: Array, position: Count
) -> _Added | None:
    """F of `columns` in r beside `basis` in noise with partial autocorrelations `partial`."""
    from scipy.special import fdtrc  # noqa: PLC0415  (SciPy is loaded by those who fit)

    known = span(whitened(basis, partial, position))
    rest = _without(known, whitened(r, partial, position))
    clean = _without(known, whitened(columns, partial, position))
    new = span(clean, 1e-6)
    q, free = new.shape[1], r.size - known.shape[1] - new.shape[1]
    if not q or free < 2 * q:
        return None
    weights = new.T @ rest
    explained = float(weights @ weights)
    left = max(float(rest @ rest) - explained, np.finfo(float).tiny)
    statistic = explained / q / (left / free)
    size = _explained(columns, basis, clean, rest)
    return _Added(statistic, float(fdtrc(q, free, statistic)), q, size)


def _without(basis: Array, x: Array) -> Array:
    """What is left of x without its part in the span of an orthonormal basis."""
    return x - basis @ (basis.T @ x)


def _explained(columns: Array, basis: Array, clean: Array, rest: Array) -> float:
    """Root mean square of what the columns say of the residuals, before whitening."""
    weights, *_ = np.linalg.lstsq(clean, rest, rcond=1e-6)
    part = _without(basis, columns @ weights)
    return float(np.sqrt(np.mean(part**2)))
