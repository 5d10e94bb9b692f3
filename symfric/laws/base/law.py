"""What a friction law is: parameters, a force and the rate of its internal states."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field
from math import inf
from typing import TYPE_CHECKING, Any, ClassVar

from symfric.foundation import checks
from symfric.foundation.numeric import Scalar, empty, equals
from symfric.foundation.parameters import Parametric, parameters
from symfric.laws.base.given import with_states

if TYPE_CHECKING:
    from matplotlib.figure import Figure

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


@dataclass(frozen=True, eq=False)
class Law(Parametric, ABC):
    """A friction law F(v, N, z) with internal states dz/dt = rate(v, N, z).

    Sign: `force` has the sign of the sliding velocity in steady sliding; whoever applies it to a
    body writes the minus (m dv/dt = F_e - force).

    `v` is the sliding velocity [m/s], `N` >= 0 the normal force [N], `z` the column of internal
    states, shape (n, 1) for CasADi types and (n, ...) for arrays, n = len(states); of one state it
    may be a number. Any of them may be a float, a NumPy array, SX, MX or DM. A law that needs
    another input, such as the applied tangential force, names it in `inputs` and takes it as a
    keyword-only argument with default 0.

    A law with modes (stick, slip) keeps them in states that only jump, at its `switches`.
    """

    facts: ClassVar[Facts]

    def __init_subclass__(cls, **keywords: Any) -> None:
        super().__init_subclass__(**keywords)
        for name in ("force", "rate"):
            if name in vars(cls):
                setattr(cls, name, with_states(vars(cls)[name]))

    @property
    @abstractmethod
    def states(self) -> tuple[State, ...]:
        """The internal states, in the order of the rows of `z`."""

    @property
    def inputs(self) -> tuple[Input, ...]:
        """Further inputs of `force`, `rate` and `switches`, by keyword."""
        return ()

    @property
    @abstractmethod
    def velocity_scale(self) -> Scalar:
        """Sliding velocity [m/s] over which the force changes; inf where there is none."""

    @abstractmethod
    def force(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Friction force [N] opposing the sliding velocity."""

    @property
    def widths(self) -> dict[str, int]:
        """Parameters that smooth the jump at v = 0: name -> exponent of their unit in m/s.

        Scaled by s^exponent, all of them, the layer of velocities in which the law differs from
        `sliding` is s times as wide. Empty for laws that do not smooth: those with modes, and
        bristles, whose stiffness is physics. A float 0 is no width.
        """
        known = parameters(self).items()
        return {name: p.width for name, p in known if p.width and not equals(p.value, 0.0)}

    def outside(self, speed: Scalar, N: Scalar) -> Scalar:
        """Sliding force [N] at a speed >= 0 as the `widths` vanish; of a dynamic law when steady.

        With its one-sided derivatives at speed 0, and finite below it: what an odd law writes, and
        `sliding` and `static_level` follow. All three take further inputs but F_e by keyword.

        Raises:
            ValueError: the law does not say, or has no such limit.
        """
        raise one_sided(self, "it does not say; write its method `outside(speed, N)`")

    def sliding(self, v: Scalar, N: Scalar, side: int) -> Scalar:
        """Sliding force [N] on one side of v = 0, `side` 1 or -1, as the `widths` vanish.

        Smooth in v from v = 0 on, with the sign of `side`; a Stribeck curve with a velocity of its
        own stays. Raises as `outside`.
        """
        return side * self.outside(side * v, N)

    def static_level(self, N: Scalar, side: int = 1) -> Scalar:
        """Largest force [N] that rest holds against being pulled to `side`, as the widths vanish.

        The top of the curve at rest, unless the law says otherwise. Raises as `outside`.
        """
        return self.outside(0.0, N)

    def most_held(self, N: Scalar, side: int = 1, **inputs: Scalar) -> Scalar:
        """Largest force [N] that the states carry in any motion at a steady load: a bound.

        The static level, unless the law says otherwise. Raises as `outside`.
        """
        return self.static_level(N, side, **inputs)

    @abstractmethod
    def rate(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Time derivative of the internal states, shape (n, 1) or (n, ...)."""

    @abstractmethod
    def steady_state(self, v: Scalar, N: Scalar) -> Scalar:
        """Internal states after long sliding at constant `v`; zero at v = 0.

        With a smoothing velocity the rate vanishes there to rounding beyond 20 v_eps.
        """

    def switches(self, v: Scalar, N: Scalar, z: Scalar = ()) -> tuple[Switch, ...]:
        """The changes of mode; none for a law whose rate says it all."""
        return ()

    def held_step(self, v: Scalar, N: Scalar, z: Scalar, h: Scalar) -> tuple[Scalar, Scalar] | None:
        """States after a step of `h` [s] with v and N held, and their means over it.

        None where they are not known in closed form; for laws with modes, whose rates do not say.
        """
        return None

    def held_rest(self, v: Scalar, N: Scalar, z: Scalar) -> Scalar | None:
        """Where each state comes to rest while v, N and the other states stay as they are.

        None for a law of which only the `steady_state` is known, where all rest together.
        """
        return None

    def warnings(self) -> tuple[str, ...]:
        """What the present numbers give away, such as passivity, one sentence each."""
        return ()

    def thumbnail(self) -> "Figure | None":
        """The force in steady sliding, small; nothing for a law with symbols."""
        from symfric.laws.base.thumbnail import picture  # noqa: PLC0415  (matplotlib is slow to import)

        return picture(self)


def one_sided(law: Law, reason: str) -> ValueError:
    """The error for a law whose force has no limit, or none known, on one side of rest."""
    return ValueError(
        f"{type(law).__name__}: expected a law with a sliding force on each side of v = 0 and a "
        f"static level, got one without; {reason}"
    )


def chosen(law: Law, inputs: Mapping[str, Scalar]) -> dict[str, Scalar]:
    """Those of `inputs` that `law` takes."""
    return {i.name: inputs[i.name] for i in law.inputs if i.name in inputs}


def check_law(where: str, law: object) -> None:
    """Refuse what is not a law: its class, or its name."""
    if isinstance(law, Law):
        return
    hint = ""
    if isinstance(law, type) and issubclass(law, Law):
        hint = f"write {law.__name__}() with parentheses"
    elif isinstance(law, str):
        hint = f"law_from_text({law!r}) makes one of its name"
    raise checks.refused(where, "a law such as LuGre()", law, hint)


@dataclass(frozen=True, eq=False)
class StaticLaw(Law):
    """A memoryless law: no internal states, the rate has no rows."""

    @property
    def states(self) -> tuple[State, ...]:
        """No internal states: the force is a map of v and N."""
        return ()

    def rate(self, v: Scalar, N: Scalar, z: Scalar = (), **inputs: Scalar) -> Scalar:
        """No rows."""
        return empty(v)

    def switches(
        self, v: Scalar, N: Scalar, z: Scalar = (), **inputs: Scalar
    ) -> tuple[Switch, ...]:
        """No modes: nothing jumps."""
        return ()

    def steady_state(self, v: Scalar, N: Scalar) -> Scalar:
        """No rows."""
        return empty(v)
