"""Consistency checks of a model: types of parts, names, row counts and undeclared symbols."""

from collections.abc import Iterator
from typing import Any

import casadi as ca

from symfric.foundation import checks
from symfric.foundation.parameters import Variable
from symfric.foundation.variable import starts_of, strays
from symfric.model.contact import Contact
from symfric.model.parts import Event, Monitor, Output
from symfric.model.start import System

RESERVED = {"t", "ode", "alg", "residual", "signals"}
"""Names that `Model.function` reserves."""

GROUPS: dict[str, tuple[type, str]] = {
    **dict.fromkeys("xzup", (Variable, "variables")),
    "monitors": (Monitor, "monitors"),
    "events": (Event, "events"),
    "contacts": (Contact, "contacts"),
}
"""Groups of a model, with the type and the name of their elements."""


def kind_problems(model: System) -> list[str]:
    """Return messages about parts of the wrong type, which prevent all other checks."""
    return [text for text in _wrong_kinds(model) if text]


def _wrong_kinds(model: System) -> Iterator[str]:
    yield _message(checks.line, "name", model.name)
    for name, (kind, what) in GROUPS.items():
        yield _message(_group, name, getattr(model, name), kind, what)
    for name in ("ode", "alg", "xdot", "residual"):
        if name != "ode" or model.ode is not None:
            yield _message(checks.expression, name, getattr(model, name))
    yield _message(_results, "outputs", model.outputs)
    yield _message(_once, "contacts", model.contacts)
    for name in ("ode", "alg", "residual"):
        yield _message(_column, name, getattr(model, name))
    if not (isinstance(model.t, ca.SX) and model.t.is_scalar() and model.t.is_symbolic()):  # pyright: ignore[reportUnnecessaryIsInstance]
        yield f"t: expected one SX symbol, got {checks.shown(model.t)}"
    for name in ("details", "sketch", "opening"):
        if name == "details" or getattr(model, name) is not None:
            yield _message(checks.function, name, getattr(model, name), "a function")


def _message(check: Any, *arguments: Any) -> str:
    """Return the message of a failed check, or an empty text."""
    try:
        check(*arguments)
    except ValueError as error:
        return str(error)
    return ""


def _group(where: str, group: object, kind: type, what: str) -> None:
    for part in checks.many(where, group, what):
        checks.kind(where, part, kind, f"{what} made by {kind.__name__}(...)")


def _results(where: str, outputs: object) -> None:
    for name, output in checks.named(where, outputs).items():
        checks.kind(f"{where}: {name}", output, Output, "Output(expression, unit)")


def _once(where: str, contacts: Any) -> None:
    given = contacts if isinstance(contacts, tuple | list) else ()
    names = [c.name for c in given if isinstance(c, Contact)]
    if repeated := [name for name in dict.fromkeys(names) if names.count(name) > 1]:
        raise ValueError(f"{where}: expected every name once, got {', '.join(repeated)}")


def _column(where: str, value: Any) -> None:
    shape = getattr(value, "shape", ())
    if len(shape) == 2 and shape[0] == 1 < shape[1]:
        raise ValueError(f"{where}: expected a column, got a row; write casadi.vertcat(...)")


def contact_problems(model: System) -> list[str]:
    """Return a message about states of contacts that the model lists as its own."""
    own = {v.symbol.element_hash() for v in (*model.x, *model.z)}
    both = [v.name for c in model.contacts for v in c.states if v.symbol.element_hash() in own]
    if not both:
        return []
    return [
        f"x: expected the states of the model only, got {', '.join(both)} of its contacts; leave "
        "them and their rates out, the model adds them"
    ]


