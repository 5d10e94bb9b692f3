"""Assembly of a `Model` from the equations of a mechanism.

Accelerations are eliminated: a = -M^-1 (balance at a = 0). For free bodies (absolute coordinates)
the inverse has a closed form,

    M^-1 = diag(I/m, E' J_W^-1 E / 4 + p p' / weight),

with J_W the inertia in world components; otherwise M is factorised as L D L'. Algebraic variables
are the multipliers of constraints, the applied forces of laws with true sticking, and the normal
forces that depend on reactions.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import casadi as ca
import numpy as np

from symfric.foundation.checks import listed
from symfric.foundation.numeric import Scalar, is_symbolic
from symfric.foundation.parameters import Variable
from symfric.foundation.variable import at_start, stacked, symbols_of
from symfric.laws.catalogue import law_name
from symfric.laws.composed.isotropic import SpatialSlip
from symfric.model import Contact, Model, Monitor, Output, Variables, kinds
from symfric.model.parts import Holonomic, Inner
from symfric.multibody.applied import Rest, rests, solve_mass
from symfric.multibody.contact import depends_on_load
from symfric.multibody.equations import Equations, normals_with
from symfric.multibody.prepare import PreparedMechanism, with_cuts, without_friction
from symfric.multibody.results import Put, constraint_units, results, sketch
from symfric.multibody.slips import Slip, events, keeps_deflection, slips

AT_REST = 1e-9
"""Sliding velocity [m/s] below which figures show a law with modes as sticking.

