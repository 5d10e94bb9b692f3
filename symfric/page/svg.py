"""Charts as SVG text; the style sheet of the page defines their colours, light and dark.

Every chart has a title and a description for screen readers. Marks are clipped at the frame.
Coordinates are rounded to a tenth of a pixel, and coincident points are omitted.
"""

from abc import ABC, abstractmethod
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from html import escape
from math import ceil, floor, isfinite, log10
from typing import NamedTuple, final

import numpy as np
from matplotlib.ticker import Locator, LogLocator, MaxNLocator

from symfric.foundation.numeric import Array

SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
STEPS = [1.0, 2.0, 2.5, 5.0, 10.0]
"""Round steps of ticks, up to a power of ten."""
SMALL, LARGE = 1e-2, 1e5
"""Range of magnitudes for which tick labels have no power of ten."""


@final
@dataclass(frozen=True)
class Axis:
    """Axis of a chart.

    Attributes:
        name, unit: name and unit of the quantity; the label is "name [unit]".
        low, high: range, low < high; 0 < low if `logarithmic`.
        logarithmic: True for a logarithmic scale.
        whole: True for ticks at whole numbers only.
    """

    name: str
    unit: str
    low: float
    high: float
    logarithmic: bool = False
    whole: bool = False

    def at(self, values: Array) -> Array:
        """Return the positions of `values` between low (0) and high (1)."""
        if self.logarithmic:
            return np.log(values / self.low) / np.log(self.high / self.low)
        return (values - self.low) / (self.high - self.low)

    @property
    def power(self) -> int:
        """Power of ten, a multiple of 3, by which the tick labels are divided."""
        size = max(abs(self.low), abs(self.high))
        if self.logarithmic or SMALL <= size < LARGE:
            return 0
        return 3 * floor(log10(size) / 3)

    @property
    def label(self) -> str:
        """Name and unit, with the power of ten of the ticks."""
        factor = f"10{str(self.power).translate(SUPERSCRIPTS)}" if self.power else ""
        inside = " ".join(part for part in (factor, self.unit) if part and part != "1")
        return f"{self.name} [{inside}]" if inside else self.name

    def ticks(self, most: int = 6) -> list[tuple[float, str]]:
        """Return round values inside the range and their labels."""
        if self.logarithmic:
            powers = self._inside(LogLocator(numticks=most + 1))
            if len(powers) > 1:
                names = (str(round(log10(x))).translate(SUPERSCRIPTS) for x in powers)
                return [(x, f"10{name}") for x, name in zip(powers, names, strict=True)]
        values = self._inside(MaxNLocator(most, integer=self.whole, steps=STEPS, min_n_ticks=3))
        step = values[1] - values[0] if len(values) > 1 else 1.0
        digits = max(6, ceil(log10(max(abs(self.low), abs(self.high)) / step)) + 1)
        unit = 10.0**self.power
        return [(x, f"{x / unit:.{digits}g}") for x in values]

    def _inside(self, locator: Locator) -> list[float]:
        """Return the values of a locator within the range."""
        values = np.asarray(locator.tick_values(self.low, self.high))
        margin = 1e-9 * (self.high - self.low)
        kept = (values >= self.low - margin) & (values <= self.high + margin)
        return (values[kept] + 0.0).tolist()


MARGIN = 0.05
"""Margin of an axis around its numbers, relative to their range."""


def around(name: str, unit: str, values: Iterable[Array], logarithmic: bool = False) -> Axis:
    """Return an axis that contains all finite numbers in `values`, with a margin."""
    kept = [y[np.isfinite(y) & ((y > 0) | (not logarithmic))] for y in values]
    every = np.concatenate([*kept, np.zeros(0)])
    if not every.size:
        return Axis(name, unit, 0.1 if logarithmic else 0.0, 1.0, logarithmic)
    low, high = float(every.min()), float(every.max())
    if logarithmic:
        share = max(MARGIN * log10(high / low), 0.05)
        return Axis(name, unit, low / 10**share, high * 10**share, True)
    width = high - low
    if not (isfinite(width) and width > 1e-12 * max(abs(low), abs(high))):
        width = abs(high) or 1.0
    return Axis(name, unit, low - MARGIN * width, high + MARGIN * width)


WIDTH = 920.0
"""Width of a chart [px]."""
LEFT, RIGHT, TOP, BOTTOM = 68.0, 14.0, 24.0, 40.0
"""Margins around the frame, for labels [px]."""
LETTER = 6.6
"""Approximate width of a letter of the legend [px]."""


class Frame(NamedTuple):
    """Frame of a chart: its axes and its size [px]."""

    x: Axis
    y: Axis
    width: float
    height: float

    def places(self, x: Array, y: Array) -> Array:
        """Return the pixels (n, 2) of the finite points; far outliers are moved near the frame."""
        across, up = self.x.at(x), self.y.at(y)
        good = np.isfinite(across) & np.isfinite(up)
        across, up = np.clip(across[good], -1.0, 2.0), np.clip(up[good], -1.0, 2.0)
        return np.round(np.column_stack([self.width * across, self.height * (1.0 - up)]), 1)


@dataclass(frozen=True, eq=False)
class Mark(ABC):
    """Mark in a chart; `kind` is its class in the style sheet."""

    kind: str

    @abstractmethod
    def draw(self, frame: Frame) -> str:
        """Return the SVG of the mark inside a frame."""


@dataclass(frozen=True, eq=False)
class ChartPoints(Mark):
    """Points (x, y); `entry` is their name in the legend."""

    x: Array
    y: Array
    entry: str = ""


