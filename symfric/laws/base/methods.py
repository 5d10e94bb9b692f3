"""Checks of the methods of a law, of its states, and of laws that users write."""

from collections.abc import Callable
from dataclasses import Field
from functools import wraps
from inspect import signature
from math import inf, isnan
from typing import Any

import casadi as ca
import numpy as np

from symfric.foundation import checks
from symfric.foundation.numeric import Scalar, is_casadi, is_number, is_symbolic
from symfric.foundation.symbolic import plain
from symfric.foundation.vector import VectorRows


def with_states(method: Callable[..., Any]) -> Callable[..., Any]:
    """Wrap `method(law, v, N, z)` so that it accepts states in any common form, with checks."""

    @wraps(method)
    def checked(law: Any, v: Scalar, N: Scalar, z: Scalar = (), *more: Any, **inputs: Any) -> Any:
        slip, load = plain(v), plain(N)
        for name, value in (("v", slip), ("N", load)):
            if type(value) is int and not is_number(value):
                where = f"{type(law).__name__}.{method.__name__}: {name}"
                raise checks.refused(where, "a number that a float can hold", value)
        states = states_of(law, slip, plain(z))
        if type(law).__module__.startswith("symfric."):
            return method(law, slip, load, states, *more, **inputs)
        where = f"{type(law).__name__}.{method.__name__}"
        try:
            value = method(law, slip, load, states, *more, **inputs)
        except (TypeError, ValueError, RuntimeError) as error:
            if not isinstance(slip, np.ndarray) and not _decides(error):
                raise
            raise _unsuitable(where, slip, error) from error
        if value is None or isinstance(value, list | tuple):
            raise _unsuitable(where, slip, value)
        if is_symbolic(slip) and isinstance(value, float) and isnan(value):
            hint = "math functions need numbers; write ca.tanh(v) instead of math.tanh(v)"
            raise checks.refused(where, "an expression of v", value, hint)
        if not is_casadi(value) or is_casadi(slip, load, states, *inputs.values()):
            return value
        shape = np.shape(slip) if method.__name__ == "force" else np.shape(states)
        if not isinstance(value, ca.DM) or value.numel() != np.prod(shape, dtype=int):
            raise _unsuitable(where, slip, value)
        return value.full().reshape(shape)[()]

    return checked


def _unsuitable(where: str, v: Scalar, got: object) -> ValueError:
    """Return the error for a method of a user's law that fails, or returns an unsuitable value."""
    if _decides(got):
        return ValueError(
            f"{where}: expected an expression, got a condition that Python evaluates (if, and, or, "
            "max, min, int); write smooth.choose(v > 0, a, b) of symfric.laws"
        )
    what, hint = "a force, or a column of rates", "write ca.vertcat(...) for several rates"
    if is_symbolic(got):
        what, hint = "a number for numbers", "declare the parameters of the law with param"
    if isinstance(v, np.ndarray) and not isinstance(got, list | tuple):
        what, hint = "an array for velocities in an array", "write it with symfric.laws.smooth"
    return checks.refused(where, what, got, hint)


def _decides(error: object) -> bool:
    """Return True if an error says that Python evaluates an expression to True or a count."""
    return "truth value" in str(error) or "to_int" in str(error)


def check_class(law: type) -> None:
    """Check the class of a law that a user writes.

    Raises:
        ValueError: the arguments of a method, a parameter with the name of a method, a bad velocity
            scale, or parameters that are not declared.
    """
    own, where = vars(law), law.__name__
    if law.__module__.startswith("symfric."):
        return
    fields = [name for name, value in own.items() if isinstance(value, Field)]
    fields = [name for name in fields if name not in getattr(law, "__dataclass_fields__", {})]
    if taken := [n for n in fields if any(n in vars(base) for base in law.__mro__[1:])]:
        raise checks.refused(where, "parameters without the names of methods", ", ".join(taken))
    for name in ("force", "rate"):
        if name in own:
            given = signature(own[name])
            try:
                given.bind(None, 0.0, 0.0, ())
                right = [*given.parameters][1:3] != ["N", "v"]
            except TypeError:
                right = False
            if not right:
                raise checks.refused(f"{where}.{name}", "arguments (self, v, N, z=())", f"{given}")
    if "__init__" in own:
        raise checks.refused(where, "parameters declared with param under @parametric", "__init__")
    scale = own.get("velocity_scale", 1.0)
    if not hasattr(scale, "__get__") and scale != inf:
        checks.number(f"{where}: velocity_scale", scale, unit="m/s", above=0.0)


def states_of(law: Any, v: Scalar, z: Scalar) -> Scalar:
    """Return `z` with one row for each state of `law`.

    If the law has one state, `z` may be a number, or an array of the shape of the velocities.
    """
    given = z
    if is_casadi(z):
        rows = z.shape[0] if z.numel() else 0  # a slice of a scalar has shape (1, 0)
    elif isinstance(z, VectorRows):
        return z
    elif is_number(z):
        z, rows = np.array([z], float), 1
    elif isinstance(z, tuple | list):
        rows = len(z)  # pyright: ignore[reportUnknownArgumentType]
    elif isinstance(z, np.ndarray):
        if z.ndim == 1 and z.size != 1 and np.shape(v) == z.shape and len(law.states) == 1:
            z = z[None]
        rows = z.shape[0]
    else:
        rows = -1
    known = law.states
    if rows == len(known):
        return z
    hint, what = "leave z out", "no states"
    if known:
        names = checks.listed(s.name for s in known)
        what = f"z with {len(known)} {'state' if len(known) == 1 else 'states'}, {names}"
        hint = "z = law.steady_state(v, N) gives those of steady sliding"
    got = "none" if rows == 0 else checks.shown(given)
    raise ValueError(f"{type(law).__name__}: expected {what}, got {got}; {hint}")
