"""Fields of a problem, and the model, bounds and costs of each phase derived from them.

Functions that change a model return a new one with the same symbols and names, so costs, bounds and
outputs written for the original model remain valid.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, field, replace
from functools import wraps
from math import inf, isfinite, sqrt
from typing import Any, NamedTuple, TypeVar, final

import casadi as ca

from ocp.formulation.expressions import (
    Cost,
    Expression,
    MissingError,
    Signals,
    arguments,
    value_of,
)
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
from ocp.formulation.relaxed import EPS, relaxes
from symfric.foundation import checks
from symfric.foundation.parameters import Variable
from symfric.foundation.variable import stacked, symbols_of
from symfric.model import Model

T = TypeVar("T")
Request = TypeVar("Request", bound=Mapping[str, Any] | Sequence[str])

WAVES = 4.0
"""Typical rate of an input, in multiples of its magnitude over the duration."""

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
        T = checks.as_number(phase.T.start if isinstance(phase.T, Free) else phase.T)
        T = T if T is not None and T > 0 else 1.0
        model = with_forms(model, forms, sizes, T)
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


def rebuilt(model: Model, again: Callable[[Model], Model] | None = None, **changes: Any) -> Model:
    """Return `model` with changed fields; `again` applies the same change to its open form."""
    if model.contacts and again is not None:
        changes["opening"] = lambda: again(model.open)
    if model.holonomic is not None:
        changes |= {"ode": None, "alg": ca.SX(0, 1)}  # derived again from `holonomic`
    return replace(model, **changes)


def _cached(change: Callable[[Model, Request], Model]) -> Callable[[Model, Request], Model]:
    """Return `change` with its results cached in the model; an empty request changes nothing."""

    @wraps(change)
    def changed(model: Model, request: Request) -> Model:
        key = tuple(request.items() if isinstance(request, Mapping) else request)
        kept = model.memory.setdefault(f"ocp {change.__name__}", {(): model})
        if key not in kept:
            kept[key] = change(model, request)
        return kept[key]

    return changed


@_cached
def with_rates(model: Model, nominal: Mapping[str, float]) -> Model:
    """Return `model` with some inputs as states and the rates of these as inputs.

        u' = u_rate

    A rate that is constant on an interval makes the input continuous and linear there. The new
    states follow those of the model; in a mechanism their rates are appended to `holonomic.rates`.

    Args:
        model: the model.
        nominal: input -> typical magnitude of its rate; 0 for an input that is constant.
    """
    states, rates = tuple(v for v in model.u if v.name in nominal), dict[str, Variable]()
    for v in states:
        doc, size = f"rate of {v.doc or v.name}", nominal[v.name]
        if size:
            rates[v.name] = Variable(rate_name(v.name), f"{v.unit}/s", nominal=size, doc=doc)
    kept = (v for v in model.u if v.name not in nominal or v.name in rates)
    inputs = tuple(rates.get(v.name, v) for v in kept)
    slopes = stacked(rates[v.name].symbol if v.name in rates else 0.0 for v in states)
    changes = further_states(model, states, slopes)
    return rebuilt(model, lambda other: with_rates(other, nominal), u=inputs, **changes)


def with_forms(model: Model, forms: Forms, sizes: Mapping[str, float], T: float) -> Model:
    """Return `model` with derivatives of inputs as states and inputs; see `Form`.

    Args:
        model: the model.
        forms: input -> form.
        sizes: input -> typical magnitude of its rate; 0 if unknown.
        T: duration [s], from which unknown magnitudes of derivatives follow.
    """
    orders = {name: order_of(form) for name, form in forms.items()}
    inputs = {v.name: v for v in model.u}
    for k in range(max(orders.values(), default=0)):
        rising = [name for name, order in orders.items() if order > k]
        first = {name: sizes.get(name) or inputs[name].nominal * WAVES / T for name in rising}
        rates = {rate_name(name, k): first[name] * (WAVES / T) ** k for name in rising}
        model = with_rates(model, rates)
    fixed = {n: order_of(form) for n, form in forms.items() if isinstance(form, Polynomial)}
    return with_rates(model, {rate_name(n, order): 0.0 for n, order in fixed.items()})


@_cached
def with_totals(model: Model, totals: Mapping[str, Expression]) -> Model:
    """Return `model` with integrals of expressions as states, which start at zero.

        y' = e(t, x, z, u, p)

    Totals with names that the model lacks are constant; invalid ones, which `validate` reports, are
    omitted.
    """
    states, rates = list[Variable](), list[ca.SX]()
    for name, expression in totals.items():
        try:
            rate = value_of(expression, Signals(model))
        except MissingError:
            rate = ca.SX(0)
        except ValueError:
            continue
        if name not in (*model.signals, *(v.name for v in model.p)):
            doc = "integral over the motion"
            states.append(Variable(name, "", nominal=typical(model, rate), doc=doc))
            rates.append(rate)
    changes = further_states(model, states, stacked(rates))
    return rebuilt(model, lambda other: with_totals(other, totals), **changes)


@_cached
def with_constants(model: Model, nominal: Mapping[str, float]) -> Model:
    """Return `model` with constant states, name -> typical magnitude, whose start is free.

    Those with a negative magnitude have the lower bound zero.
    """
    states = [
        Variable(name, "", nominal=abs(size), lower=0.0 if size < 0 else -inf)
        for name, size in nominal.items()
    ]
    changes = further_states(model, states, ca.SX.zeros(len(states)))
    return rebuilt(model, lambda other: with_constants(other, nominal), **changes)


def typical(model: Model, expression: ca.SX) -> float:
    """Return the magnitude of an expression at nominal values; 1 if it is zero or not finite."""
    at = ca.Function("typical", arguments(model), [expression])
    value = abs(float(at(0.0, *map(model.nominal, "xzu"), model.values("p"))))
    return value if isfinite(value) and value > 0.0 else 1.0


def further_states(model: Model, states: Sequence[Variable], rates: ca.SX) -> dict[str, Any]:
    """Return changed fields of `model` with `states` of derivatives `rates` appended to its states.

    In a mechanism the rates are appended to `holonomic.rates`. No other equation depends on the
    new states.
    """
    x, mechanics = (*model.x, *states), model.holonomic
    if mechanics is None:
        ode = ca.SX(0, 1) if model.ode is None else ca.SX(model.ode)
        return {"x": x, "ode": ca.vertcat(ode, rates)}
    inner = mechanics.inner
    if inner is not None and states:
        inner = replace(inner, groups=(*inner.groups, symbols_of(states)))
    together = replace(mechanics, rates=ca.vertcat(mechanics.rates, rates), inner=inner)
    return {"x": x, "holonomic": together}


@_cached
def with_parameters(model: Model, units: Mapping[str, str]) -> Model:
    """Return `model` with additional parameters (name -> unit) that its equations do not use."""
    p = (*model.p, *(Variable(name, unit) for name, unit in units.items()))
    return rebuilt(model, lambda other: with_parameters(other, units), p=p)


@_cached
def with_outputs(model: Model, names: Sequence[str]) -> Model:
    """Return `model` with some of its details as outputs, for solutions and simulations."""
    wanted = {name: model.further[name] for name in names if name not in model.signals}
    others = {name: output for name, output in model.further.items() if name not in wanted}
    outputs = {**model.outputs, **wanted}
    return rebuilt(
        model, lambda other: with_outputs(other, names), outputs=outputs, details=lambda: others
    )
