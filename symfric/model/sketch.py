"""What a machine looks like: places that move, and the marks drawn at and between them."""

from dataclasses import dataclass
from typing import final

import casadi as ca


@final
@dataclass(frozen=True, eq=False)
class Part:
    """A body: lines from its centre to its places.

    Attributes:
        centre: index of the place at its centre of mass.
        corners: indices of its frames; a body whose frames all lie in its centre is a block.
        ends: indices of those where only springs and dampers end.
        fixed: whether it is the ground, which has no lines.
    """

    name: str
    centre: int
    corners: tuple[int, ...]
    ends: tuple[int, ...] = ()
    fixed: bool = False


@final
@dataclass(frozen=True)
class Symbol:
    """How a joint, a rod or a spring is drawn between two places a and b.

    Attributes:
        marker: shape of the marker at b; none where empty.
        line: from a to b: "rod", "spring", "damper"; none where empty.
        axes: lines through b along axes of a or b, each ("a" or "b", number of the axis).
        hinge: whether it turns about z of b and does nothing else.
        guide: whether it slides along z of a.
        slot: whether it slides along z of a in a slot that hangs on the origin of a.
        plate: whether it moves in the plane x, y of a.
        anchored: whether it shows where it hangs on the ground.
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
        """Whether a and b may be swapped: not where each has an axis of its own, or a slot."""
        return len({end for end, _ in self.axes}) < 2 and not self.slot


@final
@dataclass(frozen=True, eq=False)
class Mark:
    """Something between two places: a joint, a rod, a spring.

    Attributes:
        symbol: how it is drawn.
        a, b: indices of its two places; the first is on the ground if one is.
        slips: name of the sliding velocity of each contact and the velocity [m/s] below which it
            counts as sticking.
        grounded: whether one is.
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
    """A machine as it is drawn.

    Attributes:
        places: SX (12, k) in the symbols of a model: for each place its axes in the world, column
            by column, and its position [m].
        parts: bodies.
        marks: what stands between the places.
        symbols: size of the symbols of joints, relative to that in a mechanism.
    """

    places: ca.SX
    parts: tuple[Part, ...]
    marks: tuple[Mark, ...]
    symbols: float = 1.0
