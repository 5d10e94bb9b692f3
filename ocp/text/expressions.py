"""What a lambda makes of signals: one SX expression, or a message that helps."""

from collections.abc import Callable, Iterator
from math import isnan
from typing import Any

import casadi as ca

from symfric.foundation import checks

MATH = "write casadi functions for those of math: ca.sin, ca.sqrt, ca.fmax"
BRANCH = "casadi expressions have no truth value: no if, and, max or a <= x <= b in here"


def called(where: str, function: Callable[..., Any], *signals: Any, what: str) -> Any:
    """What `function` returns; whatever else it raises becomes a `ValueError`.

    Raises:
        ValueError: what the function asks for does not exist or cannot be done.
    """
    try:
        return function(*signals)
    except (TypeError, ArithmeticError, RuntimeError, NotImplementedError, AttributeError) as error:
        hint = BRANCH if "truth value" in str(error) else MATH
        raise checks.refused(where, what, _short(error), hint) from error


def value_of(where: str, function: Callable[..., Any], *signals: Any) -> ca.SX:
    """The one expression that `function` makes of the signals, SX (1, 1).

    Raises:
        ValueError: no expression, several, or one that is not a number from the start (NaN).
    """
    what = "a function of the signals that returns one expression, such as lambda s: s.x**2"
    found = called(where, function, *signals, what=what)
    if isinstance(found, float) and isnan(found):
        raise checks.refused(where, what, found, MATH)
    value = ca.SX(checks.expression(where, found))
    if value.numel() != 1:
        raise checks.refused(where, what, found)
    if any(map(isnan, constants(value))):
        raise checks.refused(where, what, found, f"it holds a NaN; {MATH}")
    return value


def constants(expression: ca.SX) -> Iterator[float]:
    """Numbers that stand in `expression`."""
    f = ca.Function("f", ca.symvar(expression), [expression])
    for k in range(f.n_instructions()):
        if f.instruction_id(k) == ca.OP_CONST:
            yield float(f.instruction_constant(k))


def _short(error: Exception) -> str:
    """The last sentence of what CasADi or Python says."""
    return str(error).strip().splitlines()[-1].split(".cpp:")[-1].split(": ", 1)[-1]
