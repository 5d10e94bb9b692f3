"""Covariance of fitted values with autocorrelated residuals, 95 % intervals, and warnings.

    C = B' Sigma B,   B = J (J'J)^-1 (dvalues/dw)',   Sigma = autoregressive model of each channel

C is computed in the frequency domain (Whittle): B on the grid of times is transformed and weighted
by the spectral density. Missing rows and windows need no special treatment.

A record that only slides shows how friction falls with speed, but not the static level. A law may
then fit it with a static level far above every measured force. Such levels (`Levels`) have no
interval.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import NamedTuple, final

import numpy as np
from numpy.typing import NDArray

from identification.residuals.evaluation import Array
from identification.solving.task import Point, Task
from identification.unknowns.roles import is_coefficient
from identification.unknowns.subject import Subject
from identification.verdict.minimum import Minimum, groups
from symfric.foundation.parameters import parameters
from symfric.foundation.shown import brief
from symfric.foundation.units import turned
from symfric.laws.composed.populations import steady_force

SPEEDS = 20
"""Number of measured speeds at which a law is evaluated, in each direction."""
FAR = 3.0
"""Ratio of a level's force to the largest friction force above which it is not identifiable."""


class Levels(NamedTuple):
    """Friction levels among the values, and the largest force in the data.

    Attributes:
        loads: name of a level -> ratio of its force to its value: 1, or the normal force for a
            coefficient.
        largest: largest friction force in the data [N or N m].
        unit: unit of the forces.
        curve: largest force of the law in steady sliding at the measured speeds, both ways.
    """

    loads: Mapping[str, float]
    largest: float
    unit: str = "N"
    curve: float = 0.0

    @classmethod
    def of(
        cls, subject: Subject, values: Mapping[str, float], largest: float | None, v: Array,
        turning: bool,
    ) -> "Levels | None":  # fmt: skip
        """Return the levels of a law under a known load; None if the load is not known.

        Args:
            subject: fitted law or drive.
            values: fitted values by name.
            largest: largest friction force in the data [N].
            v: measured velocities [m/s].
            turning: True for rates and moments.
        """
        whole, load = subject.drive or subject.law, subject.load
        law = subject.close(values).law
        if whole is None or load is None or largest is None or law is None or law.inputs:
            return None  # with inputs, friction alone does not determine the loads of its levels
        force = turned("N") if turning else "N"
        levels = {n: p for n, p in parameters(whole).items() if p.role == "level"}
        loads = {n: load if is_coefficient(p) else 1.0 for n, p in levels.items()}
        speeds = np.quantile(np.abs(v), np.linspace(0.05, 1.0, SPEEDS))
        both = np.concatenate([-speeds, speeds])
        known = {n: loads[n] for n, p in levels.items() if p.unit in ("1", force)}
        return cls(known, largest, force, float(np.abs(steady_force(law, both, load)).max()))

    def beyond(self, values: Mapping[str, float]) -> Iterator[tuple[str, str]]:
        """Yield the name of each level far above all forces, with a message."""
        for name, load in self.loads.items():
            force = abs(values.get(name, 0.0)) * load
            if force > FAR * self.largest > 0:
                text = f"{name} is not identifiable: no friction force in the data is near "
                text += f"{force:.3g} {self.unit}, the largest is {self.largest:.2g} {self.unit}."
                yield name, text


LEVEL = 0.95
"""Confidence level of the intervals."""
TOGETHER = 0.98
"""Correlation above which two estimates are reported as strongly correlated."""
HARDLY = 0.5
"""Ratio of standard error to value above which a value is reported as poorly identified."""
DECADES = 8.0
"""Width of the interval of a logarithmic value above which the interval is dropped [decades]."""
WIDE = 1e4
"""Width of other intervals, relative to value and scale, above which the interval is dropped."""
LINEAR = 0.05
"""Relative deviation of the residuals from their linear change, at the ends of all intervals
together, below which all intervals are linear."""
ROUNDING = 1e-14
"""Slope of a value relative to its largest slope below which it is rounding error."""
CLEAN = 1e-13
"""Entry of a pseudo-inverse relative to the largest one below which it is rounded to zero."""
LOST = "not identifiable: effect below the noise"
BEYOND = "not identifiable: far above all forces"
"""Notes on values without an interval."""


