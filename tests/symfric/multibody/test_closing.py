"""Friction in the joints that close loops: the same whichever joint it is, and as it must be."""

from math import cos, sin
from typing import Any

import numpy as np
import pytest
from chains import X, Z, attach
from mechanics import brown_mcphee, four_bar_with_friction
from scipy.integrate import solve_ivp

from symfric import BrownMcPhee, Dahl, ExactCoulomb, SolveError, Trajectory, simulate
from symfric import multibody as mb
from symfric.integrator.equations.inputs import input_data
from symfric.integrator.methods.tableaux import METHODS
from symfric.integrator.running.diagnosis import dead_centre
from symfric.integrator.running.integrator import Integrator
from symfric.laws import Law, LoadNormalised, MaxwellSlip
from symfric.scenes import FourBar

pytestmark = pytest.mark.heavy

LAW = BrownMcPhee(mu_s=0.3, mu_d=0.2, v_t=1e-2)
COULOMB = BrownMcPhee(mu_s=0.2, mu_d=0.2, v_t=1e-5)
"""0.2 N at any speed above 0.1 mm/s."""
HINGES = ("theta_crank", "theta_coupler", "pin", "theta_rocker")


def four_bar(cut: str, law: Law = LAW) -> mb.Mechanism:
    """The scene with friction in all four hinges, one of which closes the loop."""
    scene = FourBar(law)
    m, friction = scene.mechanism(), mb.JointFriction(law, radius=scene.R)
    beta, gamma, beta_rate, gamma_rate = scene.closed()
    starts = {
        "theta_crank": (scene.angle, scene.omega),
        "theta_coupler": (beta - scene.angle, beta_rate - scene.omega),
        "theta_rocker": (gamma, gamma_rate),
        "pin": (beta - gamma, beta_rate - gamma_rate),
    }
    m.joints = [
        mb.PlanarRevolute(j.name, j.parent, j.child, friction=friction)
        if j.name == cut
        else mb.Revolute(j.name, j.parent, j.child, *starts[j.name], friction)
        for j in m.joints
    ]
    return m


@pytest.fixture(scope="module")
def closed_by_the_pin() -> Trajectory:
    """As the scene has it."""
    model = FourBar(LAW, pin=LAW).model()
    return simulate(model, 0.1, rtol=1e-8, backend="vm", samples=401)


@pytest.mark.parametrize(
    ("cut", "formulation"),
    [("theta_coupler", "joint"), *(pytest.param(*each, marks=pytest.mark.slow) for each in (
        ("theta_crank", "joint"), ("theta_rocker", "joint"), ("pin", "absolute")))],
)  # fmt: skip
def test_motion_loads_and_powers_do_not_depend_on_which_hinge_closes_the_loop(
    cut: str, formulation: str, closed_by_the_pin: Trajectory
) -> None:
    one, model = closed_by_the_pin, four_bar(cut).build(formulation=formulation)
    other = simulate(model, one.t[-1], rtol=1e-8, backend="vm", t_eval=one.t)
    for name in ("coupler_rod_x", "coupler_rod_z", "rocker_rod_x"):
        assert other[name] == pytest.approx(one[name], abs=1e-8)
    for hinge in HINGES:
        assert other[f"{hinge}_N"] == pytest.approx(one[f"{hinge}_N"], rel=1e-5)
        assert other[f"{hinge}_power"] == pytest.approx(one[f"{hinge}_power"], abs=1e-6)


def test_forces_in_all_pins_are_those_of_newton_and_euler(closed_by_the_pin: Trajectory) -> None:
    """Nine accelerations and eight pin forces at once, without a tree."""
    scene = FourBar(LAW)
    beta, gamma, beta_rate, gamma_rate = scene.closed()
    N, _ = four_bar_with_friction(
        (scene.crank, scene.coupler, scene.rocker, scene.base), scene.density, scene.R,
        lambda v: brown_mcphee(v, 0.3, 0.2, 1e-2), (scene.angle, beta, gamma),
        (scene.omega, beta_rate, gamma_rate), scene.g,
    )  # fmt: skip
    assert [closed_by_the_pin[f"{h}_N"][0] for h in HINGES] == pytest.approx(N, rel=1e-7)


