"""Checks of a mechanism: names, numbers and connections of its parts, and its equations."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import fields, replace
from difflib import get_close_matches

import casadi as ca
import numpy as np

from symfric.foundation.checks import shown
from symfric.foundation.numeric import is_number, is_symbolic
from symfric.foundation.variable import stacked, strays, symbols_of
from symfric.laws import Law
from symfric.model import Variables
from symfric.multibody.actuated import ActuatedElement
from symfric.multibody.constraints import Constraint
from symfric.multibody.contact import JointContact, depends_on_load
from symfric.multibody.couplings import Coupling
from symfric.multibody.element_friction import ElementFriction
from symfric.multibody.equations import Equations
from symfric.multibody.forces import Axial, Load, Part
from symfric.multibody.joint import Joint, JointFriction
from symfric.multibody.prepare import PreparedMechanism, weightless
from symfric.multibody.spatial import GROUND, Body
from symfric.multibody.topology import Topology, body_of

ROUNDING = 1e-12
"""Largest load of a bearing by rounding, relative to the largest reaction."""


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
            kind = type(known[name]).__name__
            got = f"got {direction or 'none'}; '{name}' is a {kind} joint"
            yield f"{where} > direction: expected {expected}, {got}"


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
    used = [x for x in flat if isinstance(x, ca.SX) and not x.is_constant()]
    if used and (stray := strays(ca.veccat(*used), known)):
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


def left_open(made: PreparedMechanism) -> Iterator[str]:
    """Yield messages about friction that depends on undetermined reactions."""
    for name in made.undetermined:
        yield (
            f"{name} > friction: expected reactions that the motion determines, got a "
            f"normal force that the redundant constraints {', '.join(made.redundant)} leave open; "
            "close the loop with a joint of fewer constraints: PlanarRevolute, PlanarPrismatic or "
            "PinInSlot in a planar mechanism, a ball or a PointOnLine in space"
        )
    if made.singular:
        yield "start: expected independent constraints, got a singular position; start elsewhere"


def undeclared_in_forces(made: PreparedMechanism) -> Iterator[str]:
    """Yield messages about undeclared symbols in forces."""
    eq = made.eq
    known = ca.vertcat(eq.q, eq.qd, eq.angles, symbols_of((*made.p, *made.u)), eq.kin.t)
    expected = "positions, velocities, time, parameters and inputs"
    for force, loads in zip(eq.forces, eq.loads, strict=True):
        parts = [x for load in loads for x in _parts(load)]
        yield from undeclared(f"force '{force.name}'", parts, known, expected)


def _parts(load: Load | Axial) -> tuple[ca.SX, ...]:
    return (load.value,) if isinstance(load, Axial) else (load.force, load.moment)


def infinite(made: PreparedMechanism) -> Iterator[str]:
    """Yield messages about forces that are not finite at the start, with zero inputs."""
    for force, loads in zip(made.eq.forces, made.eq.loads, strict=True):
        (found,) = made.numbers(ca.veccat(*(_parts(x)[0] for x in loads)))
        if not np.isfinite(found).all():
            yield (
                f"force '{force.name}': expected a finite force at the start, got "
                f"{shown(float(np.abs(found).sum()))}; do its places coincide there?"
            )


def without_inertia(made: PreparedMechanism) -> Iterator[str]:
    """Yield messages about coordinates without inertia near the start."""
    eq = made.eq
    if not any(eq.kin.topology.bodies[link.body].ideal for link in eq.kin.topology.links):
        return
    near = made.q0 + 0.1 * np.random.default_rng(0).standard_normal(eq.n)
    found = weightless(replace(made, q0=near).numbers(eq.mass)[0])
    if found.any():
        names = ", ".join(v.name for v, is_one in zip(made.q, found, strict=True) if is_one)
        yield (
            f"expected a mass matrix that is positive definite, got one that is not in {names}: "
            "the bodies they move have no mass (massless links, points on an axis, parallel axes) "
            "or an unphysical inertia"
        )


def inseparable(made: PreparedMechanism) -> Iterator[str]:
    """Yield messages about bodies whose inertia does not allow absolute coordinates."""
    for name, body in made.eq.kin.topology.bodies.items():
        if body.ideal and name != GROUND and any(replace(body, ideal=False).problems(made.p)):
            yield (
                f"body '{name}': expected a rigid body in absolute coordinates, got a "
                "massless link, a point or an unphysical body; use joint coordinates"
            )


def idle(eq: Equations, constraints: Sequence[Constraint]) -> Iterator[str]:
    """Yield messages about joints whose friction is zero in every motion.

    The normal force of such a joint is zero for random coordinates, rates, accelerations,
    multipliers, friction forces, inputs and parameters, and its law does not act without load.
    """
    joints = [c for c in eq.contacts if isinstance(c, JointContact) and c.friction.normal is None]
    if not joints:
        return
    loads = stacked(N for c, N in zip(eq.contacts, eq.normals, strict=True) if c in joints)
    reactions = stacked(ca.vertcat(*eq.pressing[c.part]) for c in joints)
    symbols = stacked(ca.symvar(ca.vertcat(loads, reactions)))
    at = np.random.default_rng(0).standard_normal(symbols.numel())
    found, largest = ca.Function("loads", [symbols], [ca.densify(loads), ca.densify(reactions)])(at)
    least = ROUNDING * max(1.0, float(ca.norm_inf(largest)))
    unloaded = [c for c, load in zip(joints, found.nonzeros(), strict=True) if abs(load) <= least]
    for part in dict.fromkeys(c.part for c in unloaded if not acts_without_load(c.friction.law)):
        yield f"joint '{part}' > friction: {_advice(part, constraints)}"


def acts_without_load(law: Law) -> bool:
    """Return True unless the friction force is known to be zero without a normal force."""
    if not depends_on_load(law):
        return True
    try:
        return not ca.SX(law.outside(ca.SX.sym("v"), ca.SX(0.0))).is_zero()
    except ValueError:
        return True


def _advice(joint: str, constraints: Sequence[Constraint]) -> str:
    """Return what is wrong with the friction of a joint, what carries the load, and the remedy."""
    expected = "expected a reaction that loads the bearing, got none in any motion"
    for c in constraints:
        if isinstance(c, Coupling) and joint in (name for name, _ in c.joints()):
            kind, friction = type(c).__name__, c.accepts[0].__name__
            return (
                f"{expected}, because coupling '{c.name}' carries the load; write "
                f"{kind}('{c.name}', ..., friction={friction}(law, ...)) and omit this friction, "
                "or give the bearing a preload"
            )
    return f"{expected}; write preload=... or normal=... [N], or omit the friction"