@final
@dataclass(frozen=True, eq=False)
class Covariance:
    """Uncertainty of k values; NaN where a value is not identifiable or at a bound.

    Attributes:
        names: names of the values.
        matrix: covariance with the autocorrelation of the residuals, shape (k, k).
        white: covariance for white residuals, shape (k, k).
        freedom: effective degrees of freedom, for quantiles of Student's t, shape (k,).
        low, high: 95 % intervals, shape (k,). For logarithmic unknowns they are symmetric in the
            logarithm: a stiffness known to a factor of 2 stays positive.
        at_bound: names of values at a bound.
        undetermined: groups of names with fewer identifiable combinations than names; a group of
            one name has no influence.
        effective: name of a channel -> number of independent samples.
        sentences: messages on values that are not identifiable or poorly identified.
        notes: name of a value without an interval that is in no group and at no bound -> reason.
    """

    names: tuple[str, ...]
    matrix: Array
    white: Array
    freedom: Array
    low: Array
    high: Array
    at_bound: tuple[str, ...]
    undetermined: tuple[tuple[str, ...], ...]
    effective: dict[str, float]
    sentences: tuple[str, ...]
    notes: Mapping[str, str] = field(default_factory=dict[str, str])

    __repr__ = brief

    @property
    def standard_errors(self) -> Array:
        """Standard errors with the autocorrelation of the residuals, shape (k,)."""
        return np.sqrt(np.diag(self.matrix))

    @property
    def white_errors(self) -> Array:
        """Standard errors for white residuals, shape (k,)."""
        return np.sqrt(np.diag(self.white))

    @property
    def correlation(self) -> Array:
        """Correlation of the estimates, shape (k, k); NaN where undefined."""
        return correlation(self.matrix)


def correlation(matrix: Array) -> Array:
    """Return the correlation matrix of a covariance; NaN where undefined."""
    error = np.sqrt(np.diag(matrix))
    both = np.outer(error, error)
    return np.divide(matrix, both, out=np.full_like(both, np.nan), where=both > 0)


def covariance(found: Minimum, levels: Levels | None = None) -> Covariance:
    """Compute the uncertainty of the values at a minimum.

    Limits: linear in the values, or in the logarithms of logarithmic unknowns; see `profile` for
    nonlinear intervals. Channels are independent.

    Args:
        found: the minimum.
        levels: friction levels among the values; levels far above every force have no interval.
    """
    inside = found.sandwich
    names, values = found.names, found.values
    moved = found.slope @ inside.null  # values along directions that leave the residuals unchanged
    own = [names.index(u.name) for u in found.unknowns]
    size = _sensitivity(found, own)
    wanders = np.abs(moved * size[:, None]).max(axis=1, initial=0.0) > 1e-4
    size_of = np.abs(found.slope)  # a value at its upper bound moves by rounding with its partner
    fixed = ~np.any((size_of > ROUNDING * size_of.max(axis=1, keepdims=True)) & ~found.held, axis=1)
    matrix, white = (without(C, wanders | fixed) for C in (inside.coloured, inside.white))
    low, high = _intervals(found, np.sqrt(np.diag(matrix)), inside.freedom)
    mine = tuple(names[i] for i in own)
    change = partial(_change, found, own)
    nuisance = {u.name for u in found.unknowns if u.nuisance}
    lost = [
        (members, sentence)
        for members, sentence in groups(mine, values[own], moved[own], size[own], change)
        if not nuisance.issuperset(members)
    ]
    far = {} if levels is None else dict(levels.beyond(dict(zip(names, values, strict=True))))
    gone = dict(_unlimited(found, low, high))
    labels = [found.label(c) for c in found.channels]
    effective = {n: c.effective for n, c in zip(labels, inside.colours, strict=True)}
    weak = _weak(found, matrix, low, high, {*far, *gone})
    alone = [sentence for _, sentence in lost]
    if uneven := [name for name, x in zip(names, inside.uneven, strict=True) if x]:
        alone.append(
            f"The residuals are larger where the data determine {', '.join(uneven)}: the intervals "
            "follow from the residuals there."
        )
    messages = (*alone, *far.values(), *gone.values(), *weak)
    notes = dict.fromkeys(gone, LOST) | dict.fromkeys(far, BEYOND)
    out = np.array([name in notes for name in names], dtype=bool)
    return Covariance(
        names=names,
        matrix=without(matrix, out),
        white=without(white, out),
        freedom=inside.freedom,
        low=np.where(out, np.nan, low),
        high=np.where(out, np.nan, high),
        at_bound=tuple(u.name for u, held in zip(found.unknowns, found.held, strict=True) if held),
        undetermined=tuple(members for members, _ in lost),
        effective=effective,
        sentences=tuple(s for s in messages if s),
        notes=notes,
    )


def without(matrix: Array, out: NDArray[np.bool_]) -> Array:
    """Return a matrix with the rows and columns in `out` set to NaN."""
    return np.where(out[:, None] | out, np.nan, matrix)


def _unlimited(found: Minimum, lows: Array, highs: Array) -> Iterator[tuple[str, str]]:
    """Yield values with a nearly unlimited interval and a message, which is empty for nuisances."""
    for unknown in found.unknowns:
        i = found.names.index(unknown.name)
        low, high, value = lows[i], highs[i], found.values[i]
        if unknown.logarithmic and low > 0:
            gone = high / low > 10**DECADES
        else:
            gone = high - low > WIDE * max(abs(value), abs(unknown.scale))
        if gone:
            why = "is not identifiable: its effect on the measurements is below the noise."
            yield unknown.name, "" if unknown.nuisance else f"{unknown.name} {why}"


