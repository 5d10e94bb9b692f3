"""Work by quadrature and the balance of energy: exact where it can be, and wrong where it must."""

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from chains import X, attach

from symfric import BrownMcPhee, Hold, LuGre, rabinowicz, simulate
from symfric.model import Event
from symfric.multibody import JointSpringDamper, Mechanism, PrescribedMotion, Prismatic, Revolute
from symfric.results.trajectory import EnergyBalance
from symfric.scenes import MECHANISMS, FourBar, FourMass, Pendulum, SliderCrank

pytestmark = pytest.mark.heavy

LAW = BrownMcPhee(v_t=0.05)


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
    u = {"F": Hold([0.0, 0.7, 1.1], [5.0, -2.0, 1.0])}
    run = simulate(block.build(), 2.0, u=u, rtol=1e-9, t_eval=[2.0])
    assert run.integral("F") == pytest.approx([5 * 0.7 - 2 * 0.4 + 0.9])
    assert run.energy_balance().defect == pytest.approx([0.0], abs=1e-9)


def test_work_of_friction_is_the_heat_of_the_belt() -> None:
    """Of a block at rest on average, the belt's power m g mu v and that of friction add up."""
    run = simulate(rabinowicz(LuGre()), 2.0, rtol=1e-8)
    kinetic = 0.4 * (run["v"] ** 2 - run["v"][0] ** 2) + 1.05 * (run["x"] ** 2 - run["x"][0] ** 2)
    belt = np.array([-0.1 * w for w in run.integral("friction")])
    assert kinetic == pytest.approx(belt - run.integral("power"), abs=1e-7)


def test_damper_takes_what_the_closed_form_says() -> None:
    """m v' = -d v: the energy falls with exp(-2 d t / m), all of it into the damper."""
    run = simulate(slider(JointSpringDamper("oil", "x", "slide", damping=0.8)).build(), 3.0,
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
    run = simulate(m.build(), 2.0, u={"rest": lambda t: 0.2 * ca.sin(3 * t)}, rtol=1e-10)
    balance = run.energy_balance()
    assert balance.energy == pytest.approx(run["kinetic"])
    assert np.ptp(balance.work["wound"]) > 1.0
    assert balance.relative < 1e-8


@pytest.mark.parametrize("formulation", ["joint", "absolute"])
def test_drive_lifts_and_pays_for_friction(formulation: str) -> None:
    """A rod swung by a drive: angle 0.8 sin(2 t), friction in its hinge."""
    m = Pendulum(LAW).mechanism()
    m.joints[0] = replace(m.joints[0], start=0.0, rate=1.6)
    m.constraint(PrescribedMotion("motor", "phi", lambda t: 0.8 * ca.sin(2 * t)))
    balance = simulate(m.build(formulation=formulation), 2.0, rtol=1e-9).energy_balance()
    angle, rate = 0.8 * np.sin(2 * balance.t), 1.6 * np.cos(2 * balance.t)
    assert balance.energy == pytest.approx(rate**2 / 6 - 9.81 * 0.5 * np.cos(angle), abs=1e-8)
    assert balance.work["friction"][-1] < -0.05
    assert set(balance.work) == {"drive", "friction"}
    assert balance.relative < 1e-8


SCENES = {"four_mass": (FourMass(LAW), 4.0), "slider_crank": (SliderCrank(LAW), 0.25)}


@pytest.mark.parametrize("name", SCENES)
def test_friction_explains_the_loss_of_energy(name: str) -> None:
    scene, until = SCENES[name]
    run = simulate(scene.model(), until, rtol=1e-8)
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
        simulate(m, 4.0, rtol=1e-8).energy_balance()
        for m in (model, replace(model, details=lambda: off))
    )
    assert wrong.relative > 1e3 * right.relative
    assert wrong.defect[-1] == pytest.approx(-1e-4 * right.work["friction"][-1], rel=1e-2)


@pytest.mark.parametrize(("method", "order"), [("rodas3", 3), ("rodas5p", 5)])
def test_the_defect_has_the_order_of_the_method(method: str, order: int) -> None:
    model = FourBar(BrownMcPhee(v_t=0.1)).model()
    runs = [simulate(model, 0.25, rtol=rtol, method=method) for rtol in (1e-6, 1e-9)]
    steps = [run.statistics.steps for run in runs]
    defects = [abs(run.energy_balance().defect).max() for run in runs]
    found = np.log(defects[0] / defects[1]) / np.log(steps[1] / steps[0])
    assert found == pytest.approx(order, abs=0.8)


def test_energy_that_a_reset_takes_is_defect() -> None:
    """The block loses half its speed at x = 1, three quarters of 9 J, at once."""
    model = slider().build()
    x, v = (model.x[i].symbol for i in range(2))
    bump = Event("bump", x - 1.0, 1, reset={"x_rate": v / 2})
    run = simulate(replace(model, events=(bump,)), 1.0, rtol=1e-8)
    assert run.energy_balance().defect[-1] == pytest.approx(-6.75)


def test_nothing_moves_and_nothing_is_missing() -> None:
    m = Mechanism("rest", gravity=(0.0, 0.0, 0.0))
    attach(m, Revolute, "turn", "bob")
    balance = simulate(m.build(), 1.0).energy_balance()
    assert (balance.scale, balance.relative, balance.work) == (0.0, 0.0, {})
    zero = np.zeros(3)
    books = EnergyBalance(np.arange(3.0), zero - 4.9, {}, zero + 1e-48, 1e-48)
    assert books.relative == 0.0  # it rests but for rounding
    assert replace(books, defect=zero + 1e-9, scale=1e-3).relative == 1e-6
    with pytest.raises(ValueError, match="'rabinowicz': expected a mechanism, got a model that"):
        simulate(rabinowicz(LAW), 0.1).energy_balance()


@pytest.mark.slow
@pytest.mark.parametrize("name", ["four_mass", "slider_crank", "double_pendulum", "pendulum_box"])
def test_frictionless_drift_over_100_s(name: str) -> None:
    """Far below the 1e-6 that are asked for: 3e-9 at most."""
    smooth = BrownMcPhee(mu_s=0.0, mu_d=0.0)
    run = simulate(MECHANISMS[name](smooth).model(), 100.0, rtol=1e-10)
    assert run.energy_balance().relative < 1e-7
