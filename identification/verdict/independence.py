"""Tests for dependence of residuals on inputs, motion and time: added variables, coloured noise.

Inputs and the predicted motion (the measured motion shares its noise with the residuals) define
families of columns. The residuals of a correct model do not depend on them. Each family corresponds
to one type of model error:

| family | columns | missing in the model |
|---|---|---|
| response to a regressor | its present and past values | dynamics, delay, mass, viscous |
| direction of motion | sign v, v abs(v), v^3, abs(v) | Coulomb level, asymmetry, viscous terms |
| speed | bins of abs(v), each direction | shape of the friction curve: Stribeck |
| distance since reversal | bins, each direction | pre-sliding, hysteresis, dwell |
| position | a harmonic, also times sign v | ripple, cogging, gravity, an uneven track |
| time | sensitivities times t | parameters that drift, warming up |
| delay, unless a dead time is estimated | rate of the predicted signal | a delay of the signal |
| predicted force | its size, square and cube | gain of a direction, saturation, load |

Residuals and columns are whitened by an autoregressive model, the span of the sensitivities J is
projected out of both, and the remaining residuals are regressed on the columns:

    F = (explained / q) / (rest / (n - k - q))  ~  F(q, n - k - q)     if there is no dependence

For one column, this is a cross-correlation with the variance of Bartlett's formula. The
autoregressive model is first fitted to the residuals, where it absorbs slow model errors as if they
were coloured noise. It is therefore fitted again to the residuals of the regression. The second
test counts if the model with the columns has the lower BIC.

The harmonic of the position is the one with the largest F (the periodogram of Lomb and Scargle);
p is multiplied by the number of harmonics (Bonferroni).
Sources: Haugh, J. Am. Stat. Assoc. 71, 1976; Godfrey, Econometrica 46(6), 1978 (added variables);
Ljung, System Identification, 1999, section 16.6; Nyblom, J. Am. Stat. Assoc. 84, 1989 (parameters
that drift); Schwarz, Ann. Statist. 6(2), 1978 (BIC); Ramsey, J. R. Stat. Soc. B 31(2), 1969 (powers
of predicted values).
"""

from collections.abc import Iterator, Mapping, Sequence
from typing import Literal, NamedTuple

import numpy as np

from identification.data.record import blocks
from identification.residuals.evaluation import DEAD_TIME, Array, Channel
from identification.verdict.colour import Colour, Count, deviance, lagged, positions, span, whitened
from identification.verdict.colour import colour as autoregressive
from identification.verdict.minimum import Minimum

Kind = Literal["position", "velocity", "acceleration", "time", "delay", "force", ""]

DELAYS = (0, 1, 2, 4, 8, 16, 32)
"""Delays of a regressor that are tested [samples]."""
BINS = 8
"""Number of bins of speed and of the distance since a reversal, in each direction."""
HARMONICS = 60
"""Largest number of half harmonics of the position over its range."""
ROWS_EACH = 12
"""Smallest number of rows per column."""
MOVING = 1e-3
"""Speed relative to the largest one below which there is no direction of motion."""


class Regressor(NamedTuple):
    """Signal that residuals may depend on, shape (n,), with its name and type."""

    name: str
    signal: Array
    kind: Kind = ""


class DependenceTest(NamedTuple):
    """Family of columns that tests for one type of dependence.

    Attributes:
        what: name of the dependence in a message: "the residuals of x depend on ...".
        hint: likely cause of the dependence.
        columns: columns of the regression, shape (n, q), or alternatives of them.
        smoothed: True for columns from a smoothed signal, which leaves systematic errors.
        noisy: True for past rates or accelerations, whose noise the residuals may contain.
    """

    what: str
    hint: str
    columns: "Array | Waves"
    smoothed: bool = False
    noisy: bool = False


