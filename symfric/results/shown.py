"""How runs show themselves: how they ended, and a table of their signals."""

from math import isfinite
from typing import TYPE_CHECKING

from symfric.foundation.shown import Shown, Table, among, counted
from symfric.model.shown import friction

if TYPE_CHECKING:
    from symfric.results.trajectory import Trajectory

CHEAP = 200_000
"""Steps times signals of a run whose steps are looked at without being asked: some 20 ms."""


def shown(run: "Trajectory") -> Shown:
    """Scene, law, span, how it ended, and for each signal where it began, ended and went.

    Extremes are those over all steps where these are known or cheap, else those at `t`.
    """
    counts, (first, last) = run.statistics, run.span
    known = "extremes" in run.__dict__ or counts.steps * len(run.units) <= CHEAP
    rubbing = friction(run.model)
    took = f"{counted(counts.steps, 'step')} of {counts.method}"
    happened = f", {counted(len(run.happened), 'event')}" if run.model.events else ""
    lines = [
        *([f"friction: {rubbing}"] if rubbing else []),
        f"{run.status.name}: {run.message}",
        f"{took}{happened}, {counted(run.t.size, 'time')} in t",
        *_measured(run),
    ]
    after = [] if known else [f"least and greatest at {run.t.size} times; see extremes"]
    if "further" in run.model.__dict__ and run.details:
        after.append(f"further: {among(run.details)}")
    return Shown(
        f"run of '{run.scene}' from {first:g} to {last:g} s",
        tuple(lines),
        Table(
            ("signal", "unit", "first", "last", "least", "greatest"),
            tuple(_rows(run, known)),
            numbers=(2, 3, 4, 5),
        ),
        tuple(after),
    )


def _measured(run: "Trajectory") -> list[str]:
    """What was measured of its errors."""
    counts = run.statistics
    if not isfinite(counts.error):
        return []
    slopes = among(f"{name} {x:.0e}" for name, x in counts.sensitivity_errors.items())
    derivatives = f", of derivatives by {slopes}" if slopes else ""
    return [f"measured error: {counts.error:.0e}{derivatives}"]


def _rows(run: "Trajectory", known: bool) -> list[tuple[str, ...]]:
    if not run.t.size:
        return [(name, unit, "", "", "", "") for name, unit in run.units.items()]
    ends = run.extremes if known else {n: (v.min(), v.max()) for n, v in run.signals.items()}
    rows = list[tuple[str, ...]]()
    for name, unit in run.units.items():
        values = run[name]
        numbers = (values[0], values[-1], *ends[name])
        rows.append((name, unit, *(f"{x:.6g}" for x in numbers)))
    return rows
