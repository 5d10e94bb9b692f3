"""Dahl friction along prescribed motions."""

import casadi as ca
import numpy as np
import pytest
from oracles import dahl_virgin
from rigs import prescribed_motion

from symfric import Dahl, drive, simulate

N, LEVEL = 7.848, 0.7848


@pytest.mark.parametrize("n", [0.0, 0.5, 1.0, 2.0])
def test_virgin_curve_is_the_closed_form(n: float) -> None:
    model = prescribed_motion(Dahl(n=n, rho_eps=1e-9), N, lambda t: ca.SX(1e-3))
    run = simulate(model, 0.03, rtol=1e-9)
    expected = [dahl_virgin(n, x, 1e5, LEVEL) for x in run["path"]]
    # n < 1 reaches the level within a finite distance, with a corner that rho_eps rounds
    assert run["friction"] == pytest.approx(expected, abs=1e-7 if n >= 1 else 1e-5)
    assert run.final["friction"] > 0.79 * LEVEL


@pytest.mark.parametrize("v", [1e-5, 1e-3, 0.1])
def test_force_depends_on_the_path_and_not_on_the_rate(v: float) -> None:
    run = simulate(prescribed_motion(Dahl(), N, lambda t: ca.SX(v)), 1e-5 / v, rtol=1e-9)
    assert run.final["friction"] == pytest.approx(dahl_virgin(1.0, 1e-5, 1e5, LEVEL), rel=1e-7)


def closed_cycle(law: Dahl, amplitude: float) -> tuple[float, float]:
    """Work and gain of stored energy over the third cycle of a sine of 1 Hz."""
    w = 2 * np.pi
    model = prescribed_motion(law, N, lambda t: amplitude * w * ca.cos(w * t))
    start, end = (simulate(model, t, rtol=1e-9, samples=2).final for t in (2.0, 3.0))
    return end["work"] - start["work"], 0.5 * 1e5 * (end["z"] ** 2 - start["z"] ** 2)


def test_cycle_takes_the_published_work() -> None:
    work, stored = closed_cycle(Dahl(), 5e-5)
    assert work == pytest.approx(1.323e-4, abs=5e-8)
    assert abs(stored) < 1e-6 * work
    assert work < 4 * 5e-5 * LEVEL


@pytest.mark.parametrize("n", [0.5, 1.0, 2.0])
@pytest.mark.parametrize("amplitude", [1e-6, 1e-4])
def test_settled_cycle_dissipates(n: float, amplitude: float) -> None:
    work, stored = closed_cycle(Dahl(n=n), amplitude)
    assert work > stored
    assert work > 0


def test_stiff_bristle_tends_to_coulomb() -> None:
    w = 2 * np.pi
    short = []
    for sigma_0 in (1e5, 1e6, 1e7):
        model = prescribed_motion(Dahl(sigma_0=sigma_0), N, lambda t: 1e-4 * w * ca.cos(w * t))
        work = [simulate(model, t, rtol=1e-8, samples=2).final["work"] for t in (2.0, 3.0)]
        short.append(1 - (work[1] - work[0]) / (4 * 1e-4 * LEVEL))
    assert short[0] > 5 * short[1] > 25 * short[2] > 0


@pytest.mark.parametrize("v_eps", [1e-9, 0.0])
def test_bristle_at_rest_keeps_its_load(v_eps: float) -> None:
    assert Dahl(v_eps=v_eps).rate(0.0, N, np.array([5e-6]))[0] == 0.0


def test_original_with_exponent_has_no_smoothing() -> None:
    law = Dahl(n=2.0, v_eps=0.0)
    assert law.rate(1e-15, N, np.array([0.0]))[0] == pytest.approx(1e-15, rel=1e-9)
    assert law.steady_state(-1e-15, N)[0] == pytest.approx(-LEVEL / 1e5)


@pytest.mark.parametrize("n", [0.0, 0.1])
def test_no_step_leaps_over_a_reversal_at_the_level(n: float) -> None:
    """A block that slides, is stopped and driven back: its bristle ends at the other level."""
    model = drive(Dahl(n=n))
    for rtol in (1e-5, 1e-6):
        run = simulate(model, 0.6, x0={"v": 1.0}, u={"force": -20.0}, rtol=rtol, method="rodas5p")
        start, end = run["z"].max(), run.final["z"]
        assert run.final["v"] < 0
        assert end == pytest.approx(-start, rel=10 * rtol)
