"""Prescribed motion, expressions of positions, gears, rolling and screws."""

from dataclasses import replace
from math import pi, sin

import casadi as ca
import numpy as np
import pytest
from chains import X, Y, attach, begin, chain, in_both, in_joint_coordinates_first, rod, solve
from scipy.integrate import solve_ivp

from symfric import Viscous, simulate
from symfric import multibody as mb
from symfric.foundation.numeric import Scalar
from symfric.foundation.parameters import Variable
from symfric.multibody.kinematics import Kinematics
from symfric.scenes import FourBar, SliderCrank

pytestmark = pytest.mark.heavy

SMOOTH = Viscous(sigma_2=0.0)
FORMULATIONS = ["joint", "absolute"]
OMEGA = 20.0


def slide(theta: ca.SX) -> ca.SX:
    """Position of the slider [m] from its closed relation."""
    across, up = 0.1 - 0.08 * ca.sin(theta), 0.1 + 0.08 * ca.cos(theta)
    return ca.sqrt(0.09 - across**2 - up**2)


@in_joint_coordinates_first
def test_driven_slider_crank_goes_through_full_turns_as_its_closed_relation(
    formulation: str,
) -> None:
    """Position, and the driving moment from virtual work, m x' x'' omega^2."""
    m = SliderCrank(SMOOTH, omega=OMEGA).mechanism()
    m.constraint(mb.PrescribedMotion("drive", "crank", lambda t: OMEGA * t))
    run = simulate(m.build(formulation=formulation), 0.4, rtol=1e-6, samples=41)
    theta = ca.SX.sym("theta")
    x, slope = slide(theta), ca.gradient(slide(theta), theta)
    moment = 5.0 * OMEGA**2 * slope * ca.gradient(slope, theta)
    expected = ca.Function("x", [theta], [x, moment]).map(run.t.size)(OMEGA * run.t)
    name = "slider" if formulation == "joint" else "block_x"
    assert run[name] == pytest.approx(expected[0].full()[0], abs=1e-13)
    assert run["drive_moment"] == pytest.approx(expected[1].full()[0], abs=1e-10)
    assert max(run["constraint_position"].max(), run["constraint_velocity"].max()) < 1e-13
    assert run["constraint_acceleration"].max() < 1e-11


def test_accelerated_arm_needs_inertia_times_acceleration_and_weight() -> None:
    m = rod()
    alpha = Variable("alpha", "rad/s^2", start=3.0)
    m.constraint(mb.PrescribedMotion("motor", "hinge", lambda t: alpha.symbol * t * t / 2))
    run = simulate(m.build((alpha,)), 2.0, p={"alpha": 5.0}, rtol=1e-8)
    expected = (0.1 + 2.0 * 0.16) * 5.0 + 2.0 * 9.81 * 0.4 * np.sin(2.5 * run.t**2)
    assert run["motor_moment"] == pytest.approx(expected, abs=1e-11)


@pytest.mark.parametrize(
    ("number", "direction", "k"),
    [(3, "y", 1), *(pytest.param(*each, marks=pytest.mark.slow) for each in (
        (0, "turn", 0), (2, "slide", 0), (4, "turn", 2)))],
)  # fmt: skip
def test_every_direction_is_driven_alike_in_both_formulations(
    number: int, direction: str, k: int
) -> None:
    """Motion s + s' t + t^2: accelerations of all bodies, reactions of all joints, the force."""
    m = chain(reverse=number > 2)
    q, qd = (values[k] for values in begin(type(m.joints[number]), number))
    m.constraint(mb.PrescribedMotion("d", f"j{number}", lambda t: q + qd * t + t * t, direction))
    made = [m.prepare(formulation=f) for f in FORMULATIONS]
    tree, whole = (solve(one.eq, one.q0, one.qd0) for one in made)
    first = made[0].eq.kin.topology.links[number].first
    assert tree.a[first + k] == pytest.approx(2.0)
    force, same = (next(x for x, label in zip(s.lam, one.labels, strict=True) if label[:2] == "d_")
                   for s, one in zip((tree, whole), made, strict=True))  # fmt: skip
    assert force == pytest.approx(same, rel=1e-10)
    for body, motion in tree.bodies.items():
        assert motion == pytest.approx(whole.bodies[body], rel=1e-10, abs=1e-10), body
    for joint, wrench in tree.reactions.items():
        assert wrench == pytest.approx(whole.reactions[joint], rel=1e-9, abs=1e-8), joint


