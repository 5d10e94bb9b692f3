"""Models with set-valued friction in place of the laws, for simulations with exact friction.

    slip    F = law.sliding(v, N, side)     until v = 0
    stick   F with d slip/dt = 0            until it exceeds the static level of a side

Each contact that can stick gets the law `Exact(law)`, whose modes `simulate` decides. A model with
explicit equations is closed with these laws again. In a mechanism, the force of a contact in stick
is an algebraic variable, and contacts of a loop of one degree of freedom stick together, as in
`symfric.multibody.applied`.
"""

from collections.abc import Sequence
from dataclasses import replace

import casadi as ca

from ocp.formulation.changed_models import further_states, rebuilt
from ocp.friction.mode_models import Loop, loops_of, slip_change
from ocp.friction.smooth_models import sticking
from symfric.foundation.numeric import Scalar
from symfric.foundation.parameters import Variable, parametric
from symfric.foundation.variable import stacked, symbols_of
from symfric.laws import Exact, Law
from symfric.laws.base import smooth
from symfric.model import Contact, Event, Model, Output, kinds
from symfric.model.contact import APPLIED
from symfric.model.forces import with_forces
from symfric.multibody import joint
from symfric.multibody.applied import Rest, forward
from symfric.multibody.slips import Slip, events

OVERLOAD = 1e-9
"""Excess of a force in stick over its static level at break-away, relative to this level."""
LIFTED = 1e-9
"""Magnitude [N] up to which a normal force may be negative."""


@parametric
class Tolerant(Exact):
    """`Exact` with a static level that is larger by a rounding error.

    Optimal motions hold contacts exactly at their static level.
    """

    @property
    def velocity_scale(self) -> Scalar:
        """Velocity scale of a law with modes, or as in `Exact`."""
        modes = getattr(self.law, "has_mode", False)
        return self.law.velocity_scale if modes else super().velocity_scale

    def static_level(self, N: Scalar, side: int = 1, **inputs: Scalar) -> Scalar:
        """Return the static level [N] with the margin `OVERLOAD`."""
        return (1 + OVERLOAD) * super().static_level(N, side, **inputs)


def exact_model(model: Model) -> Model:
    """Return `model` with exact friction; cached in the model.

    States of laws are replaced by "<contact>_mode", and the outputs "<contact>_F" are the friction
    forces. Names are otherwise unchanged. An event "<contact>_lifts" ends a simulation where a
    normal force becomes negative, except in mechanisms, which `simulate` checks.

    Raises:
        ValueError: a law without sliding force and static level, or sticking contacts whose forces
            the equations do not determine.
    """
    if "exact model" not in model.memory:
        model.memory["exact model"] = _made(model)
    return model.memory["exact model"]


def _made(model: Model) -> Model:
    bare, held = model.open, sticking(model)
    outputs = {f"{c.name}_F": Output(c.force, c.unit("N"), "friction force") for c in held}
    bare = replace(bare, outputs={**bare.outputs, **outputs}) if bare.holonomic is None else bare
    exact = {c.name: _exact(c, model) for c in held}
    contacts = tuple(exact.get(c.name, c) for c in model.contacts)
    if bare.holonomic is not None:
        return _mechanism(model, contacts, outputs)
    inputs = {c.variable.name for c in contacts}
    lifts = tuple(
        Event(f"{c.name}_lifts", c.N + LIFTED, -1, terminal=True, at_start=True)
        for c in contacts if not ca.SX(c.N).is_constant()
    )  # fmt: skip
    return replace(
        bare, u=tuple(v for v in bare.u if v.name not in inputs), contacts=contacts,
        events=(*lifts, *bare.events), opening=None,
    )  # fmt: skip


def _exact(c: Contact, model: Model) -> Contact:
    """Return a contact with the set-valued form of its law; its mode starts at the sign of slip."""
    slip_change(model, c)  # raises ValueError for slips that depend on an input
    law = c.law.law if isinstance(c.law, Exact) else c.law
    assert isinstance(law, Law)
    begin = ca.SX(smooth.sign(c.slip, 0.0))
    mode = Variable(f"{c.name}_mode", "1", start=begin, kind=kinds.MODE)
    return replace(c, law=Tolerant(law), states=(mode,), given=c.further, widths={}, bare=False)


