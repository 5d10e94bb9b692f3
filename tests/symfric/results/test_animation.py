"""Moving pictures in every format, whole or not at all."""

from base64 import b64decode
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pytest
from chains import attach
from matplotlib.animation import FFMpegWriter
from matplotlib.colors import to_hex
from PIL import Image

from symfric import (
    BrownMcPhee,
    ExactCoulomb,
    Law,
    Model,
    Trajectory,
    Variable,
    rabinowicz,
    simulate,
)
from symfric.multibody import Mechanism, Prismatic
from symfric.results.animation import SLIDES, STICKS, frame_times, picture
from symfric.scenes import MECHANISMS, DrillString, Pendulum, Prescribed


@pytest.fixture(scope="module")
def runs() -> dict[str, Trajectory]:
    law = BrownMcPhee(v_t=0.02)
    names = ("pendulum", "four_mass")
    return {n: simulate(MECHANISMS[n](law).model(), 0.2, samples=5, backend="vm") for n in names}


def test_films_have_a_picture_per_frame_and_need_nothing_from_elsewhere(
    runs: dict[str, Trajectory], tmp_path: Path
) -> None:
    told: list[float] = []
    path, open_before = tmp_path / "new" / "motion.gif", plt.get_fignums()
    runs["pendulum"].animate(path, fps=10, speed=0.5, progress=told.append)
    with Image.open(path) as film:
        assert (film.n_frames, film.info["duration"]) == (5, 100)  # 0.2 s at half speed
        first = np.asarray(film.convert("RGB"))
        film.seek(film.n_frames - 1)
        last = np.asarray(film.convert("RGB"))
    assert first.shape == last.shape
    assert (first != last).any()
    assert told == pytest.approx([0.2, 0.4, 0.6, 0.8, 1.0])
    runs["pendulum"].animate(path.with_suffix(".html"), fps=10, speed=0.5)
    text = path.with_suffix(".html").read_text()
    pictures = text.split("data:image/png;base64,")[1:]
    assert len(pictures) == 5
    assert b64decode(pictures[0].split('"')[0]).startswith(b"\x89PNG")
    assert "http" not in text.replace(pictures[0], "")[:2000]
    assert 'max="4"' in text
    assert sorted(p.name for p in path.parent.iterdir()) == ["motion.gif", "motion.html"]
    assert plt.get_fignums() == open_before


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
    # marks of the belt move with it
    ticks = [line for line in axis.lines if line.get_marker() == "|"]
    length, at = 3 * 0.15 * 0.8 * 9.81 / 2.1, list[list[float]]()
    for k in range(2):
        show(k)
        at.append([line.get_xdata()[0] for line in ticks])
    assert np.mod(np.subtract(at[1], at[0]), length) == pytest.approx(np.full(9, 0.3))
    small = simulate(Prescribed(BrownMcPhee()).model(), 1.0, u={"v": 1e-3})
    assert picture(small, np.array([0.0, 1.0]))[0].axes[0].get_xlabel() == "x [mm]"


@pytest.mark.parametrize("along", ["x", "y", "z"])
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


@pytest.mark.parametrize("law", [BrownMcPhee(v_t=0.02), ExactCoulomb()], ids=["smooth", "exact"])
def test_time_and_speed_stand_above_and_joints_show_whether_they_stick(law: Law) -> None:
    """From rest at 1 rad: the hinge sticks first and slides then."""
    run = simulate(Pendulum(law).model(), 0.5)
    figure, show = picture(run, np.array([0.0, 0.5]), speed=0.1)
    (axis,) = figure.axes
    fills: list[str] = []
    for k in range(2):
        show(k)
        found = (str(line.get_markerfacecolor()) for line in axis.lines)
        fills += [fill for fill in found if fill in (STICKS, SLIDES)]
    assert fills == [STICKS, SLIDES]
    assert axis.get_title(loc="left") == "pendulum   t = 0.500 s  (0.1 x)"


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
