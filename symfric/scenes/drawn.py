"""How scenes without joints look in a film: blocks, rails, springs, hands; in the plane x, z."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import isfinite
from typing import final

import casadi as ca

from symfric.foundation.numeric import Scalar
from symfric.laws import Law
from symfric.model.sketch import Mark, Part, Sketch, Symbol

ALONG = {"x": ca.DM([0, 1, 0, 0, 0, 1, 1, 0, 0]), "z": ca.DM([1, 0, 0, 0, 1, 0, 0, 0, 1])}
"""Direction of a rail -> axes of a place, column by column; the rail runs along the third."""
RAIL = Symbol("s", guide=True)
TICK, HUB = Symbol("|"), Symbol("o")
LINES = {line: Symbol(line=line, anchored=True) for line in ("spring", "damper")}


@final
@dataclass(frozen=True, eq=False)
class Block:
    """A body on a rail.

    Attributes:
        x, z: where it is [m], expressions of the model.
        along: direction of its rail, "x" or "z"; no rail where empty.
        slip: signal that is its sliding velocity; none where empty.
        law: friction there, whose velocity scale says what counts as sticking.
    """

    x: Scalar
    z: Scalar
    along: str = ""
    slip: str = ""
    law: Law | None = None


def drawn(
    blocks: Mapping[str, Block],
    fixed: Mapping[str, tuple[Scalar, Scalar]] | None = None,
    links: Sequence[tuple[str, str, str]] = (),
    hands: Mapping[str, tuple[Scalar, float]] | None = None,
    ticks: Sequence[tuple[Scalar, Scalar]] = (),
    hub: Block | None = None,
) -> Sketch:
    """A machine that is drawn without being a mechanism.

    Args:
        blocks: name -> body.
        fixed: name -> place (x, z) [m] on the ground, or that moves as the ground does, as a road.
        links: (line, from, to) between blocks and fixed places; a line is "spring" or "damper".
        hands: name -> angle [rad] and length [m] of a hand that turns about the origin.
        ticks: places (x, z) [m] of marks on what moves below, as a belt.
        hub: where the hands turn, if something rubs there.
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
        parts.append(Part(name, at[name], (at[name],)))
        if block.along:
            start = place(*((0, block.z) if block.along == "x" else (block.x, 0)), block.along)
            marks.append(Mark(name, RAIL, start, at[name], _slips(block), grounded=True))
    for line, a, b in links:
        marks.append(Mark(f"{a}_{b}", LINES[line], at[a], at[b], (), grounded=a in (fixed or {})))
    for name, (angle, length) in (hands or {}).items():
        centre = place(0, 0)
        tip = place(length * ca.sin(angle), length * ca.cos(angle))
        parts.append(Part(name, centre, (tip,)))
    if hub is not None:
        k = place(hub.x, hub.z)
        marks.append(Mark("hub", HUB, k, k, _slips(hub)))
    marks += [Mark("tick", TICK, k, k) for k in [place(x, z) for x, z in ticks]]
    return Sketch(ca.horzcat(*columns), tuple(parts), tuple(marks), symbols=2.0)


def around(way: Scalar, low: Scalar, high: Scalar) -> ca.SX:
    """`way` [m] brought between `low` and `high` by whole turns, as a mark on a belt."""
    length = high - low
    return ca.SX(way - length * ca.floor((way - low) / length))


def _slips(block: Block) -> tuple[tuple[str, float], ...]:
    """The sliding velocity of a block and what counts as rest; nothing for a law without scale."""
    if not block.slip or block.law is None:
        return ()
    try:
        scale = float(block.law.velocity_scale)
    except (TypeError, RuntimeError, NotImplementedError):  # a free parameter of the model
        return ()
    return ((block.slip, scale),) if isfinite(scale) else ()
