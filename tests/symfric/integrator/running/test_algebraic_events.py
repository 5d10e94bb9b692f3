"""Events of algebraic variables, whose interpolants and equations differ by the tolerance."""

from math import asin, atan2, pi, sqrt

import casadi as ca
import numpy as np
import pytest
from backends import each_backend, needs_compiler

from symfric import Event, Model, Variable, simulate
from symfric.integrator.equations.inputs import input_data
from symfric.integrator.methods.tableaux import RODAS5P
from symfric.integrator.running.integrator import Integrator
from symfric.integrator.running.run import Tolerances, integrate

LEVELS = (-0.4, -0.35, -0.29, -0.22, -0.15, 0.05, 0.12, 0.21, 0.28, 0.35)
SPAN = 20.0


def watched(form: str) -> Model:
    """x'' = -x with z + 20 z^3 = 4 x, watched as z rises through `level`."""
    x, v = Variable("x", "1", start=0.1), Variable("v", "1", start=1.0)
    z, level = Variable("z", "1"), Variable("level", "1")
    rates = ca.SX.sym("rates", 2)
    factor = 1 + x.symbol**2 if form == "changing masses" else 1.0
    equations = ca.vertcat(
        factor * (rates[0] - v.symbol),
        factor * (rates[1] + x.symbol),
        z.symbol + 20 * z.symbol**3 - 4 * x.symbol,
    )
    if form != "explicit":
        return Model(
            "watched",
            x=(x, v),
            z=(z,),
            p=(level,),
            xdot=rates,
            residual=equations,
            events=(Event("up", z.symbol - level.symbol, direction=1),),
        )
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
@pytest.mark.parametrize("form", ["explicit", "implicit", "changing masses"])
@each_backend
def test_each_passage_is_one_event(backend: str, form: str, rtol: float) -> None:
    """Behind an event z solves its equation exactly, and once was below the level again there."""
    model = watched(form)
    for level in LEVELS:
        run = simulate(model, SPAN, p={"level": level}, rtol=rtol, backend=backend)
        x, size = (level + 20 * level**3) / 4, sqrt(1.01)
        first = (asin(x / size) - atan2(0.1, 1.0)) % (2 * pi)  # x = size sin(t + atan2(0.1, 1))
        times = np.arange(first, SPAN, 2 * pi)
        assert [t for t, _ in run.happened] == pytest.approx(times, abs=30 * rtol)


@needs_compiler
def test_engines_tell_the_same_of_unknowns_around_an_event() -> None:
    """Behind it those that follow are known; before it they are as the step has them."""
    model = watched("explicit")
    inputs = input_data(model, None, 0.0, SPAN)
    allowed = Tolerances(1e-6, np.full(2, 1e-7), 1e-10, 10_000)
    y0, p = np.array([0.1, 1.0, 0.3]), np.array([0.12])
    runs = [
        integrate(Integrator(model, inputs, RODAS5P), inputs, y0, p, allowed, backend, None)[0]
        for backend in ("vm", "compiled")
    ]
    one, other = (run.jumps for run in runs)
    assert sum(part.t.size for part in one) == 3
    for name in ("step", "t", "size", "before", "after", "which"):
        a, b = (np.concatenate([getattr(part, name) for part in jumps]) for jumps in (one, other))
        assert (a == b).all(), name


def test_events_of_coupled_variables_grow_with_their_number() -> None:
    """Without the zeros of their equations: by a QR factorisation their length went with n^2."""

    def length(n: int) -> int:
        x, z = Variable("x", "1"), [Variable(f"z_{i}", "1") for i in range(n)]
        own = [x.symbol, *(v.symbol for v in z), 0.0]
        equations = [own[i] - 3 * own[i + 1] - own[i + 1] ** 3 + own[i + 2] for i in range(n)]
        events = (Event("up", z[n // 2].symbol - 0.1),)
        model = Model(
            "chain", x=(x,), z=tuple(z), ode=ca.SX(1), alg=ca.vertcat(*equations), events=events
        )
        data = input_data(model, None, 0.0, 1.0)
        return int(Integrator(model, data, RODAS5P).events.n_instructions())

    assert length(40) < 2.5 * length(20)
