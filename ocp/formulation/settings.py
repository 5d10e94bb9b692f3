"""What holds in each phase: what the problem says, where the phase does not say otherwise."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import isfinite
from typing import TYPE_CHECKING, TypeVar, final

from ocp.formulation.bounds import Range, as_box, is_range
from ocp.formulation.cost import Cost
from ocp.formulation.phase import Phase, Ranges
from ocp.formulation.rates import rate_name, with_parameters, with_rates
from symfric.model import Model

if TYPE_CHECKING:
    from ocp.formulation.problem import Problem

T = TypeVar("T")


@final
@dataclass(frozen=True, eq=False)
class Setting:
    """One phase with what it takes over from the problem.

    Attributes:
        number: of the phase, from 0.
        where: "phase 2 'back': " for messages; empty where there is one phase without a name.
        model: after `rates`, and with the references of costs as parameters.
        bounds, p: by name, for names that the model has.
        costs: of the problem and of the phase.
    """

    number: int
    where: str
    phase: Phase
    model: Model
    bounds: Ranges
    p: Mapping[str, float]
    costs: tuple[Cost, ...]


def settings_of(problem: "Problem") -> tuple[Setting, ...]:
    """The phases of `problem`; rates that cannot be are left out, for others to complain."""
    phases = problem.chain
    lone = len(phases) == 1 and not phases[0].name
    return tuple(
        _setting(problem, number, phase, "" if lone else f"{labelled(number, phase)}: ")
        for number, phase in enumerate(phases)
    )


def labelled(number: int, phase: Phase) -> str:
    """What a phase is called in messages."""
    return f"phase {number + 1}" + (f" '{phase.name}'" if phase.name else "")


def _setting(problem: "Problem", number: int, phase: Phase, where: str) -> Setting:
    inputs = [v.name for v in phase.model.u]
    rates = only(problem.rates, inputs) | only(phase.rates, inputs)
    taken = {*phase.model.signals, *(v.name for v in phase.model.p)}
    rates = {n: r for n, r in rates.items() if is_range(r) and rate_name(n) not in taken}
    costs = tuple(c for c in (problem.cost, phase.cost) if c is not None)
    scale = {v.name: v.nominal for v in phase.model.u}
    model = with_rates(phase.model, {n: _size(r, scale[n]) for n, r in rates.items()})
    model = with_parameters(model, dict.fromkeys(goals(phase.model, costs), ""))
    ranges = {rate_name(name): value for name, value in rates.items()}
    known = names_of(model, problem.bounds)
    return Setting(
        number=number,
        where=where,
        phase=phase,
        model=model,
        bounds=only(problem.bounds, known) | dict(phase.bounds) | ranges,
        p=only(problem.p, [v.name for v in model.p]) | dict(phase.p),
        costs=costs,
    )


def _size(value: Range, nominal: float) -> float:
    """Typical magnitude of a rate: that of its bounds, else of its input."""
    sizes = [abs(b) for b in as_box(value) if b and isfinite(b)]
    return max(sizes, default=nominal)


def goals(model: Model, costs: Iterable[Cost]) -> tuple[str, ...]:
    """References that `model` does not have: they become parameters."""
    wanted = dict.fromkeys(name for cost in costs for name in cost.references)
    known = {*model.signals, *(v.name for v in model.p), "t"}
    return tuple(name for name in wanted if name not in known and name not in model.further)


def names_of(model: Model, asked: Iterable[str] = ()) -> list[str]:
    """Signals of `model`; with its details only if one of the `asked` is none of them."""
    known = list(model.signals)
    if set(asked) - set(known):
        known += model.further
    return known


def only(given: Mapping[str, T], names: Sequence[str]) -> dict[str, T]:
    """What is `given` for these names."""
    return {name: value for name, value in given.items() if name in names}
