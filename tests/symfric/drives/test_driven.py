"""Models moved by the current of a drive, against the same equations by hand."""

from typing import Any

import casadi as ca
import numpy as np
import pytest

from ocp import Phase, Problem, integral, solve
from symfric import (
    BrownMcPhee,
    Drive,
    ExactCoulomb,
    LimitWarning,
    LuGre,
    Mechanism,
    Model,
    Stribeck,
    Variable,
    drive,
    driven,
    simulate,
)
from symfric.multibody import JointFriction, JointSpringDamper, Prismatic, Revolute
from symfric.scenes import Drive as Stage

LOAD = {"mu_s": 6.0, "mu_d": 4.0}


def push(t: Any) -> Any:
    return 9 * ca.sin(5 * t)


@pytest.mark.parametrize("law", [LuGre(**LOAD), ExactCoulomb(**LOAD), Stribeck(**LOAD)])
def test_the_rotor_adds_its_reflected_inertia(law: Any) -> None:
    d = Drive(torque_constant=0.2, gear_ratio=4.0, drum_radius=0.1, rotor_inertia=1e-3)
    by_drive = driven(drive(law, m=1.0, N=1.0), d)
    by_hand = drive(law, m=1.0 + 40**2 * 1e-3, N=1.0)
    a = simulate(by_drive, 1.0, u={"current": lambda t: push(t) / 8.0})
    b = simulate(by_hand, 1.0, u={"force": push})
    for name in ("x", "v", "friction"):
        assert np.allclose(a[name], b[name], atol=1e-6 * np.abs(b[name]).max())
    assert a.final["motor_speed"] == pytest.approx(40 * a.final["v"])
    assert a.final["motor_torque"] == pytest.approx(0.2 * push(1.0) / 8.0)


def test_gear_and_motor_do_not_change_the_motion_of_the_load() -> None:
    def at_end(ratio: float, K: float) -> tuple[float, float]:
        d = Drive(
            torque_constant=K, gear_ratio=ratio, efficiency=(0.9, 0.7), rotor_inertia=0.5 / ratio**2
        )
        model = driven(Stage(Stribeck(**LOAD), m=1.0, N=1.0, turning=True).model(), d)
        run = simulate(model, 0.7, u={"current": lambda t: push(t) / (ratio * K)}, rtol=1e-11)
        return run.final["x"], run.final["gear_loss"]

    expected = at_end(1.0, 1.0)
    for ratio, K in ((-1.0, 1e3), (3.0, -1e-3), (1000.0, 1.0)):
        assert at_end(ratio, K) == pytest.approx(expected, rel=1e-9)


def test_efficiency_acts_by_the_direction_of_the_power() -> None:
    x, v, force = Variable("x", "m"), Variable("v", "m/s"), Variable("force", "N")
    free = Model("free", x=(x, v), u=(force,), ode=ca.vertcat(v, force / 2.0))
    d = Drive(torque_constant=3.0, drum_radius=1.0, efficiency=(0.8, 0.5), rotor_inertia=1.0)
    model = driven(free, d)
    a = model.function("ode")
    for speed, current, force in ((1.0, 1.0, 0.8 * 3), (1.0, -1.0, -3 / 0.5), (0.0, 1.0, 3.0)):
        found = a(t=0, x=[0.0, speed], u=[current])["ode"]
        assert float(found[1]) == pytest.approx(force / (2.0 + 1.0), rel=1e-9)


def test_the_current_saturates_only_in_simulation() -> None:
    d = Drive(torque_constant=1.0, drum_radius=1.0, max_current=2.0)
    stage = drive(Stribeck(), m=1.0, N=1.0)
    bounded = driven(stage, d, limit="bounds")
    assert (bounded.u[0].lower, bounded.u[0].upper) == (-2.0, 2.0)
    clipped = simulate(driven(stage, d), 0.5, u={"current": 50.0})  # without a LimitWarning
    assert clipped.final["x"] == pytest.approx(simulate(stage, 0.5, u={"force": 2.0}).final["x"])
    with pytest.warns(LimitWarning, match="current from t = 0 s, up to 50 A"):
        beyond = simulate(bounded, 0.5, u={"current": 50.0})
    assert beyond.final["x"] > 2 * clipped.final["x"]


def arm(law: Any) -> Model:
    m = Mechanism("arm")
    for body, mass in (("upper", 2.0), ("lower", 1.0)):
        m.body(body, mass=mass, inertia=(0.05, 0.05, 0.05))
        m.frame(f"{body}.hinge", at=(-0.3, 0, 0), z=(0, 1, 0), x=(1, 0, 0))
        m.frame(f"{body}.end", at=(0.3, 0, 0), z=(0, 1, 0), x=(1, 0, 0))
    m.frame("ground.hinge", z=(0, 1, 0), x=(1, 0, 0))
    rubbing = JointFriction(law, normal=10.0, radius=0.05)
    m.joint(Revolute("shoulder", "ground.hinge", "upper.hinge", friction=rubbing))
    m.joint(Revolute("elbow", "upper.end", "lower.hinge"))
    for k, joint in enumerate(("shoulder", "elbow"), start=1):
        m.force(JointSpringDamper(f"motor_{k}", joint, actuator=m.input(f"tau_{k}", "N m")))
    return m.build()


