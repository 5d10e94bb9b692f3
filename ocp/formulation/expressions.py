"""What a function of the user makes of signals: one SX expression, or a message that helps."""

from collections.abc import Callable, Iterator
from math import isfinite, isnan
from typing import Any

import casadi as ca

from symfric.foundation import checks

EXPRESSION = "one expression of the signals, such as lambda s: s.x**2"
MATH = "write casadi functions for those of math: ca.sin, ca.sqrt, ca.fmax"
BRANCH = "expressions have no truth value: no if, and, max or a <= x <= b in here"


def called(function: Callable[..., Any], *signals: Any, what: str) -> Any:
    """What `function` returns; what CasADi and Python refuse becomes a `ValueError`.

    Raises:
        ValueError: the function asks for what does not exist or cannot be done.
    """
    try:
        return function(*signals)
    except (TypeError, ArithmeticError, AttributeError, RuntimeError) as error:
        text = str(error)
        plain = "argument" in text or isinstance(error, AttributeError)
        hint = BRANCH if "truth value" in text else "" if plain else MATH
        raise ValueError(
            f"expected {what}, got {type(error).__name__}: {_short(text)}"
            + f"; {hint}" * bool(hint)
        ) from error


def value_of(function: Callable[..., Any], *signals: Any) -> ca.SX:
    """The one expression that `function` makes of the signals, SX (1, 1).

    Raises:
        ValueError: no expression, several, or one that is not a number from the start (NaN).
    """
    found = called(function, *signals, what=EXPRESSION)
    if isinstance(found, float) and isnan(found):
        raise _refused(found, MATH)
    if isinstance(found, ca.MX) or (
        checks.as_number(found) is None and not isinstance(found, ca.SX | ca.DM)
    ):
        raise _refused(found, "write it with casadi.SX" if isinstance(found, ca.MX) else "")
    value = ca.SX(found)
    if value.numel() != 1:
        raise _refused(found)
    odd = [number for number in constants(value) if not isfinite(number)]
    if odd:
        raise _refused(found, f"it holds {odd[0]}" + f"; {MATH}" * isnan(odd[0]))
    return value


def constants(expression: ca.SX) -> Iterator[float]:
    """Numbers that stand in `expression`."""
    f = ca.Function("f", ca.symvar(expression), [expression])
    for k in range(f.n_instructions()):
        if f.instruction_id(k) == ca.OP_CONST:
            yield float(f.instruction_constant(k))


def _refused(found: object, hint: str = "") -> ValueError:
    text = f"expected {EXPRESSION}, got {checks.shown(found)}"
    return ValueError(text + f"; {hint}" * bool(hint))


def _short(text: str) -> str:
    """The last line of what CasADi or Python says, without the place in its source."""
    last = text.strip().splitlines()[-1].rstrip(".")
    return last.split(": ", 1)[-1] if ".cpp:" in last else last
