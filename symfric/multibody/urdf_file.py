"""Reader of URDF files: links and joints as data, with mistakes, doubts and omitted parts."""

import xml.etree.ElementTree as ET
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple, final
from xml.parsers import expat

import numpy as np

from symfric.foundation import checks
from symfric.foundation.numeric import Array
from symfric.multibody.spatial import unphysical
from symfric.multibody.urdf_text import Notes, outline, tags

KINDS = ("revolute", "continuous", "prismatic", "fixed", "floating", "planar")
SINGLE = KINDS[:3]
"""Kinds of joints with one coordinate."""
LIMITS = ("lower", "upper", "effort", "velocity")
DYNAMICS = (("damping", "mu_viscous"), ("friction", "mu_coulomb", "frictionloss"))
"""Names in <dynamics> of damping and friction: of the specification, of Franka and of MuJoCo."""
UNLIMITED = 1e9
"""Magnitude from which limits are none; Gazebo writes 1e16."""
BLANK = "\ufeff \t\r\n"
"""Characters around the content of a file; the first one is the mark of its byte order."""
POINT = 1e-15
"""Inertia per mass [m^2] below which an inertia is zero: a radius of gyration of 30 nm."""


class Inertial(NamedTuple):
    """Mass [kg], centre of mass [m] and inertia about it [kg m^2], in the axes of the link."""

    mass: float
    com: Array
    J: Array


class Mimic(NamedTuple):
    """Coupling to another joint: q = multiplier q_joint + offset."""

    joint: str
    multiplier: float
    offset: float


@final
@dataclass(frozen=True, eq=False)
class UrdfJoint:
    """Joint of a URDF file.

    Attributes:
        kind: one of `KINDS`.
        parent, child: names of the links.
        R, p: pose of the child link in the parent link at the zero position of the joint.
        axis: unit vector in the axes of the child link.
        damping: viscous damping [N s/m] or [N m s/rad].
        friction: friction level [N] or [N m].
        limits: lower < upper [m, rad], effort [N, N m], velocity [m/s, rad/s], where given.
        mimic: coupling to another joint, or None.
    """

    name: str
    kind: str
    parent: str
    child: str
    R: Array
    p: Array
    axis: Array
    damping: float
    friction: float
    limits: Mapping[str, float]
    mimic: Mimic | None


@final
@dataclass(frozen=True, eq=False)
class Urdf:
    """Robot of a URDF file.

    Attributes:
        name: name of the robot.
        links: mass and inertia of each link; None for a massless link.
        joints: joints; every link except the root is the child of one joint.
        left_out: omitted tags, each with its places.
        doubts: accepted implausible values, each with its path.
        outlines: outline of the solids in <visual> of each link [m], see `outlines`.
    """

    name: str
    links: Mapping[str, Inertial | None]
    joints: tuple[UrdfJoint, ...]
    left_out: tuple[str, ...]
    doubts: tuple[str, ...] = ()
    outlines: Mapping[str, Array] = field(default_factory=dict[str, Array])

    @property
    def root(self) -> str:
        """Name of the link that is not a child of any joint."""
        children = {joint.child for joint in self.joints}
        return next(link for link in self.links if link not in children)

    def zero(self, joint: UrdfJoint) -> float:
        """Return the position of a joint [m, rad] if all independent joints are at zero."""
        if joint.mimic is None:
            return 0.0
        leader = next(other for other in self.joints if other.name == joint.mimic.joint)
        return joint.mimic.multiplier * self.zero(leader) + joint.mimic.offset

    def outwards(self) -> Iterator[UrdfJoint]:
        """Yield the joints from the root to the tips."""
        below: dict[str, list[UrdfJoint]] = {}
        for joint in self.joints:
            below.setdefault(joint.parent, []).append(joint)
        waiting = [self.root]
        while waiting:
            for joint in below.get(waiting.pop(0), []):
                waiting.append(joint.child)
                yield joint


