"""Models whose inputs are states with a rate, and models with further parameters and outputs.

All are pure: Model -> Model, with the same symbols and names, so that a cost, a bound or an output
written for the one holds for the other. The same request to the same model gives the same object.
"""

from collections.abc import Collection, Iterable, Mapping
from dataclasses import replace
from functools import partial
from typing import Any

import casadi as ca

from symfric.foundation.parameters import Variable
from symfric.foundation.symbols import symbols_of
from symfric.model import Model, Output


def rate_name(name: str) -> str:
    """What the rate of an input is called."""
    return f"{name}_rate"


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
    kept = model.memory.setdefault("ocp rates", {})
    key = tuple(nominal.items())
    if key not in kept:
        kept[key] = _with_rates(model, nominal)
    return kept[key]


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
    inputs = tuple(rates.get(v.name, v) for v in model.u)
    added = symbols_of(rates[v.name] for v in states)
    changes: dict[str, Any] = {"x": (*model.x, *states), "u": inputs}
    if model.contacts:
        changes["opening"] = partial(_open_with_rates, model, nominal)
    if model.holonomic is None and model.ode is not None:
        changes["ode"] = ca.vertcat(ca.SX(model.ode), added)
    mechanics = model.holonomic
    if mechanics is not None:
        inner = mechanics.inner
        if inner is not None:  # an unknown of its own, which no other equation makes
            inner = replace(inner, groups=(*inner.groups, symbols_of(states)))
        changes["holonomic"] = replace(
            mechanics, rates=ca.vertcat(mechanics.rates, added), inner=inner
        )
        changes |= {"ode": None, "alg": ca.SX(0, 1)}  # made of `holonomic` once more
    return replace(model, **changes)


def _open_with_rates(model: Model, nominal: Mapping[str, float]) -> Model:
    return with_rates(model.open, nominal)


def with_parameters(model: Model, units: Mapping[str, str]) -> Model:
    """`model` with further parameters (name -> unit) that none of its equations needs."""
    if not units:
        return model
    kept = model.memory.setdefault("ocp parameters", {})
    key = tuple(units.items())
    if key not in kept:
        added = tuple(Variable(name, unit) for name, unit in units.items())
        changes: dict[str, Any] = {"p": (*model.p, *added)}
        if model.holonomic is not None:
            changes |= {"ode": None, "alg": ca.SX(0, 1)}
        if model.contacts:
            changes["opening"] = partial(_open_with_parameters, model, units)
        kept[key] = replace(model, **changes)
    return kept[key]


def _open_with_parameters(model: Model, units: Mapping[str, str]) -> Model:
    return with_parameters(model.open, units)


def with_outputs(model: Model, names: Iterable[str]) -> Model:
    """`model` with some of its details as outputs, which solutions and simulations then show."""
    asked = tuple(name for name in dict.fromkeys(names) if name not in model.signals)
    if not asked:
        return model
    kept = model.memory.setdefault("ocp outputs", {})
    if asked not in kept:
        shown = {name: model.further[name] for name in asked}
        changes: dict[str, Any] = {
            "outputs": {**model.outputs, **shown},
            "details": partial(_details_without, model, asked),
        }
        if model.contacts:
            changes["opening"] = partial(_open_with_outputs, model, asked)
        if model.holonomic is not None:
            changes |= {"ode": None, "alg": ca.SX(0, 1)}
        kept[asked] = replace(model, **changes)
    return kept[asked]


def _details_without(model: Model, names: Collection[str]) -> dict[str, Output]:
    return {name: output for name, output in model.further.items() if name not in names}


def _open_with_outputs(model: Model, names: Iterable[str]) -> Model:
    return with_outputs(model.open, names)
