"""Gears, rolling and screws: reduced inertias, full turns, both formulations."""

from math import pi, sin

import numpy as np
import pytest
from chains import X, Y, Z, attach, solve

from symfric import simulate
from symfric.foundation.numeric import Scalar
from symfric.foundation.parameters import Variable
from symfric.multibody import (
    Cylindrical,
    Gear,
    JointSpringDamper,
    Mechanism,
    Planar,
    PrescribedMotion,
    Prismatic,
    Revolute,
    Rolling,
    Screw,
)

in_both = pytest.mark.parametrize("formulation", ["joint", "absolute"])


def gearbox(ratio: Scalar, offset: float = 0.0) -> Mechanism:
    """Two rotors on parallel axes, a motor of 2 N m on the first."""
    m = Mechanism("gearbox")
    for k, J in enumerate((0.3, 0.7)):
        place = {"at": (float(k), 0.0, 0.0), "start": offset * k}
        attach(m, Revolute, f"r{k}", f"rotor_{k}", J=(0.5, 0.5, J), **place)
    m.constraint(Gear("gear", "r0", "r1", ratio, offset))
    m.force(JointSpringDamper("motor", "r0", actuator=2.0))
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
    """After 5 s the first has made almost 8 turns; the second still is where the ratio says."""
    ratio = -20 / 37
    run = simulate(gearbox(ratio, 0.4).build(formulation=formulation), 5.0, rtol=1e-7, samples=400)
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
    assert angle[-1] > 7 * 2 * pi
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
    m = Mechanism("planetary")
    attach(m, Revolute, "carrier_turn", "carrier", rate=3.0)
    attach(m, Revolute, "sun_turn", "sun", "carrier")
    attach(m, Revolute, "planet_turn", "planet", "carrier", at=(0.35, 0.0, 0.0))
    # seen from the carrier the ring turns backwards
    m.constraint(Gear("ring", "carrier_turn", "planet_turn", -z_ring / z_planet))
    m.constraint(Gear("sun_gear", "sun_turn", "planet_turn", -z_sun / z_planet))
    m.constraint(PrescribedMotion("drive", "carrier_turn", lambda t: 3.0 * t))
    run = simulate(m.assembled().build(), 2.0)
    sun = run["carrier_turn"] + run["sun_turn"]
    assert sun == pytest.approx((1 + z_ring / z_sun) * 3.0 * run.t, rel=1e-12, abs=1e-12)


@in_both
def test_a_disc_rolls_down_an_incline(formulation: str) -> None:
    """a = g sin(beta) / (1 + J / (m r^2)); the track holds J a / r^2 and the weight."""
    r, mass, J, beta = 0.2, 3.0, 0.09, 0.3
    a = 9.81 * sin(beta) / (1 + J / (mass * r * r))
    m = Mechanism("incline")
    # y = z x x points down through the track, which lies at y = r
    attach(m, Planar, "at", "disc", mass=mass, J=J, z=Y, x=(np.cos(beta), 0.0, -np.sin(beta)))
    m.constraint(PrescribedMotion("track", "at", lambda t: 0.0, "y"))
    m.constraint(Rolling("grip", "at", "at", radius=r, direction_b="x"))
    run = simulate(m.build(formulation=formulation), 2.0, rtol=1e-8, samples=200)
    if formulation == "joint":
        assert run["at_x"] == pytest.approx(a * run.t**2 / 2, abs=1e-5)
        assert run["at_angle"] == pytest.approx(run["at_x"] / r, rel=1e-12, abs=1e-12)
        assert run["at_angle"][-1] > 2 * pi
    assert run["grip_force"] == pytest.approx(-J * a / r**2, rel=1e-9)
    assert np.abs(run["track_force"]) == pytest.approx(mass * 9.81 * np.cos(beta), rel=1e-9)
    assert np.ptp(run["energy"]) < 1e-7
    assert run["constraint_position"].max() < 1e-12


@in_both
def test_a_nut_falls_along_its_thread(formulation: str) -> None:
    """With h = lead / (2 pi): a = g m h^2 / (m h^2 + J), turning 16 times."""
    lead, mass, J = 0.3, 2.0, 0.02
    h = lead / (2 * pi)
    a = -9.81 * mass * h * h / (mass * h * h + J)
    m = Mechanism("screw")
    attach(m, Cylindrical, "thread", "nut", mass=mass, J=J)
    m.constraint(Screw("pitch", "thread", lead))
    run = simulate(m.build(formulation=formulation), 2.0, rtol=1e-8, samples=200)
    z = run["thread_slide" if formulation == "joint" else "nut_z"]
    assert z == pytest.approx(a * run.t**2 / 2, abs=1e-6)
    assert abs(z[-1]) > 10 * lead
    assert run["pitch_force"] == pytest.approx(mass * (a + 9.81), rel=1e-8)


def test_an_offset_is_part_of_a_consistent_start() -> None:
    m = gearbox(2.0)
    m.constraints = [Gear("gear", "r0", "r1", 2.0, 0.5)]
    with pytest.raises(ValueError, match=r"positions that satisfy gear_moment, got 0\.5; near it"):
        m.build()
    first, second, *_ = m.assembled().build().initial_state()
    assert second == pytest.approx(2.0 * first + 0.5)


@in_both
def test_a_pinion_and_its_rack_feel_each_others_inertia(formulation: str) -> None:
    """Force 5 N on the rack: a = 5 / (m + J / r^2)."""
    m = Mechanism("rack")
    attach(m, Prismatic, "x", "rack", mass=2.0, z=X, x=Z)
    attach(m, Revolute, "angle", "pinion", J=(0.1, 0.1, 0.06), at=(0.0, 0.1, 0.0))
    m.constraint(Rolling("mesh", "angle", "x", radius=-0.1))
    m.force(JointSpringDamper("push", "x", "slide", actuator=5.0))
    made = m.prepare(formulation=formulation)
    found = solve(made.eq, made.q0, made.qd0)
    a = 5.0 / (2.0 + 0.06 / 0.01)
    assert found.bodies["rack"][3] == pytest.approx(a, rel=1e-13)
    assert found.bodies["pinion"][2] == pytest.approx(-a / 0.1, rel=1e-13)
    assert found.lam[made.labels.index("mesh_force")] == pytest.approx(2.0 * a - 5.0, rel=1e-12)