def naming_problems(model: System) -> list[str]:
    """Return messages about names that are repeated, reserved, invalid or undefined."""
    problems: list[str] = []
    names = [v.name for group in (model.x, model.z, model.u, model.p) for v in group]
    names += list(model.outputs)
    if repeated := sorted({n for n in names if names.count(n) > 1}):
        problems.append(
            f"expected every name once, got {', '.join(repeated)}"
            + "; contacts made with bare=False call their states <contact>_<state>"
            * any(contact.bare for contact in model.contacts)
        )
    if taken := sorted(RESERVED & set(names)):
        known = ", ".join(sorted(RESERVED))
        problems.append(f"expected none of the names {known}, got {', '.join(taken)}")
    odd = [n for n in names if not (n.isascii() and n.isidentifier())]
    if odd:
        offers = ", ".join(dict.fromkeys(map(checks.as_identifier, odd)))
        problems.append(
            f"expected names that are C identifiers, got {', '.join(odd)}; write {offers}"
        )
    states = [v.name for v in model.x]
    for event in model.events:
        missing = [n for n in event.reset if n not in states]
        if missing:
            problems.append(
                f"event '{event.name}': expected resets of {', '.join(states)}, "
                f"got {', '.join(missing)}"
            )
    return problems


def equation_problems(model: System, known: ca.SX) -> list[str]:
    """Return messages about wrong row counts, and about symbols that are not in `known`."""
    nx, nz = len(model.x), len(model.z)
    problems: list[str] = []
    if model.ode is None and nx and model.residual.is_empty():
        problems.append(f"ode: expected {_many(nx, 'row')} (one a state), got none")
    elif model.ode is not None and model.ode.numel() != nx:
        got = _size(model.ode)
        problems.append(f"ode: expected {_many(nx, 'row')} (one a state), got {got}")
    elif model.ode is not None and model.alg.numel() != nz:
        problems.append(f"alg: expected {_many(nz, 'row')}, got {_size(model.alg)}")
    elif model.residual.numel() != nx + nz:
        got = _size(model.residual)
        problems.append(f"residual: expected {_many(nx + nz, 'row')}, got {got}")
    single = {f"output '{n}'": o.expression for n, o in model.outputs.items()}
    single |= {f"monitor {i + 1}": m.expression for i, m in enumerate(model.monitors)}
    single |= {f"monitor {i + 1}: nominal": m.nominal for i, m in enumerate(model.monitors)}
    for event in model.events:
        single[f"event '{event.name}'"] = event.expression
        single |= {f"event '{event.name}', {n}": value for n, value in event.reset.items()}
    columns = {name: ca.vec(expression) for name, expression in single.items()}
    long = [name for name, column in columns.items() if column.numel() != 1]
    if long:
        problems.append(f"expected scalar expressions, got {', '.join(long)}")
    equations = model.residual if model.ode is None else ca.veccat(model.ode, model.alg)
    stray = strays(ca.vertcat(ca.vec(equations), *columns.values()), known)
    if stray:
        problems.append(
            f"expected only declared symbols, got {', '.join(stray)}; {_declare(stray, known)}"
        )
        return problems
    return problems + list(_start_problems(model, known))


def _many(count: int, what: str) -> str:
    return f"{count} {what}{'s' * (count != 1)}"


def _size(column: ca.SX) -> str:
    rows, columns = column.shape
    return str(rows) if columns == 1 else f"a matrix {rows} x {columns}"


def _declare(stray: list[str], known: ca.SX) -> str:
    """Return advice about the first undeclared symbol."""
    name = stray[0]
    if name == "t":
        return "give the symbol of time as t=t"
    if name in map(str, ca.symvar(known)):
        return f"it is another symbol than that of the variable {name}: write the variable itself"
    if name.endswith("_F"):
        return f"the contact of the friction force {name} is missing in contacts=(...)"
    return "declare them as x, z, u or p"


def _start_problems(model: System, known: ca.SX) -> Iterator[str]:
    """Yield messages about start values with circular dependencies or undeclared symbols."""
    starts = ca.SX(starts_of(model.x))
    if starts.is_constant():
        return
    if stray := strays(starts, known):
        yield f"start: expected declared symbols in start values, got {', '.join(stray)}"
    states = model.vector("x")
    for _ in model.x:
        if not ca.depends_on(starts, states):
            return
        starts = ca.substitute(starts, states, starts)
    if ca.depends_on(starts, states):
        loop = [v.name for v, s in zip(model.x, ca.vertsplit(starts), strict=True)
                if ca.depends_on(s, states)]  # fmt: skip
        yield f"start: expected start values without circular dependencies, got {', '.join(loop)}"
