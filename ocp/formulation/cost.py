"""Costs as sums of integrals over the motion and values at its end."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import final

import casadi as ca

from ocp.formulation.expressions import value_of
from ocp.formulation.signals import Signals
from symfric.foundation import checks
from symfric.foundation.numeric import Scalar
from symfric.model import Model

Expression = Callable[[Signals], Scalar]
"""What to evaluate, such as `lambda s: s.force**2`."""

Terms = tuple[tuple[float, Expression], ...]


@final
@dataclass(frozen=True, eq=False)
class Cost:
    """Bolza cost J = integral of (L + sum_i w_i r_i^2) dt + E at the end.

    Costs add up and take weights: `integral(lambda s: s.force**2) + 0.1 * TIME`; what is to be
    large gets a negative one: `-at_end(lambda s: s.height)`. They know signals
    by name only, so one cost serves every model that has them.

    Attributes:
        running: the terms of L as (weight, expression).
        end: the terms of E as (weight, expression).
        squares: (w_i, r_i) of `track` and `effort`, kept apart for Gauss-Newton methods.
        references: names that `track` follows.
        largest: whether the largest of all scenarios counts, and not their mean; see `worst`.
    """

    running: Terms = ()
    end: Terms = ()
    squares: Terms = ()
    references: tuple[str, ...] = ()
    largest: bool = False

    def __add__(self, other: object) -> "Cost":
        if not isinstance(other, Cost):
            return NotImplemented
        if self.largest or other.largest:
            raise ValueError(
                "cost: expected worst(...) round the whole cost, got it added to another; write "
                "worst(a + b)"
            )
        return Cost(
            self.running + other.running,
            self.end + other.end,
            self.squares + other.squares,
            tuple(dict.fromkeys(self.references + other.references)),
        )

    def __mul__(self, weight: float) -> "Cost":
        weight = checks.number("cost: weight", weight)
        if self.largest and weight < 0:
            raise ValueError(f"cost: expected a weight >= 0 of worst(...), got {weight:g}")

        def scaled(terms: Terms) -> Terms:
            return tuple((weight * w, term) for w, term in terms)

        return replace(
            self,
            running=scaled(self.running),
            end=scaled(self.end),
            squares=scaled(self.squares),
        )

    __rmul__ = __mul__

    def __radd__(self, other: object) -> "Cost":
        return self if other == 0 else NotImplemented  # where `sum` begins

    def __neg__(self) -> "Cost":
        return -1.0 * self

    def __sub__(self, other: object) -> "Cost":
        return self + (-other) if isinstance(other, Cost) else NotImplemented

    def __truediv__(self, weight: float) -> "Cost":
        weight = checks.number("cost: divisor", weight)
        if weight == 0:
            raise ValueError("cost: expected a divisor that is not zero, got 0")
        return self * (1.0 / weight)

    def expressions(self, model: Model, signals: Signals | None = None) -> tuple[ca.SX, ca.SX]:
        """Integrand, squares included, and end value in the symbols of `model`, (1, 1) each.

        `signals` are those of the model, where somebody wants to know what was asked of them.

        Raises:
            ValueError: a name the model does not have, or an expression that is not scalar.
        """
        signals = Signals(model) if signals is None else signals
        running = _total(self.running, signals)
        for weight, residual in self.residuals(model, signals):
            running += weight * residual**2
        return running, _total(self.end, signals)

    def residuals(
        self, model: Model, signals: Signals | None = None
    ) -> tuple[tuple[float, ca.SX], ...]:
        """(weight, residual) of the squares in the symbols of `model`."""
        signals = Signals(model) if signals is None else signals
        return tuple((weight, value_of(term, signals)) for weight, term in self.squares)


def _checked(where: str, expression: Expression) -> Expression:
    return checks.function(where, expression, "a function of the signals such as lambda s: s.x**2")


def integral(expression: Expression) -> Cost:
    """Cost: the integral over the motion, such as `integral(lambda s: s.force**2)`."""
    return Cost(running=((1.0, _checked("integral", expression)),))


def at_end(expression: Expression) -> Cost:
    """Cost: the value at the end, where `s.t` is the time since the start of the problem."""
    return Cost(end=((1.0, _checked("at_end", expression)),))


TIME = at_end(lambda s: s.t)
"""The duration [s] as a cost: the sum over all phases."""


def track(name: str, reference: float | str | Expression, weight: float) -> Cost:
    """Cost: the integral of weight (signal - reference)^2.

    Args:
        name: the signal that follows.
        reference: a number; a function of the signals, such as `lambda s: 0.1 * ca.sin(s.t)`; or
            the name of a parameter or signal. A name that no model has becomes a parameter of the
            problem, whose value stands in `p`: the goal of a controller.
        weight: above zero.
    """
    name = checks.text("track", name, "the name of a signal")
    weight = checks.number("track: weight", weight, above=0.0)
    if isinstance(reference, str):
        goal = checks.text("track: reference", reference, "a name, a number or a function")
        return Cost(squares=((weight, lambda s: s[name] - s[goal]),), references=(goal,))
    if callable(reference):
        follow = _checked("track: reference", reference)
        return Cost(squares=((weight, lambda s: s[name] - follow(s)),))
    number = checks.number("track: reference", reference, hint="or a function, or a name")
    return Cost(squares=((weight, lambda s: s[name] - number),))


def effort(name: str, weight: float = 1.0) -> Cost:
    """Cost: the integral of weight signal^2."""
    return track(name, 0.0, weight)


def worst(cost: Cost) -> Cost:
    """The largest `cost` of all scenarios, in place of their mean."""
    such = "a cost made of integral(...), at_end(...) and TIME"
    return replace(checks.kind("worst", cost, Cost, such), largest=True)


def _total(terms: Terms, signals: Signals) -> ca.SX:
    total = ca.SX(0)
    for weight, term in terms:
        total += weight * value_of(term, signals)
    return total