def _mechanism(model: Model, contacts: Sequence[Contact], outputs: dict[str, Output]) -> Model:
    """Return a mechanism with the given contacts, and with their forces as `outputs`."""
    bare = model.open
    exact = [c for c in contacts if isinstance(c.law, Tolerant)]
    groups = _groups(model, exact)
    levels = [c.static_level() for c in exact]
    applied: dict[int, ca.SX] = {}
    for rest in groups:
        applied |= zip(rest.members, rest.shares([levels[i] for i in rest.members]), strict=True)
    exact = [_with(c, applied[i]) for i, c in enumerate(exact)]
    for rest in groups:
        for i, g in zip(rest.members, rest.along, strict=True) if rest.direction else ():
            # a contact at its dead centre has no velocity that could determine its mode
            begin = forward(g) * smooth.sign(rest.rate, 0.0)
            (mode,) = exact[i].states
            exact[i] = replace(exact[i], states=(replace(mode, start=begin),))
    forces = {c.name: c.sliding(1) for c in contacts} | {c.name: c.friction for c in exact}
    needed = [rest.needed([exact[i].friction for i in rest.members]) for rest in groups]
    z = tuple(rest.force for rest in groups)
    made = replace(bare, **with_forces(model, bare, forces, z=z, alg=stacked(needed)))
    directions = tuple(v for rest in groups for v in rest.direction)
    states = (*(v for c in exact for v in c.states), *directions)
    rates = ca.vertcat(*(c.rate for c in exact), ca.SX.zeros(len(directions)))
    changes = further_states(made, states, rates)
    qd = bare.x[bare.holonomic.n : 2 * bare.holonomic.n]
    own = events([_slip(c) for c in exact], groups, qd)
    return rebuilt(made, events=(*own, *made.events), **changes)


def _with(c: Contact, F_e: ca.SX) -> Contact:
    return replace(c, given={**c.given, APPLIED: F_e})


def _groups(model: Model, contacts: Sequence[Contact]) -> list[Rest]:
    """Return the groups of contacts that stick together, ordered as the contacts.

    The factor 1 of the accelerations has no effect in stick; in slip, the applied force exceeds a
    level in the direction of sliding only if the contact accelerates in it.
    """
    names = [c.name for c in contacts]
    found: list[Rest] = []
    loops = loops_of(model)
    for loop in loops:
        members = tuple(names.index(c.name) for c in loop.members)
        found.append(_loop(model, loop, members))
    inside = {i for rest in found for i in rest.members}
    for i, c in enumerate(contacts):
        if i not in inside:
            doc = "friction force for zero sliding acceleration"
            force = Variable(f"{c.name}_{APPLIED}", c.unit("N"), doc=doc)
            one, change = ca.SX(1), slip_change(model, c)
            found.append(Rest(c.name, (i,), (one,), ca.SX(c.slip), change, force, one, True, (),
                              (f"{c.name}_rate",)))  # fmt: skip
    return sorted(found, key=lambda rest: rest.members)


def _loop(model: Model, loop: Loop, members: tuple[int, ...]) -> Rest:
    mechanics = model.open.holonomic
    assert mechanics is not None
    qd = model.open.x[mechanics.n : 2 * mechanics.n]
    rate, change = ca.dot(loop.tangent, symbols_of(qd)), ca.dot(loop.tangent, mechanics.a)
    name = f"{loop.members[0].name}_loop"
    begin = ca.SX(smooth.sign(rate, 0.0))
    direction = Variable(f"{name}_direction", "1", start=begin, kind=kinds.MODE)
    still = tuple(v.name for v, g in zip(qd, ca.vertsplit(loop.tangent), strict=True) if g.nnz())
    return Rest(name, members, loop.along, rate, change, Variable(f"{name}_{APPLIED}", ""),
                ca.SX(1), True, (direction,), still)  # fmt: skip


def _slip(c: Contact) -> Slip:
    """Return a contact as `symfric.multibody` describes it, for its events."""
    slip = ca.SX(c.slip)
    friction = joint.JointFriction(c.law)
    at = joint.Contact(c.name, c.name, "", friction, c.law, c.name, slip, c.force)
    N = ca.SX(c.N)
    return Slip(at, (), N, N, c.states, c.rate, c.friction, dict(c.given))
