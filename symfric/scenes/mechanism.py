"""A scene that is a mechanism: bodies, joints and forces, friction of one law in its joints."""

from abc import abstractmethod
from dataclasses import dataclass

from symfric.foundation.numeric import Scalar, is_number, sqrt
from symfric.model import Model, Variables
from symfric.multibody import Mechanism
from symfric.scenes.base import Scene


@dataclass(frozen=True, eq=False)
class MechanismScene(Scene):
    """A machine described by a `Mechanism`; `mechanism()` may be changed before it is built."""

    @abstractmethod
    def mechanism(self) -> Mechanism:
        """Bodies, joints and forces."""

    def equations(self, p: Variables) -> Model:
        """The model in joint coordinates."""
        return self.mechanism().build(p)


def reach(scene: str, square: Scalar, expected: str) -> Scalar:
    """The root of `square` > 0, a distance that links of these lengths must bridge at the start.

    Raises:
        ValueError: they do not, or lie in line, where rates of the loop are not determined.
    """
    if is_number(square) and not float(square) > 0.0:
        raise ValueError(f"{scene}: expected {expected} at the start, got links that do not reach")
    return sqrt(square)
