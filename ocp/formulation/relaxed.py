"""Conditions with a penalty, and conditions of which at most one side is nonzero.

    soft            lower <= e - s <= upper,   cost += integral of linear |s| + quadratic s^2
    complementary   0 <= a,   0 <= b,   a b <= eps size

`Problem.path`, `Phase.path` and `Phase.at` accept both forms among their functions.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, final

import casadi as ca

from ocp.formulation.expressions import Expression, Signals, value_of
from symfric.foundation import checks


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
