"""What a solved sequence tells of the modes it lacks.

A sequence that has a mode too many says so itself: its arc shrinks to nothing. One that has a mode
too few presses against the bounds of those it has:

* a contact that touches zero while it slips has come to rest there: exact friction would hold it,
  and let it go at the static level only. A motion that does not stop is wrong unless a rest is put
  in (`rests_inside`);
* a mode that changes exactly at an instant that the user has set may want to change before or
  after it, and contacts that change at the same instant one after the other. Each is another
  sequence, next to this one; which of them is better only its solution tells (`neighbours`).
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ocp.friction.sequence import Arc, Leg, flat, inserted, pruned
from ocp.friction.solved import Solved

Array = NDArray[np.float64]

TOUCH = 1e-5
"""Share of the largest sliding velocity of a contact below which it touches zero: what an interior
point leaves of a bound that presses."""


def rests_inside(solved: Solved) -> tuple[Leg, ...] | None:
    """The sequence with rests where contacts touch zero as they slip; None where none does."""
    legs, shift = solved.legs, 0
    found = False
    slips = [_slips(solved, k) for k in range(len(flat(legs)))]
    largest: dict[str, float] = {}
    for _, own in slips:
        for contact, values in own.items():
            largest[contact] = max(largest.get(contact, 0.0), float(np.abs(values).max()))
    for number, arc in enumerate(flat(solved.legs)):
        t, own = slips[number]
        for contact, mode in arc.modes.items():
            window = _touching(t, own[contact], TOUCH * largest[contact]) if mode else None
            if window is not None:
                before = len(flat(legs))
                legs = inserted(legs, number + shift, contact, 0, *window)
                shift += len(flat(legs)) - before
                found = True
                break
    return pruned(legs, 0.0) if found else None


def neighbours(legs: Sequence[Leg], width: float) -> Iterator[tuple[Leg, ...]]:
    """Sequences with one arc more, of about `width` [s], where changes of mode meet.

    At the end of a leg the modes of the next one come earlier, or its own last longer, contact by
    contact; inside a leg contacts that change together change one after the other.
    """
    for k, (leg, then) in enumerate(pairwise(legs)):
        last, first = leg.arcs[-1], then.arcs[0]
        for contact in _changes(last, first):
            early = {**last.modes, contact: first.modes[contact]}
            yield _with_leg(legs, k, _appended(leg, early, width))
            late = {**first.modes, contact: last.modes[contact]}
            yield _with_leg(legs, k + 1, _prepended(then, late, width))
    for k, leg in enumerate(legs):
        for i, (before, after) in enumerate(pairwise(leg.arcs)):
            changes = _changes(before, after)
            for contact in changes if len(changes) > 1 else ():
                modes = {**before.modes, contact: after.modes[contact]}
                half = min(width, before.duration, after.duration) / 2
                t = before.end
                parts = (
                    replace(before, end=t - half),
                    Arc(modes, t - half, t + half),
                    replace(after, begin=t + half),
                )
                yield _with_leg(
                    legs, k, replace(leg, arcs=(*leg.arcs[:i], *parts, *leg.arcs[i + 2 :]))
                )


def _slips(solved: Solved, number: int) -> tuple[Array, dict[str, Array]]:
    """Times of all points of an arc, and sliding velocities there by contact."""
    span = solved.transcription.problem.spans[number]
    arc = flat(solved.legs)[number]
    fractions = solved.transcription.fractions(number)
    t = arc.begin + fractions * arc.duration
    names = list(arc.modes)
    values = [
        solved.known.along(span.model, span.model.expression(f"{name}_slip"), t)[0]
        for name in names
    ]
    return t, dict(zip(names, values, strict=True))


def _touching(t: Array, slip: Array, touch: float) -> tuple[float, float] | None:
    """From when to when the slip is next to nothing, away from the ends of the arc."""
    near = np.flatnonzero(np.abs(slip[1:-1]) < touch) + 1
    if not near.size:
        return None
    return float(t[near[0] - 1]), float(t[near[-1] + 1])


def _changes(before: Arc, after: Arc) -> list[str]:
    """Contacts of both arcs whose modes differ."""
    both = [name for name in before.modes if name in after.modes]
    return [name for name in both if before.modes[name] != after.modes[name]]


def _with_leg(legs: Sequence[Leg], number: int, leg: Leg) -> tuple[Leg, ...]:
    return (*legs[:number], leg, *legs[number + 1 :])


def _appended(leg: Leg, modes: dict[str, int], width: float) -> Leg:
    last = leg.arcs[-1]
    t = last.end - min(width, last.duration / 2)
    return replace(leg, arcs=(*leg.arcs[:-1], replace(last, end=t), Arc(modes, t, last.end)))


def _prepended(leg: Leg, modes: dict[str, int], width: float) -> Leg:
    first = leg.arcs[0]
    t = first.begin + min(width, first.duration / 2)
    return replace(leg, arcs=(Arc(modes, first.begin, t), replace(first, begin=t), *leg.arcs[1:]))
