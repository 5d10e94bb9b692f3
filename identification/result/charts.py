"""The charts of a page: data and fit, what is left, its correlation, friction, starts."""

from math import isfinite
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from identification.result.curve import Curve
from identification.result.picture import limits
from identification.result.series import Series
from identification.result.text import SAME, number
from symfric.page.scale import Axis, around
from symfric.page.svg import Band, Dots, Level, Mark, Path, Stems, chart

if TYPE_CHECKING:
    from identification.result.fitted import Fitted

Array = NDArray[np.float64]

WINDOWS = 60
"""Beginnings of windows that are drawn."""
FLOOR = 1e-3
"""Smallest difference that the waterfall shows."""


def _across(one: Series) -> Axis:
    name, _, unit = one.abscissa.rstrip("]").partition(" [")
    low, high = float(one.residual.t.min()), float(one.residual.t.max())
    if low < high and one.ordered:
        return Axis(name, unit, low, high)
    return around(name, unit, [one.residual.t])


def _windows(one: Series) -> list[Mark]:
    """Where windows begin; of many none, they would be a hatching."""
    if one.breaks.size > WINDOWS:
        return []
    return [Level("window", float(t), upright=True) for t in one.breaks]


def data_and_fit(one: Series) -> str:
    """Measured and fitted signal."""
    shape = Path if one.ordered else Dots
    y = around(one.signal, one.unit, [one.measured.y, one.predicted.y])
    marks = [
        *_windows(one),
        shape("measured", one.measured.t, one.measured.y, "measured"),
        shape("predicted", one.predicted.t, one.predicted.y, "fitted"),
    ]
    says = f"{one.signal} of {one.record} over {one.abscissa}, measured and fitted"
    return chart(f"{one.record}: {one.signal}", _across(one), y, marks, says=says)


def left(one: Series) -> str:
    """Residuals."""
    shape = Path if one.ordered else Dots
    y = around("difference", one.unit, [one.residual.y, np.zeros(1)])
    marks = [
        *_windows(one),
        Level("zero", 0.0),
        shape("residual", one.residual.t, one.residual.y),
    ]
    size = float(np.abs(one.residual.y).max(initial=0.0))
    says = f"fitted minus measured {one.signal}, at most {number(size, 3)} {one.unit}"
    title = f"{one.record}: what is left of {one.signal}"
    return chart(title, _across(one), y, marks, height=170.0, says=says)


def lags(one: Series) -> str:
    """Autocorrelation of the residuals with the limits of white ones; "" without order."""
    if not one.correlation.size:
        return ""
    x = Axis("lag", "samples", 0.0, float(one.lags.max()) + 0.5, whole=True)
    y = around("autocorrelation", "", [one.correlation, one.low, one.high, np.array([0.0, 1.0])])
    marks = [
        Band("band", float(np.min(one.low)), float(np.max(one.high))),
        Level("zero", 0.0),
        Stems("residual", one.lags, one.correlation),
        Dots("residual", one.lags, one.correlation),
    ]
    outside = int(((one.correlation > one.high) | (one.correlation < one.low)).sum())
    says = f"{outside} of {one.lags.size} autocorrelations lie outside the limits of white noise"
    title = f"{one.record}: autocorrelation of what is left of {one.signal}"
    return chart(title, x, y, marks, height=190.0, says=says)


def friction(curve: Curve, name: str) -> str:
    """Friction over velocity: dots of the data, line of the law."""
    dots = [Dots("measured", line.t, line.y) for line in curve.measured.values()]
    low, high = limits(curve)
    x = around("v", curve.v_unit, [curve.law.t, *(line.t for line in curve.measured.values())])
    marks: list[Mark] = [
        *dots,
        Path("law", curve.law.t, curve.law.y, name),
        Dots("measured", np.zeros(0), np.zeros(0), curve.says),
    ]
    says = f"friction of {name} over velocity, {float(curve.law.y.min()):.4g} to "
    says += f"{float(curve.law.y.max()):.4g} {curve.F_unit}"
    y = Axis("friction", curve.F_unit, low, high)
    return chart("Friction over velocity", x, y, marks, height=300.0, says=says)


def waterfall(fit: "Fitted") -> str:
    """How far the starts ended from the best one; "" for a single start."""
    above = np.sort([s.above for s in fit.starts if isfinite(s.above)])
    if above.size < 2:
        return ""
    same = above < SAME
    shown = np.maximum(above, FLOOR)
    numbers = np.arange(1.0, above.size + 1)
    x = Axis("start, best first", "", 0.5, above.size + 0.5, whole=True)
    name = "-2 ln L above the best"
    y = around(name, "", [shown, np.array([FLOOR, 10.0])], logarithmic=True)
    marks: list[Mark] = [
        Level("bound", SAME),
        Path("zero", numbers, shown),
        Dots("good", numbers[same], shown[same], "the same minimum"),
        Dots("bad", numbers[~same], shown[~same], "another minimum, or none"),
    ]
    says = f"{int(same.sum())} of {len(fit.starts)} starts ended at the best minimum"
    return chart("Waterfall of the starts", x, y, marks, height=210.0, says=says)
