"""Geometry of a moving sketch as lines and markers."""

from collections.abc import Iterator, Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from symfric.foundation.numeric import Array
from symfric.model.sketch import Mark, Part, Sketch

Flags = NDArray[np.bool_]
FLAT = 1e-6
"""Fraction of the motion in a plane below which motion out of the plane counts as zero."""
SYMBOL = 0.02
"""Half the size of the symbol of a joint as a fraction of the size of the machine."""
ELEVATION, AZIMUTH = 22.0, -58.0
"""Direction from which spatial motion is viewed [degree]."""
UPRIGHT = 0.99
"""Component of the viewing direction along z above which y is upward in the picture."""


class Poses(NamedTuple):
    """Poses of the places of a sketch in all pictures.

    Attributes:
        axes: axes of the places, shape (places, axis, component, pictures).
        at: positions of the places [m], shape (places, component, pictures).
        paths: paths of the centres of the parts [m], shape (parts, component, times).
    """

    axes: Array
    at: Array
    paths: Array


class Stroke(NamedTuple):
    """Line or markers in all pictures.

    Attributes:
        role: body, outline, arm (to the end of a spring), path, block, axis, guide, rod, link,
            spring, damper, ground (a guide fixed to the ground), anchor, centre, or joint.
        points: points of the line, shape (n, 3, pictures); NaN interrupts the line.
        body: number of the body, which selects the colour; -1 if the stroke belongs to no body.
        marker: marker of a joint.
        sticks: flags of a joint, True in pictures where its contacts stick; None without friction.
    """

    role: str
    points: Array
    body: int = -1
    marker: str = ""
    sticks: Flags | None = None


class View(NamedTuple):
    """View of a motion.

    Attributes:
        low, high: corners of the visible box [m], shape (3,).
        eye: unit vector towards the viewer.
        planar: True if the motion is in a plane with the normal `eye`.
        size: half the size of the symbol of a joint [m].
    """

    low: Array
    high: Array
    eye: Array
    planar: bool
    size: float

    @property
    def up(self) -> Array:
        """Upward direction in the picture, near z, or near y if the view is along z."""
        upwards = np.eye(3)[1 if abs(self.eye[2]) > UPRIGHT else 2]
        up = upwards - (upwards @ self.eye) * self.eye
        return np.asarray(up / np.linalg.norm(up))

    @property
    def right(self) -> Array:
        """Rightward direction in the picture."""
        return np.cross(self.up, self.eye)


def look(sketch: Sketch, poses: Poses) -> View:
    """Return the view that shows all places at all times."""
    solids = [_points(solid) for part in sketch.parts for solid in outlines(part, poses)]
    every = np.hstack([_points(poses.at), _points(poses.paths), *solids])
    low, high = np.nanmin(every, axis=1), np.nanmax(every, axis=1)
    size = SYMBOL * sketch.symbols * max(float(np.max(high - low)), 1e-9)
    normal = _normal(sketch, poses)
    e, a = np.radians([ELEVATION, AZIMUTH])
    oblique = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
    eye = oblique if normal is None else normal
    return View(low - 4 * size, high + 4 * size, eye, normal is not None, size)


def _points(places: Array) -> Array:
    """Return the positions of all places at all times as columns, shape (3, n)."""
    return places.transpose(1, 0, 2).reshape(3, -1)


def outlines(part: Part, poses: Poses) -> Iterator[Array]:
    """Yield the outlines of a body in all pictures, each of shape (n, 3, pictures)."""
    for k, points in part.outlines:
        yield poses.at[k] + np.einsum("na,aci->nci", points, poses.axes[k])


