"""Check of the period of inputs and of equations that depend on time."""

from collections.abc import Mapping
from typing import Any

import casadi as ca
import numpy as np

from symfric.foundation import checks
from symfric.integrator.equations.inputs import Input
from symfric.model import Model

REPEATED, SAMPLES = 1e-6, 100
"""Largest difference after a period, relative to the range of values, and number of samples."""


def check_period(
    model: Model, u: Mapping[str, Input], p: Mapping[str, float], period: float | None
) -> None:
    """Check a period [s] of inputs and equations at constant states; samples are not compared.

    Raises:
        ValueError: a missing period, or a time after which the values do not repeat.
    """
    where = "periodic_orbit: period"
    moving = [name for name, x in u.items() if checks.as_number(x) is None]
    if period is None and moving:
        raise checks.refused(
            where, f"the period [s] of the input {moving[0]}", None, "give period="
        )
    ode: Any = model.ode
    rates = ca.vertcat(ode, *(x(model.t) for x in u.values() if callable(x)))
    if not ca.depends_on(rates, model.t):
        return
    if period is None:
        raise checks.refused(where, "the period [s] of the equations", None, "give period=")
    f = ca.Function("rates", [model.t, *map(model.vector, "xzup")], [rates])
    values = model.values("p", p)
    fixed = model.started(None, values, 0.0), model.nominal("z"), model.values("u", None), values
    times = period * (np.arange(2 * SAMPLES) + 1 / np.pi) / SAMPLES
    rows = np.hstack([f(t, *fixed).full() for t in times])
    off = np.abs(rows[:, :SAMPLES] - rows[:, SAMPLES:]).max(axis=1)
    if (off > REPEATED * np.ptp(rows, axis=1) + 1e-12 * np.abs(rows).max(axis=1)).any():
        raise checks.refused(where, "a period [s] of the inputs and of the equations", period)
