"""Signals as they are drawn and stored: measured, predicted, what is left, and its correlation."""

from dataclasses import dataclass
from itertools import pairwise
from math import nan
from typing import final

import numpy as np
from numpy.typing import NDArray

from identification.residuals.evaluation import Channel
from identification.result.estimate import Error
from identification.verdict.whiteness import Whiteness
from symfric.foundation.brief import brief

Array = NDArray[np.float64]

MOST = 2000
"""Points of a line: more than a screen has columns of pixels for both ends of each."""
GAP = 3.0
"""Usual steps of time that are a gap."""
LEAST = 300
TOGETHER = 24_000
"""Points of one kind of line over all channels: many channels are drawn coarser."""


@final
@dataclass(frozen=True, eq=False)
class Line:
    """Points of a line: t (n,), y (n,)."""

    t: Array
    y: Array

    __repr__ = brief


@final
@dataclass(frozen=True, eq=False)
class Series:
    """One signal of one record.

    Attributes:
        record, signal, unit: what it is.
        abscissa: what `t` is: "t [s]", a velocity, a number.
        ordered: whether neighbours in t are neighbours in time: a line is drawn, not dots.
        rows: samples compared; the lines hold the envelope of so many.
        measured, predicted, residual: predicted - measured is the residual.
        breaks: times at which windows begin.
        lags, correlation: autocorrelation of the residuals at lags 1, 2, ... samples; empty where
            they have no order.
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
    """The line with at most `most` points that covers the same area.

    In each of most / 2 equal spans the smallest and the largest value stay, where they stand, and
    the ends: no spike is lost. Values that are not finite are left out.
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
    """The same of a signal over time, with a NaN in every gap: no line is drawn across it."""
    steps = np.diff(t)
    gaps = np.flatnonzero(steps > GAP * np.median(steps)) + 1 if steps.size else steps.astype(int)
    if not 0 < gaps.size <= most // 10:
        return envelope(t, y, most)
    lines: list[Line] = []
    for a, b in pairwise([0, *gaps.tolist(), t.size]):
        lines.append(envelope(t[a:b], y[a:b], max(4, most * (b - a) // t.size)))
        lines.append(Line(np.array([t[b - 1]]), np.array([nan])))
    lines.pop()
    return Line(*(np.concatenate([getattr(line, name) for line in lines]) for name in ("t", "y")))


def series(
    channel: Channel, record: str, r: Array, white: Whiteness, abscissa: str, most: int = MOST
) -> Series:
    """What is drawn of a channel.

    Args:
        channel: what was compared.
        record: its name.
        r: residuals of all rows of all channels.
        white: autocorrelation of those of this channel.
        abscissa: what its `t` is.
        most: points of a line.
    """
    order = slice(None) if channel.ordered else np.argsort(channel.t, kind="stable")
    t, measured, left = channel.t[order], channel.measured[order], r[channel.rows][order]
    line = cut_envelope if channel.ordered else envelope
    return Series(
        record=record,
        signal=channel.signal,
        unit=channel.unit,
        abscissa=abscissa,
        ordered=channel.ordered,
        rows=left.size,
        measured=line(t, measured, most),
        predicted=line(t, measured + left, most),
        residual=line(t, left, most),
        breaks=channel.t[list(channel.breaks)],
        lags=white.lags,
        correlation=white.correlation,
        low=white.low,
        high=white.high,
    )


def points_each(channels: int) -> int:
    """Points of a line where there are so many channels: many are drawn coarser."""
    return int(np.clip(TOGETHER // max(1, channels), LEAST, MOST))


def error(channel: Channel, r: Array, effective: float = nan) -> Error:
    """What is left of one channel; `r` holds the residuals of all rows."""
    left = r[channel.rows]
    size = float(np.linalg.norm(channel.measured))
    return Error(
        unit=channel.unit,
        rms=float(np.sqrt(np.mean(left**2))) if left.size else 0.0,
        relative=100.0 * float(np.linalg.norm(left)) / size if size > 0 else float("inf"),
        largest=float(np.abs(left).max(initial=0.0)),
        rows=left.size,
        effective=effective,
    )
