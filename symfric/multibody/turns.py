"""Angles of joints that close loops, over full turns.

The pose of two bodies gives the angle between them modulo 2 pi. A force that grows with the angle
needs all of it: the angle becomes a state phi of the model, with the relative angular velocity as
its rate. It starts at the angle of the pose, with as many turns as the start of the joint has, and
as the other joints of its loop have made where all axes are parallel:

    phi' = a' q'  with constant a,   so that   phi - phi_0 = a' (q - q_0)
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import pi
from typing import final

import casadi as ca
import numpy as np

from symfric.foundation.parameters import Variable
from symfric.foundation.symbols import stacked, symbols_of
from symfric.model.kinds import POSITION
from symfric.multibody.joint import Joint

PARALLEL = 1e-9
"""Differences of the derivatives of a rate from one position to another that are rounding."""


@final
@dataclass(frozen=True, eq=False)
class Turn:
    """An angle as a state, and its rate [rad/s]."""

    angle: Variable
    rate: ca.SX


@final
@dataclass(frozen=True, eq=False)
class Moved:
    """Coordinates and rates of the tree and where it starts, SX (n, 1)."""

    q: ca.SX
    qd: ca.SX
    start: ca.SX

    def turned(self, rate: ca.SX) -> tuple[ca.SX, ca.SX] | None:
        """How far a joint of this rate has turned, and had at the start; None in space."""
        slopes = ca.densify(ca.jacobian(rate, self.qd))
        at = ca.symvar(slopes)
        anywhere = np.random.default_rng(0)
        numbers = ca.Function("slopes", [stacked(at)], [slopes])
        found = [numbers(anywhere.uniform(-1, 1, len(at))).full() for _ in range(3)]
        if np.ptp(found, axis=0).max(initial=0.0) > PARALLEL:
            return None
        a = ca.sparsify(ca.DM(found[0].round(9)))
        return a @ self.q, a @ self.start


@final
class Turns:
    """Collects the angles that forces ask for; mutable."""

    def __init__(self) -> None:
        self._found: dict[str, Turn] = {}

    def __call__(
        self, joint: Joint, direction: str, angle: ca.SX, rate: ca.SX, moved: "Moved"
    ) -> ca.SX:
        """The angle of a joint as a symbol, given that of its pose, its rate and what moves it."""
        k = joint.directions[direction]
        name = joint.coordinate(k)
        if name not in self._found:
            made, near = moved.turned(rate), joint.starts[k]
            if made is not None:
                near = made[0] if joint.start is None else near + made[0] - made[1]
            start = angle + 2 * pi * ca.floor((near - angle) / (2 * pi) + 0.5)
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