def slider_crank(cut: str, length: float | None = None) -> mb.Mechanism:
    """Crank, rod and a slider on a level guide in the plane x, z; friction in all four joints.

    Its guide or its small end closes the loop.
    """
    m = mb.Mechanism("engine", gravity=(0.0, 0.0, -9.81))
    r, rod, theta, omega = 0.1, 0.3, 0.7, 20.0
    down = -np.arcsin(r * sin(theta) / rod)
    down_rate = -r * omega * cos(theta) / (rod * cos(down))
    at = r * cos(theta) + rod * cos(down)
    rate = -r * omega * sin(theta) - rod * down_rate * sin(down)
    m.body("slider_body", 2.0, (1e-2, 1e-2, 1e-2))
    friction, guide = mb.JointFriction(LAW, radius=0.02), mb.JointFriction(LAW, length=length)
    for name, parent, child, reach, half, start, speed in (
        ("bearing", "ground", "crank_body", 0.0, r / 2, theta, omega),
        ("big_end", "crank_body", "rod_body", r, rod / 2, down - theta, down_rate - omega),
        ("small_end", "slider_body", "rod_body", 0.0, None, down, down_rate),
    ):
        kind, begin = (mb.Revolute, {"start": start, "rate": speed})
        if name == cut:
            kind, begin = mb.PlanarRevolute, {}
        to = (rod if half is None else 0.0, 0.0, 0.0)
        attach(m, kind, name, child, parent, J=1e-3, com=(half or 0.0, 0.0, 0.0),
               at=(reach, 0.0, 0.0), to=to, z=(0.0, -1.0, 0.0), x=X, friction=friction,
               **begin)  # fmt: skip
    kind, begin = (mb.Prismatic, {"start": at, "rate": rate})
    if cut == "guide":
        kind, begin = mb.PlanarPrismatic, {}
    attach(m, kind, "guide", "slider_body", z=X, x=Z, friction=guide, **begin)
    return m


def test_a_guide_that_closes_is_a_guide() -> None:
    """Its moment presses at two stations, too: that of friction in the small end."""
    one, other = (
        simulate(slider_crank(cut, 0.05).build(), 0.05, rtol=1e-8, backend="vm", samples=11)
        for cut in ("small_end", "guide")
    )
    for name in ("slider_body_x", "crank_body_z", "rod_body_x"):
        assert other[name] == pytest.approx(one[name], abs=1e-7)
    for name in ("guide", "bearing", "big_end", "small_end"):
        assert other[f"{name}_N"] == pytest.approx(one[f"{name}_N"], rel=1e-5, abs=1e-4)
        assert other[f"{name}_slip"] == pytest.approx(one[f"{name}_slip"], abs=1e-6)
    assert np.abs(other["guide_friction"]).min() > 1.0


def yoke(
    law: Law, r: float, w: float, mass: float, start: float = 0.2, guide: Any = None
) -> mb.Mechanism:
    """A crank whose pin rubs in the slot of a yoke; it turns at w from `start`."""
    m = mb.Mechanism("yoke", gravity=(0.0, 0.0, 0.0))
    at, rate = r * cos(start), -r * w * sin(start)
    attach(m, mb.Revolute, "theta", "crank", J=1e-3, z=(0.0, -1.0, 0.0), x=X, start=start, rate=w)
    attach(m, mb.Prismatic, "x", "yoke", mass=mass, J=1e-3, z=X, x=Z, start=at, rate=rate,
           friction=guide)  # fmt: skip
    m.frame("crank.pin", at=(r, 0.0, 0.0))
    m.frame("yoke.slot", z=Z, x=X)
    m.joint(mb.PinInSlot("slot", "yoke.slot", "crank.pin", friction=mb.JointFriction(law)))
    return m


def test_a_scotch_yoke_is_driven_by_the_moment_of_its_slot() -> None:
    """x = r cos(theta): N = m r w^2 |cos|, the pin slides at r w cos in the slot."""
    r, w, mass = 0.1, 10.0, 2.0
    m = yoke(COULOMB, r, w, mass)
    m.constraint(mb.PrescribedMotion("motor", "theta", lambda t: 0.2 + w * t))
    run = simulate(m.build(), 0.6, backend="vm", samples=31)
    theta = 0.2 + w * run.t
    apart = np.abs(np.cos(theta)) > 0.02  # where it turns back friction changes its sign
    N, slip = mass * r * w * w * np.abs(np.cos(theta)), r * w * np.cos(theta)
    assert run["slot_slip"] == pytest.approx(slip, abs=1e-8)
    assert run["slot_N"] == pytest.approx(N, abs=2e-4)
    inertia = mass * r * r * w * w * np.cos(theta) * np.sin(theta)
    moment = inertia + 0.2 * N * np.abs(slip) / w
    assert run["motor_moment"][apart] == pytest.approx(moment[apart], abs=1e-4)


