"""Friction that jams ends a run at every tolerance, and machines that move are far from it."""

from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from symfric import BrownMcPhee, Model, SolveError, Status, Viscous, simulate
from symfric.integrator.equations.blocks import signs
from symfric.integrator.equations.initial import first_guess
from symfric.integrator.equations.inputs import input_data
from symfric.integrator.equations.manifold import SHOCK, Manifold
from symfric.integrator.methods.tableaux import RODAS5P
from symfric.integrator.running.integrator import Integrator
from symfric.integrator.running.run import Tolerances, integrate
from symfric.scenes import MECHANISMS, PendulumBox

pytestmark = pytest.mark.heavy

Array = NDArray[np.float64]
MU, MASS = 0.12, 20.0
often = pytest.mark.slow
each_tolerance = pytest.mark.parametrize(
    "rtol", [1e-4, 1e-7, 1e-10, *(pytest.param(10.0**-k, marks=often) for k in (5, 6, 8, 9))]
)
each_form = pytest.mark.parametrize(
    ("formulation", "index"),
    [("joint", 1), *(pytest.param("absolute", k, marks=often) for k in (0, 1))],
)


@cache
def light_box(ratio: float, formulation: str = "joint", index: int = 1) -> Model:
    """A box of `ratio` times the mass of its pendulum, without friction in the hinge."""
    law = BrownMcPhee(mu_s=MU, mu_d=MU, v_t=1e-3)
    scene = PendulumBox(law, hinge=Viscous(sigma_2=0.0), m_box=MASS * ratio)
    return scene.mechanism().build(formulation=formulation, index=index)


def determinant(phi: float, ratio: float) -> float:
    """1 - dN/dN while the box slides forward: mass that x'' sees, with friction over without."""
    free = ratio + np.sin(phi) ** 2
    return float((free - MU * np.sin(phi) * np.cos(phi)) / free)


@each_form
@each_tolerance
@pytest.mark.filterwarnings("ignore:.*stick phases:UserWarning")
def test_a_light_box_jams_at_every_tolerance(formulation: str, index: int, rtol: float) -> None:
    """Looser than 1e-7 it once passed, with N = 2e9 N; the box then stands within microseconds."""
    model = light_box(1e-3, formulation, index)
    with pytest.raises(SolveError, match=r"stopped at t = 0\.0891102.*friction jams") as caught:
        simulate(model, 3.0, rtol=rtol, backend="vm")
    assert caught.value.status is Status.JAMMED
    assert "normal force of joint 'x' with BrownMcPhee" in str(caught.value)
    assert "a tangential shock where it slides, and impacts are excluded" in str(caught.value)
    run = caught.value.partial
    fallen = (run["potential"][0] - run.final["potential"]) / (MASS * 9.81 * 0.3)
    phi = np.arccos(np.cos(np.pi / 6) + fallen)
    assert determinant(phi, 1e-3) == pytest.approx(SHOCK, rel=0.05)
    assert run.final["x_N"] > 1e4 * run["x_N"][0]


@each_tolerance
@pytest.mark.filterwarnings("ignore:.*stick phases:UserWarning")
def test_a_box_just_heavy_enough_moves_on(rtol: float) -> None:
    """At m_box/m = (sqrt(1 + mu^2) - 1)/2 = 3.59e-3 the smallest determinant of sliding is 0."""
    run = simulate(light_box(3.7e-3), 1.0, rtol=rtol, backend="vm")
    assert run["x_N"].min() > 0.0


def reserves(model: Model, t_end: float) -> tuple[Array, Array]:
    """Det(I - dN/dN) at the ends of all steps, by NumPy, and the product of our pivots."""
    inputs = input_data(model, None, 0.0, t_end)
    integrator = Integrator(model, inputs, RODAS5P)
    s = integrator.system
    y = first_guess(s, model, model.initial_state())
    tolerances = Tolerances(1e-6, 1e-7 * s.nominal, 1e-10, 100_000)
    run, _ = integrate(integrator, inputs, y, np.zeros(0), tolerances, "vm", None)
    dense = run.dense
    assert run.status is Status.SUCCESS
    d = inputs.values[:, 0]
    manifold = s.manifold
    assert manifold is not None
    k = manifold.n + manifold.m
    pivots = signs(s, RODAS5P.gamma, s.algebraic[0][k:])
    every = [float(np.prod(np.array(pivots(y, 1e-3, d)[2]))) for y in dense.y1]
    return np.array([by_numpy(manifold, y, d) for y in dense.y1]), np.array(every)


def by_numpy(manifold: Manifold, y: Array, d: Array) -> float:
    A, k = manifold.slope(y, d).full(), manifold.n + manifold.m
    return float(np.linalg.det(A) / np.linalg.det(A[:k, :k]) * (-1) ** (A.shape[0] - k))


@pytest.mark.parametrize("name", MECHANISMS)
def test_machines_with_strong_friction_are_far_from_jamming(name: str) -> None:
    """Smallest of all: 0.49 in the arm at mu = 0.15, a pivot of 0.60 at 0.7."""
    law = BrownMcPhee(mu_s=0.7, mu_d=0.56, v_t=1e-2)
    model = MECHANISMS[name](law).model()
    determinants, pivots = reserves(model, 0.25 if name == "slider_crank" else 1.0)
    assert determinants == pytest.approx(pivots, rel=1e-9)
    assert determinants.min() > 100 * SHOCK
