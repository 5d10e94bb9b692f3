"""Spanning tree of a mechanism, whose joints have coordinates, and the joints that close loops."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import accumulate
from typing import Any, final

import casadi as ca

from symfric.multibody.joint import Joint, Pair
from symfric.multibody.joints import Floating
from symfric.multibody.spatial import GROUND, Body, Frame, skew


def body_of(place: str) -> str:
    """Return the name of the body in "body.frame"."""
    return place.partition(".")[0]


def frame_at(bodies: Mapping[str, Body], place: str) -> Frame:
    """Return the frame "body.frame"; for "body" the frame at the origin of the body."""
    body, _, frame = place.partition(".")
    return bodies[body].frames[frame]


@final
@dataclass(frozen=True, eq=False)
class Link:
    """Body with the joint that connects it to a base nearer to the ground.

    Attributes:
        base, body: names of the two bodies.
        joint: the joint between them.
        reverse: True if the base is the child of the joint.
        at_base, at_body: frames of the joint on the base and on the body.
        first: index of the first coordinate.
    """

    base: str
    body: str
    joint: Joint
    reverse: bool
    at_base: Frame
    at_body: Frame
    first: int = 0

    @property
    def n(self) -> int:
        """Number of coordinates."""
        return len(self.joint.coordinates)

    @property
    def rows(self) -> slice:
        """Slice of the link's coordinates in q."""
        return slice(self.first, self.first + self.n)

    def pose(self, q: ca.SX) -> Pair:
        """Return the pose of the frame on the body in the frame on the base."""
        R, p = self.joint.pose(q)
        return (R.T, -R.T @ p) if self.reverse else (R, p)

    def subspace(self, q: ca.SX) -> Pair:
        """Return the subspace (H_w, H_v) of the motion of the body relative to the base."""
        H_w, H_v = self.joint.subspace(q)
        if not self.reverse:
            return H_w, H_v
        R, p = self.joint.pose(q)
        return -R @ H_w, -R.T @ H_v - skew(R.T @ p) @ H_w


@final
@dataclass(frozen=True, eq=False)
class Topology:
    """Bodies and joints by name, and the tree of joints with coordinates.

    Attributes:
        links: links of the tree, each after the link of its base.
        loops: joints that close loops.
    """

    bodies: Mapping[str, Body]
    joints: Mapping[str, Joint]
    links: tuple[Link, ...]
    loops: tuple[Joint, ...]

    @property
    def n(self) -> int:
        """Number of coordinates."""
        return sum(link.n for link in self.links)

    @property
    def depth(self) -> int:
        """Number of links of the longest chain."""
        links = {GROUND: 0}
        for link in self.links:
            links[link.body] = links[link.base] + 1
        return max(links.values())

    @cached_property
    def link_of(self) -> dict[str, Link]:
        """Link of each joint of the tree by the name of the joint."""
        return {link.joint.name: link for link in self.links}


def spanning_tree(bodies: Mapping[str, Body], joints: Sequence[Joint]) -> Topology:
    """Return the tree that connects the bodies to the ground by joints with the fewest freedoms.

    Joints in the tree have coordinates and no constraint equations; all other joints close loops.
    Bodies that no joint with coordinates connects to the ground are omitted.
    """
    depth = {GROUND: 0}
    links: list[Link] = []
    rest = list(joints)
    while True:
        ends = {id(j): (body_of(j.parent), body_of(j.child)) for j in rest}
        ready = [j for j in rest if not j.closes and sum(e in depth for e in ends[id(j)]) == 1]
        if not ready:
            return _topology(bodies, joints, links, rest)
        best = min(ready, key=lambda j: (j.freedoms, max(depth.get(e, 0) for e in ends[id(j)])))
        parent, child = ends[id(best)]
        reverse = parent not in depth
        base, body = (child, parent) if reverse else (parent, child)
        here, there = (best.child, best.parent) if reverse else (best.parent, best.child)
        depth[body] = depth[base] + 1
        at_base, at_body = frame_at(bodies, here), frame_at(bodies, there)
        links.append(Link(base, body, best, reverse, at_base, at_body))
        rest.remove(best)


def absolute(
    bodies: Mapping[str, Body], joints: Sequence[Joint], starts: Mapping[str, tuple[Any, Any]]
) -> Topology:
    """Return the topology for absolute coordinates, in which all joints close loops.

    Each body floats, with the frame of its coordinates at the centre of mass. `starts` are the
    positions and rates of each body.
    """
    links: list[Link] = []
    for name, start in starts.items():
        floating, centre = Floating(name, GROUND, name, *start), Frame(at=bodies[name].c)
        links.append(Link(GROUND, name, floating, False, Frame(), centre))
    return _topology(bodies, joints, links, joints)


def _topology(
    bodies: Mapping[str, Body], joints: Sequence[Joint], links: Sequence[Link],
    loops: Sequence[Joint],
) -> Topology:  # fmt: skip
    """Return a topology whose links are numbered by their first coordinates."""
    first = accumulate((link.n for link in links), initial=0)
    numbered = tuple(replace(link, first=k) for link, k in zip(links, first, strict=False))
    return Topology(bodies, {joint.name: joint for joint in joints}, numbered, tuple(loops))
