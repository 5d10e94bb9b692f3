"""Import of mechanisms from URDF files."""

import re
import warnings
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import replace
from math import inf
from pathlib import Path
from typing import NamedTuple

import numpy as np

from symfric.foundation import checks
from symfric.foundation.numeric import Scalar, equals, is_number, is_symbolic
from symfric.foundation.parameters import check_names, parameters, with_values
from symfric.laws import Coulomb, Law, Sum, Viscous
from symfric.laws.base.law import require_law
from symfric.multibody.couplings import Gear
from symfric.multibody.forces import JointSpringDamper, JointStop
from symfric.multibody.joint import Joint, JointFriction
from symfric.multibody.joints import Floating, Planar, Prismatic, Revolute
from symfric.multibody.mechanism import Mechanism
from symfric.multibody.spatial import GROUND, Vector, unphysical
from symfric.multibody.urdf_file import UNLIMITED, Array, Inertial, Urdf, UrdfJoint, parse

KINDS: dict[str, type[Joint]] = {
    "continuous": Revolute,
    **{kind.__name__.lower(): kind for kind in (Revolute, Prismatic, Planar, Floating)},
}
FLOATING = "floating_base"
"""Name of the joint of a root link that moves freely."""


def read_urdf(
    source: str | Path,
    *,
    law: Law | None = None,
    laws: Mapping[str, Law] | None = None,
    level: Scalar = 0.0,
    bearings: Mapping[str, JointFriction] | None = None,
    stop_stiffness: Scalar = 0.0,
    stop_dissipation: Scalar = 0.0,
    floating: bool = False,
    gravity: Vector = (0.0, 0.0, -9.81),
    strict: bool = False,
) -> Mechanism:
    """Return the mechanism of a URDF file, a chain or tree of links.

    Joints keep their names and zero positions. Links connected by fixed joints become one body with
    the name of the innermost link; every link is a frame of its body, "body.link". Joints connected
    by massless links act as the axes of one joint; joints that move no mass are fixed at zero.
    Every joint that turns about or slides along its axis has an input `tau_<joint>` [N m, N]. If it
    mimics another joint, it has no input, and a `Gear` couples the two joints.

    `<dynamics damping="d" friction="f">` becomes the friction d w + f tanh(w / v_eps) for a joint
    rate w: `Viscous` with sigma_2 = d, and `Coulomb` with mu_d = 1 under the normal force f. This
    friction is independent of the reactions and adds no unknown; for a joint that turns, read N m
    and rad/s. Use `bearings` for friction caused by reactions. Tags inside `<dynamics>`, as in SDF,
    are read like attributes. If damping or friction is missing, mu_viscous or mu_coulomb of
    Franka's files, or frictionloss of MuJoCo's, has the same meaning.

    `<limit>` sets bounds of positions, rates and inputs, see `Mechanism.limit`; `limits.clear()` of
    the mechanism removes them. Boxes, cylinders and spheres in `<visual>` are drawn in films and
    schematics, links without them as lines.

    Args:
        source: path of the file, or its content.
        law: law that replaces Coulomb; its normal force is f, so with mu_d = 1 it slides at the
            level of the file (`relative` scales a law in this way).
        laws: laws by joint name; they take precedence over `law`.
        level: f of the joints whose tag does not define it [N m, N].
        bearings: friction by joint name; it replaces the friction of the file.
        stop_stiffness: stiffness of a `JointStop`, named stop_<joint>, at the limits of each joint
            with lower < upper [N m/rad, N/m], instead of bounds of its position; 0 for no stops.
        stop_dissipation: dissipation of these stops [s/rad, s/m].
        floating: True if the root link moves freely (joint `floating_base`); otherwise it is the
            ground, regardless of its mass. A massless root is always the ground.
        gravity: gravitational acceleration [m/s^2] in the axes of the root link.
        strict: True to raise errors instead of warnings about inertias that no rigid body has,
            joints that move no mass, and joints that mimic a joint missing from the file.

    Raises:
        ValueError: all mistakes of the file at once, each with its path; no moving part has a
            mass; an unknown name in `bearings` or `laws`.
        OSError: the file cannot be read.

    Warns:
        UserWarning: once, about implausible values that are accepted (see `strict`), about all
            omitted parts other than collision and material, such as meshes, and about names that
            are changed because they are not C identifiers. A separate warning names a law that has
            no effect, because no joint has friction.

    Limits: an unphysical inertia can increase the energy of the motion; `build` rejects it if the
    mass matrix at the start is not positive definite.
    """
    if law is not None:
        require_law("urdf: law", law)
    laws, bearings = checks.named("urdf: laws", laws), checks.named("urdf: bearings", bearings)
    for name, own in laws.items():
        require_law(f"urdf: law of '{name}'", own)
    given = {"level": level, "stop_stiffness": stop_stiffness, "stop_dissipation": stop_dissipation}
    for what, value in given.items():
        if not is_symbolic(value):
            checks.number(f"urdf: {what}", value, lower=0.0)
    if equals(stop_stiffness, 0.0) and is_number(stop_dissipation) and stop_dissipation > 0:
        raise checks.refused("urdf: stop_stiffness", "> 0 with stop_dissipation", stop_stiffness)
    for name, bearing in bearings.items():
        what = "JointFriction(law, radius=...)"
        checks.kind(f"urdf: bearing '{name}'", bearing, JointFriction, what)
    checks.flag("urdf: floating", floating)
    checks.flag("urdf: strict", strict)
    urdf, held = holding(parse(source, strict))
    places = carried(urdf)
    weights = {link: merged(urdf, places, link) for link in urdf.links if link == places[link].body}
    grounded = not floating or weights[urdf.root].mass == 0
    names = _names(urdf, grounded)
    moved = [joint for joint in urdf.outwards() if places[joint.child].body == joint.child]
    problems = [*names.problems, *_massless(moved, held, strict or (grounded and not moved))]
    if problems:
        raise ValueError("\n".join(f"urdf '{urdf.name}' > {text}" for text in problems))
    for what, own in (("bearings", bearings), ("laws", laws)):
        check_names(f"urdf '{urdf.name}' {what}", own, [j.name for j in moved])
    m = Mechanism(_identifier(urdf.name), gravity)
    _add_bodies(m, places, weights, names, urdf.outlines)
    if not grounded:
        m.joint(Floating(FLOATING, GROUND, names.links[urdf.root]))
    left = list(urdf.left_out)
    for joint in moved:
        own = laws.get(joint.name, law)
        friction = bearings.get(joint.name) or tag_friction(joint, own, level)
        left += _hang(m, joint, names, places, friction, urdf.zero(joint))
    _couple(m, moved, names)
    _limit(m, moved, names, stop_stiffness, stop_dissipation)
    if law is not None and equals(level, 0.0) and not any(joint.friction for joint in moved):
        warnings.warn(
            f"urdf '{urdf.name}': {type(law).__name__} has no effect, because no joint has "
            '<dynamics friction="...">; add this tag, or set a level for all joints, as '
            "level=0.5 or --friction-level 0.5",
            stacklevel=2,
        )
    still = grounded and not moved and weights[urdf.root].mass > 0
    texts = [
        ("nothing moves", [f"floating=True frees the root '{urdf.root}'"] if still else []),
        ("accepted unchanged", urdf.doubts),
        ("fixed at zero, because they move no mass", [f"joint '{name}'" for name in held]),
        ("left out", left),
        ("names changed", [f"{old} to {new}" for old, new in names.changed.items()]),
    ]
    message = "; ".join(f"{what}: {', '.join(several)}" for what, several in texts if several)
    if message:
        warnings.warn(f"urdf '{urdf.name}': {message}", stacklevel=2)
    return m