def parse(source: str | Path, strict: bool = False) -> Urdf:
    """Read a URDF file.

    Args:
        source: path of a file, or its content (which begins with "<").
        strict: True to reject unphysical inertias (a negative principal moment, a principal moment
            larger than the sum of the other two, an inertia without a mass) and joints that mimic a
            missing joint; otherwise such inertias are accepted, and such joints are independent.

    Raises:
        ValueError: the file is not XML, does not describe a tree of links, or has invalid numbers;
            all problems at once, each with its path ("urdf 'arm' > joint 'elbow' > axis").
        OSError: the file cannot be read.
    """
    is_text = isinstance(source, str) and source.lstrip(BLANK).startswith("<")
    where = "urdf" if is_text else f"urdf '{checks.path('urdf', source)}'"
    if not is_text and not Path(source).is_file():
        raise ValueError(f"{where}: expected a file, got nothing there; check the path")
    content = str(source).strip(BLANK).encode() if is_text else Path(source).read_bytes()
    try:
        robot = tags(content, "utf-8" if is_text else None)
    except expat.ExpatError as error:
        raise ValueError(f"{where}: expected XML, got {error}") from None
    if robot.tag != "robot":
        raise ValueError(f"{where}: expected <robot> as its outermost tag, got <{robot.tag}>")
    name = robot.get("name") or ("robot" if is_text else Path(source).stem)
    notes = Notes(strict)
    links = {tag.get("name", ""): _inertial(tag, notes) for tag in robot.findall("link")}
    looks = Notes(left_out=notes.left_out)
    outlines = {tag.get("name", ""): outline(tag, looks) for tag in robot.findall("link")}
    for text in (*looks.problems, *looks.doubts):
        notes.doubt(text)
    joints = tuple(_joint(tag, notes) for tag in robot.findall("joint"))
    notes.others("", robot, {"link", "joint"})
    _check_names(robot, notes)
    if not notes.problems:
        joints = tuple(_known_leader(joint, joints, notes) for joint in joints)
        notes.problems.extend([*_tree_problems(links, joints), *_mimic_problems(joints)])
    if notes.problems:
        raise ValueError("\n".join(f"urdf '{name}' > {text}" for text in notes.problems))
    left = tuple(
        f"<{tag}>" + (f" of {', '.join(at)}" if any(at) else "")
        for tag, at in notes.left_out.items()
    )
    return Urdf(name, links, joints, left, tuple(notes.doubts), outlines)


def _inertial(tag: ET.Element, notes: Notes) -> Inertial | None:
    link = f"link '{tag.get('name', '')}'"
    notes.others(link, tag, {"inertial"})
    inertial = tag.find("inertial")
    if inertial is None:
        return None
    where = f"{link} > inertial"
    notes.others(link, inertial, {"origin", "mass", "inertia"})
    for key in ("mass", "inertia"):
        if inertial.find(key) is None:
            notes.problems.append(f"{where} > {key}: expected a tag, found none")
    R, com = notes.pose(where, inertial)
    mass = notes.number(f"{where} > mass", inertial.find("mass"), "value")
    inertia, at = inertial.find("inertia"), f"{where} > inertia"
    xx, yy, zz, xy, xz, yz = (
        notes.number(at, inertia, key) for key in ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
    )
    given = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    if mass < 0:
        notes.problems.append(f"{where} > mass: expected >= 0 kg, got {mass:g}")
        return None
    J = given if np.abs(given).max() > POINT * mass else np.zeros((3, 3))
    doubts = unphysical(J, point=True)
    if mass == 0:
        text = "mass: expected > 0 kg, because there is an inertia, got 0"
        doubts = iter([text] if J.any() else [])
    for text in doubts:
        notes.doubt(f"{where} > {text}")
    return Inertial(mass, com, R @ J @ R.T) if mass or J.any() else None


def _joint(tag: ET.Element, notes: Notes) -> UrdfJoint:
    name, kind = tag.get("name", ""), tag.get("type", "")
    where = f"joint '{name}'"
    known = {"origin", "parent", "child", "axis", "dynamics", "limit", "mimic"}
    notes.others(where, tag, known)
    if kind not in KINDS:
        notes.problems.append(f"{where} > type: expected one of {', '.join(KINDS)}, got '{kind}'")
    damping, friction = _dynamics(where, tag.find("dynamics"), notes)
    limits = _limits(where, kind, tag.find("limit"), notes)
    # exporters write zero axes for joints without an axis
    along = None if kind in ("fixed", "floating") else tag.find("axis")
    mimic = tag.find("mimic")
    if kind == "fixed" and mimic is not None:
        notes.left("mimic", where)
        mimic = None
    axis = notes.numbers(f"{where} > axis", along, "xyz", "1 0 0")
    length = float(np.linalg.norm(axis))
    if not length > 1e-12:
        notes.problems.append(f"{where} > axis: expected a direction, got '0 0 0'")
    ends: list[str] = []
    for key in ("parent", "child"):
        end = tag.find(key)
        ends.append("" if end is None else end.get("link", ""))
        if not ends[-1]:
            notes.problems.append(f"{where} > {key}: expected the name of a link, found none")
    (parent, child), (R, p) = ends, notes.pose(where, tag)
    leader = None
    if mimic is not None:
        numbers = (("multiplier", "1"), ("offset", "0"))
        ratio, offset = (notes.number(f"{where} > mimic", mimic, *number) for number in numbers)
        leader = Mimic(mimic.get("joint", ""), ratio, offset)
    axis = axis / (length or 1.0)
    return UrdfJoint(name, kind, parent, child, R, p, axis, damping, friction, limits, leader)


