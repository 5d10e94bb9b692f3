"""Labelled schematic of a machine: bodies, elements, positive directions, and friction contacts."""

import re
from collections.abc import Iterable, Iterator, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import casadi as ca
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from symfric.foundation.numeric import Array
from symfric.foundation.panels import MILLIMETRE, blank, save
from symfric.foundation.style import COLOURS, EDGE
from symfric.foundation.variable import starts_of, symbols_of
from symfric.model import Contact, Model
from symfric.model.sketch import Arrow, Mark, Sketch
from symfric.results.animation import style
from symfric.results.strokes import Poses, View, look, outlines, strokes

WIDTH = 85 * 72 * MILLIMETRE
"""Width of a schematic [pt]."""
TEXT, SIZE = 7.0, 4.5
"""Font size, and half the size of the symbol of a joint [pt]."""
ROOMS = ((26.0, 220.0), (34.0, 280.0), (42.0, 340.0), (52.0, 420.0), (64.0, 540.0))
"""Margin and largest height [pt], of which the first is used with which all labels fit."""
LOWEST = 66.0
"""Least height [pt]."""
RADII = (3.0, 6.0, 10.0, 15.0, 21.0, 28.0, 36.0, 46.0, 60.0, 80.0, 105.0)
"""Distances at which a place is sought for a label [pt]."""
THIN = 0.55
"""Ratio of the line widths of a schematic to those of a film."""
CORNER = np.array([11.0, 11.0])
"""Origin of the arrows of the axes [pt]."""
TILT = 0.35
"""Share by which the view is tilted towards the axis of a rotation."""
RUBS, MOVES, DRIVES, BODY = COLOURS[1], COLOURS[0], COLOURS[2], "#606060"
"""Colours of contacts with friction, of coordinates and velocities, of inputs, and of bodies."""
GREEK = re.compile(
    "alpha|beta|gamma|delta|epsilon|zeta|eta|theta|kappa|lambda|mu|nu|xi|rho|sigma|tau|phi|chi|psi|"
    "omega"
)


class Label(NamedTuple):
    """Text at a point of the paper [pt]."""

    text: str
    at: Array
    colour: str = EDGE


class Page(NamedTuple):
    """Projection of a machine to paper.

    Attributes:
        axes: directions to the right and upward, shape (2, 3).
        eye: unit vector towards the viewer.
        scale: points per metre.
        shift: position of the origin [pt].
        height: height of the paper [pt].
    """

    axes: Array
    eye: Array
    scale: float
    shift: Array
    height: float

    def at(self, points: Array) -> Array:
        """Return points in space, shape (..., 3), on paper, shape (..., 2)."""
        return np.asarray(self.scale * points @ self.axes.T + self.shift)


def schematic(model: Model, path: str | Path | None = None) -> Figure:
    """Return a labelled figure of a machine at its start, 85 mm wide.

    Names of bodies and elements are black, coordinates, velocities and given forces with their
    positive directions blue, inputs green, and contacts with friction and their loads orange.
    Labels for which no place is free are omitted.

    Raises:
        ValueError: the model has no sketch.
    """
    if model.sketch is None:
        raise ValueError(
            f"schematic of '{model.name}': expected a machine with places, got a model without a "
            "sketch; a Mechanism and every scene have one"
        )
    sketch = model.sketch()
    sketch = sketch.layout or sketch
    columns = _start(model, sketch.places).T[:, :, None]
    at = columns[:, 9:]
    poses = Poses(columns[:, :9].reshape(-1, 3, 3, 1), at, at[[p.centre for p in sketch.parts]])
    view = look(sketch, poses)
    solids = [solid[:, :, 0] for part in sketch.parts for solid in outlines(part, poses)]
    figure = blank()
    for room in ROOMS:
        page = _page(view, np.concatenate([at[:, :, 0], *solids]), *room)
        figure = blank(WIDTH / 72, page.height / 72, free=True)
        axes: Any = figure.add_axes((0.0, 0.0, 1.0, 1.0))
        axes.set(xlim=(0, WIDTH), ylim=(0, page.height))
        axes.set_axis_off()
        lines = [*_drawn(axes, sketch, poses, view, page)]
        labels = [*_labels(sketch, model, poses, page)]
        for text, ways, colour in _arrows(sketch, model, poses, page):
            axes.plot(*ways.T, color=colour, linewidth=0.9)
            axes.annotate("", ways[-1], ways[-2], arrowprops={
                "arrowstyle": "-|>,head_width=0.14,head_length=0.3", "color": colour,
                "shrinkA": 0, "shrinkB": 0, "linewidth": 0.9})  # fmt: skip
            lines.append(ways)
            labels.append(Label(text, ways[-1], colour))
        if _written(axes, labels, _filled(lines), page):
            break
    return save(figure, path, 300)