def tag_friction(
    joint: UrdfJoint, law: Law | None = None, level: Scalar = 0.0
) -> JointFriction | None:
    """Return the friction of the tag `<dynamics>`, see `read_urdf`; None if there is none."""
    laws: list[Law] = []
    normal = joint.friction or level
    if not equals(normal, 0.0):
        laws.append(Coulomb(mu_d=1.0) if law is None else law)
    if joint.damping:
        laws.append(Viscous(sigma_2=joint.damping))
    if not laws or joint.kind in ("planar", "floating"):
        return None
    combined = laws[0] if len(laws) == 1 else Sum(tuple(laws))
    return JointFriction(combined, normal=normal, turning=joint.kind != "prismatic")


def relative(law: Law) -> Law:
    """Return `law` with its coefficients divided by the largest one, so that it breaks away at N.

    Coefficients are parameters with role "level" and unit 1; a law without them is unchanged.
    """
    known = {n: p for n, p in parameters(law).items() if p.role == "level" and p.unit == "1"}
    numbers = {name: float(p.value) for name, p in known.items() if is_number(p.value)}
    top = max(numbers.values(), default=0.0)
    return with_values(law, {name: x / top for name, x in numbers.items()}) if top else law


class Carried(NamedTuple):
    """Pose of a link in its body, in the frame of the link that names the body."""

    body: str
    R: Array
    p: Array

    def beyond(self, joint: UrdfJoint) -> "Carried":
        """Return the pose of the child of `joint` at the zero position."""
        return Carried(self.body, self.R @ joint.R, self.p + self.R @ joint.p)


