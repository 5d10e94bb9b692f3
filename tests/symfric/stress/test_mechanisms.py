"""Mechanisms at the edge: each run equals an oracle or states why it stops, and is finite."""

from functools import cache, partial
from math import atan, sqrt
from typing import Any

import numpy as np
import pytest
from mechanics import brown_mcphee, four_mass, pendulum_box, pendulum_period, slider_crank
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from symfric import BrownMcPhee, Law, Model, SolveError, Status, Trajectory, Viscous, simulate
from symfric.foundation.numeric import Array
from symfric.integrator.equations.blocks import signs
from symfric.integrator.equations.initial import first_guess
from symfric.integrator.equations.inputs import input_data
from symfric.integrator.equations.manifold import SHOCK
from symfric.integrator.methods.tableaux import RODAS5P
from symfric.integrator.running.integrator import Integrator
from symfric.integrator.running.run import Tolerances, integrate
from symfric.laws import LuGre, LuGreNormalised
from symfric.multibody import Mechanism
from symfric.scenes import MECHANISMS, DoublePendulum, FourBar, Pendulum, PendulumBox, SliderCrank

SMOOTH = Viscous(sigma_2=0.0)
G = 9.81
slow = pytest.mark.slow
loose = pytest.mark.filterwarnings("ignore:.*stick phases:UserWarning")
JOINT = ("joint", 1)


def sound(run: Trajectory) -> None:
    """Numbers are finite, loops closed, contacts pressed, and energy does not grow."""
    assert all(np.isfinite(run[name]).all() for name in run.units)
    if "constraint_position" in run.units:
        assert run["constraint_position"].max() < 1e-11
    assert all(run[name].min() >= 0 for name in run.units if name.endswith("_N"))
    assert np.diff(run["energy"]).max() < 1e-6 * np.ptp(run["energy"]) + 1e-9


# ---- narrow transitions and strong friction, compared with a solver of SciPy ----


ORACLES: dict[str, tuple[Any, list[float], float, Any]] = {
    "pendulum_box": (
        partial(pendulum_box, 6.0, 20.0, 0.3, 0.01, G), [0, np.pi / 6, 0, 0], 3.0,
        lambda y: {"x": y[0], "phi": y[1]},
    ),
    "four_mass": (
        four_mass, [np.arctan2(3, 4), 5.0, 0.0, -1.0], 2.0,
        lambda y: {"x1": 5 * np.cos(y[0]), "x4": y[1]},
    ),
    "slider_crank": (slider_crank, [0.0, 120.0], 0.25, lambda y: {"crank": y[0]}),
}  # fmt: skip
"""Scene -> equations by hand, start, end time [s], and signals of the states."""
NARROW = [(0.12, 10.0**-k) for k in range(2, 6)]
STRONG = [(mu, 1e-2) for mu in (0.3, 0.7, 1.0, 1.5)]
"""Static levels and transition velocities."""


@slow
@pytest.mark.filterwarnings("ignore:overflow:RuntimeWarning")  # of SciPy's differences
@pytest.mark.parametrize("name", ORACLES)
def test_narrow_and_strong_friction_is_that_of_equations_by_hand(name: str) -> None:
    equations, start, t_end, signals = ORACLES[name]
    times = np.linspace(t_end / 20, t_end, 20)
    for mu_s, v_t in NARROW + STRONG:
        levels = {"mu_s": mu_s, "mu_d": 0.8 * mu_s, "v_t": v_t}
        rates, span = equations(partial(brown_mcphee, **levels)), (0.0, t_end)
        found = solve_ivp(rates, span, start, "Radau", rtol=1e-8, atol=1e-10, t_eval=times)
        model = MECHANISMS[name](BrownMcPhee(**levels)).model()
        run = simulate(model, t_end, rtol=1e-9, t_eval=times)
        sound(run)
        for signal, expected in signals(found.y).items():
            assert run[signal] == pytest.approx(expected, rel=1e-6, abs=5e-6), levels


# ---- jamming: Painleve's paradox ----

MU, MASS = 0.12, 20.0


