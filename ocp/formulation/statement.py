"""Fields of a problem, its soft and complementary conditions, and the resulting phases."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, field
from math import inf, isfinite, sqrt
from typing import Any, NamedTuple, TypeVar, final

import casadi as ca

from ocp.formulation.changed_models import (
    Form,
    Forms,
    Polynomial,
    is_form,
    order_of,
    rate_name,
    states_of,
    with_forms,
    with_parameters,
    with_totals,
)
from ocp.formulation.expressions import EPS, Cost, Expression, Signals, value_of
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
from symfric.foundation import checks
from symfric.model import Model


@final
@dataclass(frozen=True, eq=False)
class Soft:
    """Condition with a penalty for its violation; see `soft`."""

    condition: Callable[[Signals], object]
    linear: float
    quadratic: float

    def __call__(self, signals: Signals) -> object:
        """Return the comparison of the signals."""
        return self.condition(signals)


def soft(
    condition: Callable[[Signals], object], *, linear: float = 0.0, quadratic: float = 0.0
) -> Soft:
    """Return a condition whose violation s is a part of the cost.

        path   J += integral of (linear |s| + quadratic s^2) dt
        at     J += linear |s| + quadratic s^2

    A linear penalty is exact: the condition holds if `linear` exceeds its multiplier. Below it, and
    with a quadratic penalty, a violation remains; also for conditions on positions over a phase,
    whose multipliers have peaks. `solution.soft` has the cost and the largest violation of each.

    Args:
        condition: function of the signals that returns a comparison.
        linear, quadratic: weights, not negative and not both zero.

    Raises:
        ValueError: not a function, or invalid weights.

    Limits: conditions over a phase need collocation.
    """
    checks.function("soft", condition, "a comparison such as lambda s: s.x <= 1.0")
    weights = (
        checks.number(f"soft: {name}", value, lower=0.0)
        for name, value in (("linear", linear), ("quadratic", quadratic))
    )
    found = Soft(condition, *weights)
    if not found.linear and not found.quadratic:
        raise ValueError(
            "soft: expected linear > 0 or quadratic > 0, got zeros; omit the condition"
        )
    return found


@final
@dataclass(frozen=True, eq=False)
class Complementary:
    """Two signals of which at most one is positive; see `complementary`."""

    a: Expression
    b: Expression

    def __call__(self, signals: Signals) -> ca.SX:
        """Return the comparisons of both signals with zero."""
        a, b = self.parts(signals)
        return ca.vertcat(a >= 0, b >= 0)

    def parts(self, signals: Signals) -> tuple[ca.SX, ca.SX]:
        """Return both signals, SX (1, 1) each."""
        return value_of(self.a, signals), value_of(self.b, signals)


def complementary(a: Expression, b: Expression) -> Complementary:
    """Return the path condition 0 <= a, 0 <= b, a b = 0.

    Examples are gap and force of a unilateral contact, or current and blocking voltage of a diode.
    The product has no interior, so `solve` relaxes it to a b <= eps times the product of their
    typical magnitudes, and decreases eps in several solves. The message reports the last eps and
    the largest product.

    Args:
        a, b: functions of the signals, such as `lambda s: s.gap`.

    Limits: the result is a stationary point of the last relaxed problem; which of both signals is
    zero, and when, is a local optimum. An input that is constant on intervals switches at nodes.
    """
    what = "a function of the signals such as lambda s: s.gap"
    for name, part in (("a", a), ("b", b)):
        checks.function(f"complementary: {name}", part, what)
    return Complementary(a, b)


def relaxes(conditions: Any) -> bool:
    """Return True if some of the `conditions` are complementary."""
    return any(isinstance(condition, Complementary) for condition in conditions)


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
