"""Models with set-valued friction in place of the laws, for simulations with exact friction.

    slip    F = law.sliding(v, N, side)     until v = 0
    stick   F with d slip/dt = 0            until it exceeds the static level of a side

Each contact that can stick gets the law `Exact(law)`, whose modes `simulate` decides. A model with
explicit equations is closed with these laws again. In a mechanism, the force of a contact in stick
is an algebraic variable, and contacts of a loop of one degree of freedom stick together, as in
`symfric.multibody.applied`.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import casadi as ca

from ocp.formulation.changed_models import further_states, rebuilt
from ocp.formulation.phase import Array
from ocp.friction.mode_models import loops_of, mode_model, slip_change
from ocp.friction.smooth_models import law_of, sticking
from symfric.foundation.numeric import Scalar
from symfric.foundation.parameters import Variable, parametric
from symfric.foundation.variable import stacked, symbols_of
from symfric.integrator.running.contact_modes import STILL
from symfric.laws import Exact
from symfric.laws.base import smooth
from symfric.model import Contact, Event, Model, Output, kinds
from symfric.model.contact import APPLIED
from symfric.model.forces import with_forces
from symfric.model.parts import Holonomic
from symfric.multibody.applied import Rest, forward
from symfric.multibody.contact import JointContact
from symfric.multibody.joint import JointFriction
from symfric.multibody.slips import Slip, events

OVERLOAD = 1e-9
"""Excess of a force in stick over its static level at break-away, relative to this level."""
LIFTED = 1e-9
"""Magnitude [N] up to which a normal force may be negative."""
LIFTS = "_lifts"
"""Suffix of the event that ends a simulation when a normal force becomes negative."""


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


def start_modes(
    exact: Model, t: float, x: Mapping[str, float], p: Array, modes: Mapping[str, int]
) -> dict[str, float]:
    """Return the modes of contacts without velocity at the start, as states of an exact model.

    Args:
        exact: the exact model.
        t: start time [s].
        x: start values by name.
        p: values of the parameters.
        modes: contact -> mode before the start, 0 by default.
    """
    held = [c for c in exact.contacts if isinstance(c.law, Tolerant)]
    slips, nominal = stacked(c.slip for c in held), exact.nominal("x")
    at = ca.Function("slips", [exact.t, exact.vector("x"), exact.vector("p")], [slips])
    values = at(t, [x.get(v.name, 0.0) for v in exact.x], p).full()[:, 0]
    found: dict[str, float] = {}
    for c, v in zip(held, values, strict=True):
        slope = ca.DM(ca.jacobian(ca.SX(c.slip), exact.vector("x")).sparsity(), 1).full()[0] != 0
        if abs(v) <= STILL * max(nominal[slope], default=1.0):
            found[f"{c.name}_mode"] = float(modes.get(c.name, 0))
    return found


def _made(model: Model) -> Model:
    bare, held = model.open, sticking(model)
    mode_model(model, dict.fromkeys((c.name for c in model.contacts), 0))  # may refuse it
    outputs = {f"{c.name}_F": Output(c.force, c.unit("N"), "friction force") for c in held}
    exact = {c.name: _exact(c) for c in held}
    if bare.holonomic is not None:
        return _mechanism(model, bare.holonomic, tuple(exact.values()), outputs)
    contacts = tuple(exact.get(c.name, c) for c in model.contacts)
    inputs = {c.variable.name for c in contacts}
    lifts = tuple(
        Event(f"{c.name}{LIFTS}", c.N + LIFTED, -1, terminal=True, at_start=True)
        for c in contacts if not ca.SX(c.N).is_constant()
    )  # fmt: skip
    return replace(
        bare, u=tuple(v for v in bare.u if v.name not in inputs), contacts=contacts,
        outputs={**bare.outputs, **outputs}, events=(*lifts, *bare.events), opening=None,
    )  # fmt: skip


def _exact(c: Contact) -> Contact:
    """Return a contact with the set-valued form of its law; its mode starts at the sign of slip."""
    law = c.law.law if isinstance(c.law, Exact) else law_of(c)
    begin = ca.SX(smooth.sign(c.slip, 0.0))
    mode = Variable(f"{c.name}_mode", "1", start=begin, kind=kinds.MODE)
    return replace(c, law=Tolerant(law), states=(mode,), given=c.further, widths={}, bare=False)


def _mechanism(
    model: Model, mechanics: Holonomic, contacts: tuple[Contact, ...], outputs: dict[str, Output]
) -> Model:
    """Return a mechanism with the given contacts, and with their forces as `outputs`."""
    bare, groups = model.open, _groups(model, mechanics, contacts)
    exact = _carrying(contacts, groups)
    directions = tuple(v for rest in groups for v in rest.direction)
    modes = (*(v for c in exact for v in c.states), *directions)
    bare = rebuilt(bare, **further_states(bare, modes, ca.SX.zeros(len(modes))))
    forces = {c.name: c.sliding(1) for c in model.contacts} | {c.name: c.friction for c in exact}
    needed = [rest.needed([exact[i].friction for i in rest.members]) for rest in groups]
    z = tuple(rest.force for rest in groups)
    changes = with_forces(model, bare, forces, z=z, alg=stacked(needed))
    made, closed = replace(bare, **changes), changes["holonomic"]
    kept = closed.rates[: mechanics.rates.numel(), 0]
    rates = ca.vertcat(kept, *(c.rate for c in exact), *(ca.SX(0) for _ in directions))
    own = events([_slip(c) for c in exact], groups, _rates(bare, mechanics))
    outputs = {n: replace(o, expression=forces[n.removesuffix("_F")]) for n, o in outputs.items()}
    return rebuilt(
        made, events=(*own, *made.events), holonomic=replace(closed, rates=rates),
        outputs={**made.outputs, **outputs}, contacts=exact, opening=lambda: model.open,
    )  # fmt: skip


def _carrying(contacts: Sequence[Contact], groups: Sequence[Rest]) -> tuple[Contact, ...]:
    """Return the contacts with the forces that they carry in stick."""
    found, levels = list(contacts), [c.static_level() for c in contacts]
    for rest in groups:
        shares = rest.shares([levels[i] for i in rest.members])
        for i, g, F_e in zip(rest.members, rest.along, shares, strict=True):
            c = replace(found[i], given={**found[i].given, APPLIED: F_e})
            if rest.direction:
                # a contact at its dead centre has no velocity that could determine its mode
                begin = forward(g) * smooth.sign(rest.rate, 0.0)
                c = replace(c, states=tuple(replace(v, start=begin) for v in c.states))
            found[i] = c
    return tuple(found)


def _groups(model: Model, mechanics: Holonomic, contacts: Sequence[Contact]) -> list[Rest]:
    """Return the groups of contacts that stick together, in the order of the contacts.

    The factor 1 of the accelerations has no effect in stick. In slip, the applied force exceeds a
    level in the direction of sliding only if the contact accelerates in it.
    """
    qd, one = _rates(model.open, mechanics), ca.SX(1)
    names, found = [c.name for c in contacts], list[Rest]()
    for loop in loops_of(model):
        members = tuple(names.index(c.name) for c in loop.members)
        name = f"{loop.members[0].name}_loop"
        rate, change = (ca.dot(loop.tangent, x) for x in (symbols_of(qd), mechanics.a))
        begin, force = ca.SX(smooth.sign(rate, 0.0)), Variable(f"{name}_{APPLIED}", "")
        direction = Variable(f"{name}_direction", "1", start=begin, kind=kinds.MODE)
        still = tuple(
            v.name for v, g in zip(qd, ca.vertsplit(loop.tangent), strict=True) if g.nnz()
        )
        group = name, members, loop.along, rate, change, force, one, True, (direction,), still
        found.append(Rest(*group))
    inside = {i for rest in found for i in rest.members}
    for i, c in enumerate(contacts):
        if i not in inside:
            force = Variable(f"{c.name}_{APPLIED}", c.unit("N"), doc="friction force in stick")
            change = slip_change(model, c)
            still = tuple(v.name for v in qd if ca.depends_on(c.slip, v.symbol))
            still = still if len(still) == 1 else ()
            group = c.name, (i,), (one,), ca.SX(c.slip), change, force, one, True, (), still
            found.append(Rest(*group))
    return sorted(found, key=lambda rest: rest.members)


def _rates(bare: Model, mechanics: Holonomic) -> tuple[Variable, ...]:
    return bare.x[mechanics.n : 2 * mechanics.n]


def _slip(c: Contact) -> Slip:
    """Return a contact as `symfric.multibody` describes it, for its events."""
    law, slip, N = law_of(c), ca.SX(c.slip), ca.SX(c.N)
    at = JointContact(c.name, c.name, JointFriction(law), law, c.name, slip, c.force, "")
    given = {name: ca.SX(value) for name, value in c.given.items()}
    return Slip(at, (), N, N, c.states, c.rate, c.friction, given)
