"""What the data say before a fit: speeds, and where to start."""

from collections.abc import Mapping

import numpy as np

from identification.data.dataset import Dataset
from identification.data.findings import Findings
from identification.residuals.points import Points
from identification.signals.differentiate import differentiate
from identification.starts.measured import Measured
from identification.starts.start import start_values
from identification.unknowns.subject import Subject
from symfric.laws import Law
from symfric.scenes import Drive

FEW = 0.01
"""Share of points whose speed may be any small number, such as noise about rest."""


def findings_of(kind: object, data: Dataset) -> Findings:
    """What is doubtful about the data, for who uses them like this."""
    if isinstance(kind, Points):
        return data.check()
    called = {part: name for part, name in _roles(kind).items() if any(name in r for r in data)}
    return data.check(**called)


def explained(error: ValueError, findings: Findings) -> ValueError:
    """The error of residuals that could not be made, behind what is wrong with the data."""
    if not findings.errors:
        return error
    sentence = findings.errors[0].sentence.rstrip(".")
    return ValueError(f"data '{findings.name}': {sentence}; then {error}")


def _roles(kind: object) -> dict[str, str]:
    """Channels of position and force of a drive."""
    names = {name: getattr(kind, name, name) for name in ("x", "force")}
    return {name: given if isinstance(given, str) else name for name, given in names.items()}


def measured(kind: object, data: Dataset, load: float) -> Measured | None:
    """Velocity and force of points or of a drive, all records; None where the data have none."""
    try:
        if isinstance(kind, Points):
            return _of_points(kind, data, load)
        return _of_drive(kind, data, load)
    except ValueError:  # whoever prepares the residuals says what is missing
        return None


def _of_points(kind: Points, data: Dataset, load: float) -> Measured:
    v, F = (np.concatenate([r[name] for r in data]) for name in (kind.v, kind.F))
    times = [r.t for r in data]
    t = None if any(one is None for one in times) else np.concatenate([r.time for r in data])
    return Measured(v, F, t=t, N=load, breaks=_breaks([r.size for r in data]))


def _of_drive(kind: object, data: Dataset, load: float) -> Measured:
    names, chosen = _roles(kind), getattr(kind, "filter", None)
    each = [differentiate(r, chosen, x=names["x"], force=names["force"]) for r in data]
    v, F, x, t, a = (
        np.concatenate([getattr(one, name) for one in each])
        for name in ("v", "force", "x", "t", "a")
    )
    return Measured(v, F, x=x, t=t, a=a, N=load, breaks=_breaks([one.v.size for one in each]))


def strongest(
    kind: object, data: Dataset, seen: Measured | None, mass: float | None
) -> float | None:
    """Largest force on the friction of points or of a drive [N]; None where nobody knows it.

    In sliding it is F - m a, at rest F. Not known of points with a measured normal force.
    """
    loaded = isinstance(kind, Points) and (kind.N is not None or any("N" in r for r in data))
    if seen is None or loaded:
        return None
    if seen.a is None or mass is None:
        return float(np.abs(seen.F).max())
    return float(max(np.abs(seen.F).max(), np.abs(seen.F - mass * seen.a).max()))


def slowest(kind: object, seen: Measured | None) -> float:
    """Speed [m/s] above which nearly all points lie that are not at rest; 0 for motions."""
    if seen is None or not isinstance(kind, Points):
        return 0.0
    speeds = np.abs(seen.v[seen.v != 0])
    return float(np.quantile(speeds, FEW)) if speeds.size else 0.0


def _breaks(sizes: list[int]) -> tuple[int, ...]:
    return tuple(np.cumsum(sizes)[:-1].tolist())


def from_data(subject: Subject, seen: Measured | None) -> dict[str, float]:
    """Start values of the free parameters of a law or a drive that the data tell."""
    whole: Law | Drive | None = subject.law if subject.scene is None else subject.drive
    if whole is None or seen is None:
        return {}
    names = [u.name for u in subject.unknowns]
    try:
        return start_values(whole, seen, free=names)
    except ValueError:  # data that do not move: the law's own values are as good as any
        return {}


def centre(subject: Subject, seen: Measured | None, given: Mapping[str, float]) -> dict[str, float]:
    """Start value of every free parameter: what the user says, else the data, else the law."""
    values = {u.name: u.start for u in subject.unknowns}
    told = {n: x for n, x in from_data(subject, seen).items() if n not in subject.started}
    return values | told | dict(given)
