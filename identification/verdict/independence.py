"""Tests for dependence of residuals on inputs and motion: added variables, autocorrelated noise.

Inputs and the predicted motion (the measured motion shares its noise with the residuals) define
families of columns. The residuals of a correct model do not depend on them. Each family corresponds
to one type of model error:

| family | columns | missing in the model |
|---|---|---|
| response to a regressor | its present and past values | dynamics, delay, mass, viscous |
| direction of motion | sign v, v abs(v), v^3, abs(v) | Coulomb level, asymmetry, viscous terms |
| speed | bins of abs(v), each direction | shape of the friction curve: Stribeck |
| distance since reversal | bins, each direction | pre-sliding, hysteresis, dwell |
| position | harmonics of the position | ripple, cogging, gravity |

Residuals and columns are whitened by an autoregressive model, the span of the sensitivities J is
projected out of both, and the remaining residuals are regressed on the columns:

    F = (explained / q) / (rest / (n - k - q))  ~  F(q, n - k - q)     if there is no dependence

For one column, this is a cross-correlation with the variance of Bartlett's formula. The
autoregressive model is first fitted to the residuals, where it may absorb a missing harmonic.
Unless F is already large, it is therefore fitted again to the residuals of the regression.
Sources: Haugh, J. Am. Stat. Assoc. 71, 1976; Godfrey, Econometrica 46(6), 1978 (added variables);
Ljung, System Identification, 1999, section 16.6.
"""

from collections.abc import Iterator, Mapping, Sequence
from typing import Literal, NamedTuple

import numpy as np

from identification.residuals.evaluation import Array, Channel
from identification.verdict.colour import Colour, Count, span, whitened
from identification.verdict.colour import colour as autoregressive
from identification.verdict.minimum import Minimum, lagged, positions

Kind = Literal["position", "velocity", "acceleration", ""]

DELAYS = (0, 1, 2, 4, 8, 16, 32)
"""Delays of a regressor that are tested [samples]."""
BINS = 8
"""Number of bins of speed and of the distance since a reversal, in each direction."""
HARMONICS = 12
"""Largest number of harmonics of the position over its range."""
ROWS_EACH = 12
"""Smallest number of rows per column."""
MOVING = 1e-3
"""Speed relative to the largest one below which there is no direction of motion."""


class Regressor(NamedTuple):
    """Signal that residuals may depend on, shape (n,), with its name and type."""

    name: str
    signal: Array
    kind: Kind = ""


class Family(NamedTuple):
    """Columns that test for one type of dependence.

    Attributes:
        what: name of the dependence in a message: "the residuals of x depend on ...".
        hint: likely cause of the dependence.
        columns: columns of the regression, shape (n, q).
        smoothed: True for columns from a smoothed signal, which leaves systematic errors.
    """

    what: str
    hint: str
    columns: Array
    smoothed: bool = False


def families(regressors: Sequence[Regressor], position: Count) -> Iterator[Family]:
    """Yield the families of all `regressors`, with fewer columns if there are few rows."""
    n = position.size
    delays = DELAYS if position.max(initial=0) > 2 * DELAYS[-1] else DELAYS[:1]
    most = n // (2 * ROWS_EACH)
    bins = max(2, min(BINS, most))
    for name, signal, kind in regressors:
        if not np.ptp(signal) > 0:
            continue
        if kind == "position":
            turns = 2 * np.pi * (signal - signal.min()) / np.ptp(signal)
            waves = np.outer(turns, np.arange(1, max(1, min(HARMONICS, most)) + 1) / 2)
            hint = "an effect of the position is missing: ripple, cogging, a spring, gravity"
            columns = np.column_stack([np.cos(waves), np.sin(waves)])
            yield Family(f"the position {name}", hint, columns)
            continue
        columns = np.column_stack([lagged(signal, position, d) for d in delays])
        hint = f"dynamics or a delay from {name} is missing"
        yield Family(f"the present and past of {name}", hint, columns, kind == "acceleration")
        if kind != "velocity":
            continue
        speed, size = np.abs(signal), np.abs(signal).max()
        way = np.where(speed > MOVING * size, np.sign(signal), 0.0)  # 0 at standstill
        powers = (way, signal * speed / size**2, (signal / size) ** 3, speed / size)
        hint = "the friction level or its dependence on the speed is wrong"
        yield Family(f"the direction and size of {name}", hint, np.column_stack(powers))
        hint = "the friction curve has another shape, such as a Stribeck peak"
        yield Family(f"the speed {name}", hint, _bins(speed, way, bins))
        if position.any():
            columns = _bins(_since_reversal(signal, position), way, bins)
            hint = "hysteresis or pre-sliding is not modelled"
            yield Family(f"the distance since {name} last changed its sign", hint, columns)