@final
class Polyline(ChartPoints):
    """Line through points."""

    def draw(self, frame: Frame) -> str:
        """Return a polyline for each sequence of finite points, without repeated points."""
        bad, text = np.flatnonzero(~np.isfinite(self.y)), ""
        for x, y in zip(np.split(self.x, bad), np.split(self.y, bad), strict=True):
            at = frame.places(x, y)
            if len(at):
                kept = np.concatenate([[True], (np.diff(at, axis=0) != 0).any(axis=1)])
                points = " ".join(f"{a:g},{b:g}" for a, b in at[kept])
                text += f'<polyline class="{self.kind}" points="{points}"/>'
        return text


@final
class Dots(ChartPoints):
    """Points, drawn as short strokes with round ends."""

    def draw(self, frame: Frame) -> str:
        """Return one path with all points."""
        at = np.unique(frame.places(self.x, self.y), axis=0)
        points = "".join(f"M{a:g} {b:g}h0" for a, b in at)
        return f'<path class="dots {self.kind}" d="{points}"/>' if points else ""


@final
class Stems(ChartPoints):
    """Vertical lines from zero."""

    def draw(self, frame: Frame) -> str:
        """Return one path with the lines of all finite points."""
        zero, ends = (frame.places(self.x, y) for y in (0.0 * self.y, self.y))
        stems = "".join(f"M{a:g} {b:g}V{c:g}" for (a, b), (_, c) in zip(zero, ends, strict=True))
        return f'<path class="{self.kind}" d="{stems}"/>'


@final
@dataclass(frozen=True, eq=False)
class Level(Mark):
    """Horizontal line at y = value, or, with `upright`, vertical line at x = value."""

    value: float
    upright: bool = False

    def draw(self, frame: Frame) -> str:
        """Return one line; "" if the value is outside the axis."""
        share = float((frame.x if self.upright else frame.y).at(np.array([self.value]))[0])
        line = f"M0 {frame.height * (1 - share):.1f}H{frame.width:g}"
        if self.upright:
            line = f"M{frame.width * share:.1f} 0V{frame.height:g}"
        return f'<path class="{self.kind}" d="{line}"/>' if 0.0 <= share <= 1.0 else ""


@final
@dataclass(frozen=True, eq=False)
class Band(Mark):
    """Horizontal band between two values of y."""

    low: float
    high: float

    def draw(self, frame: Frame) -> str:
        """Return a rectangle across the frame."""
        low, high = np.clip(frame.y.at(np.array([self.low, self.high])), 0.0, 1.0)
        top = frame.height * (1 - high)
        size = f'width="{frame.width:g}" height="{frame.height * (high - low):.1f}"'
        return f'<rect class="{self.kind}" x="0" y="{top:.1f}" {size}/>'


def chart(
    title: str,
    x: Axis,
    y: Axis,
    marks: Sequence[Mark],
    height: float = 230.0,
    says: str = "",
) -> str:
    """Return one chart.

    Args:
        title: text above the chart, also for screen readers.
        x, y: axes.
        marks: marks from back to front.
        height: height of the whole chart [px], which the page scales.
        says: description for screen readers.
    """
    w, h = WIDTH - LEFT - RIGHT, height - TOP - BOTTOM
    inside = "".join(mark.draw(Frame(x, y, w, h)) for mark in marks)
    return (
        f'<svg class="chart" role="img" viewBox="0 0 {WIDTH:g} {height:g}">'
        f"<title>{escape(title)}</title><desc>{escape(says or title)}</desc>"
        f'<text class="title" x="{LEFT:g}" y="15">{escape(title)}</text>'
        f"{_legend(marks)}"
        f"{_ticks(x, y, w, h)}"
        f'<svg x="{LEFT:g}" y="{TOP:g}" width="{w:g}" height="{h:g}">{inside}</svg>'
        f'<rect class="frame" x="{LEFT:g}" y="{TOP:g}" width="{w:g}" height="{h:g}"/>'
        "</svg>"
    )


def _ticks(x: Axis, y: Axis, w: float, h: float) -> str:
    """Return grid, tick labels and axis labels."""
    text: list[str] = []
    for value, label in x.ticks(max(3, int(w // 90))):
        at = LEFT + w * float(x.at(np.array([value]))[0])
        text.append(f'<path class="grid" d="M{at:.1f} {TOP:g}v{h:g}"/>')
        text.append(f'<text class="tick" x="{at:.1f}" y="{TOP + h + 14:g}">{label}</text>')
    for value, label in y.ticks(max(3, int(h // 34))):
        at = TOP + h * (1 - float(y.at(np.array([value]))[0]))
        text.append(f'<path class="grid" d="M{LEFT:g} {at:.1f}h{w:g}"/>')
        text.append(f'<text class="tick y" x="{LEFT - 6:g}" y="{at + 4:.1f}">{label}</text>')
    middle = f'x="{-(TOP + h / 2):.1f}" y="13" transform="rotate(-90)"'
    text.append(f'<text class="label" {middle}>{escape(y.label)}</text>')
    place = f'x="{LEFT + w / 2:.1f}" y="{TOP + h + 32:g}"'
    text.append(f'<text class="label" {place}>{escape(x.label)}</text>')
    return "".join(text)


def _legend(marks: Sequence[Mark]) -> str:
    """Return the entries of the legend, at the right of the line of the title."""
    text: list[str] = []
    at = WIDTH - RIGHT
    for mark in reversed([m for m in marks if isinstance(m, ChartPoints) and m.entry]):
        at -= LETTER * len(mark.entry)
        text.append(f'<text class="entry" x="{at:.1f}" y="15">{escape(mark.entry)}</text>')
        at -= 20
        line = isinstance(mark, Polyline)
        dots, sample = ("", f"M{at:.1f} 11h14") if line else ("dots ", f"M{at + 7:.1f} 11h0")
        text.append(f'<path class="{dots}sample {mark.kind}" d="{sample}"/>')
        at -= 12
    return "".join(text)
