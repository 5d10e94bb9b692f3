"""Changes of models: other forms of inputs, further states, parameters and outputs.

These functions return a new model with the same symbols and names, so costs, bounds and outputs
written for the original model remain valid.
"""

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import wraps
from math import inf, isfinite
from typing import Any, Literal, TypeVar, final

import casadi as ca

from ocp.formulation.expressions import Expression, MissingError, Signals, arguments, value_of
from symfric.foundation import checks
from symfric.foundation.parameters import Variable
from symfric.foundation.variable import stacked, symbols_of
from symfric.model import Model

MOST = 9
"""Largest degree of a polynomial."""


@final
@dataclass(frozen=True)
class Polynomial:
    """Input that is one polynomial of time over each phase, with free coefficients.

    Limits: high degrees are badly conditioned.

    Raises:
        ValueError: degree is not in 0 ... 9.
    """

    degree: int

    def __post_init__(self) -> None:
        degree = checks.count("Polynomial: degree", self.degree, least=0, most=MOST)
        object.__setattr__(self, "degree", degree)


Form = Literal["constant", "linear", "cubic"] | Polynomial
"""Form of an input.

    "constant"     constant on each interval of the mesh (default)
    "linear"       continuous, linear on each interval: the rate is constant there
    "cubic"        cubic spline with continuous first and second derivatives: the third derivative
                   is constant on each interval
    Polynomial(d)  polynomial of degree d over each phase, which may jump between phases
"""
Forms = Mapping[str, Form]

ORDERS: dict[str, int] = {"constant": 0, "linear": 1, "cubic": 3}
"""Form -> number of the derivatives that are states or inputs of the model."""
FORM = "'constant', 'linear', 'cubic' or Polynomial(degree)"


def is_form(form: object) -> bool:
    """Return True for one of the forms."""
    return isinstance(form, Polynomial) or (isinstance(form, str) and form in ORDERS)


def order_of(form: Form) -> int:
    """Return the number of derivatives of an input that the model needs."""
    return form.degree if isinstance(form, Polynomial) else ORDERS[form]


def rate_name(name: str, order: int = 1) -> str:
    """Return the name of a derivative of an input: "force_rate", "force_rate_rate", ..."""
    return name + order * "_rate"


def states_of(forms: Forms) -> tuple[str, ...]:
    """Return the inputs and derivatives of inputs that become states."""
    return tuple(
        rate_name(name, k)
        for name, form in forms.items()
        for k in range(order_of(form) + isinstance(form, Polynomial))
    )


Request = TypeVar("Request", bound=Mapping[str, Any] | Sequence[str])

WAVES = 4.0
"""Typical rate of an input, in multiples of its magnitude over the duration."""


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
    states, rates = [v for v in model.u if v.name in nominal], dict[str, Variable | None]()
    for v in states:
        doc, size = f"rate of {v.doc or v.name}", nominal[v.name]
        rate = Variable(rate_name(v.name), f"{v.unit}/s", nominal=size or 1.0, doc=doc)
        rates[v.name] = rate if size else None
    slopes = stacked(0.0 if rate is None else rate.symbol for rate in rates.values())
    return _with_states(model, states, lambda _: slopes, rates)


def _with_states(
    model: Model,
    states: Sequence[Variable],
    rates: Callable[[Model], ca.SX],
    instead: Mapping[str, Variable | None],
) -> Model:
    """Return `model` with further states, and other inputs (None for no input) `instead` of some.

    `rates` returns the rates of the states in the symbols of a model.
    """
    u = tuple(v for old in model.u if (v := instead.get(old.name, old)) is not None)
    changes = further_states(model, states, rates(model))
    return rebuilt(model, lambda it: _with_states(it, states, rates, instead), u=u, **changes)


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

    def rate(name: str, of: Model) -> ca.SX:
        try:
            return value_of(totals[name], Signals(of))
        except MissingError:
            return ca.SX(0)

    states = list[Variable]()
    taken = {*model.signals, *(v.name for v in model.p)}
    for name in (name for name in totals if name not in taken):
        with suppress(ValueError):
            size = typical(model, rate(name, model))
            states.append(Variable(name, "", nominal=size, doc="integral over the motion"))
    return _with_states(model, states, lambda of: stacked(rate(v.name, of) for v in states), {})


@_cached
def with_constants(model: Model, nominal: Mapping[str, float]) -> Model:
    """Return `model` with constant states, name -> typical magnitude, whose start is free.

    Those with a negative magnitude have the lower bound zero.
    """
    states = [
        Variable(name, "", nominal=abs(size), lower=0.0 if size < 0 else -inf)
        for name, size in nominal.items()
    ]
    return _with_states(model, states, lambda _: ca.SX.zeros(len(states)), {})


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
