"""Tags of a URDF file: their numbers, poses and solids, and notes about them."""

import xml.etree.ElementTree as ET
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from math import cos, isfinite, sin
from typing import final
from xml.parsers import expat

import numpy as np

from symfric.foundation.numeric import Array
from symfric.multibody.outlines import box, cylinder, sphere

APPEARANCE = {"visual", "collision", "material"}
"""Tags that are ignored without a note."""
TURNS = 13.0
"""Magnitude of angles [rad], about two turns, above which they are probably degrees."""
SNAP = 1e-15
"""Magnitude below which entries of rotation matrices are set to zero, as after a quarter turn."""

ROUND = ("radius", "0"), ("length", "0")
SOLIDS: dict[str, tuple[Callable[..., Array], tuple[tuple[str, str], ...]]] = {
    "box": (box, (("size", "0 0 0"),)),
    "cylinder": (cylinder, ROUND),
    "capsule": (cylinder, ROUND),
    "sphere": (sphere, ROUND[:1]),
}
"""Outline of each solid, and its attributes with their zeros; capsules are drawn as cylinders."""


@final
@dataclass(frozen=True, eq=False)
class Notes:
    """Notes on a file: problems, doubts (implausible values), and places of omitted tags.

    If `strict`, doubts are problems.
    """

    strict: bool = False
    problems: list[str] = field(default_factory=list[str])
    doubts: list[str] = field(default_factory=list[str])
    left_out: dict[str, list[str]] = field(default_factory=dict[str, list[str]])

    def others(self, where: str, tag: ET.Element, known: Iterable[str]) -> None:
        """Note the tags inside `tag` that are not known."""
        for other in tag:
            if other.tag.startswith("xacro:"):
                self.problems.append("<xacro>: expected plain URDF; expand the file with xacro")
            elif other.tag not in {*known, *APPEARANCE}:
                self.left(other.tag, where)
                if (meant := other.tag.lower()) in known:
                    self.problems.append(f"<{other.tag}>: expected <{meant}>, in lower case")

    def doubt(self, text: str) -> None:
        """Note an implausible value that other tools accept."""
        (self.problems if self.strict else self.doubts).append(text)

    def left(self, tag: str, where: str) -> None:
        """Note an omitted tag, once for every place."""
        places = self.left_out.setdefault(tag, [])
        if where not in places:
            places.append(where)

    def numbers(self, where: str, tag: ET.Element | None, key: str, default: str) -> Array:
        """Return the numbers in an attribute, or in `default` if the attribute is missing.

        The attribute must contain as many numbers as `default`.
        """
        text = default if tag is None else tag.get(key, default)
        n = len(default.split())
        try:
            found = [float(word) for word in text.split()]
        except ValueError:
            found = []
        if len(found) != n or not all(isfinite(x) for x in found):
            several = "a number" if n == 1 else f"{n} numbers"
            self.problems.append(f"{where}: expected {several} in {key}, got '{text}'")
            found = [float(word) for word in default.split()]
        return np.array(found)

    def number(self, where: str, tag: ET.Element | None, key: str, default: str = "0") -> float:
        """Return the number in an attribute."""
        return float(self.numbers(where, tag, key, default)[0])

    def pose(self, where: str, tag: ET.Element) -> tuple[Array, Array]:
        """Return the rotation and position in the tag <origin> of `tag`."""
        origin, at = tag.find("origin"), f"{where} > origin"
        rpy = self.numbers(at, origin, "rpy", "0 0 0")
        if np.abs(rpy).max() > TURNS:
            self.doubt(f"{at}: expected rpy in radians, got {', '.join(f'{x:g}' for x in rpy)}")
        return rotation(*rpy), self.numbers(at, origin, "xyz", "0 0 0")


def rotation(roll: float, pitch: float, yaw: float) -> Array:
    """Return R_z(yaw) R_y(pitch) R_x(roll): rotations about the fixed axes x, y, z in turn."""
    (cr, sr), (cp, sp), (cy, sy) = ((cos(a), sin(a)) for a in (roll, pitch, yaw))
    R = np.array([
        [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
        [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
        [-sp, cp * sr, cp * cr],
    ])  # fmt: skip
    return np.where(np.abs(R) < SNAP, 0.0, R)


def tags(content: bytes, encoding: str | None, *, comments: bool = False) -> ET.Element:
    """Return the outermost tag; undeclared prefixes are accepted, because many files have them."""
    builder = ET.TreeBuilder(insert_comments=comments)
    parser = expat.ParserCreate(encoding)
    parser.CommentHandler = builder.comment if comments else None
    parser.StartElementHandler, parser.EndElementHandler = builder.start, builder.end
    parser.CharacterDataHandler = builder.data
    parser.Parse(content, True)
    return builder.close()


def outline(tag: ET.Element, notes: Notes) -> Array:
    """Return the outline of the solids in <visual> of a link, shape (n, 3); NaN separates lines."""
    link, found = f"link '{tag.get('name', '')}'", [np.empty((0, 3))]
    for visual in tag.findall("visual"):
        where = f"{link} > visual"
        R, p = notes.pose(where, visual)
        for solid in visual.iterfind("geometry/*"):
            draw, keys = SOLIDS.get(solid.tag.rpartition(":")[2], (None, ()))
            sizes = [x for key, zero in keys for x in notes.numbers(where, solid, key, zero)]
            if draw is None or min(sizes) <= 0:
                notes.left(solid.tag, link)
            else:
                found.append(draw(*sizes) @ R.T + p)
    return np.concatenate(found)
