"""Rest as a mode: what the laws share that hold a contact exactly."""

from abc import abstractmethod
from dataclasses import dataclass

from symfric.foundation.numeric import Scalar, column, empty
from symfric.laws.base import smooth
from symfric.laws.base.law import APPLIED_FORCE, Input, Law, State, Switch


@dataclass(frozen=True, eq=False)
class Sticking(Law):
    """A law whose mode is the direction of sliding, or 0 for a contact at rest.

        F = slip force in the direction `mode`   while sliding
        F = F_e within +-static level            at rest, mode = 0

    A form without modes (`has_mode` false) has no states.
    """

    @property
    @abstractmethod
    def has_mode(self) -> bool:
        """Whether rest is a mode and not a band of velocities."""

    @property
    def states(self) -> tuple[State, ...]:
        """The mode: direction of sliding, or 0 at rest."""
        return (State("mode", "1", 1.0),) if self.has_mode else ()

    @property
    def inputs(self) -> tuple[Input, ...]:
        """The applied force."""
        return (APPLIED_FORCE,)

    def rate(self, v: Scalar, N: Scalar, z: Scalar = (), *, F_e: Scalar = 0.0) -> Scalar:
        """Zero: the mode changes at switches only."""
        return column(0.0 * v) if self.has_mode else empty(v)

    def steady_state(self, v: Scalar, N: Scalar) -> Scalar:
        """The direction of sliding."""
        return column(smooth.sign(v, 0.0)) if self.has_mode else empty(v)


def held(mode: Scalar, F_e: Scalar, static: Scalar) -> Scalar:
    """What the contact carries at rest [N]; zero while it slides."""
    return smooth.clip(F_e, -static, static) * (1 - mode * mode)


def stick_and_slip(
    v: Scalar, mode: Scalar, F_e: Scalar, static: Scalar, v_0: Scalar
) -> tuple[Switch, ...]:
    """End of sliding at v = 0, break-away under a growing load, and motion under an overload.

    Sliding goes on in the other direction where the contact cannot hold `F_e`. A load beyond
    `static` from the very start has no instant of break-away; its rest ends at |v| = v_0. While
    the load beyond `static` pulls forward v = 0 is a beginning, and no end.
    """
    onward = smooth.sign(F_e, 0.0)
    excess = smooth.magnitude(F_e, 0.0) - static
    gone = smooth.magnitude(v, 0.0) - v_0
    after = smooth.choose(excess <= 0, 0.0, onward)
    rests, pull = mode == 0, mode * F_e - static
    ahead = smooth.choose(mode * v > pull, mode * v, pull)
    return (
        Switch("stick", smooth.choose(rests, 1.0, ahead), -1, {"mode": after}, halts=True),
        Switch("slip", smooth.choose(rests, excess, -1.0), 1, {"mode": onward}),
        Switch("overload", smooth.choose(rests, gone, -1.0), 1, {"mode": onward}),
    )