@cache
def light_model(ratio: float, formulation: str, index: int) -> Model:
    """A box of `ratio` times the mass of its pendulum, without friction in the hinge."""
    friction = BrownMcPhee(mu_s=MU, mu_d=MU, v_t=1e-3)
    scene = PendulumBox(friction, hinge=SMOOTH, m_box=MASS * ratio)
    return scene.mechanism().build(formulation=formulation, index=index)


def reserve(phi: Array, ratio: float) -> Array:
    """Factor of x'' while the box slides: m_box / m + sin(phi) (sin(phi) - mu cos(phi))."""
    return ratio + np.sin(phi) * (np.sin(phi) - MU * np.cos(phi))


@pytest.mark.parametrize(
    ("ratio", "rtol", "form"),
    [
        (1e-3, 1e-4, JOINT),
        (1e-3, 1e-7, JOINT),
        pytest.param(1e-3, 1e-10, JOINT, marks=slow),
        *(pytest.param(1e-3, 1e-7, ("absolute", k), marks=slow) for k in (0, 1)),
        *(pytest.param(ratio, 1e-8, JOINT, marks=slow) for ratio in (1e-6, 1e-4)),
    ],
)
@loose
def test_a_light_box_jams(ratio: float, rtol: float, form: tuple[str, int]) -> None:
    """Below m_box/m = (sqrt(1 + mu^2) - 1)/2 the box that slides has no acceleration."""
    assert ratio < (sqrt(1 + MU**2) - 1) / 2
    with pytest.raises(SolveError, match=r"friction jams.*joint 'x' with BrownMcPhee") as caught:
        simulate(light_model(ratio, *form), 3.0, rtol=rtol, backend="vm")
    assert caught.value.status is Status.JAMMED
    assert "a tangential shock where it slides, and impacts are excluded" in str(caught.value)
    run = caught.value.partial
    assert isinstance(run, Trajectory)
    sound(run)
    potential = np.append(run["potential"], run.final["potential"])
    fallen = (potential - potential[0]) / (MASS * G * 0.3)
    phi = np.arccos(np.cos(np.pi / 6) - fallen)
    top = atan(MU) / 2  # where the reserve is smallest
    assert phi[-1] == pytest.approx(brentq(reserve, top, 0.5, args=(ratio,)), abs=3e-4)
    share = reserve(phi, ratio) / (ratio + np.sin(phi) ** 2)  # mass with friction over without
    assert (share > 0).all()
    assert ratio < 1e-3 or share[-1] == pytest.approx(SHOCK, rel=0.05)
    assert run.final["x_N"] > 1e4 * run["x_N"][0]


@pytest.mark.parametrize("ratio", [3.7e-3, pytest.param(1e-2, marks=slow)])
@pytest.mark.parametrize("rtol", [1e-4, 1e-7, pytest.param(1e-10, marks=slow)])
@loose
def test_a_box_just_heavy_enough_moves_on(ratio: float, rtol: float) -> None:
    sound(simulate(light_model(ratio, *JOINT), 1.0, rtol=rtol, backend="vm"))


@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=slow) if n in ("arm", "four_mass") else n for n in MECHANISMS]
)
def test_machines_with_strong_friction_are_far_from_jamming(name: str) -> None:
    """Det(I - dN/dN) at the ends of all steps, by NumPy, equals the product of the pivots."""
    model = MECHANISMS[name](BrownMcPhee(mu_s=0.7, mu_d=0.56, v_t=1e-2)).model()
    inputs = input_data(model, None, 0.0, 0.25 if name == "slider_crank" else 1.0)
    integrator = Integrator(model, inputs, RODAS5P)
    s, d = integrator.system, inputs.values[:, 0]
    y = first_guess(s, model, model.initial_state())
    tolerances = Tolerances(1e-6, 1e-7 * s.nominal, 1e-10, 100_000)
    run, _ = integrate(integrator, inputs, y, np.zeros(0), tolerances, "vm", None)
    assert run.status is Status.SUCCESS
    manifold = s.manifold
    assert manifold is not None
    k = manifold.n + manifold.m
    pivots = signs(s, RODAS5P.gamma, s.algebraic[0][k:])
    for y in run.dense.y1:
        A = manifold.slope(y, d).full()
        reserve = np.linalg.det(A) / np.linalg.det(A[:k, :k]) * (-1) ** (A.shape[0] - k)
        assert reserve == pytest.approx(float(np.prod(np.array(pivots(y, 1e-3, d)[2]))), rel=1e-9)
        assert reserve > 100 * SHOCK


