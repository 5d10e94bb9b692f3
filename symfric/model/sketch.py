"""Drawing of a machine: bodies, elements between them, and positive directions."""

from dataclasses import dataclass
from typing import final

import casadi as ca

from symfric.foundation.numeric import Array


@final
@dataclass(frozen=True, eq=False)
class Part:
    """Body, drawn as lines from its centre to its places.

    Attributes:
        name: name of the body.
        centre: index of the place at the centre of mass.
        corners: indices of the frames; a body whose frames all coincide with its centre is drawn as
            a block.
        ends: indices of places that have only springs and dampers.
        fixed: True for the ground, which has no lines but outlines.
        label: symbol or value of the mass or inertia.
        outlines: lines [m] that are drawn instead, in the axes of a place given by its index, see
            `symfric.multibody.outlines`.
    """

    name: str
    centre: int
    corners: tuple[int, ...]
    ends: tuple[int, ...] = ()
    fixed: bool = False
    label: str = ""
    outlines: tuple[tuple[int, Array], ...] = ()


@final
@dataclass(frozen=True)
class Symbol:
    """Drawing style of a joint, a rod or a spring between two places a and b.

    Attributes:
        marker: shape of the marker at b; empty for no marker.
        line: line from a to b: "rod", "spring", "damper", or "strut" for a spring and a damper;
            "circle" about a through b, "spiral" for a torsion spring at b, "link" for a gear or a
            belt; empty for no line.
        axes: lines through b along axes of a or b, each given as ("a" or "b", number of the axis).
        hinge: True for a pure rotation about z of b.
        guide: True for sliding along z of a.
        slot: True for sliding along z of a in a slot attached to the origin of a.
        plate: True for motion in the plane x, y of a.
        anchored: True if the attachment to the ground is drawn.
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
        """True if a and b may be exchanged: at most one has axes, and there is no slot."""
        return len({end for end, _ in self.axes}) < 2 and not self.slot


@final
@dataclass(frozen=True, eq=False)
class Mark:
    """Element between two places, such as a joint, a rod or a spring.

    Attributes:
        name: name of the element.
        symbol: drawing style.
        a, b: indices of the two places; if one of them is on the ground, it is a.
        slips: name of the sliding velocity of each contact, and the velocity [m/s] below which the
            contact counts as sticking.
        grounded: True if a is on the ground.
        contacts: names of the contacts with friction of this element.
        label: symbols or values of stiffness and damping, or the name.
    """

    name: str
    symbol: Symbol
    a: int
    b: int
    slips: tuple[tuple[str, float], ...] = ()
    grounded: bool = False
    contacts: tuple[str, ...] = ()
    label: str = ""


@final
@dataclass(frozen=True)
class Arrow:
    """Positive direction of coordinates, velocities, forces or inputs.

    Attributes:
        names: names of the quantities, such as a coordinate and its rate.
        at: index of the place at the arrow.
        frame: index of the place whose axes `axis` refers to.
        axis: direction, or axis of rotation.
        turning: True for a rotation.
    """

    names: tuple[str, ...]
    at: int
    frame: int
    axis: tuple[float, float, float]
    turning: bool = False


@final
@dataclass(frozen=True, eq=False)
class Sketch:
    """Drawing of a machine.

    Attributes:
        places: SX (12, k) in the symbols of a model: the axes of each place in the world, column by
            column, followed by its position [m].
        parts: bodies.
        marks: elements between the places.
        symbols: size of the symbols of joints relative to their size in a mechanism.
        arrows: positive directions, drawn in a schematic.
        layout: arrangement in a schematic, if it differs from that in motion.
    """

    places: ca.SX
    parts: tuple[Part, ...]
    marks: tuple[Mark, ...]
    symbols: float = 1.0
    arrows: tuple[Arrow, ...] = ()
    layout: "Sketch | None" = None

    @property
    def still(self) -> bool:
        """True if nothing in the drawing moves."""
        return self.places.is_constant()