def _bins(signal: Array, way: Array, count: int) -> Array:
    """Return a column for each quantile bin of `signal` and each direction, (n, up to 2 count)."""
    moving = way != 0
    if not moving.any():
        return np.zeros((signal.size, 0))
    edges = np.quantile(signal[moving], np.linspace(0, 1, count + 1)[1:-1])
    bin_of = np.searchsorted(edges, signal)
    columns = [(bin_of == b) & (way == side) for b in range(count) for side in (-1, 1)]
    return np.column_stack([c for c in columns if c.any()]).astype(float)


def _since_reversal(v: Array, position: Count) -> Array:
    """Return the sum of abs(v) since the last sign change or start of a run, shape (n,)."""
    way = np.sign(v)
    turned = np.ones(v.size, dtype=bool)
    turned[1:] = (way[1:] != way[:-1]) | (position[1:] == 0)
    path = np.cumsum(np.abs(v))
    last = np.maximum.accumulate(np.where(turned, np.arange(v.size), 0))
    return path - path[last]


POSITIONS, VELOCITIES = ("m", "rad"), ("m/s", "rad/s")
KINDS: Mapping[str, Kind] = {"x": "position", "v": "velocity", "a": "acceleration"}
"""Types of regressors by the first part of their names."""


def inputs_of(found: Minimum, channel: Channel) -> list[Regressor]:
    """Return the regressors of a channel and the predicted motion of its record."""
    regressors = dict[str, Regressor]()
    for name, signal in channel.regressors.items():
        stem = name.replace(".", "_").replace("[", "_").split("_")[0]
        regressors[name] = Regressor(name, signal, KINDS.get(stem, ""))
    for other in found.channels:
        if other.record != channel.record or not np.array_equal(other.t, channel.t):
            continue
        predicted = other.measured + found.raw[other.rows]
        if other.unit in VELOCITIES:
            regressors.setdefault(other.signal, Regressor(other.signal, predicted, "velocity"))
        elif other.unit in POSITIONS and other.ordered:
            regressors.setdefault(other.signal, Regressor(other.signal, predicted, "position"))
            rate = "v" if other.signal == "x" else f"the rate of {other.signal}"
            speed = _rate(predicted, other.t, positions(other))
            regressors.setdefault(rate, Regressor(rate, speed, "velocity"))
    return list(regressors.values())


def _rate(x: Array, t: Array, position: Count) -> Array:
    """Return the time derivative of x, computed separately in each run."""
    slope = np.zeros_like(x)
    starts = np.flatnonzero(position == 0)
    for first, last in zip(starts, [*starts[1:], x.size], strict=True):
        if last - first > 1:
            slope[first:last] = np.gradient(x[first:last], t[first:last])
    return slope


SURE, UNSURE = 1e-6, 0.02
"""p-values: below SURE, the first test is sufficient; below UNSURE, the second model is refined."""

MANY = 25
"""Rows per column above which a model of the remaining residuals is reliable."""


class Dependence(NamedTuple):
    """Part of the residuals of one channel that is explained by added columns.

    Attributes:
        statistic: statistic F.
        p: probability of a larger F without dependence.
        size: root mean square of the explained part, in the unit of the residuals.
    """

    statistic: float
    p: float
    size: float


def dependences(
    r: Array, J: Array, colour: Colour, regressors: Sequence[Regressor], position: Count
) -> Iterator[tuple[Family, Dependence]]:
    """Test the residuals against every family of `regressors`.

    Args:
        r: residuals, shape (n,).
        J: sensitivities, shape (n, k), of any rank.
        colour: autoregressive model of r.
        regressors: signals that r may depend on.
        position: number of neighbours before each row, see `positions`.
    """
    if not np.any(r):
        return
    basis = span(J)
    for family in families(regressors, position):
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
        yield family, found


def _added(
    r: Array, basis: Array, columns: Array, partial: Array, position: Count
) -> Dependence | None:
    """Return F of `columns` added to `basis` for noise with partial autocorrelations `partial`."""
    from scipy.special import fdtrc  # noqa: PLC0415  (slow to import)

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
    weights, *_ = np.linalg.lstsq(clean, rest, rcond=1e-6)
    part = _without(basis, columns @ weights)  # explained part before whitening
    size = float(np.sqrt(np.mean(part**2)))
    return Dependence(statistic, float(fdtrc(q, free, statistic)), size)


def _without(basis: Array, x: Array) -> Array:
    """Return x without its projection on an orthonormal basis."""
    return x - basis @ (basis.T @ x)