def winch(kind: str = "user", rate: float = -0.3) -> mb.Mechanism:
    """A bob in the plane x, z on a rope that is pulled in: L = 1 + rate t."""
    m = mb.Mechanism("winch")
    start = (np.sin(0.6), np.cos(0.6), 0.0)
    attach(m, mb.Planar, "bob_at", "bob", mass=2.0, J=0.1, z=Y, x=X, start=start,
           rate=(rate * start[0], rate * start[1], 0.0))  # fmt: skip
    if kind == "user":
        m.constraint(mb.UserConstraint("rope", lambda kin: (
            ca.sumsqr(kin.point("bob")[0]) - (1 + rate * kin.t) ** 2) / 2))  # fmt: skip
    else:
        m.joint(mb.Distance("rope", "ground", "bob", length=1.0))
    return m


@in_both
def test_rope_that_is_pulled_in_swings_faster(formulation: str) -> None:
    """L theta'' = -g sin(theta) - 2 L' theta'."""
    run = simulate(winch().build(formulation=formulation), 2.0, rtol=1e-8, samples=201)

    def rate(t: float, y: np.ndarray) -> list[float]:
        return [y[1], (-9.81 * np.sin(y[0]) + 0.6 * y[1]) / (1 - 0.3 * t)]

    found = solve_ivp(rate, (0, 2), [0.6, 0.0], "DOP853", run.t, rtol=1e-11, atol=1e-12).y[0]
    x = run["bob_at_x" if formulation == "joint" else "bob_x"]
    assert x == pytest.approx((1 - 0.3 * run.t) * np.sin(found), abs=1e-6)
    assert run["constraint_position"].max() < 1e-13
    assert run["constraint_velocity"].max() < 1e-12


@in_both
def test_a_user_rope_equals_the_rope_of_the_library(formulation: str) -> None:
    made = [winch(kind, 0.0).prepare(formulation=formulation) for kind in ("user", "distance")]
    assert made[0].labels[-1 if formulation == "joint" else -2] == "rope_lambda"
    own, ours = (solve(one.eq, one.q0, one.qd0) for one in made)
    for body, motion in own.bodies.items():
        assert motion == pytest.approx(ours.bodies[body], abs=1e-13)


def test_user_constraints_load_bodies_where_they_hold_them() -> None:
    """A moving rod between bodies of the chain, an angle: the same reactions everywhere."""
    m = chain()

    def gap(kin: Kinematics) -> ca.SX:
        return ca.sumsqr(kin.point("b2.out")[0] - kin.point("b5.in")[0])

    at = m.prepare()
    eq = at.eq
    numbers = ca.Function("g", [eq.q, eq.qd], [gap(eq.kin), ca.jtimes(gap(eq.kin), eq.q, eq.qd)])
    value, speed = (float(x) for x in numbers(at.q0, at.qd0))
    j1 = m.joints[1]
    s, rate = (values[0] for values in begin(mb.Prismatic, 1))

    def fixed(kin: Kinematics) -> ca.SX:
        slide = kin.along(j1, "slide")[0]
        return ca.vertcat(gap(kin) - value - speed * kin.t, slide - s - rate * kin.t)

    m.constraint(mb.UserConstraint("own", fixed))
    made = [m.prepare(formulation=f) for f in FORMULATIONS]
    assert made[0].labels[:2] == ("own_lambda_1", "own_lambda_2")
    tree, whole = (solve(one.eq, one.q0, one.qd0) for one in made)
    for joint, wrench in tree.reactions.items():
        assert wrench == pytest.approx(whole.reactions[joint], rel=1e-9, abs=1e-8), joint
    assert tree.a[1] == pytest.approx(0.0, abs=1e-10)
    at = made[1].labels.index("own_lambda_1")
    assert tree.lam[:2] == pytest.approx(whole.lam[at : at + 2], rel=1e-9)


