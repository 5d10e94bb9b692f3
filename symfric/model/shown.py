"""How a model shows itself: what it consists of, without its expressions."""

from symfric.foundation.parameters import Variable
from symfric.foundation.shown import Shown, Table, among, counted, figure_of
from symfric.model.start import System

GROUPS = {
    "x": ("state", "states"),
    "z": ("algebraic variable", "algebraic variables"),
    "u": ("input", "inputs"),
    "p": ("parameter", "parameters"),
}


def shown(model: System) -> Shown:
    """Names, units and start values of everything, and where there is friction by which law."""
    counts = [counted(len(getattr(model, g)), *words) for g, words in GROUPS.items()]
    counts += [counted(len(model.outputs), "output")]
    return Shown(
        f"model '{model.name}': {', '.join(c for c in counts if not c.startswith('no '))}",
        table=Table(("name", "what", "unit", "start", ""), tuple(_rows(model)), numbers=(3,)),
        after=tuple(_after(model)),
    )


def _rows(model: System) -> list[tuple[str, ...]]:
    rows = [_row(v, one) for g, (one, _) in GROUPS.items() for v in getattr(model, g)]
    return rows + [(name, "output", o.unit, "", o.doc) for name, o in model.outputs.items()]


def _row(v: Variable, what: str) -> tuple[str, ...]:
    return v.name, what, v.unit, figure_of(v.start), v.doc


def _after(model: System) -> list[str]:
    found = list[str]()
    if model.contacts:
        found.append(f"friction: {friction(model)}")
    if model.events:
        found.append(f"events: {among(e.name for e in model.events)}")
    if "further" in model.__dict__:
        found.append(f"further results: {among(model.__dict__['further'])}")
    return found


def friction(model: System) -> str:
    """Where there is friction by which law: "belt by LuGre"; all contacts of a law together."""
    laws: dict[str, list[str]] = {}
    for contact in model.contacts:
        laws.setdefault(type(contact.law).__name__, []).append(contact.name)
    return "; ".join(f"{among(places, 4)} by {law}" for law, places in laws.items())
