"""Contacts with friction: sliding velocity, normal force and friction force in a model.

The equations of a model contain the symbol of the friction force. A law closes them,

    F = law.force(slip, N, z),   z' = law.rate(slip, N, z)

or another expression does: another law, the force of sliding to one side, or an unknown that keeps
the contact sticking. `Model.contacts` contains the contacts, `Model.open` has their forces as
inputs, and `Model.with_forces` closes the open model with other forces.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from math import isfinite
from typing import Any, NamedTuple, Protocol, final

import casadi as ca

from symfric.foundation import checks
from symfric.foundation.numeric import Scalar
from symfric.foundation.parameters import Parametric, Variable
from symfric.foundation.symbolic import take_symbols
from symfric.foundation.units import turned
from symfric.foundation.variable import at_start, symbols_of, take_si
from symfric.model.kinds import MODE
from symfric.model.parts import Event, Monitor

Variables = tuple[Variable, ...]
APPLIED = "F_e"
"""Name of the applied force among the inputs of a law."""


class FrictionLaw(Protocol):
    """Interface of friction laws that models require; `symfric.laws.Law` implements it."""

    @property
    def states(self) -> tuple[Any, ...]: ...  # noqa: D102
    @property
    def inputs(self) -> tuple[Any, ...]: ...  # noqa: D102
    @property
    def velocity_scale(self) -> Scalar: ...  # noqa: D102
    @property
    def widths(self) -> Mapping[str, int]: ...  # noqa: D102
    def force(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar: ...  # noqa: D102
    def rate(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar: ...  # noqa: D102
    def steady_state(self, v: Scalar, N: Scalar) -> Scalar: ...  # noqa: D102
    def steady_state_at(self, v: Scalar, N: Scalar, **inputs: Scalar) -> Scalar: ...  # noqa: D102
    def most_held(self, N: Scalar, side: int = 1, **inputs: Scalar) -> Scalar: ...  # noqa: D102
    def switches(self, v: Scalar, N: Scalar, z: Scalar = ()) -> tuple[Any, ...]: ...  # noqa: D102
    def sliding(self, v: Scalar, N: Scalar, side: int) -> Scalar: ...  # noqa: D102
    def static_level(self, N: Scalar, side: int = 1) -> Scalar: ...  # noqa: D102


@final
@dataclass(frozen=True, eq=False, repr=False)
class Contact:
    """Friction between two bodies of a model along one direction.

    The equations of the model contain `force`, and the contact is passed to `Model(contacts=...)`.
    The model then contains the law: its states follow those of the model, and its changes of mode
    are events.

    Attributes:
        name: prefix of states and events of the law, as in "<name>_<state>".
        slip: sliding velocity [m/s], a variable or an expression of the model, shape (1, 1).
        N: normal force [N], an expression or an algebraic variable of the model; NaN in a mechanism
            if the law does not depend on it.
        law: any friction law for a scalar sliding velocity.
        given: further inputs of the law by name. If the applied force F_e is omitted, it is derived
            from the equations of the model.
        rest: maps a state of the model to its value at which `slip` is exactly zero. A law with
            modes assigns it when sliding ends. By default it is a state in which `slip` is linear.
        states: variables of the states of the law; by default new variables that start in steady
            sliding.
        force: SX symbol of the friction force [N] that opposes the slip; by default a new symbol.
        turning: True if the slip is a rate [rad/s] and the force a moment [N m].
        widths: further smoothing widths, such as `JointFriction.eps`, by name. They are parameters
            of `Model.open`, and constants with their start values in the closed model.
        bare: True if states and events have the names of the law, without "<name>_"; None for True
            if the model has only one contact.
    """

    name: str
    slip: Scalar
    N: Scalar
    law: FrictionLaw
    given: Mapping[str, Scalar] = field(default_factory=dict[str, Scalar])
    rest: Mapping[str, Scalar] = field(default_factory=dict[str, Scalar])
    states: Variables = ()
    force: ca.SX = field(default_factory=lambda: ca.SX(0, 0))
    turning: bool = False
    widths: Mapping[str, Variable] = field(default_factory=dict[str, Variable])
    bare: bool | None = False

    def __post_init__(self) -> None:
        where = f"contact '{checks.line('contact: name', self.name)}'"
        if not (isinstance(self.law, Parametric) and hasattr(self.law, "sliding")):
            raise checks.refused(f"{where}: law", "a law of a scalar slip, as LuGre()", self.law)
        take_si(where, self, "slip", "N")
        take_symbols(self, "given", "rest")
        object.__setattr__(self, "rest", checks.named(f"{where}: rest", self.rest))
        for part in ("slip", "N"):
            value = ca.SX(checks.expression(f"{where}: {part}", getattr(self, part)))
            if value.numel() != 1:
                raise checks.refused(f"{where}: {part}", "one expression", value)
            object.__setattr__(self, part, value if part == "slip" else getattr(self, part))
        known = {i.name: i.doc for i in self.law.inputs}
        missing = [f"{n} ({doc})" for n, doc in known.items() if n not in (*self.given, APPLIED)]
        if missing:
            raise ValueError(
                f"{where}: expected all inputs of {type(self.law).__name__}, got no "
                f"{', '.join(missing)}; give it by name, as given={{...}}"
            )
        given = {name: self.given[name] for name in known if name in self.given}
        object.__setattr__(self, "given", given)
        if self.force.is_empty():
            object.__setattr__(self, "force", ca.SX.sym(f"{self.name}_F"))
        if self.law.states and not self.states:
            start = ca.SX(self.law.steady_state(self.slip, self.N))
            states = tuple(
                Variable(
                    self.called(s.name), self.unit(s.unit), start=start[i], nominal=s.nominal,
                    doc=s.doc or "internal friction state", kind=MODE if s.whole else "",
                )
                for i, s in enumerate(self.law.states)
            )  # fmt: skip
            object.__setattr__(self, "states", states)

    def __repr__(self) -> str:
        states = f", states {', '.join(v.name for v in self.states)}" if self.states else ""
        return f"<contact '{self.name}' by {type(self.law).__name__}{states}>"

    def unit(self, of_sliding: str) -> str:
        """Return the unit `of_sliding`, converted to rotation if the contact is `turning`."""
        return turned(of_sliding) if self.turning else of_sliding

    def called(self, name: str) -> str:
        """Return the name that a state or an event of the law has in the model."""
        return f"{self.name}_{name}" if self.bare is False else name

    @property
    def variable(self) -> Variable:
        """Friction force as an input variable named "<name>_F"."""
        return Variable(f"{self.name}_F", self.unit("N"), symbol=self.force, doc="friction force")

    @property
    def further(self) -> dict[str, Scalar]:
        """Further inputs of the law except the applied force, for `sliding` and `static_level`."""
        return {name: value for name, value in self.given.items() if name != APPLIED}

    @cached_property
    def friction(self) -> ca.SX:
        """Friction force [N] of the law."""
        return self._of_law("force", 1)

    @cached_property
    def rate(self) -> ca.SX:
        """Rates of the states of the law, shape (n, 1)."""
        return self._of_law("rate", len(self.states))

    def _of_law(self, what: str, rows: int) -> ca.SX:
        """Return the force or the rates of the law, shape (rows, 1)."""
        if any(i.name == APPLIED for i in self.law.inputs) and APPLIED not in self.given:
            raise checks.refused(
                f"contact '{self.name}': {APPLIED}", "an applied force", None,
                "it follows from the equations: pass the contact to Model(contacts=...) and read "
                "the contact of that model",
            )  # fmt: skip
        value = getattr(self.law, what)(self.slip, self.N, symbols_of(self.states), **self.given)
        where = f"contact '{self.name}': {type(self.law).__name__}.{what}"
        try:
            found = ca.SX(value)
        except NotImplementedError:
            hint = "write casadi.vertcat(...) for several"
            raise checks.refused(where, "an SX expression", value, hint) from None
        if found.numel() != rows:
            raise checks.refused(where, f"{rows} row{'s' * (rows != 1)}", found)
        return found

    def sliding(self, side: int) -> ca.SX:
        """Return the force [N] of sliding to one side in the limit of zero widths."""
        return ca.SX(self.law.sliding(self.slip, self.N, side, **self.further))

    def static_level(self, side: int = 1) -> ca.SX:
        """Return the largest force [N] in stick against a pull to one side."""
        return ca.SX(self.law.static_level(self.N, side, **self.further))

    @property
    def most_held(self) -> ca.SX:
        """Upper bound [N] of the force of the states of the law for any motion."""
        sides = [ca.SX(self.law.most_held(self.N, s, **self.further)) for s in (1, -1)]
        return ca.fmax(*sides)

    def events(self, *, sticks: bool = False) -> tuple[Event, ...]:
        """Return the changes of mode of the law as events of the model.

        `sticks`: True if a contact that stops always sticks first.
        """
        z = symbols_of(self.states)
        at, switches = (self.slip, self.N, z), self.law.switches
        return mode_events(switches, at, self.given, self.called, self.rest, sticks)

    def monitors(self, p: Sequence[Variable]) -> tuple[Monitor, ...]:
        """Return the monitor of the sliding velocity for error control, as a tuple.

        Its scale is the velocity scale of the law, which may depend on the parameters `p`. The
        tuple is empty if this scale is infinite at the start values of `p`.
        """
        scale = self.law.velocity_scale
        return (Monitor(self.slip, scale),) if isfinite(float(at_start(scale, p))) else ()


def mode_events(
    switches: Callable[..., tuple[Any, ...]], at: tuple[Scalar, Scalar, Scalar],
    given: Mapping[str, Scalar],
    called: Callable[[str], str], rest: Mapping[str, Scalar], sticks: bool,
) -> tuple[Event, ...]:  # fmt: skip
    """Return the changes of mode of a law as events.

    Args:
        switches: function of the law that returns its changes of mode.
        at, given: sliding velocity, normal force and states, and further inputs by name.
        called: name of a state or event of the law -> its name in the model.
        rest: resets when sliding ends.
        sticks: True if a contact that stops always sticks first. It then breaks away again if it
            cannot hold; F_e need not be exact while it slides.
    """
    own = switches(*at, **given)
    idle = switches(*at, **{**given, APPLIED: 0.0}) if sticks else own
    return tuple(
        Event(
            called(s.name), s.expression, s.direction,
            reset={called(name): x for name, x in (still if s.halts else s).reset.items()}
            | (dict(rest) if s.halts else {}),
            at_start=s.at_start, rtol=s.rtol,
        )
        for s, still in zip(own, idle, strict=True)
    )  # fmt: skip


class Switching(NamedTuple):
    """Contact whose mode is a state of its own.

    Attributes:
        contact: the contact.
        mode: index of its mode among the states.
        events: indices of its events.
    """

    contact: Contact
    mode: int
    events: tuple[int, int]


def switching(
    contacts: Sequence[Contact], x: Variables, events: Sequence[Event]
) -> tuple[Switching, ...]:
    """Return the contacts of a model with states `x` whose modes can be decided together."""
    states, numbers = [v.name for v in x], {e.name: i for i, e in enumerate(events)}
    found: list[Switching] = []
    for c in contacts:
        modes = [v.name for s, v in zip(c.law.states, c.states, strict=True) if s.whole]
        own = [numbers[name] for name in map(c.called, ("stick", "slip")) if name in numbers]
        if APPLIED in c.given and len(modes) == 1 and len(own) == 2:
            found.append(Switching(c, states.index(modes[0]), (own[0], own[1])))
    return tuple(found)


def mode_changes(contacts: Sequence[Switching], events: Sequence[Event]) -> tuple[int, ...]:
    """Return a number for each event of a model with `contacts` whose modes can be decided.

    It is 1 for events of contacts that may change together, 2 for other events with resets, which
    may start sliding, and otherwise 0.
    """
    own = {i for c in contacts for i in c.events}
    return tuple(
        int(len(contacts) > 1) if i in own else 2 if contacts and e.reset else 0
        for i, e in enumerate(events)
    )
