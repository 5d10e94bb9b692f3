"""Profile likelihood: increase of the cost when one value is held elsewhere and the others adapt.

    rise(c) = min over the others of  [cost(value = c) - cost at the minimum] / (s^2 kappa)

s^2 is the variance of the weighted residuals and kappa the factor by which their autocorrelation
widens the linear interval. The interval in which rise <= t^2 (Student's t, 95 %) agrees with that
of `Covariance` if the model is linear, and also holds if it is not. Noise levels stay those of the
fit. The value moves away from its minimum to both sides; each point starts from the previous one.
Sources: Bates and Watts, Nonlinear Regression Analysis, 1988, chapter 6; Raue et al.,
Bioinformatics 25(15), 2009.
"""

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
from symfric.foundation.shown import brief

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FARTHEST = 12
"""Largest number of additional steps to one side."""
FLAT = 0.02
"""Share of the limit below which a profile counts as flat."""
BLIND = 0.1
"""First step, over the value, without a linear standard error."""
EVALUATIONS = 30
"""Largest number of residual evaluations for one point."""


@final
@dataclass(frozen=True, eq=False)
class Profile:
    """The profile of one value.

    Attributes:
        name, unit: of the value.
        best: the value of the fit.
        values: in increasing order, `best` among them, shape (n,).
        rise: increase of the cost in variances, shape (n,).
        others: all values at each point, shape (n, k).
        names: of the columns of `others`.
        limit: of the rise, at the ends of the 95 % interval.
        low, high: 95 % interval; None if the limit was not reached.
        logarithmic: whether steps are taken in the logarithm.
        sentences: messages for the reader: open or flat sides, a better minimum.
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
        ends = [e for e in (self.low, self.high) if e is not None]
        near = [abs(e - self.best) for e in ends if e != self.best]
        width = min(near, default=0.0)
        digits = ceil(log10(abs(self.best) / width)) + 3 if width and self.best else 4
        best, *sides = (
            "open" if x is None else f"{x:.{min(max(digits, 4), 12)}g}"
            for x in (self.best, self.low, self.high)
        )
        unit = "" if self.unit in ("", "1") else f" {self.unit}"
        text = f"{self.name}: {best}{unit}, 95 %: {' to '.join(sides)}."
        return " ".join([text, *self.sentences])

    def to_dict(self) -> dict[str, Any]:
        """Return all fields as plain data, ready for JSON."""
        arrays = {n: getattr(self, n).tolist() for n in ("values", "rise", "others")}
        return self.__dict__ | arrays | {n: list(getattr(self, n)) for n in ("names", "sentences")}

    def plot(self, path: str | Path | None = None) -> "Figure":
        """Plot the rise over the value, with the 95 % limit.

        Args:
            path: image file.
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
    """Move one value away from its minimum until the fit is worse than the 95 % limit.

    Args:
        task, point: the solved task and its minimum.
        covariance: its linear intervals; they give steps and the limit.
        name: of the value.
        points: approximate number of points to each side.

    Raises:
        ValueError: an unknown name, or a value that was not fitted.
    """
    checks.choice("profile: name", name, task.unknowns.fitted)
    points = checks.count("profile: points", points, least=2)
    walk = _Walk.of(task, point, covariance, name)
    down, up = (walk.side(direction, points) for direction in (-1, 1))
    stations = [*down.stations[::-1], (walk.best, 0.0, point.values), *up.stations]
    values = np.array([s[0] for s in stations])
    rise = np.array([s[1] for s in stations])
    low, high = (_crossing(walk, side.stations) for side in (down, up))
    messages = [*_open_side(walk, down, low, "below"), *_open_side(walk, up, high, "above")]
    if rise.min() < -FLAT * walk.limit:
        better = float(values[np.argmin(rise)])
        messages.append(f"The cost is lower at {name} = {better:.4g}: the fit is not a minimum.")
    return Profile(
        name=name,
        unit=walk.unit,
        best=walk.best,
        values=values,
        rise=rise,
        others=np.array([s[2] for s in stations]),
        names=task.unknowns.names,
        limit=walk.limit,
        low=low,
        high=high,
        logarithmic=walk.logarithmic,
        sentences=tuple(messages),
    )


Station = tuple[float, float, Array]
"""Value, rise, all values."""


@final
@dataclass(frozen=True, eq=False)
class _Side:
    stations: list[Station]
    why: str