Stick of such laws is exact up to rounding.
"""


def assemble(name: str, made: PreparedMechanism, index: int) -> Model:
    """Return the model of the mechanism `name`; `index` is that of `Holonomic`."""
    eq, cut = made.eq, with_cuts(made)
    a0, lam0, N0 = without_friction(made)
    groups = rests(f"mechanism '{name}'", made, a0)
    contacts = slips(eq, N0.tolist(), groups)
    units = eq.multipliers
    multipliers = tuple(
        Variable(label, units[label], start=x, nominal=max(1.0, abs(x)), doc="multiplier")
        for label, x in zip(made.labels, lam0.tolist(), strict=True)
    )
    inner = None if cut is None else _inner(cut, eq, contacts)
    # balls are excluded: their slip is a vector
    frictional = tuple(_contact(s) for s in contacts if not isinstance(s.contact.law, SpatialSlip))
    model = partial(_model, name, index, multipliers)
    opening = partial(_opened, model, made, contacts, frictional)
    return model(made, contacts, groups, inner, frictional, opening)


def _model(
    name: str, index: int, multipliers: Variables, made: PreparedMechanism,
    contacts: Sequence[Slip], groups: Sequence[Rest], inner: Inner | None,
    frictional: tuple[Contact, ...] = (), opening: Callable[[], Model] | None = None,
) -> Model:  # fmt: skip
    """Return the model of a mechanism with the given contacts and groups of sticking contacts."""
    eq, p = made.eq, made.p
    pressed, loops = [s for s in contacts if s.unknown], [v for r in groups for v in r.direction]
    states = [v for s in contacts for v in s.states]
    before = ca.vertcat(eq.lam, eq.F)
    after = ca.vertcat(symbols_of(multipliers), stacked(s.force for s in contacts))
    needed = stacked(rest.needed([contacts[i].force for i in rest.members]) for rest in groups)
    balance, normals, phi_ddot = ca.substitute(
        [eq.balance, stacked(s.normal - s.N for s in pressed), eq.phi_ddot], [before], [after]
    )
    rates = (*(t.rate for t in eq.turns), *(s.rate for s in contacts), *(0.0 for _ in loops))
    mechanics = Holonomic(
        eq.n, eq.phi, eq.a, ca.vertcat(balance, phi_ddot, needed, normals), stacked(rates),
        partial(solve_mass, eq), eq.norms, index, inner,
        *_pressing(contacts, ca.vertcat(eq.a, before)), applied=len(groups),
    )  # fmt: skip

    def put(expressions: Sequence[ca.SX]) -> list[ca.SX]:
        known = ca.substitute(list(expressions), [before], [after])
        return ca.substitute(known, [eq.a], [mechanics.explicit[0]])

    scales = {s.contact.name: at_start(s.contact.friction.law.velocity_scale, p) for s in contacts}
    limits = {s.contact.name: AT_REST for s in contacts if s.contact.friction.law.inputs}
    limits |= {name: float(x) for name, x in scales.items() if x.is_regular()}
    closed = [s for s in contacts if s.force is not s.contact.F]
    watched = [s for s in closed if scales[s.contact.name].is_regular()]
    return Model(
        name=name,
        x=(*made.q, *made.qd, *(t.angle for t in eq.turns), *states, *loops),
        z=(*multipliers, *(r.force for r in groups), *(v for s in pressed for v in s.unknown)),
        u=made.u,
        p=p,
        outputs=_outputs(eq, contacts, put, [v.unit for v in multipliers]),
        monitors=tuple(
            Monitor(v, s.contact.friction.law.velocity_scale)
            for s in watched
            for v in ca.vertsplit(s.contact.slip)
        ),
        events=events(closed, groups, made.qd),
        t=eq.kin.t,
        details=lambda: results(eq, made.open_reactions, symbols_of(p), put),
        sketch=lambda: sketch(eq, limits),
        holonomic=mechanics,
        contacts=frictional,
        opening=opening,
    )


def _contact(s: Slip) -> Contact:
    """Return the contact as `Model` describes it."""
    contact = s.contact
    width = Variable(
        f"{contact.pressed}_eps", "N", start=contact.friction.eps, lower=0.0, doc="width of |f|"
    )
    # a normal force that contains reactions is no expression of the model's symbols
    known = s.N is not s.normal or depends_on_load(contact.friction.law)
    return Contact(
        contact.name, contact.slip, s.N if known else ca.SX(np.nan), contact.friction.law,
        given=s.inputs, states=s.states, force=contact.F, turning=contact.friction.turning,
        widths={"eps": width} if s.N is not s.normal and contact.normal_symbol.is_empty() else {},
    )  # fmt: skip


def _opened(
    model: Callable[..., Model], made: PreparedMechanism, contacts: Sequence[Slip],
    frictional: Sequence[Contact],
) -> Model:  # fmt: skip
    """Return the model with friction forces as inputs; balls keep their laws."""
    eps: dict[str, Scalar] = {s.contact.pressed: s.contact.friction.eps for s in contacts}
    widths = {v.name: v for c in frictional for v in c.widths.values()}
    eps |= {name: widths[f"{name}_eps"].symbol for name in eps if f"{name}_eps" in widths}
    names = {c.name for c in frictional}
    free: list[Slip] = []
    for s, normal in zip(contacts, normals_with(made.eq, eps), strict=True):
        given = s.N is s.normal or not s.contact.normal_symbol.is_empty()
        own = s if given else replace(s, normal=normal)
        if s.contact.name in names:
            own = replace(own, states=(), rate=ca.SX(0, 1), force=s.contact.F, inputs={})
        free.append(own)
    u = (*made.u, *(c.variable for c in frictional))
    return model(replace(made, u=u, p=(*made.p, *widths.values())), free, (), None)


def _inner(cut: Equations, eq: Equations, contacts: Sequence[Slip]) -> Inner | None:
    """Return the balance and normal forces with inner unknowns, ordered from the tips to the base.

    The unknowns are eliminated link by link in this order.
    """
    cuts, links = cut.kin.cuts, eq.kin.topology.links
    if cuts is None:
        return None
    pairs = zip(contacts, cut.normals, strict=True)
    normals = (normal - s.N for s, normal in pairs if s.unknown)
    f, values = ca.substitute(
        [ca.vertcat(cut.balance, *normals), cuts.values],
        [ca.vertcat(cut.a, cut.F, cut.N)],
        [ca.vertcat(eq.a, stacked(s.force for s in contacts), eq.N)],
    )
    kept, symbols = cuts.needed(f), cuts.symbols
    of_link: list[list[ca.SX]] = [[] for _ in links]
    for i in kept:
        of_link[cuts.links[i]].append(symbols[i])
    groups: list[ca.SX] = []
    for k, link in reversed(list(enumerate(links))):
        # inner unknowns first: their right-hand sides are zero, so they cost no stage
        groups.append(stacked(of_link[k]))
        groups.append(ca.vertcat(*(column[link.rows] for column in (eq.q, eq.qd, eq.a))))
        own = (s for s in contacts if s.contact.link == link.joint.name)
        groups.append(symbols_of(v for s in own for v in (*s.unknown, *s.states)))
    return Inner(symbols[kept], values[kept], f, tuple(groups))


def _pressing(contacts: Sequence[Slip], reactive: ca.SX) -> tuple[ca.SX, tuple[str, ...], str]:
    """Return the normal forces that could become negative, their names, and advice.

    These are the normal forces that are unknowns or are given by inputs or parameters. A sum of
    absolute values of reactions cannot become negative. The advice is shown if there is no
    solution.
    """
    values, words, bristles = list[ca.SX](), list[str](), list[Slip]()
    for s in contacts:
        friction = s.contact.friction
        law = type(friction.law).__name__
        given = is_symbolic(friction.normal) or is_symbolic(friction.preload)
        if s.unknown or (given and not ca.depends_on(s.N, reactive)):
            values.append(s.N / (s.unknown[0].nominal if s.unknown else 1.0))
            words.append(f"normal force of {s.contact.place} with {law}")
        if s.unknown and keeps_deflection(friction.law):
            bristles.append(s)
    return stacked(values), tuple(words), _advice(bristles)


def _advice(bristles: Sequence[Slip]) -> str:
    """Return advice to replace laws whose bristles keep the deflection of a larger load.

    The reference load N_0 of the replacement is the smallest load at the start, so that the
    bristles of all joints are at least as stiff as before.
    """
    if not bristles:
        return ""
    laws = {type(s.contact.friction.law).__name__: s.contact.friction.law for s in bristles}
    joints, (name, law) = dict.fromkeys(s.contact.part for s in bristles), next(iter(laws.items()))
    least = min(float(at_start(s.unknown[0].start, ())) for s in bristles)
    load = f"{float(f'{max(least, 1.0):.2g}'):g}"
    return (
        f"bristles of {', '.join(laws)} in joint{'s' * (len(joints) > 1)} {listed(joints)} keep "
        "the deflection of a larger load and stiffen without bound as it falls: write "
        f"LoadNormalised({name}(...), N_0={load}) for {name}(...), the same at {load} N "
        f"(--law 'load_normalised({law_name(law)})' --set N_0={load})"
    )


def _sizes(slip: Slip) -> tuple[ca.SX, ca.SX]:
    """Return the sliding velocity and friction force; smoothed magnitudes if they are vectors."""
    law = slip.contact.law
    if not isinstance(law, SpatialSlip):
        return slip.contact.slip, slip.force
    speed = ca.sqrt(ca.sumsqr(slip.contact.slip) + law.v_eps**2)
    return speed, slip.contact.friction.magnitude(*ca.vertsplit(slip.force))


def _outputs(
    eq: Equations, contacts: Sequence[Slip], put: Put, multipliers: list[str]
) -> dict[str, Output]:
    """Return the results of the contacts, energies, and the residuals of the constraints.

    `multipliers` are the units of the multipliers.
    """
    found: dict[str, Output] = {}
    levels = ("constraint_position", "constraint_velocity", "constraint_acceleration")
    norms = [eq.phi, eq.phi_dot, eq.phi_ddot]
    expressions = put([*(s.normal for s in contacts), *norms])
    for s, normal in zip(contacts, expressions, strict=False):
        contact, name, force = s.contact, s.contact.name, s.contact.unit("N")
        if s.N is s.normal:
            doc = "level of the friction moment" if contact.friction.turning else "normal force"
            found[f"{contact.pressed}_N"] = Output(normal, force, doc, kinds.NORMAL_FORCE)
        slip, size = _sizes(s)
        doc = "sliding velocity, for a ball its magnitude"
        found[f"{name}_slip"] = Output(slip, contact.unit("m/s"), doc)
        doc = "friction force opposing the slip"
        found[f"{name}_friction"] = Output(size, force, doc, kinds.FRICTION)
        power = ca.dot(s.force, contact.slip)
        found[f"{name}_power"] = Output(power, "W", "power dissipated by friction", kinds.FRICTION)
    kinetic, potential = eq.kinetic, eq.potential
    for name, value, doc in (
        ("kinetic", kinetic, "kinetic energy"),
        ("potential", potential, "potential energy"),
        ("energy", kinetic + potential, "kinetic and potential energy"),
    ):
        found[name] = Output(value, "J", doc, kinds.ENERGY)
    if eq.m:
        units = constraint_units(multipliers)
        for label, unit, value in zip(levels, units, expressions[len(contacts) :], strict=True):
            norm, doc = ca.sqrt(ca.sumsqr(value)), "norm of the constraints on this level"
            found[label] = Output(norm, unit, doc, kinds.CONSTRAINTS)
    return found
