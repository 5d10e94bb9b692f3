"""Parts of a result: its problem, estimates, errors, signals for plots, friction over velocity."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import inf, nan
from typing import Any, Protocol, final

import numpy as np

from identification.data.dataset import Dataset
from identification.residuals.evaluation import (
    DEAD_TIME,
    Array,
    Channel,
    Extended,
    Residuals,
)
from identification.residuals.inverse import PART, InverseDynamics, InverseRows
from identification.solving.descent import best_of, many_starts
from identification.solving.task import Point, Task, triangle
from identification.unknowns.subject import Closed, Subject
from identification.unknowns.unknowns import unknowns_of
from identification.verdict.covariance import Covariance, Levels, covariance, steps_of
from identification.verdict.identifiable import assured
from identification.verdict.minimum import Minimum, minimum
from symfric.foundation import checks
from symfric.foundation.shown import brief
from symfric.foundation.status import Status


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


def error(channel: Channel, r: Array, effective: float = nan) -> Error:
    """Return the errors of one channel; `r` contains the residuals of all rows."""
    left = r[channel.rows]
    size = float(np.linalg.norm(channel.measured))
    rms = float(np.sqrt(np.mean(left**2))) if left.size else 0.0
    relative = 100.0 * float(np.linalg.norm(left)) / size if size > 0 else inf
    largest = float(np.abs(left).max(initial=0.0))
    return Error(channel.unit, rms, relative, largest, left.size, effective)


def errors_of(
    residuals: Residuals, records: Sequence[str], r: Array, effective: Mapping[str, float]
) -> Errors:
    """Return (record, signal) -> errors [SI]; `effective` gives samples by label of the channel."""
    both = zip(residuals.channels, labels(residuals), strict=True)
    return {(records[c.record], c.signal): error(c, r, effective.get(n, nan)) for c, n in both}


def labels(residuals: Residuals) -> list[str]:
    """Return the labels of the channels, such as "force", or "force[0]" for several records."""
    several = len({c.record for c in residuals.channels}) > 1
    return [f"{c.signal}[{c.record}]" if several else c.signal for c in residuals.channels]


@final
@dataclass(frozen=True, eq=False)
class FrictionCurve:
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


def limits(curve: FrictionCurve) -> tuple[float, float]:
    """Return a range of forces that contains the curve and all but the farthest points."""
    dots = np.concatenate([line.y for line in curve.measured.values()] or [np.zeros(0)])
    ends = [*np.percentile(dots, [0.2, 99.8])] if dots.size else []
    low, high = min([*ends, curve.law.y.min()]), max([*ends, curve.law.y.max()])
    margin = 0.1 * (high - low) or 1.0
    return float(low - margin), float(high + margin)


class Kind(Protocol):
    """Type of residuals, such as points, inverse dynamics, shooting or closed loop."""

    def prepare(self, subject: Subject, data: Dataset, start: Mapping[str, float]) -> Residuals:
        """Return the residuals of `subject` on `data`; start values are estimated near `start`."""
        ...


@final
@dataclass(frozen=True, eq=False)
class Asked:
    """Arguments of a fit and its end, from which the problem is restored on demand.

    Attributes:
        question: the `Fit` with its data.
        noise: signal -> standard deviation at the end.
        w: coordinates of the minimum.
    """

    question: Any
    noise: dict[str, float]
    w: Array

    @cached_property
    def live(self) -> "Live":
        """Problem and end, restored on first use."""
        return self.question.live(self.noise, self.w)


@final
@dataclass(frozen=True, eq=False)
class Live:
    """Problem of a fit with its end.

    Attributes:
        kind, subject, data: arguments of the fit.
        task: least-squares problem with the noise levels at the end.
        point: the minimum.
        levels: friction levels of the law; None if the load is not known.
    """

    kind: Kind
    subject: Subject
    data: Dataset
    task: Task
    point: Point
    levels: Levels | None

    @cached_property
    def minimum(self) -> Minimum:
        """Arrays of the minimum."""
        return minimum(self.task, self.point)

    @cached_property
    def covariance(self) -> Covariance:
        """Covariance of the values at the minimum, with the intervals of nonlinear models."""
        linear = covariance(self.minimum, self.levels)
        whole = part = (self.task, self.point)
        if (some := self.task.part) is not self.task:
            there = some.at(self.point.w)
            part = whole if isinstance(there, str) else (some, there)
        steps = steps_of(*part, linear)
        return assured(whole, part, linear, steps) if steps else linear

    @cached_property
    def closed(self) -> Closed:
        """Law, machine and model with the numbers of `point`."""
        return self.subject.close(self.values)

    @property
    def values(self) -> dict[str, float]:
        """Free parameters, start values and dead times by name."""
        names = self.task.residuals.names
        return dict(zip(names, self.point.values.tolist(), strict=True))

    @property
    def dead_time(self) -> float:
        """Largest fitted dead time [s], of either sign."""
        late = [abs(x) for n, x in self.values.items() if n.startswith(DEAD_TIME)]
        return max(late, default=0.0)

    def errors_on(self, data: Dataset) -> Errors:
        """Return the errors of the parameters on other data; see `left_on`."""
        residuals, r = self.left_on(data)
        return errors_of(residuals, [r.name for r in data], r, {})

    def left_on(self, data: Dataset) -> tuple[Residuals, Array]:
        """Return the residuals of other data with these parameters, and their values [SI].

        Start values of the other data are estimated there.

        Raises:
            ValueError: the data lack the signals of the fit, or cannot be simulated.
        """
        data = checks.kind("validate", data, Dataset, "data, such as Dataset.read('v.csv')")
        start = {n: v for n, v in self.values.items() if n in self.subject.names}
        residuals = _settled(self.kind, self.task.residuals, data).prepare(
            self.subject, data, start
        )
        unknowns = unknowns_of(residuals.own, {}, residuals.names, start)
        signals = {c.signal for c in residuals.channels}
        noise = {s: sigma for s, sigma in self.task.noise.items() if s in signals}
        task, w = Task(residuals, unknowns, noise, (), self.task.loss), unknowns.start
        point = task.at(best_of(many_starts(task, [w])).w if w.size else w)
        if isinstance(point, str):
            raise ValueError(f"validate: expected data '{data.name}' that can be compared: {point}")
        return residuals, point.evaluation.r


FEW = 20
"""Largest number of records for which dead times are tested before they are estimated."""
SHIFTED = 0.1
"""Shift of a value, in its standard errors, above which dead times of long records matter."""


def matters(live: Live, rows: InverseRows) -> bool:
    """Return False if a Gauss-Newton step shows that dead times of long records shift no value.

    Args:
        live, rows: fit without dead times, and its residuals.
    """
    point, count = live.point, live.point.w.size
    if live.task.rows <= PART or len(rows.pieces) > FEW:
        return True
    R = triangle(np.column_stack([point.J, rows.rates() / point.sigma[:, None], point.r]))
    inverse = np.linalg.pinv(R[:-1, :-1])
    wide = live.minimum.sandwich.widening * R[-1, -1] / np.sqrt(live.task.rows)
    sure = np.abs(inverse @ R[:-1, -1]) / (wide * np.linalg.norm(inverse, axis=1))
    return bool((sure[:count] > SHIFTED).any())


def expanded(rows: InverseRows) -> Extended:
    """Return the residuals `InverseRows.delayed`, linear in dead times far below a sample."""
    count = len(rows.own) - len(rows.pieces)
    plain = replace(rows, own=rows.own[:count])
    return Extended(plain, rows.own[count:], plain.rates())


def _settled(kind: Kind, residuals: Residuals, data: Dataset) -> Kind:
    """Return `kind` with the filter chosen for the data of the fit, for equal filtering."""
    residuals = residuals.residuals if isinstance(residuals, Extended) else residuals
    if not isinstance(kind, InverseDynamics) or not isinstance(residuals, InverseRows):
        return kind
    if kind.filter is not None:
        return kind
    motion = residuals.pieces[0].motion
    thinner = round(motion.filter.decimation * motion.step / data[0].median_step)
    return replace(kind, filter=replace(motion.filter, decimation=max(1, thinner)))
