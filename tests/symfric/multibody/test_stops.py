"""Stops of joints against the closed form of an impact, and the energy."""

from math import log1p, sqrt

import numpy as np
import pytest
from scipy.optimize import brentq

from symfric import simulate
from symfric.multibody import JointStop, Mechanism, Prismatic

CASES = [(2.0, 1e4, 0.0, 1.0), (2.0, 1e4, 0.4, 1.5), (1e-3, 30.0, 2.0, 0.1), (500.0, 1e7, 0.9, 3.0)]


def rebound(e: float, v: float) -> float:
    """The speed after an impact, from the integral of m v dv = -k d (1 + e v) dd."""
    if e == 0:
        return v
    lost = e * v - log1p(e * v)
    return brentq(lambda u: -e * u - log1p(-e * u) - lost, 0.0, (1 - 1e-12) / e, xtol=1e-14)


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize(("mass", "k", "e", "v"), CASES)
def test_a_mass_rebounds_at_the_speed_of_the_closed_form(
    mass: float, k: float, e: float, v: float, side: int
) -> None:
    m = Mechanism("puck", gravity=(0.0, 0.0, 0.0))
    m.body("puck", mass, (1.0, 1.0, 1.0))
    m.joint(Prismatic("x", "ground", "puck"))
    ends = sorted((0.1 * side, -9.0 * side))
    m.force(JointStop("stop", "x", *ends, k, e))
    until = 0.15 / v + 20 * sqrt(mass / k)
    run = simulate(m.build(), until, x0={"x_rate": side * v}, rtol=1e-10, max_step=0.01 / v)
    assert run.final["x_rate"] == pytest.approx(-side * rebound(e, v), rel=1e-7)
    depth = np.max(side * run["x"] - 0.1)
    assert depth <= v * sqrt(mass / k) * (1 + 1e-9)
    if e == 0:
        assert depth == pytest.approx(v * sqrt(mass / k), rel=1e-3)
    balance = run.energy_balance()
    assert np.abs(balance.defect).max() < 1e-6 * mass * v**2


def test_stops_that_cannot_be_are_refused_at_once() -> None:
    problems = list(JointStop("stop", "x", 1.0, -1.0, 0.0, -2.0).problems())
    assert [text.partition(":")[0] for text in problems] == ["lower", "stiffness", "dissipation"]