def _limits(where: str, kind: str, tag: ET.Element | None, notes: Notes) -> dict[str, float]:
    """Return the limits that apply to a joint: ends with lower < upper, and others above zero."""
    given = {} if tag is None or kind == "fixed" else tag.attrib
    found = {key: notes.number(f"{where} > limit", tag, key) for key in LIMITS if key in given}
    low, high = (found.get(key, 0.0) for key in LIMITS[:2])
    found = {key: value for key, value in found.items() if abs(value) < UNLIMITED}
    if kind not in SINGLE:
        if found:
            notes.left("limit", where)
        return {}
    stated, ends = [found.pop(key) for key in LIMITS[:2] if key in found], dict[str, float]()
    if stated and kind != "continuous" and low < high:
        ends = {"lower": low, "upper": high}
    elif any(stated):
        notes.left("limit lower, upper", where)
    for key in [key for key, value in found.items() if value <= 0]:  # exporters write 0 for none
        notes.left(f'limit {key}="{given[key]}"', where)
        del found[key]
    return ends | found


def _dynamics(where: str, tag: ET.Element | None, notes: Notes) -> tuple[float, float]:
    """Return damping and friction, given as attributes or, as in SDF, as tags.

    A name of the specification takes precedence, even with the value zero.
    """
    inside = {} if tag is None else {one.tag: (one.text or "").strip() for one in tag} | tag.attrib
    known = {name for names in DYNAMICS for name in names}
    inside = {low if (low := key.lower()) in known else key: x for key, x in inside.items()}
    both = ET.Element("dynamics", inside)
    for key in inside:
        if key not in known:
            notes.left(f"dynamics {key}", where)
    levels: list[float] = []
    for names in DYNAMICS:
        found = {
            key: notes.number(f"{where} > dynamics", both, key) for key in names if key in inside
        }
        levels.append(next(iter(found.values()), 0.0))
        for key, value in found.items():
            if value < 0:
                notes.problems.append(f"{where} > dynamics > {key}: expected >= 0, got {value:g}")
            if value not in (0.0, levels[-1]):
                notes.left(f"dynamics {key}", where)
    return levels[0], levels[1]


def _check_names(robot: ET.Element, notes: Notes) -> None:
    """Check that every link and every joint has a unique name."""
    for kind in ("link", "joint"):
        names = [tag.get("name", "") for tag in robot.findall(kind)]
        for name in dict.fromkeys(names):
            if not name:
                notes.problems.append(f"{kind}: expected a name, found none")
            elif names.count(name) > 1:
                notes.problems.append(f"{kind} '{name}': expected every name once")
        if kind == "link" and not names:
            notes.problems.append("link: expected at least one, got none")


def _tree_problems(links: Iterable[str], joints: Sequence[UrdfJoint]) -> Iterator[str]:
    """Yield reasons why the joints do not form a tree of the links."""
    carriers: dict[str, list[str]] = {link: [] for link in links}
    for joint in joints:
        for key, link in (("parent", joint.parent), ("child", joint.child)):
            if link not in carriers:
                yield f"joint '{joint.name}' > {key}: expected a link, got '{link}'"
        carriers.setdefault(joint.child, []).append(joint.name)
    for link, above in carriers.items():
        for first, second in pairwise(above):
            yield f"link '{link}': expected one joint that carries it, got {first}, {second}"
    roots = [link for link, above in carriers.items() if not above]
    if len(roots) != 1:
        yield f"expected one link that no joint carries, got {', '.join(roots) or 'a closed loop'}"
        return
    reached = {roots[0]}
    while more := {j.child for j in joints if j.parent in reached} - reached:
        reached |= more
    for link in carriers:
        if link not in reached:
            yield f"link '{link}': expected joints that lead to '{roots[0]}', got a closed loop"


def _known_leader(joint: UrdfJoint, joints: Sequence[UrdfJoint], notes: Notes) -> UrdfJoint:
    """Return the joint, without its coupling if the file lacks the joint that it mimics."""
    if joint.mimic is None or any(joint.mimic.joint == other.name for other in joints):
        return joint
    leader = joint.mimic.joint or "one without a name"
    notes.doubt(f"joint '{joint.name}' > mimic: expected a joint of the file, got {leader}")
    return replace(joint, mimic=None)


def _mimic_problems(joints: Sequence[UrdfJoint]) -> Iterator[str]:
    """Yield messages about couplings that do not end in an independent joint of one coordinate."""
    along = {joint.name: joint for joint in joints if joint.kind in SINGLE}
    for joint in joints:
        leader, steps = joint, 0
        while leader is not None and leader.mimic is not None and steps <= len(joints):
            leader, steps = along.get(leader.mimic.joint), steps + 1
        if joint.mimic is not None and (leader is None or leader.mimic or joint.name not in along):
            yield (
                f"joint '{joint.name}' > mimic: expected joints of kind {', '.join(SINGLE)} whose "
                f"chain ends in one that mimics no other, got '{joint.mimic.joint}'"
            )
