"""Normal forces of bearings from reactions, and what friction asks of a joint."""

from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np
import pytest
from chains import attach, in_joint_coordinates_first

import symfric as sf
from symfric.laws import GMS, Gonthier, Karnopp, Law, LuGreNormalised, QuarterCarGeneral
from symfric.multibody import JointFriction, Mechanism, Revolute, Spherical, Universal
from symfric.scenes import SliderCrank

pytestmark = pytest.mark.heavy


LAW = sf.BrownMcPhee()
F, T = ca.SX([3.0, -4.0, 5.0]), ca.SX([0.6, -0.8, 0.2])


SLIDE, TURN, BOTH = ("slide",), ("turn",), ("slide", "turn")


def load(friction: JointFriction, rubs: tuple[str, ...]) -> float:
    return float(ca.DM(friction.normal_force(rubs, F, T)))


BEARING = JointFriction(LAW, radius=0.1, length=0.2, width=0.1, eps=1e-9)
"""Stations: f_2 = (0.8, 0.6) / 0.2 = (4, 3) N, f_1 = -(3, -4) - f_2 = (-7, 1) N."""


def test_bearings_press_at_two_stations_or_as_they_are_given() -> None:
    for rubs, expected in (
        (BOTH, 50.0**0.5 + 5.0),
        (TURN, 50.0**0.5 + 5.0 + 5.0),
        (SLIDE, 5.0 + 1.0 + 4.0 + 3.0 + 2.0),
        (("ball",), 50.0**0.5),
    ):
        assert load(BEARING, rubs) == pytest.approx(expected, rel=1e-7)
    short = JointFriction(LAW, radius=0.1, eps=1e-9)  # without a length only forces press
    assert load(short, BOTH) == pytest.approx(5.0)
    assert load(replace(short, preload=7.0), BOTH) == pytest.approx(12.0)
    assert load(JointFriction(LAW, normal=2.5), SLIDE) == 2.5


WRONG = [
    (JointFriction(LAW), TURN, "radius: expected the bearing's radius"),
    (JointFriction(Karnopp(), radius=0.1), ("ball",), "Karnopp, which also needs F_e; a ball has"),
    (JointFriction(QuarterCarGeneral()), SLIDE, "also needs x_rel, v_rel; a joint has no such inp"),
    (JointFriction(LAW), (), "expected a joint with friction"),
    (JointFriction(LAW, radius=-1.0), TURN, "radius: expected a number > 0, got -1"),
    (JointFriction(LAW, length=0.0), SLIDE, "length: expected a number > 0"),
    (JointFriction(LAW, preload=-1.0), SLIDE, "preload: expected a number >= 0"),
    (JointFriction(LAW, normal=float("nan")), SLIDE, "normal: expected a number >= 0"),
]


def test_bad_bearings_are_described() -> None:
    for friction, rubs, message in WRONG:
        assert any(message in problem for problem in friction.problems(rubs)), message
    with pytest.raises(ValueError, match="friction: expected a law such as"):
        JointFriction("lugre")  # type: ignore[arg-type]


KINETIC = sf.BrownMcPhee(mu_s=0.2, mu_d=0.2, mu_v=0.0, v_t=1e-3)
"""0.2 N at any speed well above a millimetre per second."""
SPIN = np.array([1.0, -4.0, 8.0])
"""9 rad/s."""


def ball(law: Law, **friction: Any) -> Mechanism:
    """A rotor of J = 0.05 kg m^2 on a ball of 2 cm, pressed by 20 N, spinning about a skew axis."""
    m = Mechanism("rotor", gravity=(0.0, 0.0, -10.0))
    bearing = JointFriction(law, radius=0.02, **friction)
    rate = (0.0, *(0.5 * SPIN).tolist())
    attach(m, Spherical, "ball", "wheel", mass=2.0, J=0.05, rate=rate, friction=bearing)
    return m


def rotor(formulation: str, law: Law = KINETIC) -> sf.Trajectory:
    return sf.simulate(ball(law).build(formulation=formulation), 2.0, rtol=1e-7, samples=101)


@in_joint_coordinates_first
def test_a_spinning_ball_slows_down_linearly(formulation: str) -> None:
    """J w' = -R mu N: from 9 rad/s with 1.6 rad/s^2."""
    run = rotor(formulation)
    assert run["ball_slip"] == pytest.approx(0.02 * (9.0 - 1.6 * run.t), rel=2e-5)
    assert run["ball_N"] == pytest.approx(20.0, abs=1e-3)
    assert run["ball_friction"] == pytest.approx(0.2 * 20.0, rel=1e-3)
    assert run["ball_power"] == pytest.approx(run["ball_slip"] * run["ball_friction"], rel=1e-4)
    assert run["friction_work_rate"] == pytest.approx(-run["ball_power"])


