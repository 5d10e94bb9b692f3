"""Base class of friction laws: parameters, a force, and the rate of internal states."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import wraps
from inspect import cleandoc
from math import inf, isfinite
from re import DOTALL, search
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from symfric.foundation import checks, units
from symfric.foundation.numeric import Scalar, empty, equals, is_casadi, is_number, is_symbolic
from symfric.foundation.parameters import Parametric, parameters, parametric
from symfric.foundation.symbolic import plain
from symfric.foundation.vector import VectorRows
from symfric.laws.base import smooth
from symfric.laws.base.own_laws import called, check_class, with_checks
from symfric.laws.base.phenomena import CONFIDENCE

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class Facts:
    """Properties of a law that are not part of its equations.

    Attributes:
        phenomena: codes of `PHENOMENA`.
        smoothness: differentiability class in the velocity, and the exceptions.
        confidence: a key of `CONFIDENCE`.
        source: publication of the law; by default the section "Source:" of its docstring.
        odd: True if the force changes sign when v, the states and the further inputs do.
        load: dependence of the dry force on N: "proportional", "independent" or a description.
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
        """Confidence in the formula as text, with the reference of the comparison."""
        text = f"{self.confidence} ({CONFIDENCE[self.confidence]})"
        return f"{text}: {self.checked}" if self.checked else text


@dataclass(frozen=True)
class State:
    """Internal state of a law: name, unit, typical magnitude and description.

    An `even` state, such as an age, keeps its value when the motion is mirrored; all other states,
    such as deflections, change sign. A `whole` state is a mode: -1, 0 or 1, in results as well.
    """

    name: str
    unit: str
    nominal: float
    even: bool = False
    doc: str = ""
    whole: bool = False

    def __post_init__(self) -> None:
        checks.identifier("state: name", self.name)
        if units.in_si(self.unit) not in (None, 1.0):
            raise checks.refused(f"state '{self.name}': unit", "an SI unit", self.unit)
        hint = "parameters are symbols in fits and generated code, so give a number for all values"
        checks.number(f"state '{self.name}': nominal", self.nominal, above=0.0, hint=hint)


@dataclass(frozen=True)
class Input:
    """Input of a law in addition to v and N: a keyword-only argument of its methods.

    `nominal` is its typical magnitude. `steady` is its value in figures of steady sliding, v > 0.
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
        expression: function of v, N, z and the further inputs of the law.
        direction: 1 for rising zeros only, -1 for falling zeros only, 0 for both.
        reset: maps a state to its value after the change, in terms of the values before it.
        halts: True if the sliding velocity is set to exactly zero at the change.
        at_start: True if it also occurs at the start when the expression is already beyond zero.
        rtol: largest relative tolerance of a run, for laws that require accurate instants.
    """

    name: str
    expression: Scalar
    direction: int = 0
    reset: Mapping[str, Scalar] = field(default_factory=dict[str, Scalar])
    halts: bool = False
    at_start: bool = False
    rtol: float = inf


def with_states(method: Callable[..., Any]) -> Callable[..., Any]:
    """Wrap `method(law, v, N, z)` so that it accepts states in any common form, with checks."""

    @wraps(method)
    def checked(law: Any, v: Scalar, N: Scalar, z: Scalar = (), *more: Any, **inputs: Any) -> Any:
        slip, load = plain(v), plain(N)
        for name, value in (("v", slip), ("N", load)):
            if type(value) is int and not is_number(value):
                where = f"{type(law).__name__}.{method.__name__}: {name}"
                raise checks.refused(where, "a number that a float can hold", value)
        states = states_of(law, slip, plain(z))
        if type(law).__module__.startswith("symfric."):
            return method(law, slip, load, states, *more, **inputs)
        like = slip if method.__name__ == "force" else states
        return called(method, law, (slip, load, states, *more), inputs, like)

    return checked


