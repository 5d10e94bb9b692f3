"""Contacts with friction: where a model slides, what presses there, and its friction force.

Equations written with the symbol of the friction force are closed by a law,

    F = law.force(slip, N, z),   z' = law.rate(slip, N, z)

or by something else: another law, the force of sliding on one side, an unknown that holds the
contact at rest. `Model.contacts` says where, `Model.open` has the forces as inputs, and
`Model.with_forces` closes it again.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from math import isfinite
from typing import TYPE_CHECKING, Any, Protocol, final

import casadi as ca

from symfric.foundation import checks
from symfric.foundation.numeric import Scalar
from symfric.foundation.parameters import Parametric, Variable
from symfric.foundation.symbolic import take_symbols
from symfric.foundation.symbols import at_start, stacked, starts_of, symbols_of
from symfric.foundation.units import turned
from symfric.foundation.variable import take_si
from symfric.model.holding import APPLIED, completed
from symfric.model.kinds import MODE
from symfric.model.parts import Event, Monitor, Output

if TYPE_CHECKING:
    from symfric.model.model import Model

Variables = tuple[Variable, ...]


class FrictionLaw(Protocol):
    """What a model asks of a friction law; see `symfric.laws.Law`, which is one."""

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
    def most_held(self, N: Scalar, side: int = 1, **inputs: Scalar) -> Scalar: ...  # noqa: D102
    def switches(self, v: Scalar, N: Scalar, z: Scalar = ()) -> tuple[Any, ...]: ...  # noqa: D102
    def sliding(self, v: Scalar, N: Scalar, side: int) -> Scalar: ...  # noqa: D102
    def static_level(self, N: Scalar, side: int = 1) -> Scalar: ...  # noqa: D102


@final
@dataclass(frozen=True, eq=False, repr=False)
class Contact:
    """Friction at one place of a model, along one direction.

    Write the equations with `force`, pass the contact to `Model(contacts=...)`: the model then
    holds the law, with its states behind those of the model and its changes of mode as events.

    Attributes:
        name: of its states and events, "<name>_<state>".
        slip: sliding velocity [m/s], a variable or an expression of the model, shape (1, 1).
        N: normal force [N], an expression or an algebraic variable of the model; NaN where a
            mechanism's law does not depend on it.
        law: any friction law of a scalar slip.
        given: further inputs of the law by name. The applied force F_e, if omitted, follows from
            the equations of the model.
        rest: state of the model -> its value at which `slip` is exactly zero, which a law by modes
            gives it when sliding ends; if omitted, the first state in which `slip` is linear.
        states: variables for the states of the law; made, starting in steady sliding.
        force: SX symbol of the friction force [N] that opposes the slip; made.
        turning: the law is one of a rate [rad/s], and its force a moment [N m].
        widths: what is smoothed beside the law: name -> parameter of `Model.open`, whose start
            value is the number in the closed model. `JointFriction.eps` is one.
        bare: states and events have the names of the law, without "<name>_"; None: if the model
            has one contact.
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
                f"{where}: expected what {type(self.law).__name__} needs besides v and N, got no "
                f"{', '.join(missing)}; give it by name, as given={{...}}"
            )
        given = {name: self.given[name] for name in known if name in self.given}
        object.__setattr__(self, "given", given)
        if self.force.is_empty():
            object.__setattr__(self, "force", ca.SX.sym(f"{self.name}_F"))
        if self.law.states and not self.states:
            object.__setattr__(self, "states", self._made())

    def __repr__(self) -> str:
        kept = f", states {', '.join(v.name for v in self.states)}" if self.states else ""
        return f"<contact '{self.name}' by {type(self.law).__name__}{kept}>"

    def unit(self, of_sliding: str) -> str:
        """A unit of the law: that of sliding, or of turning."""
        return turned(of_sliding) if self.turning else of_sliding

    def called(self, name: str) -> str:
        """Return the name of a state or an event of the law in the model."""
        return f"{self.name}_{name}" if self.bare is False else name

    def _made(self) -> Variables:
        start = ca.SX(self.law.steady_state(self.slip, self.N))
        return tuple(
            Variable(
                self.called(s.name), self.unit(s.unit), start=start[i], nominal=s.nominal,
                doc=s.doc or "internal friction state", kind=MODE if s.whole else "",
            )
            for i, s in enumerate(self.law.states)
        )  # fmt: skip

    @property
    def variable(self) -> Variable:
        """The friction force as an input, "<name>_F"."""
        return Variable(f"{self.name}_F", self.unit("N"), symbol=self.force, doc="friction force")

    @property
    def further(self) -> dict[str, Scalar]:
        """What the law is given besides the applied force, for `sliding` and `static_level`."""
        return {name: value for name, value in self.given.items() if name != APPLIED}

    @cached_property
    def friction(self) -> ca.SX:
        """The friction force by the law [N]."""
        return self._of_law("force", 1)

    @cached_property
    def rate(self) -> ca.SX:
        """Rates of the states of the law, (n, 1)."""
        return self._of_law("rate", len(self.states))

    def _of_law(self, what: str, rows: int) -> ca.SX:
        """The force or the rates that the law returns, (rows, 1)."""
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
        """The force of sliding to one side as the widths of the law vanish [N]."""
        return ca.SX(self.law.sliding(self.slip, self.N, side, **self.further))

    def static_level(self, side: int = 1) -> ca.SX:
        """The largest force at rest against being pulled to one side [N]."""
        return ca.SX(self.law.static_level(self.N, side, **self.further))

    @property
    def most_held(self) -> ca.SX:
        """The largest force that the states of the law carry in any motion [N]."""
        sides = [ca.SX(self.law.most_held(self.N, s, **self.further)) for s in (1, -1)]
        return ca.fmax(*sides)

    def events(self) -> tuple[Event, ...]:
        """The changes of mode of the law."""
        names = {s.name: v.name for s, v in zip(self.law.states, self.states, strict=True)}
        return tuple(
            Event(
                self.called(s.name),
                s.expression,
                s.direction,
                reset={names[name]: value for name, value in s.reset.items()}
                | (dict(self.rest) if s.halts else {}),
                at_start=s.at_start,
                rtol=s.rtol,
            )
            for s in self.law.switches(self.slip, self.N, symbols_of(self.states), **self.given)
        )

    def monitors(self, p: Sequence[Variable]) -> tuple[Monitor, ...]:
        """What error control must watch: the sliding velocity, on the law's scale.

        The scale follows `p`; a law without one, at the start values of `p`, adds nothing.
        """
        scale = self.law.velocity_scale
        return (Monitor(self.slip, scale),) if isfinite(float(at_start(scale, p))) else ()


