"""Extremes, works and areas of a run, and its balance of energy."""

from dataclasses import replace
from itertools import pairwise
from math import pi, sqrt

import casadi as ca
import numpy as np
import pytest
from chains import X, attach, in_joint_coordinates_first
from hybrid import ball
from matplotlib.lines import Line2D

import symfric as sf
from symfric.model import Event, Output
from symfric.multibody import JointSpringDamper, Mechanism, PrescribedMotion, Prismatic, Revolute
from symfric.results.pictures import plot_trajectories
from symfric.results.signals import extremes, looks
from symfric.results.trajectory import EnergyBalance
from symfric.scenes import MECHANISMS, FourBar, FourMass, Pendulum, Prescribed, SliderCrank


def circle() -> sf.Trajectory:
    """x = cos t, v = -sin t over two turns, with signals of them and of time."""
    x, v, t = sf.Variable("x", "m", start=1.0), sf.Variable("v", "m/s"), ca.SX.sym("t")
    outputs = {"size": Output(ca.fabs(v.symbol), "m/s"), "late": Output(t * x.symbol, "m s")}
    ode = ca.vertcat(v.symbol, -x.symbol)
    model = sf.Model("circle", x=(x, v), t=t, ode=ode, outputs=outputs)
    return sf.simulate(model, 4 * np.pi, rtol=1e-10, t_eval=[0.0, 4 * np.pi])


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
    run = sf.simulate(sf.rabinowicz(sf.Coulomb()), 5.0, rtol=1e-8, t_eval=[0.0, 5.0])
    assert run.work("friction", "v_rel") == pytest.approx(run.integral("power")[-1], rel=1e-7)
    halves = run.work("friction", "v_rel", (0.0, 2.0)) + run.work("friction", "v_rel", (2.0, 5.0))
    assert halves == pytest.approx(run.work("friction", "v_rel"), rel=1e-10)
    assert run.work("friction", "v_rel", (1.0, 1.0)) == 0.0


def test_what_has_no_area_and_times_that_are_none_are_refused() -> None:
    run = sf.simulate(
        Prescribed(sf.Viscous()).model(), 1.0, u={"v": sf.Hold([0.0], [0.5])}, t_eval=[1.0]
    )
    for call, message in (
        (lambda: run.area("friction", "v"), "area: expected an x of the states and time"),
        (lambda: run.work("friction", "v", (1.0, 0.5)), "between: expected a first and a later"),
        (lambda: run.work("friction", "v", (0.0, 1.5)), r"expected times in \[0, 1\] s"),
        (lambda: run.work("frictio", "v"), "did you mean friction"),
    ):
        with pytest.raises(ValueError, match=message):
            call()


AT, WIDTH = 5.1234, 1e-3


def hit() -> sf.Trajectory:
    """A pulse of 564 N for a thousandth of a second, looked at in tenths of a second."""
    force = {"force": lambda t: ca.exp(-(((t - AT) / WIDTH) ** 2)) / (WIDTH * sqrt(pi))}
    return sf.simulate(sf.drive(sf.BrownMcPhee()), 10.0, u=force, samples=101, backend="vm")


def test_a_pulse_between_the_samples_is_the_greatest_value_and_in_the_picture() -> None:
    run = hit()
    assert run["force"].max() < 1e-3
    assert run.extremes["force"] == pytest.approx((0.0, 1 / (WIDTH * sqrt(pi))), rel=1e-4)
    figure = plot_trajectories({"hit": run}, ["force"])
    (line,) = (artist for artist in figure.axes[0].get_children() if isinstance(artist, Line2D))
    assert np.max(line.get_ydata()) > 500


def test_extremes_between_steps_are_refined() -> None:
    x, v = sf.Variable("x", "m", start=1.0), sf.Variable("v", "m/s")
    swing = sf.Model("swing", x=(x, v), ode=ca.vertcat(v.symbol, -x.symbol))
    run = sf.simulate(swing, 10.0, samples=2, rtol=1e-9, backend="vm")
    for name in ("x", "v"):
        assert run.extremes[name] == pytest.approx((-1.0, 1.0), abs=1e-6)
    times = np.linspace(0.0, 10.0, 30)
    found = extremes(times, {"a": np.sin(times)}, lambda at: {"a": np.sin(at)})
    assert found["a"] == pytest.approx([-1.0, 1.0], abs=1e-5)