@parametric
class Law(Parametric, ABC):
    """Friction law F(v, N, z) with internal states dz/dt = rate(v, N, z).

    Sign: in steady sliding, `force` has the sign of the sliding velocity. It opposes the motion of
    a body, so it is applied with a minus sign (m dv/dt = F_e - force).

    `v` is the sliding velocity [m/s], `N` >= 0 the normal force [N], and `z` the column of internal
    states, of shape (n, 1) for CasADi types and (n, ...) for arrays, with n = len(states). If n is
    1, `z` may be a number. All of them may be floats, NumPy arrays, SX, MX or DM. A law that needs
    another input, such as the applied tangential force, lists it in `inputs` and accepts it as a
    keyword-only argument with the default 0.

    The modes of a law (stick, slip) are states that change only by jumps, at its `switches`.
    """

    facts: ClassVar[Facts] = Facts((), "not stated", "unverified")

    def __init_subclass__(cls, **keywords: Any) -> None:
        super().__init_subclass__(**keywords)
        if not cls.__module__.startswith("symfric."):
            check_class(cls)
            if "outside" in vars(cls):
                cls.outside = with_checks(cls.outside)
        for name in ("force", "rate"):
            if name in vars(cls):
                setattr(cls, name, with_states(vars(cls)[name]))

    @property
    @abstractmethod
    def states(self) -> tuple[State, ...]:
        """Internal states, in the order of the rows of `z`."""

    @property
    def inputs(self) -> tuple[Input, ...]:
        """Further inputs of `force`, `rate` and `switches`, which are passed by keyword."""
        return ()

    @property
    def velocity_scale(self) -> Scalar:
        """Sliding velocity [m/s] over which the force changes; inf if the law has no such scale.

        By default it is the first nonzero width or, without one, the first parameter with the role
        "velocity scale". If that parameter is a steepness [s/m], it is the inverse.
        """
        known, widths = parameters(self), self.widths
        scales = [p for p in known.values() if p.role == "velocity scale" and not p.width]
        for p in [known[name] for name in widths] or scales:
            return p.value if p.unit in ("m/s", "rad/s") else 1 / p.value
        return inf

    @abstractmethod
    def force(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Return the friction force [N], which opposes the motion and is positive for v > 0."""

    @property
    def widths(self) -> dict[str, int]:
        """Names of the parameters that smooth the jump at v = 0, with the exponent of m/s.

        If each width is scaled by s^exponent, the band of velocities in which the law differs from
        `sliding` becomes s times as wide. The result is empty for laws with modes and for bristle
        laws, whose stiffness is physical. A width that is the float 0 is omitted.
        """
        known = parameters(self).items()
        return {name: p.width for name, p in known if p.width and not equals(p.value, 0.0)}

    def outside(self, speed: Scalar, N: Scalar) -> Scalar:
        """Return the force [N] of steady sliding at a speed >= 0, in the limit of zero `widths`.

        The force has one-sided derivatives at speed 0 and is finite at negative speeds. An odd law
        defines this method; `sliding` and `static_level` are derived from it. All three accept
        further inputs, except F_e, by keyword.

        Raises:
            ValueError: the law does not define this method, or has no such limit.
        """
        raise one_sided(self, "it is not defined; write its method `outside(speed, N)`")

    def sliding(self, v: Scalar, N: Scalar, side: int, **inputs: Scalar) -> Scalar:
        """Return the force [N] of steady sliding to one `side`, 1 or -1, for zero `widths`.

        The force has the sign of `side` and is smooth in v on this side, including v = 0. A
        Stribeck curve with its own velocity scale is retained. Raises the errors of `outside`.
        """
        return side * self.outside(side * v, N, **inputs)

    def static_level(self, N: Scalar, side: int = 1, **inputs: Scalar) -> Scalar:
        """Return the largest force [N] in stick against a pull to `side`, for zero `widths`.

        By default it is the force of `outside` at speed 0. Raises the errors of `outside`.
        """
        return self.outside(0.0, N, **inputs)

    def most_held(self, N: Scalar, side: int = 1, **inputs: Scalar) -> Scalar:
        """Return an upper bound of the force [N] of the states for any motion at constant load.

        By default it is the static level. Raises the errors of `outside`.
        """
        return self.static_level(N, side, **inputs)

    @abstractmethod
    def rate(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Return the time derivative of the internal states, shape (n, 1) or (n, ...)."""

    @abstractmethod
    def steady_state(self, v: Scalar, N: Scalar) -> Scalar:
        """Return the internal states after long sliding at constant `v`; zero at v = 0.

        If |v| is smooth over v_eps, their rate vanishes to rounding for |v| > 20 v_eps.
        """

    def steady_state_at(self, v: Scalar, N: Scalar, **inputs: Scalar) -> Scalar:
        """Return the `steady_state` under further inputs, which have no effect by default."""
        return self.steady_state(v, N)

    def switches(self, v: Scalar, N: Scalar, z: Scalar = ()) -> tuple[Switch, ...]:
        """Return the changes of mode; empty for a law without modes."""
        return ()

    def held_step(self, v: Scalar, N: Scalar, z: Scalar, h: Scalar) -> tuple[Scalar, Scalar] | None:
        """Return the states after a step of `h` [s] at constant v and N, and their means over it.

        Return None if they are not known in closed form. Laws with modes need this method, because
        the rates alone do not determine their step.
        """
        return None

    def held_rest(self, v: Scalar, N: Scalar, z: Scalar) -> Scalar | None:
        """Return each state's equilibrium at constant v, N and other states; None if unknown."""
        return None

    def warnings(self) -> tuple[str, ...]:
        """Return warnings about the parameters, such as a lack of passivity, one sentence each."""
        return ()

    def thumbnail(self) -> "Figure | None":
        """Return a small figure of the force in steady sliding at N = 1 N; None with symbols."""
        from symfric.foundation.panels import blank, dressed  # noqa: PLC0415  (slow to import)

        if any(is_symbolic(p.value) for p in parameters(self).values()):
            return None
        scale = checks.as_number(self.velocity_scale)
        largest = 20 * scale if scale is not None and isfinite(scale) else 1.0
        v = largest * np.linspace(-1.0, 1.0, 400)  # even count: excludes v = 0
        ahead = smooth.sign(v, 0.0) if self.facts.odd else 1.0
        inputs = {i.name: i.steady * ahead for i in self.inputs}
        with np.errstate(all="ignore"):
            force = self.force(v, 1.0, self.steady_state(v, 1.0), **inputs)
        figure = blank(4.2, 1.9)
        axis = dressed(figure.subplots())
        axis.plot(1e3 * v, np.broadcast_to(force, v.shape), linewidth=1.2)
        axis.set_xlabel("v [mm/s], steady", fontsize=7)
        axis.set_ylabel("F [N] under 1 N", fontsize=7)
        axis.tick_params(labelsize=7)
        return figure


def one_sided(law: Law, reason: str) -> ValueError:
    """Return the error for a law whose force has no known limit on one side of rest."""
    return ValueError(
        f"{type(law).__name__}: expected a law with a sliding force on each side of v = 0 and a "
        f"static level, got one without; {reason}"
    )


def chosen(law: Law, inputs: Mapping[str, Scalar]) -> dict[str, Scalar]:
    """Return the entries of `inputs` that `law` accepts."""
    return {i.name: inputs[i.name] for i in law.inputs if i.name in inputs}


def require_law(where: str, law: object) -> None:
    """Raise an error if `law` is not a law; the hint covers the class and the name of a law."""
    if isinstance(law, Law):
        if not type(law).__module__.startswith("symfric."):
            _check_states(type(law).__name__, law.states)
        return
    hint = ""
    if isinstance(law, type) and issubclass(law, Law):
        hint = f"write {law.__name__}() with parentheses"
    elif isinstance(law, str):
        hint = f"use law_from_text({law!r})"
    raise checks.refused(where, "a law such as LuGre()", law, hint)


def _check_states(name: str, states: object) -> None:
    """Raise an error if the states of a user's law are not a tuple of states with own names."""
    if not isinstance(states, tuple | list) or not all(isinstance(s, State) for s in states):
        hint = "a method that returns them needs @property"
        raise checks.refused(f"{name}: states", "a tuple of State(...)", states, hint)
    names = [state.name for state in states]
    if len(set(names)) < len(names):
        raise checks.refused(f"{name}: states", "every name once", ", ".join(names))


@parametric
class StaticLaw(Law):
    """Memoryless law, which has no internal states."""

    @property
    def states(self) -> tuple[State, ...]:
        """Empty tuple, since the force is a function of v and N only."""
        return ()

    def rate(self, v: Scalar, N: Scalar, z: Scalar = (), **inputs: Scalar) -> Scalar:
        """Return an empty column."""
        return empty(v)

    def switches(
        self, v: Scalar, N: Scalar, z: Scalar = (), **inputs: Scalar
    ) -> tuple[Switch, ...]:
        """Return an empty tuple, since the law has no modes."""
        return ()

    def steady_state(self, v: Scalar, N: Scalar) -> Scalar:
        """Return an empty column."""
        return empty(v)


def states_of(law: Any, v: Scalar, z: Scalar) -> Scalar:
    """Return `z` with one row for each state of `law`.

    If the law has one state, `z` may be a number, or an array of the shape of the velocities.
    """
    given = z
    if is_casadi(z):
        rows = z.shape[0] if z.numel() else 0  # a slice of a scalar has shape (1, 0)
    elif isinstance(z, VectorRows):
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
    known = law.states
    if rows == len(known):
        return z
    hint, what = "leave z out", "no states"
    if known:
        names = checks.listed(s.name for s in known)
        what = f"z with {len(known)} {'state' if len(known) == 1 else 'states'}, {names}"
        hint = "z = law.steady_state(v, N) gives those of steady sliding"
    got = "none" if rows == 0 else checks.shown(given)
    raise ValueError(f"{type(law).__name__}: expected {what}, got {got}; {hint}")