def test_start_against_a_drive_is_refused_and_a_fitting_one_offered() -> None:
    m = mb.Mechanism("m")
    attach(m, mb.Prismatic, "x", "block", start=0.1)
    m.constraint(mb.PrescribedMotion("drive", "x", lambda t: 0.2 + 3.0 * t, "slide"))
    with pytest.raises(ValueError, match=r"positions that satisfy drive_force, .* x = 0\.2;"):
        m.build()
    m.joints = [replace(m.joints[0], start=0.2)]
    with pytest.raises(ValueError, match=r"velocities that satisfy drive_force, .* x_rate = 3;"):
        m.build()
    run = simulate(m.assembled().build(), 1.0)
    assert run["x"] == pytest.approx(0.2 + 3.0 * run.t)


def test_a_run_that_starts_later_starts_where_the_drive_is() -> None:
    m = rod(rate=3.0)
    m.constraint(mb.PrescribedMotion("drive", "hinge", lambda t: 3.0 * t))
    run = simulate(m.build(), 1.5, t_start=1.0, samples=11)
    assert run["hinge"] == pytest.approx(3.0 * run.t, abs=1e-13)


@in_both
def test_motion_that_is_prescribed_twice_is_refused(formulation: str) -> None:
    m = winch()
    m.constraint(mb.UserConstraint("again", lambda kin: ca.sumsqr(kin.point("bob")[0]) - 1))
    with pytest.raises(ValueError, match="constraint 'rope': expected motion that no other "
                       "constraint fixes, got one that depends on again_lambda"):  # fmt: skip
        m.build(formulation=formulation)


def test_named_functions_take_time_where_it_matters() -> None:
    m = winch()
    phi = mb.functions(m)["constraints"]
    assert phi.name_in() == ["q", "p", "t"]
    assert float(phi([0.0, 0.7, 0.0], [], 1.0)[0]) == pytest.approx(0.0)
    assert mb.functions(winch("distance", 0.0))["constraints"].name_in() == ["q", "p"]


def test_derivatives_by_a_parameter_of_the_motion_are_exact() -> None:
    """For hinge = A sin(w t): d hinge / dA = sin(w t), also where A moves the start."""
    A = Variable("A", "rad", start=1.0)
    m = rod(rate=OMEGA)
    m.constraint(mb.PrescribedMotion("drive", "hinge", lambda t: A.symbol * ca.sin(OMEGA * t)))
    run = simulate(m.build((A,)), 0.5, sensitivities=("A",), samples=11)
    assert run.sensitivities["A"]["hinge"] == pytest.approx(np.sin(OMEGA * run.t), abs=1e-12)


def test_a_hinge_that_closes_a_loop_is_driven_through_full_turns() -> None:
    """The crank's own hinge, cylindrical, is cut; the coupler pin fixes the rest."""
    scene = FourBar(SMOOTH)
    free, m = scene.mechanism(), scene.mechanism()
    crank = m.joints[0]
    beta, gamma, beta_rate, gamma_rate = scene.closed()
    m.joints = [
        mb.Cylindrical("crank", crank.parent, crank.child),
        mb.Revolute("coupler", "coupler_rod.far", "rocker_rod.far", gamma - beta,
                 gamma_rate - beta_rate),
        m.joints[2],
        mb.Revolute("knee", "coupler_rod.near", "crank_rod.far", 1.0 - beta, 10.0 - beta_rate),
    ]  # fmt: skip
    for each, name in ((m, "crank"), (free, "theta_crank")):
        each.constraint(mb.PrescribedMotion("drive", name, lambda t: 1.0 + 10.0 * t))
    cut, whole = (simulate(each.build(), 2.0, rtol=1e-6, samples=101) for each in (m, free))
    assert cut["theta_rocker"] == pytest.approx(whole["theta_rocker"], abs=1e-12)
    assert cut["drive_moment"] == pytest.approx(whole["drive_moment"], abs=1e-9)
    assert np.ptp(whole["theta_crank"]) == pytest.approx(20.0)