def by_laws(model: "Model", expression: ca.SX) -> ca.SX:
    """Return `expression` with the laws of all contacts in the place of their forces.

    Raises:
        ValueError: friction forces that need each other.
    """
    forces = {c.name: c.friction for c in model.contacts}
    return _Put(f"model '{model.name}': contacts", model.contacts, forces)(expression)


def closed(model: "Model") -> dict[str, Any]:
    """The parts of an open model that change as the laws of its contacts close it.

    Raises:
        ValueError: `holonomic`, which a mechanism closes itself; friction forces that need each
            other.
    """
    where = f"model '{model.name}': contacts"
    if model.holonomic is not None:
        raise checks.refused(
            where, "none beside `holonomic`; a Mechanism makes them", model.contacts
        )
    contacts = completed(model)
    put = _Put(where, contacts, {c.name: c.friction for c in contacts})
    changes = put.explicit(model)
    changes["contacts"] = contacts
    changes["x"] = (*model.x, *(v for c in contacts for v in c.states))
    rates = [row for c in contacts for row in ca.vertsplit(put(c.rate))]
    changes["ode"] = ca.vertcat(changes["ode"], *rates)
    watched = [m for c in contacts for m in c.monitors(model.p)]
    changes["monitors"] = (*map(put.monitor, watched), *changes["monitors"])
    changes["events"] = (
        *(put.event(e) for c in contacts for e in c.events()),
        *changes["events"],
    )
    return changes


def opened(given: Mapping[str, Any], make: Callable[..., "Model"]) -> "Model":
    """The model of the parts `given`, written with friction forces, as inputs of it."""
    inputs = (*given["u"], *(c.variable for c in given["contacts"]))
    return make(**{**given, "u": inputs, "contacts": (), "opening": None})


def reopened(model: "Model", made: "Model") -> "Model":
    """The open model `made` of a model, if that is still the one it was made with."""
    inputs = {c.variable.name for c in model.contacts}
    now, then = ({letter: {v.name for v in getattr(m, letter)} for letter in "xup"}
                 for m in (model, made))  # fmt: skip
    if then["x"] <= now["x"] and now["u"] == then["u"] - inputs and now["p"] <= then["p"]:
        return made
    raise ValueError(
        f"model '{model.name}': open: expected states, inputs and parameters as they were made, "
        "got others; change its `open` and close that by `with_forces`"
    )


