"""How long the windows of a simulation should be, as the data at hand say.

Short windows forgive a model what it gets wrong slowly, long ones show it what it gets wrong in the
long run; which of the two helps a prediction depends on what is wrong. So each length is tried:

    for each quarter of every record: fit to the others in windows of that length,
    simulate the quarter freely, from the start that the data tell;
    error^2 = mean over signals and quarters of  mean r^2 / variance of the signal

and the length of the least error is taken. Nothing is drawn by chance, nothing else is looked at.
"""

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from identification.residuals.initial import FEWEST
from identification.residuals.shots import DEAD_TIME

if TYPE_CHECKING:
    from identification.data.dataset import Dataset
    from identification.data.record import Record
    from identification.residuals.shooting import Shooting
    from identification.unknowns.subject import Subject

Solve = Callable[["Shooting", "Dataset"], Mapping[str, float] | None]
"""Fits parameters to data by windows; None where that fails."""
BLOCKS = 4
RTOL = 1e-6
"""Tolerance of simulations where nobody gave one."""
LENGTHS, LEAST = 5, 2.5
"""Lengths to try besides whole records, each half the one before; windows of fewer samples than
`LEAST` times the fewest tell their start values badly."""


def lengths(data: "Dataset") -> list[float | None]:
    """Lengths to try [s]; None is whole records."""
    span = max(float(r.time[-1] - r.time[0]) for r in data)
    least = LEAST * FEWEST * max(r.median_step for r in data)
    shorter = [span / 2 ** (k + 1) for k in range(LENGTHS)]
    return [None, *(s for s in shorter if s >= least)]


def choose(kind: "Shooting", subject: "Subject", data: "Dataset", solve: Solve) -> "Shooting":
    """The kind with windows of the length that predicts left-out quarters best.

    Args:
        kind: whose windows are to be chosen.
        subject: what is fitted.
        data: records; each is divided in time.
        solve: fits parameters to some of the data.

    Raises:
        ValueError: no length gives a fit that can be simulated.
    """
    # what is left of a record begins anywhere; a tolerance as of usual data saves looking for one
    x0 = "data" if kind.x0 == "data" else "estimate"
    asked = replace(kind, x0=x0, rtol=kind.rtol or RTOL)
    errors = {s: _left_out(replace(asked, windows=s), subject, data, solve) for s in lengths(data)}
    best = min(errors, key=lambda s: errors[s])
    if not np.isfinite(errors[best]):
        raise ValueError(
            "Shooting: windows: expected a length whose fits can be simulated over a quarter of "
            "the data, found none; give a length [s], or better start values"
        )
    return replace(kind, windows=best)


def _left_out(kind: "Shooting", subject: "Subject", data: "Dataset", solve: Solve) -> float:
    """Mean square error of predicted quarters over the variance of each signal."""
    found = list[float]()
    for block in range(BLOCKS):
        rest, other = _divided(data, block)
        try:
            values = solve(kind, rest)
            found.append(np.inf if values is None else _free_run(kind, subject, other, values))
        except ValueError:  # a rest whose windows are too short, or that does not move
            found.append(np.inf)
    return float(np.mean(found))


def _divided(data: "Dataset", block: int) -> "tuple[Dataset, Dataset]":
    """All but a quarter of each record, and these quarters."""
    rest, other = list["Record"](), list["Record"]()
    for record in data:
        a, b = (record.size * k // BLOCKS for k in (block, block + 1))
        other.append(record.at(slice(a, b)))
        rest += [record.at(s) for s in (slice(0, a), slice(b, record.size)) if s.stop > s.start]
    return replace(data, records=tuple(rest)), replace(data, records=tuple(other))


def _free_run(
    kind: "Shooting", subject: "Subject", data: "Dataset", values: Mapping[str, float]
) -> float:
    """Mean square error of simulated records over the variance of each signal."""
    shots = replace(kind, windows=None, x0="data").prepare(subject, data, values)
    own = {u.name: values[u.name] if u.name == DEAD_TIME else u.start for u in shots.own}
    predicted = shots.predicted(np.array([{**values, **own}[name] for name in shots.names]))
    if isinstance(predicted, str):
        return np.inf
    errors = list[float]()
    for c in shots.channels:
        size = float(np.var(c.measured))
        if size > 0:
            errors.append(float(np.mean((predicted[c.rows] - c.measured) ** 2)) / size)
    return float(np.mean(errors)) if errors else np.inf
