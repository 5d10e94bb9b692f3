"""Comparisons between SX expressions as rows: what lambdas of `path` and `joins` return."""

from collections.abc import Callable, Iterator
from math import inf, isfinite
from typing import Any

import casadi as ca

from ocp.text.expressions import BRANCH, MATH, called, constants
from symfric.foundation import checks

WHAT = "a comparison such as lambda s: s.tip_z <= 0.9"

Comparison = tuple[ca.SX, float, float]
"""(expression, lower, upper)."""


def comparisons(where: str, function: Callable[..., Any], *signals: Any) -> list[Comparison]:
    """Rows of what `function` returns: `a <= b`, `a >= b` or `a == b` of SX.

    Columns are compared row by row, and `ca.logic_and(a, b)` of comparisons is both of them.

    Raises:
        ValueError: no comparison, or one that is always true or false.
    """
    checks.function(where, function, "a function of the signals that returns " + WHAT)
    found = called(where, function, *signals, what=WHAT)
    if isinstance(found, bool):
        raise checks.refused(where, WHAT, found, f"Python compared numbers; {MATH}; {BRANCH}")
    if not isinstance(found, ca.SX):
        raise checks.refused(where, WHAT, found)
    return [row for each in ca.vertsplit(ca.vec(found)) for row in _rows(where, each)]


def _rows(where: str, condition: ca.SX) -> Iterator[Comparison]:
    if condition.is_constant():
        always = "true" if float(ca.DM(condition)) else "false"
        raise ValueError(
            f"{where}: expected a comparison that depends on the motion, got one that is always "
            f"{always}"
        )
    kind = condition.op()
    if kind == ca.OP_AND:
        for part in (condition.dep(0), condition.dep(1)):
            yield from _rows(where, part)
        return
    if kind not in (ca.OP_LE, ca.OP_LT, ca.OP_EQ):
        raise checks.refused(where, WHAT, condition, "write <=, >= or == between two expressions")
    left, right = condition.dep(0), condition.dep(1)
    yield _sorted(where, left, right, equal=kind == ca.OP_EQ)


def _sorted(where: str, left: ca.SX, right: ca.SX, *, equal: bool) -> Comparison:
    """Left <= right, or ==, with numbers moved to the bounds."""
    numbers = [float(ca.DM(side)) if side.is_constant() else None for side in (left, right)]
    for number in (*numbers, *constants(ca.vertcat(left, right))):
        if number is not None and not isfinite(number):
            raise ValueError(f"{where}: expected finite numbers, got {number}; {MATH}")
    low, high = numbers
    if high is not None:
        if left.op() == ca.OP_FABS and not equal:  # its kink at zero is none of the range
            return left.dep(0), -high, high
        return left, (high if equal else -inf), high
    if low is not None:
        return right, low, (low if equal else inf)
    return left - right, (0.0 if equal else -inf), 0.0
