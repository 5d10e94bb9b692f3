"""The sequence of modes of a sharpened motion."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import isfinite
from typing import final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ocp.formulation.problem import Problem
from ocp.friction.carry import Known
from ocp.friction.mode_models import mode_model
from ocp.friction.release import excess, rubbing
from ocp.friction.sequence import Leg, Track, cut, read, with_rests

Array = NDArray[np.float64]

SHORT_RUN = 5e-3
"""Share of the whole duration below which a run counts to its neighbours."""

NEW_REST = 2.5e-3
"""Share of the whole duration that a rest has where it is put into a sequence."""


@final
@dataclass(frozen=True, eq=False)
class Reading:
    """How a motion is read.

    Attributes:
        creep: contact -> sliding velocity below which it rests.
        rests: whether rests are put in at reversals and at the ends.
    """

    creep: Mapping[str, float]
    rests: bool = True


def sequence_of(problem: Problem, known: Known, reading: Reading) -> tuple[Leg, ...]:
    """The legs of `problem` with the arcs of a motion.

    Args:
        problem: the user's, one scenario.
        known: its sharpened motion.
        reading: how fast creeping is.
    """
    tracks: list[Track] = []
    for stay in _stays(problem):
        tracks.append(_track(problem, known, reading, *stay))
    if reading.rests:
        tracks = [_rested(problem, known, reading, track, tracks) for track in tracks]
    legs: list[Leg] = []
    for number, (phase, when) in enumerate(zip(problem.chain, known.motion.phases, strict=True)):
        fractions = [0.0, *sorted(phase.via), 1.0]
        for part in range(len(fractions) - 1):
            a, b = (when.begin + when.T * s for s in fractions[part : part + 2])
            legs.append(cut(tracks, (number, part), a, b))
    return tuple(legs)


def sizes_of(problem: Problem, known: Known) -> dict[str, float]:
    """Typical static level of each contact [N]: its mean over the motion."""
    found: dict[str, float] = {}
    for phase in problem.chain:
        held = mode_model(phase.model, {c.name: 0 for c in rubbing(phase.model)})
        for contact in rubbing(phase.model):
            both = [held.expression(f"{contact.name}_grip_{side}") for side in ("up", "down")]
            levels = known.along(held, (both[0] + both[1]) / 2, known.motion.t)
            size = float(np.mean(np.abs(levels[np.isfinite(levels)]))) if levels.size else 1.0
            found.setdefault(contact.name, size if isfinite(size) and size > 0 else 1.0)
    return found


def starts_at_rest(problem: Problem, known: Known, creep: Mapping[str, float]) -> tuple[str, ...]:
    """Contacts that do not slide at the very start."""
    model, start = problem.chain[0].model, known.motion.t[:1]
    return tuple(
        c.name
        for c in rubbing(model)
        if abs(float(known.along(model, c.slip, start)[0, 0])) < 1e-3 * creep[c.name]
    )


def _stays(problem: Problem) -> list[tuple[int, int, str]]:
    """(first phase, last phase, contact): where a contact is without a break."""
    found: list[tuple[int, int, str]] = []
    for number, phase in enumerate(problem.chain):
        for contact in rubbing(phase.model):
            stay = (number, number, contact.name)
            for k, (first, last, name) in enumerate(found):
                if name == contact.name and last == number - 1 and not phase.link:
                    stay = (first, number, name)
                    del found[k]
                    break
            found.append(stay)
    return found


def _track(
    problem: Problem, known: Known, reading: Reading, first: int, last: int, name: str
) -> Track:
    t, phases = known.motion.t, known.motion.phases
    kept = (t >= phases[first].begin) & (t <= phases[last].end)
    slips = np.zeros(t.size)
    for number in range(first, last + 1):
        model = problem.chain[number].model
        own = next(c for c in model.contacts if c.name == name)
        here = (t >= phases[number].begin) & (t <= phases[number].end)
        slips[here] = known.along(model, own.slip, t[here])[0]
    whole = phases[-1].end - phases[0].begin
    return read(name, t[kept], slips[kept], reading.creep[name], SHORT_RUN * whole)


def _rested(
    problem: Problem, known: Known, reading: Reading, track: Track, tracks: Sequence[Track]
) -> Track:
    """`track` with rests where something can hold the contact."""
    phases = known.motion.phases
    whole = phases[-1].end - phases[0].begin
    ends = np.array([track.runs[0].begin, track.runs[-1].end])

    def model_at(t: float) -> int:
        return next(k for k, phase in enumerate(phases) if t <= phase.end or k == len(phases) - 1)

    def can_rest(t: float) -> bool:
        number = model_at(t)
        return _holdable(problem, number, known, track.contact, tracks, t)

    def resting(t: float) -> bool:
        model = problem.chain[model_at(t)].model
        own = next(c for c in model.contacts if c.name == track.contact)
        slip = float(known.along(model, own.slip, np.array([t]))[0, 0])
        return abs(slip) < reading.creep[track.contact]

    at_ends = tuple(resting(float(t)) for t in ends)
    return with_rests(track, can_rest, NEW_REST * whole, (at_ends[0], at_ends[1]))


def _holdable(
    problem: Problem, number: int, known: Known, name: str, tracks: Sequence[Track], t: float
) -> bool:
    """Whether inputs within their bounds can hold a contact at a time.

    The force that this takes is affine in the inputs of most models; of others this is its tangent.
    """
    model, span = problem.chain[number].model, problem.spans[number]
    others = {track.contact: track.at(t) or 0 for track in tracks}
    boxes = [span.box(v.name) for v in model.u]
    for side in (1, -1):
        modes = {c.name: others.get(c.name, 0) for c in rubbing(model)} | {name: side}
        moving = mode_model(model, modes)
        beyond = excess(model, modes, name, side)
        slope = ca.jacobian(beyond, moving.vector("u")).T
        values = known.along(moving, ca.vertcat(beyond, slope), np.array([t]))[:, 0]
        least = values[0]
        for gradient, v, (low, high) in zip(values[1:], model.u, boxes, strict=True):
            now = float(known.held(v.name, np.array([t]))[0])
            if gradient:
                least += min(gradient * (low - now), gradient * (high - now))
        if not least < 0.0:
            return False
    return True
