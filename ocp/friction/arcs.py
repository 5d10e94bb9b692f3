"""Multi-phase problem of a mode sequence: one phase of mode models for each arc.

The user's conditions hold by name in all arcs of his phases. In addition, the following conditions
make the arcs a motion with exact Coulomb friction and stiction, for each contact:

* it slips in the direction of its mode: slip >= 0 or <= 0;
* in stick the reaction is within the static level in both directions: |F| <= F_s;
* at a change of mode slip = 0: at the end of slipping, and at the start of the next mode;
* at the end of stick, or at a reversal, it breaks away: the force that would hold it at rest under
  the control *after* that instant reaches the static level in that direction. It may exceed it,
  since controls jump, so this is an inequality: an equality would exclude such motions; without
  the condition a body could leave rest although friction can hold it, with a lower, wrong cost;

* a contact that sticks when the control changes is caught: slightly earlier, the previous control
  would reverse it. It would then slip back for a moment, and stop only if the force under the next
  control is below the sliding force, not just below the static level;

* a contact that sticks is stopped by a share of the sliding force: if slip only touches zero, or
  a larger force would be needed after a jump of the control, the smallest deviation would let it
  continue to slip.

Dependent conditions are stated once, since solvers need independent ones: in stick slip stays zero
by itself, so no condition is imposed on it at the end of stick.
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
"""Initial friction margin: share of the static level that stiction keeps from it, and by which a
jumping control exceeds it at break-away. Near its peak a smooth law creeps below it and stays for
long above it, and where the force follows its limit, held controls make a sawtooth of it. If the
contact breaks away by a force that cannot jump, the margin is reduced to zero at the end."""

FADE = 1e-3
"""Duration of that reduction, as a share of the whole duration."""

LEVEL = -1e-6
"""Friction margin in that direction: at its end stiction is at its level, which the break-away
condition already states, and two conditions would be dependent."""

SIGN = 1e-7
"""Sliding velocity by which one that is not a state may have the wrong sign: at the ends of
slipping, where it is zero, two conditions would be dependent."""

Ranges = dict[str, Range]
Value = TypeVar("Value")


@final
@dataclass(frozen=True, eq=False)
class Place:
    """An arc among its neighbours.

    Attributes:
        number: index of the arc.
        model: the user's, with contacts.
        leg: its mode interval.
        opens, closes: whether it is the first or last one of the user's phase.
        ends: whether it is the last one of its mode interval.
        before, after: modes of the neighbours if states are continuous; else empty.
        leaves: sticking contact -> direction of its next slip, 0 if it keeps sticking.
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
    """Return all arcs among their neighbours."""
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
    """Return the problem of mode models for the sequence `legs`, one phase for each arc.

    Args:
        problem: the user's problem.
        legs: its arcs; their durations are initial values.
        sizes: contact -> typical static level [N], which scales conditions on forces.
        at_rest: contacts that stick at the start.
        shortest: least duration of an arc [s].
        margin: friction margin, as a share of the static level.
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
    """Return the phase of one arc: the user's conditions, and those of its modes."""
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
        if not modes[contact.name]:  # also between the start and the first point
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
    """Return True if the contact starts to slip at the start of this arc, or reverses there."""
    mode = place.arc.modes[name]
    if not mode:
        return False
    return place.before[name] != mode if name in place.before else (
        not place.number and name in at_rest
    )  # fmt: skip


def _pull(place: Place, name: str, limited: Collection[str], margin: float) -> Range:
    """Return the range of the excess of the holding force over the static level at break-away.

    A force that cannot jump was below it until then: it reaches the level exactly.
    """
    modes = place.arc.modes
    if _jumps(place.model, modes, name, limited):
        return (margin, None)
    alone = all(modes[other] == mode for other, mode in place.before.items() if other != name)
    return 0.0 if alone and place.before.get(name) == 0 else (0.0, None)


def _starts_at_rest(place: Place, contact: Contact, at_rest: Sequence[str]) -> Ranges:
    """Return slip = 0 for its state, at the start of stick and at a change of mode."""
    name, state = contact.name, _state(place, contact)
    mode = place.arc.modes[name]
    was = place.before.get(name)
    begins = mode == 0 and (was is not None or (not place.number and name in at_rest))
    changes = was is not None and was != mode
    return {state: 0.0} if state and (begins or changes) else {}


def _end(base: Phase, place: Place) -> Ranges:
    """Return the user's conditions at the end of this arc, if it ends a phase or at a via point."""
    if place.closes:
        return dict(base.end)
    return dict(base.via[sorted(base.via)[place.leg.part]]) if place.ends else {}


def _end_of(place: Place, contact: Contact, end: Ranges) -> Ranges:
    """Return `end` with slip = 0 at the end of slipping, and without it if stick implies it."""
    name, state = contact.name, _state(place, contact)
    mode, then = place.arc.modes[name], place.after.get(contact.name)
    if mode and then is not None and then != mode:
        return end | {state or f"{name}_slip": 0.0}
    return end if mode else {n: r for n, r in end.items() if n != state}


def _caught(place: Place, limited: Collection[str]) -> tuple[dict[str, int], dict[str, int]]:
    """Return contacts that stop under a control that may jump, and all contacts that stop.

    Both with the direction of the previous slip.
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
    """Return sticking contacts that break away by a force that cannot jump -> direction."""
    modes = place.arc.modes
    return {
        name: side
        for name, side in place.leaves.items()
        if side and not _jumps(place.model, {**modes, name: side}, name, limited)
    }


def _inside(
    problem: Problem, place: Place, contact: Contact, tight: Mapping[str, int], margin: float
) -> Ranges:
    """Return the direction of slip, or the friction margins in stick, over the whole arc."""
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
    """Return the state that is proportional to the slip of a contact, if there is one."""
    found = carrier(place.model, contact)
    return None if found is None else found[0]


def _jumps(model: Model, modes: Mapping[str, int], name: str, limited: Collection[str]) -> bool:
    """Return True if the force that holds a contact depends on an input that may jump."""
    inputs = stacked(v.symbol for v in model.u if v.name not in limited)
    return ca.depends_on(excess(model, modes, name, modes[name]), inputs)


def _duration(problem: Problem, place: Place, shortest: float) -> float | Free:
    """Return a free duration of the arc, or that of the phase if the arc is the whole phase."""
    T = problem.chain[place.leg.phase].T
    if place.opens and place.closes:
        return T
    most = T.upper if isinstance(T, Free) else T
    guess = min(max(place.arc.duration, 2 * shortest), most)
    return Free(shortest, most, guess)


def _durations(problem: Problem, legs: Sequence[Leg]) -> tuple[Duration, ...]:
    """Return the sums of durations: of mode intervals, and as given by the user."""
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
    """Return the entries of `given` for these names."""
    return {name: value for name, value in given.items() if name in names}
