"""Checks of the arguments and values of the methods of laws."""

from collections.abc import Callable
from functools import wraps
from typing import Any

import numpy as np

from symfric.foundation import checks
from symfric.foundation.numeric import Scalar, is_casadi, is_number
from symfric.foundation.symbolic import plain
from symfric.foundation.vector import Rows


def with_states(method: Callable[..., Any]) -> Callable[..., Any]:
    """Wrap `method(law, v, N, z)` so that it accepts and checks states in any common form.

    Raises:
        ValueError: the number of states is wrong, an integer is too large for a float, or the
            method of a user's law fails or returns an unsuitable value.
    """

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
            if not isinstance(slip, np.ndarray) and "truth value" not in str(error):
                raise
            raise _unsuitable(where, slip, error) from error
        arguments = is_casadi(slip, load, states, *inputs.values())
        if isinstance(value, list | tuple) or (is_casadi(value) and not arguments):
            raise _unsuitable(where, slip, value)
        return value

    return checked


def _unsuitable(where: str, v: Scalar, got: object) -> ValueError:
    """Return the error for a method of a user's law that fails, or returns an unsuitable value."""
    if "truth value" in str(got):
        return ValueError(
            f"{where}: expected an expression, got a condition that Python evaluates (if, and, or, "
            "max, min); write smooth.choose(v > 0, a, b) of symfric.laws"
        )
    what, hint = "a force, or a column of rates", ""
    if isinstance(got, list | tuple):
        hint = "write ca.vertcat(...) for several rates"
    elif isinstance(v, np.ndarray):
        what, hint = "an array for velocities in an array", "write it with symfric.laws.smooth"
    return checks.refused(where, what, got, hint)


def states_of(law: Any, v: Scalar, z: Scalar) -> Scalar:
    """Return `z` with one row for each state of `law`.

    If the law has one state, `z` may be a number, or an array of the shape of the velocities.
    """
    given = z
    if is_casadi(z):
        rows = z.shape[0] if z.numel() else 0  # a slice of a scalar has shape (1, 0)
    elif isinstance(z, Rows):
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
