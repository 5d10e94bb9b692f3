"""Profile likelihood: increase of the cost when one value is held and the other values adapt.

    rise(c) = min over the others of  [cost(value = c) - cost at the minimum] / (s^2 kappa)

s^2 is the variance of the weighted residuals. kappa is the factor by which their autocorrelation
widens the linear interval. The interval in which rise <= t^2 (Student's t, 95 %) agrees with that
of `Covariance` if the model is linear, and is also valid if it is not. Noise levels are those of
the fit. The value moves away from its minimum to both sides; each point starts at the previous one.
Sources: Bates and Watts, Nonlinear Regression Analysis, 1988, chapter 6; Raue et al.,
Bioinformatics 25(15), 2009.
"""

from contextlib import suppress
from dataclasses import dataclass
from importlib import import_module
from math import ceil, inf, isfinite, log10
from pathlib import Path
from typing import TYPE_CHECKING, Any, final

import numpy as np

from identification.residuals.evaluation import Array
from identification.solving.task import Point, Task
from identification.verdict.covariance import Covariance
from symfric.foundation import checks
from symfric.foundation.shown import brief, spaced

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FARTHEST = 12
"""Largest number of additional steps to each side."""
FLAT = 0.02
"""Rise relative to the limit below which a profile is flat."""
BLIND = 0.1
"""First step relative to the value, if there is no linear standard error."""
REFINED, NEAR = 5, 2.0
"""Largest number of stations inserted at the limit, and rise relative to it that needs none."""
EVALUATIONS = 30
"""Largest number of residual evaluations at one point."""


@final
@dataclass(frozen=True, eq=False)
class Profile:
    """Profile of one value.

    Attributes:
        name, unit: name and unit of the value.
        best: value of the fit.
        values: values in increasing order, including `best`, shape (n,).
        rise: increase of the cost in variances, shape (n,).
        others: all values at each point, shape (n, k).
        names: names of the columns of `others`.
        limit: rise at the ends of the 95 % interval.
        low, high: 95 % interval; None if the limit was not reached.
        logarithmic: True if steps are taken in the logarithm.
        sentences: messages for the user: open or flat sides, a better minimum.
    """

    name: str
    unit: str
    best: float
    values: Array
    rise: Array
    others: Array
    names: tuple[str, ...]
    limit: float
    low: float | None
    high: float | None
    logarithmic: bool
    sentences: tuple[str, ...]

    __repr__ = brief

    def __str__(self) -> str:
        ends = [end for end in (self.low, self.high) if end not in (None, self.best)]
        width = min((abs(end - self.best) for end in ends), default=0.0)
        digits = ceil(log10(abs(self.best) / width)) + 3 if width and self.best else 4
        best, *sides = (
            "open" if x is None else f"{x:.{min(max(digits, 4), 12)}g}"
            for x in (self.best, self.low, self.high)
        )
        unit = spaced(self.unit)
        text = f"{self.name}: {best}{unit}, 95 %: {' to '.join(sides)}."
        return " ".join([text, *self.sentences])

    def to_dict(self) -> dict[str, Any]:
        """Return all fields as plain data for JSON."""
        arrays = {n: getattr(self, n).tolist() for n in ("values", "rise", "others")}
        return self.__dict__ | arrays | {n: list(getattr(self, n)) for n in ("names", "sentences")}

    def plot(self, path: str | Path | None = None) -> "Figure":
        """Plot the rise over the value with the 95 % limit.

        Args:
            path: image file to write.
        """
        from symfric.foundation.panels import panels, save  # noqa: PLC0415 (Matplotlib is slow)
        from symfric.foundation.style import colour  # noqa: PLC0415

        figure, (axis,) = panels(1, width=5.5, height=3.2)
        axis.plot(self.values, self.rise, "o-", ms=4, lw=1.3, label="profile")
        axis.axhline(self.limit, color=colour(1), lw=1, ls="--", label="95 % limit")
        axis.plot([self.best], [0.0], "k|", ms=14, label="fit")
        for end in (self.low, self.high):
            if end is not None:
                axis.axvline(end, color=colour(1), lw=0.8, ls=":")
        if self.logarithmic and self.values.max() > 5 * self.values.min():
            axis.set_xscale("log")
        top = max(1.6 * self.limit, 0.0)
        axis.set_ylim(min(float(self.rise.min()), 0.0) - 0.05 * top, top)
        axis.set_xlabel(f"{self.name} [{self.unit}]")
        axis.set_ylabel("rise of the cost, in variances")
        axis.set_title("\n".join(self.sentences), fontsize="small", wrap=True)
        axis.legend(fontsize="small")
        return save(figure, path)


