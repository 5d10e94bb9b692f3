"""Parts of a result: estimates, errors, signals for plots, and friction over velocity."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from math import inf, nan
from typing import final

import numpy as np

from identification.data.differentiate import differentiated
from identification.data.record import Record
from identification.residuals.evaluation import Array, Channel
from identification.verdict.colour import Whiteness
from symfric.foundation.shown import brief
from symfric.foundation.status import Status
from symfric.foundation.units import turned
from symfric.laws import Law
from symfric.laws.base.law import FORCE
from symfric.laws.composed.populations import steady_force
from symfric.scenes import Drive


@final
@dataclass(frozen=True)
class Estimate:
    """Estimate of a parameter, start value or dead time.

    Attributes:
        value, unit: estimate in the unit of the user.
        standard_error: standard error with autocorrelated residuals; None if the parameter is
            held, at a bound, or not separable from others.
        low, high: 95 % interval; symmetric in the logarithm if the value is fitted by its
            logarithm, so that a stiffness stays positive. None if `standard_error` is.
        white_error: standard error for white residuals; much less than `standard_error` if
            neighbouring samples are correlated.
        fixed: True if the value was not fitted.
        note: reason why the parameter is held or has no interval, or that it is tied.
        nuisance: True for a start value or a dead time, which is fitted but not requested.
    """

    value: float
    unit: str
    standard_error: float | None = None
    low: float | None = None
    high: float | None = None
    white_error: float | None = None
    fixed: bool = False
    note: str = ""
    nuisance: bool = False

    @property
    def relative_error(self) -> float | None:
        """Standard error relative to the value [%]; None for zero or without a standard error."""
        if self.standard_error is None or self.value == 0.0:
            return None
        return 100.0 * self.standard_error / abs(self.value)


@final
@dataclass(frozen=True)
class Error:
    """Size of the residuals of one signal of one record.

    Attributes:
        unit: unit of the signal.
        rms: root mean square of predicted - measured.
        relative: norm of the difference relative to the norm of the signal [%], as in the EMPS
            benchmark; not informative for a signal far from zero, such as an offset position.
        largest: largest magnitude of the difference.
        rows: number of differences.
        effective: equivalent number of independent samples; NaN if unknown.
    """

    unit: str
    rms: float
    relative: float
    largest: float
    rows: int
    effective: float = nan


@final
@dataclass(frozen=True)
class Tried:
    """Start with the end of its descent.

    Attributes:
        number: number of the start.
        above: -2 log-likelihood above that of the best start; if less than 1, both reached the
            same minimum.
        cost: sum of weighted squares, or of the robust losses.
        status, message: status of the end.
        evaluations: number of residual evaluations.
        values: values at the end.
    """

    number: int
    above: float
    cost: float
    status: Status
    message: str
    evaluations: int
    values: dict[str, float]


Errors = dict[tuple[str, str], Error]
"""Errors of each signal of each record, (record, signal) -> error."""


MOST = 2000
"""Largest number of points of a line, about two for each column of pixels."""
GAP = 3.0
"""Smallest gap in time, relative to the usual step."""
LEAST = 300
TOGETHER = 24_000
"""Total number of points of one type of line; with many channels, each line has fewer points."""


@final
@dataclass(frozen=True, eq=False)
class Line:
    """Points of a line, t (n,) and y (n,)."""

    t: Array
    y: Array

    __repr__ = brief


@final
@dataclass(frozen=True, eq=False)
class Series:
    """Signal of a record for plots.

    Attributes:
        record, signal, unit: names of record and signal, and unit.
        abscissa: quantity of `t`, such as "t [s]", a velocity, or an index.
        ordered: True if neighbours in t are neighbours in time; drawn as a line, otherwise as dots.
        rows: number of compared samples, of which the lines contain the envelope.
        measured, predicted, residual: lines; the residual is predicted - measured.
        breaks: times at which windows begin.
        lags, correlation: autocorrelation of the residuals at lags 1, 2, ... samples; empty if
            they are unordered.
        low, high: 95 % limits of `correlation` for white residuals.
    """

    record: str
    signal: str
    unit: str
    abscissa: str
    ordered: bool
    rows: int
    measured: Line
    predicted: Line
    residual: Line
    breaks: Array
    lags: Array
    correlation: Array
    low: Array
    high: Array

    __repr__ = brief


def envelope(t: Array, y: Array, most: int = MOST) -> Line:
    """Return a line of at most `most` points that covers the same area as the signal.

    The ends and the extreme values in each of most / 2 equal intervals are kept, so that no spike
    is lost. Non-finite values are left out.
    """
    finite = np.isfinite(y)
    t, y = t[finite], y[finite]
    if y.size <= most:
        return Line(t, y)
    edges = np.linspace(0, y.size, max(1, (most - 2) // 2) + 1).astype(int)
    spans = list(pairwise(edges.tolist()))
    low = [a + int(np.argmin(y[a:b])) for a, b in spans]
    high = [a + int(np.argmax(y[a:b])) for a, b in spans]
    kept = np.unique([0, *low, *high, y.size - 1])
    return Line(t[kept], y[kept])


def cut_envelope(t: Array, y: Array, most: int = MOST) -> Line:
    """Return the envelope of a signal over time, with a NaN in every gap to interrupt the line."""
    steps = np.diff(t)
    gaps = np.flatnonzero(steps > GAP * np.median(steps)) + 1 if steps.size else steps.astype(int)
    if not 0 < gaps.size <= most // 10:
        return envelope(t, y, most)
    lines: list[Line] = []
    for a, b in pairwise([0, *gaps.tolist(), t.size]):
        lines.append(envelope(t[a:b], y[a:b], max(4, most * (b - a) // t.size)))
        lines.append(Line(t[b - 1 : b], np.array([nan])))
    return Line(
        *(np.concatenate(part[:-1]) for part in ([x.t for x in lines], [x.y for x in lines]))
    )


def series(
    channel: Channel, record: str, r: Array, white: Whiteness, abscissa: str, most: int = MOST
) -> Series:
    """Return the data of a channel for plots.

    Args:
        channel: compared samples.
        record: name of the record.
        r: residuals of all rows of all channels.
        white: autocorrelation of the residuals of this channel.
        abscissa: quantity of `t` of the channel.
        most: largest number of points of a line.
    """
    order = slice(None) if channel.ordered else np.argsort(channel.t, kind="stable")
    t, measured, left = channel.t[order], channel.measured[order], r[channel.rows][order]
    line = cut_envelope if channel.ordered else envelope
    seen, predicted, residual = (line(t, y, most) for y in (measured, measured + left, left))
    return Series(
        record, channel.signal, channel.unit, abscissa, channel.ordered, left.size,
        seen, predicted, residual, channel.t[list(channel.breaks)],
        white.lags, white.correlation, white.low, white.high,
    )  # fmt: skip


def points_each(channels: int) -> int:
    """Return the number of points of a line, which decreases with the number of channels."""
    return int(np.clip(TOGETHER // max(1, channels), LEAST, MOST))


def error(channel: Channel, r: Array, effective: float = nan) -> Error:
    """Return the errors of one channel; `r` contains the residuals of all rows."""
    left = r[channel.rows]
    size = float(np.linalg.norm(channel.measured))
    rms = float(np.sqrt(np.mean(left**2))) if left.size else 0.0
    relative = 100.0 * float(np.linalg.norm(left)) / size if size > 0 else inf
    largest = float(np.abs(left).max(initial=0.0))
    return Error(channel.unit, rms, relative, largest, left.size, effective)


SIDE = 300
"""Number of points of the curve in each direction, down to a millionth of the largest speed."""
DOTS = 4000
"""Largest number of measured points that are drawn, over all records."""


@final
@dataclass(frozen=True, eq=False)
class Curve:
    """Friction over velocity of a law and of measured points.

    Attributes:
        v_unit, F_unit: units of velocity and friction.
        law: force of the fitted law in steady sliding over velocity.
        measured: record -> points (velocity, friction).
        says: origin of the points.
        half: half width of the pointwise 95 % band of the law, shape of its force; empty if a
            parameter of the law has no interval.
    """

    v_unit: str
    F_unit: str
    law: Line
    measured: dict[str, Line]
    says: str
    half: Array = field(default_factory=lambda: np.zeros(0))


def of_points(law: Law, N: float, points: dict[str, tuple[Array, Array]], turning: bool) -> Curve:
    """Return the curve of a law with measured points (v, F) of each record."""
    lines = {name: Line(v, F) for name, (v, F) in points.items()}
    inputs = [f"{i.name} = {i.steady:g} {i.unit}" for i in law.inputs if i.name != FORCE]
    says = ", ".join(["measured points", *(f"line at {one}" for one in inputs)])
    return _curve(law, N, lines, turning, says)


def of_drive(drive: Drive, records: Sequence[Record]) -> Curve:
    """Return the curve of the law of a drive, with force - m a - offset of the records.

    Records without position, force or equal intervals have no points.
    """
    lines = dict[str, Line]()
    for record in records:
        if record.t is None or "force" not in record or "x" not in record:
            continue
        try:
            found = differentiated(record, None)
        except ValueError:  # no acceleration: unequal intervals, or too short
            continue
        m, offset = float(drive.m), float(drive.offset)
        parts = [(s.equations(s.v), s.equations(s.force - m * s.a - offset)) for s in found]
        lines[record.name] = Line(*map(np.concatenate, zip(*parts, strict=True)))
    says = "measured: force - m a - offset" if lines else "no record has force and position"
    return _curve(drive.law, float(drive.N), lines, drive.turning, says)


REST = 1e-3
"""Share of the largest speed above which a point has a direction."""


def _curve(law: Law, N: float, lines: dict[str, Line], turning: bool, says: str) -> Curve:
    """Return the curve with every n-th point of the lines, at most about `DOTS` in total."""
    every = max(1, -(-sum(line.t.size for line in lines.values()) // DOTS))
    measured = {name: Line(line.t[::every], line.y[::every]) for name, line in lines.items()}
    top = max([float(np.abs(line.t).max(initial=0.0)) for line in measured.values()], default=0.0)
    if top == 0.0:
        scale = law.velocity_scale
        top = 10.0 * float(scale) if np.isfinite(float(scale)) else 1.0
    side = np.geomspace(1e-6 * top, top, SIDE)
    seen = [np.sign(line.t[np.abs(line.t) > REST * top]) for line in measured.values()]
    ways = np.unique(np.concatenate(seen)) if seen else np.zeros(0)
    v = np.concatenate([-side[::-1], [0.0], side])
    if ways.size == 1:  # the data do not show the other direction
        v = np.sort(ways[0] * side)
    unit = turned if turning else str
    return Curve(unit("m/s"), unit("N"), Line(v, steady_force(law, v, N)), measured, says)


def limits(curve: Curve) -> tuple[float, float]:
    """Return a range of forces that contains the curve and all but the farthest points."""
    dots = np.concatenate([line.y for line in curve.measured.values()] or [np.zeros(0)])
    ends = [*np.percentile(dots, [0.2, 99.8])] if dots.size else []
    low, high = min([*ends, curve.law.y.min()]), max([*ends, curve.law.y.max()])
    margin = 0.1 * (high - low) or 1.0
    return float(low - margin), float(high + margin)
