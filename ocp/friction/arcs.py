"""From a sequence of modes to a problem of mode models: one phase for each arc.

What the user has written holds in all arcs of his phases, by name. To it come the conditions under
which the arcs are a motion with exact Coulomb friction and stiction, for each contact:

* it slips to the side of its mode: slip >= 0 or <= 0;
* at rest the reaction is within the static level to both sides: |F| <= F_s;
* where it changes its mode, slip = 0: at the end of slipping, and at the start of what follows;
* what leaves rest, or turns round, breaks away: the force that would hold it at rest under the
  control *after* that instant reaches the static level to that side. It may exceed it, since
  controls jump, so that this is an inequality: equality would exclude such motions, and without it
  a body could leave rest although friction can hold it, which costs less and is wrong.

* what comes to rest as the control changes is caught: a moment early, and the control before would
  turn it round. Then it slips back for this moment, and stops only if the force under the control
  after is below that of sliding, not just below the static level.

* what comes to rest is stopped by a share of the sliding force: where slip only touches zero, or
  more than that force would be needed after a jump of the control, the least deviation lets it slip
  on, past the rest.

Conditions that depend on each other are written once, for solvers need independent ones: at rest
slip stays zero by itself, so nothing is asked of it at the end of a rest.
Source: Brogliato, Nonsmooth Mechanics, 3rd ed., 2016, ch. 5; Betts, Practical Methods for Optimal
Control, 2nd ed., 2010, 2.8 and 3.7 (phases, linkage conditions).
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from math import inf
from typing import TypeVar, final

import casadi as ca

from ocp.formulation.phase import Chain, Free, Phase, Range, Start, meet
from ocp.formulation.problem import Problem
from ocp.formulation.statement import Duration
from ocp.friction.mode_models import SIDES, excess, rubbing
from ocp.friction.sequence import Arc, Leg
from ocp.friction.transfer import CAUGHT, FIRST, LEFT, PULLED, STOPPED, arc_model, carrier
from symfric.foundation.variable import stacked
from symfric.model import Contact, Model

MARGIN = 1e-2
"""Share of the static level that a rest keeps away from it at first, and by which a control that
jumps exceeds it where it breaks away: a smooth law creeps over its peak a little below and stays on
it a little above for long, and where the force follows its limit, controls that are held make a saw
of it. Where the contact leaves by a force that cannot jump the rest gives that up at last."""

FADE = 1e-3
"""For how long before, as a share of the whole duration."""

LEVEL = -1e-6
"""What is allowed on that side: at its end the rest is at its level, which the condition of
breaking away says already, and two conditions would depend on each other."""

SIGN = 1e-7
"""Sliding velocity by which one that is no state may have the wrong sign: at the ends of slipping,
where it is zero, two conditions would depend on each other."""

Ranges = dict[str, Range]
Value = TypeVar("Value")


@final
@dataclass(frozen=True, eq=False)
class Place:
    """An arc among its neighbours.

    Attributes:
        number: of the arc.
        model: the user's, with contacts.
        leg: the leg it is in.
        opens, closes: whether it is the first, the last one of the user's phase.
        ends: whether it is the last one of its leg.
        before, after: modes of the neighbours, where states are continuous; else empty.
        leaves: resting contact -> the side to which it will leave, 0 where it does not.
    """

    number: int
    model: Model
    arc: Arc
    leg: Leg
    opens: bool
    closes: bool
    ends: bool
    before: Mapping[str, int]
    after: Mapping[str, int]
    leaves: Mapping[str, int]


def places_of(problem: Problem, legs: Sequence[Leg]) -> tuple[Place, ...]:
    """All arcs among their neighbours."""
    pairs = [(leg, k) for leg in legs for k in range(len(leg.arcs))]
    arcs = [leg.arcs[k] for leg, k in pairs]
    phases = [leg.phase for leg, _ in pairs]
    broken = [
        k > 0 and phases[k] != phases[k - 1] and bool(problem.chain[phases[k]].link)
        for k in range(len(arcs))
    ]
    found: list[Place] = []
    for i, (leg, k) in enumerate(pairs):
        first, last = i == 0, i == len(arcs) - 1
        leaves = {c: 0 for c, mode in arcs[i].modes.items() if not mode}
        for c in leaves:
            for later in arcs[i + 1 :]:
                if later.modes.get(c) != 0:
                    leaves[c] = later.modes.get(c, 0)
                    break
        found.append(
            Place(
                number=i,
                model=problem.chain[leg.phase].model,
                arc=arcs[i],
                leg=leg,
                opens=first or phases[i - 1] != leg.phase,
                closes=last or phases[i + 1] != leg.phase,
                ends=k == len(leg.arcs) - 1,
                before={} if first or broken[i] else arcs[i - 1].modes,
                after={} if last or broken[i + 1] else arcs[i + 1].modes,
                leaves=leaves,
            )
        )
    return tuple(found)


def in_arcs(
    problem: Problem,
    legs: Sequence[Leg],
    sizes: Mapping[str, float],
    at_rest: Sequence[str],
    shortest: float,
    margin: float = MARGIN,
) -> Problem:
    """The problem of mode models that follows the sequence `legs`, one phase for each arc.

    Args:
        problem: the user's.
        legs: its arcs; their durations are where the solver starts.
        sizes: contact -> typical static level [N], which scales conditions on forces.
        at_rest: contacts that are at rest at the very start.
        shortest: least duration of an arc [s].
        margin: share of the static level that rests and controls that break away keep from it.
    """
    places = places_of(problem, legs)
    margins = margin, FADE * sum(leg.duration for leg in legs)
    phases = [_phase(problem, place, sizes, at_rest, shortest, margins) for place in places]
    states = {v.name for v in phases[0].model.x}
    signals = {name for phase in phases for name in (*phase.model.signals, *phase.model.further)}
    parameters = {v.name for phase in phases for v in phase.model.p}
    return replace(
        problem,
        phases=Chain(tuple(phases)),
        bounds=_only(problem.bounds, signals),
        p=_only(problem.p, parameters),
        choose=_only(problem.choose, parameters),
        durations=_durations(problem, legs),
        periodic=tuple(name for name in problem.periodic if name in states),
    )


def _phase(
    problem: Problem,
    place: Place,
    sizes: Mapping[str, float],
    at_rest: Sequence[str],
    shortest: float,
    margin: tuple[float, float],
) -> Phase:
    """The phase of one arc: what the user says of it, and the conditions of its modes."""
    base, modes = problem.chain[place.leg.phase], place.arc.modes
    released = [name for name in modes if _breaks_away(place, name, at_rest)]
    limited = {*problem.rates, *base.rates}
    tight = _tight(place, limited)
    leaving = {name: side for name, side in tight.items() if place.after.get(name) == side}
    caught, stopped = _caught(place, limited)
    model = arc_model(base.model, modes, released, leaving, caught, stopped, sizes, margin)
    start: Ranges = dict(base.start) if place.opens else {}
    link: dict[str, Start] = dict(base.link) if place.opens else {}
    end = _end(base, place)
    if leaving:
        start, end = start | {LEFT: (0.0, None)}, end | {LEFT: 0.0}
        link |= {LEFT: None} if place.number else {}
    bounds: Ranges = dict(base.bounds)
    for contact in rubbing(base.model):
        zero = _starts_at_rest(place, contact, at_rest)
        start |= zero
        if place.number:
            link |= dict.fromkeys(zero)
        end = _end_of(place, contact, end)
        inside = _inside(problem, place, contact, tight, margin[0])
        bounds |= inside
        if not modes[contact.name]:  # between the start and the first point, too
            for side in SIDES.values():
                row = inside[f"{contact.name}_{side}"]
                start[f"{contact.name}{FIRST}{side}"] = row
            if contact.name in caught:
                start[f"{contact.name}{CAUGHT}"] = (0.0, None)
            if contact.name in stopped:
                start[f"{contact.name}{STOPPED}"] = (0.0, None)
        if contact.name in released:
            start[f"{contact.name}{PULLED}"] = _pull(place, contact.name, limited, margin[0])
    signals = {*model.signals, *model.further}
    return replace(
        base,
        model=model,
        T=_duration(problem, place, shortest),
        start=_only(start, signals),
        end=_only(end, signals),
        via={},
        bounds=_only(bounds, signals),
        link=_only(link, signals),
        joins=base.joins if place.opens else (),
        cost=base.cost if place.closes or base.cost is None else replace(base.cost, end=()),
        p=_only(base.p, {v.name for v in model.p}),
        name="",
    )


def _breaks_away(place: Place, name: str, at_rest: Sequence[str]) -> bool:
    """Whether the contact slips from the start of this arc on, and did not slip that way before."""
    mode = place.arc.modes[name]
    if not mode:
        return False
    return place.before[name] != mode if name in place.before else (
        not place.number and name in at_rest
    )  # fmt: skip


def _pull(place: Place, name: str, limited: Collection[str], margin: float) -> Range:
    """How far the force that would hold a contact exceeds its static level when it breaks away.

    One that cannot jump was below it until then: it reaches the level exactly.
    """
    modes = place.arc.modes
    if _jumps(place.model, modes, name, limited):
        return (margin, None)
    alone = all(modes[other] == mode for other, mode in place.before.items() if other != name)
    return 0.0 if alone and place.before.get(name) == 0 else (0.0, None)


def _starts_at_rest(place: Place, contact: Contact, at_rest: Sequence[str]) -> Ranges:
    """The state that carries the slip, zero at the start of a rest and where the mode changes."""
    name, state = contact.name, _state(place, contact)
    mode = place.arc.modes[name]
    was = place.before.get(name)
    begins = mode == 0 and (was is not None or (not place.number and name in at_rest))
    changes = was is not None and was != mode
    return {state: 0.0} if state and (begins or changes) else {}


def _end(base: Phase, place: Place) -> Ranges:
    """What the user asks for at the end of this arc: that of the phase, or of a via point."""
    if place.closes:
        return dict(base.end)
    return dict(base.via[sorted(base.via)[place.leg.part]]) if place.ends else {}


def _end_of(place: Place, contact: Contact, end: Ranges) -> Ranges:
    """`end` with slip = 0 where slipping ends, and without it where rest implies it."""
    name, state = contact.name, _state(place, contact)
    mode, then = place.arc.modes[name], place.after.get(contact.name)
    if mode and then is not None and then != mode:
        return end | {state or f"{name}_slip": 0.0}
    return end if mode else {n: r for n, r in end.items() if n != state}


def _caught(place: Place, limited: Collection[str]) -> tuple[dict[str, int], dict[str, int]]:
    """Contacts that come to rest under a control that may jump, and all that come to rest.

    With the sides to which they slipped.
    """
    modes = place.arc.modes
    stopped = {n: side for n, side in place.before.items() if side and modes.get(n) == 0}
    caught = {
        name: side
        for name, side in stopped.items()
        if _jumps(place.model, {**modes, name: 1}, name, limited)
    }
    return caught, stopped


def _tight(place: Place, limited: Collection[str]) -> dict[str, int]:
    """Resting contacts that will leave by a force that cannot jump, and to which side."""
    modes = place.arc.modes
    return {
        name: side
        for name, side in place.leaves.items()
        if side and not _jumps(place.model, {**modes, name: side}, name, limited)
    }


def _inside(
    problem: Problem, place: Place, contact: Contact, tight: Mapping[str, int], margin: float
) -> Ranges:
    """The side of slipping, or the room of a rest, over the whole arc."""
    name, mode = contact.name, place.arc.modes[contact.name]
    if not mode:
        open_side = tight.get(name)
        return {
            f"{name}_{row}": (LEVEL if side == open_side else margin, None)
            for side, row in SIDES.items()
        }
    found = carrier(problem.chain[place.leg.phase].model, contact)
    if found is None:
        return {f"{name}_slip": (-SIGN, None) if mode > 0 else (None, SIGN)}
    state, factor = found
    half = (0.0, inf) if mode * factor > 0 else (-inf, 0.0)
    return {state: meet(problem.spans[place.leg.phase].box(state), half)}


def _state(place: Place, contact: Contact) -> str | None:
    """The state that carries the slip of a contact, if there is one."""
    found = carrier(place.model, contact)
    return None if found is None else found[0]


def _jumps(model: Model, modes: Mapping[str, int], name: str, limited: Collection[str]) -> bool:
    """Whether the force that holds a contact follows an input that may jump."""
    inputs = stacked(v.symbol for v in model.u if v.name not in limited)
    return ca.depends_on(excess(model, modes, name, modes[name]), inputs)


def _duration(problem: Problem, place: Place, shortest: float) -> float | Free:
    """A duration of its own; that of the phase where it is all of that."""
    T = problem.chain[place.leg.phase].T
    if place.opens and place.closes:
        return T
    most = T.upper if isinstance(T, Free) else T
    guess = min(max(place.arc.duration, 2 * shortest), most)
    return Free(shortest, most, guess)


def _durations(problem: Problem, legs: Sequence[Leg]) -> tuple[Duration, ...]:
    """What the durations of the arcs add up to: those of legs, and what the user asks for."""
    first = 0
    found: list[Duration] = []
    of_phase: dict[int, list[int]] = {}
    for leg in legs:
        numbers = list(range(first, first + len(leg.arcs)))
        first += len(leg.arcs)
        of_phase.setdefault(leg.phase, []).extend(numbers)
        phase = problem.chain[leg.phase]
        if isinstance(phase.T, Free):
            if len(numbers) > 1:
                found.append((numbers, Free(phase.T.lower, phase.T.upper)))
        elif len(numbers) > 1 or phase.via:
            fractions = [0.0, *sorted(phase.via), 1.0]
            share = fractions[leg.part + 1] - fractions[leg.part]
            found.append((numbers, share * phase.T))
    for phases, total in problem.durations:
        found.append(([n for phase in phases for n in of_phase[phase]], total))
    return tuple(found)


def _only(given: Mapping[str, Value], names: Collection[str]) -> dict[str, Value]:
    """What is `given` for these names."""
    return {name: value for name, value in given.items() if name in names}
