"""Results of a mechanism: additional outputs and the sketch."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace

import casadi as ca

from symfric.foundation.numeric import Scalar, equals, is_number
from symfric.foundation.variable import stacked, strays
from symfric.model import Output
from symfric.model.kinds import WORK
from symfric.model.sketch import Arrow, Mark, Part, Sketch, Symbol
from symfric.multibody.contact import LeverContact
from symfric.multibody.equations import Equations
from symfric.multibody.forces import Gravity, JointSpringDamper, SpringDamper
from symfric.multibody.joint import COMPONENTS, FORCE_NAMES
from symfric.multibody.joints import Distance, Universal
from symfric.multibody.kinematics import Motion
from symfric.multibody.spatial import GROUND
from symfric.multibody.topology import body_of

Put = Callable[[Sequence[ca.SX]], list[ca.SX]]
"""Function that rewrites expressions of accelerations and forces in the symbols of the model."""


def results(eq: Equations, undetermined: Sequence[str], p: ca.SX, put: Put) -> dict[str, Output]:
    """Return reactions, motions of centres of mass, and powers, by name.

    Args:
        eq: equations of the mechanism.
        undetermined: names of joints whose reactions are not unique and are omitted.
        p: symbols of the parameters.
        put: function that rewrites expressions in the symbols of the model.
    """
    still = ca.vertcat(eq.q, eq.angles, p)
    found = [*_reactions(eq, undetermined), *_elements(eq), *_centres(eq), *_work(eq, still)]
    values = put([output.expression for _, output in found])
    own = {str(eq.q[i]) for i in range(eq.n)}
    return {
        name: replace(output, expression=value)
        for (name, output), value in zip(found, values, strict=True)
        if name not in own  # absolute coordinates are the centres of mass
    }


def _reactions(eq: Equations, undetermined: Sequence[str]) -> Iterator[tuple[str, Output]]:
    """Yield the reaction force [N] and moment [N m] on the child of each joint at its joint point.

    Components are those of the joint's frame on the child. Friction, motors and springs along or
    about the axis of the joint are not included.
    """
    for name, joint in eq.kin.topology.joints.items():
        if name in undetermined:
            continue
        column = ca.vertcat(*eq.reactions[name])
        for component in joint.transmits:
            unit, what = ("N", "force") if component in FORCE_NAMES else ("N m", "moment")
            value = column[COMPONENTS.index(component)]
            doc = f"{what} of joint '{name}' on its child along {component[1]} of its frame"
            yield f"{name}_{component}", Output(value, unit, doc)
        if isinstance(joint, Distance):
            relative = eq.kin.relative(joint)
            along = ca.dot(relative.R @ column[:3], relative.p)
            yield f"{name}_tension", Output(-along / joint.length, "N", "force in the rod")


def _elements(eq: Equations) -> Iterator[tuple[str, Output]]:
    """Yield loads, powers, tensions and the locking ratio of each element with friction."""
    for contact in eq.contacts:
        if not isinstance(contact, LeverContact):
            continue
        name = contact.name
        for letter, load in zip("ab", contact.transmitted(eq.kin), strict=False):
            unit = "N" if load.joint.linear(load.direction) else "N m"
            on = f"the child of '{load.joint.name}' in its direction {load.direction}"
            yield f"{name}_load_{letter}", Output(load.value, unit, f"load by '{name}' on {on}")
            yield f"{name}_power_{letter}", Output(load.power(eq.kin), "W", f"power to {on}")
        for end, tension in contact.tensions().items():
            yield f"{name}_{end}", Output(tension, "N", f"tension of the {end} end")
        try:
            ratio = contact.locking
        except ValueError:
            continue
        yield f"{name}_locking", Output(ratio, "1", f"{contact.measure}; locks from 1")


def _centres(eq: Equations) -> Iterator[tuple[str, Output]]:
    """Yield the positions [m] and velocities [m/s] of all centres of mass in the world."""
    for name, motion in eq.kin.motion.items():
        if name == GROUND:
            continue
        at, v = motion.point(eq.kin.topology.bodies[name].c)
        for i, axis in enumerate("xyz"):
            yield f"{name}_{axis}", Output(at[i], "m", f"centre of mass of '{name}' along {axis}")
        for i, axis in enumerate("xyz"):
            yield f"{name}_v{axis}", Output(v[i], "m/s", f"its velocity along {axis}")


def _work(eq: Equations, still: ca.SX) -> Iterator[tuple[str, Output]]:
    """Yield the powers [W] that change the conserved energy, and this energy [J].

    The conserved energy is the kinetic energy plus the potentials that depend on the symbols
    `still` only. Other potentials, for example that of a spring attached to an input or to time,
    are excluded: the whole power of such a force is yielded.
    """
    kin, conserved = eq.kin, eq.kinetic
    positions = ca.vertcat(eq.q, eq.angles)
    rates = ca.vertcat(eq.qd, stacked(turn.rate for turn in eq.turns))
    for force in eq.forces:
        energy = ca.SX(force.energy(kin))
        own = not strays(energy, still)
        if own:
            conserved += energy
        if own and force.conservative:
            continue
        power = sum((load.power(kin) for load in force.loads(kin)), ca.SX(0))
        if own:
            power += ca.jtimes(energy, positions, rates)
        yield f"{force.name}_work_rate", Output(power, "W", f"power input of '{force.name}'", WORK)
    if eq.contacts:
        taken = sum((-ca.dot(c.F, c.slip) for c in eq.contacts), ca.SX(0))
        doc = "power input of friction, above zero where it drives"
        yield "friction_work_rate", Output(taken, "W", doc, WORK)
    if eq.m and not eq.phi_t.is_zero():
        drive = ca.dot(eq.lam, eq.phi_t)
        yield "drive_work_rate", Output(drive, "W", "power input of prescribed motions", WORK)
    yield "conserved", Output(conserved, "J", "energy without potentials of time or inputs")


CONSTRAINT = {"N": "m", "N m": "rad", "N/m": "m^2"}
"""Unit of a constraint by the unit of its multiplier; their product is an energy."""


def constraint_units(units: list[str]) -> tuple[str, str, str]:
    """Return the units of the norms of phi, phi' and phi''; "" if constraints differ in unit."""
    kinds = {CONSTRAINT.get(unit, "") for unit in units}
    unit = kinds.pop() if len(kinds) == 1 else ""
    return (unit, f"{unit}/s", f"{unit}/s^2") if unit else ("", "", "")


