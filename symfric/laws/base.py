"""What a friction law is: parameters, a force and the rate of its internal states."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar

from symfric.numeric import Scalar, empty
from symfric.parameters import Parametric

PHENOMENA = {
    "D": "dynamic (kinetic) friction",
    "S": "static friction (stiction or a break-away peak)",
    "St": "Stribeck effect",
    "V": "viscous friction",
    "P": "pre-sliding displacement",
    "L": "frictional lag",
    "B": "break-away force depends on the loading rate",
}
"""What a law can show, by the codes in `Facts.phenomena`."""


@dataclass(frozen=True)
class Facts:
    """What is known about a law, as data.

    Attributes:
        phenomena: codes of `PHENOMENA`.
        smoothness: differentiability class in the velocity, and where it breaks.
        confidence: how the formula was confirmed.
        source: the publication.
    """

    phenomena: tuple[str, ...]
    smoothness: str
    confidence: str
    source: str


@dataclass(frozen=True)
class State:
    """An internal state of a law: name, unit and typical magnitude."""

    name: str
    unit: str
    nominal: float


@dataclass(frozen=True, eq=False)
class Law(Parametric, ABC):
    """A friction law F(v, N, z) with internal states dz/dt = rate(v, N, z).

    Sign: `force` has the sign of the sliding velocity in steady sliding; whoever applies it to a
    body writes the minus (m dv/dt = F_e - force).

    `v` is the sliding velocity [m/s], `N` >= 0 the normal force [N], `z` the column of internal
    states, shape (n, 1) for CasADi types and (n, ...) for arrays, n = len(states). Any of them may
    be a float, a NumPy array, SX, MX or DM. A law that needs another input, such as the applied
    tangential force, takes it as a keyword-only argument of `force` and `rate`.
    """

    facts: ClassVar[Facts]

    @property
    @abstractmethod
    def states(self) -> tuple[State, ...]:
        """The internal states, in the order of the rows of `z`."""

    @property
    @abstractmethod
    def velocity_scale(self) -> Scalar:
        """Sliding velocity [m/s] over which the force changes; inf where there is none."""

    @abstractmethod
    def force(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Friction force [N] opposing the sliding velocity."""

    @abstractmethod
    def rate(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Time derivative of the internal states, shape (n, 1) or (n, ...)."""

    @abstractmethod
    def steady_state(self, v: Scalar, N: Scalar) -> Scalar:
        """Internal states after long sliding at constant `v`; zero at v = 0.

        With a smoothing velocity the rate vanishes there to rounding beyond 20 v_eps.
        """


def check_law(where: str, law: object) -> None:
    """Refuse what is not a law: its class, or its name."""
    if not isinstance(law, Law):
        got = f"the class {law.__name__}" if isinstance(law, type) else repr(law)
        raise ValueError(f"{where}: expected a law such as LuGre(), got {got}")


@dataclass(frozen=True, eq=False)
class StaticLaw(Law):
    """A memoryless law: no internal states, the rate has no rows."""

    @property
    def states(self) -> tuple[State, ...]:
        """No internal states."""
        return ()

    def rate(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """No rows."""
        return empty(v)

    def steady_state(self, v: Scalar, N: Scalar) -> Scalar:
        """No rows."""
        return empty(v)
