"""How wide friction laws are smoothed: in multiples of what their contacts do on the way."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ocp.formulation.phase import Span
from ocp.formulation.problem import Problem
from ocp.friction.mode_models import jumps, widths
from ocp.transcription.unknowns import Points, SpanPoints
from symfric.model import Contact

Array = NDArray[np.float64]

LEAST = 0.1
"""Share of the scale before that a contact keeps which hardly moves: at rest it has none."""


@final
@dataclass(frozen=True)
class Scale:
    """What the widths of one contact are relative to.

    Attributes:
        speed: largest sliding velocity on the way [m/s or rad/s].
        load: largest normal force [N]; 1 where it is not known.
    """

    speed: float
    load: float = 1.0


Scales = Mapping[str, Scale]
"""Contact -> its scale."""


def scales_of(
    problem: Problem, smooth: Problem, points: Points, before: Scales | None = None
) -> Scales:
    """The scales of the motion `points`; none is below `LEAST` of that before.

    Args:
        problem: the user's.
        smooth: the same with smooth models, to which the points belong.
    """
    found: dict[str, list[float]] = {}
    for span, own in zip(smooth.spans, points.spans, strict=True):
        for contact in problem.chain[span.phase].model.contacts:
            largest = np.abs(values_at(span, contact, own)).max(axis=1)
            kept = found.setdefault(contact.name, [0.0, 0.0])
            kept[:] = [max(a, float(b)) for a, b in zip(kept, largest, strict=True)]
    return {
        name: Scale(
            max(speed, LEAST * before[name].speed if before and name in before else 0.0),
            load if load > 0.0 else 1.0,
        )
        for name, (speed, load) in found.items()
    }


def same_size(a: Scales, b: Scales, factor: float) -> bool:
    """Whether no speed differs by more than `factor`."""
    speeds = [(a[name].speed, b[name].speed) for name in a]
    return all(max(pair) <= factor * min(pair) for pair in speeds)


def guessed(problem: Problem, scales: Sequence[Scales]) -> Scales:
    """What to expect of a motion from those of several starts.

    The largest median speed of all contacts that slide, or that turn: a body that stands still in
    straight lines from end to end will move, and layers that are too wide do no harm.
    """
    turning = {c.name: c.turning for phase in problem.chain for c in phase.model.contacts}
    speeds = {name: float(np.median([s[name].speed for s in scales])) for name in turning}
    return {
        name: Scale(
            max(speeds[other] for other in turning if turning[other] == turning[name]),
            float(np.median([s[name].load for s in scales])),
        )
        for name in turning
    }


def widths_at(problem: Problem, scales: Scales, level: float) -> dict[str, float]:
    """Values of the widths of the smooth models: layers of `level` times the scales.

    Those of the user's laws are the smallest.
    """
    found: dict[str, float] = {}
    for phase in problem.chain:
        laws = {c.name: c.law for c in phase.model.contacts}
        for width in widths(phase.model):
            own = scales[width.contact]
            if width.layer is None:
                found[width.parameter] = max(width.number, level * own.load)
            else:
                least = width.layer if laws[width.contact].widths else 0.0
                found[width.parameter] = width.at(max(least, level * own.speed))
    return found


def speeds_at(problem: Problem, scales: Scales, level: float) -> dict[str, float]:
    """Contact -> width of its layer [m/s or rad/s] at `level`."""
    found: dict[str, float] = {}
    for phase in problem.chain:
        laws = {c.name: c.law for c in phase.model.contacts}
        for width in widths(phase.model):
            if width.layer is not None:
                least = width.layer if laws[width.contact].widths else 0.0
                found[width.contact] = max(least, level * scales[width.contact].speed)
    return found


def own_level(problem: Problem, scales: Scales) -> float:
    """How wide the layers of the user's own laws are, in multiples of the speeds.

    The narrowest counts; 0 for laws without layers.
    """
    found = [
        width.layer / scales[width.contact].speed
        for phase in problem.chain
        for width in widths(phase.model)
        if width.layer is not None and scales[width.contact].speed > 0.0
        if next(c for c in phase.model.contacts if c.name == width.contact).law.widths
    ]
    return min(found, default=0.0)


def has_jumps(problem: Problem) -> bool:
    """Whether any contact of any phase holds at rest, so that there is something to sharpen."""
    return any(jumps(phase.model, c) for phase in problem.chain for c in phase.model.contacts)


def values_at(span: Span, contact: Contact, points: SpanPoints) -> Array:
    """Sliding velocities and normal forces at the collocation points, shape (2, N d).

    A normal force that needs the friction force of another contact is zero here.
    """
    at = ca.Function(
        "at", span.symbols, [ca.vertcat(contact.slip, ca.SX(contact.N))], {"allow_free": True}
    )
    if at.has_free():
        at = ca.Function("at", span.symbols, [ca.vertcat(contact.slip, 0.0)])
    count = points.inner.shape[1]
    held = np.repeat(points.u, count // points.u.shape[1], axis=1)
    p = np.tile(span.p[:, None], count)
    return np.asarray(at.map(count)(np.zeros((1, count)), points.inner, points.z, held, p))
