"""Errors of fixed steps of plants."""

import casadi as ca
import numpy as np
import pytest

from symfric import BrownMcPhee, LuGre, Viscous
from symfric.embedded import step_errors
from symfric.scenes import Drive, Rabinowicz


def test_errors_equal_those_of_a_loop_in_numpy():
    """m v' = F(t) - sigma v by backward Euler, against the closed form."""
    machine = Drive(Viscous(sigma_2=3.0), m=2.0)
    found = step_errors(machine, 0.02, 1.0, u={"force": ca.cos}, method="backward_euler")
    assert [e.h for e in found] == [0.08, 0.04, 0.02, 0.01, 0.005]
    for one in found:
        steps = round(one.duration / one.h)
        t = one.h * np.arange(1, steps + 1)
        a, x, v = 1.5, np.zeros(steps + 1), np.zeros(steps + 1)
        for k in range(steps):
            v[k + 1] = (v[k] + one.h * np.cos(t[k] - one.h / 2) / 2.0) / (1.0 + a * one.h)
            x[k + 1] = x[k] + one.h * v[k + 1]
        rate = (a * np.cos(t) + np.sin(t) - a * np.exp(-a * t)) / (2.0 * (1.0 + a**2))
        way = (a * np.sin(t) - np.cos(t) + np.exp(-a * t)) / (2.0 * (1.0 + a**2))
        errors = {
            name: np.abs(y[1:] - exact).max() / np.abs(exact).max()
            for name, y, exact in (("x", x, way), ("v", v, rate))
        }
        assert one.state == max(errors, key=errors.__getitem__)
        assert one.error == pytest.approx(errors[one.state], rel=1e-6)


def test_shorter_steps_are_more_accurate_and_long_ones_diverge():
    belt = [e.error for e in step_errors(Rabinowicz(BrownMcPhee()), 1e-3, 4.0)]
    assert belt[0] > 3 * belt[2] > 9 * belt[4]
    own = step_errors(Rabinowicz(BrownMcPhee()).model(), 1e-3, 4.0)  # numbers instead of symbols
    assert own[2].error == pytest.approx(belt[2], rel=1e-3)
    stuck = step_errors(Drive(LuGre()), 8e-3, 1.0, u={"force": lambda t: 2 * ca.sin(np.pi * t)})
    assert stuck[0].error > 0.5
    assert str(stuck[2]).startswith("The largest error of steps of 0.008 s is ")
    assert step_errors(Drive(LuGre()), 1e-7, 4.0)[0].duration == pytest.approx(0.0025)


def test_bad_numbers_are_refused():
    with pytest.raises(ValueError, match="step_errors: h: expected"):
        step_errors(Drive(LuGre()), 0.0, 4.0)
    with pytest.raises(ValueError, match="step_errors: t_end"):
        step_errors(Drive(LuGre()), 1.0, 0.5)