def test_the_value_just_before_a_jump_counts() -> None:
    """A ball is fastest when it hits the ground, where its velocity turns over."""
    run = sf.simulate(ball(0.8), 0.6, samples=2, backend="vm")
    (hit, _), *_ = run.happened
    least = run.extremes["v"][0]
    assert least == pytest.approx(-9.81 * hit, rel=1e-9)
    assert run.at_looks("v").min() == pytest.approx(least, rel=1e-9)


def test_looks_show_samples_steps_their_middles_and_both_sides_of_jumps() -> None:
    found = looks(np.array([0.0, 2.0]), np.array([0.0, 1.0, 2.0]), np.array([1.0, 3.0]))
    assert found.tolist() == [0.0, 0.5, np.nextafter(1.0, 0.0), 1.0, 1.5, 2.0]


def test_what_was_reached_has_extremes_too() -> None:
    x = sf.Variable("x", "m", start=1.0)
    with pytest.raises(sf.SolveError) as failed:
        sf.simulate(sf.Model("blow up", x=(x,), ode=x.symbol**2), 2.0)
    least, greatest = failed.value.partial.extremes["x"]
    assert least == 1.0
    assert greatest > 1e3


pytestmark = pytest.mark.heavy

LAW = sf.BrownMcPhee(v_t=0.05)


def slider(*forces: JointSpringDamper) -> Mechanism:
    """2 kg on a level guide that start with 3 m/s."""
    m = Mechanism("slider", gravity=(0.0, 0.0, 0.0))
    attach(m, Prismatic, "x", "block", mass=2.0, z=X, rate=3.0)
    for force in forces:
        m.force(force)
    return m


def test_integral_sees_the_jumps_of_an_input() -> None:
    block = slider(JointSpringDamper("motor", "x", "slide"))
    block.forces[0] = replace(block.forces[0], actuator=block.input("F", "N"))
    u = {"F": sf.Hold([0.0, 0.7, 1.1], [5.0, -2.0, 1.0])}
    run = sf.simulate(block.build(), 2.0, u=u, rtol=1e-9, t_eval=[2.0])
    assert run.integral("F") == pytest.approx([5 * 0.7 - 2 * 0.4 + 0.9])
    assert run.energy_balance().defect == pytest.approx([0.0], abs=1e-9)


def test_damper_dissipates_the_energy_of_the_closed_form() -> None:
    """m v' = -d v: the energy falls with exp(-2 d t / m), all of it into the damper."""
    run = sf.simulate(slider(JointSpringDamper("oil", "x", "slide", damping=0.8)).build(), 3.0,
                   rtol=1e-9)  # fmt: skip
    balance = run.energy_balance()
    assert balance.work["oil"] == pytest.approx(9 * (np.exp(-0.8 * run.t) - 1), abs=1e-7)
    assert balance.energy == pytest.approx(9 * np.exp(-0.8 * run.t), abs=1e-7)
    assert balance.relative < 1e-8
    assert balance.scale == pytest.approx(9.0)
    numbers = balance.to_dict()
    assert numbers["end"] - numbers["start"] == pytest.approx(numbers["work"]["oil"], abs=1e-6)
    assert numbers["relative"] == balance.relative


def test_motor_that_moves_its_spring_counts_with_its_whole_power() -> None:
    """The rest of a spring follows an input; the energy of the bodies alone is the balance's."""
    m = slider()
    rest = m.input("rest", "m")
    m.force(JointSpringDamper("wound", "x", "slide", stiffness=50.0, rest=rest))
    run = sf.simulate(m.build(), 2.0, u={"rest": lambda t: 0.2 * ca.sin(3 * t)}, rtol=1e-10)
    balance = run.energy_balance()
    assert balance.energy == pytest.approx(run["kinetic"])
    assert np.ptp(balance.work["wound"]) > 1.0
    assert balance.relative < 1e-8


@in_joint_coordinates_first
def test_drive_lifts_and_pays_for_friction(formulation: str) -> None:
    """A rod swung by a drive: angle 0.8 sin(2 t), friction in its hinge."""
    m = Pendulum(LAW).mechanism()
    m.joints[0] = replace(m.joints[0], start=0.0, rate=1.6)
    m.constraint(PrescribedMotion("motor", "phi", lambda t: 0.8 * ca.sin(2 * t)))
    balance = sf.simulate(m.build(formulation=formulation), 2.0, rtol=1e-9).energy_balance()
    angle, rate = 0.8 * np.sin(2 * balance.t), 1.6 * np.cos(2 * balance.t)
    assert balance.energy == pytest.approx(rate**2 / 6 - 9.81 * 0.5 * np.cos(angle), abs=1e-8)
    assert balance.work["friction"][-1] < -0.05
    assert set(balance.work) == {"drive", "friction"}
    assert balance.relative < 1e-8


