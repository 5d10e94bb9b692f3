"""Parts of a block of a mechanism: friction of joints, a payload, variable gravity."""

from copy import copy
from dataclasses import replace
from typing import NamedTuple

import casadi as ca

from symfric.codegen.blocks.block import Block
from symfric.codegen.blocks.from_law import law_block
from symfric.foundation.numeric import equals, is_number
from symfric.foundation.parameters import Variable
from symfric.foundation.variable import stacked, symbols_of
from symfric.model import Variables
from symfric.multibody import GROUND, Body, Mechanism
from symfric.multibody.contact import Contact
from symfric.multibody.element_friction import ElementFriction
from symfric.multibody.forces import Gravity
from symfric.multibody.joint import JointFriction
from symfric.multibody.spatial import Frame, skew, vector


class ContactStep(NamedTuple):
    """Friction of one contact over a step.

    Attributes:
        along: coordinate that the friction resists.
        law: block of the law, with the texts of the data sheet.
        force: friction [N]; for a rotary law [N m].
        parameters: parameters with the names of the law.
        following: states after the step.
        sliding: states of long sliding.
    """

    along: str
    law: Block
    force: ca.SX
    parameters: Variables
    following: ca.SX
    sliding: ca.SX


def contact_step(
    contact: Contact, along: str, normal: ca.SX, h: ca.SX, *, fold: bool
) -> ContactStep:
    """Return the friction of a contact under the normal force `normal` [N], in a step of `h` [s].

    A constant normal force becomes a parameter N, unless `fold` is True.

    Args:
        along: coordinate that the friction resists.
        fold: True if all parameters become constants.

    Raises:
        ValueError: errors of `law_block`; a law with inputs other than v and N.
    """
    law, friction = contact.friction.law, contact.friction
    if law.inputs:
        raise ValueError(
            f"inverse dynamics: {contact.law_place}: expected one that needs only v and N, got "
            f"{type(law).__name__}, which also needs {', '.join(i.name for i in law.inputs)}"
        )
    block = law_block(law, free=() if fold else None, turning=friction.turning)
    v, N = block.inputs
    level = () if fold or not ca.depends_on(block.everything, N.symbol) else _level(friction)
    if level:
        normal = level[0].symbol
    sizes = [variable for variable in block.parameters if variable.name == "h"]
    symbols, values = [v.symbol, symbols_of(sizes)], [contact.slip, h if sizes else ca.SX(0, 1)]
    parts = (block.outputs["F"].expression, block.next, *(s for s, _ in block.resets.values()))
    parts = ca.substitute([ca.SX(part) for part in parts], symbols, values)
    normal = contact.explicit_normal(normal, parts[0], N.symbol)
    if ca.depends_on(normal, contact.F):
        raise ValueError(
            f"inverse dynamics: {contact.law_place}: expected one whose force is proportional to "
            f"the normal force, got {type(law).__name__}; friction presses this element, and no "
            "equation is solved"
        )
    force, following, *sliding = ca.substitute(parts, [N.symbol], [normal])
    parameters = (*(v for v in block.parameters if v not in sizes), *level)
    return ContactStep(along, block, force, parameters, following, *sliding or [ca.SX(0, 1)])


def _level(friction: JointFriction | ElementFriction) -> Variables:
    """Return the constant normal force of a joint as a parameter; () if it is not constant."""
    if friction.normal is None or not is_number(friction.normal):
        return ()
    start, turning = float(friction.normal), friction.turning
    doc, unit = ("friction level", "N m") if turning else ("normal force", "N")
    known = max(start, 1e-3)
    return (Variable("N", unit, start=start, lower=0.0, upper=1e6, nominal=known, doc=doc),)


