"""Charts as SVG text: colours come from the style of the page, so that they follow light and dark.

Every chart has a title and a description for those who do not see it. Whatever is drawn is cut at
the frame. Coordinates are rounded to a tenth of a pixel and points that fall together are left out.
"""

from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from html import escape
from typing import final

import numpy as np
from numpy.typing import NDArray

from symfric.page.scale import Axis

Array = NDArray[np.float64]

LEFT, RIGHT, TOP, BOTTOM = 68.0, 14.0, 24.0, 40.0
"""Room beside the frame for labels [px]."""
LETTER = 6.6
"""Width of a letter of the legend [px], about."""


@dataclass(frozen=True, eq=False)
class Mark(ABC):
    """Something drawn in a chart; `kind` is the class that the style sheet colours."""

    kind: str

    @abstractmethod
    def draw(self, x: Axis, y: Axis, width: float, height: float) -> str:
        """Its SVG inside a frame of this size [px]."""

    @property
    def name(self) -> str:
        """Entry in the legend; "" for none."""
        return ""


def _places(
    x: Axis, y: Axis, width: float, height: float, xs: Array, ys: Array
) -> NDArray[np.float64]:
    """Pixels (n, 2) of the finite points, far outliers held near the frame."""
    across, up = x.at(xs), y.at(ys)
    good = np.isfinite(across) & np.isfinite(up)
    across, up = np.clip(across[good], -1.0, 2.0), np.clip(up[good], -1.0, 2.0)
    return np.round(np.column_stack([width * across, height * (1.0 - up)]), 1)


@dataclass(frozen=True, eq=False)
class Named(Mark):
    """Points that have an entry in the legend."""

    x: Array
    y: Array
    entry: str = ""

    @property
    def name(self) -> str:
        """Entry in the legend."""
        return self.entry


@final
@dataclass(frozen=True, eq=False)
class Path(Named):
    """A line through points."""

    def draw(self, x: Axis, y: Axis, width: float, height: float) -> str:
        """A polyline for each run of finite points."""
        bad = np.flatnonzero(~np.isfinite(self.y))
        runs = [_places(x, y, width, height, *run) for run in self._runs(bad)]
        return "".join(f'<polyline class="{self.kind}" points="{_points(at)}"/>' for at in runs)

    def _runs(self, bad: NDArray[np.intp]) -> Iterator[tuple[Array, Array]]:
        for xs, ys in zip(np.split(self.x, bad), np.split(self.y, bad), strict=True):
            if np.isfinite(ys).any():
                yield xs, ys


def _points(at: Array) -> str:
    """Points of a polyline, those that fall together once."""
    kept = np.concatenate([[True], (np.diff(at, axis=0) != 0).any(axis=1)])
    return " ".join(f"{a:g},{b:g}" for a, b in at[kept])


@final
@dataclass(frozen=True, eq=False)
class Dots(Named):
    """Points, each a short stroke with round ends: small in the file."""

    def draw(self, x: Axis, y: Axis, width: float, height: float) -> str:
        """One path of all points."""
        at = np.unique(_places(x, y, width, height, self.x, self.y), axis=0)
        points = "".join(f"M{a:g} {b:g}h0" for a, b in at)
        return f'<path class="dots {self.kind}" d="{points}"/>' if points else ""


@final
@dataclass(frozen=True, eq=False)
class Stems(Mark):
    """Upright lines from zero."""

    x: Array
    y: Array

    def draw(self, x: Axis, y: Axis, width: float, height: float) -> str:
        """One path of all lines."""
        zero = _places(x, y, width, height, self.x, np.zeros(self.x.size))
        ends = _places(x, y, width, height, self.x, self.y)
        stems = "".join(f"M{a:g} {b:g}V{c:g}" for (a, b), (_, c) in zip(zero, ends, strict=True))
        return f'<path class="{self.kind}" d="{stems}"/>'


@final
@dataclass(frozen=True, eq=False)
class Level(Mark):
    """A line across, at y; upright, at x, with `upright`."""

    value: float
    upright: bool = False

    def draw(self, x: Axis, y: Axis, width: float, height: float) -> str:
        """One line."""
        along = x if self.upright else y
        share = float(along.at(np.array([self.value]))[0])
        if not 0.0 <= share <= 1.0:
            return ""
        if self.upright:
            return f'<path class="{self.kind}" d="M{width * share:.1f} 0V{height:g}"/>'
        return f'<path class="{self.kind}" d="M0 {height * (1 - share):.1f}H{width:g}"/>'


@final
@dataclass(frozen=True, eq=False)
class Band(Mark):
    """The area between two heights."""

    low: float
    high: float

    def draw(self, x: Axis, y: Axis, width: float, height: float) -> str:
        """A rectangle across the frame."""
        low, high = np.clip(y.at(np.array([self.low, self.high])), 0.0, 1.0)
        top = height * (1 - high)
        size = f'width="{width:g}" height="{height * (high - low):.1f}"'
        return f'<rect class="{self.kind}" x="0" y="{top:.1f}" {size}/>'


def chart(
    title: str,
    x: Axis,
    y: Axis,
    marks: Sequence[Mark],
    width: float = 920.0,
    height: float = 230.0,
    says: str = "",
) -> str:
    """One chart.

    Args:
        title: written above it, and read aloud.
        x, y: its axes.
        marks: what is drawn, from the back to the front.
        width, height: of everything [px]; the page scales it.
        says: description that is read aloud.
    """
    w, h = width - LEFT - RIGHT, height - TOP - BOTTOM
    inside = "".join(mark.draw(x, y, w, h) for mark in marks)
    return (
        f'<svg class="chart" role="img" viewBox="0 0 {width:g} {height:g}">'
        f"<title>{escape(title)}</title><desc>{escape(says or title)}</desc>"
        f'<text class="title" x="{LEFT:g}" y="15">{escape(title)}</text>'
        f"{_legend(marks, width)}"
        f"{_ticks(x, y, w, h)}"
        f'<svg x="{LEFT:g}" y="{TOP:g}" width="{w:g}" height="{h:g}">{inside}</svg>'
        f'<rect class="frame" x="{LEFT:g}" y="{TOP:g}" width="{w:g}" height="{h:g}"/>'
        "</svg>"
    )


def _ticks(x: Axis, y: Axis, w: float, h: float) -> str:
    """Grid, numbers and labels."""
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


def _legend(marks: Sequence[Mark], width: float) -> str:
    """Entries at the right of the title."""
    text: list[str] = []
    at = width - RIGHT
    for mark in reversed([mark for mark in marks if mark.name]):
        at -= LETTER * len(mark.name)
        text.append(f'<text class="entry" x="{at:.1f}" y="15">{escape(mark.name)}</text>')
        at -= 20
        sample = f"M{at:.1f} 11h14" if isinstance(mark, Path) else f"M{at + 7:.1f} 11h0"
        dots = "" if isinstance(mark, Path) else "dots "
        text.append(f'<path class="{dots}sample {mark.kind}" d="{sample}"/>')
        at -= 12
    return "".join(text)
