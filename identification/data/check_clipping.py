"""Signals that stop at a limit: an amplifier or a sensor at the end of its range."""

from collections.abc import Iterator

import numpy as np

from identification.data.findings import Finding, Severity
from identification.data.rough import rough_model
from identification.data.view import View, constant_runs

RUN, SHARE = 5, 0.002
"""Samples in a row at the extreme value, and share of all that lie in such runs, from which on
it is clipping."""
THERE = 0.6
"""Share of all long constant runs that lie at the extremes: else the signal is of few levels."""
MEAN, MOST = 0.03, 0.1
"""Force that the motion asks for beyond the limit, over it: mean and 90 % of the clipped samples.
Where the drive itself was at its limit, the motion asks for no more than that."""


def of_clipping(view: View) -> Iterator[Finding]:
    """Signals that are held at their largest or smallest value."""
    for signal, y in view.known():
        if y.size < 50 or np.ptp(y) == 0:
            continue
        first, length = constant_runs(y)
        held = length >= RUN
        levels = y[first]
        sides: list[tuple[str, float]] = []
        for side, top in (("largest", float(y.max())), ("smallest", float(y.min()))):
            share = float(length[held & (levels == top)].sum()) / y.size
            if share >= SHARE:
                sides.append((side, top))
        at_ends = held & np.isin(levels, [top for _, top in sides])
        if not sides or length[at_ends].sum() < THERE * length[held].sum():
            continue
        if signal == view.name("x"):  # at rest at the end of its way
            continue
        k = int(np.argmax(np.where(at_ends, length, 0)))
        samples = int(length[at_ends].sum())
        unit = view.record.units[signal]
        where = " and ".join(f"its {side} value {top:.4g} {unit}" for side, top in sides)
        severity, why = _verdict(view, signal, [top for _, top in sides])
        yield view.finding(
            "clipping",
            signal,
            f"{signal} stays at {where} in {samples / y.size:.1%} of the samples, longest from "
            f"{view.at(int(first[k]))} on: {why}.",
            severity,
            int(first[k]),
            int(first[k] + length[k] - 1),
        )


def _verdict(view: View, signal: str, tops: list[float]) -> tuple[Severity, str]:
    """Whether the force itself was limited, or only what the sensor could show of it."""
    unsure = "the amplifier or the sensor was at its limit there"
    model = rough_model(view, curve=True) if signal == view.name("force") else None
    if model is None or view.steady is None:
        return "warning", unsure
    force = np.interp(model.t, view.steady.time, view.steady[signal])
    clipped = np.isin(force, tops)
    free, top = ~clipped, float(np.abs(tops).max())
    if clipped.sum() < 5 or free.sum() < 50:
        return "warning", unsure
    values, *_ = np.linalg.lstsq(model.columns[free], model.force[free], rcond=1e-10)
    passed = (model.columns[clipped] @ values - model.force[clipped]) * np.sign(force[clipped])
    most = float(np.quantile(passed, 0.9))
    if passed.mean() > MEAN * top and most > MOST * top:
        return "error", (
            f"the motion asks for up to {most:.3g} {view.record.units[signal]} more, so it was not "
            "the drive but its sensor that was at its limit"
        )
    return "warning", unsure
