"""What laws around a law share: everything is that of the law inside, seen through two changes."""

from abc import abstractmethod
from dataclasses import dataclass

from symfric.foundation.numeric import Scalar
from symfric.laws.base.law import Input, Law, State, Switch


@dataclass(frozen=True, eq=False)
class Wrapper(Law):
    """A law in another law, with other numbers at a velocity or under another normal force.

        F = F_inner(v)(v, load(N), z)

    What a wrapper changes it overrides: `inner_at`, `load`, or a method.
    """

    @property
    @abstractmethod
    def inner(self) -> Law:
        """The law inside."""

    def inner_at(self, v: Scalar) -> Law:
        """The law inside, with the numbers it has at the sliding velocity `v`."""
        return self.inner

    def inner_of(self, side: int) -> Law:
        """The law inside, with the numbers it has on one side of v = 0."""
        return self.inner

    def load(self, N: Scalar) -> Scalar:
        """The normal force [N] that the law inside sees."""
        return N

    @property
    def states(self) -> tuple[State, ...]:
        """The states of the law inside."""
        return self.inner.states

    @property
    def inputs(self) -> tuple[Input, ...]:
        """The further inputs of the law inside."""
        return self.inner.inputs

    @property
    def velocity_scale(self) -> Scalar:
        """That of the law inside [m/s]."""
        return self.inner.velocity_scale

    def force(self, v: Scalar, N: Scalar, z: Scalar = (), **inputs: Scalar) -> Scalar:
        """Friction force [N]."""
        return self.inner_at(v).force(v, self.load(N), z, **inputs)

    def sliding(self, v: Scalar, N: Scalar, side: int, **inputs: Scalar) -> Scalar:
        """Sliding force [N] of the law inside on one side; of one that lags, when steady."""
        return self.inner_of(side).sliding(v, self.load(N), side, **inputs)

    def static_level(self, N: Scalar, side: int = 1, **inputs: Scalar) -> Scalar:
        """Largest force [N] at rest of the law inside, on its side."""
        return self.inner_of(side).static_level(self.load(N), side, **inputs)

    def most_held(self, N: Scalar, side: int = 1, **inputs: Scalar) -> Scalar:
        """That of the law inside, on its side."""
        return self.inner_of(side).most_held(self.load(N), side, **inputs)

    def rate(self, v: Scalar, N: Scalar, z: Scalar = (), **inputs: Scalar) -> Scalar:
        """Rates of the states."""
        return self.inner_at(v).rate(v, self.load(N), z, **inputs)

    def switches(
        self, v: Scalar, N: Scalar, z: Scalar = (), **inputs: Scalar
    ) -> tuple[Switch, ...]:
        """The changes of mode of the law inside."""
        return self.inner_at(v).switches(v, self.load(N), z, **inputs)

    def steady_state(self, v: Scalar, N: Scalar) -> Scalar:
        """Steady states of the law inside."""
        return self.inner_at(v).steady_state(v, self.load(N))

    def held_step(self, v: Scalar, N: Scalar, z: Scalar, h: Scalar) -> tuple[Scalar, Scalar] | None:
        """That of the law inside."""
        return self.inner_at(v).held_step(v, self.load(N), z, h)

    def held_rest(self, v: Scalar, N: Scalar, z: Scalar) -> Scalar | None:
        """That of the law inside."""
        return self.inner_at(v).held_rest(v, self.load(N), z)

    def warnings(self) -> tuple[str, ...]:
        """Those of the law inside."""
        return self.inner.warnings()