def profile(
    task: Task, point: Point, covariance: Covariance, name: str, points: int = 5
) -> Profile:
    """Move one value away from its minimum until the rise of the cost reaches the 95 % limit.

    Args:
        task, point: solved task and its minimum.
        covariance: linear intervals, which determine steps and limit.
        name: name of the value.
        points: approximate number of points to each side.

    Raises:
        ValueError: an unknown name, or a value that was not fitted.
    """
    checks.choice("profile: name", name, task.unknowns.fitted)
    points = checks.count("profile: points", points, least=2)
    walk = Walk(task, point, covariance, name)
    (down, low, below), (up, high, above) = (walk.side(side, points) for side in (-1, 1))
    stations = [*down[::-1], (walk.best, 0.0, point.values), *up]
    values, rise, others = (np.array(column) for column in zip(*stations, strict=True))
    messages = [message for message in (below, above) if message]
    if rise.min() < -FLAT * walk.limit:
        better = float(values[np.argmin(rise)])
        messages.append(f"The cost is lower at {name} = {better:.4g}: the fit is not a minimum.")
    return Profile(
        name, walk.unknown.unit, walk.best, values, rise, others, task.unknowns.names,
        walk.limit, low, high, walk.logarithmic, tuple(messages),
    )  # fmt: skip


Station = tuple[float, float, Array]
"""Value, rise, and all values at a point of a profile."""