@final
@dataclass(frozen=True, eq=False)
class _Walk:
    """Quantities that stay the same along a profile."""

    task: Task
    point: Point
    name: str
    unit: str
    index: int
    own: int
    best: float
    step: float
    scale: float
    limit: float
    logarithmic: bool

    @staticmethod
    def of(task: Task, point: Point, covariance: Covariance, name: str) -> "_Walk":
        from scipy.special import stdtrit  # noqa: PLC0415  (SciPy is loaded by those who fit)

        index, own = task.unknowns.names.index(name), task.unknowns.fitted.index(name)
        unknown, best = task.unknowns.unknowns[own], float(point.values[index])
        logarithmic = unknown.logarithmic and best > 0
        error, white = covariance.standard_errors[index], covariance.white_errors[index]
        colour = float((error / white) ** 2) if white > 0 and isfinite(error) else 1.0
        t = float(stdtrit(covariance.freedom[index], 0.975)) if isfinite(error) else 1.96
        size = abs(best) or unknown.scale
        step = float(t * error) if isfinite(error) and error > 0 else BLIND * size
        step = min(step / best, 1.0) if logarithmic else step
        rows, n = point.r.size, task.unknowns.lower.size
        variance = max(point.cost / max(rows - n, 1), 1e-300)
        return _Walk(
            task=task,
            point=point,
            name=name,
            unit=unknown.unit,
            index=index,
            own=own,
            best=best,
            step=step,
            scale=variance * colour,
            limit=t**2,
            logarithmic=logarithmic,
        )

    def at(self, distance: float) -> float:
        """Return the value at a distance from the minimum."""
        return self.best * float(np.exp(distance)) if self.logarithmic else self.best + distance

    def side(self, direction: int, points: int) -> _Side:
        """Return the stations on one side, nearest first, up to the limit or the search's end."""
        stations, w = list[Station](), self.point.w
        distance, step = 0.0, self.step / (points - 1)
        unknown = self.task.unknowns.unknowns[self.own]
        for count in range(FARTHEST + points):
            distance += step
            c = self.at(direction * distance)
            if not unknown.lower <= c <= unknown.upper:
                return _Side(stations, "its bound")
            try:
                found = held_at(self.task, w, self.index, self.own, c)
            except KeyboardInterrupt:
                return _Side(stations, "an interruption")
            if isinstance(found, str):
                return _Side(stations, f"a value without a fit ({found})")
            w = found.w
            rise = (found.cost - self.point.cost) / self.scale
            stations.append((c, rise, found.values))
            if rise >= self.limit:
                return _Side(stations, "")
            if count >= points:  # the linear theory was too short: increase the step
                step *= 1.6
        return _Side(stations, "the end of the search")


def held_at(task: Task, w: Array, index: int, own: int, c: float) -> Point | str:
    """Minimise over the others with value `index` held at c, from `w`; a reason if impossible.

    The coordinate of the value is eliminated: w_own solves value(w) = c. The derivatives become
    J_j - J_own (dvalue/dw_j) / (dvalue/dw_own).
    """
    optimize: Any = import_module("scipy.optimize")  # slow to import, and seldom needed
    box, others = task.unknowns, np.arange(w.size) != own
    best: list[Point] = []
    why = [""]

    def at(rest: Array) -> Point | None:
        whole = w.copy()
        whole[others] = rest
        there = _solved(task, whole, index, own, c)
        if there is None:
            why[0] = f"{box.fitted[own]} = {c:.4g} is outside its order or its bounds"
            return None
        found = task.at(there)
        if isinstance(found, str):
            why[0] = found
            return None
        if not best or found.cost < best[0].cost:
            best[:] = [found]
        return found

    def residuals(rest: Array) -> Array:
        found = at(rest)
        if found is None:
            return np.full(len(box.names) + 1, inf)
        return found.reduced[0]

    def slopes(rest: Array) -> Array:
        found = at(rest)
        if found is None:
            raise ArithmeticError(why[0])
        J, slope = found.reduced[1], found.slope[index]
        return J[:, others] - J[:, [own]] * (slope[others] / slope[own])

    start = np.clip(w[others], box.lower[others], box.upper[others])
    if not others.any() or at(start) is None:
        at(start)
        return best[0] if best else why[0]
    optimize.least_squares(
        residuals, start, slopes, bounds=(box.lower[others], box.upper[others]), x_scale="jac",
        ftol=1e-7, xtol=1e-7, gtol=1e-12, max_nfev=EVALUATIONS,
    )  # fmt: skip
    return best[0]


def _solved(task: Task, near: Array, index: int, own: int, c: float) -> Array | None:
    """Return `near` with coordinate `own` solved for value c; None outside its bounds."""
    box, w = task.unknowns, near.copy()
    for _ in range(30):
        miss = c - float(box.values(w)[index])
        if abs(miss) <= 1e-10 * max(abs(c), 1e-300):
            break
        w[own] += max(-1e3, min(1e3, miss / float(box.slope(w)[index, own])))
    if not box.lower[own] <= w[own] <= box.upper[own]:
        return None
    return np.asarray(w, float)


def _crossing(walk: _Walk, stations: list[Station]) -> float | None:
    """Return the value at the limit, by interpolation of the square root of the rise."""
    last = (walk.best, 0.0)
    for value, rise, _ in stations:
        if rise >= walk.limit:
            a, b = (float(np.sqrt(max(x, 0.0))) for x in (last[1], rise))
            share = (float(np.sqrt(walk.limit)) - a) / max(b - a, 1e-300)
            if walk.logarithmic:
                return float(last[0] * (value / last[0]) ** share)
            return last[0] + share * (value - last[0])
        last = (value, rise)
    return None


def _open_side(walk: _Walk, side: _Side, end: float | None, where: str) -> list[str]:
    """Return the message for a side that does not reach the limit."""
    if end is not None:
        return []
    if not side.stations:
        return [f"{walk.name} is open {where}: it reaches {side.why} at once."]
    value, rise, _ = side.stations[-1]
    how = "flat" if rise < FLAT * walk.limit else "open"
    share = f"the rise is {100 * max(rise, 0.0) / walk.limit:.0f} % of the limit"
    return [f"{walk.name} is {how} {where}: at {value:.4g}, near {side.why}, {share}."]
