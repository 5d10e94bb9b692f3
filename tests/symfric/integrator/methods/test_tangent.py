"""Mechanisms in charts of their tangent space: the same motion as in all coordinates."""

from dataclasses import replace
from functools import cache

import casadi as ca
import numpy as np
import pytest
from closed_forms import assemble

from symfric import BrownMcPhee, Model, flow, simulate
from symfric.foundation.parameters import symbolise
from symfric.integrator.equations.system import System
from symfric.integrator.methods.attempt import tangent
from symfric.integrator.methods.tangent import TangentChart
from symfric.multibody import Mechanism, PrescribedMotion
from symfric.scenes import FourBar, FourMass, MechanismScene, PendulumBox, SliderCrank

pytestmark = pytest.mark.heavy

LAW = BrownMcPhee(mu_s=0.12, mu_d=0.1, v_t=0.01)
SCENES: dict[str, MechanismScene] = {
    "four_mass": FourMass(LAW),
    "slider_crank": SliderCrank(LAW, omega=20.0),
    "four_bar": FourBar(LAW),
}
each_scene = pytest.mark.parametrize("name", ["four_mass", "four_bar"])


def smooth(scene: MechanismScene) -> Mechanism:
    """Without friction, whose kinks would hide the order of a method."""
    made = scene.mechanism()
    made.joints = [replace(joint, friction=None) for joint in made.joints]
    return made


@cache
def built(name: str, index: int = 0, rubs: bool = True) -> Model:
    """A scene in charts (index 0) or in all coordinates."""
    made = SCENES[name].mechanism() if rubs else smooth(SCENES[name])
    return made.build(index=index)


def unknowns(model: Model) -> tuple[System, TangentChart]:
    whole = assemble(model)
    chart = tangent(whole)
    assert chart is not None
    return whole, chart


@each_scene
def test_charts_lead_where_all_coordinates_lead(name: str) -> None:
    one, other = (simulate(built(name, i), 0.3, rtol=1e-10) for i in (0, 1))
    for v in one.model.x:
        scale = max(1.0, float(np.abs(other[v.name]).max()))
        assert one[v.name] == pytest.approx(other[v.name], abs=3e-8 * scale)
    assert one["constraint_position"].max() < 1e-12
    assert one["constraint_velocity"].max() < 1e-12
    assert one["constraint_acceleration"].max() < 1e-9


def test_as_many_differential_unknowns_as_degrees_of_freedom() -> None:
    """A tree needs no chart."""
    for name, n, degrees in (("four_mass", 4, 2), ("slider_crank", 2, 1), ("four_bar", 3, 1)):
        whole, chart = unknowns(built(name, rubs=False))
        constraints = n - degrees
        assert chart.reduced.nx == 2 * degrees
        assert chart.reduced.n == 2 * degrees + n + constraints
        assert whole.n == 2 * n + n + constraints + n * degrees
    assert tangent(assemble(PendulumBox(LAW).mechanism().build(index=0))) is None


def start_of(model: Model) -> np.ndarray:
    """Consistent unknowns, as the first step of a run has them."""
    whole, _ = unknowns(model)
    run = simulate(model, 1e-9, samples=2, backend="vm")
    y = np.zeros(whole.n)
    for i, name in enumerate(whole.names):
        y[i] = run[name][0] if name in run.units else 0.0
    return y


@each_scene
def test_slope_at_the_origin_of_a_chart_is_that_of_differentiation(name: str) -> None:
    """By the implicit-function theorem, and by CasADi through the frozen iterations."""
    model = built(name)
    whole, chart = unknowns(model)
    assert whole.manifold is not None
    y, reduced = start_of(model), chart.reduced
    phi_q = whole.manifold.slope(y, [])[whole.manifold.n :, : whole.manifold.n].full()
    phi_q = phi_q[: whole.manifold.m]
    y[whole.manifold.basis] = np.linalg.svd(phi_q)[2][whole.manifold.m :].ravel()
    data = chart.open(y, [])
    both = ca.Function("J", [reduced.y, reduced.d], [reduced.J, ca.jacobian(reduced.f, reduced.y)])
    by_theorem, by_differentiation = (m.full() for m in both.call([chart.enter(y, data), data]))
    scale = np.abs(by_differentiation).max()
    assert by_theorem == pytest.approx(by_differentiation, abs=1e-12 * scale)