class Walk:
    """Computation of a profile, step by step away from the minimum."""

    def __init__(self, task: Task, point: Point, covariance: Covariance, name: str) -> None:
        from scipy.special import stdtrit  # noqa: PLC0415  (slow to import)

        box = task.unknowns
        self.task, self.point, self.name = task, point, name
        self.index, self.own = box.names.index(name), box.fitted.index(name)
        self.unknown, self.best = box.unknowns[self.own], float(point.values[self.index])
        self.logarithmic = self.unknown.logarithmic and self.best > 0
        error, white = (
            part[self.index] for part in (covariance.standard_errors, covariance.white_errors)
        )
        colour = float((error / white) ** 2) if white > 0 and isfinite(error) else 1.0
        t = float(stdtrit(covariance.freedom[self.index], 0.975)) if isfinite(error) else 1.96
        size = abs(self.best) or self.unknown.scale
        step = float(t * error) if isfinite(error) and error > 0 else BLIND * size
        self.step = min(step / self.best, 1.0) if self.logarithmic else step
        freedom = max(point.r.size - box.lower.size, 1)
        self.scale = max((point.cost - point.excess) / freedom, 1e-300) * colour
        self.limit = t**2

    def far(self, decades: float) -> list[float]:
        """Return values near the ends of the range, none where a linear value is unbounded.

        Args:
            decades: distance of the ends of an unbounded logarithmic value.
        """
        known = (self.unknown.lower, self.unknown.upper)
        if not self.logarithmic:
            return [0.999 * end + 0.001 * self.best for end in known if isfinite(end)]
        far = self.best * 10.0**-decades, self.best * 10.0**decades
        return [max(far[0], 1.001 * known[0]), min(far[1], 0.999 * known[1])]

    def side(self, direction: int, points: int) -> tuple[list[Station], float | None, str]:
        """Return the stations of one side, nearest first; the value at the limit; or a message."""
        stations, w = list[Station](), self.point.w
        distance, step, why = 0.0, self.step / (points - 1), "the end of the search"
        for count in range(FARTHEST + points):
            distance += step
            away = direction * distance
            c = self.best * float(np.exp(away)) if self.logarithmic else self.best + away
            if not self.unknown.lower <= c <= self.unknown.upper:
                why = "its bound"
                break
            try:
                found = self.held_at(w, c)
            except KeyboardInterrupt:
                why = "an interruption"
                break
            if isinstance(found, str):
                why = f"a value without a fit ({found})"
                break
            w, rise = found.w, (found.cost - self.point.cost) / self.scale
            stations.append((c, rise, found.values))
            if rise >= self.limit:
                return stations, self.refined(stations, direction), ""
            if count >= points:  # the linear interval was too short
                step *= 1.6
        where = "below" if direction < 0 else "above"
        if not stations:
            return stations, None, f"{self.name} is open {where}: it reaches {why} at once."
        value, rise, _ = stations[-1]
        how = "flat" if rise < FLAT * self.limit else "open"
        share = f"the rise is {100 * max(rise, 0.0) / self.limit:.0f} % of the limit"
        return stations, None, f"{self.name} is {how} {where}: at {value:.4g}, near {why}, {share}."

    def refined(self, stations: list[Station], direction: int) -> float:
        """Return the value at the limit; insert stations between the last two until they are near.

        Interpolation from a rise far above the limit would be inaccurate.
        """
        inner, outer = [(self.best, 0.0, self.point.values), *stations][-2:]
        for _ in range(REFINED):
            c = self.crossing([inner, outer])
            found = self.held_at(self.point.w, c)
            if outer[1] < NEAR * self.limit or isinstance(found, str):
                break
            between = c, (found.cost - self.point.cost) / self.scale, found.values
            stations.append(between)
            inner, outer = (inner, between) if between[1] >= self.limit else (between, outer)
        stations.sort(key=lambda station: direction * station[0])
        return self.crossing([inner, outer])

    def crossing(self, stations: list[Station]) -> float:
        """Return the value at the limit by interpolation of the square root of the rise."""
        (last, before, _), (value, rise, _) = stations
        a, b = (float(np.sqrt(max(x, 0.0))) for x in (before, rise))
        share = (float(np.sqrt(self.limit)) - a) / max(b - a, 1e-300)
        if self.logarithmic:
            return float(last * (value / last) ** share)
        return last + share * (value - last)

    def held_at(self, w: Array, c: float) -> Point | str:
        """Minimise over the other values with the value held at c; return a message on failure.

        The search starts at `w`. The coordinate of the value is eliminated: w_own solves
        value(w) = c. The derivatives become J_j - J_own (dvalue/dw_j) / (dvalue/dw_own).
        """
        optimize: Any = import_module("scipy.optimize")  # slow to import
        box, own = self.task.unknowns, self.own
        others = np.arange(w.size) != own
        best: list[Point] = []
        why = ""

        def at(rest: Array) -> Point | None:
            nonlocal why
            whole = w.copy()
            whole[others] = rest
            there = self.solved(whole, c)
            found = f"{box.fitted[own]} = {c:.4g} is outside its order or its bounds"
            if there is not None:
                found = self.task.at(there)
            if isinstance(found, str):
                why = found
                return None
            if not best or found.cost < best[0].cost:
                best[:] = [found]
            return found

        def residuals(rest: Array) -> Array:
            found = at(rest)
            return np.full(len(box.names) + 1, inf) if found is None else found.reduced[0]

        def slopes(rest: Array) -> Array:
            found = at(rest)
            if found is None:
                raise ArithmeticError(why)
            J, slope = found.reduced[1], found.slope[self.index]
            reduced = J[:, others] - J[:, [own]] * (slope[others] / slope[own])
            if not np.isfinite(reduced).all():
                raise ArithmeticError(why)
            return reduced

        low, high = box.lower[others], box.upper[others]
        start = np.clip(w[others], low, high)
        if at(start) is not None and others.any():
            with suppress(ArithmeticError, ValueError), np.errstate(all="ignore"):  # overflow
                optimize.least_squares(
                    residuals, start, slopes, bounds=(low, high), x_scale="jac",
                    ftol=1e-7, xtol=1e-7, gtol=1e-12, max_nfev=EVALUATIONS,
                )  # fmt: skip
        return best[0] if best else why

    def solved(self, near: Array, c: float) -> Array | None:
        """Return `near` with its coordinate solved for the value c; None if outside its bounds."""
        box, own, w = self.task.unknowns, self.own, near.copy()
        for _ in range(30):
            miss = c - float(box.values(w)[self.index])
            if abs(miss) <= 1e-10 * max(abs(c), 1e-300):
                break
            slope = float(box.slope(w)[self.index, own])
            if not abs(slope) > 0.0:
                return None
            w[own] += max(-1e3, min(1e3, miss / slope))
        return w if box.lower[own] <= w[own] <= box.upper[own] else None
