"""Works and areas of a run: closed forms, kinks inside a step, and what is refused."""

from itertools import pairwise

import casadi as ca
import numpy as np
import pytest

from symfric import Coulomb, Hold, Trajectory, Viscous, rabinowicz, simulate
from symfric.foundation.parameters import Variable
from symfric.model import Model, Output
from symfric.scenes import Prescribed


def circle() -> Trajectory:
    """x = cos t, v = -sin t over two turns, with signals of them and of time."""
    x, v, t = Variable("x", "m", start=1.0), Variable("v", "m/s"), ca.SX.sym("t")
    outputs = {
        "size": Output(ca.fabs(v.symbol), "m/s"),
        "late": Output(t * x.symbol, "m s"),
    }
    ode = ca.vertcat(v.symbol, -x.symbol)
    model = Model("circle", x=(x, v), t=t, ode=ode, outputs=outputs)
    return simulate(model, 4 * np.pi, rtol=1e-10, t_eval=[0.0, 4 * np.pi])


def test_the_area_of_a_loop_is_that_of_the_circle() -> None:
    run = circle()
    assert run.area("v", "x") == pytest.approx(2 * np.pi, rel=1e-9)
    assert run.area("x", "v") == pytest.approx(-2 * np.pi, rel=1e-9)
    assert run.area("v", "x", (0.0, np.pi / 2)) == pytest.approx(np.pi / 4, rel=1e-9)
    times = [0.0, 1e-3, 6.9]
    assert run.integral("x", times) == pytest.approx(np.sin(times), abs=1e-8)


def test_the_area_below_a_curve_takes_the_rate_by_time_too() -> None:
    """The integral of v d(t x) = v (x + t v) dt over whole turns T is T^2 / 4."""
    run = circle()
    assert run.area("v", "late") == pytest.approx((4 * np.pi) ** 2 / 4, rel=1e-8)


def test_kinks_inside_a_step_are_found() -> None:
    """|sin| has one in every half turn."""
    run = circle()
    assert run.work("size", "size") == pytest.approx(2 * np.pi, rel=1e-9)
    exact = run.area("size", "x", (0.5, 9.0))
    pieces = [0.5, np.pi, 2 * np.pi, 9.0]
    by_parts = sum(run.area("size", "x", part) for part in pairwise(pieces))
    assert exact == pytest.approx(by_parts, abs=1e-10)


def test_the_work_of_friction_is_its_power_integrated() -> None:
    run = simulate(rabinowicz(Coulomb()), 5.0, rtol=1e-8, t_eval=[0.0, 5.0])
    assert run.work("friction", "v_rel") == pytest.approx(run.integral("power")[-1], rel=1e-7)
    halves = run.work("friction", "v_rel", (0.0, 2.0)) + run.work("friction", "v_rel", (2.0, 5.0))
    assert halves == pytest.approx(run.work("friction", "v_rel"), rel=1e-10)
    assert run.work("friction", "v_rel", (1.0, 1.0)) == 0.0


def test_what_has_no_area_and_times_that_are_none_are_refused() -> None:
    run = simulate(Prescribed(Viscous()).model(), 1.0, u={"v": Hold([0.0], [0.5])}, t_eval=[1.0])
    for call, message in (
        (lambda: run.area("friction", "v"), "area: expected an x of the states and time"),
        (lambda: run.work("friction", "v", (1.0, 0.5)), "between: expected a first and a later"),
        (lambda: run.work("friction", "v", (0.0, 1.5)), r"expected times in \[0, 1\] s"),
        (lambda: run.work("frictio", "v"), "did you mean friction"),
    ):
        with pytest.raises(ValueError, match=message):
            call()
