"""Moving pictures in every format, whole or not at all, and their geometry."""

from base64 import b64decode
from io import BytesIO
from pathlib import Path

import casadi as ca
import matplotlib.pyplot as plt
import numpy as np
import pytest
from chains import attach
from matplotlib.animation import FFMpegWriter
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_hex
from PIL import Image

from symfric import BrownMcPhee, ExactCoulomb, Model, Trajectory, Variable, rabinowicz, simulate
from symfric.foundation.numeric import Array
from symfric.model.sketch import Mark, Part, Sketch, Symbol
from symfric.multibody import Distance, Mechanism, PinInSlot, Prismatic, Revolute
from symfric.multibody.results import SPRING
from symfric.results.animation import SLIDES, STICKS, frame_times, picture
from symfric.results.strokes import Poses, Stroke, View, look, strokes
from symfric.scenes import (
    ALL_SCENES,
    MECHANISMS,
    CoupledBlocks,
    DrillString,
    Pendulum,
    Prescribed,
    Rabinowicz,
)


@pytest.fixture(scope="module")
def runs() -> dict[str, Trajectory]:
    law = BrownMcPhee(v_t=0.02)
    names = ("pendulum", "four_mass")
    return {n: simulate(MECHANISMS[n](law).model(), 0.2, samples=5, backend="vm") for n in names}


def test_films_have_a_picture_per_frame_and_need_nothing_from_elsewhere(
    runs: dict[str, Trajectory], tmp_path: Path
) -> None:
    """A page lays each picture over their common part, which gives those of the GIF."""
    reported: list[float] = []
    path, open_before = tmp_path / "new" / "motion.gif", plt.get_fignums()
    runs["pendulum"].animate(path, fps=5, speed=0.5, progress=reported.append)
    assert reported == pytest.approx([1 / 3, 2 / 3, 1.0])
    runs["pendulum"].animate(path.with_suffix(".html"), fps=5, speed=0.5)
    text = path.with_suffix(".html").read_text()
    pictures = text.split("data:image/png;base64,")[1:]
    assert "http" not in text.replace(pictures[0], "")[:2000]
    assert 'max="2"' in text
    parts = [BytesIO(b64decode(part.split('"')[0])) for part in pictures]
    common, *layers = [Image.open(part).convert("RGBA") for part in parts]
    frames = list[Array]()
    with Image.open(path) as film:
        assert film.n_frames == len(layers) == 3  # 0.2 s at half speed
        assert film.info["duration"] == 200
        for k, layer in enumerate(layers):
            film.seek(k)
            frames.append(np.asarray(film.convert("RGB")))
            shown = Image.alpha_composite(common, layer).convert("RGB")
            assert (np.asarray(shown) == frames[k]).all()
    assert (frames[0] != frames[-1]).any()
    assert sorted(p.name for p in path.parent.iterdir()) == ["motion.gif", "motion.html"]
    assert plt.get_fignums() == open_before


@pytest.mark.slow
@pytest.mark.parametrize("name", ["quarter_car", "coupled_blocks", "pendulum"])
def test_films_of_scenes_have_at_most_500_kB(name: str, tmp_path: Path) -> None:
    """The largest of all scenes."""
    kind = ALL_SCENES[name]
    run = simulate(kind(BrownMcPhee()).model(), kind.t_end)
    for ending in ("gif", "html"):
        path = tmp_path / f"film.{ending}"
        run.animate(path)
        assert path.stat().st_size <= 500e3


@pytest.mark.parametrize("ending", ["gif", "html"])
def test_a_failed_film_leaves_nothing_behind(
    runs: dict[str, Trajectory], tmp_path: Path, ending: str
) -> None:
    def stop(done: float) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        runs["pendulum"].animate(tmp_path / f"x.{ending}", fps=5, progress=stop)
    assert list(tmp_path.iterdir()) == []