# ---- uneven masses and dead points ----


@slow
def test_a_box_without_mass_and_a_box_as_heavy_as_a_wall() -> None:
    """Without mass and friction the rod carries nothing: L (cos phi - cos phi_0) = g t^2 / 2."""
    times = np.linspace(0.01, 0.08, 8)
    light = PendulumBox(SMOOTH, hinge=SMOOTH, m_box=20e-6).mechanism()
    for formulation in ("joint", "absolute"):
        run = simulate(light.build(formulation=formulation), 0.08, rtol=1e-9, t_eval=times)
        fallen = run["potential"] / (20 * G)
        assert fallen - fallen[0] == pytest.approx(-G * (times**2 - times[0] ** 2) / 2, abs=1e-6)
    period = pendulum_period(sqrt(G / 0.3), np.pi / 6)
    wall = PendulumBox(SMOOTH, hinge=SMOOTH, m_box=20e6).model()
    assert simulate(wall, period, rtol=1e-10).final["phi"] == pytest.approx(np.pi / 6, abs=1e-5)


@slow
@pytest.mark.parametrize("ratio", [1e-6, 1e-3, 1e3, 1e6])
def test_uneven_pendulums_keep_their_energy_in_both_formulations(ratio: float) -> None:
    """The lower rod is `ratio` times as heavy as usual."""
    m, uneven = DoublePendulum(SMOOTH).mechanism(), Mechanism("uneven")
    uneven.forces, uneven.frames, uneven.joints = m.forces, m.frames, m.joints
    for body in m.bodies[1:]:
        by = ratio if body.name == "lower" else 1.0
        uneven.body(body.name, by * body.mass, tuple(by * J for J in body.inertia))
    kinetic = list[Array]()
    for formulation in ("joint", "absolute"):
        run = simulate(uneven.build(formulation=formulation), 0.5, rtol=1e-9)
        assert np.ptp(run["energy"]) < 1e-6 * run["kinetic"].max()
        kinetic.append(run["kinetic"] / run["kinetic"].max())
    assert kinetic[0] == pytest.approx(kinetic[1], abs=1e-6)


@slow
@pytest.mark.parametrize("length", [0.22, 0.2214214, 0.22143, 0.2215])
def test_slider_crank_near_its_dead_point_keeps_energy_and_closed_form_or_jams(
    length: float,
) -> None:
    """From 0.2214214 m on the rod just reaches over: slider^2 falls to a few millionths of l^2."""
    run = simulate(SliderCrank(SMOOTH, l=length).model(), 0.25, rtol=1e-9)
    th = run["crank"]
    square = length**2 - (0.1 - 0.08 * np.sin(th)) ** 2 - (0.1 + 0.08 * np.cos(th)) ** 2
    assert run["slider"] ** 2 == pytest.approx(square, abs=1e-13)
    assert run["slider"].min() < (-0.2 if length == 0.22 else 0.03 * length)
    assert (np.ptp(th) < 2 * np.pi) == (length == 0.22)
    assert np.ptp(run["energy"]) < 1e-7 * run["energy"][0]
    if length in (0.2214214, 0.22143):
        rough = SliderCrank(BrownMcPhee(mu_s=0.1, mu_d=0.08, v_t=0.01), l=length).model()
        with pytest.raises(SolveError, match=r"friction jams.*joint 'crank' with Brown") as caught:
            simulate(rough, 0.25, rtol=1e-8)
        assert isinstance(caught.value.partial, Trajectory)
        sound(caught.value.partial)