SPRING, DAMPER, STRUT = (Symbol(line=line, anchored=True) for line in ("spring", "damper", "strut"))
SPIRAL, LINK = Symbol(line="spiral"), Symbol(line="link")
AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0)}
"""Directions of joints in the axes of a frame; all others are along or about z."""


def sketch(eq: Equations, scales: Mapping[str, float]) -> Sketch:
    """Return the sketch of a mechanism.

    Args:
        eq: equations of the mechanism.
        scales: sliding velocity [m/s] below which a contact is drawn as sticking, by its name.
    """
    kin = eq.kin
    bodies, joints = kin.topology.bodies, kin.topology.joints.values()
    springs = [f for f in eq.forces if isinstance(f, SpringDamper)]
    ends = [place for joint in joints for place in (joint.parent, joint.child)]
    pulled = [place for force in eq.forces for place in force.places()]
    named = (f"{body}.{frame}" for body, b in bodies.items() for frame in b.frames if frame)
    used = {place: k for k, place in enumerate(dict.fromkeys((*ends, *named, *pulled)))}
    columns = [_column(kin.motion[body_of(p)], kin.frame(p).R, kin.frame(p).p) for p in used]
    parts: list[Part] = []
    for name, motion in kin.motion.items():
        own = [(place, k) for place, k in used.items() if body_of(place) == name]
        corners = tuple(k for place, k in own if place in ends or place not in pulled)
        far = tuple(k for place, k in own if place not in ends and place in pulled)
        mass = _amount(bodies[name].mass, "kg")
        drawn = ((k, kin.frame(place).outline) for place, k in own)
        outlines = tuple((k, lines) for k, lines in drawn if lines is not None)
        parts.append(Part(name, len(columns), corners, far, name == GROUND, mass, outlines))
        columns.append(_column(motion, ca.SX.eye(3), bodies[name].c))
    marks: list[Mark] = []
    for joint in joints:
        mark = _mark(joint.name, joint.symbol, (joint.parent, joint.child), used)
        rubs = tuple(c.name for c in eq.contacts if c.part == joint.name)
        slips = tuple((f"{name}_slip", scales[name]) for name in rubs if name in scales)
        label = joint.name if joint.symbol.line else ""
        marks.append(replace(mark, slips=slips, contacts=rubs, label=label))
    for force in springs:
        mark = _mark(force.name, _springy(force), (force.a, force.b), used)
        label = _amounts(force, "N/m", "N s/m") or force.name
        marks.append(replace(mark, label=label))
    marks += _elements_drawn(eq, used, parts[0].centre)
    return Sketch(ca.horzcat(*columns), tuple(parts), tuple(marks), arrows=tuple(_arrows(eq, used)))


