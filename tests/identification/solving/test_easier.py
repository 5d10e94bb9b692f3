"""Starts far off reach the truth by way of windows, and only they go that way."""

import casadi as ca
import numpy as np
import pytest

from identification.data.dataset import Dataset
from identification.fit import Fit
from identification.residuals.shooting import Shooting
from identification.solving.descent import descend_easier_first
from symfric import Model, simulate
from symfric.foundation.parameters import Variable
from symfric.foundation.status import Status

Y, V = Variable("y", "m", start=1.0), Variable("v", "m/s")
W, D = (Variable(name, "1/s", start=x, lower=0.0) for name, x in (("w", 9.0), ("d", 0.2)))
SWING = Model(
    "swing",
    x=(Y, V),
    p=(W, D),
    ode=ca.vertcat(V.symbol, -(W.symbol**2) * Y.symbol - D.symbol * V.symbol),
)
T = np.linspace(0.0, 10.0, 501)
TRUTH = {"w": 9.0, "d": 0.02}


def asked() -> Fit:
    """Fourteen periods, from a frequency that is off by a quarter: many minima lie between."""
    y = simulate(SWING, 10.0, p=TRUTH, t_eval=T, rtol=1e-9)["y"]
    y = y + 1e-3 * np.random.default_rng(0).standard_normal(T.size)
    data = Dataset.of(t=T, y=y, units={"y": "m"})
    return Fit(Shooting(), SWING, data, start={"w": 7.0, "d": 0.01}, starts=2)


def test_a_start_far_off_needs_the_windows() -> None:
    prepared = asked().prepared()
    task, first = prepared.task, prepared.centre
    (easier,) = task.easier
    assert len(easier.unknowns.fitted) > len(task.unknowns.fitted)
    straight = descend_easier_first(task, first, 0, 200)
    around = descend_easier_first(task, first, 1, 200)
    assert around.status is Status.SOLVED
    assert task.unknowns.named(around.w)["w"] == pytest.approx(9.0, rel=1e-3)
    assert straight.objective > around.objective + 1000
