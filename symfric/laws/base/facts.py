"""What is known of a law, and its states, inputs and changes of mode, as data."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import inf

from symfric.foundation.numeric import Scalar

PHENOMENA = {
    "D": "dynamic (kinetic) friction",
    "S": "static friction (stiction or a break-away peak)",
    "St": "Stribeck effect",
    "V": "viscous friction",
    "P": "pre-sliding displacement",
    "M": "non-local memory (hysteresis loops inside loops close)",
    "L": "frictional lag",
    "B": "break-away force depends on the loading rate",
    "N": "no drift under vibration below break-away",
    "T": "static friction grows with the dwell time",
}
"""What a law can show, by the codes in `Facts.phenomena`."""

CONFIDENCE = {
    "two sources": "the formula was compared with two independent ones",
    "one source": "the formula was compared with one",
    "textbook": "the formula stands in every textbook",
    "rebuilt": "the formula was lost or garbled, and rebuilt from what is said of it",
    "constructed": "made here",
    "unverified": "written from memory, compared with no publication and no public code",
}
"""How sure a formula is, by the words in `Facts.confidence`."""


@dataclass(frozen=True)
class Facts:
    """What is known about a law, as data.

    Attributes:
        phenomena: codes of `PHENOMENA`.
        smoothness: differentiability class in the velocity, and where it breaks.
        confidence: one of `CONFIDENCE`.
        source: the publication, read or not.
        odd: the force changes sign with v, states and further inputs together.
        load: how the dry force follows the normal force: "proportional", "independent" or in
            words.
        checked: what the formula was compared with, or what else speaks for it.
    """

    phenomena: tuple[str, ...]
    smoothness: str
    confidence: str
    source: str
    odd: bool = True
    load: str = "proportional"
    checked: str = ""

    @property
    def formula(self) -> str:
        """How sure the formula is, in words."""
        said = f"{self.confidence} ({CONFIDENCE[self.confidence]})"
        return f"{said}: {self.checked}" if self.checked else said


@dataclass(frozen=True)
class State:
    """An internal state of a law: name, unit, typical magnitude and what it is.

    `even` states (a mode, an age) keep their value when the motion is mirrored; the others, such
    as deflections and forces, change sign with it. A `whole` state is a mode: -1, 0 or 1, and
    results give these numbers.
    """

    name: str
    unit: str
    nominal: float
    even: bool = False
    doc: str = ""
    whole: bool = False


@dataclass(frozen=True)
class Input:
    """What a law takes besides v and N, as a keyword-only argument of its methods.

    `nominal` is its typical magnitude, `steady` its value in pictures of steady sliding (v > 0).
    """

    name: str
    unit: str
    doc: str
    nominal: float = 1.0
    steady: float = 0.0


FORCE = "F_e"
APPLIED_FORCE = Input(FORCE, "N", "force that keeps the sliding velocity constant", steady=1.0)
"""What the contact must carry for no acceleration: m dv/dt = F_e - F."""


@dataclass(frozen=True, eq=False)
class Switch:
    """A change of mode: the states in `reset` jump when `expression` passes through zero.

    Attributes:
        expression: in v, N, z and the further inputs of the law.
        direction: +1 only rising, -1 only falling, 0 both.
        reset: state -> its value afterwards, in terms of the values before.
        halts: the sliding velocity, zero at this instant, becomes zero without rounding.
        at_start: it happens at the start, too, where the expression is beyond zero already.
        rtol: largest relative tolerance that a run may have, where a law promises exact instants.
    """

    name: str
    expression: Scalar
    direction: int = 0
    reset: Mapping[str, Scalar] = field(default_factory=dict[str, Scalar])
    halts: bool = False
    at_start: bool = False
    rtol: float = inf
