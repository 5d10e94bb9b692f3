"""How a mechanism is shown: its sketch, a small picture, and a table of its parts."""

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.foundation.numeric import equals
from symfric.foundation.parameters import Variable
from symfric.foundation.shown import Shown, Table, among, counted, figure_of
from symfric.foundation.style import EDGE, colour
from symfric.model.sketch import Mark, Part, Sketch, Symbol
from symfric.multibody.constraints import Constraint
from symfric.multibody.equations import Equations
from symfric.multibody.forces import Force, SpringDamper
from symfric.multibody.joint import Joint
from symfric.multibody.kinematics import Kinematics
from symfric.multibody.spatial import GROUND, Body
from symfric.multibody.topology import body_of, frame_at

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Array = NDArray[np.float64]
SPRING, DAMPER = (Symbol(line=line, anchored=True) for line in ("spring", "damper"))
SIZE = 2.6
"""Of the small picture [inch]."""
AWAY = 1e-6
"""Extent across a plane, relative to that in it, below which all lies in the plane."""


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


def thumbnail(drawn: Sketch, places: Array) -> "Figure":
    """Bodies as lines to their frames, joints as dots.

    Args:
        drawn: the sketch of a mechanism.
        places: its places as numbers, shape (12, k).
    """
    from matplotlib.figure import Figure  # noqa: PLC0415  (matplotlib is slow to import)

    at = places[9:].T
    across, up = _view(drawn, places)
    flat = np.column_stack([at @ across, at @ up])
    figure = Figure(figsize=(SIZE, SIZE), layout="constrained")
    axis = figure.subplots()
    _draw(axis, drawn, flat)
    axis.set_aspect("equal", "datalim")
    axis.margins(0.15)
    axis.tick_params(labelsize=6)
    axis.set_xlabel(f"{_called(across)} [m]", fontsize=7)
    axis.set_ylabel(f"{_called(up)} [m]", fontsize=7)
    axis.grid(alpha=0.3)
    return figure


def _view(drawn: Sketch, places: Array) -> tuple[Array, Array]:
    """Directions to the right and upwards: of the plane of the hinges, or seen from aside."""
    hinges = [places[6:9, mark.b] for mark in drawn.marks if mark.symbol.hinge]
    normal = hinges[0] if hinges else np.array([0.0, 1.0, 0.0])
    if any(np.linalg.norm(np.cross(normal, other)) > AWAY for other in hinges):
        normal = np.array([0.45, -0.8, 0.4]) / np.linalg.norm([0.45, -0.8, 0.4])
    upwards = np.eye(3)[1 if abs(normal[2]) > 0.99 else 2]
    up = upwards - (upwards @ normal) * normal
    up /= np.linalg.norm(up)
    across = np.cross(up, normal)
    return (across if across.sum() > 0 else -across), up


def _draw(axis: "Axes", drawn: Sketch, flat: Array) -> None:
    for k, part in enumerate(drawn.parts):
        if part.fixed:
            continue
        for place in (*part.corners, *part.ends):
            _line(axis, flat, (part.centre, place), color=colour(k), linewidth=2.2)
        axis.plot(*flat[part.centre], "s", color=colour(k), markersize=4)
    for mark in drawn.marks:
        if mark.symbol.line:
            _line(axis, flat, (mark.a, mark.b), color="0.35", linewidth=1.0, linestyle="--")
        face = EDGE if mark.grounded else "white"
        axis.plot(*flat[mark.b], "o", markersize=5, markerfacecolor=face, color=EDGE)


def _line(axis: "Axes", flat: Array, ends: Sequence[int], **how: object) -> None:
    axis.plot(flat[list(ends), 0], flat[list(ends), 1], **how)  # pyright: ignore[reportArgumentType]


def _called(direction: Array) -> str:
    """The axis of the world along a direction, or what else it is."""
    k = int(np.argmax(np.abs(direction)))
    if abs(direction[k]) < 1 - AWAY:
        return "seen from aside"
    return ("" if direction[k] > 0 else "-") + "xyz"[k]


def shown(
    name: str,
    bodies: Iterable[Body],
    joints: Sequence[Joint],
    forces: Iterable[Force],
    constraints: Iterable[Constraint],
    inputs: Sequence[Variable],
) -> Shown:
    """A mechanism as a table of its parts; `build` says what is wrong with it."""
    bodies = [body for body in bodies if body.name != GROUND]
    loops = max(0, len(joints) - len(bodies))
    counts = [
        counted(len(bodies), "body", "bodies"),
        counted(len(joints), "joint"),
        counted(loops, "closed loop"),
    ]
    rows = [(b.name, "body", f"{figure_of(b.mass)} kg", "") for b in bodies]
    rows += [_shown_joint(joint) for joint in joints]
    for force in forces:
        ends = _between(force.a, force.b) if isinstance(force, SpringDamper) else ""
        rows.append((force.name, type(force).__name__, ends, ""))
    rows += [(c.name, type(c).__name__, "", "") for c in constraints]
    after = [f"inputs: {among(v.name for v in inputs)}"] if inputs else []
    return Shown(
        f"mechanism '{name}': {', '.join(counts)}",
        table=Table(("name", "what", "", "friction"), tuple(rows)),
        after=tuple(after),
    )


def _shown_joint(joint: Joint) -> tuple[str, ...]:
    rubs = type(joint.friction.law).__name__ if joint.friction is not None else ""
    return joint.name, type(joint).__name__, _between(joint.parent, joint.child), rubs


def _between(a: str, b: str) -> str:
    return f"{a} - {b}"