def test_a_contact_in_its_dead_centre_is_named() -> None:
    """The guide does not slide there in any motion; a microradian away it does."""
    guide = mb.JointFriction(ExactCoulomb(), preload=10.0)
    for start, name in ((0.0, "x"), (1e-6, "")):
        model = yoke(COULOMB, 0.1, 0.0, 2.0, start, guide).assembled().build()
        integrator = Integrator(model, input_data(model, None, 0.0, 1.0), METHODS["rodas5p"])
        y = np.zeros(integrator.system.n)
        y[: len(model.x)] = model.initial_state()
        found = dead_centre(integrator, y, np.zeros(0))
        assert found.startswith(f"contact '{name}'" if name else "")
        assert bool(found) is bool(name)


@pytest.mark.parametrize("law", [Dahl(), MaxwellSlip()], ids=lambda law: type(law).__name__)
def test_bristles_without_damping_that_a_falling_load_stops_are_named(law: Law) -> None:
    """A spring lets go of the yoke. What the error says to write instead is copied, and goes on."""

    def swung(law: Law) -> Trajectory:
        m = yoke(law, 0.1, 0.0, 2.0)
        m.force(mb.JointSpringDamper("spring", "theta", stiffness=20.0))
        return simulate(m.assembled().build(), 0.05, backend="vm", samples=11)

    with pytest.raises(
        SolveError, match=r"force of joint 'slot' with .* falls to zero; below"
    ) as e:
        swung(law)
    name, reported = type(law).__name__, str(e.value)
    advised = reported[reported.index("LoadNormalised(") : reported.index(f" for {name}")].replace(
        "...", ""
    )
    run = swung(eval(advised, {"LoadNormalised": LoadNormalised, name: type(law)}))
    assert np.abs(run.energy_balance().defect).max() < 1e-4


def test_a_bead_on_a_turning_wire_is_pressed_by_coriolis_and_weight() -> None:
    """r'' = w^2 r - mu sqrt((2 w r')^2 + g^2), on a level wire; slip is that in its frame."""
    w, g, r0, v0 = 3.0, 9.81, 0.2, 1.0
    m = mb.Mechanism("wire", gravity=(0.0, 0.0, -g))
    attach(m, mb.Revolute, "turn", "hub", rate=w)
    m.body("bead", 0.1, (1e-6, 1e-6, 1e-6))
    m.frame("hub.wire", z=X)
    start, rate = (r0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0), (v0, r0 * w, 0.0, 0.0, 0.0, 0.0, 0.0)
    m.joint(mb.Floating("free", "ground", "bead", start, rate))
    m.joint(
        mb.PointOnLine("along", "hub.wire", "bead", friction=mb.JointFriction(COULOMB, eps=1e-8))
    )
    m.constraint(mb.PrescribedMotion("motor", "turn", lambda t: w * t))
    run = simulate(m.build(), 0.5, rtol=1e-8, backend="vm", samples=11)
    rates = solve_ivp(
        lambda _, y: [y[1], w * w * y[0] - 0.2 * np.hypot(2 * w * y[1], g)],
        (0.0, 0.5), [r0, v0], t_eval=run.t, rtol=1e-10, atol=1e-12,
    )  # fmt: skip
    r, v = rates.y
    assert np.hypot(run["bead_x"], run["bead_y"]) == pytest.approx(r, rel=1e-7)
    assert run["along_slip"] == pytest.approx(v, rel=1e-7)
    assert run["along_N"] == pytest.approx(0.1 * np.hypot(2 * w * v, g), rel=1e-6)


def test_what_is_open_is_refused_and_the_way_out_named() -> None:
    """A hinge fixes what the plane fixes; a line in the plane fixes the way out of it."""
    bar, crank = four_bar("pin"), slider_crank("guide")
    for m, kind, assemble in ((bar, mb.Revolute, True), (crank, mb.PointOnLine, False)):
        last, friction = m.joints[-1], mb.JointFriction(LAW, radius=0.01)
        m.joints[-1] = kind(last.name, last.parent, last.child, friction=friction)
        with pytest.raises(ValueError, match="PlanarRevolute, PlanarPrismatic or PinInSlot in a"):
            (m.assembled() if assemble else m).build()
