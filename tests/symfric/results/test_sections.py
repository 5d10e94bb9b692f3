"""Crossings of a run, and the cycle it settles to, against closed forms."""

from pathlib import Path

import casadi as ca
import numpy as np
import pytest

from symfric import GMS, BrownMcPhee, ExactCoulomb, LuGre, Model, Variable, rabinowicz, simulate
from symfric.laws import Viscous


def oscillator(damping: float = 0.0) -> Model:
    x, v = Variable("x", "m", start=1.0), Variable("v", "m/s")
    return Model("spring", x=(x, v), ode=ca.vertcat(v.symbol, -9 * x.symbol - damping * v))


def test_crossings_are_those_of_a_sine() -> None:
    run = simulate(oscillator(), 10.0, rtol=1e-11)
    at = run.crossings("x")
    expected = np.pi / 6 + np.pi / 3 * np.arange(at.size)
    assert at.size == 10 and np.abs(at - expected).max() < 1e-9
    assert run.crossings("x", 1) == pytest.approx(expected[1::2], abs=1e-9)
    assert run.crossings("x", -1) == pytest.approx(expected[::2], abs=1e-9)
    shifted = run.crossings(run.model.expression("x") - 0.5, -1)
    assert shifted == pytest.approx(np.pi / 9 + 2 * np.pi / 3 * np.arange(shifted.size), abs=1e-9)
    assert np.abs(run.at(at)["x"]).max() < 1e-13
    assert run.crossings(run.model.expression("x") - 2.0).size == 0


def test_the_measures_of_a_sine() -> None:
    cycle = simulate(oscillator(), 20.0, rtol=1e-11).period()
    assert cycle.period == pytest.approx(2 * np.pi / 3, rel=1e-9)
    assert cycle.extremes("x") == pytest.approx((-1.0, 1.0), abs=1e-6)
    assert cycle.amplitude("v") == pytest.approx(3.0, rel=1e-6)
    assert abs(cycle.mean("x")) < 1e-8
    sizes = np.abs(cycle.spectrum("x", 3))
    assert sizes == pytest.approx([0.0, 0.5, 0.0, 0.0], abs=1e-9)
    assert "period" in repr(cycle)


def test_stick_slip_has_its_period_and_share_of_sticking() -> None:
    m, k, v, N, rise = 0.8, 2.1, 0.1, 0.8 * 9.81, 0.05
    w = np.sqrt(k / m)
    stick = 2 * rise * N / (k * v)
    slip = 2 / w * (np.pi - np.arctan(rise * N * w / (k * v)))
    cycle = simulate(rabinowicz(ExactCoulomb()), 60.0, rtol=1e-10).period()
    assert cycle.period == pytest.approx(stick + slip, rel=1e-11)
    assert cycle.sticking("belt") == pytest.approx(stick / (stick + slip), rel=1e-9)
    # the momentum of the block does not change in a period: friction balances the spring
    assert cycle.mean("friction") == pytest.approx(-k * cycle.mean("x"), rel=1e-9)
    assert cycle.settled < 10.0
    for law in (LuGre(), BrownMcPhee()):
        other = simulate(rabinowicz(law), 60.0, rtol=1e-8).period()
        assert other.sticking("belt") == pytest.approx(stick / (stick + slip), rel=0.1)


def test_the_transient_ends_where_returns_repeat() -> None:
    x, v = Variable("x", "m", start=0.1), Variable("v", "m/s")
    van_der_pol = ca.vertcat(v.symbol, 0.2 * (1 - x**2) * v - x)
    run = simulate(Model("pol", x=(x, v), ode=van_der_pol), 120.0, rtol=1e-9)
    early, late = run.period(tolerance=1e-1), run.period(tolerance=1e-5)
    assert early.period == pytest.approx(late.period, rel=1e-6)
    assert early.settled < late.settled - 10
    # decay of deviations by exp(-mu T) per period: five decades less 1 take log(1e4) / 0.2
    assert late.settled - early.settled == pytest.approx(np.log(1e4) / 0.2, rel=0.4)


def test_two_slips_make_one_period() -> None:
    x, y = Variable("x", "m", start=1.0), Variable("y", "m", start=0.0)
    v, w = Variable("v", "m/s"), Variable("w", "m/s", start=1.0)
    ode = ca.vertcat(v.symbol, w.symbol, -4 * x.symbol, -1 * y.symbol)
    run = simulate(Model("two", x=(x, y, v, w), ode=ode), 40.0, rtol=1e-10)
    assert run.period("x").period == pytest.approx(2 * np.pi, rel=1e-8)
    assert run.period("y").period == pytest.approx(2 * np.pi, rel=1e-8)


def test_a_bristle_that_vibrates_does_not_define_the_period() -> None:
    run = simulate(rabinowicz(GMS()), 40.0)
    assert run.period().period == pytest.approx(run.period(run.model.expression("v")).period)
    assert run.period().period > 5.0


def test_a_section_shows_one_point_per_return(tmp_path: Path) -> None:
    run = simulate(oscillator(0.1), 20.0, rtol=1e-10)
    (axis,) = run.plot_section("v", "x", "x", path=tmp_path / "section.png").axes
    v, x = axis.lines[0].get_data()
    assert (axis.get_xlabel(), axis.get_ylabel()) == ("v [m/s]", "x [m]")
    # the velocity falls by exp(-c T / 2) between rising crossings, T = 2 pi / sqrt(9 - c^2 / 4)
    decay = np.exp(-0.05 * 2 * np.pi / np.sqrt(9 - 0.05**2))
    assert v[1:] / v[:-1] == pytest.approx(decay, rel=1e-7) and np.abs(x).max() < 1e-12
    with pytest.raises(ValueError, match="expected an expression that crosses zero"):
        run.plot_section("v", "x", run.model.expression("x") - 5)


def test_runs_without_a_cycle_are_refused() -> None:
    still = simulate(rabinowicz(ExactCoulomb(sigma_2=5.0), v_belt=1.0), 200.0)
    short = simulate(oscillator(), 3.0)
    falling = simulate(oscillator(0.5), 40.0)
    moving = simulate(rabinowicz(Viscous()), 1.0)
    for call, text in {
        still.period: "that moves",
        short.period: "simulate longer",
        lambda: falling.period(tolerance=1e-4): "differs by",
        lambda: falling.period(tolerance=0.0): "tolerance",
        lambda: short.crossings("y"): "got y",
        lambda: short.crossings("x", 2): "direction",
        lambda: short.crossings(ca.SX.sym("other")): "symbols of its model",
        lambda: short.period("no"): "got no",
        lambda: moving.crossings(None): "expression",
    }.items():
        with pytest.raises(ValueError, match=text):
            call()
