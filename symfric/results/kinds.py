"""Kinds of signals, and groups of signals for tables and plots."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, final

from symfric.model import Model
from symfric.model.kinds import CONSTRAINTS, ENERGY, FRICTION, INPUT, POSITION

LENGTHS, FORCES, POWER = ("m", "rad"), ("N", "N m"), "W"
SPEEDS = {"m/s", "rad/s"}


def is_mechanism(model: Model) -> bool:
    """Return True for a model of bodies and joints."""
    return model.holonomic is not None


def norms(model: Model) -> tuple[str, ...]:
    """Return the names of the norms of constraints; empty without closed loops."""
    return tuple(name for name, kind in kinds(model).items() if kind == CONSTRAINTS)


def kinds(model: Model) -> dict[str, str]:
    """Return the kinds of signals by name; signals without a kind are omitted.

    Inputs always have a kind; multipliers and sliding velocities have none.
    """
    found = {v.name: v.kind for v in (*model.x, *model.z)}
    found |= {v.name: v.kind or INPUT for v in model.u}
    found |= {name: output.kind for name, output in model.outputs.items()}
    return {name: kind for name, kind in found.items() if kind}


@final
@dataclass(frozen=True)
class Group:
    """Group of signals in one panel.

    Attributes:
        title: common name; empty for a single signal, which is labelled by its name.
        unit: common unit.
        names: label of each signal in the panel.
        norms: True for norms of constraints, which are drawn as dots on a logarithmic axis.
    """

    title: str
    unit: str
    names: dict[str, str]
    norms: bool = False


def main(model: Model, units: dict[str, str]) -> list[Group]:
    """Return the main signals of a run: positions, friction, and energy or else power.

    If no state is a position, as in a clutch, speeds replace positions. The result is empty for a
    model with neither positions nor friction.

    Args:
        model: model of the signals.
        units: units by name of the signals that may be shown.
    """
    kind, own = kinds(model), {v.name for c in model.contacts for v in c.states}
    rubs = {"friction" if c.bare else f"{c.name}_friction" for c in model.contacts}
    places = [v.name for v in model.x if v.kind == POSITION] or [
        v.name for v in model.x if not v.kind and v.unit in LENGTHS and v.name not in own
    ]
    forces = [n for n, u in units.items() if u in FORCES and (kind.get(n) == FRICTION or n in rubs)]
    if not (places or forces):
        return []
    rates = {v.unit for v in model.x if v.name not in own} & SPEEDS
    speeds = [n for n, u in units.items() if u in rates and n not in own and not kind.get(n)]
    energies = [n for n in units if kind.get(n) == ENERGY]
    powers = [] if energies else [n for n in model.outputs if units.get(n) == POWER]
    titled = {
        "position": places, "speed": [] if places else speeds, "friction": forces,
        "energy": energies, "power of friction": powers,
    }  # fmt: skip
    return [group for title, names in titled.items() for group in by_unit(title, names, units)]


def every(model: Model, units: dict[str, str], apart: int) -> list[Group]:
    """Return groups of all signals: single signals if at most `apart`, else by kind and unit."""
    kind = kinds(model)
    norm = {n: n for n in units if kind.get(n) == CONSTRAINTS}
    rest = [n for n in units if n not in norm]
    last = [Group(CONSTRAINTS, "", norm, norms=True)] if norm else []
    if len(units) <= apart:
        return [*(Group("", units[n], {n: n}) for n in rest), *last]
    titled: dict[str, list[str]] = {}
    for n in rest:
        title = kind.get(n, "")
        if title or not is_mechanism(model):  # omits multipliers and sliding velocities
            of_power = (title, units[n]) == (FRICTION, POWER)
            titled.setdefault(f"power of {title}" if of_power else title, []).append(n)
    groups = [group for title, names in titled.items() for group in by_unit(title, names, units)]
    return [*groups, *last]


def by_unit(title: str, names: Iterable[str], units: dict[str, str]) -> list[Group]:
    """Return the names grouped by unit; names without a unit are omitted.

    Labels are names without a common last word, see `shortened`.
    """
    found: dict[str, list[str]] = {}
    for name in names:
        if name in units:
            found.setdefault(units[name], []).append(name)
    return [
        Group(title if len(own) > 1 else "", unit, dict(zip(own, shortened(own), strict=True)))
        for unit, own in found.items()
    ]


def shortened(names: list[str]) -> list[str]:
    """Return names of at most 28 characters without a common last word such as "_friction"."""
    ending = f"_{names[0].rpartition('_')[2]}"
    if len(names) > 1 and all(n.endswith(ending) and n != ending for n in names):
        names = [n.removesuffix(ending) for n in names]
    return [n if len(n) <= 28 else f"{n[:13]}...{n[-12:]}" for n in names]


def friction_laws(model: Model) -> str:
    """Return the names of the laws of all contacts, such as "LuGre, Coulomb"; "" if none."""
    return ", ".join(dict.fromkeys(_called(contact.law) for contact in model.contacts))


def _called(law: Any) -> str:
    """Return the name of a law; for a sum, the names of its terms joined by "+"."""
    terms = getattr(law, "laws", ())
    return "+".join(map(_called, terms)) if terms else type(law).__name__
