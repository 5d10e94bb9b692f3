"""Friction forces of a model: given by its laws, used as inputs, or replaced by expressions.

The force that a contact must carry to keep its sliding velocity follows from the equations. The
rate of a sliding velocity s_i is affine in the friction forces F of a model,

    ds_i/dt = a_i - M_i F,   M = -(d slip/dx) (d ode/dF)

The applied force F_e of contact i is the force for which ds_i/dt = 0 while all other contacts keep
their modes: they slide with the force of their law, or they stick with constant velocity.

    ds_i/dt = 0,   and for j != i   ds_j/dt = 0 if j sticks, else F_j = force of its law

These linear equations are solved symbolically. For contacts that do not interact the solution is
F_e = a_i / M_ii. If algebraic variables depend on friction, as a normal force may, F_e is an
algebraic variable of a contact with modes,

    0 = F_i + ds_i/dt - F_e

which is exact in stick, where F_i = F_e. While the contact slides, F_e exceeds its static level in
the direction of sliding only if the contact accelerates in it.
Source: Pfeiffer & Glocker, Multibody Dynamics with Unilateral Contacts, 1996, ch. 5.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any, TypeVar

import casadi as ca
import numpy as np

from symfric.foundation import checks
from symfric.foundation.numeric import Scalar
from symfric.foundation.parameters import Variable
from symfric.foundation.variable import stacked, starts_of, symbols_of
from symfric.model.contact import APPLIED, Contact, Variables
from symfric.model.parts import Monitor
from symfric.model.start import Put, System, rate_of

STICKS = 0.5
"""Absolute value of a mode below which a contact sticks. Modes are -1, 0 or 1, except for
integration errors."""


def completed(model: System) -> tuple[tuple[Contact, ...], dict[str, Variable]]:
    """Return the contacts of an open model with default values of `F_e`, `rest` and `bare`.

    The second result contains applied forces that are algebraic variables, by contact.

    Raises:
        ValueError: the equations do not determine an applied force.
    """
    contacts = tuple(_named(c, len(model.contacts)) for c in model.contacts)
    contacts = tuple(_resting(c, model) if _mode(c) is not None else c for c in contacts)
    unknown: dict[str, Variable] = {}
    if ca.depends_on(model.alg, stacked(c.force for c in contacts)):
        doc = "friction force for zero sliding acceleration"
        unknown = {
            c.name: Variable(f"{c.name}_{APPLIED}", c.unit("N"), doc=doc)
            for c in contacts if _mode(c) is not None and not _complete(c)
        }  # fmt: skip
    contacts = tuple(_with(c, unknown[c.name].symbol) if c.name in unknown else c for c in contacts)
    pairs = enumerate(contacts)
    done = [c if _complete(c) else _with(c, _applied(i, contacts, model)) for i, c in pairs]
    own = zip(contacts, done, strict=True)
    _refuse_shared([c for c, now in own if now is not c and _mode(c) is not None], model)
    return tuple(done), unknown


def _with(c: Contact, F_e: ca.SX) -> Contact:
    return replace(c, given={**c.given, APPLIED: F_e})


def _refuse_shared(held: Sequence[Contact], model: System) -> None:
    """Raise ValueError if M is singular for contacts that all stick, at two arbitrary places."""
    if len(held) < 2:
        return
    changes = stacked(_change(c, model) for c in held)
    M = ca.densify(ca.jacobian(changes, stacked(c.force for c in held)))
    symbols = ca.vertcat(*ca.symvar(M))
    at = ca.Function("M", [symbols], [M])
    for k in (1, 2):
        values = at(1 + 0.3 * np.sin(k + np.arange(symbols.numel()))).full()
        if not np.isfinite(values).all() or np.linalg.matrix_rank(values) == len(held):
            return
    names = ", ".join(c.name for c in held)
    raise ValueError(
        f"model '{model.name}': contacts: expected contacts whose forces in stick the equations "
        f"determine, got {names}, which cannot slide independently of each other; use one contact "
        "with the Sum of their laws"
    )


def _named(c: Contact, count: int) -> Contact:
    if c.bare is not None:
        return c
    named = replace(c, bare=count == 1)
    states = tuple(
        replace(v, name=named.called(s.name)) for s, v in zip(c.law.states, c.states, strict=True)
    )
    return replace(named, states=states)


def _complete(c: Contact) -> bool:
    """Return True if the applied force is given or not needed."""
    return APPLIED in c.given or all(i.name != APPLIED for i in c.law.inputs)


def _mode(c: Contact) -> ca.SX | None:
    """Return the mode of a law that needs the applied force, which is 0 in stick; None without."""
    modes = [v.symbol for s, v in zip(c.law.states, c.states, strict=True) if s.whole]
    needs = any(i.name == APPLIED for i in c.law.inputs)
    return modes[0] if needs and modes else None


def _resting(c: Contact, model: System) -> Contact:
    """Set `rest` to a state in which the slip is linear, with its value for zero slip.

    If there are several such states, the one that appears in the fewest sliding velocities is
    chosen, since a reset changes all of these.
    """
    slip = ca.SX(c.slip)
    slopes = {v: ca.jacobian(slip, v.symbol) for v in model.x}
    linear = [v for v, k in slopes.items() if k.nnz() and not ca.depends_on(k, v.symbol)]
    if c.rest or not linear:
        return c
    all_slips = [ca.SX(other.slip) for other in model.contacts]
    v = min(linear, key=lambda v: sum(ca.depends_on(s, v.symbol) for s in all_slips))
    return replace(c, rest={v.name: -ca.substitute(slip, v.symbol, ca.SX(0)) / slopes[v]})


def _applied(i: int, contacts: tuple[Contact, ...], model: System) -> ca.SX:
    """Return the force of contact `i` that keeps its sliding velocity constant."""
    if model.ode is None:
        raise _refused(contacts[i], "explicit equations, ode")
    F = stacked(c.force for c in contacts)
    rows = [_change(c, model) if j == i else _row(c, model) for j, c in enumerate(contacts)]
    order = _connected(i, rows, F)
    for j in order:
        if j != i and not _complete(contacts[j]) and _mode(contacts[j]) is None:
            raise _refused(
                contacts[i], f"no other contact on it whose law needs F_e, got '{contacts[j].name}'"
            )
    chosen = stacked(rows[j] for j in order)
    unknown = stacked(contacts[j].force for j in order)
    slopes = ca.jacobian(chosen, unknown)
    if ca.depends_on(slopes, F):
        raise _refused(contacts[i], "accelerations and normal forces affine in the friction forces")
    if ca.depends_on(chosen, symbols_of(model.z)) and ca.depends_on(model.alg, F):
        raise _refused(contacts[i], "equations without algebraic variables that depend on friction")
    constant = ca.substitute(chosen, unknown, ca.SX.zeros(unknown.numel()))
    found = _last_unknown(slopes, -constant)
    if found is None:
        raise _refused(contacts[i], "equations in which the friction force acts on the slip")
    return found


def _change(c: Contact, model: System) -> ca.SX:
    """Return the rate of the sliding velocity of a contact, which must depend on states only."""
    slip = ca.SX(c.slip)
    if ca.depends_on(slip, ca.vertcat(symbols_of(model.z), symbols_of(model.u))):
        raise _refused(c, "a sliding velocity without inputs, whose rates are unknown")
    return rate_of(slip, model)


def _row(c: Contact, model: System) -> ca.SX:
    """Return the residual of the equation of a contact that keeps its mode."""
    mode = _mode(c)
    if mode is None:
        return c.force - c.friction if _complete(c) else c.force
    given = c.given if APPLIED in c.given else {**c.given, APPLIED: 0.0}
    sliding = c.force - ca.SX(c.law.force(c.slip, c.N, symbols_of(c.states), **given))
    return ca.if_else(ca.fabs(mode) < STICKS, _change(c, model), sliding)


def _connected(i: int, rows: list[ca.SX], F: ca.SX) -> list[int]:
    """Return the contacts on whose forces the equation of contact `i` depends, with `i` last."""
    known, queue = {i}, [i]
    while queue:
        slope = ca.jacobian(rows[queue.pop()], F)
        new = {j for j in range(F.numel()) if slope[0, j].nnz()} - known
        known |= new
        queue += sorted(new)
    return [*sorted(known - {i}), i]


def _last_unknown(A: ca.SX, b: ca.SX) -> ca.SX | None:
    """Return the last unknown of A y = b by elimination, or None if it does not appear.

    Pivoting is not necessary: each leading block consists of rows of the identity, for sliding
    contacts, and rows of a matrix M that is positive definite if contacts do not depend on each
    other.
    """
    n = b.numel()
    rows = ca.SX(ca.horzcat(A, b))
    for k in range(n - 1):
        for i in range(k + 1, n):
            if rows[i, k].nnz():
                factor = rows[i, k] / rows[k, k]
                rows[i, :] = ca.sparsify(rows[i, :] - factor * rows[k, :])
                rows[i, k] = 0
    pivot = ca.sparsify(rows[n - 1, n - 1])
    return rows[n - 1, n] / pivot if pivot.nnz() else None


def _refused(c: Contact, expected: str) -> ValueError:
    return checks.refused(
        f"contact '{c.name}': {APPLIED}", expected, None,
        f"give it by name, as in contact(..., {APPLIED}=pull): the sum of all other forces along "
        "the slip",
    )  # fmt: skip


M = TypeVar("M", bound=System)


def by_laws(model: System, expression: ca.SX) -> ca.SX:
    """Return `expression` with the forces of all contacts replaced by those of their laws.

    Raises:
        ValueError: friction forces depend on each other.
    """
    forces = {c.name: c.friction for c in model.contacts}
    return _put(f"model '{model.name}': contacts", model.contacts, forces)(expression)


def closed(model: System) -> dict[str, Any]:
    """Return the parts of an open model that change when the laws of its contacts close it.

    Raises:
        ValueError: the model has contacts together with `holonomic`, although a mechanism creates
            its contacts; or friction forces depend on each other.
    """
    where = f"model '{model.name}': contacts"
    if model.holonomic is not None:
        raise checks.refused(
            where, "none together with `holonomic`; a Mechanism makes them", model.contacts
        )
    contacts, unknown = completed(model)
    put = _put(where, contacts, {c.name: c.friction for c in contacts})
    changes = put.explicit(model)
    held = [(c, unknown[c.name].symbol) for c in contacts if c.name in unknown]
    rows = [put(c.friction + _change(c, model) - F_e) for c, F_e in held]
    changes["z"] = (*model.z, *unknown.values())
    changes["alg"] = ca.vertcat(changes["alg"], *rows)
    changes["contacts"] = contacts
    changes["x"] = (*model.x, *(v for c in contacts for v in c.states))
    rates = [row for c in contacts for row in ca.vertsplit(put(c.rate))]
    changes["ode"] = ca.vertcat(changes["ode"], *rates)
    watched = [m for c in contacts for m in c.monitors(model.p)]
    changes["monitors"] = (*map(put.monitor, watched), *changes["monitors"])
    changes["events"] = (
        *(put.event(e) for c in contacts for e in c.events(sticks=c.name in unknown)),
        *changes["events"],
    )
    return changes


def opened(given: Mapping[str, Any], make: Callable[..., M]) -> M:
    """Return the model with the parts `given`, in which friction forces are inputs."""
    inputs = (*given["u"], *(c.variable for c in given["contacts"]))
    return make(**{**given, "u": inputs, "contacts": (), "opening": None})


def reopened(model: System, made: M) -> M:
    """Return the open model `made`; raise an error if the variables of `model` were changed."""
    inputs = {c.variable.name for c in model.contacts}
    now, then = ({letter: {v.name for v in getattr(m, letter)} for letter in "xup"}
                 for m in (model, made))  # fmt: skip
    if then["x"] <= now["x"] and now["u"] == then["u"] - inputs and now["p"] <= then["p"]:
        return made
    raise ValueError(
        f"model '{model.name}': open: expected unchanged states, inputs and parameters, "
        "got others; change its `open` and close it with `with_forces`"
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
    """Return the parts of the open model `bare` that change with other friction forces.

    States, events and monitors of the laws are removed.

    Args:
        model: the model with its contacts.
        bare: the open form of `model`.
        forces: force [N] opposing the slip of each contact, by name, in the symbols of the model,
            of `p` and of `z`; it may contain the forces of other contacts.
        p, z: additional parameters and algebraic variables. A width of a contact remains a
            parameter if it is in `p`; otherwise it is a constant. In a mechanism `z` contains the
            constraint forces of sticking contacts, which are placed after its multipliers.
        alg: additional algebraic equations, as many as `z`. In a mechanism they may contain the
            accelerations `holonomic.a`.
        monitors: additional monitors for error control of these contacts.

    Raises:
        ValueError: a contact does not exist, or a contact has no force.
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
    put = _put(where, contacts, forces, fixed)
    rows = put(ca.SX(0, 1) if alg is None else ca.SX(alg))
    inputs = {c.variable.name for c in contacts}
    own = {v.name for c in contacts for v in c.widths.values()}
    changes: dict[str, Any] = put.explicit(bare)
    columns = (*bare.z, *z)
    if bare.holonomic is not None:
        mechanics = bare.holonomic
        known = put(mechanics.implicit)
        # forces in stick follow the multipliers, and their equations follow the constraints
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


def _put(
    where: str, contacts: Sequence[Contact], forces: Mapping[str, Scalar],
    fixed: Iterable[Variable] = (),
) -> Put:  # fmt: skip
    """Return the substitution that replaces the symbols of friction forces by expressions."""
    F = stacked(c.force for c in contacts)
    values = stacked(ca.SX(forces[c.name]) for c in contacts)
    for _ in contacts:  # a normal force may follow from the friction of another contact
        if ca.depends_on(values, F):
            values = ca.substitute(values, F, values)
    if ca.depends_on(values, F):
        raise ValueError(
            f"{where}: expected friction forces that do not depend on each other, got a loop; "
            "make the normal force an algebraic variable"
        )
    fixed = tuple(fixed)
    numbers, old = ca.SX(starts_of(fixed)), symbols_of(fixed)
    return Put(ca.vertcat(F, old), ca.vertcat(ca.substitute(values, old, numbers), numbers))