def test_what_cannot_be_filmed_is_refused_before_any_work(
    runs: dict[str, Trajectory], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(FFMpegWriter, "isAvailable", lambda: False)
    x = Variable("x", "m", start=1.0)
    decay = simulate(Model("decay", x=(x,), ode=-x.symbol), 0.1)
    speed = r"animation: (fps|speed): expected a number > 0"
    for run, ending, how, message in (
        (runs["pendulum"], "avi", {}, r"ending in \.gif, \.html, \.mp4, got '\.avi'"),
        (runs["pendulum"], "mp4", {}, r"ffmpeg for \.mp4, got none; write \.gif or \.html"),
        *((runs["pendulum"], "gif", bad, speed)
          for bad in ({"fps": 0.0}, {"speed": -1.0}, {"fps": np.nan})),
        (decay, "gif", {}, "'decay': expected a machine with places"),
    ):  # fmt: skip
        with pytest.raises(ValueError, match=message):
            run.animate(tmp_path / f"x.{ending}", **how)
    assert list(tmp_path.iterdir()) == []


def test_a_block_on_a_belt_is_seen_from_aside_with_its_spring_and_its_stick() -> None:
    """Carried by the belt it sticks, until the spring pulls it back."""
    run = simulate(rabinowicz(BrownMcPhee()), 8.0)
    figure, show = picture(run, np.array([0.0, 3.0, 7.0]))
    (axis,) = figure.axes
    assert (axis.get_xlabel(), axis.get_ylabel(), axis.get_aspect()) == ("x [m]", "z [m]", 1.0)
    joint = next(line for line in axis.lines if line.get_marker() == "s")
    fills = []
    for k, t in enumerate((0.0, 3.0, 7.0)):
        show(k)
        fills.append(to_hex(joint.get_markerfacecolor()))
        assert joint.get_xdata()[0] == pytest.approx(run.at(t)["x"][0])
    assert fills == [to_hex(fill) for fill in (SLIDES, STICKS, SLIDES)]
    small = simulate(Prescribed(BrownMcPhee()).model(), 1.0, u={"v": 1e-3})
    assert picture(small, np.array([0.0, 1.0]))[0].axes[0].get_xlabel() == "x [mm]"


def test_marks_of_a_belt_are_evenly_spaced_and_move_with_it() -> None:
    way = 0.15 * 0.8 * 9.81 / 2.1
    for kind, count in ((Rabinowicz, 9), (CoupledBlocks, 15)):
        run = simulate(kind(BrownMcPhee()).model(), 3.0, samples=3, backend="vm")
        figure, show = picture(run, np.array([0.0, 3.0]))
        ticks = [line for line in figure.axes[0].lines if line.get_marker() == "|"]
        at = list[Array]()
        for k in range(2):
            show(k)
            at.append(np.array([line.get_xdata()[0] for line in ticks]))
            assert np.diff(np.sort(at[k])) == pytest.approx(np.full(count - 1, way / 3))
            assert -1e-9 < at[k].min() + way < way / 3
        assert np.mod(at[1] - at[0], count * way / 3) == pytest.approx(np.full(count, 0.3))


@pytest.mark.parametrize("along", ["x", "z"])
def test_a_slider_alone_is_drawn_in_a_plane(along: str) -> None:
    machine = Mechanism("slider", gravity=(0.0, 0.0, 0.0))
    axis = tuple(float(along == other) for other in "xyz")
    attach(machine, Prismatic, "s", "block", z=axis, rate=1.0)
    figure, _ = picture(simulate(machine.build(), 0.1), np.array([0.0, 0.1]))
    assert figure.axes[0].name == "rectilinear"
    assert along in figure.axes[0].get_xlabel() + figure.axes[0].get_ylabel()


def test_what_is_too_fast_or_too_slow_is_shown_in_six_seconds() -> None:
    for end, speed, frames in ((4.0, 1.0, 81), (0.25, 0.25 / 6, 121), (60.0, 10.0, 121)):
        times, found = frame_times(0.0, end, 20.0, None)
        assert (found, times.size, times[0], times[-1]) == (pytest.approx(speed), frames, 0.0, end)


def test_spatial_mechanisms_have_one_scale_on_three_axes(runs: dict[str, Trajectory]) -> None:
    figure, _ = picture(runs["four_mass"], np.linspace(0.0, 0.2, 3))
    (axis,) = figure.axes
    assert [getattr(axis, f"get_{a}label")() for a in "xyz"] == ["x [m]", "y [m]", "z [m]"]
    spans = np.array([np.ptp(getattr(axis, f"get_{a}lim")()) for a in "xyz"])
    box = axis._box_aspect  # type: ignore[attr-defined]
    assert spans / spans.max() == pytest.approx(box / box.max())
    drawn = np.hstack([np.array(line.get_data_3d()) for line in axis.lines])  # type: ignore[attr-defined]
    size = np.nanmax(np.ptp(drawn[:, ~np.isnan(drawn).any(axis=0)], axis=1))
    assert size < spans.max() < 1.5 * size


def test_time_and_speed_stand_above_and_joints_show_whether_they_stick() -> None:
    """From rest at 1 rad: the hinge sticks first and slides then."""
    run = simulate(Pendulum(ExactCoulomb()).model(), 0.5)
    figure, show = picture(run, np.array([0.0, 0.5]), speed=0.1)
    (axis,) = figure.axes
    fills: list[str] = []
    for k in range(2):
        show(k)
        found = (str(line.get_markerfacecolor()) for line in axis.lines)
        fills += [fill for fill in found if fill in (STICKS, SLIDES)]
    assert fills == [STICKS, SLIDES]
    assert axis.get_title(loc="left") == "pendulum with ExactCoulomb\nt = 0.500 s  (0.1 x)"


def test_labels_of_spatial_axes_are_inside_the_picture() -> None:
    """Mechanisms that are tall, wide, deep or a line, and their small figures."""
    for reach in ((0.0, 0.0, 3.0), (0.1, 4.0, 1.0), (5e-3,) * 3):
        m = Mechanism("r")
        m.body("a", 1.0, (1.0, 1.0, 1.0))
        m.body("b", 1.0, (1.0, 1.0, 1.0))
        m.joint(Revolute("j", "ground", "a"))
        m.frame("a.end", reach, z=(1.0, 0.0, 0.0))
        m.joint(Revolute("k", "a.end", "b"))
        run = simulate(m.build(), 0.1, x0={"j_rate": 1.0}, samples=3)
        figure, _ = picture(run, np.array([0.0, 0.1]))
        FigureCanvasAgg(figure).draw()
        labels = [getattr(figure.axes[0], f"{axis}axis").label for axis in "xyz"]
        for label in labels:
            box = label.get_window_extent()
            assert figure.bbox.x0 <= box.x0 < box.x1 <= figure.bbox.x1, (reach, label.get_text())
            assert figure.bbox.y0 <= box.y0 < box.y1 <= figure.bbox.y1, (reach, label.get_text())


def test_the_hands_of_a_drill_string_turn_and_its_bit_sticks_at_first() -> None:
    run = simulate(DrillString(BrownMcPhee()).model(), 8.0, u={"w_top": 0.5})
    figure, show = picture(run, np.array([0.0, 8.0]))
    axis = figure.axes[0]
    circles = (line for line in axis.lines if line.get_marker() == "o")
    hub = next(line for line in circles if line.get_markersize() > 8)
    assert to_hex(hub.get_markerfacecolor()) == to_hex(STICKS)
    show(1)
    now = run.at(8.0)
    angle = now["phi"][0] + sum(now[f"twist_{i}"][0] for i in range(1, 5))
    ends = [np.asarray(line.get_xdata()) for line in axis.lines]
    tips = np.array([x[1] for x in ends if x.size == 3])  # centre, tip, gap
    assert np.abs(tips - np.sin(angle)).min() < 1e-9  # the hand of the top drive


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


def test_a_body_of_micrometres_is_drawn_as_a_line() -> None:
    axes, at = np.eye(3)[None, :, :, None], 1e-6 * np.stack([A, B])[:, :, None]
    sketch = Sketch(ca.SX(12, 2), (Part("body", 1, (0,)),), ())
    view = View(at[0], at[1], np.array([0.0, -1.0, 0.0]), True, 1e-7)
    roles = [s.role for s in strokes(sketch, Poses(axes, at, A[None, :, None]), view, {})]
    assert roles == ["path", "body", "centre"]


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
