"""Contacts of a loop of one degree of freedom: they rest together, and share what holds it.

The slips are s_i = g_i(q) omega, with omega the speed along the tangent of the constraints. No
equation tells how the contacts share the force T = sum g_i F_i that holds the loop. They hold it as
long as they can, and that is with equal shares of what each can hold at most,

    F_i = sign(g_i) S_i T / sum |g_k| S_k,   S_i the static level

as in `symfric.multibody.applied`. All of them are at their levels at the same instant.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import final

import casadi as ca

from symfric.foundation.coupling import coupled
from symfric.laws.base import smooth
from symfric.model import Contact, Model

MINORS = 8
"""Coordinates of a loop at most; its tangent is made of their minors."""


@final
@dataclass(frozen=True, eq=False)
class Loop:
    """Contacts that rest together.

    Attributes:
        members: the contacts, two or more.
        along: g_i of each, in the coordinates.
    """

    members: tuple[Contact, ...]
    along: tuple[ca.SX, ...]

    @property
    def name(self) -> str:
        """Of the force that holds it."""
        return f"{self.members[0].name}_loop"

    def shares(self, force: ca.SX) -> list[ca.SX]:
        """F_i [N] of each member, where `force` T holds the loop."""
        levels = [(c.static_level(1) + c.static_level(-1)) / 2 for c in self.members]
        weights = [
            ca.SX(smooth.choose(g < 0, -1.0, 1.0)) * S
            for g, S in zip(self.along, levels, strict=True)
        ]
        total = sum((g * w for g, w in zip(self.along, weights, strict=True)), start=ca.SX(0))
        return [w / total * force for w in weights]

    def projected(self, changes: Sequence[ca.SX]) -> ca.SX:
        """What is zero at rest, of the rates of change of the members' slips."""
        pairs = zip(self.along, changes, strict=True)
        return sum((g * change for g, change in pairs), start=ca.SX(0))


def loops_of(model: Model, contacts: Sequence[Contact]) -> tuple[Loop, ...]:
    """The loops of a mechanism in which several of `contacts` rest together."""
    from symfric.multibody.mass import null_direction  # noqa: PLC0415  (of mechanisms only)

    mechanics = model.holonomic
    if mechanics is None or not mechanics.phi.numel() or ca.depends_on(mechanics.phi, model.t):
        return ()
    q, qd = model.vector("x")[: mechanics.n], model.vector("x")[mechanics.n : 2 * mechanics.n]
    found: list[Loop] = []
    pattern = ca.DM(ca.jacobian(mechanics.phi, q).sparsity(), 1).full() != 0
    for columns, rows in coupled(pattern):
        if len(columns) != len(rows) + 1 or len(columns) > MINORS:
            continue
        tangent = ca.SX(mechanics.n, 1)
        tangent[columns] = null_direction(ca.jacobian(mechanics.phi, q)[rows, columns])
        slopes = [(c, ca.jacobian(c.slip, qd)) for c in contacts]
        touched = {c.name: {*G.sparsity().get_col()} for c, G in slopes}
        members = [
            (c, ca.SX(G @ tangent))
            for c, G in slopes
            if touched[c.name] and touched[c.name] <= {*columns}
        ]
        if len(members) > 1:
            found.append(Loop(tuple(c for c, _ in members), tuple(g for _, g in members)))
    return tuple(found)
