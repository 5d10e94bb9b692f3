"""URDF files with identified inertias and friction."""

import xml.etree.ElementTree as ET
from collections.abc import Mapping

from identification.data.record import Array
from identification.robot.dynamics import COLUMNS, ROWS, RobotModel, inertial_of
from symfric.multibody.urdf import carried
from symfric.multibody.urdf_file import tags

ENTRIES = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")


def updated_urdf(
    content: str, model: RobotModel, pi: Array, friction: Mapping[str, tuple[float, float]]
) -> str:
    """Return the URDF with new inertias and friction; other tags and comments are unchanged.

    The inertia of a body that consists of several links is written to the link that names it; the
    links behind fixed joints become massless. `<dynamics>` is replaced, not added to.

    Args:
        content: the URDF.
        model: its robot.
        pi: inertial parameters, shape (10 k,).
        friction: joint -> Coulomb friction [N m, N] and damping [N m s/rad, N s/m].
    """
    robot = tags(content.strip().encode(), "utf-8", comments=True)
    places, numbers = carried(model.urdf), dict(zip(model.bodies, pi.reshape(-1, 10), strict=True))
    for link in robot.findall("link"):
        name = link.get("name", "")
        old = link.find("inertial")
        if places[name].body not in numbers:
            continue
        if old is not None:
            link.remove(old)
        if name in numbers:
            link.insert(0, _inertial(numbers[name]))
    for joint in robot.findall("joint"):
        found = friction.get(joint.get("name", ""))
        if joint.find("mimic") is not None:  # its friction is part of that of the other joint
            found = (0.0, 0.0) if joint.find("dynamics") is not None else None
        if found is not None:
            dynamics = joint.find("dynamics")
            if dynamics is None:
                dynamics = ET.SubElement(joint, "dynamics")
            dynamics.set("friction", repr(found[0]))
            dynamics.set("damping", repr(found[1]))
    ET.indent(robot)
    return ET.tostring(robot, encoding="unicode")


def _inertial(numbers: Array) -> ET.Element:
    """Return the tag of a body, with axes parallel to those of its link."""
    weight = inertial_of(numbers)
    tag = ET.Element("inertial")
    place = " ".join(repr(x) for x in weight.com.tolist())
    ET.SubElement(tag, "origin", xyz=place, rpy="0 0 0")
    ET.SubElement(tag, "mass", value=repr(weight.mass))
    values = weight.J[ROWS, COLUMNS].tolist()
    ET.SubElement(tag, "inertia", dict(zip(ENTRIES, map(repr, values), strict=True)))
    return tag