@pytest.mark.parametrize(
    ("law", "formulation"),
    [(sf.LuGre(mu_s=0.2, mu_d=0.2, sigma_2=0.0), "absolute"), (GMS(mu_s=0.2, mu_d=0.2), "joint"),
     (sf.Dahl(mu_d=0.2, n=1.5), "joint"), (Gonthier(mu_s=0.2, mu_d=0.2), "joint")],
)  # fmt: skip
def test_bristles_of_a_ball_are_vectors(law: Law, formulation: str) -> None:
    """They slow the rotor down as Coulomb, once they lie against the motion."""
    run = rotor(formulation, law)
    assert run["ball_slip"][-1] == pytest.approx(0.02 * (9.0 - 1.6 * 2), rel=1e-3)
    if isinstance(law, sf.LuGre):
        bristles = np.array([run[f"ball_z_{axis}"][-1] for axis in "xyz"])
        assert bristles / np.linalg.norm(bristles) == pytest.approx(SPIN / 9.0, abs=1e-6)


def test_a_ball_that_sticks_stays_where_it_is() -> None:
    """A pendulum tilted by 0.1 rad; up to 0.2 rad friction holds what hangs 10 cm below."""
    m = Mechanism("held", gravity=(0.0, 0.0, -10.0))
    tilt = (np.cos(0.05), 0.6 * np.sin(0.05), 0.8 * np.sin(0.05), 0.0)
    bearing = JointFriction(sf.LuGre(mu_s=0.2, mu_d=0.15), radius=0.1)
    attach(m, Spherical, "ball", "bob", mass=2.0, J=0.05, com=(0.0, 0.0, -0.1), start=tilt,
           friction=bearing)  # fmt: skip
    run = sf.simulate(m.build(), 3.0, rtol=1e-6, samples=50)
    assert run["ball_e1"] == pytest.approx(tilt[1], rel=1e-2)  # bristles bend by 0.03 mm
    assert np.ptp(run["ball_e1"][25:]) < 1e-8
    assert run["ball_slip"][-1] < 1e-4
    # the couple of the weight, 2 x 10 x 0.1 sin(0.1), is what friction at 10 cm carries
    assert run["ball_friction"][-1] == pytest.approx(20.0 * np.sin(0.1), rel=1e-2)


@in_joint_coordinates_first
def test_a_shaft_on_a_cross_slows_down_linearly(formulation: str) -> None:
    """It turns about the horizontal x; both of its bearings carry 20 N across their axes."""
    m = Mechanism("cross", gravity=(0.0, 0.0, -10.0))
    attach(m, Universal, "cross", "shaft", mass=2.0, J=0.05, rate=(9.0, 0.0),
           friction=JointFriction(KINETIC, radius=0.02))  # fmt: skip
    run = sf.simulate(m.build(formulation=formulation), 2.0, rtol=1e-7, samples=101)
    assert run["cross_x_slip"] == pytest.approx(0.02 * (9.0 - 1.6 * run.t), rel=2e-5)
    assert run["cross_y_slip"] == pytest.approx(0.0, abs=1e-9)
    # y turns with the shaft: what is thrust there now is across a quarter of a turn later
    assert run["cross_x_N"] == pytest.approx(20.0, abs=1e-3)
    assert run["cross_y_N"].max() <= 20.0 * 2**0.5


def test_bearings_of_a_cross_feel_what_it_transmits() -> None:
    """Force (1, 2, 3) N, moment (0, 0, 0.4) N m normal to both axes, stations 0.1 m apart."""
    friction = JointFriction(LAW, radius=0.02, length=0.1, eps=1e-9)
    joint = Universal("u", "a", "b")
    force, moment = ca.SX([1.0, 2.0, 3.0]), ca.SX([0.0, 0.0, 0.4])
    loads = {}
    for direction in "xy":
        R = joint.bearing(direction, ca.SX.eye(3))
        N = friction.normal_force(("turn",), R @ force, R @ moment)
        loads[direction] = float(ca.DM(N))
    # about x: across (y, z) = (2, 3), thrust 1, a couple of 4 N in the plane of y
    assert loads["x"] == pytest.approx(np.hypot(2 - 4, 3) + 4 + 1, rel=1e-6)
    assert loads["y"] == pytest.approx(np.hypot(3, 1 + 4) + 4 + 2, rel=1e-6)