SCENES = {"four_mass": (FourMass(LAW), 2.0), "slider_crank": (SliderCrank(LAW), 0.25)}


@pytest.mark.parametrize("name", SCENES)
def test_friction_explains_the_loss_of_energy(name: str) -> None:
    scene, until = SCENES[name]
    run = sf.simulate(scene.model(), until, rtol=1e-8)
    balance = run.energy_balance()
    lost = balance.energy[0] - balance.energy[-1]
    assert lost > 0.1 * balance.scale
    assert lost == pytest.approx(-balance.work["friction"][-1], rel=1e-7)
    assert balance.relative < 1e-7
    assert np.diff(balance.work["friction"]).max() <= 1e-12 * balance.scale


def test_a_wrong_friction_power_shows() -> None:
    """One part in ten thousand of it is a thousand times what the integrator leaves open."""
    model = FourMass(LAW).model()
    name = "friction_work_rate"
    off = dict(model.further)
    off[name] = replace(off[name], expression=(1 + 1e-4) * off[name].expression)
    right, wrong = (
        sf.simulate(m, 0.6, rtol=1e-8).energy_balance()
        for m in (model, replace(model, details=lambda: off))
    )
    assert wrong.relative > 1e3 * right.relative
    assert wrong.defect[-1] == pytest.approx(-1e-4 * right.work["friction"][-1], rel=1e-2)


@pytest.mark.parametrize(("method", "order"), [("rodas3", 3), ("rodas5p", 5)])
def test_the_defect_has_the_order_of_the_method(method: str, order: int) -> None:
    model = FourBar(sf.BrownMcPhee(v_t=0.1)).model()
    runs = [sf.simulate(model, 0.25, rtol=rtol, method=method) for rtol in (1e-6, 1e-8)]
    steps = [run.statistics.steps for run in runs]
    defects = [abs(run.energy_balance().defect).max() for run in runs]
    found = np.log(defects[0] / defects[1]) / np.log(steps[1] / steps[0])
    assert found == pytest.approx(order, abs=0.8)


def test_energy_that_a_reset_takes_is_defect() -> None:
    """The block loses half its speed at x = 1, three quarters of 9 J, at once."""
    model = slider().build()
    x, v = (model.x[i].symbol for i in range(2))
    bump = Event("bump", x - 1.0, 1, reset={"x_rate": v / 2})
    run = sf.simulate(replace(model, events=(bump,)), 1.0, rtol=1e-8)
    assert run.energy_balance().defect[-1] == pytest.approx(-6.75)


def test_nothing_moves_and_nothing_is_missing() -> None:
    m = Mechanism("rest", gravity=(0.0, 0.0, 0.0))
    attach(m, Revolute, "turn", "bob")
    balance = sf.simulate(m.build(), 1.0).energy_balance()
    assert (balance.scale, balance.relative, balance.work) == (0.0, 0.0, {})
    zero = np.zeros(3)
    books = EnergyBalance(np.arange(3.0), zero - 4.9, {}, zero + 1e-48, 1e-48)
    assert books.relative == 0.0  # it rests but for rounding
    assert replace(books, defect=zero + 1e-9, scale=1e-3).relative == 1e-6
    with pytest.raises(ValueError, match="'rabinowicz': expected a mechanism, got a model w"):
        sf.simulate(sf.rabinowicz(LAW), 0.1).energy_balance()


@pytest.mark.slow
@pytest.mark.parametrize("name", ["four_mass", "slider_crank", "double_pendulum", "pendulum_box"])
def test_frictionless_drift_over_100_s(name: str) -> None:
    """Far below the requested 1e-6: 3e-9 at most."""
    smooth = sf.BrownMcPhee(mu_s=0.0, mu_d=0.0)
    run = sf.simulate(MECHANISMS[name](smooth).model(), 100.0, rtol=1e-10)
    assert run.energy_balance().relative < 1e-7