@slow
@pytest.mark.parametrize("rtol", [1e-6, 1e-8])
@pytest.mark.parametrize("form", [JOINT, ("joint", 0), ("absolute", 0)])
def test_an_exact_parallelogram_stops_where_its_links_are_in_line(
    form: tuple[str, int], rtol: float
) -> None:
    scene = FourBar(SMOOTH, crank=0.2, coupler=0.4, rocker=0.2, base=0.4)
    model = scene.mechanism().build(formulation=form[0], index=form[1])
    with pytest.raises(SolveError, match="the configuration is singular") as caught:
        simulate(model, 3.0, rtol=rtol, backend="vm")
    run = caught.value.partial
    assert isinstance(run, Trajectory)
    assert run.step_times[-1] == pytest.approx(0.206637, abs=1e-5)
    if form == JOINT:
        assert "pin_lambda" in str(caught.value)
        assert run["theta_crank"] == pytest.approx(run["theta_rocker"], abs=1e-8)
        reached = run.at([float(run.step_times[-1])])["theta_crank"][0]
        assert reached == pytest.approx(np.pi, abs=1e-4)


@slow
@pytest.mark.parametrize("excess", [1e-8, 1e-4, 1e-2])
def test_near_parallelograms_go_through_on_their_own_branch(excess: float) -> None:
    """Beyond the line the rocker turns against the crank."""
    scene = FourBar(SMOOTH, crank=0.2, coupler=0.4, rocker=0.2 * (1 + excess), base=0.4)
    run = simulate(scene.model(), 3.0, rtol=1e-8)
    assert run["constraint_position"].max() < 1e-12
    assert np.ptp(run["energy"]) < 1e-6 * run["kinetic"].max()
    assert run["theta_crank"][-1] > 30.0


@slow
@pytest.mark.parametrize(("v_t", "t_end"), [(1e-6, 1e3), (1e-7, 1e4), (1e-8, 1e5)])
def test_a_velocity_law_creeps_by_its_slope_at_rest(v_t: float, t_end: float) -> None:
    """phi' = -phi m g L / (R^2 N mu'(0)): a static law does not hold, for 1e5 s neither."""
    mu_s, mu_d, R, L = 0.15, 0.12, 0.02, 0.5
    slope = (4 * mu_d + (mu_s - mu_d) / 0.75**2) / v_t
    scene = Pendulum(BrownMcPhee(mu_s=mu_s, mu_d=mu_d, v_t=v_t), phi_0=1e-4)
    run = simulate(scene.model(), t_end, rtol=1e-8)
    sound(run)
    expected = 1e-4 * np.exp(-run.t * L / (R * R * slope))
    assert run["phi"][1:] == pytest.approx(expected[1:], rel=1e-4)


@slow
@pytest.mark.parametrize("friction", [LuGre(), LuGreNormalised()], ids=["lugre", "normalised"])
def test_bristles_hold_a_pendulum_for_a_day(friction: Law) -> None:
    """At rest weight and bristles balance, and nothing moves between an hour and 1e5 s."""
    model = Pendulum(friction, phi_0=0.002).model()
    run = simulate(model, 1e5, rtol=1e-8, t_eval=[100.0, 3600.0, 1e5])
    phi = run["phi"]
    assert np.ptp(phi) < 1e-9
    assert abs(phi[-1]) > 1e-4
    assert 0.5 * G * np.sin(phi) == pytest.approx(-0.02 * run["phi_friction"], rel=1e-5)
    short = simulate(model, 100.0, rtol=1e-9)["phi"][-1]
    assert phi[-1] == pytest.approx(short, abs=1e-7)


@slow
@pytest.mark.parametrize(
    "name", ["pendulum", "pendulum_box", "four_mass", "slider_crank", "four_bar", "arm"]
)
@pytest.mark.parametrize(
    "friction", [BrownMcPhee(), LuGreNormalised(), LuGre()], ids=lambda law: type(law).__name__
)
def test_every_mechanism_rests_for_a_day_or_gives_the_reason(name: str, friction: Law) -> None:
    run = simulate(MECHANISMS[name](friction).model(), 1e5, throw=False)
    assert all(np.isfinite(run[name]).all() for name in run.units)
    if run.status.ok:
        assert run["kinetic"][-1] < 1e-8
        assert run["energy"][-1] == pytest.approx(run["energy"][1000], abs=1e-2)
    else:
        assert isinstance(friction, LuGre)
        assert "lugre_normalised" in run.message