def carried(urdf: Urdf) -> dict[str, Carried]:
    """Return the body of each link and its pose there; fixed joints merge links into one body."""
    found = {urdf.root: Carried(urdf.root, np.eye(3), np.zeros(3))}
    for joint in urdf.outwards():
        own = Carried(joint.child, np.eye(3), np.zeros(3))
        found[joint.child] = found[joint.parent].beyond(joint) if joint.kind == "fixed" else own
    return found


def merged(urdf: Urdf, places: Mapping[str, Carried], body: str) -> Inertial:
    """Return the mass, centre of mass and inertia of a body, the sum over its links."""
    links = ((at, urdf.links[link]) for link, at in places.items() if at.body == body)
    parts = [(at, part) for at, part in links if part is not None]
    mass = sum(part.mass for _, part in parts)
    moment = sum((part.mass * (at.p + at.R @ part.com) for at, part in parts), np.zeros(3))
    com = moment / mass if mass else moment
    inertia = np.zeros((3, 3))
    for at, part in parts:
        d = at.p + at.R @ part.com - com
        inertia += at.R @ part.J @ at.R.T + part.mass * (d @ d * np.eye(3) - np.outer(d, d))
    return Inertial(mass, com, inertia)


def holding(urdf: Urdf) -> tuple[Urdf, tuple[str, ...]]:
    """Fix the joints that move only massless links; return the robot and the names of the joints.

    Such joints have no inertia and no effect. Joints that move a link with mass, even through
    several massless links, are not fixed.
    """
    heavy = {link for link, weight in urdf.links.items() if weight is not None}
    for joint in reversed(tuple(urdf.outwards())):
        if joint.child in heavy:
            heavy.add(joint.parent)
    held = tuple(j.name for j in urdf.joints if j.kind != "fixed" and j.child not in heavy)
    if not held:
        return urdf, ()
    joints = tuple(replace(j, kind="fixed") if j.name in held else j for j in urdf.joints)
    return replace(urdf, joints=joints), held


class _Names(NamedTuple):
    """Names in the mechanism by names of links and joints in the file; changed names; problems."""

    links: dict[str, str]
    joints: dict[str, str]
    changed: dict[str, str]
    problems: list[str]


def _massless(moved: Iterable[UrdfJoint], held: Collection[str], refused: bool) -> Iterator[str]:
    """Yield messages about joints that move no mass, if refused, and joints that mimic them."""
    for name in held if refused else ():
        yield (
            f"joint '{name}': expected links with a mass > 0 kg that it moves, got none; give one "
            "an <inertial>, or make it a fixed joint"
        )
    for joint in moved:
        if joint.mimic is not None and joint.mimic.joint in held:
            yield (
                f"joint '{joint.name}' > mimic: expected a joint that moves a mass, got "
                f"'{joint.mimic.joint}'"
            )


def _identifier(text: str) -> str:
    """Return `text` with underscores for characters that are invalid in a C identifier."""
    text = re.sub(r"\W", "_", text, flags=re.ASCII)
    return f"_{text}" if text[:1].isdigit() else text