def _sensitivity(found: Minimum, own: list[int]) -> Array:
    """Return norms of dr/dvalue with other unknowns held, shape (k,); 1/value for tied values."""
    size = 1 / np.maximum(np.abs(found.values), 1e-300)
    alone = np.linalg.norm(found.J @ _inverse(found.slope[own]), axis=0)
    for i, s in zip(own, alone, strict=True):
        size[i] = s if s > 0 else size[i]
    return size


def _change(found: Minimum, own: list[int], some: Array) -> float:
    """Return the change of the residuals; tied values follow the unknowns to first order."""
    w = _inverse(found.slope[own]) @ (some - found.values[own])
    there = found.values + found.slope @ w
    there[own] = some
    return found.change(there)


def _inverse(slope: Array) -> Array:
    """Return dw/dvalues, shape (n, n); zero for coordinates without effect, such as exp(-800)."""
    size = np.abs(slope).max(axis=1)
    size[size == 0.0] = 1.0
    inverse = np.linalg.pinv(slope / size[:, None])
    inverse[np.abs(inverse) < CLEAN * np.abs(inverse).max(initial=0.0)] = 0.0
    return inverse / size


def _intervals(found: Minimum, error: Array, freedom: Array) -> tuple[Array, Array]:
    from scipy.special import stdtrit  # noqa: PLC0415  (slow to import)

    reach = stdtrit(freedom, 0.5 + LEVEL / 2) * error
    low, high = found.values - reach, found.values + reach
    for unknown in found.unknowns:
        i = found.names.index(unknown.name)
        if unknown.logarithmic and found.values[i] > 0 and np.isfinite(reach[i]):
            factor = np.exp(min(reach[i] / found.values[i], 300.0))
            low[i], high[i] = found.values[i] / factor, found.values[i] * factor
    return low, high


def _weak(
    found: Minimum, matrix: Array, low: Array, high: Array, mentioned: set[str]
) -> Iterator[str]:
    """Yield a message for each poorly identified value that is not in `mentioned`."""
    error, related = np.sqrt(np.diag(matrix)), np.nan_to_num(np.abs(correlation(matrix)))
    np.fill_diagonal(related, 0.0)
    mentioned = mentioned | {u.name for u in found.unknowns if u.nuisance}
    units = {u.name: f" {u.unit}" for u in found.unknowns if u.unit != "1"}
    for i, name in enumerate(found.names):
        if name in mentioned or not error[i] > HARDLY * abs(found.values[i]):
            continue
        j = int(np.argmax(related[i]))
        goes = f"; strongly correlated with {found.names[j]}" if related[i, j] > TOGETHER else ""
        yield (
            f"{name} is poorly identified: between {low[i]:.3g} and {high[i]:.3g}"
            f"{units.get(name, '')} with 95 %{goes}."
        )


def steps_of(task: Task, point: Point, linear: Covariance) -> dict[str, Array]:
    """Return the changes of the coordinates to the upper ends of the intervals, none if linear.

    They are none if the residuals are linear up to all ends together.
    """
    box, names = task.unknowns, linear.names
    out = {*box.nuisance, *linear.at_bound}
    kept = [n for n in box.fitted if n not in out and np.isfinite(linear.low[names.index(n)])]
    steps = {n: _direction(point, linear, n) for n in kept}
    whole = sum(steps.values(), np.zeros(point.w.size))
    return steps if steps and bend(task, point, whole) > LINEAR else {}


def _direction(point: Point, linear: Covariance, name: str) -> Array:
    """Return the change of the coordinates to the upper end of the linear interval, shape (n,)."""
    i = linear.names.index(name)
    change = np.nan_to_num(linear.white[:, i] / linear.white[i, i])
    reach = (linear.high[i] - linear.low[i]) / 2
    size = np.linalg.norm(point.slope, axis=1)
    size[size == 0] = 1.0  # the rows have different units
    return np.linalg.lstsq(point.slope / size[:, None], change * reach / size, rcond=1e-9)[0]


def bend(task: Task, point: Point, step: Array) -> float:
    """Return the deviation of the residuals from their linear change, relative to this change.

    It is infinite if the step takes a logarithmic value out of its range.
    """
    box, end = task.unknowns, point.w + step
    inside = np.clip(end, box.lower, box.upper)
    there, change = task.at(inside), point.J @ (inside - point.w)
    leaves = [u.logarithmic and a != b for u, a, b in zip(box.unknowns, end, inside, strict=True)]
    if any(leaves) or isinstance(there, str):
        return np.inf
    bent = float(np.linalg.norm(there.evaluation.r / task.sigma - point.r - change))
    return bent / max(float(np.linalg.norm(change)), 1e-300)
