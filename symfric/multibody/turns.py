"""Angles of joints that close loops, over full turns.

The pose of two bodies gives the angle between them modulo 2 pi. A force that grows with the angle
needs all of it: the angle becomes a state phi of the model, with the relative angular velocity as
its rate. It starts at the angle of the pose, with as many turns as the start of the joint has.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import pi
from typing import final

import casadi as ca

from symfric.foundation.parameters import Variable
from symfric.foundation.symbols import symbols_of
from symfric.model.kinds import POSITION
from symfric.multibody.joint import Joint


@final
@dataclass(frozen=True, eq=False)
class Turn:
    """An angle as a state, and its rate [rad/s]."""

    angle: Variable
    rate: ca.SX


@final
class Turns:
    """Collects the angles that forces ask for; mutable."""

    def __init__(self) -> None:
        self._found: dict[str, Turn] = {}

    def __call__(self, joint: Joint, direction: str, angle: ca.SX, rate: ca.SX) -> ca.SX:
        """The angle of a joint as a symbol, given that of its pose and its rate."""
        k = joint.directions[direction]
        name = joint.coordinate(k)
        if name not in self._found:
            full = ca.floor((joint.starts[k] - angle) / (2 * pi) + 0.5)
            start = angle + 2 * pi * full
            state = Variable(
                name, "rad", start=start, doc="angle of a joint that closes a loop", kind=POSITION
            )
            self._found[name] = Turn(state, rate)
        return self._found[name].angle.symbol

    @property
    def found(self) -> tuple[Turn, ...]:
        """All that were asked for."""
        return tuple(self._found.values())


def angles(turns: Sequence[Turn]) -> ca.SX:
    """Their symbols, shape (k, 1)."""
    return symbols_of(turn.angle for turn in turns)
