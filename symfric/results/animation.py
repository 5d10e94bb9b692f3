"""Animations of mechanisms."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from io import BytesIO
from pathlib import Path
from string import Template
from typing import Any, TypeVar

import numpy as np
from matplotlib.animation import FFMpegWriter
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray
from PIL import Image

from symfric.foundation import checks
from symfric.foundation.files import write_text, written
from symfric.foundation.numeric import Array
from symfric.foundation.panels import blank, grid
from symfric.foundation.shown import png_uri
from symfric.foundation.style import EDGE, colour
from symfric.foundation.units import readable
from symfric.foundation.variable import stacked
from symfric.model.sketch import Sketch
from symfric.results.kinds import friction_laws
from symfric.results.signals import Signals
from symfric.results.strokes import AZIMUTH, ELEVATION, Poses, Stroke, View, look, strokes

Frame = TypeVar("Frame")
ENDINGS = (".gif", ".html", ".mp4")
Flags = NDArray[np.bool_]
BRIEF, LONG, SHOWN = 2.0, 12.0, 6.0
"""Motions between BRIEF and LONG [s] are shown in real time, other motions in SHOWN [s]."""
INSIDE = np.array([[0.01, 0.01], [0.99, 0.94]])
"""Corners of the part of a figure that contains spatial axes and their labels."""
SIZE = 6.4
"""Larger side of the panel of an animation [inch]."""
PATH = 1001
"""Number of points in the path of a centre of mass."""
STICKS, SLIDES = colour(1), "white"
"""Fill colours of joints with friction: filled if they stick, hollow if they slide."""
GROUND = "#8c6d46"
PASSES = 3
"""Number of drawing passes after which a layout with equal axis scales is stationary."""
FLATTEST = 0.4
"""Smallest ratio of the sides of a planar picture."""


def animate(
    trajectory: Signals,
    path: str | Path,
    *,
    fps: float = 12.5,
    speed: float | None = None,
    progress: Callable[[float], None] | None = None,
) -> None:
    """Write an animation of `trajectory`; see `Trajectory.animate`.

    Raises:
        ValueError: the model has no bodies, the file suffix is not supported, ffmpeg is missing, or
            a number is not positive.
    """
    check_format(path)
    for name, value in (("fps", fps), ("speed", speed)):
        if value is not None:
            checks.number(f"animation: {name}", value, above=0.0)
    times, speed = frame_times(float(trajectory.t[0]), float(trajectory.t[-1]), fps, speed)
    figure, pose = picture(trajectory, times, speed)

    def told(frames: Iterable[Frame]) -> Iterator[Frame]:
        for k, frame in enumerate(frames, start=1):
            if progress is not None:
                progress(k / times.size)
            yield frame

    ending = Path(path).suffix.lower()
    if ending == ".mp4":
        movie = FFMpegWriter(fps)  # type: ignore[arg-type]
        with written(path) as temporary, movie.saving(figure, str(temporary), dpi=100):
            for k in told(range(times.size)):
                pose(k)
                movie.grab_frame()
        return
    film = list(told(pictures(figure, pose, times.size)))
    write = write_page if ending == ".html" else write_gif
    write(path, film, fps)


def check_format(path: str | Path) -> None:
    """Check that the format given by the suffix of a path can be written.

    Raises:
        ValueError: the suffix is not .gif, .html or .mp4, or it is .mp4 and ffmpeg is missing.
    """
    ending = checks.path("animation", path).suffix.lower()
    if ending not in ENDINGS:
        raise ValueError(
            f"animation '{path}': expected a file ending in {', '.join(ENDINGS)}, got '{ending}'"
        )
    if ending == ".mp4" and not FFMpegWriter.isAvailable():
        raise ValueError(
            f"animation '{path}': expected the program ffmpeg for .mp4, got none; "
            "write .gif or .html, which need no program"
        )


def frame_times(begin: float, end: float, fps: float, speed: float | None) -> tuple[Array, float]:
    """Return the times of the pictures [s] and the speed relative to real time."""
    span = end - begin
    if speed is None:
        speed = 1.0 if BRIEF <= span <= LONG else max(span, 1e-300) / SHOWN
    return np.linspace(begin, end, max(2, round(span / speed * fps) + 1)), speed


def picture(
    trajectory: Signals, times: Array, speed: float = 1.0
) -> tuple[Figure, Callable[[int], None]]:
    """Return a figure of a mechanism, and a function of k that draws the pose at times[k].

    Raises:
        ValueError: the model has no bodies.
    """
    model = trajectory.model
    if model.sketch is None or model.sketch().still:
        raise ValueError(
            f"animation of '{trajectory.scene}': expected a machine with places, got a model "
            "without a sketch that moves; plot() shows its signals"
        )
    sketch = model.sketch()
    columns = trajectory.of(sketch.places, times).reshape(-1, 12, times.size)
    centres = sketch.places[9:, [part.centre for part in sketch.parts]]
    fine = np.linspace(times[0], times[-1], PATH)
    paths = trajectory.of(centres, fine).reshape(-1, 3, PATH)
    sticks = _sticks(trajectory, sketch, times)
    figure, drawn = _drawn(sketch, columns, paths, sticks)
    title = figure.axes[0].set_title("", loc="left", fontsize="medium")
    laws = friction_laws(model)
    named = f"{trajectory.scene} with {laws}\n" if laws else f"{trajectory.scene}   "
    factor = "" if abs(speed - 1) < 1e-9 else f"  ({speed:.3g} x)"
    if sticks:
        entries = [
            Line2D([], [], linestyle="", marker="o", color=EDGE, markerfacecolor=fill, label=label)
            for fill, label in ((SLIDES, "slides"), (STICKS, "sticks"))
        ]
        side = "upper right" if figure.get_layout_engine() is None else "outside lower right"
        figure.legend(handles=entries, loc=side, ncols=2, frameon=False, fontsize="small",
                      handletextpad=0.2)  # fmt: skip

    def show(k: int) -> None:
        for put in drawn:
            put(k)
        title.set_text(f"{named}t = {times[k]:.3f} s{factor}")

    show(0)
    for _ in range(PASSES):
        figure.draw_without_rendering()
    figure.set_layout_engine("none")  # every picture has the layout of the first one
    return figure, show


def _drawn(
    sketch: Sketch, columns: Array, paths: Array, sticks: Mapping[str, Flags]
) -> tuple[Figure, list[Callable[[int], None]]]:
    """Return a figure, and a function of k for each stroke that draws it as in picture k.

    Args:
        sketch: places, parts and marks.
        columns: axes and positions of the places in each picture, shape (places, 12, pictures).
        paths: centres of the parts, shape (parts, 3, times).
        sticks: flags by joint, True in pictures where its contacts stick.
    """
    poses = Poses(columns[:, :9].reshape(-1, 3, 3, columns.shape[2]), columns[:, 9:], paths)
    view = look(sketch, poses)
    figure, axes = _flat(view) if view.planar else _spatial(view)
    return figure, [_added(figure, axes, s) for s in strokes(sketch, poses, view, sticks)]


def _sticks(trajectory: Signals, sketch: Sketch, times: Array) -> dict[str, Flags]:
    """Return flags by joint, True at times when all its contacts are slower than their limit."""
    marks = [mark for mark in sketch.marks if mark.slips]
    if not marks:
        return {}
    names = list(dict.fromkeys(name for mark in marks for name, _ in mark.slips))
    column = stacked([*(trajectory.model.expression(name) for name in names), 0])
    slip = dict(zip(names, trajectory.of(column, times), strict=False))
    return {
        mark.name: np.all([np.abs(slip[name]) < limit for name, limit in mark.slips], axis=0)
        for mark in marks
    }


def _flat(view: View) -> tuple[Figure, Array]:
    """Return a figure that shows a plane along its normal, and the projection to its axes."""
    axes = np.stack([view.right, view.up])
    low, high = axes @ view.low, axes @ view.high
    low, high = np.minimum(low, high), np.maximum(low, high)
    extent = high - low
    more = np.maximum(FLATTEST * extent.max() - extent, 0) / 2
    low, high = low - more, high + more
    width, height = high - low
    factor, unit = readable("m", [low, high])
    low, high = factor * low, factor * high
    scale = SIZE / max(width, height)
    figure, ((ax,),) = grid(1, 1, scale * width + 0.9, scale * height + 0.9)
    ax.set_aspect("equal")
    ax.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]))
    ax.set(xlabel=f"{_direction(view.right)} [{unit}]", ylabel=f"{_direction(view.up)} [{unit}]")
    return figure, factor * axes


def _spatial(view: View) -> tuple[Figure, Array]:
    """Return a figure with three axes of equal scale, and the projection to its axes."""
    figure = blank(1.125 * SIZE, SIZE, free=True)
    ax: Any = figure.add_subplot(projection="3d", proj_type="ortho")
    extent = view.high - view.low
    extent = np.maximum(extent, 0.15 * extent.max())
    middle = (view.low + view.high) / 2
    for k, axis in enumerate("xyz"):
        count = max(1, round(6 * extent[k] / extent.max()))
        ticks = MaxNLocator(count, min_n_ticks=1)  # by default 2, whose labels would overlap
        getattr(ax, f"set_{axis}lim")(middle[k] - extent[k] / 2, middle[k] + extent[k] / 2)
        getattr(ax, f"set_{axis}label")(f"{axis} [m]")
        getattr(ax, f"{axis}axis").set_major_locator(ticks)
    ax.set_box_aspect(extent, zoom=1.12)
    figure.subplots_adjust(left=0.0, right=0.95, bottom=0.04, top=0.93)
    ax.view_init(ELEVATION, AZIMUTH)
    _fit(figure, ax)
    return figure, np.eye(3)


def _fit(figure: Figure, ax: Any) -> None:
    """Shrink and move axes until their labels are inside the figure, below the title."""
    for _ in range(PASSES):
        figure.draw_without_rendering()
        box = ax.get_tightbbox().transformed(figure.transFigure.inverted())
        place = ax.get_position()
        share = min(1.0, *((INSIDE[1] - INSIDE[0]) / box.size))
        low, high = box.min * share, box.max * share
        shift = np.maximum(INSIDE[0] - low, 0) + np.minimum(INSIDE[1] - high, 0)
        ax.set_position([*(share * place.min + shift), *(share * place.size)])


def _added(figure: Figure, axes: Array, stroke: Stroke) -> Callable[[int], None]:
    """Add a stroke to the figure, and return a function of k that draws it as in picture k."""
    points = np.einsum("ac,nck->kan", axes, stroke.points)
    canvas: Any = figure.axes[0]
    (line,) = canvas.plot(*([] for _ in axes), **style(stroke))
    place = line.set_data if len(axes) == 2 else line.set_data_3d

    def put(k: int) -> None:
        place(*points[k])
        if stroke.sticks is not None:
            line.set_markerfacecolor(STICKS if stroke.sticks[k] else SLIDES)

    return put


def _direction(axis: Array) -> str:
    """Return the name of a direction, such as x or -y, or else its components."""
    k = int(np.argmax(np.abs(axis)))
    if abs(abs(axis[k]) - 1) < 1e-9:
        return "xyz"[k] if axis[k] > 0 else f"-{'xyz'[k]}"
    return "({:.2g}, {:.2g}, {:.2g})".format(*(axis.round(9) + 0.0))


def style(stroke: Stroke) -> dict[str, Any]:
    """Return the style keywords of a stroke."""
    shade = colour(stroke.body) if stroke.body >= 0 else EDGE
    styles: dict[str, dict[str, Any]] = {
        "path": {"color": shade, "linewidth": 0.8, "alpha": 0.35},
        "body": {"color": shade, "linewidth": 4.0, "solid_capstyle": "round"},
        "outline": {"color": shade if stroke.body >= 0 else GROUND, "linewidth": 1.2},
        "arm": {"color": shade, "linewidth": 1.2},
        "centre": {"color": shade, "marker": "o", "markersize": 7.0},
        "block": {"color": shade, "linewidth": 1.2},
        "axis": {"color": EDGE, "linewidth": 1.2},
        "guide": {"color": EDGE, "linewidth": 1.0, "linestyle": "-."},
        "ground": {"color": GROUND, "linewidth": 3.0, "alpha": 0.6},
        "anchor": {"color": GROUND, "marker": "^", "markersize": 13.0, "linestyle": ""},
        "rod": {"color": EDGE, "linewidth": 1.8},
        "damper": {"color": EDGE, "linewidth": 1.2},
        "link": {"color": EDGE, "linewidth": 1.4, "linestyle": "--"},
        "spring": {"color": "#7f7f7f", "linewidth": 1.0},
        "joint": {"color": EDGE, "marker": stroke.marker, "linestyle": "", "markeredgewidth": 1.6,
                  "markersize": 4.0 if stroke.sticks is None else 9.0,
                  "markerfacecolor": EDGE if stroke.sticks is None else SLIDES},
    }  # fmt: skip
    return styles[stroke.role]


# ---- films: pictures with one short palette, as GIF or as an HTML page with a slider ----

DPI = 72
"""Resolution of a film [dots per inch]; with it, films of all scenes have at most 500 kB."""
SHADES = 16
"""Number of colours of a film; the last one is transparent in HTML."""
SAMPLES = 8
"""Number of pictures from which the palette is chosen."""
SEEN = 32
"""Largest number of pictures from which their common part is taken."""


def pictures(figure: Figure, pose: Callable[[int], None], count: int) -> Iterator[Image.Image]:
    """Yield the pictures of a film, which have a common palette.

    Args:
        figure: figure of the film, whose resolution becomes that of the film.
        pose: function of k that changes the figure to picture k.
        count: number of pictures.
    """
    figure.set_dpi(DPI)
    canvas = FigureCanvasAgg(figure)

    def drawn(k: int) -> Image.Image:
        pose(k)
        canvas.draw()
        return Image.fromarray(np.asarray(canvas.buffer_rgba())).convert("RGB")

    chosen = np.unique(np.linspace(0, count - 1, SAMPLES).round().astype(int))
    seen = np.concatenate([np.asarray(drawn(int(k))) for k in chosen])
    palette = Image.fromarray(seen).quantize(SHADES - 1, method=Image.Quantize.MAXCOVERAGE)
    for k in range(count):
        yield drawn(k).quantize(palette=palette, dither=Image.Dither.NONE)


def write_gif(path: str | Path, film: Sequence[Image.Image], fps: float) -> None:
    """Write a film as GIF, in which each picture has only what differs from the one before it."""
    with written(path) as temporary:
        film[0].save(temporary, "GIF", save_all=True, append_images=film[1:],
                     duration=round(1000 / fps), loop=0)  # fmt: skip


def write_page(path: str | Path, film: Sequence[Image.Image], fps: float) -> None:
    """Write a film as an HTML page, in which each picture lies over what most have in common."""
    common = np.median([np.asarray(picture) for picture in film[:: 1 + len(film) // SEEN]], axis=0)
    common = common.astype(np.uint8)
    shades = (np.asarray(picture) for picture in film)
    layers = [common, *(np.where(own == common, np.uint8(SHADES - 1), own) for own in shades)]
    sources = ",\n".join(f'"{_uri(layer, film[0].getpalette())}"' for layer in layers)
    player = Template(Path(__file__).with_name("player.html").read_text("utf-8"))
    settings = {"pictures": sources, "last": len(film) - 1, "wait": round(1000 / fps)}
    write_text(path, player.substitute(settings))


def _uri(shades: Any, palette: Any) -> str:
    """Return a picture with few colours, the last of which is transparent, as a data URI."""
    picture, buffer = Image.fromarray(shades), BytesIO()
    picture.putpalette([*palette, 255, 255, 255])
    picture.save(buffer, "PNG", bits=4, optimize=True, transparency=SHADES - 1)
    return png_uri(buffer.getvalue())