@in_joint_coordinates_first
def test_friction_in_balls_and_crosses_takes_energy(formulation: str) -> None:
    """A double pendulum in space: what is missing is what friction took."""
    m = Mechanism("double")
    bearing = JointFriction(sf.BrownMcPhee(mu_s=0.3, mu_d=0.2, v_t=0.01), radius=0.05, length=0.1)
    for name in ("upper", "lower"):
        m.body(name, 1.0, (0.02, 0.02, 0.01), com=(0.0, 0.0, -0.2))
        m.frame(f"{name}.end", at=(0.0, 0.0, -0.4))
    m.joint(Universal("cross", "ground", "upper", (0.8, 0.3), (1.0, 2.0), friction=bearing))
    m.joint(Spherical("ball", "upper.end", "lower", rate=(0.0, 2.0, 1.0, 3.0), friction=bearing))
    run = sf.simulate(m.build(formulation=formulation), 1.0, rtol=1e-7, samples=2001)
    powers = [run[f"{name}_power"] for name in ("cross_x", "cross_y", "ball")]
    assert min(power.min() for power in powers) >= 0.0
    taken = np.trapezoid(sum(powers), run.t)
    assert run["energy"][0] - run["energy"][-1] == pytest.approx(taken, rel=1e-5)
    assert taken > 0.5


def test_laws_without_a_form_for_vectors_are_refused_in_a_ball_by_name() -> None:
    for law in (GMS(form="event"), sf.Asymmetric(sf.LuGre(), sf.LuGre(mu_s=0.3))):
        path = "mechanism 'rotor' > joint 'ball' > friction: law: expected an isotropic one, got "
        with pytest.raises(ValueError, match=path + type(law).__name__):
            ball(law).build()


def brake(formulation: str = "joint") -> Mechanism:
    """A disc on a shaft, pressed by an input."""
    m = Mechanism("brake", gravity=(0.0, 0.0, 0.0))
    clamp = JointFriction(KINETIC, radius=0.1, normal=m.input("clamp", "N", start=10.0))
    attach(m, Revolute, "shaft", "disc", J=0.1, rate=20.0, friction=clamp)
    return m


@in_joint_coordinates_first
def test_a_brake_that_pulls_is_an_error_at_its_time(formulation: str) -> None:
    """The clamp falls through zero at 2 s; friction would drive the disc from then on."""
    model = brake().build(formulation=formulation)
    pressed = sf.simulate(model, 1.9, u={"clamp": lambda t: 10.0 - 5.0 * t})
    assert pressed["shaft_power"].min() >= 0.0
    message = "normal force of joint 'shaft' with BrownMcPhee falls to zero; below, it would pull"
    with pytest.raises(sf.SolveError, match=message) as caught:
        sf.simulate(model, 3.0, u={"clamp": lambda t: 10.0 - 5.0 * t})
    assert caught.value.status is sf.Status.JAMMED
    assert caught.value.partial.t[-1] == pytest.approx(2.0, abs=1e-3)
    with pytest.raises(ValueError, match=r"falls below zero \(-4 times its typical size\)"):
        sf.simulate(model, 1.0, u={"clamp": -4.0})


def test_a_negative_preload_is_an_error_where_it_outweighs_the_reaction() -> None:
    preload = sf.Variable("preload", "N", start=0.0)
    model = ball(KINETIC, preload=preload.symbol).build((preload,))
    assert sf.simulate(model, 0.1, p={"preload": -19.0})["ball_N"][-1] == pytest.approx(
        1.0, abs=1e-3
    )
    with pytest.raises(ValueError, match="force of joint 'ball' with BrownMcPhee falls below"):
        sf.simulate(model, 0.1, p={"preload": -25.0})


def test_bristles_that_keep_the_deflection_of_another_load_are_named() -> None:
    """Their damping makes the reaction loop singular; what to take instead stands in the error."""
    scene = SliderCrank(sf.LuGre())
    with pytest.raises(
        sf.SolveError, match=r"bristles of LuGre in joints? [a-z_]*crank.* keep"
    ) as e:
        sf.simulate(scene.model(), 0.5)
    assert "write LoadNormalised(LuGre(...), N_0=" in str(e.value)
    assert sf.simulate(replace(scene, law=LuGreNormalised()).model(), 0.1).t[-1] == 0.1
    for law in (LuGreNormalised(), Karnopp(), sf.ExactCoulomb(), KINETIC):
        assert SliderCrank(law).model().holonomic.advice == ""  # type: ignore[union-attr]


def test_normal_forces_that_cannot_be_negative_are_not_watched() -> None:
    for law, more in ((KINETIC, {"normal": 5.0}), (KINETIC, {}), (sf.Viscous(), {})):
        m, bearing = Mechanism("m"), JointFriction(law, radius=0.02, **more)
        attach(m, Revolute, "pin", "wheel", friction=bearing)
        assert m.build().holonomic.pressing.numel() == 0  # type: ignore[union-attr]