def _normal(sketch: Sketch, poses: Poses) -> Array | None:
    """Return the normal of the plane of motion, towards the viewer; None if motion is spatial.

    For motion along a line, or rest, the normal is the axis of the hinges. Without hinges, it is
    the normal of the plane through all places, or orthogonal to their line if they are collinear.
    """
    moved = _points(poses.at - poses.at[:, :, :1])
    hinges = [poses.axes[mark.b, 2] for mark in sketch.marks if mark.symbol.hinge]
    directions, extent, _ = np.linalg.svd(moved, full_matrices=False)
    if extent[1] > FLAT * extent[0]:
        normal = directions[:, 2]
    elif hinges:
        normal = hinges[0][:, 0]
    else:
        moved = _points(poses.at)
        moved = moved - moved[:, :1]
        directions, extent, _ = np.linalg.svd(moved, full_matrices=False)
        aside = _aside(directions[:, 0] if extent[0] > 0 else np.array([1.0, 0.0, 0.0]))
        normal = directions[:, 2] if extent[1] > FLAT * extent[0] else aside
    across = [np.linalg.norm(np.cross(axis.T, normal), axis=1).max() for axis in hinges]
    slides = [poses.axes[m.a, 2] for m in sketch.marks if m.symbol.guide or m.symbol.slot]
    across += [float(np.abs(normal @ axis).max()) for axis in slides]
    beyond = np.abs(normal @ moved).max() > FLAT * max(extent[0], 1e-300)
    if beyond or max(across, default=0.0) > FLAT:
        return None
    right = View(normal, normal, normal, True, 0.0).right
    return normal if right[np.argmax(np.abs(right))] > 0 else -normal


def _aside(line: Array) -> Array:
    """Return a direction orthogonal to a line: -y for a line along x or z, x for one along y."""
    level = np.array([0.0, -1.0, 0.0]) if abs(line[1]) < UPRIGHT else np.array([1.0, 0.0, 0.0])
    across = level - (level @ line) * line
    return np.asarray(across / np.linalg.norm(across))


def strokes(
    sketch: Sketch, poses: Poses, view: View, sticks: Mapping[str, Flags]
) -> Iterator[Stroke]:
    """Yield all strokes of a sketch from back to front.

    Args:
        sketch, poses: sketch, and poses of its places.
        view: view of the motion.
        sticks: flags by joint, True in pictures where its contacts stick.
    """
    moving = [
        (part, path) for part, path in zip(sketch.parts, poses.paths, strict=True) if not part.fixed
    ]
    for k, (_, path) in enumerate(moving):
        yield Stroke("path", np.repeat(path.T[:, :, None], poses.at.shape[2], axis=2), k)
    for part in sketch.parts:
        if part.fixed:
            yield from (Stroke("outline", solid) for solid in outlines(part, poses))
    for mark in sketch.marks:
        yield from _behind(mark, poses, view)
    for k, (part, _) in enumerate(moving):
        yield from _body(sketch, part, k, poses, view)
    for mark in sketch.marks:
        yield from _symbol(mark, poses, view)
        if mark.symbol.marker:
            at = poses.at[mark.b][None]
            yield Stroke("joint", at, -1, mark.symbol.marker, sticks.get(mark.name))


def _body(sketch: Sketch, part: Part, k: int, poses: Poses, view: View) -> Iterator[Stroke]:
    """Yield lines from the centre of mass to the places of a body, or a block if they coincide."""
    centre = poses.at[part.centre]
    yield from (Stroke("outline", solid, k) for solid in outlines(part, poses))
    for role, places in (("arm", part.ends), ("body", () if part.outlines else part.corners)):
        arms = [poses.at[c] for c in places]
        arms = [arm for arm in arms if np.abs(arm - centre).max() > 1e-9 * view.size]
        if arms:
            gap = np.full_like(centre, np.nan)
            yield Stroke(role, np.stack([p for arm in arms for p in (centre, arm, gap)]), k)
    guided = any(m.symbol.guide and m.b in part.corners for m in sketch.marks)
    if not (arms or part.outlines or guided):
        yield Stroke("block", _block(poses.axes[part.centre], centre, 1.2 * view.size), k)
    yield Stroke("centre", centre[None], k)


def _behind(mark: Mark, poses: Poses, view: View) -> Iterator[Stroke]:
    """Yield the guide, slot, rod, spring or damper of a mark, and its anchor on the ground."""
    a, b, z = poses.at[mark.a], poses.at[mark.b], poses.axes[mark.a, 2]
    if mark.symbol.guide or mark.symbol.slot:
        along = np.sum(z * (b - a), axis=0)
        along = np.append(along, 0.0) if mark.symbol.slot else along
        low, high = along.min() - 3 * view.size, along.max() + 3 * view.size
        role = "ground" if mark.grounded else "guide"
        yield Stroke(role, np.stack([a + low * z, a + high * z]))
    if mark.symbol.line:
        yield from _line(mark.symbol.line, a, b, view)
    if mark.grounded and mark.symbol.anchored:
        yield Stroke("anchor", a[None])


