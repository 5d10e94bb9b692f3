"""SciPy's integrator as a judge that shares no code with ours, where it is installed."""

import warnings
from importlib.util import find_spec
from itertools import pairwise

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.integrator.equations.inputs import input_data
from symfric.stress.problem import Problem

Array = NDArray[np.float64]
RTOL = 1e-9
EVALUATIONS = 200_000
"""Calls of the equations, after which SciPy gives up."""


class TooManyError(Exception):
    """The equations were called too often."""


def by_scipy(ready: Problem) -> Array | None:
    """States over time by SciPy's LSODA, shape (nx, times); None where it cannot say.

    It takes ODEs without events, from start values that symfric gives too.
    """
    model, case = ready.model, ready.case
    if model.events or model.z or model.ode is None or find_spec("scipy") is None:
        return None
    from scipy.integrate import solve_ivp  # noqa: PLC0415  (not everybody has it)

    p = model.values("p", ready.p)
    ode, given = model.function("ode"), input_data(model, ready.inputs, case.t_start, case.t_end)
    force = ca.Function("u", [model.t, given.data], [given.expression])
    calls = 0
    x, times = model.initial_state(case.x0, ready.p), ready.times
    found = np.zeros((x.size, times.size))
    for k, (begin, end) in enumerate(pairwise(given.breaks)):

        def rate(t: float, y: Array, data: Array = given.values[:, k]) -> Array:
            nonlocal calls
            calls += 1
            if calls > EVALUATIONS:
                raise TooManyError
            return ode(t, y, [], force(t, data), p).full()[:, 0]

        here = (times >= begin) & (times <= end)
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # LSODA tells of each step that it repeats
                done = solve_ivp(
                    rate, (begin, end), x, method="LSODA", dense_output=True, rtol=RTOL,
                    atol=RTOL * 1e-3 * model.nominal("x"), max_step=(end - begin) / 200,
                )  # fmt: skip
        except TooManyError:
            return None
        if not done.success:
            return None
        x = done.y[:, -1]
        if here.any():
            found[:, here] = done.sol(times[here])
    return found