@pytest.mark.parametrize("law", [LuGre(), ExactCoulomb()])
def test_energy_of_a_driven_mechanism_is_accounted_for(law: Any) -> None:
    d = Drive(
        torque_constant=0.1, gear_ratio=100, rotor_inertia=1e-4, efficiency=(0.8, 0.7), resistance=2
    )
    model = driven(driven(arm(law), d, "tau_1", name="a"), d, "tau_2", name="b")
    run = simulate(model, 0.5, u={"a_current": lambda t: 3 * ca.sin(8 * t), "b_current": 1.0})
    balance = run.energy_balance()
    assert balance.relative < 1e-4
    lost = run.integral("a_gear_loss")[-1]
    assert balance.work["a_gear"][-1] == pytest.approx(-lost, rel=1e-6)
    assert balance.work["b_gear"][-1] < 0 < balance.work["motor_2"][-1]
    assert run.integral("b_copper_loss")[-1] == pytest.approx(2 * 0.5)
    assert {"a_current", "b_current"} <= {u.name for u in model.open.u}


def test_a_mechanism_and_equations_by_hand_agree() -> None:
    m = Mechanism("sled", gravity=(0, 0, 0))
    m.body("sled", mass=1.5, inertia=(1, 1, 1))
    m.frame("ground.rail", z=(1, 0, 0))
    m.frame("sled.shoe", z=(1, 0, 0))
    rubbing = JointFriction(LuGre(**LOAD), normal=1.0)
    m.joint(Prismatic("x", "ground.rail", "sled.shoe", friction=rubbing))
    m.force(JointSpringDamper("motor", "x", actuator=m.input("force", "N")))
    d = Drive(
        torque_constant=0.2, gear_ratio=-4, drum_radius=0.1, rotor_inertia=1e-3, efficiency=0.9
    )
    stage = drive(LuGre(**LOAD), m=1.5, N=1.0)
    ends = [
        simulate(driven(model, d), 0.5, u={"current": lambda t: push(t) / 8}).final["x"]
        for model in (m.build(), stage)
    ]
    assert ends[0] == pytest.approx(ends[1], rel=1e-5)


def test_least_copper_loss_and_its_sensitivities_have_a_closed_form() -> None:
    x, v, force = Variable("x", "m"), Variable("v", "m/s"), Variable("force", "N")
    free = Model("free", x=(x, v), u=(force,), ode=ca.vertcat(v, force / 2.0))
    d = Drive(torque_constant=0.5, lead=0.1, rotor_inertia=1e-3, max_current=5.0, resistance=3.0)
    model = driven(free, d, limit="bounds", free=("torque_constant", "rotor_inertia"))
    move = Phase(model, 0.5, start={"x": 0.0, "v": 0.0}, end={"x": 0.2, "v": 0.0})
    found = solve(Problem(move, integral(lambda s: s.copper_loss)), intervals=40)
    mass = 2.0 + float(d.rotor)
    J = 3.0 * 12 * 0.2**2 / 0.5**3 * (mass / float(d.force_constant)) ** 2
    assert found.cost == pytest.approx(J, rel=1e-3)  # a current that is constant on intervals
    by_K = found.sensitivity("torque_constant").cost
    by_J = found.sensitivity("rotor_inertia").cost
    assert by_K == pytest.approx(-2 * found.cost / 0.5, rel=1e-6)
    assert by_J == pytest.approx(2 * found.cost * float(d.ratio) ** 2 / mass, rel=1e-6)


def test_optimal_moves_equal_those_in_load_units() -> None:
    law = BrownMcPhee(mu_s=6.0, mu_d=4.0, mu_v=0.5, v_t=1e-3, N_t=1e-3)
    d = Drive(torque_constant=0.5, gear_ratio=-2, lead=0.1, rotor_inertia=1e-4)
    ends: dict[str, Any] = {"start": {"x": 0.0, "v": 0.0}, "end": {"x": 0.1, "v": 0.0}}
    by_drive = driven(drive(law, m=1.0, N=1.0), d, limit="bounds")
    by_hand = drive(law, m=1.0 + float(d.rotor), N=1.0)
    k = float(d.force_constant)
    costs = (integral(lambda s: s.current**2), integral(lambda s: (s.force / k) ** 2))
    found = [
        solve(Problem(Phase(model, 0.4, **ends), cost), friction="smooth", intervals=20).cost
        for model, cost in zip((by_drive, by_hand), costs, strict=True)
    ]
    assert found[0] == pytest.approx(found[1], rel=1e-9)


def test_a_force_without_its_own_coordinate_is_refused() -> None:
    x, v, force = Variable("x", "m"), Variable("v", "m/s"), Variable("force", "N")
    squared = Model("odd", x=(x, v), u=(force,), ode=ca.vertcat(v, force**2))
    with pytest.raises(ValueError, match="accelerates a single state"):
        driven(squared, Drive(torque_constant=1.0, lead=0.1))
    with pytest.raises(ValueError, match="expected the name of its input, got 2 inputs"):
        driven(arm(LuGre()), Drive(torque_constant=1.0))
