"""Mechanisms stay on their constraints on all levels, and what cannot go on says why."""

import numpy as np
import pytest
from closed_forms import assemble

import symfric.multibody as mb
from symfric import BrownMcPhee, Model, SolveError, Status, Trajectory, Variable, Viscous, simulate
from symfric.scenes import FourBar, FourMass, Pendulum, SliderCrank

SMOOTH = Viscous(sigma_2=0.0)
LOOPS = {
    "four_mass": FourMass(SMOOTH).model(),
    "slider_crank": SliderCrank(SMOOTH, omega=20.0).model(),
    "four_bar": FourBar(SMOOTH).model(),
}
each_loop = pytest.mark.parametrize("name", LOOPS)


def largest(run: Trajectory) -> list[float]:
    """Largest violation of the constraints in position, velocity and acceleration."""
    levels = ("position", "velocity", "acceleration")
    return [float(run[f"constraint_{level}"].max()) for level in levels]


@each_loop
@pytest.mark.parametrize("method", ["rodas5p", "rodas4p", "radau5"])
def test_constraints_hold_on_three_levels_whatever_the_method(name: str, method: str) -> None:
    """Between steps, too, where the dense output is projected."""
    run = simulate(LOOPS[name], 1.0, rtol=1e-6, method=method, samples=77)
    assert (np.array(largest(run)) < [1e-12, 1e-12, 1e-10]).all()


@each_loop
@pytest.mark.slow
def test_energy_and_constraints_last_for_100_s(name: str) -> None:
    run = simulate(LOOPS[name], 100.0, rtol=1e-10, samples=5001)
    assert np.ptp(run["energy"]) / np.abs(run["energy"]).max() < 1e-6
    assert max(largest(run)[:2]) < 1e-11


def test_accelerations_are_unknowns_and_projection_is_the_nearest_point() -> None:
    """x1 and y2 of the four-mass system lie on a circle of 5 m; no mass matrix is inverted."""
    s = assemble(LOOPS["four_mass"])
    assert s.names[8:12] == ("x1_rate_dot", "y2_rate_dot", "z3_rate_dot", "x4_rate_dot")
    assert (s.n, s.nx, s.has_pivots) == (8 + 4 + 2, 8, False)
    assert s.pivots == (tuple(range(12)), (12, 13), ())
    assert s.manifold is not None
    y = np.zeros(s.n)
    y[:4] = 4.001, 3.001, 40**0.5, 5.0
    x1, y2, z3, x4 = s.manifold.project(y, []).full()[:4, 0]
    assert (x1**2 + y2**2, y2**2 + z3**2) == pytest.approx((25.0, 49.0), abs=1e-11)
    assert x4 == 5.0
    assert np.abs([x1 - 4.001, y2 - 3.001]).max() < 2e-3


def test_a_start_off_the_constraints_is_assembled_or_refused() -> None:
    run = simulate(LOOPS["four_mass"], 0.1, x0={"x1": 3.9, "x4_rate": -2.0})
    assert run["constraint_position"].max() < 1e-12
    assert run["x4_rate"][0] == -2.0
    length = Variable("length", "m", start=2.5)
    m = mb.Mechanism("bead")
    m.body("bead", 1.0, (0.1, 0.1, 0.1))
    m.frame("ground.peg", at=(2.0, 0.0, 0.0))
    m.joint(mb.Prismatic("z", "ground", "bead", start=1.5))
    m.joint(mb.Distance("rod", "ground.peg", "bead", length=length.symbol))
    model = m.build((length,))
    assert simulate(model, 0.01, p={"length": 2.1})["z"][0] == pytest.approx(0.41**0.5)
    with pytest.raises(ValueError, match="from which all loops can be closed"):
        simulate(model, 0.1, p={"length": 1.9})


