"""Assembly of a `Model` from the equations of a mechanism.

Accelerations are eliminated: a = -M^-1 (balance at a = 0). For free bodies (absolute coordinates)
the inverse has a closed form,

    M^-1 = diag(I/m, E' J_W^-1 E / 4 + p p' / weight),

with J_W the inertia in world components; otherwise M is factorised as L D L'. The multipliers of
loops, the applied forces of laws with true sticking and those normal forces that depend on
reactions are algebraic variables.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import final

import casadi as ca
import numpy as np

from symfric.foundation.checks import listed
from symfric.foundation.numeric import Scalar, is_symbolic
from symfric.foundation.parameters import Variable
from symfric.foundation.variable import at_start, stacked, symbols_of
from symfric.laws.catalogue import law_name
from symfric.laws.composed.isotropic import SpatialSlip
from symfric.model import Contact, Model, Monitor, Output, Variables, kinds
from symfric.model.holonomic import Holonomic, Inner
from symfric.model.sketch import Sketch
from symfric.multibody.applied import Rest, rests, solve_mass
from symfric.multibody.equations import Equations, normals_with
from symfric.multibody.joint import Contact as Rubbing
from symfric.multibody.results import Put, constraint_units, multiplier_units
from symfric.multibody.slips import Slip, depends_on_load, events, keeps_deflection, slips
from symfric.multibody.topology import Topology

AT_REST = 1e-9
"""Sliding velocity [m/s] below which a law with modes sticks in figures: its stick is exact up to
rounding.
"""
Details = Callable[[ca.SX, Put], Mapping[str, Output]]
Drawn = Callable[[Mapping[str, float]], Sketch]


def coordinates(topology: Topology) -> tuple[Variables, Variables]:
    """Joint coordinates and their rates as variables of a model."""
    q: list[Variable] = []
    qd: list[Variable] = []
    for link in topology.links:
        joint = link.joint
        quaternion = range(0) if joint.quaternion is None else range(joint.quaternion, link.n)
        given = zip(joint.coordinates, joint.starts, joint.rates, strict=True)
        for i, ((_, unit), start, rate) in enumerate(given):
            name = joint.coordinate(i)
            per_second = "1/s" if i in quaternion else f"{unit}/s"
            q.append(Variable(name, unit, start=start, doc="joint coordinate", kind=kinds.POSITION))
            qd.append(
                Variable(f"{name}_rate", per_second, start=rate, doc="joint rate", kind=kinds.RATE)
            )
    return tuple(q), tuple(qd)


def assemble(
    name: str,
    eq: Equations,
    q: Variables,
    qd: Variables,
    labels: Sequence[str],
    guess: Mapping[str, np.ndarray],
    p: Variables,
    u: Variables,
    more: tuple[Details, Drawn],
    index: int,
    cut: Equations | None = None,
) -> Model:
    """Return the model of a mechanism.

    Args:
        eq: its equations, in the symbols of q and qd.
        labels: names of the multipliers.
        guess: accelerations "a", multipliers "lam" and normal forces "N" without friction, at the
            start.
        more: functions for further results and the sketch.
        index: 0 or 1, see `Holonomic`.
        cut: the equations of a long chain once more, with cuts.
    """
    groups = rests(f"mechanism '{name}'", eq, (q, qd, guess["a"]), p)
    contacts = slips(eq, guess["N"].tolist(), groups)
    units = multiplier_units(eq)
    multipliers = tuple(
        Variable(
            label,
            units[label],
            start=float(x),
            nominal=max(1.0, abs(float(x))),
            doc="multiplier",
        )
        for label, x in zip(labels, guess["lam"], strict=True)
    )
    machine = _Machine(name, eq, q, qd, multipliers, p, u, more, index)
    inner = None if cut is None else _inner(cut, eq, contacts, stacked(s.force for s in contacts))
    frictional = _frictional(contacts)
    opening = partial(_open, machine, contacts, frictional)
    return _model(machine, contacts, groups, inner, frictional, opening)


@final
@dataclass(frozen=True, eq=False)
class _Machine:
    """Parts of a mechanism that do not depend on its friction forces."""

    name: str
    eq: Equations
    q: Variables
    qd: Variables
    multipliers: Variables
    p: Variables
    u: Variables
    more: tuple[Details, Drawn]
    index: int


def _model(
    machine: _Machine, contacts: Sequence[Slip], groups: Sequence[Rest], inner: Inner | None,
    frictional: tuple[Contact, ...], opening: Callable[[], Model] | None,
) -> Model:  # fmt: skip
    """Return the model of a machine with the contact forces of `contacts`."""
    eq, p = machine.eq, machine.p
    pressed, loops = [s for s in contacts if s.unknown], [v for r in groups for v in r.direction]
    forces = stacked(s.force for s in contacts)
    symbols = symbols_of(machine.multipliers)
    before, after = ca.vertcat(eq.lam, eq.F), ca.vertcat(symbols, forces)
    needed = stacked(rest.needed([contacts[i].force for i in rest.members]) for rest in groups)
    balance, normals, phi_ddot = ca.substitute(
        [eq.balance, stacked(s.normal - s.N for s in pressed), eq.phi_ddot],
        [before],
        [after],
    )
    mechanics = Holonomic(
        eq.n,
        eq.phi,
        eq.a,
        ca.vertcat(balance, phi_ddot, needed, normals),
        stacked((*(t.rate for t in eq.turns), *(s.rate for s in contacts), *(0.0 for _ in loops))),
        partial(solve_mass, eq),
        eq.norms,
        machine.index,
        inner,
        *_pressing(contacts, ca.vertcat(eq.a, before)),
        applied=len(groups),
    )

    def put(expressions: Sequence[ca.SX]) -> list[ca.SX]:
        known = ca.substitute(list(expressions), [before], [after])
        return ca.substitute(known, [eq.a], [mechanics.explicit[0]])

    scales = [(s, x) for s in contacts if np.isfinite(x := _scale(s, p))]
    modal = (s for s in contacts if s.contact.friction.law.inputs)
    names = {s.contact.name: AT_REST for s in modal} | {s.contact.name: x for s, x in scales}
    return Model(
        name=machine.name,
        x=(
            *machine.q,
            *machine.qd,
            *(t.angle for t in eq.turns),
            *(v for s in contacts for v in s.states),
            *loops,
        ),
        z=(
            *machine.multipliers,
            *(r.force for r in groups),
            *(v for s in contacts for v in s.unknown),
        ),
        u=machine.u,
        p=p,
        outputs=_outputs(eq, contacts, put, [v.unit for v in machine.multipliers]),
        monitors=tuple(m for s, _ in scales if s.force is not s.contact.F for m in _watched(s)),
        events=events([s for s in contacts if s.force is not s.contact.F], groups, machine.qd),
        t=eq.kin.t,
        details=lambda: machine.more[0](symbols_of(p), put),
        sketch=lambda: machine.more[1](names),
        holonomic=mechanics,
        contacts=frictional,
        opening=opening,
    )


def _frictional(contacts: Sequence[Slip]) -> tuple[Contact, ...]:
    """Return the contacts of a model, except balls, whose slip is a vector without two sides."""
    return tuple(
        Contact(
            s.contact.name,
            s.contact.slip,
            s.N if _pressed(s) else ca.SX(np.nan),
            s.contact.friction.law,
            given=s.inputs,
            states=s.states,
            force=s.contact.F,
            turning=s.contact.friction.turning,
            widths={"eps": _rounding(s.contact)} if s.N is not s.normal else {},
        )
        for s in contacts
        if not isinstance(s.contact.law, SpatialSlip)
    )


def _pressed(slip: Slip) -> bool:
    """Return True if its normal force is written in the symbols of the model."""
    return slip.N is not slip.normal or depends_on_load(slip.contact.friction.law)


def _rounding(contact: Rubbing) -> Variable:
    """Return the width of |f| in a normal force, as a parameter."""
    eps = contact.friction.eps
    return Variable(f"{contact.pressed}_eps", "N", start=eps, lower=0.0, doc="width of |f|")


def _open(machine: _Machine, contacts: Sequence[Slip], frictional: tuple[Contact, ...]) -> Model:
    """Return the model with friction forces as inputs; balls keep their laws."""
    eps: dict[str, Scalar] = {s.contact.pressed: s.contact.friction.eps for s in contacts}
    widths = {v.name: v for c in frictional for v in c.widths.values()}
    eps |= {name: widths[f"{name}_eps"].symbol for name in eps if f"{name}_eps" in widths}
    free = [
        s if s.N is s.normal else replace(s, normal=normal)
        for s, normal in zip(contacts, normals_with(machine.eq, eps), strict=True)
    ]
    names = {c.name for c in frictional}
    free = [
        replace(s, states=(), rate=ca.SX(0, 1), force=s.contact.F, inputs={})
        if s.contact.name in names
        else s
        for s in free
    ]
    u = (*machine.u, *(c.variable for c in frictional))
    p = (*machine.p, *widths.values())
    return _model(replace(machine, u=u, p=p), free, (), None, (), None)


def _inner(cut: Equations, eq: Equations, contacts: Sequence[Slip], forces: ca.SX) -> Inner | None:
    """Return balance and normal forces with inner unknowns, eliminated link by link from the
    tips.
    """
    cuts, links = cut.kin.cuts, eq.kin.topology.links
    if cuts is None:
        return None
    pairs = zip(contacts, cut.normals, strict=True)
    normals = (normal - s.N for s, normal in pairs if s.unknown)
    f, values = ca.substitute(
        [ca.vertcat(cut.balance, *normals), cuts.values],
        [ca.vertcat(cut.a, cut.F)],
        [ca.vertcat(eq.a, forces)],
    )
    kept = cuts.needed(f)
    of_link: dict[str, list[ca.SX]] = {link.joint.name: [] for link in links}
    for s in contacts:
        of_link[s.contact.joint] += [v.symbol for v in (*s.unknown, *s.states)]
    groups: list[ca.SX] = []
    for k, link in reversed(list(enumerate(links))):
        # inner unknowns first: their right-hand sides are zero, so they cost no stage
        groups.append(stacked(cuts.symbols[i] for i in kept if cuts.links[i] == k))
        groups.append(ca.vertcat(*(column[link.rows] for column in (eq.q, eq.qd, eq.a))))
        groups.append(stacked(of_link[link.joint.name]))
    return Inner(cuts.symbols[kept], values[kept], f, tuple(groups))


def _scale(slip: Slip, p: Variables) -> float:
    """Return the velocity scale of the law at the start values of `p` [m/s]."""
    return float(at_start(slip.contact.friction.law.velocity_scale, p))


def _watched(slip: Slip) -> tuple[Monitor, ...]:
    """Return the monitors of its sliding velocities, on the scale of its law."""
    scale = slip.contact.friction.law.velocity_scale
    return tuple(Monitor(v, scale) for v in ca.vertsplit(slip.contact.slip))


def _pressing(contacts: Sequence[Slip], reactive: ca.SX) -> tuple[ca.SX, tuple[str, ...], str]:
    """Return normal forces that could become negative, their names, and advice if there is no
    solution.

    These are the unknown ones, and those given by inputs or parameters; a sum of absolute values of
    reactions that no law needs cannot become negative.
    """
    values, words, bristles = list[ca.SX](), list[str](), list[Slip]()
    for s in contacts:
        friction, joint = s.contact.friction, s.contact.joint
        law = type(friction.law).__name__
        given = is_symbolic(friction.normal) or is_symbolic(friction.preload)
        if s.unknown or (given and not ca.depends_on(s.N, reactive)):
            values.append(s.N / (s.unknown[0].nominal if s.unknown else 1.0))
            words.append(f"normal force of joint '{joint}' with {law}")
        if s.unknown and keeps_deflection(friction.law):
            bristles.append(s)
    return stacked(values), tuple(words), _advice(bristles)


def _advice(bristles: Sequence[Slip]) -> str:
    """Return advice to replace laws whose bristles keep the deflection of a larger load, once.

    The load of the replacement is the least of those at the start: bristles in all joints are then
    at least as stiff as before.
    """
    if not bristles:
        return ""
    laws = {type(s.contact.friction.law).__name__: s.contact.friction.law for s in bristles}
    joints = dict.fromkeys(s.contact.joint for s in bristles)
    name, law = next(iter(laws.items()))
    least = min(float(at_start(s.unknown[0].start, ())) for s in bristles)
    load = f"{float(f'{max(least, 1.0):.2g}'):g}"
    return (
        f"bristles of {', '.join(laws)} in joint{'s' * (len(joints) > 1)} {listed(joints)} keep "
        "the deflection of a larger load and stiffen without bound as it falls: write "
        f"LoadNormalised({name}(...), N_0={load}) for {name}(...), the same at {load} N "
        f"(--law 'load_normalised({law_name(law)})' --set N_0={load})"
    )


def _sizes(slip: Slip) -> tuple[ca.SX, ca.SX]:
    """Return sliding velocity and friction force; their smooth sizes if they are vectors."""
    law = slip.contact.law
    if not isinstance(law, SpatialSlip):
        return slip.contact.slip, slip.force
    speed = ca.sqrt(ca.sumsqr(slip.contact.slip) + law.v_eps**2)
    return speed, slip.contact.friction.magnitude(*ca.vertsplit(slip.force))


def _outputs(
    eq: Equations, contacts: Sequence[Slip], put: Put, multipliers: list[str]
) -> dict[str, Output]:
    """Return results of the contacts, energies, and the residuals of the constraints.

    `multipliers` are their units.
    """
    found: dict[str, Output] = {}
    levels = ("constraint_position", "constraint_velocity", "constraint_acceleration")
    norms = [eq.phi, eq.phi_dot, eq.phi_ddot]
    expressions = put([*(s.normal for s in contacts), *norms])
    for slip, normal in zip(contacts, expressions, strict=False):
        contact, name = slip.contact, slip.contact.name
        if slip.N is slip.normal:
            what = "level of the friction moment" if contact.friction.turning else "normal force"
            found[f"{contact.pressed}_N"] = Output(
                normal, contact.unit("N"), what, kinds.NORMAL_FORCE
            )
        speed, size = _sizes(slip)
        rate = contact.unit("m/s")
        found[f"{name}_slip"] = Output(speed, rate, "sliding velocity, for a ball its magnitude")
        found[f"{name}_friction"] = Output(
            size, contact.unit("N"), "friction force opposing the slip", kinds.FRICTION
        )
        power = ca.dot(slip.force, contact.slip)
        found[f"{name}_power"] = Output(power, "W", "power dissipated by friction", kinds.FRICTION)
    for name, value, doc in (
        ("kinetic", eq.kinetic, "kinetic energy"),
        ("potential", eq.potential, "potential energy"),
        ("energy", eq.kinetic + eq.potential, "kinetic and potential energy"),
    ):
        found[name] = Output(value, "J", doc, kinds.ENERGY)
    if eq.m:
        units = constraint_units(multipliers)
        for label, unit, value in zip(levels, units, expressions[len(contacts) :], strict=True):
            norm = ca.sqrt(ca.sumsqr(value))
            found[label] = Output(
                norm, unit, "norm of the constraints on this level", kinds.CONSTRAINTS
            )
    return found
