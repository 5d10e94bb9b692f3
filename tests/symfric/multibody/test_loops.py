"""Closed loops: balls, redundant constraints, full turns, and mechanisms with known solutions."""

from collections.abc import Callable
from dataclasses import replace

import casadi as ca
import iftomm
import numpy as np
import pytest
from chains import X, Y, Z, attach, in_both

from symfric import BrownMcPhee, SolveError, Status, simulate
from symfric import multibody as mb
from symfric.bench.ivp import JOINT, correct_digits
from symfric.multibody.kinematics import constant_slopes

LAW = BrownMcPhee()


def crank_with_a_ball() -> mb.Mechanism:
    """A crank on a shaft that may slide, a rod, and a piston whose ball closes the loop."""
    m = mb.Mechanism("crank")
    rubs, light = mb.JointFriction(LAW, radius=0.01), {"mass": 0.5, "J": 1e-3}
    begin = {"start": (0.0, 0.5), "rate": (0.0, 10.0)}
    attach(m, mb.Cylindrical, "shaft", "crank", z=Y, **light, **begin)
    attach(m, mb.Revolute, "pin", "rod", "crank", at=(0.1, 0.0, 0.0), to=(-0.15, 0.0, 0.0), z=Y,
           start=-0.7, friction=rubs, **light)  # fmt: skip
    attach(
        m, mb.Prismatic, "bore", "piston", z=X, start=0.38, friction=mb.JointFriction(LAW), **light
    )
    attach(m, mb.Spherical, "end", "piston", "rod", at=(0.15, 0.0, 0.0), z=Y, friction=rubs)
    return m.assembled()


def test_a_ball_that_closes_a_loop_rubs_with_a_law_without_states() -> None:
    # some components of its slip are zero for every motion: CasADi then refused to put them in
    run = simulate(crank_with_a_ball().build(), 0.02, backend="vm")
    pressed = np.sqrt(sum(run[f"end_{c}"] ** 2 for c in ("Fx", "Fy", "Fz")))
    np.testing.assert_allclose(run["end_N"], pressed, atol=2e-4)
    np.testing.assert_allclose(run["end_friction"] * run["end_slip"], run["end_power"], rtol=1e-2)
    assert run["end_power"].max() > 1e-4


@pytest.mark.parametrize("rubbing", ["floor face", "face guide"])
def test_redundant_loops_that_rub_twice_are_refused_in_words(rubbing: str) -> None:
    m = mb.Mechanism("wedge")
    slope = (-np.cos(0.3), 0.0, np.sin(0.3))
    m.body("block", 10.0, (0.01, 0.01, 0.01))
    ends = {"floor": ("ground", "wedge", X), "face": ("wedge", "block", slope),
            "guide": ("ground", "block", Z)}  # fmt: skip
    for name, (a, b, z) in ends.items():
        friction = mb.JointFriction(LAW) if name in rubbing.split() else None
        attach(m, mb.Prismatic, name, b, a, J=0.01, z=z, friction=friction)
    with pytest.raises(ValueError, match="normal force that the redundant constraints"):
        m.assembled().build()


def spatial_crank() -> mb.Mechanism:
    """Crank about x, slider along x, and a rod with balls at both ends, which may spin."""
    m = mb.Mechanism("crank", gravity=(0.0, 0.0, -9.8))
    r, length, b, c, e = 0.08, 0.3, 0.1, 0.12, 0.02
    reach = float(np.sqrt(length**2 - b**2 - (c + r - e) ** 2))
    along = (np.array([reach, 0.0, e]) - np.array([0.0, b, c + r])) / length
    # the turn that brings z along the rod, as Euler parameters
    half = np.array([1.0 + along[2], -along[1], along[0], 0.0])
    half /= np.linalg.norm(half)
    attach(m, mb.Revolute, "theta", "wheel", mass=0.5, J=0.2, at=(0.0, b, c), z=X, x=Z, rate=120.0)
    attach(m, mb.Prismatic, "slider", "block", mass=5.0, J=0.2, z=X, x=Z, start=reach,
           rate=b * r * 120.0 / reach)  # fmt: skip
    attach(m, mb.Spherical, "near", "rod", "wheel", mass=0.1, J=(1e-3, 1e-3, 1e-5), at=(0, 0, r),
           to=(0.0, 0.0, -length / 2), start=tuple(half.tolist()))  # fmt: skip
    attach(m, mb.Spherical, "far", "block", "rod", at=(0.0, 0.0, length / 2), to=(0.0, 0.0, e))
    return m.assembled()


def test_unknowns_that_are_zero_but_for_rounding_are_found() -> None:
    # the multiplier of the norm is 1e-15, accelerations are 1e3: Newton's method went on
    # without end and reported that there was no solution
    run = simulate(spatial_crank().build(), 0.02, backend="vm")
    assert run.final["energy"] == pytest.approx(run["energy"][0], rel=1e-6)


