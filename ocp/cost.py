"""Costs as sums of integrals over the motion and values at its end."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import final

import casadi as ca

from symfric.foundation import checks
from symfric.foundation.numeric import Scalar
from symfric.foundation.parameters import check_names
from symfric.model import Model


@final
class Signals:
    """The symbols of a model by name: `s.force`, or `s["force"]`.

    Time `t`, states, algebraic variables, inputs, parameters and outputs.
    """

    def __init__(self, model: Model) -> None:
        groups = (model.x, model.z, model.u, model.p)
        self._model = model.name
        self._symbols = {"t": model.t} | {v.name: v.symbol for group in groups for v in group}
        self._symbols |= {name: ca.SX(o.expression) for name, o in model.outputs.items()}

    def __getitem__(self, name: str) -> ca.SX:
        check_names(f"cost of '{self._model}'", [name], self._symbols)
        return self._symbols[name]

    def __getattr__(self, name: str) -> ca.SX:
        if name.startswith("_"):
            raise AttributeError(name)
        return self[name]


Expression = Callable[[Signals], Scalar]
"""What to evaluate, such as `lambda s: s.force**2`."""


@final
@dataclass(frozen=True, eq=False)
class Cost:
    """Bolza cost J = integral over [0, T] of L dt + E at T; made by `integral` and `at_end`.

    Costs add up and take weights: `integral(lambda s: s.force**2) + 0.1 * TIME`. They know signals
    by name only, so one cost serves every model that has them.

    Attributes:
        running: the terms of L as (weight, expression).
        end: the terms of E as (weight, expression).
    """

    running: tuple[tuple[float, Expression], ...] = ()
    end: tuple[tuple[float, Expression], ...] = ()

    def __add__(self, other: object) -> "Cost":
        if not isinstance(other, Cost):
            return NotImplemented
        return Cost(self.running + other.running, self.end + other.end)

    def __mul__(self, weight: float) -> "Cost":
        weight = checks.number("cost: weight", weight)
        return Cost(
            tuple((weight * w, term) for w, term in self.running),
            tuple((weight * w, term) for w, term in self.end),
        )

    __rmul__ = __mul__

    def expressions(self, model: Model) -> tuple[ca.SX, ca.SX]:
        """L and E in the symbols of `model`, shape (1, 1) each.

        Raises:
            ValueError: a name the model does not have, or an expression that is not scalar.
        """
        signals = Signals(model)
        return _total(self.running, signals), _total(self.end, signals)


def _checked(where: str, expression: Expression) -> Expression:
    return checks.function(where, expression, "a function of the signals such as lambda s: s.x**2")


def integral(expression: Expression) -> Cost:
    """Cost: the integral over the motion, such as `integral(lambda s: s.force**2)`."""
    return Cost(running=((1.0, _checked("integral", expression)),))


def at_end(expression: Expression) -> Cost:
    """Cost: the value at the end, where `s.t` is the duration T."""
    return Cost(end=((1.0, _checked("at_end", expression)),))


TIME = at_end(lambda s: s.t)
"""The duration T [s] as a cost."""


def _value(term: Expression, signals: Signals) -> ca.SX:
    """The expression that `term` makes of the signals."""
    what = "a function of the signals that returns one expression, such as lambda s: s.x**2"
    try:
        value = checks.expression("cost", term(signals))
    except (TypeError, ArithmeticError, RuntimeError, NotImplementedError) as error:
        raise checks.refused(
            "cost", what, error, "write casadi functions for those of math"
        ) from error
    if ca.SX(value).numel() != 1:
        raise checks.refused("cost", what, value)
    return ca.SX(value)


def _total(terms: tuple[tuple[float, Expression], ...], signals: Signals) -> ca.SX:
    total = ca.SX(0)
    for weight, term in terms:
        value = _value(term, signals)
        total += weight * value
    return total