def gearbox(ratio: Scalar, offset: float = 0.0) -> mb.Mechanism:
    """Two rotors on parallel axes, a motor of 2 N m on the first."""
    m = mb.Mechanism("gearbox")
    for k, J in enumerate((0.3, 0.7)):
        place = {"at": (float(k), 0.0, 0.0), "start": offset * k}
        attach(m, mb.Revolute, f"r{k}", f"rotor_{k}", J=(0.5, 0.5, J), **place)
    m.constraint(mb.Gear("gear", "r0", "r1", ratio, offset))
    m.force(mb.JointSpringDamper("motor", "r0", actuator=2.0))
    return m


@in_both
@pytest.mark.parametrize("ratio", [-2.0, 1 / 3])
def test_inertias_add_up_by_the_square_of_the_ratio(ratio: float, formulation: str) -> None:
    """a = tau / (J1 + r^2 J2), and the moment in the gear is J2 r a."""
    made = gearbox(ratio).prepare(formulation=formulation)
    found = solve(made.eq, made.q0, made.qd0)
    a = 2.0 / (0.3 + ratio**2 * 0.7)
    assert found.bodies["rotor_0"][2] == pytest.approx(a, rel=1e-13)
    assert found.bodies["rotor_1"][2] == pytest.approx(ratio * a, rel=1e-13)
    moment = found.lam[made.labels.index("gear_moment")]
    assert moment == pytest.approx(0.7 * ratio * a, rel=1e-12)


@in_both
def test_gears_go_through_full_turns(formulation: str) -> None:
    """After 2.5 s the first has made two turns; the second still is where the ratio says."""
    ratio = -20 / 37
    run = simulate(gearbox(ratio, 0.4).build(formulation=formulation), 2.5, rtol=1e-7, samples=200)
    a = 2.0 / (0.3 + ratio**2 * 0.7)
    angle = a * run.t**2 / 2
    if formulation == "joint":
        first, second = run["r0"], run["r1"]
    else:
        first, second = (
            np.unwrap(2 * np.arctan2(run[f"rotor_{k}_e3"], run[f"rotor_{k}_e0"])) for k in range(2)
        )
    assert first == pytest.approx(angle, abs=1e-4)
    assert second - second[0] == pytest.approx(ratio * first, abs=1e-9)
    assert angle[-1] > 3.5 * pi
    assert run["constraint_position"].max() < 1e-12


def test_any_ratio_couples_joints_that_count_their_turns() -> None:
    ratio = Variable("ratio", "1", start=-pi / 5)
    run = simulate(gearbox(ratio.symbol).build((ratio,)), 3.0, p={"ratio": -(2**0.5)})
    assert run["r1"] == pytest.approx(-(2**0.5) * run["r0"], rel=1e-12)


def test_other_ratios_are_refused_where_turns_are_not_counted() -> None:
    free = Variable("free", "1", start=1.0)
    path = "coupling 'gear' > ratio: expected a ratio of integers .* angles of r0 and r1 are known"
    for ratio in (pi, free.symbol):
        with pytest.raises(ValueError, match=path):
            gearbox(ratio).build((free,), formulation="absolute")


