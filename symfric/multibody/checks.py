"""Checks of the parts of a mechanism: names, numbers, connections."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import fields
from difflib import get_close_matches

import casadi as ca
import numpy as np

from symfric.foundation.checks import shown
from symfric.foundation.numeric import is_number, is_symbolic
from symfric.foundation.variable import strays, symbols_of
from symfric.model import Variables
from symfric.multibody.actuated import ActuatedElement
from symfric.multibody.element_friction import ElementFriction
from symfric.multibody.forces import Part
from symfric.multibody.joint import Joint, JointFriction
from symfric.multibody.spatial import GROUND, Body
from symfric.multibody.topology import Topology, body_of


def texts(part: object) -> Iterator[str]:
    """Yield messages about names and places of a part that are not strings."""
    for item in fields(part):  # type: ignore[arg-type]
        value = getattr(part, item.name)
        if item.type is str and not isinstance(value, str):
            yield f"{item.name}: expected a text, got {shown(value)}"


def naming(
    bodies: Sequence[Body], joints: Sequence[Joint], parts: Sequence[Part], inputs: Variables
) -> Iterator[str]:
    """Yield messages about repeated or invalid names and about missing places and joints.

    `parts` are forces and constraints.
    """
    names = [("body", b.name) for b in bodies] + [("joint", j.name) for j in joints]
    names += [(part.kind, part.name) for part in parts] + [("input", v.name) for v in inputs]
    every = [name for _, name in names]
    for kind, name in names:
        if not (name.isascii() and name.isidentifier()):
            yield f"{kind} '{name}': expected a name that is a C identifier, got {shown(name)}"
        if every.count(name) > 1:
            yield f"{kind} '{name}': expected every name once"
    known = {b.name: b for b in bodies}
    for joint in joints:
        for end in (joint.parent, joint.child):
            yield from _place(f"joint '{joint.name}'", end, known)
        if body_of(joint.parent) == body_of(joint.child):
            yield f"joint '{joint.name}': expected two bodies, got {joint.parent} twice"
    for part in parts:
        where = f"{part.kind} '{part.name}'"
        for end in part.places():
            yield from _place(where, end, known)
        yield from _moving(where, part.joints(), joints)
        yield from (f"{where} > {text}" for text in part.problems())
        if isinstance(part, ActuatedElement):
            yield from _on_one_base(where, part.joints(), joints)


def _moving(where: str, pairs: Iterable[tuple[str, str]], joints: Sequence[Joint]) -> Iterator[str]:
    """Yield messages about missing joints and about directions that a joint does not have."""
    known = {joint.name: joint for joint in joints}
    for name, direction in pairs:
        if name not in known:
            near = get_close_matches(name, list(known), n=1, cutoff=0.4)
            hint = f"; did you mean {near[0]}?" if near else ""
            yield f"{where}: expected a joint, got {name}{hint}"
        elif known[name].way(direction) not in known[name].directions:
            expected = " or ".join(known[name].directions) or "a joint that moves along an axis"
            yield f"{where} > direction: expected {expected}, got {direction or 'none'}"


def _on_one_base(
    where: str, pairs: Iterable[tuple[str, str]], joints: Sequence[Joint]
) -> Iterator[str]:
    """Yield a message if an element is between angles relative to different bodies."""
    turned = [name for name, direction in pairs if direction == "turn"]
    bases = sorted({body_of(joint.parent) for joint in joints if joint.name in turned})
    if len(bases) > 1:
        yield (
            f"{where}: expected joints with one parent, got {' and '.join(turned)} with the "
            f"parents {' and '.join(bases)}; add a joint for the relative motion"
        )


def _place(where: str, place: str, bodies: Mapping[str, Body]) -> Iterator[str]:
    body, _, frame = place.partition(".")
    if body not in bodies:
        near = get_close_matches(body, list(bodies), n=1, cutoff=0.4)
        near = [f"{b.name}.{f}" for b in bodies.values() for f in b.frames if f == body] or near
        hint = f"; did you mean {' or '.join(near)}?" if near else ""
        yield f"{where}: expected a body or 'body.frame', got {place}{hint}"
    elif frame not in bodies[body].frames:
        near = [name for name in bodies[body].frames if name]
        yield f"{where}: expected one of the frames {', '.join(near) or '(none)'}, got {place}"


def weights(bodies: Sequence[Body], p: Variables) -> Iterator[str]:
    """Yield messages about invalid masses and inertias."""
    for body in bodies:
        if body.name == GROUND:
            continue
        where = f"body '{body.name}'"
        given = (body.mass, body.inertia, body.com, *(f.p for f in body.frames.values()))
        stray = list(undeclared(where, given, symbols_of(p), "parameters"))
        yield from stray or (f"{where} > {text}" for text in body.problems(p))


def bearings(joints: Sequence[Joint], p: ca.SX, u: ca.SX) -> Iterator[str]:
    """Yield messages about invalid start values, lengths and friction."""
    for joint in joints:
        where = f"joint '{joint.name}'"
        own = [value for name, value in vars(joint).items() if name != "friction"]
        yield from undeclared(where, own, p, "parameters")
        yield from (f"{where} > {text}" for text in joint.problems())
        n = len(joint.coordinates)
        for what, values in (("start", joint.starts), ("rate", joint.rates)):
            if getattr(joint, what) is not None and len(values) != n:
                yield f"{where} > {what}: expected {n} numbers, got {len(values)}"
            for x in values:
                if not is_symbolic(x) and not (is_number(x) and np.isfinite(float(x))):
                    yield f"{where} > {what}: expected finite numbers, got {x!r}"
                    break
        if isinstance(joint.friction, JointFriction):
            own = joint.friction
            yield from (f"{where} > friction: {text}" for text in own.problems(joint.rubs))
            yield from rubbing(f"{where} > friction", own, ca.vertcat(p, u))
        elif joint.friction is not None:
            expected = "expected JointFriction(law, radius=...)"
            yield f"{where} > friction: {expected}, got {shown(joint.friction)}"


def rubbing(
    where: str, friction: JointFriction | ElementFriction | ActuatedElement, known: ca.SX
) -> Iterator[str]:
    """Yield messages about undeclared symbols in a friction law and its geometry."""
    law, v, N = friction.law, ca.SX.sym("v"), ca.SX.sym("N")
    z = ca.SX.sym("z", len(law.states))
    offered = {i.name: ca.SX.sym(i.name) for i in law.inputs}
    given = [value for name, value in vars(friction).items() if name != "law"]
    given += [law.force(v, N, z, **offered), law.rate(v, N, z, **offered)]
    known = ca.vertcat(v, N, z, *offered.values(), known)
    yield from undeclared(where, given, known, "parameters and inputs")


def undeclared(where: str, values: Iterable[object], known: ca.SX, expected: str) -> Iterator[str]:
    """Yield messages about undeclared symbols in `values`."""
    flat = [x for value in values for x in (value if isinstance(value, tuple | list) else [value])]
    stray = strays(ca.veccat(*(x for x in flat if isinstance(x, ca.SX))), known)
    if stray:
        hint = f"pass the variable, build(p=({stray[0]},))"
        yield f"{where}: expected only declared {expected}, got {', '.join(stray)}; {hint}"


def connected(topology: Topology) -> Iterator[str]:
    """Yield messages about unconnected bodies and about a mechanism that cannot move."""
    loose = topology.bodies.keys() - {GROUND, *(link.body for link in topology.links)}
    for name in topology.bodies:
        if name in loose:
            yield (
                f"body '{name}': expected joints with coordinates up to the ground, found "
                "none; a Floating joint lets it move freely"
            )
    if not loose and not topology.n:
        yield "expected bodies that can move, got none"