def with_payload(mechanism: Mechanism, place: str, *, inertia: bool) -> tuple[Mechanism, Variables]:
    """Return a copy whose body at `place` carries a rigid load, and the parameters of the load.

    Body and load form one body of mass m + m_l, with the centre of mass c + r (c_l - c) and the
    inertia J + J_l + r m (|d|^2 - d d'), d = c_l - c, r = m_l / (m + m_l).

    Args:
        place: "body", "body.frame", or the unique name of a frame or a link.
        inertia: True if the load has moments of inertia; otherwise it is a point mass.

    Returns:
        The copy, and the parameters payload_m [kg], payload_c_1 ... 3 [m] in the axes of the frame
        and, with `inertia`, payload_J_1 ... 6 [kg m^2] about the centre of mass of the load; the
        default of each is zero.

    Raises:
        ValueError: an unknown or ambiguous place, or the ground.
    """
    name, frame = _found(mechanism, place)
    m = Variable("payload_m", "kg", lower=0.0, upper=1e6, doc="mass of the payload")
    c, J = (
        [Variable(f"payload_{letter}_{k}", unit, lower=-limit, upper=limit, doc=doc)
         for k in range(1, count + 1)]
        for letter, count, unit, limit, doc in (
            ("c", 3, "m", 1e3, f"its centre of mass in {place}"),
            ("J", 6, "kg m^2", 1e6, "its inertia about it, xx yy zz xy xz yz"),
        )
    )  # fmt: skip
    moments = [v.symbol for v in J] if inertia else (0.0, 0.0, 0.0)
    load = Body("payload", m.symbol, moments, [v.symbol for v in c], ideal=True)
    changed = copy(mechanism)
    changed.bodies = [
        _together(body, load, frame) if body.name == name else body for body in mechanism.bodies
    ]
    return changed, (m, *c, *(J if inertia else ()))


def _found(mechanism: Mechanism, place: str) -> tuple[str, Frame]:
    """Return the name of the body at a place, and the frame on this body."""
    places = dict(mechanism.frames)
    if place in [body.name for body in mechanism.bodies]:
        places, found = {**places, place: Frame()}, [place]
    else:
        found = [known for known in places if place in (known, known.partition(".")[2])]
    where = "inverse dynamics: payload"
    if len(found) != 1:
        expected = "a body or a frame" if not found else "one of " + ", ".join(found)
        near = [known.partition(".")[2] or known for known in places]
        hint = f"; there are {', '.join(dict.fromkeys(near))}" if not found else ""
        raise ValueError(f"{where}: expected {expected}, got {place!r}{hint}")
    body = found[0].partition(".")[0]
    if body == GROUND:
        raise ValueError(f"{where}: expected a body that moves, got '{place}' on the ground")
    return body, places[found[0]]


def _together(body: Body, load: Body, frame: Frame) -> Body:
    """Return a body and its load at a frame as one body."""
    c = ca.SX(frame.p) + ca.SX(frame.R) @ load.c
    inertia = body.J + ca.SX(frame.R) @ load.J @ ca.SX(frame.R).T
    mass = load.mass
    if not equals(body.mass, 0.0):
        mass = ca.SX(body.mass) + load.mass
        share, d = load.mass / mass, c - body.c
        c = body.c + share * d
        inertia = inertia - share * body.mass * (skew(d) @ skew(d))
    six = [ca.SX(inertia[i, j]) for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]
    return replace(body, mass=mass, com=c, inertia=six, ideal=True)


def with_gravity(mechanism: Mechanism) -> tuple[Mechanism, Variables]:
    """Return a copy with variable gravity, and its parameters g_1, g_2, g_3 [m/s^2].

    The axes are those of the ground.
    """
    weights = [force for force in mechanism.forces if isinstance(force, Gravity)]
    start = stacked(vector(force.g) for force in weights[:1])
    values = [float(start[k]) if weights else 0.0 for k in range(3)]
    g = tuple(
        Variable(f"g_{k}", "m/s^2", start=value, lower=-1e3, upper=1e3, nominal=9.81,
                 doc="gravity in the axes of the base")
        for k, value in enumerate(values, start=1)
    )  # fmt: skip
    changed = copy(mechanism)
    others = [force for force in mechanism.forces if not isinstance(force, Gravity)]
    changed.forces = [Gravity("gravity", [v.symbol for v in g]), *others]
    return changed, g
