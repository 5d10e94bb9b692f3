"""Events of algebraic variables, whose interpolants and equations differ by the tolerance."""

from math import asin, atan2, pi, sqrt

import casadi as ca
import numpy as np
import pytest
from backends import each_backend

from symfric import Event, Model, Variable, simulate

LEVELS = (-0.4, -0.35, -0.29, -0.22, -0.15, 0.05, 0.12, 0.21, 0.28, 0.35)
SPAN = 20.0


def watched() -> Model:
    """x'' = -x with z + 20 z^3 = 4 x, watched as z rises through `level`."""
    x, v = Variable("x", "1", start=0.1), Variable("v", "1", start=1.0)
    z, level = Variable("z", "1"), Variable("level", "1")
    return Model(
        "watched",
        x=(x, v),
        z=(z,),
        p=(level,),
        ode=ca.vertcat(v.symbol, -x.symbol),
        alg=z.symbol + 20 * z.symbol**3 - 4 * x.symbol,
        events=(Event("up", z.symbol - level.symbol, direction=1),),
    )


@pytest.mark.parametrize("rtol", [1e-6, 1e-8])
@each_backend
def test_each_passage_is_one_event(backend: str, rtol: float) -> None:
    """Behind an event z solves its equation exactly, and once was below the level again there."""
    model = watched()
    for level in LEVELS:
        run = simulate(model, SPAN, p={"level": level}, rtol=rtol, backend=backend)
        x, size = (level + 20 * level**3) / 4, sqrt(1.01)
        first = (asin(x / size) - atan2(0.1, 1.0)) % (2 * pi)  # x = size sin(t + atan2(0.1, 1))
        times = np.arange(first, SPAN, 2 * pi)
        assert [t for t, _ in run.happened] == pytest.approx(times, abs=30 * rtol)
