"""Friction forces of a model: those of its laws, as inputs, or others in their place."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, TypeVar, final

import casadi as ca

from symfric.foundation import checks
from symfric.foundation.numeric import Scalar
from symfric.foundation.parameters import Variable
from symfric.foundation.symbols import stacked, starts_of, symbols_of
from symfric.model.contact import Contact, Variables
from symfric.model.holding import completed
from symfric.model.parts import Event, Monitor, Output
from symfric.model.start import System

M = TypeVar("M", bound=System)


def by_laws(model: System, expression: ca.SX) -> ca.SX:
    """Return `expression` with the laws of all contacts in the place of their forces.

    Raises:
        ValueError: friction forces that need each other.
    """
    forces = {c.name: c.friction for c in model.contacts}
    return _Put(f"model '{model.name}': contacts", model.contacts, forces)(expression)


def closed(model: System) -> dict[str, Any]:
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


def opened(given: Mapping[str, Any], make: Callable[..., M]) -> M:
    """The model of the parts `given`, written with friction forces, as inputs of it."""
    inputs = (*given["u"], *(c.variable for c in given["contacts"]))
    return make(**{**given, "u": inputs, "contacts": (), "opening": None})


def reopened(model: System, made: M) -> M:
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
    model: System,
    bare: System,
    forces: Mapping[str, Scalar],
    p: Variables = (),
    z: Variables = (),
    alg: Scalar | None = None,
    monitors: tuple[Monitor, ...] = (),
) -> dict[str, Any]:
    """The parts of the open model `bare` that change with other forces than those of its laws.

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
    return changes | {
        "u": tuple(v for v in bare.u if v.name not in inputs),
        "p": (*(v for v in bare.p if v.name not in own), *p),
        "z": columns,
        "monitors": (*changes["monitors"], *map(put.monitor, monitors)),
    }


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

    def explicit(self, model: System) -> dict[str, Any]:
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