def _start(model: Model, places: ca.SX) -> Array:
    """Return the places at the start of the model."""
    every = (*model.x, *model.z, *model.u, *model.p)
    known = ca.vertcat(symbols_of(every), model.t)
    for _ in range(2):  # start values may contain parameters
        places = ca.substitute(places, known, ca.vertcat(starts_of(every), 0.0 * model.t))
    return np.array(ca.DM(places))


def _page(view: View, at: Array, margin: float, highest: float) -> Page:
    """Return the paper with all points at least `margin` [pt] from its edges."""
    axes = np.stack([view.right, view.up])
    flat = at @ axes.T
    low, high = np.nanmin(flat, axis=0), np.nanmax(flat, axis=0)
    room = np.array([WIDTH, highest]) - 2 * margin
    scale = float(np.min(room / np.maximum(high - low, 1e-9)))
    height = max(scale * (high - low)[1] + 2 * margin, LOWEST)
    middle = np.array([WIDTH, height]) / 2
    return Page(axes, view.eye, scale, middle - scale * (low + high) / 2, height)


def _drawn(axes: Any, sketch: Sketch, poses: Poses, view: View, page: Page) -> Iterator[Array]:
    """Draw bodies, elements and contacts with friction, and yield their lines [pt]."""
    for stroke in strokes(sketch, poses, view._replace(size=SIZE / page.scale), {}):
        if stroke.role == "path":
            continue
        how = style(stroke)
        if stroke.body >= 0:
            how["color"] = BODY
        how |= {key: THIN * how[key] for key in ("linewidth", "markersize") if key in how}
        line = page.at(stroke.points[:, :, 0])
        axes.plot(*line.T, **how)
        yield line
    for mark in sketch.marks:
        if mark.contacts:
            line = _rubbing(mark, poses, page)
            axes.plot(*line.T, color=RUBS, linewidth=1.6)
            yield line


def _rubbing(mark: Mark, poses: Poses, page: Page) -> Array:
    """Return a line along a guide below its block, or else a ring around a joint [pt]."""
    at = page.at(poses.at[mark.b, :, 0])
    along = page.axes @ poses.axes[mark.a, 2, :, 0]
    if mark.symbol.guide and np.linalg.norm(along) > TILT:
        along = along / np.linalg.norm(along)
        below = np.array([along[1], -along[0]])
        return at + SIZE * np.array([1.3 * below - 1.6 * along, 1.3 * below + 1.6 * along])
    return at + 1.5 * SIZE * _circle(0.0, 2 * np.pi)


def _circle(start: float, end: float) -> Array:
    angles = np.linspace(start, end, 49)
    return np.stack([np.cos(angles), np.sin(angles)], axis=1)


def _labels(sketch: Sketch, model: Model, poses: Poses, page: Page) -> Iterator[Label]:
    """Yield the labels of contacts, bodies and elements."""
    at = page.at(poses.at[:, :, 0])
    known = {contact.name: contact for contact in model.contacts}
    for mark in sketch.marks:
        middle = (at[mark.a] + at[mark.b]) / 2
        if mark.symbol.line == "circle":
            middle = at[mark.a]
        for name in mark.contacts:
            load = _load(known[name], model) if name in known else "$N$"
            yield Label(f"{name}: {load}", at[mark.b], RUBS)
        if mark.label:
            yield Label(_symbols(mark.label.split(", ")), middle)
    for part in sketch.parts:
        if not part.fixed:
            mass = f", {_symbols([part.label])}" if part.label else ""
            yield Label(f"{part.name}{mass}", at[part.centre])


def _load(contact: Contact, model: Model) -> str:
    """Return the load of a contact as a formula: a product of parameters, or else N."""
    factors = re.sub(r"[()\s]", "", str(ca.SX(contact.N))).split("*")
    own = {p.name for p in model.p}
    if len(factors) > 1 and all(factor in own for factor in factors):
        return f"$N$ = {' '.join(map(formula, factors))}"
    return "$N$"


def _symbols(texts: Iterable[str]) -> str:
    """Return symbols as formulas, and values with units as they are."""
    return ", ".join(
        text if re.match(r"[-\d]", text) else re.sub(r"[A-Za-z]\w*", lambda m: formula(m[0]), text)
        for text in texts
    )


def formula(name: str) -> str:
    """Return a name as a formula, such as `mu_s`, `tau1` and `phi_rate`; words are texts."""
    base, *under = re.sub(r"(?<=[A-Za-z])(\d+)", r"_\1", name.removesuffix("_rate")).split("_")
    if len(base) > 1 and not GREEK.fullmatch(base):
        return name
    first = base if len(base) == 1 else rf"\{base}"
    first = rf"\dot{{{first}}}" if name.endswith("_rate") else first
    lower = ",".join(part if part.isdigit() else rf"\mathrm{{{part}}}" for part in under if part)
    return f"${first}_{{{lower}}}$" if lower else f"${first}$"