def _line(line: str, a: Array, b: Array, view: View) -> Iterator[Stroke]:
    """Yield the line of an element between two points; see `Symbol`."""
    aside = 1.4 * view.size * _aside_of(b - a, view) if line == "strut" else np.zeros_like(a)
    if line in ("spring", "strut"):
        yield Stroke("spring", _zigzag(a + aside, b + aside, view))
    if line in ("damper", "strut"):
        yield Stroke("damper", _dashpot(a - aside, b - aside, view))
    if line == "strut":
        bars = [a + aside, a - aside, np.full_like(a, np.nan), b + aside, b - aside]
        yield Stroke("damper", np.stack(bars))
    if line == "circle":
        angles = np.linspace(0.0, 2 * np.pi, 73)[:, None, None]
        yield Stroke("rod", a + np.cos(angles) * (b - a) + np.sin(angles) * np.cross(
            (b - a).T, view.eye).T)  # fmt: skip
    if line == "spiral":
        angles = np.linspace(0.0, 5 * np.pi, 91)[:, None]
        turn = np.cos(angles) * view.right + np.sin(angles) * view.up
        growing = np.linspace(0.5, 2.6, 91)[:, None] * view.size * turn
        yield Stroke("spring", b + growing[:, :, None])
    if line in ("rod", "link"):
        yield Stroke(line, np.stack([a, b]))


def _symbol(mark: Mark, poses: Poses, view: View) -> Iterator[Stroke]:
    """Yield the block, axes and plate of a joint."""
    a, b, size = poses.axes[mark.a], poses.at[mark.b], view.size
    if mark.symbol.guide:
        yield Stroke("block", _block(poses.axes[mark.b], b, size))
    for end, k in mark.symbol.axes:
        axis = poses.axes[mark.a if end == "a" else mark.b, k]
        yield Stroke("axis", np.stack([b - 1.6 * size * axis, b + 1.6 * size * axis]))
    if mark.symbol.plate:
        corners = [(1, 1), (-1, 1), (-1, -1), (1, -1), (1, 1)]
        yield Stroke("axis", np.stack([b + 2 * size * (i * a[0] + j * a[1]) for i, j in corners]))


CORNERS = np.array([(i, j, k) for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)], dtype=float)
EDGES = [(i, j) for i in range(8) for j in range(i) if np.abs(CORNERS[i] - CORNERS[j]).sum() == 2]


def _block(axes: Array, at: Array, size: float) -> Array:
    """Return the edges of a cube."""
    corners = at + size * np.einsum("ca,aik->cik", CORNERS, axes)
    gap = np.full_like(at, np.nan)
    return np.stack([point for i, j in EDGES for point in (corners[i], corners[j], gap)])


def _aside_of(d: Array, view: View) -> Array:
    """Return the unit vectors across directions `d`, facing the viewer, shape (3, pictures)."""
    side = np.cross(d.T, view.eye)
    length = np.linalg.norm(side, axis=1, keepdims=True)
    side = np.where(length > 1e-6 * np.linalg.norm(d), side / np.maximum(length, 1e-300), view.up)
    return np.asarray(side.T)


def _zigzag(a: Array, b: Array, view: View) -> Array:
    """Return the points of a spring of 8 coils between two points, facing the viewer."""
    s = np.concatenate([[0.0, 0.1], np.linspace(0.125, 0.875, 16), [0.9, 1.0]])
    swing = np.concatenate([[0.0, 0.0], np.tile([1.0, -1.0], 8), [0.0, 0.0]]) * view.size
    d = b - a
    return a + s[:, None, None] * d + swing[:, None, None] * _aside_of(d, view)


def _dashpot(a: Array, b: Array, view: View) -> Array:
    """Return the points of a damper between two points: a cup, and a piston in it."""
    along = [0, 0.4, 0.4, 0.65, np.nan, 0.4, 0.4, 0.65, np.nan, 1, 0.55, np.nan, 0.55, 0.55]
    across = [0, 0, 1, 1, np.nan, 0, -1, -1, np.nan, 0, 0, np.nan, 0.7, -0.7]
    s, swing = np.array(along)[:, None, None], np.array(across)[:, None, None] * view.size
    return a + s * (b - a) + swing * _aside_of(b - a, view)