def drill(loop: bool, start: float, stiffness: float = 473.0) -> mb.Mechanism:
    """A rotary table drives a bit through a string of pipes; a bearing at the bit closes a loop."""
    m = mb.Mechanism("drill", gravity=(0.0, 0.0, 0.0))
    attach(m, mb.Revolute, "top", "table", J=2122.0, rate=5.0)
    attach(m, mb.Revolute, "pipe", "bit", "table", J=374.0, start=start)
    if loop:
        attach(m, mb.Revolute, "rock", "bit", start=start, rate=5.0)
    m.force(mb.JointSpringDamper("string", "pipe", stiffness=stiffness, damping=23.0))
    m.force(mb.JointSpringDamper("drive", "top", actuator=6000.0))
    m.force(mb.UserForce("brake", "bit", lambda kin: ((0.0, 0.0, 0.0), (0.0, 0.0, -4000.0))))
    return m


@pytest.mark.parametrize("start", [0.0, -10.0])
def test_a_string_winds_up_over_full_turns_where_its_joint_is_cut(start: float) -> None:
    # the spring of a cut joint wrapped at pi: 183 rad of the table instead of 85, and SUCCESS
    tree, cut = (
        simulate(drill(loop, start).build(), 3.0, rtol=1e-8, backend="vm") for loop in (False, True)
    )
    assert np.abs(tree["pipe"]).max() > 1.5 * np.pi
    for name in ("pipe", "energy"):
        np.testing.assert_allclose(cut[name][-1], tree[name][-1], rtol=1e-5)
    assert cut.energy_balance().relative < 1e-6
    assert set(cut.energy_balance().work) == {"string", "drive", "brake"}


def test_absolute_coordinates_count_turns_in_few_steps() -> None:
    # ten times as many steps while error control watched the multiplier of the norm, which loads
    # nothing
    m = mb.Mechanism("wheel", gravity=(0.0, 0.0, 0.0))
    attach(m, mb.Revolute, "axle", "rim", J=1e3, start=-10.0, rate=5.0)
    m.force(mb.JointSpringDamper("spring", "axle", stiffness=500.0))
    run = simulate(m.build(formulation="absolute"), 1.0, backend="vm")
    w = np.sqrt(0.5)
    expected = -10.0 * np.cos(w * run.t) + 5.0 / w * np.sin(w * run.t)
    np.testing.assert_allclose(run["axle"], expected, atol=1e-4)
    assert run.statistics.steps < 60


def test_angles_that_no_force_asks_for_are_no_states() -> None:
    without = drill(True, 0.0, stiffness=0.0).build()
    assert [v.name for v in without.x] == ["top", "rock", "top_rate", "rock_rate"]
    assert [v.name for v in drill(True, 0.0).build().x][4:] == ["pipe"]


def test_forces_of_users_see_full_turns_too() -> None:
    m = drill(True, -10.0, stiffness=0.0)
    pipe = m.joints[1]

    def spring(kin):
        angle, _ = kin.along(pipe, "turn")
        return (0.0, 0.0, 0.0), (0.0, 0.0, -473.0 * angle)

    m.force(mb.UserForce("own", "bit", spring))
    model = m.build()
    assert model.initial_state({"top": 1.0})[-1] == pytest.approx(-11.0)
    run = simulate(model, 0.5, backend="vm")
    assert run["pipe"][0] == pytest.approx(-10.0)
    np.testing.assert_allclose(run["pipe"], run["rock"] - run["top"], atol=1e-6)


def test_functions_of_positions_count_the_turns_of_parallel_axes() -> None:
    bias = mb.functions(drill(True, -10.0))["bias"]
    q = [0.0, -10.0 + 4.0 * np.pi]  # top, rock
    moment = bias(q, [0.0, 0.0], [], []).full().ravel()
    wound = -473.0 * q[1]
    assert moment == pytest.approx([-6000.0 + wound, 4000.0 - wound])


@in_both
def test_a_string_starts_as_wound_up_as_the_joints_of_its_loop_are(formulation: str) -> None:
    # -20 rad of the bit left -1.15 rad in the string, without a word
    m = drill(True, -20.0)
    top, pipe, rock = m.joints
    m.joints = [top, rock, replace(pipe, start=None)]
    model = m.build(formulation=formulation)
    k = [v.name for v in model.x].index("pipe")
    assert model.initial_state()[k] == pytest.approx(-20.0, abs=1e-12)
    if formulation == "joint":
        moved = model.initial_state({"rock": -33.0, "top": 1.0})
        assert moved[k] == pytest.approx(-34.0)


def test_in_space_the_start_of_a_joint_selects_the_turn() -> None:
    q, qd = ca.SX.sym("q", 2), ca.SX.sym("qd", 2)
    assert str(constant_slopes(ca.dot(ca.DM([2.0, -1.0]), qd), qd)) == "[[2, -1]]"
    assert constant_slopes(q[0] * qd[1], qd) is None


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
    run = simulate(iftomm.bricard().build(), 1.0, backend="vm")
    assert np.ptp(run["energy"]) < 1e-5
    assert run["constraint_position"].max() < 1e-13


def momentum(m: mb.Mechanism, values: Callable[[str], np.ndarray]) -> np.ndarray:
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