def drawer(mu_s: float, rate: float = 1.0, names: tuple[str, ...] = ("slide",)) -> Model:
    """A drawer with its centre of mass off its guide, pulled back: N = 2 m c |a| / length.

    While it slides forward, a (1 - 2 mu c / length) = -F / m: with c = length it jams where the
    coefficient of friction reaches 1/2. More `names` make more of them, all alike.
    """
    m = mb.Mechanism("drawer", gravity=(0.0, 0.0, 0.0))
    friction = mb.JointFriction(BrownMcPhee(mu_s=mu_s, mu_d=0.1, v_t=0.01), length=0.1)
    for name in names:
        m.body(f"{name}r", 2.0, (0.01, 0.01, 0.01), com=(0.1, 0.0, 0.0))
        m.joint(mb.Prismatic(name, "ground", f"{name}r", rate=rate, friction=friction))
        m.force(mb.JointSpringDamper(f"pull_{name}", name, "slide", actuator=-5.0))
    return m.build()


def test_below_the_limit_the_drawer_moves_as_it_must() -> None:
    """mu = 0.1 while it slides fast: a = -2.5 / 0.8 m/s^2."""
    run = simulate(drawer(0.4), 0.2, rtol=1e-8)
    assert run["slide_rate"][-1] == pytest.approx(1 - 0.2 * 2.5 / 0.8, abs=1e-4)
    assert run["slide_N"][100] == pytest.approx(2 * 2.0 * 2.5 / 0.8, rel=1e-3)


@pytest.mark.parametrize("method", ["rodas5p", "radau5"])
def test_jamming_ends_with_joint_law_and_time(method: str) -> None:
    """It jams where x = v / v_t gives mu = 1/2: 0.1 + 0.5 x / (x^2/4 + 3/4)^2 at x = 2.05."""
    with pytest.raises(SolveError, match=r"stopped at t = 0\.309") as caught:
        simulate(drawer(0.6), 1.0, rtol=1e-8, method=method)
    assert caught.value.status is Status.JAMMED
    assert "joint 'slide' with BrownMcPhee" in str(caught.value)
    run = caught.value.partial
    assert run["slide_rate"][-1] == pytest.approx(0.0205, abs=2e-4)
    assert (run["slide_N"] >= 0).all()


def test_two_that_jam_at_once_and_starts_beyond_jamming_are_seen() -> None:
    """The determinant stays positive."""
    with pytest.raises(SolveError, match=r"stopped at t = 0\.309.*joint '(left|right)' with"):
        simulate(drawer(0.6, names=("left", "right")), 1.0, rtol=1e-8)
    with pytest.raises(ValueError, match="model 'drawer': "):
        simulate(drawer(0.6, rate=0.01), 1.0)


@pytest.mark.parametrize("mu", [0.3, 1.5])
@pytest.mark.parametrize("v_t", [1e-2, 1e-6])
def test_sticking_friction_runs_at_every_width(mu: float, v_t: float) -> None:
    law = BrownMcPhee(mu_s=mu, mu_d=0.8 * mu, v_t=v_t)
    run = simulate(Pendulum(law, R=0.1).model(), 20.0, rtol=1e-7)
    assert np.isfinite(run["energy"]).all()
    assert abs(run["phi_rate"][-1]) < 2 * v_t / 0.1


def test_mass_ratios_of_a_million_do_not_matter() -> None:
    m = mb.Mechanism("m")
    for name, mass in (("heavy", 1e3), ("light", 1e-3)):
        m.body(name, mass, (mass / 10,) * 3)
        m.frame(f"{name}.top", at=(0.0, 0.0, 0.5), z=(0.0, 1.0, 0.0))
        m.frame(f"{name}.end", at=(0.0, 0.0, -0.5), z=(0.0, 1.0, 0.0))
    m.frame("ground.top", z=(0.0, 1.0, 0.0))
    m.joint(mb.Revolute("a", "ground.top", "heavy.top", start=0.5))
    m.joint(mb.Revolute("b", "heavy.end", "light.top"))
    run = simulate(m.build(), 5.0, rtol=1e-9)
    assert np.ptp(run["energy"]) < 1e-5 * np.ptp(run["kinetic"])
