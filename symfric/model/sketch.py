"""Drawing of a machine: places that move, and symbols at and between them."""

from dataclasses import dataclass
from typing import final

import casadi as ca


@final
@dataclass(frozen=True, eq=False)
class Part:
    """Body: lines from its centre to its places.

    Attributes:
        centre: index of the place at its centre of mass.
        corners: indices of its frames; a body whose frames all coincide with its centre is a block.
        ends: indices of places with only springs and dampers.
        fixed: True for the ground, which has no lines.
    """

    name: str
    centre: int
    corners: tuple[int, ...]
    ends: tuple[int, ...] = ()
    fixed: bool = False


@final
@dataclass(frozen=True)
class Symbol:
    """Drawing style of a joint, a rod or a spring between two places a and b.

    Attributes:
        marker: shape of the marker at b; empty for none.
        line: from a to b: "rod", "spring", "damper"; empty for none.
        axes: lines through b along axes of a or b, each ("a" or "b", number of the axis).
        hinge: True for a pure rotation about z of b.
        guide: True for sliding along z of a.
        slot: True for sliding along z of a in a slot attached to the origin of a.
        plate: True for motion in the plane x, y of a.
        anchored: True if its attachment to the ground is drawn.
    """

    marker: str = ""
    line: str = ""
    axes: tuple[tuple[str, int], ...] = ()
    hinge: bool = False
    guide: bool = False
    slot: bool = False
    plate: bool = False
    anchored: bool = False

    @property
    def turnable(self) -> bool:
        """True if a and b may be swapped: neither has an axis of its own while the other has
        one, nor a slot.
        """
        return len({end for end, _ in self.axes}) < 2 and not self.slot


@final
@dataclass(frozen=True, eq=False)
class Mark:
    """Element between two places: a joint, a rod, a spring.

    Attributes:
        symbol: its drawing style.
        a, b: indices of its two places; the first is on the ground if one is.
        slips: name of the sliding velocity of each contact and the velocity [m/s] below which it
            counts as sticking.
        grounded: True if one is.
    """

    name: str
    symbol: Symbol
    a: int
    b: int
    slips: tuple[tuple[str, float], ...] = ()
    grounded: bool = False


@final
@dataclass(frozen=True, eq=False)
class Sketch:
    """Drawing of a machine.

    Attributes:
        places: SX (12, k) in the symbols of a model: for each place its axes in the world, column
            by column, and its position [m].
        parts: bodies.
        marks: elements between the places.
        symbols: size of the symbols of joints, relative to that in a mechanism.
    """

    places: ca.SX
    parts: tuple[Part, ...]
    marks: tuple[Mark, ...]
    symbols: float = 1.0
