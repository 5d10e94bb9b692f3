"""Fields of a problem, and the model, bounds and costs of each phase derived from them."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, field
from math import inf, isfinite, sqrt
from typing import Any, NamedTuple, TypeVar, final

from ocp.formulation.changed_models import with_forms, with_parameters, with_totals
from ocp.formulation.expressions import EPS, Cost, Expression
from ocp.formulation.inputs import Form, Forms, Polynomial, is_form, order_of, rate_name, states_of
from ocp.formulation.phase import (
    Chain,
    Free,
    PathCondition,
    Phase,
    Range,
    Ranges,
    as_box,
    clipped,
    is_range,
    meet,
    size_of,
)
from ocp.formulation.relaxed import relaxes
from symfric.foundation import checks
from symfric.model import Model

T = TypeVar("T")

Duration = tuple[Sequence[int], float | Free]
"""(indices of phases, sum of their durations [s])."""


@dataclass(frozen=True, eq=False)
class Statement:
    """Fields of a `Problem` before they are checked."""

    phases: Phase | Chain
    cost: Cost | None = None
    _: KW_ONLY
    bounds: Ranges = field(default_factory=dict[str, Range])
    rates: Ranges = field(default_factory=dict[str, Range])
    inputs: Forms = field(default_factory=dict[str, Form])
    path: Sequence[PathCondition] = ()
    totals: Mapping[str, Expression] = field(default_factory=dict[str, Expression])
    choose: Mapping[str, tuple[float | None, ...]] = field(default_factory=dict[str, Any])
    periodic: Sequence[str] = ()
    scenarios: Mapping[str, Mapping[str, float]] = field(default_factory=dict[str, Any])
    shared: Sequence[str] | None = None
    p: Mapping[str, float] = field(default_factory=dict[str, float])
    durations: Sequence[Duration] = ()

    @property
    def name(self) -> str:
        """Name in messages: the names of the models of its phases."""
        if not isinstance(self.phases, Phase | Chain):  # pyright: ignore[reportUnnecessaryIsInstance]
            return "?"
        return " >> ".join(dict.fromkeys(phase.model.name for phase in self.chain))

    @property
    def chain(self) -> tuple[Phase, ...]:
        """Phases in the order of time."""
        return (self.phases,) if isinstance(self.phases, Phase) else self.phases.phases


def labelled_phases(problem: Statement) -> Iterator[tuple[str, Phase]]:
    """Yield phases with their prefix in messages, "phase 2 'back': "; "" for a single phase."""
    phases = problem.chain
    for number, phase in enumerate(phases):
        name = f" '{phase.name}'" if isinstance(phase.name, str) and phase.name else ""  # pyright: ignore[reportUnnecessaryIsInstance]
        yield (f"phase {number + 1}{name}: " if len(phases) > 1 or name else "", phase)


def costs_of(problem: Statement, phase: Phase) -> tuple[Cost, ...]:
    """Return the costs of the problem and of the phase."""
    return tuple(cost for cost in (problem.cost, phase.cost) if cost is not None)


class Setting(NamedTuple):
    """Phase with the fields that it inherits from the problem.

    Attributes:
        number: index of the phase.
        where: prefix of messages, "phase 2 'back': ".
        model: model with `inputs`, `rates` and `totals` applied, and with the references of costs
            as parameters.
        bounds, p: bounds and parameters of the problem and the phase whose names the model has.
        costs: costs of the problem and of the phase.
        forms: inputs of the model that are not constant on intervals, and their forms.
    """

    number: int
    where: str
    phase: Phase
    model: Model
    bounds: Ranges
    p: Mapping[str, float]
    costs: tuple[Cost, ...]
    forms: Forms

    @property
    def apart(self) -> tuple[str, ...]:
        """States of this phase that do not continue those of the previous one by default."""
        return states_of({n: f for n, f in self.forms.items() if isinstance(f, Polynomial)})


def settings_of(problem: Statement) -> tuple[Setting, ...]:
    """Return the phases of `problem`; invalid inputs, which `validate` reports, are omitted."""
    settings: list[Setting] = []
    for number, (where, phase) in enumerate(labelled_phases(problem)):
        model, costs = phase.model, costs_of(problem, phase)
        forms = forms_of(problem, phase)
        inputs = {v.name: v for v in model.u if v.name in forms}
        rates = only(problem.rates, inputs) | only(phase.rates, inputs)
        sizes = {n: size_of(as_box(r), 0.0) for n, r in rates.items() if is_range(r)}
        time = checks.as_number(phase.T.start if isinstance(phase.T, Free) else phase.T)
        model = with_forms(model, forms, sizes, time if time is not None and time > 0 else 1.0)
        extra = [*references_of(problem, phase), *[EPS] * relaxes([*problem.path, *phase.path])]
        model = with_totals(with_parameters(model, dict.fromkeys(extra, "")), problem.totals)
        bounds = only(problem.bounds, names_of(model, problem.bounds)) | dict(phase.bounds)
        bounds |= {rate_name(n): rates[n] for n in sizes if order_of(forms[n])}
        p = only(problem.p, [v.name for v in model.p]) | dict(phase.p)
        settings.append(Setting(number, where, phase, model, bounds, p, costs, forms))
    return tuple(settings)


def forms_of(problem: Statement, phase: Phase) -> dict[str, Form]:
    """Return input -> form of the inputs of a phase that are not constant on intervals.

    Inputs with bounded rate are linear by default. Forms that are invalid, or whose derivatives
    have names that the model uses, are omitted.
    """
    inputs = [v.name for v in phase.model.u]
    taken = {*phase.model.signals, *(v.name for v in phase.model.p)} - set(inputs)
    forms: dict[str, Form] = dict.fromkeys([*problem.rates, *phase.rates], "linear")
    forms |= dict(problem.inputs) | dict(phase.inputs)
    return {
        name: form
        for name, form in only(forms, inputs).items()
        if is_form(form)
        and form != "constant"
        and not taken & {rate_name(name, k + 1) for k in range(order_of(form))}
    }


def added_signals(problem: Statement, phase: Phase) -> set[str]:
    """Return the names of the signals that `inputs`, `rates` and `totals` add to a model."""
    forms = forms_of(problem, phase)
    derived = {rate_name(name, k) for name, f in forms.items() for k in range(order_of(f) + 1)}
    return derived | {*problem.totals}


def only(values: Mapping[str, T], names: Iterable[str]) -> dict[str, T]:
    """Return the entries of `values` with these names."""
    return {name: value for name, value in values.items() if name in names}


def references_of(problem: Statement, phase: Phase) -> tuple[str, ...]:
    """Return references of the costs that the model lacks and that become parameters."""
    model, costs = phase.model, costs_of(problem, phase)
    wanted = dict.fromkeys(name for cost in costs for name in cost.references)
    known = {*model.signals, *(v.name for v in model.p), "t"}
    return tuple(name for name in wanted if name not in known and name not in model.further)


def names_of(model: Model, wanted: Iterable[str] = ()) -> list[str]:
    """Return the names of the signals of `model`, and of its details if `wanted` requires them.

    The details are included only on demand because writing them out takes time.
    """
    known = list(model.signals)
    return [*known, *model.further] if set(wanted) - set(known) else known


@final
@dataclass(frozen=True)
class Choice:
    """Parameter that the optimiser chooses.

    Attributes:
        lower, upper: bounds, within those of the parameter of the model.
        guess: initial value for the solver.
    """

    name: str
    unit: str
    lower: float
    upper: float
    guess: float

    @property
    def nominal(self) -> float:
        """Typical magnitude: that of the guess, otherwise of the larger bound, otherwise 1."""
        return abs(self.guess) or size_of((self.lower, self.upper))


def chosen_of(problem: Statement, settings: Sequence[Setting]) -> tuple[Choice, ...]:
    """Return the chosen parameters, in the order of `choose`."""
    choices: list[Choice] = []
    for name, (low, high, *guess) in problem.choose.items():
        found = [(s, v) for s in settings for v in s.model.p if v.name == name]
        box = wanted = as_box((low, high))
        for _, v in found:
            box = meet(box, (v.lower, v.upper))
        (setting, v), *_ = found
        first = guess[0] if guess and guess[0] is not None else None
        if first is None:
            first = _nearby(wanted, float(setting.p.get(name, v.start)))
        choices.append(Choice(name, v.unit, *box, clipped(float(first), box)))
    return tuple(choices)


def _nearby(box: tuple[float, float], value: float) -> float:
    """Return `value` if it is in `box`, otherwise the middle or the finite bound of `box`."""
    low, high = box
    if low <= value <= high:
        return value
    if low > 0 and high < inf:
        return sqrt(low * high)
    if isfinite(low) and isfinite(high):
        return 0.5 * (low + high)
    return low if isfinite(low) else high
