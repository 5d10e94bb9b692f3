"""The force that a contact must carry to keep its sliding velocity, found from the equations.

The rate of a sliding velocity s_i is affine in the friction forces F of a model,

    ds_i/dt = a_i - M_i F,   M = -(d slip/dx) (d ode/dF)

and the applied force F_e of contact i is the force with which ds_i/dt = 0 while every other contact
does what it does: it slides with the force of its law, or it sticks and keeps its own velocity.

    ds_i/dt = 0,   and for j != i   ds_j/dt = 0 if j sticks, else F_j = force of its law

These linear equations are solved symbolically. Contacts that do not act on each other have
F_e = a_i / M_ii.
Source: Pfeiffer & Glocker, Multibody Dynamics with Unilateral Contacts, 1996, ch. 5.
"""

from dataclasses import replace

import casadi as ca

from symfric.foundation import checks
from symfric.foundation.symbols import stacked, symbols_of
from symfric.model.contact import APPLIED, Contact
from symfric.model.start import System

STICKS = 0.5
"""A mode, which is -1, 0 or 1 but for what error control adds, below which a contact sticks."""


def completed(model: System) -> tuple[Contact, ...]:
    """Return the contacts of an open model with `F_e`, `rest` and `bare` where none was given.

    Raises:
        ValueError: an applied force that the equations do not determine.
    """
    contacts = tuple(_named(c, len(model.contacts)) for c in model.contacts)
    contacts = tuple(_resting(c, model) if _mode(c) is not None else c for c in contacts)
    if all(_complete(c) for c in contacts):
        return contacts
    return tuple(
        c if _complete(c) else replace(c, given={**c.given, APPLIED: _applied(i, contacts, model)})
        for i, c in enumerate(contacts)
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
    return APPLIED in c.given or all(i.name != APPLIED for i in c.law.inputs)


def _mode(c: Contact) -> ca.SX | None:
    """Return the mode of a law that sticks, 0 at rest; None for a law without one."""
    modes = [v.symbol for s, v in zip(c.law.states, c.states, strict=True) if s.whole]
    needs = any(i.name == APPLIED for i in c.law.inputs)
    return modes[0] if needs and modes else None


def _resting(c: Contact, model: System) -> Contact:
    """Set a state in which the slip is linear to the value where the slip vanishes.

    Of several it is the one in the fewest sliding velocities, since a reset moves those, too.
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
    """Solve for the force of contact `i` that keeps its sliding velocity."""
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
    z, u = symbols_of(model.z), symbols_of(model.u)
    if ca.depends_on(chosen, z) and ca.depends_on(model.alg, F):
        raise _refused(contacts[i], "equations without algebraic variables that depend on friction")
    if ca.depends_on(ca.SX(contacts[i].slip), u):
        raise _refused(contacts[i], "a sliding velocity without inputs, whose rates are unknown")
    constant = ca.substitute(chosen, unknown, ca.SX.zeros(unknown.numel()))
    found = _last_unknown(slopes, -constant)
    if found is None:
        raise _refused(contacts[i], "equations in which the friction force acts on the slip")
    return found


def _change(c: Contact, model: System) -> ca.SX:
    """Return the rate of the sliding velocity."""
    slip, ode = ca.SX(c.slip), ca.SX(0, 1) if model.ode is None else model.ode
    return ca.jtimes(slip, symbols_of(model.x), ode) + ca.jacobian(slip, model.t)


def _row(c: Contact, model: System) -> ca.SX:
    """Return the equation of a contact that does what it does, = 0."""
    mode = _mode(c)
    if mode is None:
        return c.force - c.friction if _complete(c) else c.force
    given = c.given if APPLIED in c.given else {**c.given, APPLIED: 0.0}
    sliding = c.force - ca.SX(c.law.force(c.slip, c.N, symbols_of(c.states), **given))
    return ca.if_else(ca.fabs(mode) < STICKS, _change(c, model), sliding)


def _connected(i: int, rows: list[ca.SX], F: ca.SX) -> list[int]:
    """Return the contacts whose forces appear in the equation of contact `i`, which comes last."""
    found, queue = {i}, [i]
    while queue:
        slope = ca.jacobian(rows[queue.pop()], F)
        new = {j for j in range(F.numel()) if slope[0, j].nnz()} - found
        found |= new
        queue += sorted(new)
    return [*sorted(found - {i}), i]


def _last_unknown(A: ca.SX, b: ca.SX) -> ca.SX | None:
    """Return the last unknown of A y = b by elimination, or None where it does not appear.

    No pivoting: each leading block has rows of the identity, of contacts that slide, and rows of a
    matrix M that is positive definite where contacts do not depend on each other.
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
