"""Drawings of machines that are not mechanisms: blocks on rails, springs, hands, rollers."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import isfinite
from typing import final

import casadi as ca
import numpy as np

from symfric.foundation.numeric import Scalar
from symfric.laws import Law
from symfric.model.sketch import Arrow, Mark, Part, Sketch, Symbol

ALONG = {"x": ca.DM([0, 1, 0, 0, 0, 1, 1, 0, 0]), "z": ca.DM([1, 0, 0, 0, 1, 0, 0, 0, 1])}
"""Axes of a place, column by column, by direction of its rail, which is along the third axis."""
RAIL = Symbol("s", guide=True)
TICK, HUB = Symbol("|"), Symbol("o")
LINES = {
    line: Symbol(line=line, anchored=line in ("spring", "damper", "strut"))
    for line in ("spring", "damper", "strut", "rod", "circle")
}
DIRECTIONS = {"y": (1.0, 0.0, 0.0), "z": (0.0, 1.0, 0.0), "x": (0.0, 0.0, 1.0)}
"""Directions in the axes of a place along x."""


@final
@dataclass(frozen=True, eq=False)
class RailBody:
    """Body or contact in a drawing, on a rail or not.

    Attributes:
        x, z: position [m], expressions of the model.
        along: direction of the rail, "x" or "z"; empty for no rail.
        slip: name of the signal of the sliding velocity; empty for no friction.
        law: friction law; a slip below its velocity scale counts as sticking.
        label: symbol of the mass or inertia.
        contact: name of the contact with friction.
    """

    x: Scalar
    z: Scalar
    along: str = ""
    slip: str = ""
    law: Law | None = None
    label: str = ""
    contact: str = ""


def drawn(
    blocks: Mapping[str, RailBody],
    fixed: Mapping[str, tuple[Scalar, Scalar]] | None = None,
    links: Sequence[tuple[str, str, str, str]] = (),
    hands: Mapping[str, tuple[Scalar, float]] | None = None,
    ticks: Sequence[tuple[Scalar, Scalar]] = (),
    hub: RailBody | None = None,
    arrows: Sequence[tuple[str, str | tuple[Scalar, Scalar], str]] = (),
    layout: Sketch | None = None,
) -> Sketch:
    """Return the drawing of a machine that is not a mechanism.

    Args:
        blocks: bodies by name.
        fixed: places (x, z) [m], by name, on the ground or on a moving ground such as a road.
        links: (line, from, to, symbols) between blocks and fixed places; a line is "spring",
            "damper", "strut" for both, "rod" or "circle".
        hands: angle [rad] and length [m], by name, of hands that rotate about the origin.
        ticks: places (x, z) [m] of marks on a moving ground such as a belt.
        hub: contact that is not that of a block, such as the centre of the hands.
        arrows: (names, place or (x, z), direction) of coordinates, velocities, forces and inputs;
            a direction is "x", "-z", ..., or "turn x", ... for a rotation.
        layout: arrangement in a schematic, if it differs from that in motion.
    """
    columns: list[ca.SX] = []
    parts: list[Part] = []
    marks: list[Mark] = []
    at: dict[str, int] = {}

    def place(x: Scalar, z: Scalar, along: str = "x") -> int:
        columns.append(ca.densify(ca.vertcat(ca.SX(ALONG[along]), x, 0, z)))
        return len(columns) - 1

    for name, (x, z) in (fixed or {}).items():
        at[name] = place(x, z)
    for name, block in blocks.items():
        at[name] = place(block.x, block.z, block.along or "x")
        parts.append(Part(name, at[name], (at[name],), label=block.label))
        if block.along:
            start = place(*((0, block.z) if block.along == "x" else (block.x, 0)), block.along)
            marks.append(Mark(name, RAIL, start, at[name], _slips(block), True, _contacts(block)))
    for line, a, b, symbols in links:
        grounded = a in (fixed or {})
        marks.append(Mark(f"{a}_{b}", LINES[line], at[a], at[b], grounded=grounded, label=symbols))
    for name, (angle, length) in (hands or {}).items():
        centre = place(0, 0)
        tip = place(length * ca.sin(angle), length * ca.cos(angle))
        parts.append(Part(name, centre, (tip,)))
    if hub is not None:
        k = place(hub.x, hub.z)
        marks.append(Mark("hub", HUB, k, k, _slips(hub), False, _contacts(hub)))
    marks += [Mark("tick", TICK, k, k) for k in [place(x, z) for x, z in ticks]]
    pointers: list[Arrow] = []
    for names, where, direction in arrows:
        k = place(*where) if isinstance(where, tuple) else at[where]
        axis = np.array(DIRECTIONS[direction[-1]]) * (-1.0 if "-" in direction else 1.0)
        frame = k if isinstance(where, tuple) else place(0, 0)
        pointers.append(Arrow(tuple(names.split()), k, frame, tuple(axis), "turn" in direction))
    return Sketch(ca.horzcat(*columns), tuple(parts), tuple(marks), 2.0, tuple(pointers), layout)


def around(way: Scalar, low: Scalar, high: Scalar) -> ca.SX:
    """Return `way` [m] shifted into [low, high) by whole periods, as for a mark on a belt."""
    length = high - low
    return ca.SX(way - length * ca.floor((way - low) / length))


def _contacts(block: RailBody) -> tuple[str, ...]:
    return (block.contact,) if block.contact else ()


def _slips(block: RailBody) -> tuple[tuple[str, float], ...]:
    """Return the sliding velocity of a block and the velocity scale of its law, as in `Mark`."""
    if not block.slip or block.law is None:
        return ()
    try:
        scale = float(block.law.velocity_scale)
    except (TypeError, RuntimeError, NotImplementedError):  # a free parameter of the model
        return ()
    return ((block.slip, scale),) if isfinite(scale) else ()
