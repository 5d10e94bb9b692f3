"""Which links of a URDF file make one body, where they are in it, and what it weighs."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import final

import numpy as np

from symfric.multibody.urdf.file import Inertial, Urdf
from symfric.multibody.urdf.notes import Array


@final
@dataclass(frozen=True, eq=False)
class Carried:
    """Where a link is: the link whose body it is part of, and its pose there."""

    body: str
    R: Array
    p: Array


def carried(urdf: Urdf) -> dict[str, Carried]:
    """Every link: a body of its own, or fixed to another one."""
    found = {urdf.root: Carried(urdf.root, np.eye(3), np.zeros(3))}
    for joint in urdf.outwards():
        on = found[joint.parent]
        found[joint.child] = (
            Carried(on.body, on.R @ joint.R, on.p + on.R @ joint.p)
            if joint.kind == "fixed"
            else Carried(joint.child, np.eye(3), np.zeros(3))
        )
    return found


def merged(urdf: Urdf, places: Mapping[str, Carried], body: str) -> Inertial:
    """Mass, centre of mass and inertia about it of all links of a body."""
    parts = [
        (at, part)
        for link, at in places.items()
        if at.body == body and (part := urdf.links[link]) is not None
    ]
    mass = sum(part.mass for _, part in parts)
    moment = sum((part.mass * (at.p + at.R @ part.com) for at, part in parts), np.zeros(3))
    com = moment / mass if mass else moment
    inertia = np.zeros((3, 3))
    for at, part in parts:
        d = at.p + at.R @ part.com - com
        inertia += at.R @ part.J @ at.R.T + part.mass * (d @ d * np.eye(3) - np.outer(d, d))
    return Inertial(mass, com, inertia)


def holding(urdf: Urdf) -> tuple[Urdf, tuple[str, ...]]:
    """The robot with all joints fixed that move nothing but massless links, and their names.

    Nothing would resist their motion, and it moves nothing. A massless link that carries a heavy
    one, however far out, is no such case: its joints are the axes of one joint.
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
