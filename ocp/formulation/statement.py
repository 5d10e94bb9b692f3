"""Statements of a problem, and the model, bounds and costs of each phase that follow.

Changes of models are pure: Model -> Model, with the same symbols and names, so that a cost, a bound
or an output written for the one holds for the other.
"""

from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from math import inf, isfinite, sqrt
from typing import Any, TypeVar, final

import casadi as ca

from ocp.formulation.expressions import Cost
from ocp.formulation.phase import (
    Box,
    Chain,
    Free,
    PathCondition,
    Phase,
    Range,
    Ranges,
    as_box,
    is_range,
)
from symfric.foundation.parameters import Variable
from symfric.foundation.variable import symbols_of
from symfric.model import Model

T = TypeVar("T")

Duration = tuple[Sequence[int], float | Free]
"""Numbers of phases, and what their durations add up to [s]."""


@dataclass(frozen=True, eq=False)
class Statement:
    """Fields of a `Problem` as they were given, not checked yet."""

    phases: Phase | Chain
    cost: Cost | None = None
    bounds: Mapping[str, Range] = field(default_factory=dict[str, Range], kw_only=True)
    rates: Mapping[str, Range] = field(default_factory=dict[str, Range], kw_only=True)
    path: Sequence[PathCondition] = field(default=(), kw_only=True)
    choose: Mapping[str, tuple[float | None, ...]] = field(
        default_factory=dict[str, tuple[float | None, ...]], kw_only=True
    )
    periodic: Sequence[str] = field(default=(), kw_only=True)
    scenarios: Mapping[str, Mapping[str, float]] = field(
        default_factory=dict[str, Mapping[str, float]], kw_only=True
    )
    shared: Sequence[str] | None = field(default=None, kw_only=True)
    p: Mapping[str, float] = field(default_factory=dict[str, float], kw_only=True)
    durations: Sequence[Duration] = field(default=(), kw_only=True)

    @property
    def name(self) -> str:
        """Name in messages: the names of its models."""
        if not isinstance(self.phases, Phase | Chain):  # pyright: ignore[reportUnnecessaryIsInstance]
            return "?"
        return " >> ".join(dict.fromkeys(phase.model.name for phase in self.chain))

    @property
    def chain(self) -> tuple[Phase, ...]:
        """The phases in order."""
        return (self.phases,) if isinstance(self.phases, Phase) else self.phases.phases


def labelled_phases(problem: Statement) -> Iterator[tuple[str, Phase]]:
    """Phases with the beginning of a message about them: "phase 2 'back': ", "" for a lone one."""
    phases = problem.chain
    for number, phase in enumerate(phases):
        name = f" '{phase.name}'" if isinstance(phase.name, str) and phase.name else ""  # pyright: ignore[reportUnnecessaryIsInstance]
        yield (f"phase {number + 1}{name}: " if len(phases) > 1 or name else "", phase)


def costs_of(problem: Statement, phase: Phase) -> tuple[Cost, ...]:
    """Costs of the problem and of the phase."""
    return tuple(cost for cost in (problem.cost, phase.cost) if cost is not None)


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


def settings_of(problem: Statement) -> tuple[Setting, ...]:
    """The phases of `problem`; impossible rates are left out, `validate` reports them."""
    labelled = enumerate(labelled_phases(problem))
    return tuple(_setting(problem, number, phase, where) for number, (where, phase) in labelled)


def _setting(problem: Statement, number: int, phase: Phase, where: str) -> Setting:
    inputs = {v.name: v for v in phase.model.u}
    rates = _only(problem.rates, inputs) | _only(phase.rates, inputs)
    taken = {*phase.model.signals, *(v.name for v in phase.model.p)}
    rates = {n: r for n, r in rates.items() if is_range(r) and rate_name(n) not in taken}
    costs = costs_of(problem, phase)
    model = with_rates(phase.model, {n: _size(r, inputs[n].nominal) for n, r in rates.items()})
    model = with_parameters(model, dict.fromkeys(references_of(phase.model, costs), ""))
    ranges = {rate_name(name): value for name, value in rates.items()}
    known = names_of(model, problem.bounds)
    return Setting(
        number=number,
        where=where,
        phase=phase,
        model=model,
        bounds=_only(problem.bounds, known) | dict(phase.bounds) | ranges,
        p=_only(problem.p, [v.name for v in model.p]) | dict(phase.p),
        costs=costs,
    )


def _size(value: Range, nominal: float) -> float:
    """Typical magnitude of a rate: that of its bounds, else of its input."""
    return max((abs(b) for b in as_box(value) if b and isfinite(b)), default=nominal)


def _only(given: Mapping[str, T], names: Iterable[str]) -> dict[str, T]:
    """Entries of `given` with these names."""
    return {name: value for name, value in given.items() if name in names}


def references_of(model: Model, costs: Iterable[Cost]) -> tuple[str, ...]:
    """References of `costs` that `model` does not have: they become parameters."""
    wanted = dict.fromkeys(name for cost in costs for name in cost.references)
    known = {*model.signals, *(v.name for v in model.p), "t"}
    return tuple(name for name in wanted if name not in known and name not in model.further)


def names_of(model: Model, wanted: Iterable[str] = ()) -> list[str]:
    """Signals of `model`; with its details only if one of the `wanted` is none of them."""
    known = list(model.signals)
    return [*known, *model.further] if set(wanted) - set(known) else known


