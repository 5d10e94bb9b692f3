"""Comparisons between SX expressions as rows: what lambdas of `path` and `joins` return."""

from collections.abc import Callable, Iterator
from math import inf, isfinite
from typing import Any

import casadi as ca

from ocp.formulation.expressions import BRANCH, MATH, called, constants
from symfric.foundation import checks

COMPARISON = "a comparison such as lambda s: s.tip_z <= 0.9"

Comparison = tuple[ca.SX, float, float]
"""(expression, lower, upper)."""


def comparisons(function: Callable[..., Any], *signals: Any) -> list[Comparison]:
    """Rows of what `function` returns: `a <= b`, `a >= b` or `a == b` of SX.

    Columns are compared row by row, `ca.logic_and(a, b)` of comparisons is both of them, and
    `abs(a) <= number` is a range without a kink.

    Raises:
        ValueError: no comparison, or one that is always true or false.
    """
    found = called(function, *signals, what=COMPARISON)
    if isinstance(found, bool):
        raise ValueError(
            f"expected {COMPARISON}, got {found}: Python compared numbers; {MATH}; {BRANCH}"
        )
    if not isinstance(found, ca.SX) or found.is_empty():
        raise ValueError(f"expected {COMPARISON}, got {checks.shown(found)}")
    return [row for each in ca.vertsplit(ca.vec(found)) for row in _rows(each)]


def _rows(condition: ca.SX) -> Iterator[Comparison]:
    if condition.is_constant():
        always = "true" if float(ca.DM(condition)) else "false"
        raise ValueError(
            f"expected a comparison that depends on the motion, got one that is always {always}"
        )
    kind = condition.op()
    if kind == ca.OP_AND:
        for part in (condition.dep(0), condition.dep(1)):
            yield from _rows(part)
    elif kind in (ca.OP_LE, ca.OP_LT, ca.OP_EQ):
        yield _sorted(condition.dep(0), condition.dep(1), equal=kind == ca.OP_EQ)
    else:
        raise ValueError(
            f"expected {COMPARISON}, got {checks.shown(condition)}; write <=, >= or == between two "
            "expressions"
        )


def _sorted(left: ca.SX, right: ca.SX, *, equal: bool) -> Comparison:
    """Left <= right, or ==, with numbers moved to the bounds."""
    for number in constants(ca.vertcat(left, right)):
        if not isfinite(number):
            raise ValueError(f"expected finite numbers, got {number}; {MATH}")
    if right.is_constant():
        high = float(ca.DM(right))
        if left.op() == ca.OP_FABS and not equal:
            return left.dep(0), -high, high
        return left, (high if equal else -inf), high
    if left.is_constant():
        low = float(ca.DM(left))
        return right, low, (low if equal else inf)
    return left - right, (0.0 if equal else -inf), 0.0