def _arrows(
    sketch: Sketch, model: Model, poses: Poses, page: Page
) -> Iterator[tuple[str, Array, str]]:
    """Yield the text, the line [pt] and the colour of each arrow."""
    for k, axis in enumerate("xyz"):
        along = page.axes[:, k]
        if np.linalg.norm(along) > TILT:
            yield f"${axis}$", np.array([CORNER, CORNER + 10.0 * along]), BODY
    driven, count = {u.name for u in model.u}, dict[tuple[float, ...], int]()
    for arrow in sketch.arrows:
        at = page.at(poses.at[arrow.at, :, 0])
        key = tuple(at.round(1))
        count[key] = count.get(key, -1) + 1
        axis = np.array(arrow.axis) @ poses.axes[arrow.frame, :, :, 0]
        colour = DRIVES if driven.intersection(arrow.names) else MOVES
        yield _symbols(arrow.names), at + _way(arrow, axis, page, count[key]), colour


def _way(arrow: Arrow, axis: Array, page: Page, k: int) -> Array:
    """Return the line of arrow `k` at a place, relative to the place [pt]."""
    along = page.axes @ axis
    across = np.array([-along[1], along[0]]) / max(float(np.linalg.norm(along)), 1e-9)
    if across[1] < -1e-9:
        across = -across
    if not arrow.turning:
        if np.linalg.norm(along) < TILT:  # towards the viewer
            along = TILT * np.array([-0.7, -0.7]) * np.sign(axis @ page.eye)
        start = (2.9 + 1.3 * k) * SIZE * across - SIZE * along
        return np.array([start, start + 4.5 * SIZE * along])
    e1 = np.cross(axis, page.eye)
    if np.linalg.norm(e1) < TILT:
        e1 = page.axes[0] - (page.axes[0] @ axis) * axis
    e1 = e1 / np.linalg.norm(e1)
    around = _circle(-0.6, 1.9 - 0.2 * k) @ np.stack([e1, np.cross(axis, e1)])
    lean = TILT * (1 - abs(float(axis @ page.eye)))
    ring = around @ page.axes.T - lean * (around @ page.eye)[:, None] * along
    return np.asarray((2.6 + 1.2 * k) * SIZE * ring)


def _filled(lines: Sequence[Array]) -> Array:
    """Return points on the lines that are at most 2 pt apart."""
    found: list[Array] = []
    for line in lines:
        found.append(line if len(line) > 1 else line + SIZE * _circle(0.0, 2 * np.pi))
        for a, b in pairwise(line[np.isfinite(line).all(axis=1)]):
            found.append(np.linspace(a, b, 2 + int(np.linalg.norm(b - a) / 2)))
    return np.concatenate(found)


def _written(axes: Any, labels: Sequence[Label], lines: Array, page: Page) -> bool:
    """Write the labels apart from each other and off the lines, and return True if all fit.

    Labels for which no place is free are omitted.
    """
    figure = axes.figure
    renderer, pt = FigureCanvasAgg(figure).get_renderer(), 72 / figure.dpi
    u = _circle(0.0, 2 * np.pi)[:-1:2]
    away = np.concatenate([r * u for r in RADII])
    u = np.tile(u, (len(RADII), 1))
    paper, taken, fit = np.array([WIDTH, page.height]), np.empty((0, 4)), True
    for text, at, colour in labels:
        written = axes.text(0, 0, text, fontsize=TEXT, color=colour, ha="center", va="center")
        box = written.get_window_extent(renderer)
        half = pt * np.array([box.width, box.height]) / 2 + 0.8
        middle = at + away + half * u
        low, high = middle - half, middle + half
        free = ((low > 1) & (high < paper - 1)).all(axis=1)
        for other in taken:
            free &= ((low >= other[2:]) | (high <= other[:2])).any(axis=1)
        if not free.any():
            written.remove()
            fit = False
            continue
        kept = np.flatnonzero(free)
        inside = (lines > low[kept, None]) & (lines < high[kept, None])
        leaders = at + np.linspace(0.0, 1.0, 8)[:, None, None] * away[kept]
        crossed = np.zeros(kept.size)
        for other in taken:
            crossed += ((leaders > other[:2]) & (leaders < other[2:])).all(axis=2).sum(axis=0)
        cost = np.linalg.norm(away[kept], axis=1) + 3.0 * inside.all(axis=2).sum(axis=1)
        cost += 9.0 * crossed
        k = kept[int(np.argmin(cost))]
        written.set_position(middle[k])
        taken = np.vstack([taken, np.concatenate([low[k], high[k]])])
        lines = np.vstack([lines, np.linspace(at, at + away[k], 8)])
        if np.linalg.norm(away[k]) > RADII[3]:
            axes.plot(*np.array([at, at + away[k]]).T, color=colour, linewidth=0.4, alpha=0.6)
    return fit