def _names(urdf: Urdf, grounded: bool) -> _Names:
    """Return unique C identifiers; joints take precedence, because results contain their names."""
    names = _Names({urdf.root: GROUND} if grounded else {}, {}, {}, [])
    taken = {GROUND: "the ground", "gravity": "the weight", FLOATING: "the root's joint"}
    groups = (
        ("joint", names.joints, [joint.name for joint in urdf.joints if joint.kind != "fixed"]),
        ("link", names.links, [link for link in urdf.links if link not in names.links]),
    )
    for kind, into, olds in groups:
        # identifiers first, so that they keep their names
        for old in sorted(olds, key=lambda old: old != _identifier(old)):
            new = _identifier(old)
            if new in taken:
                new = f"{new}_{kind}"
            if new in taken:
                names.problems.append(
                    f"{kind} '{old}': expected a name that differs from that of {taken[new]} as a "
                    f"C identifier, got {new} for both; rename one"
                )
            taken[new] = f"{kind} '{old}'"
            into[old] = new
            if new != old:
                names.changed[f"{kind} '{old}'"] = new
    return names


def _add_bodies(
    m: Mechanism, places: Mapping[str, Carried], weights: Mapping[str, Inertial], names: _Names,
    outlines: Mapping[str, Array],
) -> None:  # fmt: skip
    """Add the bodies, and every link as a frame of its body."""
    for link, weight in weights.items():
        if names.links[link] != GROUND:
            six = weight.J[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
            ideal = weight.mass == 0 or any(unphysical(weight.J))
            m.body(names.links[link], weight.mass, six.tolist(), weight.com.tolist(), ideal)
    for link, at in places.items():
        name = names.links[link] if names.links[link] != GROUND else _identifier(link)
        (z, x), outline = at.R.T[[2, 0]].tolist(), outlines[link] if len(outlines[link]) else None
        m.frame(f"{names.links[at.body]}.{name}", at.p.tolist(), z, x, outline)


def _hang(
    m: Mechanism,
    joint: UrdfJoint,
    names: _Names,
    places: Mapping[str, Carried],
    friction: JointFriction | None,
    start: float,
) -> Iterator[str]:
    """Add a joint with its frames and its input, and yield the omitted parts."""
    name, at = names.joints[joint.name], places[joint.parent].beyond(joint)
    # joints and links may have the same name; the dots keep their frames distinct
    ends = f"{names.links[at.body]}.{name}.parent", f"{names.links[joint.child]}.{name}.child"
    z, x = joint.axis, np.eye(3)[int(np.argmin(np.abs(joint.axis)))]
    if joint.kind == "floating":
        z, x = np.eye(3)[2], np.eye(3)[0]
    m.frame(ends[0], at.p.tolist(), (at.R @ z).tolist(), (at.R @ x).tolist())
    m.frame(ends[1], (0.0, 0.0, 0.0), z.tolist(), x.tolist())
    kind = KINDS[joint.kind]
    single = len(kind.directions) == 1
    m.joint(kind(name, *ends, start=start if single else None, friction=friction))
    if single and joint.mimic is None:
        torque = m.input(f"tau_{name}", "N m" if "turn" in kind.directions else "N")
        m.force(JointSpringDamper(f"motor_{name}", name, actuator=torque))
    elif not single and (joint.damping or joint.friction):
        yield f"<dynamics> of {joint.kind} joint '{joint.name}'"


def _limit(m: Mechanism, moved: Iterable[UrdfJoint], names: _Names, k: Scalar, e: Scalar) -> None:
    """Set the bounds of inputs, rates and positions, or for k > 0 stops instead of the last."""
    for joint in moved:
        name, limits = names.joints[joint.name], joint.limits
        low, high = limits.get("lower", 0.0), limits.get("upper", 0.0)
        if low < high and not equals(k, 0.0):
            m.force(JointStop(f"stop_{name}", name, low, high, k, e))
        elif low < high:
            m.limit(name, low if low > -UNLIMITED else -inf, high if high < UNLIMITED else inf)
        if "velocity" in limits:
            m.limit(f"{name}_rate", -limits["velocity"], limits["velocity"])
        if "effort" in limits and joint.mimic is None:
            m.limit(f"tau_{name}", -limits["effort"], limits["effort"])


def _couple(m: Mechanism, moved: Iterable[UrdfJoint], names: _Names) -> None:
    """Add gears that couple joints to the joints that they mimic."""
    directions = {joint.name: joint.way("") for joint in m.joints}
    for joint in moved:
        if joint.mimic is not None:
            a, b = names.joints[joint.mimic.joint], names.joints[joint.name]
            ratio, offset = joint.mimic.multiplier, joint.mimic.offset
            m.constraint(Gear(f"{b}_mimic", a, b, ratio, offset, directions[a], directions[b]))