def _elements_drawn(eq: Equations, used: Mapping[str, int], ground: int) -> Iterator[Mark]:
    """Yield the marks of forces and constraints other than gravity and springs between places.

    Inputs that act on joints have arrows. An element without joints and places is named at the
    place `ground`.
    """
    for force in eq.forces:
        if isinstance(force, JointSpringDamper):
            joint, direction = force.place(eq.kin)
            slides = joint.linear(direction)
            units = ("N/m", "N s/m") if slides else ("N m/rad", "N m s/rad")
            driven = ca.SX(force.actuator).is_symbolic()
            if label := _amounts(force, *units) or ("" if driven else force.name):
                turned = Symbol() if equals(force.stiffness, 0.0) else SPIRAL
                ends = joint.parent, joint.child
                mark = _mark(force.name, _springy(force) if slides else turned, ends, used)
                yield replace(mark, label=label)
    joints = eq.kin.topology.joints
    rubbing = {c.part: (c.name,) for c in eq.contacts if isinstance(c, LeverContact)}
    for part in (*eq.constraints, *eq.forces):
        if not isinstance(part, Gravity | SpringDamper | JointSpringDamper):
            at = [used[joints[name].child] for name, _ in part.joints()]
            at = at + [used[place] for place in part.places()] or [ground]
            rubs = rubbing.get(part.name, ())
            symbol = LINK if at[0] != at[-1] else Symbol()
            label = "" if rubs else part.name
            yield Mark(part.name, symbol, at[0], at[-1], contacts=rubs, label=label)


def _springy(force: SpringDamper | JointSpringDamper) -> Symbol:
    if equals(force.damping, 0.0):
        return SPRING
    return DAMPER if equals(force.stiffness, 0.0) else STRUT


def _amounts(force: SpringDamper | JointSpringDamper, stiffness: str, damping: str) -> str:
    """Return the symbols or values of stiffness and damping, given their units."""
    found = _amount(force.stiffness, stiffness), _amount(force.damping, damping)
    return ", ".join(filter(None, found))


def _arrows(eq: Equations, used: Mapping[str, int]) -> Iterator[Arrow]:
    """Yield the positive directions of the coordinates of joints, and of inputs that act on them.

    Joints without directions, such as balls, have no arrows.
    """
    pushes = [f for f in eq.forces if isinstance(f, JointSpringDamper)]
    for link in eq.kin.topology.links:
        joint = link.joint
        a, b = used[joint.parent], used[joint.child]
        for direction, k in joint.directions.items():
            frame = b if isinstance(joint, Universal) and direction == "y" else a
            turning = not joint.linear(direction)
            axis = AXES.get(direction, (0.0, 0.0, 1.0))
            name = joint.coordinate(k)
            yield Arrow((name, f"{name}_rate"), b, frame, axis, turning)
            for push in pushes:
                drive = ca.SX(push.actuator)
                if drive.is_symbolic() and push.place(eq.kin) == (joint, direction):
                    yield Arrow((str(drive),), b, frame, axis, turning)


def _amount(value: Scalar, unit: str) -> str:
    """Return the name of a symbol, a number with its unit, or nothing for an expression or zero."""
    if is_number(value):
        return f"{float(value):.3g} {unit}" if float(value) else ""
    return str(value) if ca.SX(value).is_symbolic() else ""


def _mark(name: str, symbol: Symbol, ends: tuple[str, str], used: Mapping[str, int]) -> Mark:
    """Return a mark; if possible, its first end is the end that is on the ground."""
    grounded = GROUND in (body_of(end) for end in ends[: 1 if symbol.slot else 2])
    if grounded and body_of(ends[0]) != GROUND and symbol.turnable:
        ends = ends[1], ends[0]
    return Mark(name, symbol, used[ends[0]], used[ends[1]], grounded=grounded)


def _column(motion: Motion, R: ca.SX, offset: ca.SX) -> ca.SX:
    """Return the axes and the position of a place on a body, shape (12, 1)."""
    return ca.densify(ca.vertcat(ca.vec(motion.R @ R), motion.place(offset)))
