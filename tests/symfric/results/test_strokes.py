"""Geometry of moving pictures: views, springs, blocks, guides."""

import casadi as ca
import numpy as np
import pytest
from numpy.typing import NDArray

from symfric.model.sketch import Mark, Part, Sketch, Symbol
from symfric.multibody import Distance, PinInSlot, Prismatic, Revolute, Spherical
from symfric.multibody.results import SPRING
from symfric.results.strokes import Poses, Stroke, View, look, strokes

Array = NDArray[np.float64]
FRAMES = 7


def turned(axis: int, angles: Array) -> Array:
    """Axes of a frame that turns about a world axis, shape (axis, component, pictures)."""
    c, s = np.cos(angles), np.sin(angles)
    R = np.zeros((3, 3, angles.size))
    i, j = (axis + 1) % 3, (axis + 2) % 3
    R[axis, axis], R[i, i], R[j, j], R[j, i], R[i, j] = 1, c, c, s, -s
    return R.transpose(1, 0, 2)


def arm(normal: int, length: float = 2.0, lift: float = 0.0) -> tuple[Sketch, Poses]:
    """A rod on the ground that turns about a world axis, its centre at the far end."""
    angles = np.linspace(0.2, 1.9, FRAMES)
    axes = turned(normal, angles)
    first = axes[(normal + 1) % 3]
    far = length * first + lift * np.outer(np.eye(3)[normal], angles)
    ground = np.repeat(np.eye(3)[:, :, None], FRAMES, axis=2)
    hinge = np.roll(ground, 2 - normal, axis=0), np.roll(axes, 2 - normal, axis=0)
    at = np.stack([np.zeros((3, FRAMES)), np.zeros((3, FRAMES)), np.zeros((3, FRAMES)), far])
    parts = (Part("ground", 2, (0,), fixed=True), Part("rod", 3, (1,)))
    marks = (Mark("hinge", Revolute.symbol, 0, 1, grounded=True),)
    poses = Poses(np.stack([*hinge, ground, axes]), at, np.stack([0 * far, far]))
    return Sketch(ca.SX(12, 4), parts, marks), poses


def test_planar_motion_is_seen_along_its_normal_and_holds_all_places() -> None:
    for normal, right, up in ((0, "y", "z"), (1, "x", "z"), (2, "x", "y")):
        sketch, poses = arm(normal)
        view = look(sketch, poses)
        assert view.planar
        assert view.right == pytest.approx(np.eye(3)["xyz".index(right)])
        assert view.up == pytest.approx(np.eye(3)["xyz".index(up)])
        assert np.cross(view.right, view.up) == pytest.approx(view.eye)
        assert (view.low < poses.at.min(axis=(0, 2))).all()
        assert (view.high > poses.paths.max(axis=(0, 2))).all()
        assert view.size == pytest.approx(0.02 * np.ptp(poses.at, axis=(0, 2)).max())
    spatial = look(*arm(1, lift=1e-3))
    assert not spatial.planar
    assert np.linalg.norm(spatial.eye) == pytest.approx(1.0)


def test_a_mechanism_at_rest_is_seen_along_its_hinges() -> None:
    sketch, poses = arm(1)
    still = Poses(*(np.repeat(a[..., :1], FRAMES, axis=-1) for a in (poses.axes, poses.at)),
                  poses.paths[..., :1])  # fmt: skip
    view = look(sketch, still)
    assert view.planar
    assert abs(view.eye[1]) == pytest.approx(1.0)


def drawn(symbol: Symbol, a: Array, b: Array, **more: object) -> dict[str, Stroke]:
    """Strokes by role of one mark between two places that stand still."""
    axes = np.tile(np.eye(3)[None, :, :, None], (3, 1, 1, 1))
    poses = Poses(axes, np.stack([a, b, b])[:, :, None], b[None, :, None])
    sketch = Sketch(ca.SX(12, 3), (Part("body", 2, (1,)),), (Mark("it", symbol, 0, 1, **more),))  # type: ignore[arg-type]
    view = View(a, b, np.array([0.0, -1.0, 0.0]), True, 0.1)
    sticks = {"it": np.array([True])} if more.get("slips") else {}
    return {s.role: s for s in strokes(sketch, poses, view, sticks)}


A, B = np.zeros(3), np.array([3.0, 0.0, 4.0])


def test_a_spring_runs_from_end_to_end_and_swings_in_the_picture() -> None:
    points = drawn(SPRING, A, B)["spring"].points[:, :, 0]
    assert points[0] == pytest.approx(A)
    assert points[-1] == pytest.approx(B)
    along = points @ B / 5
    assert (np.diff(along) > 0).all()
    off = points - np.outer(along, B / 5)
    assert np.abs(off[:, 1]).max() == pytest.approx(0.0, abs=1e-12)
    assert np.linalg.norm(off, axis=1).max() == pytest.approx(0.1)
    towards_the_eye = drawn(SPRING, A, np.array([0.0, 2.0, 0.0]))["spring"].points
    assert np.isfinite(towards_the_eye).all()


def test_a_block_has_the_twelve_edges_of_a_cube() -> None:
    points = drawn(Spherical.symbol, A, B)["block"].points[:, :, 0].reshape(12, 3, 3)
    assert np.isnan(points[:, 2]).all()
    lengths = np.linalg.norm(points[:, 0] - points[:, 1], axis=1)
    assert lengths == pytest.approx(np.full(12, 0.24))
    assert np.mean(points[:, :2], axis=(0, 1)) == pytest.approx(B)


def test_a_guide_reaches_beyond_the_slide_on_the_axis_of_its_parent() -> None:
    found = drawn(Prismatic.symbol, A, np.array([0.0, 0.0, 2.0]), grounded=True)
    assert found["ground"].points[:, :, 0] == pytest.approx(np.array([[0, 0, 1.7], [0, 0, 2.3]]))
    assert "anchor" not in found
    assert "guide" in drawn(Prismatic.symbol, A, B)


def test_a_slot_reaches_from_its_body_to_beyond_the_pin() -> None:
    found = drawn(PinInSlot.symbol, A, np.array([0.0, 0.0, 2.0]))
    assert found["guide"].points[:, :, 0] == pytest.approx(np.array([[0, 0, -0.3], [0, 0, 2.3]]))
    assert found["joint"].points[0, :, 0] == pytest.approx(np.array([0.0, 0.0, 2.0]))
    assert not PinInSlot.symbol.turnable  # the slot stays that of its body


def test_joints_show_the_ground_what_their_contacts_do_and_rods_a_line() -> None:
    bare = drawn(Revolute.symbol, A, A)
    assert "anchor" not in bare and bare["joint"].sticks is None
    anchor = drawn(Revolute.symbol, A, A, grounded=True)["anchor"]
    assert anchor.points[0, :, 0] == pytest.approx(A)
    joint = drawn(Revolute.symbol, A, A, slips=(("it_slip", 0.1),))["joint"]
    assert joint.sticks is not None and joint.sticks.all()
    rod = drawn(Distance.symbol, A, B)
    assert rod["rod"].points[:, :, 0] == pytest.approx(np.stack([A, B]))
    assert "joint" not in rod
