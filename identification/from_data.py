"""Properties of data that a fit uses before it is solved: findings, motion and force, starts."""

from collections.abc import Mapping
from contextlib import suppress

import numpy as np

from identification.data.dataset import Dataset
from identification.data.differentiate import differentiated
from identification.data.findings import Findings
from identification.residuals.points import Points
from identification.starts.measured import Measured
from identification.starts.start import start_values
from identification.unknowns.subject import Subject
from symfric.laws import Law
from symfric.scenes import Drive

FEW = 0.01
"""Share of points whose speed may be arbitrarily small, such as noise about rest."""


def findings_of(kind: object, data: Dataset) -> Findings:
    """Return the findings of the data check for these residuals."""
    if isinstance(kind, Points):
        return data.check()
    called = {part: name for part, name in _roles(kind).items() if any(name in r for r in data)}
    return data.check(**called)


def explained(error: ValueError, findings: Findings) -> ValueError:
    """Return the error of failed residuals, preceded by the first error found in the data."""
    if not findings.errors:
        return error
    sentence = findings.errors[0].sentence.rstrip(".")
    return ValueError(f"data '{findings.name}': {sentence}; then {error}")


def _roles(kind: object) -> dict[str, str]:
    """Return the names of the channels of position and force of a drive."""
    names = {name: getattr(kind, name, name) for name in ("x", "force")}
    return {name: given if isinstance(given, str) else name for name, given in names.items()}


def measured(kind: object, data: Dataset, load: float) -> Measured | None:
    """Return velocity and force of all points or of a drive; None if unavailable.

    Blocks represent a long record of a drive.
    """
    try:
        if isinstance(kind, Points):
            timed = all(r.t is not None for r in data)
            names = {"v": kind.v, "F": kind.F} | ({"t": "t"} if timed else {})
            each = [{p: r[n] if n in r else kind.path(r).v for p, n in names.items()} for r in data]
        else:
            called, chosen = _roles(kind), getattr(kind, "filter", None)
            motions = [m for r in data for m in differentiated(r, chosen, **called)]
            each = [{"v": m.v, "F": m.force, "x": m.x, "t": m.t, "a": m.a} for m in motions]
        signals = {part: np.concatenate([one[part] for one in each]) for part in each[0]}
        breaks = tuple(np.cumsum([one["v"].size for one in each])[:-1].tolist())
        return Measured(**signals, N=load, breaks=breaks)
    except ValueError:  # preparing the residuals reports missing channels
        return None


def strongest(
    kind: object, data: Dataset, seen: Measured | None, mass: float | None
) -> float | None:
    """Return the largest force on the friction of points or of a drive [N]; None if unknown.

    The force is F - m a in sliding and F at rest; unknown for points with a measured normal force.
    """
    loaded = isinstance(kind, Points) and (kind.N is not None or any("N" in r for r in data))
    if seen is None or loaded:
        return None
    if seen.a is None or mass is None:
        return float(np.abs(seen.F).max())
    return float(max(np.abs(seen.F).max(), np.abs(seen.F - mass * seen.a).max()))


def slowest(kind: object, seen: Measured | None) -> float:
    """Return the speed [m/s] above which nearly all points not at rest lie; 0 for motions."""
    if seen is None or not isinstance(kind, Points):
        return 0.0
    speeds = np.abs(seen.v[seen.v != 0])
    return float(np.quantile(speeds, FEW)) if speeds.size else 0.0


def centre(subject: Subject, seen: Measured | None, given: Mapping[str, float]) -> dict[str, float]:
    """Return the start of each free parameter: from the user, otherwise the data, then the law."""
    values, found = {u.name: u.start for u in subject.unknowns}, dict[str, float]()
    whole: Law | Drive | None = subject.law if subject.scene is None else subject.drive
    if whole is not None and seen is not None:
        with suppress(ValueError):  # without motion in the data, keep the values of the law
            found = start_values(whole, seen, free=[*values])
    started = subject.requests.started
    return values | {n: x for n, x in found.items() if n not in started} | dict(given)