@final
@dataclass(frozen=True)
class Choice:
    """A parameter that the optimiser chooses.

    Attributes:
        lower, upper: its bounds, those of the parameter itself included.
        guess: where the solver starts.
    """

    name: str
    unit: str
    lower: float
    upper: float
    guess: float

    @property
    def nominal(self) -> float:
        """Typical magnitude: of the guess, else of the larger bound, else 1."""
        sizes = [abs(b) for b in (self.lower, self.upper) if isfinite(b)]
        return abs(self.guess) or max(sizes, default=0.0) or 1.0


def chosen_of(problem: Statement, settings: Sequence[Setting]) -> tuple[Choice, ...]:
    """The chosen parameters, in the order of `choose`."""
    return tuple(_choice(name, given, settings) for name, given in problem.choose.items())


def _choice(name: str, given: tuple[float | None, ...], settings: Sequence[Setting]) -> Choice:
    found = [(s, v) for s in settings for v in s.model.p if v.name == name]
    wanted = as_box((given[0], given[1]))
    low, high = wanted
    for _, v in found:
        low, high = max(low, v.lower), min(high, v.upper)
    setting, variable = found[0]
    guess = given[2] if len(given) == 3 else None
    if guess is None:
        guess = _guess(wanted, float(setting.p.get(name, variable.start)))
    return Choice(name, variable.unit, low, high, min(max(float(guess), low), high))


def _guess(box: Box, value: float) -> float:
    """The value of the parameter where it lies in the range, else the middle of the range."""
    low, high = box
    if low <= value <= high:
        return value
    if low > 0 and high < inf:
        return sqrt(low * high)
    if isfinite(low) and isfinite(high):
        return 0.5 * (low + high)
    return low if isfinite(low) else high


def rate_name(name: str) -> str:
    """Name of the rate of an input."""
    return f"{name}_rate"


def rebuilt(model: Model, again: Callable[[Model], Model], **changes: Any) -> Model:
    """`model` with other fields; `again` makes the same changes in the model that it opens to."""
    if model.contacts:
        changes["opening"] = partial(_opened, model, again)
    if model.holonomic is not None:
        changes |= {"ode": None, "alg": ca.SX(0, 1)}  # made of `holonomic` once more
    return replace(model, **changes)


def _opened(model: Model, again: Callable[[Model], Model]) -> Model:
    return again(model.open)


def _remembered(model: Model, what: str, key: Hashable, make: Callable[[], Model]) -> Model:
    """The same object for the same change of the same model."""
    kept = model.memory.setdefault(f"ocp {what}", {})
    if key not in kept:
        kept[key] = make()
    return kept[key]


def with_rates(model: Model, nominal: Mapping[str, float]) -> Model:
    """`model` with inputs as states, whose rates are inputs instead.

        u' = u_rate

    A rate that is constant on an interval makes the input continuous and linear there. Its state
    stands behind those of the model; of a mechanism its rate joins `holonomic.rates`.

    Args:
        nominal: input -> typical magnitude of its rate.
    """
    if not nominal:
        return model
    make = partial(_with_rates, model, nominal)
    return _remembered(model, "rates", tuple(nominal.items()), make)


def _with_rates(model: Model, nominal: Mapping[str, float]) -> Model:
    states = tuple(v for v in model.u if v.name in nominal)
    rates = {
        v.name: Variable(
            rate_name(v.name),
            f"{v.unit}/s",
            nominal=nominal[v.name],
            doc=f"rate of {v.doc or v.name}",
        )
        for v in states
    }
    added = symbols_of(rates[v.name] for v in states)
    inputs = tuple(rates.get(v.name, v) for v in model.u)
    changes = further_states(model, states, added)
    return rebuilt(model, partial(with_rates, nominal=nominal), u=inputs, **changes)


def further_states(model: Model, states: Sequence[Variable], rates: ca.SX) -> dict[str, Any]:
    """Changed fields of `model` with further `states`, behind its own, that change at `rates`.

    In a mechanism they join `holonomic.rates`; no other equation makes them.
    """
    x, mechanics = (*model.x, *states), model.holonomic
    if mechanics is None:
        ode = ca.SX(0, 1) if model.ode is None else ca.SX(model.ode)
        return {"x": x, "ode": ca.vertcat(ode, rates)}
    inner = mechanics.inner
    if inner is not None and states:
        inner = replace(inner, groups=(*inner.groups, symbols_of(states)))
    together = replace(mechanics, rates=ca.vertcat(mechanics.rates, rates), inner=inner)
    # ode and alg are made of `holonomic` once more
    return {"x": x, "holonomic": together, "ode": None, "alg": ca.SX(0, 1)}


def with_parameters(model: Model, units: Mapping[str, str]) -> Model:
    """`model` with further parameters (name -> unit) that none of its equations needs."""
    if not units:
        return model

    def make() -> Model:
        p = (*model.p, *(Variable(name, unit) for name, unit in units.items()))
        return rebuilt(model, partial(with_parameters, units=units), p=p)

    return _remembered(model, "parameters", tuple(units.items()), make)


def with_outputs(model: Model, names: Iterable[str]) -> Model:
    """`model` with some of its details as outputs, which solutions and simulations then show."""
    details = tuple(name for name in dict.fromkeys(names) if name not in model.signals)
    if not details:
        return model

    def make() -> Model:
        outputs = {**model.outputs, **{name: model.further[name] for name in details}}
        again = partial(with_outputs, names=details)
        rest = partial(_details_without, model, details)
        return rebuilt(model, again, outputs=outputs, details=rest)

    return _remembered(model, "outputs", details, make)


def _details_without(model: Model, names: Sequence[str]) -> dict[str, Any]:
    return {name: output for name, output in model.further.items() if name not in names}
