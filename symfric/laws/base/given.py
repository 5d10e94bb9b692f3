"""The states that a law is given: a number where there is one, and as many as it has."""

from collections.abc import Callable
from functools import wraps
from typing import TYPE_CHECKING, Any

import numpy as np

from symfric.foundation import checks
from symfric.foundation.numeric import Scalar, is_casadi, is_number
from symfric.foundation.symbolic import plain
from symfric.foundation.vector import Rows

if TYPE_CHECKING:
    from symfric.laws.base.law import Law


def with_states(method: Callable[..., Any]) -> Callable[..., Any]:
    """`method(law, v, N, z)` that takes states as people have them, and refuses others.

    Raises:
        ValueError: another number of states than the law has; an integer that no float holds.
    """

    @wraps(method)
    def checked(law: "Law", v: Scalar, N: Scalar, z: Scalar = (), *more: Any, **inputs: Any) -> Any:
        slip, load = plain(v), plain(N)
        for name, value in (("v", slip), ("N", load)):
            if type(value) is int and not is_number(value):
                where = f"{type(law).__name__}.{method.__name__}: {name}"
                raise checks.refused(where, "a number that a float can hold", value)
        return method(law, slip, load, states_of(law, slip, plain(z)), *more, **inputs)

    return checked


def states_of(law: "Law", v: Scalar, z: Scalar) -> Scalar:
    """`z` with a row for each state of `law`.

    Of a law of one state a number is its row, and so is an array beside one of velocities.
    """
    given = z
    if is_casadi(z):
        rows = z.shape[0] if z.numel() else 0  # what is cut of a scalar has shape (1, 0)
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
    if rows != len(law.states):
        raise _refused(law, given, rows)
    return z


def _refused(law: "Law", z: Scalar, rows: int) -> ValueError:
    name, known = type(law).__name__, law.states
    if not known:
        hint, what = "leave z out", "no states"
    else:
        names = checks.listed(s.name for s in known)
        what = f"z with {len(known)} {'state' if len(known) == 1 else 'states'}, {names}"
        hint = "z = law.steady_state(v, N) are those of steady sliding"
    got = "none" if rows == 0 else checks.shown(z)
    return ValueError(f"{name}: expected {what}, got {got}; {hint}")