def families(
    regressors: Sequence[Regressor], position: Count, basis: Array
) -> Iterator[DependenceTest]:
    """Yield the families of all `regressors`, with fewer columns if there are few rows.

    Args:
        regressors: signals that residuals may depend on.
        position: number of neighbours before each row, see `positions`.
        basis: orthonormal basis of the sensitivities, shape (n, k).
    """
    n = position.size
    delays = DELAYS if position.max(initial=0) > 2 * DELAYS[-1] else DELAYS[:1]
    most = n // (2 * ROWS_EACH)
    bins = max(2, min(BINS, most))
    for name, signal, kind in regressors:
        if not np.ptp(signal) > 0:
            continue
        if kind == "time":
            yield DependenceTest(
                "the time", "parameters drift, or a temperature", basis * signal[:, None]
            )
            continue
        if kind == "delay":
            hint = "the signals are recorded at different times: free={'dead_time': (0, 0.01)}"
            yield DependenceTest("the rate of the signal", hint, signal[:, None])
            continue
        if kind == "force":
            y = signal / np.abs(signal).max()
            hint = "the gain of the sensor depends on direction or size, or friction on the load"
            yield DependenceTest(
                "the predicted force", hint, np.column_stack([np.abs(y), y**2, y**3])
            )
            continue
        if kind == "position":
            way = next((np.sign(s) for _, s, k in regressors if k == "velocity"), None)
            hint = "an effect of the position is missing: ripple, cogging, a spring, gravity"
            yield DependenceTest(f"the position {name}", hint, _waves(signal, way, n // 2))
            continue
        columns = np.column_stack([lagged(signal, position, d) for d in delays])
        hint = f"dynamics or a delay from {name} is missing"
        smoothed, what = kind == "acceleration", f"the present and past of {name}"
        yield DependenceTest(what, hint, columns, smoothed, smoothed or kind == "velocity")
        if kind != "velocity":
            continue
        speed, size = np.abs(signal), np.abs(signal).max()
        way = np.where(speed > MOVING * size, np.sign(signal), 0.0)  # 0 at standstill
        powers = (way, signal * speed / size**2, (signal / size) ** 3, speed / size)
        hint = "the friction level or its dependence on the speed is wrong"
        yield DependenceTest(f"the direction and size of {name}", hint, np.column_stack(powers))
        hint = "the friction curve has another shape, such as a Stribeck peak"
        yield DependenceTest(f"the speed {name}", hint, _bins(speed, way, bins))
        if position.any():
            columns = _bins(_since_reversal(signal, position), way, bins)
            hint = "hysteresis or pre-sliding is not modelled"
            yield DependenceTest(f"the distance since {name} last changed its sign", hint, columns)


class Waves(NamedTuple):
    """Half harmonics of a position, from 1 to `most`.

    Attributes:
        turns: phases of the first one, shape (n,).
        way: direction of motion, shape (n,), if known.
        most: number of harmonics.
    """

    turns: Array
    way: Array | None
    most: int

    def columns(self, k: int, rows: Count | slice = slice(None)) -> Array:
        """Return the columns cos, sin, and both times `way`, of harmonic k, shape (n, q)."""
        phases = k * self.turns[rows]
        both = np.column_stack([np.cos(phases), np.sin(phases)])
        return both if self.way is None else np.hstack([both, both * self.way[rows, None]])


def _waves(x: Array, way: Array | None, most: int) -> Waves:
    turns = np.pi * (x - x.min()) / np.ptp(x)
    return Waves(turns, way, max(1, min(HARMONICS, most)))


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
    if channel.ordered:
        predicted = channel.measured + found.raw[channel.rows]
        if not any(name.startswith(DEAD_TIME) for name in found.names):
            rate = _rate(predicted, channel.t, positions(channel))
            regressors["rate"] = Regressor("rate", rate, "delay")
        regressors["time"] = Regressor("time", channel.t - channel.t.mean(), "time")
        if channel.unit in FORCES:
            regressors["predicted"] = Regressor("predicted", predicted, "force")
    return list(regressors.values())


def _rate(x: Array, t: Array, position: Count) -> Array:
    """Return the time derivative of x, computed separately in each run."""
    slope = np.zeros_like(x)
    starts = np.flatnonzero(position == 0)
    for first, last in zip(starts, [*starts[1:], x.size], strict=True):
        if last - first > 1:
            slope[first:last] = np.gradient(x[first:last], t[first:last])
    return slope


STRONG = 10.0
"""Difference of BIC that is strong evidence (Kass and Raftery, J. Am. Stat. Assoc. 90, 1995)."""


class Dependence(NamedTuple):
    """Part of the residuals of one channel that is explained by added columns.

    Attributes:
        statistic: statistic F.
        p: probability of a larger F without dependence.
        size: root mean square of the explained part, in the unit of the residuals.
        moved: change of the fitted values if the columns are added to the model, in standard
            errors of the combination of values that moves most.
    """

    statistic: float
    p: float
    size: float
    moved: float


def dependences(
    r: Array, J: Array, colour: Colour, regressors: Sequence[Regressor], position: Count
) -> Iterator[tuple[DependenceTest, Dependence]]:
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
    before = deviance(colour.partial, r, basis, position)
    test = _Added.of(r, basis, colour.partial, position)
    for family in families(regressors, position, basis):
        columns, count = family.columns, 1
        if isinstance(columns, Waves):
            count, columns = columns.most, _largest(columns, r, basis, colour.partial, position)
        columns = _scaled(columns)
        first = test(columns)
        if first is None:
            continue
        both = span(np.column_stack([basis, columns]), 1e-6)
        other = autoregressive(_without(both, r), both, position, refine=False)
        if deviance(other.partial, r, both, position) < before - STRONG:
            second = _Added.of(r, basis, other.partial, position)(columns)
            if second is not None and second.p < first.p:
                first = second
        yield family, first._replace(p=min(1.0, first.p * count))


CHOICE = 10_000
"""Largest number of rows from which a harmonic is chosen."""


def _largest(waves: Waves, r: Array, basis: Array, partial: Array, position: Count) -> Array:
    """Return the columns of the harmonic with the largest F, on blocks of a long channel."""
    parts = [np.arange(part.start, part.stop) for part in blocks(r.size, CHOICE)]
    rows = np.concatenate(parts)
    there = np.minimum(position[rows], np.concatenate([part - part[0] for part in parts]))
    test = _Added.of(r[rows], basis[rows], partial, there)
    each = ((k, test(_scaled(waves.columns(k, rows)))) for k in range(1, waves.most + 1))
    found = [(k, d.statistic) for k, d in each if d is not None]
    return waves.columns(max(found, key=lambda one: one[1], default=(1, 0.0))[0])


def _scaled(columns: Array) -> Array:
    """Return columns of mean zero and length one."""
    centred = columns - columns.mean(axis=0)
    return centred / np.maximum(np.linalg.norm(centred, axis=0), 1e-300)


class _Added(NamedTuple):
    """Test for added columns under an autoregressive model.

    Attributes:
        partial, position: see `whitened`.
        basis: orthonormal basis of the sensitivities, shape (n, k).
        known: orthonormal basis of the whitened sensitivities, shape (n, k).
        rest: whitened residuals without their part in `known`, shape (n,).
    """

    partial: Array
    position: Count
    basis: Array
    known: Array
    rest: Array

    @classmethod
    def of(cls, r: Array, basis: Array, partial: Array, position: Count) -> "_Added":
        known = span(whitened(basis, partial, position))
        rest = _without(known, whitened(r, partial, position))
        return cls(partial, position, basis, known, rest)

    def __call__(self, plain: Array) -> Dependence | None:
        """Return F of the columns `plain`, shape (n, q); None if they are in the model."""
        from scipy.special import fdtrc  # noqa: PLC0415  (slow to import)

        columns = whitened(plain, self.partial, self.position)
        inside = self.known.T @ columns
        clean = columns - self.known @ inside
        squares, axes = np.linalg.eigh(clean.T @ clean)
        kept = squares > 1e-12 * squares[-1]
        axes, squares = axes[:, kept], squares[kept]
        q, free = squares.size, self.rest.size - self.known.shape[1] - squares.size
        if not q or free < 2 * q:
            return None
        along, whole = axes.T @ (clean.T @ self.rest), float(self.rest @ self.rest)
        explained = float(along @ (along / squares))
        left = max(whole - explained, 1e-15 * whole, np.finfo(float).tiny)
        statistic = explained / q / (left / free)
        weights = axes @ (along / squares)
        part = _without(self.basis, plain @ weights)  # explained part before whitening
        moved = float(np.linalg.norm(inside @ weights)) / np.sqrt(left / free)
        size = float(np.sqrt(np.mean(part**2)))
        return Dependence(statistic, float(fdtrc(q, free, statistic)), size, moved)


def _without(basis: Array, x: Array) -> Array:
    """Return x without its projection on an orthonormal basis."""
    return x - basis @ (basis.T @ x)


ROUNDING = 1e-6
"""Error of simulation and interpolation, relative to the range of a signal."""
BALANCE = 2e-4
"""The same error for a force, limited by filtering and differentiation of the motion."""
FORCES = ("N", "N m")


def resolution(measured: Array, unit: str) -> float:
    """Return the rms error of rounding and simulation, in the unit of the signal.

    A signal is rounded if its values are multiples of the smallest step between them.
    """
    values = np.unique(measured)
    reach = float(values[-1] - values[0])
    floor = (BALANCE if unit in FORCES else ROUNDING) * max(
        reach, 1e-3 * float(np.abs(values).max())
    )
    steps = np.diff(values)
    steps = steps[steps > 1e-9 * reach]
    if not steps.size:
        return floor
    count = (values - values[0]) / float(steps.min())
    rounded = np.abs(count - np.rint(count)).max() < 0.1 and values.size < 0.9 * measured.size
    return max(floor, float(steps.min()) / np.sqrt(12)) if rounded else floor


def rms(r: Array) -> float:
    """Return the root mean square."""
    return float(np.sqrt(np.mean(r**2)))
