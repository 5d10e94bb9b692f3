"""Mechanisms of others with known solutions: the IFToMM library, Andrews' squeezer."""

from collections.abc import Callable

import iftomm
import numpy as np
import pytest

from symfric import SolveError, Status, simulate
from symfric.bench.ivp import correct_digits
from symfric.bench.ivp_mechanisms import ABSOLUTE, JOINT
from symfric.multibody import Mechanism


def time_to_lie_down(n: int) -> float:
    """Time from upright to flat of n square loops, by Gauss quadrature of dt = -dtheta/omega."""
    inertia, weight = (n + 1) / 3 + n, (n + 1) / 2 + n
    nodes, weights = np.polynomial.legendre.leggauss(40)
    theta = np.pi / 4 * (1 + nodes)
    omega = np.sqrt(1 + 2 * weight * iftomm.G * (1 - np.sin(theta)) / inertia)
    return float(np.pi / 4 * (weights / omega).sum())


@pytest.mark.parametrize("n", [1, pytest.param(3, marks=pytest.mark.slow)])
def test_four_bars_stop_where_all_their_rods_lie_on_one_line(n: int) -> None:
    """Two motions go on from there; the library's pass straight through."""
    with pytest.raises(SolveError, match="the configuration is singular") as caught:
        # the projection leapt onto the branch of the other motion: SUCCESS with 74 % of energy lost
        simulate(iftomm.four_bars(n).build(), 1.0, rtol=1e-8, method="rodas5p", backend="vm")
    partial = caught.value.partial
    assert partial.status is Status.SINGULAR
    assert partial.step_times[-1] == pytest.approx(time_to_lie_down(n), abs=1e-5)
    np.testing.assert_allclose(partial["theta_1"], partial["theta_0"], atol=1e-9)
    assert partial.energy_balance().relative < 1e-6


def test_bricard_moves_though_one_constraint_is_redundant_everywhere() -> None:
    made = [iftomm.bricard().prepare(formulation=f) for f in ("joint", "absolute")]
    assert [len(m.redundant) for m in made] == [1, 1]
    # the norm of Euler parameters was left out: "no solution" for a consistent start
    assert not made[1].redundant[0].endswith("_norm")
    run = simulate(iftomm.bricard().build(), 3.0, backend="vm")
    assert np.ptp(run["energy"]) < 1e-5
    assert run["constraint_position"].max() < 1e-13


def momentum(m: Mechanism, values: Callable[[str], np.ndarray]) -> np.ndarray:
    """Angular momentum about the shaft of the governor [kg m^2/s], from angle and rate of turn."""
    angle, rate = values("angle_left"), values("turn_rate")
    J = 0.01 + 0.1
    for side in (body for body in m.bodies if body.name in ("left", "right")):
        c, (light, across, _) = float(side.com[0]), side.inertia
        J = J + side.mass * (c * np.sin(angle)) ** 2
        J = J + across * np.sin(angle) ** 2 + light * np.cos(angle) ** 2
    return J * rate


def test_governor_keeps_its_momentum_and_loses_what_its_dampers_take() -> None:
    m = iftomm.governor()
    run = simulate(m.build(), 3.0, rtol=1e-8, backend="vm")
    L = momentum(m, lambda name: run[name])
    np.testing.assert_allclose(L, L[0], rtol=1e-6)
    np.testing.assert_allclose(run["angle_left"], run["angle_right"], atol=1e-8)
    assert run["turn_rate"].min() < 6.27 < run["turn_rate"].max()
    assert run.energy_balance().relative < 1e-7


def test_squeezer_of_joints_meets_the_published_digits() -> None:
    problem = JOINT
    run = simulate(problem.model(), problem.t_end, samples=2, backend="vm")
    digits, worst = correct_digits(problem, run)
    assert digits > 7, worst
    assert run.final["constraint_position"] < 1e-15


@pytest.mark.slow
@pytest.mark.parametrize("name", ["bricard", "governor", "squeezer"])
def test_absolute_coordinates_agree(name: str) -> None:
    if name == "squeezer":
        problem = ABSOLUTE
        run = simulate(problem.model(), problem.t_end, rtol=1e-8, samples=2, backend="vm")
        assert correct_digits(problem, run)[0] > 6.5
        return
    m = getattr(iftomm, name)()
    ours, absolute = (
        simulate(m.build(formulation=f), 1.0, rtol=1e-8, backend="vm")
        for f in ("joint", "absolute")
    )
    for body in m.bodies[1:]:
        for axis in "xyz":
            signal = f"{body.name}_{axis}"
            np.testing.assert_allclose(absolute[signal], ours[signal], atol=1e-5, err_msg=signal)
