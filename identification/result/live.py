"""Live part of a fit: its problem, its minimum and its model."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import nan
from typing import Protocol, final

import numpy as np

from identification.data.dataset import Dataset
from identification.residuals.evaluation import DEAD_TIME, Array, Extended, Residuals
from identification.residuals.inverse import PART, InverseDynamics, InverseRows
from identification.result.series import Errors, error
from identification.solving.many_starts import best_of, many_starts
from identification.solving.task import Point, Task, triangle
from identification.unknowns.subject import Closed, Subject
from identification.unknowns.unknowns import unknowns_of
from identification.verdict.covariance import Covariance, Levels, covariance, steps_of
from identification.verdict.identifiable import assured
from identification.verdict.minimum import Minimum, minimum
from symfric.foundation import checks


class Kind(Protocol):
    """Type of residuals, such as points, inverse dynamics, shooting or closed loop."""

    def prepare(self, subject: Subject, data: Dataset, start: Mapping[str, float]) -> Residuals:
        """Return the residuals of `subject` on `data`; start values are estimated near `start`."""
        ...


class Question(Protocol):
    """Arguments of a fit, implemented by `identification.fit.Fit`."""

    def live(self, noise: dict[str, float], w: Array) -> "Live":
        """Return the problem with its end at the coordinates `w`."""
        ...


@final
@dataclass(frozen=True, eq=False)
class Asked:
    """Arguments of a fit and its end, from which the problem is restored on demand.

    Attributes:
        question: the fit with its data.
        noise: signal -> standard deviation at the end.
        w: coordinates of the minimum.
    """

    question: Question
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