@pytest.mark.parametrize(("method", "order"), [("rodas3", 3), ("radau5", 5)])
def test_order_of_a_method_is_kept_in_charts(method: str, order: int) -> None:
    """Four masses without friction: error of fixed steps against a run at 1e-13."""
    model = built("four_mass", rubs=False)
    exact = simulate(model, 0.5, rtol=1e-13, samples=2)
    reference = np.array([exact[v.name][-1] for v in model.x])
    found = []
    for steps in (10, 20):
        end = flow(model, steps=steps, method=method)(x0=model.initial_state(), T=0.5)["xf"]
        found.append(float(np.abs(end.full().ravel() - reference).max()))
    assert np.log2(found[0] / found[1]) > order - 0.35


def test_fixed_step_ends_on_the_constraints() -> None:
    model = built("slider_crank", rubs=False)
    whole = assemble(model)
    end = flow(model, steps=1)(x0=model.initial_state(), T=0.02)["xf"].full().ravel()
    y = np.concatenate([end, np.zeros(whole.n - end.size)])
    assert whole.manifold is not None
    assert np.abs(whole.manifold.defect(y, []).full()).max() < 1e-12


def test_charts_follow_full_turns() -> None:
    """Two turns of the crank in Euler parameters, whose tangent turns with it."""
    made = smooth(SliderCrank(LAW)).build(formulation="absolute")
    run = simulate(made, 0.13, rtol=1e-8, backend="vm", samples=27)
    joint = simulate(smooth(SliderCrank(LAW)).build(), 0.13, rtol=1e-10, samples=27)
    assert joint["crank"][-1] > 4 * np.pi
    assert run["wheel_e0"] == pytest.approx(np.cos(joint["crank"] / 2), abs=2e-6)
    assert run["block_x"] == pytest.approx(joint["slider"], abs=1e-6)


def test_charts_follow_constraints_that_move() -> None:
    """Slider 4 is driven: one degree of freedom is left, coupled to it by a spring."""
    made = smooth(SCENES["four_mass"])
    made.constraint(PrescribedMotion("drive", "x4", lambda t: 5.0 - t + 0.3 * t * t, "slide"))
    one, other = (simulate(made.build(index=i), 0.7, rtol=1e-9) for i in (0, 1))
    assert one["x4"] == pytest.approx(5.0 - one.t + 0.3 * one.t**2, abs=1e-12)
    assert one["x4_rate"] == pytest.approx(-1.0 + 0.6 * one.t, abs=1e-12)
    assert one["x1"] == pytest.approx(other["x1"], abs=1e-7)
    assert one["drive_force"] == pytest.approx(other["drive_force"], abs=1e-5)


def test_dense_output_between_steps_is_as_good_as_the_steps() -> None:
    model = built("four_mass", rubs=False)
    run = simulate(model, 0.5, rtol=1e-7)
    exact = simulate(model, 0.5, rtol=1e-12)
    between = np.linspace(0.013, 0.487, 101)
    coarse, fine = run.at(between), exact.at(between)
    for name in ("x1", "x1_rate", "x4_rate"):
        assert coarse[name] == pytest.approx(fine[name], abs=2e-5)


@pytest.mark.slow
def test_derivatives_in_charts_are_those_in_all_coordinates() -> None:
    scene, p = symbolise(FourMass(BrownMcPhee(mu_s=0.12, mu_d=0.1, v_t=0.1)), "k_4")
    models = (scene.mechanism().build(p, index=i) for i in (0, 1))
    made = [simulate(m, 0.5, rtol=1e-8, sensitivities=["k_4"], samples=3) for m in models]
    one, other = (run.sensitivities["k_4"] for run in made)
    assert one["x1"] == pytest.approx(other["x1"], abs=1e-6)
    assert np.abs(other["x1"]).max() > 1e-3