def test_planetary_gear_obeys_willis() -> None:
    """Ring fixed, carrier driven: the sun turns 1 + z_ring / z_sun times as fast."""
    z_sun, z_planet, z_ring = 20, 15, 50
    m = mb.Mechanism("planetary")
    attach(m, mb.Revolute, "carrier_turn", "carrier", rate=3.0)
    attach(m, mb.Revolute, "sun_turn", "sun", "carrier")
    attach(m, mb.Revolute, "planet_turn", "planet", "carrier", at=(0.35, 0.0, 0.0))
    # seen from the carrier the ring turns backwards
    m.constraint(mb.Gear("ring", "carrier_turn", "planet_turn", -z_ring / z_planet))
    m.constraint(mb.Gear("sun_gear", "sun_turn", "planet_turn", -z_sun / z_planet))
    m.constraint(mb.PrescribedMotion("drive", "carrier_turn", lambda t: 3.0 * t))
    run = simulate(m.assembled().build(), 2.0)
    sun = run["carrier_turn"] + run["sun_turn"]
    assert sun == pytest.approx((1 + z_ring / z_sun) * 3.0 * run.t, rel=1e-12, abs=1e-12)


@in_joint_coordinates_first
def test_a_disc_rolls_down_an_incline(formulation: str) -> None:
    """a = g sin(beta) / (1 + J / (m r^2)); the track holds J a / r^2 and the weight."""
    r, mass, J, beta = 0.2, 3.0, 0.09, 0.3
    a = 9.81 * sin(beta) / (1 + J / (mass * r * r))
    m = mb.Mechanism("incline")
    # y = z x x points down through the track, which lies at y = r
    attach(m, mb.Planar, "at", "disc", mass=mass, J=J, z=Y, x=(np.cos(beta), 0.0, -np.sin(beta)))
    m.constraint(mb.PrescribedMotion("track", "at", lambda t: 0.0, "y"))
    m.constraint(mb.Rolling("grip", "at", "at", radius=r, direction_b="x"))
    run = simulate(m.build(formulation=formulation), 2.0, rtol=1e-8, samples=200)
    if formulation == "joint":
        assert run["at_x"] == pytest.approx(a * run.t**2 / 2, abs=1e-5)
        assert run["at_angle"] == pytest.approx(run["at_x"] / r, rel=1e-12, abs=1e-12)
        assert run["at_angle"][-1] > 2 * pi
    assert run["grip_force"] == pytest.approx(-J * a / r**2, rel=1e-9)
    assert np.abs(run["track_force"]) == pytest.approx(mass * 9.81 * np.cos(beta), rel=1e-9)
    assert np.ptp(run["energy"]) < 1e-7
    assert run["constraint_position"].max() < 1e-12


@in_joint_coordinates_first
def test_a_nut_falls_along_its_thread(formulation: str) -> None:
    """With h = lead / (2 pi): a = g m h^2 / (m h^2 + J), turning 16 times."""
    lead, mass, J = 0.3, 2.0, 0.02
    h = lead / (2 * pi)
    a = -9.81 * mass * h * h / (mass * h * h + J)
    m = mb.Mechanism("screw")
    attach(m, mb.Cylindrical, "thread", "nut", mass=mass, J=J)
    m.constraint(mb.Screw("pitch", "thread", lead))
    run = simulate(m.build(formulation=formulation), 2.0, rtol=1e-8, samples=200)
    z = run["thread_slide" if formulation == "joint" else "nut_z"]
    assert z == pytest.approx(a * run.t**2 / 2, abs=1e-6)
    assert abs(z[-1]) > 10 * lead
    assert run["pitch_force"] == pytest.approx(mass * (a + 9.81), rel=1e-8)


def test_an_offset_is_part_of_a_consistent_start() -> None:
    m = gearbox(2.0)
    m.constraints = [mb.Gear("gear", "r0", "r1", 2.0, 0.5)]
    with pytest.raises(ValueError, match=r"positions that satisfy gear_moment, got 0\.5; near it"):
        m.build()
    first, second, *_ = m.assembled().build().initial_state()
    assert second == pytest.approx(2.0 * first + 0.5)