def with_forces(
    model: "Model",
    forces: Mapping[str, Scalar],
    p: Variables = (),
    z: Variables = (),
    alg: Scalar | None = None,
    monitors: tuple[Monitor, ...] = (),
) -> "Model":
    """A model with other friction forces than those of the laws of its contacts.

    States, events and monitors of the laws are gone with them.

    Args:
        forces: contact -> force [N] opposing its slip, in the symbols of the model, of `p` and of
            `z`; those of other contacts may stand in it.
        p, z: what parameters and algebraic variables come with them. A width of a contact stays a
            parameter if it is in `p`, else it is its number. In a mechanism `z` are forces that
            hold it somehow, and stand next to its multipliers.
        alg: as many more algebraic equations as `z`; in a mechanism they may be written with the
            accelerations `holonomic.a`.
        monitors: what error control watches of these contacts.

    Raises:
        ValueError: a contact that does not exist, or one without a force.
    """
    where, contacts = f"model '{model.name}': with_forces", model.contacts
    names = [c.name for c in contacts]
    checks.check_names(where, checks.named(where, forces), names)
    if missing := [name for name in names if name not in forces]:
        raise ValueError(
            f"{where}: expected a force for each contact, got none for {', '.join(missing)}"
        )
    free = {v.name for v in p}
    fixed = [v for c in contacts for v in c.widths.values() if v.name not in free]
    bare = model.open
    put = _Put(where, contacts, forces, fixed)
    rows = put(ca.SX(0, 1) if alg is None else ca.SX(alg))
    inputs = {c.variable.name for c in contacts}
    own = {v.name for c in contacts for v in c.widths.values()}
    changes: dict[str, Any] = put.explicit(bare)
    columns = (*bare.z, *z)
    if bare.holonomic is not None:
        mechanics = bare.holonomic
        known = put(mechanics.implicit)
        # forces that hold stand next to the multipliers, their equations next to the constraints
        count = mechanics.phi.numel()
        first = mechanics.n + count
        columns = (*bare.z[:count], *z, *bare.z[count:])
        changes["holonomic"] = replace(
            mechanics,
            implicit=ca.vertcat(known[:first, 0], rows, known[first:, 0]),
            applied=mechanics.applied + len(z),
            rates=put(mechanics.rates),
            pressing=put(mechanics.pressing),
        )
        changes |= {"ode": None, "alg": ca.SX(0, 1)}
    else:
        changes["alg"] = ca.vertcat(changes["alg"], rows)
    return replace(
        bare,
        u=tuple(v for v in bare.u if v.name not in inputs),
        p=(*(v for v in bare.p if v.name not in own), *p),
        z=columns,
        **{**changes, "monitors": (*changes["monitors"], *map(put.monitor, monitors))},
    )


@final
class _Put:
    """Puts expressions in the place of the symbols of friction forces."""

    def __init__(
        self, where: str, contacts: Sequence[Contact], forces: Mapping[str, Scalar],
        fixed: Iterable[Variable] = (),
    ) -> None:  # fmt: skip
        F = stacked(c.force for c in contacts)
        values = stacked(ca.SX(forces[c.name]) for c in contacts)
        for _ in contacts:  # a normal force may follow from the friction of another contact
            if ca.depends_on(values, F):
                values = ca.substitute(values, F, values)
        if ca.depends_on(values, F):
            raise ValueError(
                f"{where}: expected friction forces that do not need each other, got a loop; make "
                "the normal force an algebraic variable"
            )
        fixed = tuple(fixed)
        numbers = ca.SX(starts_of(fixed))
        self.old = ca.vertcat(F, symbols_of(fixed))
        self.new = ca.vertcat(ca.substitute(values, symbols_of(fixed), numbers), numbers)

    def __call__(self, expression: Scalar) -> ca.SX:
        return ca.substitute(ca.SX(expression), self.old, self.new)

    def explicit(self, model: "Model") -> dict[str, Any]:
        """Equations, outputs, monitors and events of a model."""
        names = list(model.outputs)
        parts = [ca.SX(0, 1) if model.ode is None else ca.SX(model.ode), ca.SX(model.alg)]
        parts += [ca.SX(model.outputs[name].expression) for name in names]
        ode, alg, *values = ca.substitute(parts, [self.old], [self.new])  # together: shared parts
        pairs = zip(names, values, strict=True)
        return {
            "ode": ode,
            "alg": alg,
            "outputs": {n: replace(model.outputs[n], expression=value) for n, value in pairs},
            "monitors": tuple(map(self.monitor, model.monitors)),
            "events": tuple(map(self.event, model.events)),
            "details": partial(self.outputs, model.details),
        }

    def outputs(self, write: Callable[[], Mapping[str, Output]]) -> dict[str, Output]:
        """Further results, written when somebody asks."""
        return {n: replace(o, expression=self(o.expression)) for n, o in write().items()}

    def monitor(self, monitor: Monitor) -> Monitor:
        """What error control watches."""
        return replace(monitor, expression=self(monitor.expression))

    def event(self, event: Event) -> Event:
        """What happens at zero crossings."""
        reset = {name: self(value) for name, value in event.reset.items()}
        return replace(event, expression=self(event.expression), reset=reset)
