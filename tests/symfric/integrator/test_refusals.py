"""Invalid arguments of simulations, ensembles, plants, flows and inputs: one table of calls."""

import math
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
from differentiable import oscillator
from refusing import not_refused

import symfric as sf
from symfric import Event, Model, Variable, integrator, simulate

X = Variable("x", "m", start=1.0)
FALLING = Model("falling", x=(X,), ode=ca.SX(-1.0), events=(Event("ground", X.symbol),))


class Source:
    """An input as an object."""

    def __init__(self, size: float) -> None:
        self.size = size

    def __call__(self, t: ca.SX) -> ca.SX:
        return self.size * t


def test_bad_arguments_are_refused_in_a_sentence() -> None:
    cart, swing = sf.drive(sf.Viscous()), oscillator()
    plain, run = (simulate(swing, 2.0, samples=5, sensitivities=s) for s in ([], ["k"]))

    def pushed(force: Any) -> object:
        return simulate(cart, 1.0, u={"force": force}, backend="vm")

    wrong = not_refused(
        Path(__file__).with_name("refusals.toml"), sf, integrator, cart=cart, swing=swing,
        belt=sf.rabinowicz(sf.Viscous(), free=["m"]), falling=FALLING, plain=plain, run=run,
        pushed=pushed, Source=Source, math=math,
    )  # fmt: skip
    assert wrong == []


def test_bounds_of_a_parameter_are_allowed_themselves() -> None:
    k = Variable("k", "1/s", start=0.5, lower=0.0, upper=1.0)
    model = Model("bounded", x=(X,), p=(k,), ode=-k.symbol * X.symbol)
    assert simulate(model, 1.0, p={"k": 0.0}).final["x"] == 1.0
    many = integrator.simulate_many(model, 1.0, p={"k": np.array([0.0, 1.0])})
    assert many["x"][0, -1] == 1.0
