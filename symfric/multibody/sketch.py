"""What is drawn of a mechanism: bodies as lines to their frames, joints, rods and springs."""

from collections.abc import Iterable, Mapping

import casadi as ca

from symfric.foundation.numeric import equals
from symfric.model.sketch import Mark, Part, Sketch, Symbol
from symfric.multibody.body import GROUND
from symfric.multibody.equations import Equations
from symfric.multibody.forces import Force, SpringDamper
from symfric.multibody.joint import Joint
from symfric.multibody.kinematics import Kinematics
from symfric.multibody.topology import body_of, frame_at

SPRING, DAMPER = (Symbol(line=line, anchored=True) for line in ("spring", "damper"))


def sketch(
    eq: Equations, joints: Iterable[Joint], forces: Iterable[Force], scales: Mapping[str, float]
) -> Sketch:
    """The sketch of a mechanism.

    Args:
        eq: its equations.
        joints, forces: what is drawn beside bodies.
        scales: contact -> velocity [m/s] below which it counts as sticking.
    """
    drawn = [f for f in forces if isinstance(f, SpringDamper)]
    held = dict.fromkeys(place for joint in joints for place in (joint.parent, joint.child))
    bodies = eq.kin.topology.bodies
    named = (f"{body}.{frame}" for body, b in bodies.items() for frame in b.frames if frame)
    pulled = (place for force in drawn for place in force.places())
    used = {place: k for k, place in enumerate({**held, **dict.fromkeys((*named, *pulled))})}
    only = {place for force in drawn for place in force.places()} - held.keys()
    columns = [_frame(eq.kin, place) for place in used]
    parts: list[Part] = []
    for name in eq.kin.motion:
        own = [(place, k) for place, k in used.items() if body_of(place) == name]
        corners = tuple(k for place, k in own if place not in only)
        ends = tuple(k for place, k in own if place in only)
        parts.append(Part(name, len(columns), corners, ends, fixed=name == GROUND))
        columns.append(_centre(eq.kin, name))
    marks = [_joint(eq, joint, used, scales) for joint in joints]
    for force in drawn:
        symbol = DAMPER if equals(force.stiffness, 0.0) else SPRING
        marks.append(_mark(force.name, symbol, (force.a, force.b), used))
    return Sketch(ca.horzcat(*columns), tuple(parts), tuple(marks))


def _joint(eq: Equations, joint: Joint, used: dict[str, int], scales: Mapping[str, float]) -> Mark:
    slips = tuple(
        (f"{c.name}_slip", scales[c.name])
        for c in eq.contacts
        if c.joint == joint.name and c.name in scales
    )
    return _mark(joint.name, joint.symbol, (joint.parent, joint.child), used, slips)


def _mark(
    name: str,
    symbol: Symbol,
    ends: tuple[str, str],
    used: dict[str, int],
    slips: tuple[tuple[str, float], ...] = (),
) -> Mark:
    """A mark whose first end is on the ground, if one is and it may be the first."""
    grounded = GROUND in (body_of(end) for end in ends[: 1 if symbol.slot else 2])
    if grounded and body_of(ends[0]) != GROUND and symbol.turnable:
        ends = ends[1], ends[0]
    return Mark(name, symbol, used[ends[0]], used[ends[1]], slips, grounded)


def _frame(kin: Kinematics, place: str) -> ca.SX:
    """Axes and position of the frame "body.frame", shape (12, 1)."""
    frame, motion = frame_at(kin.topology.bodies, place), kin.motion[body_of(place)]
    return ca.densify(ca.vertcat(ca.vec(motion.R @ frame.R), motion.point(frame.p)[0]))


def _centre(kin: Kinematics, name: str) -> ca.SX:
    """Axes of a body and its centre of mass, shape (12, 1)."""
    motion = kin.motion[name]
    at = motion.point(kin.topology.bodies[name].c)[0]
    return ca.densify(ca.vertcat(ca.vec(motion.R), at))
