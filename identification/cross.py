"""Cross-validation of a fit by records, points or blocks of time.

Each fold is left out once; the model is fitted to the other folds and evaluated on the omitted one.
Neighbouring samples share noise and motion. Folds are therefore whole records or blocks of time,
and a gap separates a block from the samples used for fitting.
Source: Burman, Chow and Nolan, Biometrika 81(2), 1994 (blocks with gaps).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import isfinite, nan
from typing import final

import numpy as np

from identification.data.dataset import Dataset
from identification.data.record import Array, Record
from identification.fit import Fit
from identification.result.fitted import Fitted
from identification.verdict.judge import FORCES
from symfric.foundation import checks
from symfric.foundation.shown import brief
from symfric.foundation.status import SolveError

GAP = 0.05
"""Gap between a block and the samples used for fitting, relative to the length of the block."""
LEAST = 20
"""Smallest number of samples before or after a block that is used for fitting."""
DIVERGED = 1e3
"""Error [%] above which a prediction counts as diverged."""


@final
@dataclass(frozen=True, eq=False)
class Left:
    """Residuals of one signal of one record that was left out of the fit.

    Attributes:
        record: name of the record.
        signal, unit: name and unit of the signal.
        t: times of the residuals [s]; for points, velocities.
        r: predicted - measured [SI], shape of t.
        spread: standard deviation of the measured signal [SI].
        mean: mean of a measured force over the record [SI]; 0 for other signals, whose records may
            be at different places.
    """

    record: str
    signal: str
    unit: str
    t: Array
    r: Array
    spread: float
    mean: float = 0.0

    __repr__ = brief


@final
@dataclass(frozen=True, eq=False)
class CrossValidation:
    """Prediction errors on the data that were left out of the fits.

    Attributes:
        left: residuals of all folds.
        folds: number of folds that could be fitted and compared.
        failed: messages of the folds that failed.
        by: "records", "blocks of time" or "points".
    """

    left: tuple[Left, ...]
    folds: int
    failed: tuple[str, ...]
    by: str

    @property
    def relative(self) -> float:
        """Root mean square error relative to the spread of the signals [%]; NaN without folds."""
        return relative(self.left)

    @property
    def rms(self) -> dict[str, float]:
        """Root mean square error of each signal [SI]."""
        return {signal: _rms(some) for signal, some in by_signal(self.left).items()}

    def __str__(self) -> str:
        each = ", ".join(f"{s} {value:.3g}" for s, value in self.rms.items())
        error = f"{percent(self.relative)} of the spread ({each} rms)"
        return "\n".join([f"{self.folds} folds by {self.by}: {error}", *self.failed])


def cross_validate(
    fit: Fit, folds: int = 4, start: Mapping[str, float] | None = None
) -> CrossValidation:
    """Fit to all but one part of the data, for each part in turn, and evaluate that part.

    Args:
        fit: fit whose data are divided.
        folds: number of parts. The parts are groups of records if there are at least as many
            records, otherwise every n-th point, or blocks of time of each record.
        start: values from which each part is fitted with a single start, such as the result of
            a fit to all data; None: the starts of `fit`.

    Raises:
        ValueError: fewer than two folds.
    """
    folds = checks.count("cross_validate: folds", folds, least=2)
    parts, by = _divided(fit.data, folds)
    if start is not None:
        fit = replace(fit, start=dict(start), starts=1)
    left, failed = list[Left](), list[str]()
    for number, (rest, part) in enumerate(parts):
        try:
            left += left_of(replace(fit, data=rest).solve(throw=False), part)
        except (ValueError, SolveError) as error:
            failed.append(f"fold {number + 1}: {error}")
    return CrossValidation(tuple(left), len(parts) - len(failed), tuple(failed), by)


def left_of(fit: Fitted, data: Dataset) -> list[Left]:
    """Return the residuals of a fit on other data.

    Raises:
        ValueError: the data cannot be compared, or the fit was loaded from JSON.
    """
    residuals, r = fit.alive("validate").left_on(data)
    left = list[Left]()
    for c in residuals.channels:
        spread = float(np.std(c.measured)) or float(np.abs(c.measured).max(initial=0.0)) or 1.0
        mean = float(c.measured.mean()) if c.unit in FORCES else 0.0
        left.append(Left(data[c.record].name, c.signal, c.unit, c.t, r[c.rows], spread, mean))
    return left


def by_signal(left: Sequence[Left]) -> dict[str, list[Left]]:
    """Return signal -> its residuals of all records."""
    signals = dict.fromkeys(part.signal for part in left)
    return {s: [part for part in left if part.signal == s] for s in signals}


def relative(left: Sequence[Left]) -> float:
    """Return the rms error relative to the spread [%], averaged over signals; NaN if empty."""
    each = list[float]()
    for some in by_signal(left).values():
        each.append(_rms(some) / _spread(some))
    return 100 * float(np.sqrt(np.mean(np.square(each)))) if each else nan


def _spread(some: Sequence[Left]) -> float:
    """Return the standard deviation of a signal over all records."""
    rows = [part.r.size for part in some]
    mean = np.average([part.mean for part in some], weights=rows)
    squares = [part.spread**2 + (part.mean - mean) ** 2 for part in some]
    return float(np.sqrt(np.average(squares, weights=rows)))


BLOCKS = 20
"""Number of blocks of neighbouring residuals that determine a standard error."""


def uncertainty(left: Sequence[Left]) -> float:
    """Return the standard error of `relative` [%]; NaN with too few residuals."""
    mean, error = excess(left)
    return 100 * error / (2 * float(np.sqrt(mean))) if mean > 0 else nan


def excess(left: Sequence[Left], best: Sequence[Left] = ()) -> tuple[float, float]:
    """Return the mean squared error relative to the spread, minus that of `best`, and its error.

    Both have residuals at the same times. Neighbouring residuals are correlated; the standard error
    is therefore that of the means of blocks of neighbours.
    """
    if not left:
        return nan, nan
    means, errors = list[float](), list[float]()
    others = by_signal(best)
    for signal, some in by_signal(left).items():
        squares = np.concatenate([part.r**2 for part in some]) / _spread(some) ** 2
        if best:
            squares -= np.concatenate([part.r**2 for part in others[signal]]) / _spread(some) ** 2
        blocks = [float(b.mean()) for b in np.array_split(squares, BLOCKS) if b.size]
        means.append(float(squares.mean()))
        errors.append(float(np.std(blocks, ddof=1) / np.sqrt(BLOCKS)) if len(blocks) > 1 else nan)
    return float(np.mean(means)), float(np.linalg.norm(errors)) / max(len(errors), 1)


def percent(value: float) -> str:
    """Return an error in percent as text."""
    if value > DIVERGED:
        return "diverged"
    return f"{value:.3g} %" if isfinite(value) else "-"


def shared(many: Sequence[Sequence[Left]]) -> list[list[Left]]:
    """Return residuals at common times only, because stateless laws omit samples near rest."""
    common: dict[tuple[str, str], Array] = {}
    for left in many:
        for part in left:
            key = (part.record, part.signal)
            common[key] = np.intersect1d(common.get(key, part.t), part.t)

    def at_common(part: Left) -> Left:
        there = np.isin(part.t, common[part.record, part.signal])
        return replace(part, t=part.t[there], r=part.r[there]) if there.any() else part

    return [[at_common(part) for part in left] for left in many]


def _rms(some: Sequence[Left]) -> float:
    r = np.concatenate([part.r for part in some])
    return float(np.sqrt(np.mean(r**2))) if r.size else nan


def _divided(data: Dataset, folds: int) -> tuple[list[tuple[Dataset, Dataset]], str]:
    """Return the remaining and the omitted data of each fold, and the kind of the folds."""
    if len(data) >= folds:
        groups = [data.records[k::folds] for k in range(folds)]
        found = [([r for r in data if r not in group], group) for group in groups]
        by = "records"
    elif all(record.t is None for record in data):
        every = [[np.arange(r.size) % folds == k for r in data] for k in range(folds)]
        found = [
            tuple([r.at(rows == inside) for r, rows in zip(data, some, strict=True)]
                  for inside in (False, True))
            for some in every
        ]  # fmt: skip
        by = "points"
    else:
        found, by = [_blocked(data, k, folds) for k in range(folds)], "blocks of time"
    return [(Dataset((*a,), data.name), Dataset((*b,), data.name)) for a, b in found], by


def _blocked(data: Dataset, k: int, folds: int) -> tuple[list[Record], list[Record]]:
    """Return the samples of each record beyond a gap around block k, and those of block k."""
    rest, part = list[Record](), list[Record]()
    for record in data:
        first, last = (round(j * record.size / folds) for j in (k, k + 1))
        gap = round(GAP * (last - first))
        part.append(record.at(slice(first, last)))
        sides = {"before": slice(0, max(0, first - gap)), "after": slice(last + gap, None)}
        for side, rows in sides.items():
            if len(range(record.size)[rows]) >= LEAST:
                rest.append(replace(record.at(rows), name=f"{record.name} {side}"))
    if not rest:
        raise ValueError(
            f"cross_validate: expected records of at least {2 * LEAST} samples, got data "
            f"'{data.name}'; use fewer folds"
        )
    return rest, part
