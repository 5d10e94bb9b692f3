"""Extremes and pictures come from all accepted steps: what is short is seen."""

from math import pi, sqrt

import casadi as ca
import numpy as np
import pytest
from hybrid import ball
from matplotlib.lines import Line2D

from symfric import BrownMcPhee, Model, SolveError, Trajectory, Variable, drive, simulate
from symfric.results.pictures import plot_trajectories
from symfric.results.quadrature import extremes, looks

AT, WIDTH = 5.1234, 1e-3


def hit() -> Trajectory:
    """A pulse of 564 N for a thousandth of a second, looked at in tenths of a second."""
    force = {"force": lambda t: ca.exp(-(((t - AT) / WIDTH) ** 2)) / (WIDTH * sqrt(pi))}
    return simulate(drive(BrownMcPhee()), 10.0, u=force, samples=101, backend="vm")


def test_a_pulse_between_the_samples_is_the_greatest_value_and_in_the_picture() -> None:
    run = hit()
    assert run["force"].max() < 1e-3
    assert run.extremes["force"] == pytest.approx((0.0, 1 / (WIDTH * sqrt(pi))), rel=1e-4)
    figure = plot_trajectories({"hit": run}, ["force"])
    (line,) = (artist for artist in figure.axes[0].get_children() if isinstance(artist, Line2D))
    assert np.max(line.get_ydata()) > 500


def test_extremes_between_steps_are_refined() -> None:
    x, v = Variable("x", "m", start=1.0), Variable("v", "m/s")
    swing = Model("swing", x=(x, v), ode=ca.vertcat(v.symbol, -x.symbol))
    run = simulate(swing, 10.0, samples=2, rtol=1e-9, backend="vm")
    for name in ("x", "v"):
        assert run.extremes[name] == pytest.approx((-1.0, 1.0), abs=1e-6)
    times = np.linspace(0.0, 10.0, 30)
    found = extremes(times, {"a": np.sin(times)}, lambda at: {"a": np.sin(at)})
    assert found["a"] == pytest.approx([-1.0, 1.0], abs=1e-5)


def test_the_value_just_before_a_jump_counts() -> None:
    """A ball is fastest when it hits the ground, where its velocity turns over."""
    run = simulate(ball(0.8), 0.6, samples=2, backend="vm")
    (hit, _), *_ = run.happened
    least = run.extremes["v"][0]
    assert least == pytest.approx(-9.81 * hit, rel=1e-9)
    assert run.at_looks("v").min() == pytest.approx(least, rel=1e-9)


def test_looks_show_samples_steps_their_middles_and_both_sides_of_jumps() -> None:
    found = looks(np.array([0.0, 2.0]), np.array([0.0, 1.0, 2.0]), np.array([1.0, 3.0]))
    assert found.tolist() == [0.0, 0.5, np.nextafter(1.0, 0.0), 1.0, 1.5, 2.0]


def test_what_was_reached_has_extremes_too() -> None:
    x = Variable("x", "m", start=1.0)
    with pytest.raises(SolveError) as failed:
        simulate(Model("blow up", x=(x,), ode=x.symbol**2), 2.0)
    least, greatest = failed.value.partial.extremes["x"]
    assert least == 1.0
    assert greatest > 1e3
