"""Friction laws in the contacts of a mechanism: their unknowns, states and events."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import final

import casadi as ca

from symfric.foundation.parameters import Variable
from symfric.foundation.variable import stacked, symbols_of
from symfric.laws import Law
from symfric.laws.base import smooth
from symfric.laws.base.families import FINEST, rests
from symfric.laws.base.law import FORCE
from symfric.model import Event, Variables, kinds
from symfric.model.contact import mode_events
from symfric.multibody.applied import Rest, capacity_of, forward, switches_at
from symfric.multibody.contact import Contact, depends_on_load
from symfric.multibody.equations import Equations


@final
@dataclass(frozen=True, eq=False)
class Slip:
    """Contact with its unknowns in the model.

    Attributes:
        contact: the contact.
        unknown: the normal force as an algebraic variable, if it depends on reactions and the law
            depends on it; otherwise empty.
        N: normal force that the law is evaluated with.
        normal: normal force in terms of accelerations and multipliers.
        states, rate: states of the law and their derivatives.
        force: friction force [N]; for a ball a vector.
        inputs: the applied force by name, if the law needs it.
    """

    contact: Contact
    unknown: Variables
    N: ca.SX
    normal: ca.SX
    states: Variables
    rate: ca.SX
    force: ca.SX
    inputs: dict[str, ca.SX]


def keeps_deflection(law: Law) -> bool:
    """Return True if the deflection of the bristles depends on the load.

    If a deflection of a larger load remains, the damping (`LuGre`) or the rate (`Dahl`) of the
    bristles grows without bound as the load falls. Laws that need more than v and N return False,
    because `LoadNormalised` does not accept them.
    """
    N, z, v = ca.SX.sym("N"), ca.SX.sym("z", len(law.states)), ca.SX.sym("v")
    if law.inputs or not law.states or not ca.depends_on(ca.SX(law.steady_state(v, N)), N):
        return False
    moved = ca.vertcat(ca.SX(law.force(v, N, z)), ca.SX(law.rate(v, N, z)))
    return ca.depends_on(ca.jacobian(moved, N), z)


def slips(
    eq: Equations, normal_at_start: Sequence[float], groups: Sequence[Rest] = ()
) -> tuple[Slip, ...]:
    """Return all contacts with their unknowns.

    Args:
        eq: equations of motion.
        normal_at_start: normal force of each contact at the start [N].
        groups: groups of contacts whose laws need the applied force.
    """
    unknowns, pressing = dict[str, Variable](), list[ca.SX]()
    reactive, normals = ca.vertcat(eq.a, eq.lam, eq.F), ca.densify(stacked(eq.normals))
    loaded = ca.which_depends(normals, reactive, 1, True)
    rows = zip(eq.contacts, eq.normals, normal_at_start, loaded, strict=True)
    for contact, normal, start, depends in rows:
        law, pressed = contact.friction.law, contact.pressed
        if depends and depends_on_load(law):
            doc = f"normal force of {contact.place} with {type(law).__name__}"
            size, kind = max(1.0, abs(start)), kinds.NORMAL_FORCE
            symbol = ca.SX(0, 0) if contact.normal_symbol.is_empty() else contact.normal_symbol
            new = Variable(
                f"{pressed}_N", "N", start=start, nominal=size, doc=doc, symbol=symbol, kind=kind
            )
            normal = unknowns.setdefault(pressed, new).symbol
        pressing.append(normal)
    levels = [capacity_of(c.law, N) if groups else N
              for c, N in zip(eq.contacts, pressing, strict=True)]  # fmt: skip
    applied: dict[int, ca.SX] = {}
    for rest in groups:
        shares = rest.shares([levels[i] for i in rest.members])
        applied |= zip(rest.members, shares, strict=True)
    slides = [c.slip for c in eq.contacts]
    for rest in groups:
        for i, g in zip(rest.members, rest.along, strict=True) if rest.direction else ():
            # a contact at its dead centre has no velocity that could determine its mode
            slides[i] = forward(g) * smooth.sign(rest.rate, 0.0)
    found: list[Slip] = []
    for i, contact in enumerate(eq.contacts):
        law, N = contact.law, pressing[i]
        begin = ca.SX(law.steady_state(slides[i], normal_at_start[i]))
        states = tuple(_states(contact, begin))
        z, inputs = symbols_of(states), {FORCE: applied[i]} if i in applied else {}
        # dense, because these expressions replace the symbols of F
        rate, force = (
            ca.densify(ca.SX(of(contact.slip, N, z, **inputs))) for of in (law.rate, law.force)
        )
        own = unknowns.pop(contact.pressed, None)
        unknown = () if own is None else (own,)
        found.append(Slip(contact, unknown, N, eq.normals[i], states, rate, force, inputs))
    return tuple(found)


def _states(contact: Contact, begin: ca.SX) -> Iterator[Variable]:
    """Yield the states of a law with their names in the model."""
    for i, s in enumerate(contact.law.states):
        name, unit = f"{contact.name}_{s.name}", contact.unit(s.unit)
        kind = kinds.MODE if s.whole else kinds.FRICTION_STATE
        yield Variable(name, unit, start=begin[i], nominal=s.nominal, doc=s.doc, kind=kind)


def events(contacts: Sequence[Slip], groups: Sequence[Rest], rates: Variables) -> tuple[Event, ...]:
    """Return the mode changes of all laws, with the names of states in the model."""
    in_loops = {i for rest in groups if rest.direction for i in rest.members}
    still = {rest.members[0]: rest.still for rest in groups if not rest.direction}
    names = {v.name for v in rates}
    found: list[Event] = []
    for i, slip in enumerate(contacts):
        if i not in in_loops:
            own = slip.contact.rate
            halted = still.get(i, (own,) if own in names else ())
            found += _of_contact(slip, dict.fromkeys(halted, 0.0))
    for rest in groups:
        if rest.direction:
            found += _of_loop(rest, [contacts[i] for i in rest.members])
    return tuple(found)


def _of_contact(slip: Slip, rest: dict[str, float]) -> tuple[Event, ...]:
    """Return the mode changes of a single contact; a stop also sets the states in `rest`.

    A contact that stops always sticks first: only the solution of the stick equations determines
    whether it breaks away again.
    """
    contact, z = slip.contact, symbols_of(slip.states)
    at, sticks = (contact.slip, slip.N, z), bool(slip.inputs)
    return mode_events(
        contact.law.switches, at, slip.inputs, f"{contact.name}_{{}}".format, rest, sticks
    )


def _of_loop(rest: Rest, contacts: Sequence[Slip]) -> Iterator[Event]:
    """Yield the stop, break-away and dead centres of a loop of one degree of freedom."""
    m, T, omega = rest.direction[0].symbol, rest.force.symbol, rest.rate
    top = rest.capacity([capacity_of(s.contact.law, s.N) for s in contacts])
    modes = [_modes(s) for s in contacts]
    still, every = rests(m), [name for names in modes for name in names]
    pull = m * T - top
    ahead = smooth.choose(m * omega > pull, m * omega, pull)
    onward = forward(T)
    away = {
        name: forward(g) * onward
        for g, names in zip(rest.along, modes, strict=True) for name in names
    }  # fmt: skip
    own = rest.direction[0].name
    halt = dict.fromkeys([*every, own, *rest.still], 0.0)
    yield Event(f"{rest.name}_stick", smooth.choose(still, 1.0, ahead), -1, reset=halt)
    yield Event(
        f"{rest.name}_slip", smooth.choose(still, smooth.magnitude(T, 0.0) - top, -1.0), 1,
        reset=away | {own: onward}, at_start=True, rtol=FINEST,
    )  # fmt: skip
    for slip, g, names in zip(contacts, rest.along, modes, strict=True):
        symbols = {v.name: v.symbol for v in slip.states}
        if not g.is_constant():
            ahead = symbols[names[0]] * m * g
            turn = {name: -symbols[name] for name in names}
            yield Event(
                f"{slip.contact.name}_turn", smooth.choose(still, 1.0, ahead), -1, reset=turn
            )


def _modes(slip: Slip) -> list[str]:
    """Return the names of the states that represent the mode of a contact."""
    z = symbols_of(slip.states)
    found = switches_at(slip.contact.law, slip.contact.slip, slip.N, z, ca.SX(0.0))
    return [f"{slip.contact.name}_{state}" for s in found if s.halts for state in s.reset]
