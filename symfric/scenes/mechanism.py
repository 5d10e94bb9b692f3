"""A scene that is a mechanism: bodies, joints and forces, friction of one law in its joints."""

from abc import abstractmethod
from dataclasses import dataclass

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
