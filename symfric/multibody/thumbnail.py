"""A small picture of a mechanism at its start, for notebooks."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import casadi as ca
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from symfric.foundation.style import EDGE, colour
from symfric.multibody.sketch import sketch

if TYPE_CHECKING:
    from symfric.model.sketch import Sketch
    from symfric.multibody.mechanism import Mechanism

Array = NDArray[np.float64]
SIZE = 2.6
"""Of the picture [inch]."""
AWAY = 1e-6
"""Extent across a plane, relative to that in it, below which all lies in the plane."""


def picture(machine: "Mechanism") -> Figure | None:
    """Bodies as lines to their frames, joints as dots; nothing where it cannot be built yet."""
    try:
        made = machine.prepare()
    except ValueError:
        return None
    drawn = sketch(made.eq, machine.joints, machine.forces, {})
    places = ca.Function("places", [made.eq.q], [drawn.places])(made.q0).full()
    at = places[9:].T
    across, up = _view(drawn, places)
    flat = np.column_stack([at @ across, at @ up])
    figure = Figure(figsize=(SIZE, SIZE), layout="constrained")
    axis = figure.subplots()
    _draw(axis, drawn, flat)
    axis.set_aspect("equal", "datalim")
    axis.margins(0.15)
    axis.tick_params(labelsize=6)
    axis.set_xlabel(f"{_called(across)} [m]", fontsize=7)
    axis.set_ylabel(f"{_called(up)} [m]", fontsize=7)
    axis.grid(alpha=0.3)
    return figure


def _view(drawn: "Sketch", places: Array) -> tuple[Array, Array]:
    """Directions to the right and upwards: of the plane of the hinges, or seen from aside."""
    hinges = [places[6:9, mark.b] for mark in drawn.marks if mark.symbol.hinge]
    normal = hinges[0] if hinges else np.array([0.0, 1.0, 0.0])
    if any(np.linalg.norm(np.cross(normal, other)) > AWAY for other in hinges):
        normal = np.array([0.45, -0.8, 0.4]) / np.linalg.norm([0.45, -0.8, 0.4])
    upwards = np.eye(3)[1 if abs(normal[2]) > 0.99 else 2]
    up = upwards - (upwards @ normal) * normal
    up /= np.linalg.norm(up)
    across = np.cross(up, normal)
    return (across if across.sum() > 0 else -across), up


def _draw(axis: Axes, drawn: "Sketch", flat: Array) -> None:
    for k, part in enumerate(drawn.parts):
        if part.fixed:
            continue
        for place in (*part.corners, *part.ends):
            _line(axis, flat, (part.centre, place), color=colour(k), linewidth=2.2)
        axis.plot(*flat[part.centre], "s", color=colour(k), markersize=4)
    for mark in drawn.marks:
        if mark.symbol.line:
            _line(axis, flat, (mark.a, mark.b), color="0.35", linewidth=1.0, linestyle="--")
        face = EDGE if mark.grounded else "white"
        axis.plot(*flat[mark.b], "o", markersize=5, markerfacecolor=face, color=EDGE)


def _line(axis: Axes, flat: Array, ends: Sequence[int], **how: object) -> None:
    axis.plot(flat[list(ends), 0], flat[list(ends), 1], **how)  # pyright: ignore[reportArgumentType]


def _called(direction: Array) -> str:
    """The axis of the world along a direction, or what else it is."""
    k = int(np.argmax(np.abs(direction)))
    if abs(direction[k]) < 1 - AWAY:
        return "seen from aside"
    return ("" if direction[k] > 0 else "-") + "xyz"[k]
