"""Checks of laws that users write."""

from collections.abc import Callable
from dataclasses import Field
from functools import wraps
from inspect import signature
from math import inf, isnan
from typing import Any

import casadi as ca
import numpy as np

from symfric.foundation import checks
from symfric.foundation.numeric import Scalar, is_casadi, is_symbolic
from symfric.foundation.symbolic import plain

ARGUMENTS = {
    "force": "self, v, N, z=()",
    "rate": "self, v, N, z=()",
    "outside": "self, speed, N",
    "steady_state": "self, v, N",
}
"""Arguments of the methods that a law may define."""


def check_class(law: type) -> None:
    """Check the class of a law that a user writes.

    Raises:
        ValueError: the arguments of a method, a parameter with the name of a method, a bad velocity
            scale, or parameters that are not declared.
    """
    own, where = vars(law), law.__name__
    fields = [name for name, value in own.items() if isinstance(value, Field)]
    fields = [name for name in fields if name not in getattr(law, "__dataclass_fields__", {})]
    if taken := [n for n in fields if any(n in vars(base) for base in law.__mro__[1:])]:
        raise checks.refused(where, "parameters without the names of methods", ", ".join(taken))
    for name in own.keys() & ARGUMENTS.keys():
        wanted = ARGUMENTS[name]
        given: Any = signature(own[name]) if callable(own[name]) else own[name]
        if not _takes(given, wanted):
            raise checks.refused(f"{where}.{name}", f"a method ({wanted})", f"{given}")
    if "__init__" in own:
        raise checks.refused(where, "parameters declared with param under @parametric", "__init__")
    scale = own.get("velocity_scale", 1.0)
    if not hasattr(scale, "__get__") and scale != inf:
        checks.number(f"{where}: velocity_scale", scale, unit="m/s", above=0.0)


def _takes(given: Any, wanted: str) -> bool:
    """Return True if a signature accepts the arguments `wanted`, with v before N."""
    try:
        given.bind(*wanted.split(", "))
    except (AttributeError, TypeError):
        return False
    return [*given.parameters][1:3] != ["N", "v"]


def with_checks(method: Callable[..., Any]) -> Callable[..., Any]:
    """Wrap the method `outside(law, speed, N)` of a user's law so that its result is checked."""

    @wraps(method)
    def checked(law: Any, speed: Scalar, N: Scalar, **inputs: Any) -> Any:
        return called(method, law, (plain(speed), plain(N)), inputs, speed)

    return checked


def called(
    method: Callable[..., Any], law: Any, arguments: tuple[Any, ...], inputs: dict[str, Any],
    like: Scalar,
) -> Any:  # fmt: skip
    """Return the result of a method of a user's law; if it is an array, in the shape of `like`."""
    where, v = f"{type(law).__name__}.{method.__name__}", arguments[0]
    try:
        value: Any = method(law, *arguments, **inputs)
    except (ArithmeticError, IndexError, TypeError, ValueError, RuntimeError) as error:
        if not isinstance(v, np.ndarray) and not any(text in str(error) for text in KNOWN):
            raise
        raise _unsuitable(where, v, error) from error
    if value is None or isinstance(value, list | tuple) or getattr(value, "dtype", "") == "O":
        raise _unsuitable(where, v, value)
    if is_symbolic(v) and isinstance(value, float) and isnan(value):
        hint = "math functions need numbers; write ca.tanh(v) instead of math.tanh(v)"
        raise checks.refused(where, "an expression of v", value, hint)
    if is_casadi(*arguments, *inputs.values()):
        rows: Any = getattr(value, "shape", ())[:1]
        if method.__name__ == "rate" and rows not in ((), (len(law.states),)):
            raise checks.refused(where, f"as many rates as states, {len(law.states)}", rows[0])
        return value
    shape = np.shape(like)
    if isinstance(value, ca.DM) and value.numel() == np.prod(shape, dtype=int):
        value = value.full()
    if is_casadi(value):
        raise _unsuitable(where, v, value)
    same = np.size(value) == np.prod(shape, dtype=int)
    return np.reshape(value, shape)[()] if same else value


KNOWN = ("truth value", "to_int", "out of bounds", "division by zero")
"""Parts of errors of Python and CasADi that methods raise for symbols."""


def _unsuitable(where: str, v: Scalar, got: object) -> ValueError:
    """Return the error for a method of a user's law that fails, or returns an unsuitable value."""
    text = str(got)
    if "truth value" in text or "to_int" in text:
        return ValueError(
            f"{where}: expected an expression, got a condition that Python evaluates (if, and, or, "
            "max, min, int); write smooth.choose(v > 0, a, b) of symfric.laws"
        )
    if "out of bounds" in text:
        return ValueError(f"{where}: expected z[k] of the states of the law only; check k")
    what, hint = "a force, or a column of rates", "write ca.vertcat(...) for several rates"
    if is_symbolic(got):
        what, hint = "a number for numbers", "declare the parameters of the law with param"
    if "division by zero" in text:
        what, hint = "a finite force", "sliding forces are evaluated at rest, too"
    elif isinstance(v, np.ndarray) and not isinstance(got, list | tuple):
        what, hint = "an array for velocities in an array", "write it with symfric.laws.smooth"
    return checks.refused(where, what, got, hint)
