"""What may be wrong with a model: kinds of its parts, names, rows, undeclared symbols."""

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import casadi as ca

from symfric.foundation import checks
from symfric.foundation.parameters import Variable
from symfric.foundation.symbols import strays
from symfric.model.contact import Contact
from symfric.model.parts import Event, Monitor, Output

if TYPE_CHECKING:
    from symfric.model.model import Model

RESERVED = {"t", "ode", "alg", "residual", "signals"}
"""Names that `Model.function` uses itself."""

GROUPS: dict[str, tuple[type, str]] = {
    **dict.fromkeys("xzup", (Variable, "variables")),
    "monitors": (Monitor, "monitors"),
    "events": (Event, "events"),
    "contacts": (Contact, "contacts"),
}
"""Groups of a model: what they consist of."""


def kind_problems(model: "Model") -> list[str]:
    """Parts that are not of the kind they should be; without these nothing else can be asked."""
    return [text for text in _wrong_kinds(model) if text]


def _wrong_kinds(model: "Model") -> Iterator[str]:
    yield _said(checks.text, "name", model.name)
    for name, (kind, what) in GROUPS.items():
        yield _said(_group, name, getattr(model, name), kind, what)
    for name in ("ode", "alg", "xdot", "residual"):
        if name != "ode" or model.ode is not None:
            yield _said(checks.expression, name, getattr(model, name))
    yield _said(_results, "outputs", model.outputs)
    if not (isinstance(model.t, ca.SX) and model.t.is_scalar() and model.t.is_symbolic()):  # pyright: ignore[reportUnnecessaryIsInstance]
        yield f"t: expected one SX symbol, got {checks.shown(model.t)}"
    for name in ("details", "sketch", "opening"):
        if name == "details" or getattr(model, name) is not None:
            yield _said(checks.function, name, getattr(model, name), "a function")


def _said(check: Any, *arguments: Any) -> str:
    """What a check has to say, or nothing."""
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


def naming_problems(model: "Model") -> list[str]:
    """Names that are repeated, reserved or no identifiers, or stand for nothing."""
    problems: list[str] = []
    names = [v.name for group in (model.x, model.z, model.u, model.p) for v in group]
    names += list(model.outputs)
    repeated = sorted({n for n in names if names.count(n) > 1} | (RESERVED & set(names)))
    if repeated:
        problems.append(
            f"expected every name once and none of {', '.join(sorted(RESERVED))}, "
            f"got {', '.join(repeated)}"
            + "; contacts made with bare=False call their states <contact>_<state>"
            * any(contact.bare for contact in model.contacts)
        )
    odd = [n for n in names if not (n.isascii() and n.isidentifier())]
    if odd:
        problems.append(f"expected names that are C identifiers, got {', '.join(odd)}")
    states = [v.name for v in model.x]
    for event in model.events:
        missing = [n for n in event.reset if n not in states]
        if missing:
            problems.append(
                f"event '{event.name}': expected resets of {', '.join(states)}, "
                f"got {', '.join(missing)}"
            )
    return problems


def equation_problems(model: "Model", known: ca.SX) -> list[str]:
    """Row counts that do not fit, and symbols that are not among the `known`."""
    nx, nz = len(model.x), len(model.z)
    problems: list[str] = []
    if model.ode is not None and model.ode.numel() != nx:
        problems.append(f"ode: expected {nx} rows (one a state), got {model.ode.numel()}")
    elif model.ode is not None and model.alg.numel() != nz:
        problems.append(f"alg: expected {nz} rows, got {model.alg.numel()}")
    elif model.ode is None and nx and model.residual.is_empty():
        problems.append(f"ode: expected a row for each of {nx} states, got none")
    elif model.residual.numel() != nx + nz:
        problems.append(f"residual: expected {nx + nz} rows, got {model.residual.numel()}")
    single = {f"output '{n}'": o.expression for n, o in model.outputs.items()}
    single |= {f"monitor {i + 1}": m.expression for i, m in enumerate(model.monitors)}
    single |= {f"monitor {i + 1}: nominal": m.nominal for i, m in enumerate(model.monitors)}
    for event in model.events:
        single[f"event '{event.name}'"] = event.expression
        single |= {f"event '{event.name}', {n}": value for n, value in event.reset.items()}
    long = [name for name, expression in single.items() if ca.SX(expression).numel() != 1]
    if long:
        problems.append(f"expected scalar expressions, got {', '.join(long)}")
    equations = model.residual if model.ode is None else ca.veccat(model.ode, model.alg)
    stray = strays(ca.veccat(equations, *map(ca.SX, single.values())), known)
    if stray:
        problems.append(
            f"expected only declared symbols, got {', '.join(stray)}; declare them as x, z, u or p"
        )
    return problems
