"""Base class of friction laws: parameters, a force, the rate of internal states, and facts."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import wraps
from inspect import cleandoc
from math import inf, isfinite
from re import DOTALL, search
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from symfric.foundation import checks
from symfric.foundation.numeric import Scalar, empty, equals, is_casadi, is_number, is_symbolic
from symfric.foundation.parameters import Parametric, parameters, parametric
from symfric.foundation.style import COLOURS
from symfric.foundation.symbolic import plain
from symfric.foundation.vector import Rows
from symfric.laws.base import smooth

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
"""Phenomena that a law can reproduce, by the codes in `Facts.phenomena`."""

CONFIDENCE = {
    "two sources": "the formula was compared with two independent ones",
    "one source": "the formula was compared with one",
    "textbook": "the formula is in every textbook",
    "rebuilt": "the formula was lost or garbled, and rebuilt from descriptions of it",
    "constructed": "constructed here",
    "unverified": "written from memory, compared with no publication and no public code",
}
"""Confidence in a formula, by the words in `Facts.confidence`."""


@dataclass(frozen=True)
class Facts:
    """Facts about a law, as data.

    Attributes:
        phenomena: codes of `PHENOMENA`.
        smoothness: differentiability class in the velocity, and where it breaks.
        confidence: one of `CONFIDENCE`.
        source: publication, read or not; by default the section "Source:" of the docstring.
        odd: True if the force changes sign with v, states and further inputs together.
        load: how the dry force depends on N: "proportional", "independent" or a description.
        checked: reference of the comparison; by default the section "Checked:" of the docstring.
    """

    phenomena: tuple[str, ...]
    smoothness: str
    confidence: str
    source: str = ""
    odd: bool = True
    load: str = "proportional"
    checked: str = ""

    def __set_name__(self, law: type, _: str) -> None:
        text = cleandoc(law.__doc__ or "")
        for name in ("source", "checked"):
            found = search(rf"\n{name.title()}: (.+?)(?=\n\s*\n|\n[A-Z]\w+:|\Z)", text, DOTALL)
            if found and not getattr(self, name):
                object.__setattr__(self, name, " ".join(found[1].split()).removesuffix("."))

    @property
    def formula(self) -> str:
        """Confidence in the formula, in words."""
        text = f"{self.confidence} ({CONFIDENCE[self.confidence]})"
        return f"{text}: {self.checked}" if self.checked else text


@dataclass(frozen=True)
class State:
    """Internal state of a law: name, unit, typical magnitude and description.

    `even` states (a mode, an age) keep their value when the motion is mirrored; the others, such as
    deflections and forces, change sign with it. A `whole` state is a mode: -1, 0 or 1, also in
    results.
    """

    name: str
    unit: str
    nominal: float
    even: bool = False
    doc: str = ""
    whole: bool = False


@dataclass(frozen=True)
class Input:
    """Input of a law besides v and N: a keyword-only argument of its methods.

    `nominal` is its typical magnitude, `steady` its value in figures of steady sliding (v > 0).
    """

    name: str
    unit: str
    doc: str
    nominal: float = 1.0
    steady: float = 0.0


FORCE = "F_e"
APPLIED_FORCE = Input(FORCE, "N", "force that keeps the sliding velocity constant", steady=1.0)
"""Force that the contact must carry for zero acceleration: m dv/dt = F_e - F."""


@dataclass(frozen=True, eq=False)
class Switch:
    """Change of mode: the states in `reset` jump when `expression` passes through zero.

    Attributes:
        expression: in v, N, z and the further inputs of the law.
        direction: +1 only rising, -1 only falling, 0 both.
        reset: state -> its value afterwards, in terms of the values before.
        halts: True if the sliding velocity, zero at this instant, is set to exactly zero.
        at_start: True if it also happens at the start if the expression is already beyond zero.
        rtol: largest relative tolerance of a run, if the law requires exact instants.
    """

    name: str
    expression: Scalar
    direction: int = 0
    reset: Mapping[str, Scalar] = field(default_factory=dict[str, Scalar])
    halts: bool = False
    at_start: bool = False
    rtol: float = inf


def with_states(method: Callable[..., Any]) -> Callable[..., Any]:
    """Wrap `method(law, v, N, z)` so that it accepts states in any common form, and checks them.

    Raises:
        ValueError: another number of states than the law has; an integer too large for a float.
    """

    @wraps(method)
    def checked(law: "Law", v: Scalar, N: Scalar, z: Scalar = (), *more: Any, **inputs: Any) -> Any:
        slip, load = plain(v), plain(N)
        for name, value in (("v", slip), ("N", load)):
            if type(value) is int and not is_number(value):
                where = f"{type(law).__name__}.{method.__name__}: {name}"
                raise checks.refused(where, "a number that a float can hold", value)
        return method(law, slip, load, states_of(law, slip, plain(z)), *more, **inputs)

    return checked


@parametric
class Law(Parametric, ABC):
    """Friction law F(v, N, z) with internal states dz/dt = rate(v, N, z).

    Sign: `force` has the sign of the sliding velocity in steady sliding; it is applied to a body
    with a minus (m dv/dt = F_e - force).

    `v` is the sliding velocity [m/s], `N` >= 0 the normal force [N], `z` the column of internal
    states, shape (n, 1) for CasADi types and (n, ...) for arrays, n = len(states); for one state it
    may be a number. Any of them may be a float, a NumPy array, SX, MX or DM. A law that needs
    another input, such as the applied tangential force, lists it in `inputs` and takes it as a
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
    def velocity_scale(self) -> Scalar:
        """Sliding velocity [m/s] over which the force changes; inf if there is none.

        By default it is that of its first nonzero width or, without one, its first parameter with
        the role "velocity scale"; the inverse of a steepness [s/m].
        """
        known, widths = parameters(self), self.widths
        scales = [p for p in known.values() if p.role == "velocity scale" and not p.width]
        for p in [known[name] for name in widths] or scales:
            return p.value if p.unit in ("m/s", "rad/s") else 1 / p.value
        return inf

    @abstractmethod
    def force(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Return the friction force [N] opposing the sliding velocity."""

    @property
    def widths(self) -> dict[str, int]:
        """Parameters that smooth the jump at v = 0: name -> exponent of their unit in m/s.

        If all of them are scaled by s^exponent, the band of velocities in which the law differs
        from `sliding` is s times as wide. Empty for laws without smoothing: those with modes, and
        bristles, whose stiffness is physical. A float 0 is not a width.
        """
        known = parameters(self).items()
        return {name: p.width for name, p in known if p.width and not equals(p.value, 0.0)}

    def outside(self, speed: Scalar, N: Scalar) -> Scalar:
        """Return the force [N] of steady sliding at a speed >= 0, in the limit of zero `widths`.

        It has one-sided derivatives at speed 0, and is finite below. An odd law defines this
        method, and `sliding` and `static_level` follow from it. All three take further inputs
        except F_e by keyword.

        Raises:
            ValueError: the law does not define it, or has no such limit.
        """
        raise one_sided(self, "it is not defined; write its method `outside(speed, N)`")

    def sliding(self, v: Scalar, N: Scalar, side: int, **inputs: Scalar) -> Scalar:
        """Return the force [N] of steady sliding to one `side`, 1 or -1, for zero `widths`.

        It is smooth in v from v = 0 on, with the sign of `side`; a Stribeck curve with a velocity
        of its own stays. Raises as `outside`.
        """
        return side * self.outside(side * v, N, **inputs)

    def static_level(self, N: Scalar, side: int = 1, **inputs: Scalar) -> Scalar:
        """Return the largest force [N] in stick against a pull to `side`, for zero `widths`.

        By default it is the top of the curve at rest. Raises as `outside`.
        """
        return self.outside(0.0, N, **inputs)

    def most_held(self, N: Scalar, side: int = 1, **inputs: Scalar) -> Scalar:
        """Return an upper bound of the force [N] of the states in any motion at a steady load.

        By default it is the static level. Raises as `outside`.
        """
        return self.static_level(N, side, **inputs)

    @abstractmethod
    def rate(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Return the time derivative of the internal states, shape (n, 1) or (n, ...)."""

    @abstractmethod
    def steady_state(self, v: Scalar, N: Scalar) -> Scalar:
        """Return the internal states after long sliding at constant `v`; zero at v = 0.

        With a smoothing velocity the rate vanishes there to rounding beyond 20 v_eps.
        """

    def switches(self, v: Scalar, N: Scalar, z: Scalar = ()) -> tuple[Switch, ...]:
        """Return the changes of mode; empty for a law without modes."""
        return ()

    def held_step(self, v: Scalar, N: Scalar, z: Scalar, h: Scalar) -> tuple[Scalar, Scalar] | None:
        """Return states after a step of `h` [s] with v and N held, and their means over it.

        None if they are not known in closed form; needed for laws with modes, where rates are not
        enough.
        """
        return None

    def held_rest(self, v: Scalar, N: Scalar, z: Scalar) -> Scalar | None:
        """Return the equilibrium of each state while v, N and the other states stay constant.

        None for a law with a known `steady_state` only, in which all states are steady.
        """
        return None

    def warnings(self) -> tuple[str, ...]:
        """Return warnings about the parameters, such as missing passivity, one sentence each."""
        return ()

    def thumbnail(self) -> "Figure | None":
        """Return a small figure of steady sliding under 1 N; None for a law with symbols."""
        from matplotlib.figure import Figure  # noqa: PLC0415  (matplotlib is slow to import)

        if any(is_symbolic(p.value) for p in parameters(self).values()):
            return None
        scale = checks.as_number(self.velocity_scale)
        largest = 20 * scale if scale is not None and isfinite(scale) else 1.0
        v = largest * np.linspace(-1.0, 1.0, 400)  # even count: excludes v = 0
        ahead = smooth.sign(v, 0.0) if self.facts.odd else 1.0
        inputs = {i.name: i.steady * ahead for i in self.inputs}
        with np.errstate(all="ignore"):
            force = self.force(v, 1.0, self.steady_state(v, 1.0), **inputs)
        figure = Figure(figsize=(4.2, 1.9), layout="constrained")
        axis = figure.subplots()
        axis.plot(1e3 * v, np.broadcast_to(force, v.shape), linewidth=1.2, color=COLOURS[0])
        axis.set_xlabel("v [mm/s], steady", fontsize=7)
        axis.set_ylabel("F [N] under 1 N", fontsize=7)
        axis.tick_params(labelsize=7)
        axis.grid(alpha=0.3)
        return figure


def one_sided(law: Law, reason: str) -> ValueError:
    """Return the error for a law whose force has no known limit on one side of rest."""
    return ValueError(
        f"{type(law).__name__}: expected a law with a sliding force on each side of v = 0 and a "
        f"static level, got one without; {reason}"
    )


def chosen(law: Law, inputs: Mapping[str, Scalar]) -> dict[str, Scalar]:
    """Return those of `inputs` that `law` takes."""
    return {i.name: inputs[i.name] for i in law.inputs if i.name in inputs}


def check_law(where: str, law: object) -> None:
    """Raise an error for anything but a law, such as its class or its name."""
    if isinstance(law, Law):
        return
    hint = ""
    if isinstance(law, type) and issubclass(law, Law):
        hint = f"write {law.__name__}() with parentheses"
    elif isinstance(law, str):
        hint = f"use law_from_text({law!r})"
    raise checks.refused(where, "a law such as LuGre()", law, hint)


@parametric
class StaticLaw(Law):
    """Memoryless law: no internal states, no rows of the rate."""

    @property
    def states(self) -> tuple[State, ...]:
        """Return no internal states: the force is a function of v and N."""
        return ()

    def rate(self, v: Scalar, N: Scalar, z: Scalar = (), **inputs: Scalar) -> Scalar:
        """Return an empty column."""
        return empty(v)

    def switches(
        self, v: Scalar, N: Scalar, z: Scalar = (), **inputs: Scalar
    ) -> tuple[Switch, ...]:
        """Return no changes of mode."""
        return ()

    def steady_state(self, v: Scalar, N: Scalar) -> Scalar:
        """Return an empty column."""
        return empty(v)


def states_of(law: Law, v: Scalar, z: Scalar) -> Scalar:
    """Return `z` with a row for each state of `law`.

    For a law of one state a number is its row, and so is an array with an array of velocities.
    """
    given = z
    if is_casadi(z):
        rows = z.shape[0] if z.numel() else 0  # a slice of a scalar has shape (1, 0)
    elif isinstance(z, Rows):
        return z
    elif is_number(z):
        z, rows = np.array([z], float), 1
    elif isinstance(z, tuple | list):
        rows = len(z)  # pyright: ignore[reportUnknownArgumentType]
    elif isinstance(z, np.ndarray):
        if z.ndim == 1 and z.size != 1 and np.shape(v) == z.shape and len(law.states) == 1:
            z = z[None]
        rows = z.shape[0]
    else:
        rows = -1
    if rows != len(law.states):
        raise _wrong_states(law, given, rows)
    return z


def _wrong_states(law: Law, z: Scalar, rows: int) -> ValueError:
    name, known = type(law).__name__, law.states
    if not known:
        hint, what = "leave z out", "no states"
    else:
        names = checks.listed(s.name for s in known)
        what = f"z with {len(known)} {'state' if len(known) == 1 else 'states'}, {names}"
        hint = "z = law.steady_state(v, N) gives those of steady sliding"
    got = "none" if rows == 0 else checks.shown(z)
    return ValueError(f"{name}: expected {what}, got {got}; {hint}")
