"""Families of methods: their steps against closed forms, SciPy and books, and what they cost."""

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from closed_forms import assemble, observed_order, smooth_dae, smooth_ode
from numpy.typing import NDArray
from scipy.integrate import RK45

import symfric as sf
from symfric.integrator.equations.initial import consistent, first_guess
from symfric.integrator.equations.inputs import input_data
from symfric.integrator.equations.system import system
from symfric.integrator.methods.families import SMALL, eigenbasis, eliminated, exp_phi1_phi2
from symfric.integrator.methods.tableaux import (
    BACKWARD_EULER,
    DOPRI5,
    EXPONENTIAL,
    METHODS,
    RADAU5,
    RODAS5P,
    through,
)
from symfric.integrator.running.record import Dense
from symfric.integrator.step.attempt import (
    KAPPA,
    Given,
    State,
    build_dense_step,
    build_fixed,
    build_step,
    converged,
)
from symfric.scenes import DoublePendulum, FourBar, MechanismScene, SliderCrank

x = sf.Variable("x", "1", start=1.0)


@pytest.mark.parametrize("h", [0.01, 1.0, 100.0])
def test_step_solves_its_equation(h: float) -> None:
    """x_1 + h x_1^2 = x_0."""
    step = build_fixed(assemble(sf.Model("square", x=(x,), ode=-(x.symbol**2))), BACKWARD_EULER)
    enough = replace(BACKWARD_EULER, iterations=12)
    exactly = build_fixed(assemble(sf.Model("square", x=(x,), ode=-(x.symbol**2))), enough)
    root = (np.sqrt(1 + 4 * h) - 1) / (2 * h)
    assert float(exactly(1.0, h, [])) == pytest.approx(root, rel=1e-14)
    assert float(step(1.0, h, [])) == pytest.approx(root, rel=1e-14 if h < 0.1 else 0.1)


def test_newton_converges_quadratically() -> None:
    model, errors = sf.Model("square", x=(x,), ode=-(x.symbol**2)), []
    for k in (1, 2, 3):
        step = build_fixed(assemble(model), replace(BACKWARD_EULER, iterations=k))
        errors.append(abs(float(step(1.0, 0.5, [])) - (np.sqrt(3.0) - 1)))
    # Newton for x + x^2/2 - 1: e+ = e^2 / (2 (1 + x))
    assert errors[1] / errors[0] ** 2 == pytest.approx(1 / (2 * np.sqrt(3.0)), rel=0.1)
    assert errors[2] / errors[1] ** 2 == pytest.approx(1 / (2 * np.sqrt(3.0)), rel=0.1)


def test_algebraic_unknowns_end_on_their_equations() -> None:
    problem = smooth_dae()
    X, Y, Z = build_fixed(assemble(problem.model), BACKWARD_EULER)(
        problem.exact(0.0), 0.1, []
    ).full().ravel()  # fmt: skip
    assert pytest.approx(X + Y, rel=1e-12) == Z * (1 + Y)


@pytest.mark.parametrize("v_t", [1e-3, 1e-5])
@pytest.mark.parametrize("h", [0.1, 0.01, 0.001])
def test_it_stays_bounded_where_the_step_resolves_nothing(h: float, v_t: float) -> None:
    model = sf.rabinowicz(sf.BrownMcPhee(v_t=v_t))
    step = build_fixed(assemble(model), BACKWARD_EULER).mapaccum(2000)
    x = step(model.initial_state(), h, []).full()[0]
    assert np.abs(x).max() < 2.0  # the spring balances static friction at 0.57 m


H = 0.2


def rates(_: float, y: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.array([-3 * y[0] + y[1] ** 2, y[0] - y[1] - y[1] ** 2])


def by_scipy() -> RK45:
    """One step of H of the same pair, without error control."""
    solver = RK45(
        rates, 0.0, [1.0, 1.0], 1.0, first_step=H, max_step=H, rtol=1.0, atol=1.0,
    )  # fmt: skip
    solver.step()
    return solver


def test_step_is_that_of_scipy() -> None:
    found = build_fixed(assemble(smooth_ode().model), DOPRI5)([1.0, 1.0], H, [])
    assert found.full().ravel() == pytest.approx(by_scipy().y, rel=1e-14)


def test_dense_output_is_that_of_scipy() -> None:
    rows = build_dense_step(assemble(smooth_ode().model), DOPRI5)([1.0, 1.0], H, [])
    rows = rows.full().reshape(-1, 2)
    ends = np.array([0.0]), np.array([H])
    dense = Dense(*ends, np.ones((1, 2)), rows[:1], rows[None, 1:])
    t = np.linspace(0.0, H, 7)
    assert dense(t) == pytest.approx(by_scipy().dense_output()(t), rel=1e-12)


def test_bristles_cost_it_many_times_the_steps_of_an_implicit_method() -> None:
    explicit, implicit = (
        sf.simulate(sf.rabinowicz(sf.LuGre()), 10.0, method=method).statistics
        for method in ("dopri5", "rodas5p")
    )
    assert explicit.steps > 20 * implicit.steps
    assert (explicit.jacobians, explicit.factorisations) == (0, 0)
    assert explicit.evaluations == 7 * (explicit.steps + explicit.rejections)


point = ca.SX.sym("x")
VALUES = ca.Function("values", [point], exp_phi1_phi2(point)[1:])
SLOPES = ca.Function(
    "slopes",
    [point],
    [ca.jacobian(phi, point) for phi in exp_phi1_phi2(point)[1:]],
)
NODES, WEIGHTS = (0.5 * part for part in np.polynomial.legendre.leggauss(40))
S = NODES + 0.5


@pytest.mark.parametrize(
    "at", [0.0, 1e-9, -1e-4, -0.999 * SMALL, -1.001 * SMALL, 0.5, -1.0, 2.0, -5.0, -20.0]
)
def test_values_are_the_integrals(at: float) -> None:
    phi1, phi2 = VALUES(at)
    assert float(phi1) == pytest.approx(WEIGHTS @ np.exp(at * S), rel=1e-13)
    assert float(phi2) == pytest.approx(WEIGHTS @ ((1 - S) * np.exp(at * S)), rel=3e-14 / SMALL)


@pytest.mark.parametrize("at", [-1e4, -1e12, -1e300])
def test_far_below_zero_they_tend_to_the_reciprocal(at: float) -> None:
    phi1, phi2 = VALUES(at)
    assert float(phi1) == -1 / at
    assert float(phi2) == pytest.approx(-1 / at, rel=2e-4)


def test_slopes_at_zero_are_those_of_the_series() -> None:
    assert [float(slope) for slope in SLOPES(0.0)] == pytest.approx([1 / 2, 1 / 6], rel=1e-14)


@pytest.mark.parametrize("rate", [1e-6, 1.0, 1e3, 1e9])
def test_equation_linear_in_its_unknown_is_solved_exactly(rate: float) -> None:
    """x' = 1 - rate x from 2."""
    v = sf.Variable("x", "1", start=2.0)
    step = build_fixed(assemble(sf.Model("affine", x=(v,), ode=1 - rate * v.symbol)), EXPONENTIAL)
    exact = 2 * np.exp(-rate) - np.expm1(-rate) / rate
    assert float(step(2.0, 1.0, [])) == pytest.approx(exact, rel=1e-13)


def test_bristles_stay_within_their_travel_at_any_step() -> None:
    """|z| <= g/sigma_0 at the friction's peak, though sigma_0 |v| h / g is a thousand."""
    model = sf.rabinowicz(sf.LuGre())
    step = build_fixed(assemble(model), EXPONENTIAL)
    limit = 0.8 * 9.81 * sf.LuGre().mu_s / sf.LuGre().sigma_0
    for v in (-3.0, -0.1, 0.3, 3.0):
        z = float(step([0.0, v, 0.0], 0.1, [])[2])
        assert abs(z) <= limit * (1 + 1e-12)
        assert np.sign(z) == np.sign(v - 0.1)


def test_only_unknowns_with_their_own_slope_cost_an_exponential() -> None:
    point, v = sf.Variable("x", "m"), sf.Variable("v", "m/s")
    model = sf.Model("fall", x=(point, v), ode=ca.vertcat(v.symbol, 9.81 - 0.1 * v.symbol))
    step = build_fixed(assemble(model), EXPONENTIAL)
    codes = [step.instruction_id(k) for k in range(step.n_instructions())]
    assert codes.count(ca.OP_EXPM1) == 1


@pytest.mark.parametrize(("name", "stages"), [("rodas5p", 8), ("rodas4p", 6), ("rodas3", 4)])
def test_work_of_a_step_is_its_stages_and_one_factorisation(name: str, stages: int) -> None:
    system = assemble(sf.rabinowicz(sf.LuGre()))
    assert METHODS[name].work(system) == (stages, 1, 1)


@pytest.mark.parametrize(
    ("law", "attempt", "step", "divisions"),
    [(sf.BrownMcPhee(), 1002, 451, 46), (sf.LuGre(), 1273, 645, 49)],
    ids=["bm", "lugre"],
)
def test_attempt_costs_no_more_instructions_than_it_did(
    law: sf.Law, attempt: int, step: int, divisions: int
) -> None:
    """The other methods, and whatever comes, must not make the default one dearer.

    A division takes the time of ten others; there were 45 and 57, of which 28 and 31 stayed. Of
    those here 9 tangents take 18, and 241 instructions: libm's took more time, in branches.
    """
    system = assemble(sf.rabinowicz(law))
    whole = build_step(system, RODAS5P)
    operations = [whole.instruction_id(k) for k in range(whole.n_instructions())]
    assert len(operations) <= attempt
    assert operations.count(ca.OP_DIV) <= divisions
    assert build_fixed(system, RODAS5P).n_instructions() <= step


S6 = np.sqrt(6.0)


def test_matrix_is_the_one_of_the_book() -> None:
    """Hairer and Wanner, table IV.5.6."""
    book = [
        [(88 - 7 * S6) / 360, (296 - 169 * S6) / 1800, (-2 + 3 * S6) / 225],
        [(296 + 169 * S6) / 1800, (88 + 7 * S6) / 360, (-2 - 3 * S6) / 225],
        [(16 - S6) / 36, (16 + S6) / 36, 1 / 9],
    ]
    assert pytest.approx(np.array(book), abs=1e-14) == RADAU5.A


def test_eigenvalues_are_those_of_the_book() -> None:
    """Of the inverse: roots of z^3 - 9 z^2 + 36 z - 60."""
    basis = eigenbasis(RADAU5.A)
    roots = np.roots([1.0, -9.0, 36.0, -60.0])
    assert basis.gamma == pytest.approx(float(roots.real[np.argmin(np.abs(roots.imag))]))
    pair = roots[np.argmax(roots.imag)]
    assert (basis.alpha, basis.beta) == pytest.approx((pair.real, pair.imag))
    blocks = np.linalg.inv(basis.T) @ np.linalg.inv(RADAU5.A) @ basis.T
    assert blocks[1:, 1:] == pytest.approx(
        np.array([[basis.alpha, basis.beta], [-basis.beta, basis.alpha]])
    )
    assert blocks[0] == pytest.approx([basis.gamma, 0.0, 0.0], abs=1e-13)
    assert blocks[1:, 0] == pytest.approx([0.0, 0.0], abs=1e-13)


def test_cubic_goes_through_the_increments() -> None:
    """theta^3, theta^2 and theta are reproduced."""
    c = RADAU5.c
    H = through(c)
    theta = np.linspace(0, 1, 9)
    for power in (1, 2, 3):
        d = H @ c**power
        found = theta * (1 + (1 - theta) * (d[0] + theta * d[1]))
        assert found == pytest.approx(theta**power, abs=1e-14)


def test_linear_equations_need_one_iteration() -> None:
    """exp(-z) is then Pade's (1 + 2z/5 + z^2/20) / (1 - 3z/5 + 3z^2/20 - z^3/60) at -z."""
    once = replace(RADAU5, iterations=1)
    step = build_fixed(assemble(sf.Model("decay", x=(x,), ode=-x.symbol)), once)
    z = -0.7
    pade = (1 + 2 * z / 5 + z**2 / 20) / (1 - 3 * z / 5 + 3 * z**2 / 20 - z**3 / 60)
    assert float(step(1.0, 0.7, [])) == pytest.approx(pade, rel=1e-14)


@pytest.mark.parametrize("case", [smooth_ode, smooth_dae])
def test_enough_iterations_solve_the_collocation_equations(case: object) -> None:
    """Those of the method agree with many more to the order of the method."""
    problem = case()  # pyright: ignore[reportCallIssue]
    system = assemble(problem.model)
    few, many = (build_fixed(system, replace(RADAU5, iterations=k)) for k in (3, 12))
    y = problem.exact(0.0)
    gaps = [float(ca.norm_inf(few(y, 1 / n, []) - many(y, 1 / n, []))) for n in (4, 8, 16)]
    order = 7 if case is smooth_ode else 5  # h^2 an iteration, h in algebraic unknowns
    assert observed_order([4, 8, 16], gaps) == pytest.approx(order, abs=0.5)


def test_work_counts_one_more_iteration_with_algebraic_unknowns() -> None:
    assert RADAU5.work(assemble(smooth_ode().model)) == (7, 1, 2)
    assert RADAU5.work(assemble(smooth_dae().model)) == (10, 1, 2)


@pytest.mark.parametrize(
    ("before", "last", "enough"),
    [
        (1.0, 0.9 * KAPPA, True),  # small
        (0.8, 0.2, True),  # a quarter each: a third of the last one is still to come
        (0.3, 0.27, False),  # too slow
        (0.1, 0.2, False),  # diverges
        (0.0, 0.0, True),
    ],
)
def test_newton_is_done_when_what_is_to_come_is_small(
    before: float, last: float, enough: bool
) -> None:
    assert bool(converged(ca.DM(before**2), ca.DM(last**2))) == enough


@pytest.mark.parametrize("kind", [ca.SX, ca.MX], ids=["flat", "blocks"])
def test_failed_iteration_is_rejected_and_the_step_halved(kind: type) -> None:
    """x' = -1000 (x - 1)^3 from 2: a Jacobian at the start says little about the end."""
    model = sf.Model("cubic", x=(x,), ode=-1000 * (x.symbol - 1) ** 3)
    step = build_step(assemble(model), RADAU5, kind)
    R = Given.of(1.0, 0.05, 1.0, [0.05], [])  # an error of this size would be allowed
    after = step(State.at(0.0, 0.01, [2.0]), R)[0].full().ravel()
    assert after[State.Y].tolist() == [2.0]
    assert after[State.H] == pytest.approx(0.005)


@pytest.mark.parametrize("law", [sf.BrownMcPhee(), sf.LuGre()], ids=["brown_mcphee", "lugre"])
def test_no_slip_is_lost_at_loose_tolerance(law: sf.BrownMcPhee | sf.LuGre) -> None:
    """At rtol = 1e-3 Rodas5P is off by several parts in a thousand, Radau by less than 3e-4."""
    model, t = sf.rabinowicz(law), np.linspace(0.1, 20.0, 200)
    start = {"v": np.linspace(-0.1, 0.1, 40)}
    exact = sf.simulate_many(model, 20.0, x0=start, rtol=1e-10, t_eval=t)["x"]
    with pytest.warns(UserWarning, match="stick phases"):
        found = sf.simulate_many(model, 20.0, x0=start, rtol=1e-3, t_eval=t)["x"]
    assert np.abs(found - exact).max() < 5e-4 * np.abs(exact).max()


def test_multipliers_that_a_projection_leaves_over_are_no_error_of_the_next_step() -> None:
    """A fast crank in absolute coordinates: the step once shrank to nothing after 2 ms."""
    law = sf.BrownMcPhee(mu_s=0.1, mu_d=0.08, v_t=0.01)
    model = SliderCrank(law).mechanism().build(formulation="absolute")
    run = sf.simulate(model, 0.01, rtol=1e-5, method="radau5")
    exact = sf.simulate(SliderCrank(law).model(), 0.01, rtol=1e-10)
    assert run["energy"] == pytest.approx(exact["energy"], rel=1e-4)
    assert run.statistics.steps < 200


def bare(scene: MechanismScene) -> sf.Model:
    """The scene with nothing that rubs."""
    mechanism = scene.mechanism()
    mechanism.joints = [replace(joint, friction=None) for joint in mechanism.joints]
    return mechanism.build()


TREE, LOOP = bare(DoublePendulum(sf.Viscous())), bare(FourBar(sf.Viscous()))
each = pytest.mark.parametrize("model", [TREE, LOOP], ids=["tree", "loop"])


@each
def test_order_five(model: sf.Model) -> None:
    """Of positions and velocities, accelerations and multipliers alike."""
    whole = system(model, input_data(model, None, 0.0, 1.0))
    start = consistent(
        whole, "start", first_guess(whole, model, model.initial_state()), np.zeros(0)
    )
    step = build_fixed(whole, DOPRI5)

    def end(steps: int) -> np.ndarray:
        h = 0.1 / steps
        return step.mapaccum(steps)(start, h, np.zeros((0, steps))).full()[:, -1]

    exact = end(512)
    errors = [np.abs((end(n) - exact) / (1 + np.abs(exact))).max() for n in (16, 32, 64)]
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    assert (orders > 4.6).all()  # of the loop 6.3 and 5.9: its leading error is small


@each
def test_same_motion_and_reactions_as_by_the_implicit_method(model: sf.Model) -> None:
    runs = [sf.simulate(model, 0.5, rtol=1e-9, method=m, samples=51) for m in ("dopri5", "rodas5p")]
    explicit, implicit = runs
    for name in model.signals:
        size = 1 + np.abs(implicit[name]).max()
        assert explicit[name] == pytest.approx(implicit[name], abs=2e-6 * size)
    assert explicit.statistics.steps < 0.7 * implicit.statistics.steps
    work = len(DOPRI5.A) * (explicit.statistics.steps + explicit.statistics.rejections)
    assert explicit.statistics.factorisations == explicit.statistics.evaluations == work


def test_friction_from_reactions_is_refused() -> None:
    model = FourBar(sf.BrownMcPhee()).model()
    assert eliminated(system(model, input_data(model, None, 0.0, 1.0))) is None
    with pytest.raises(
        ValueError, match=r"DOPRI5: expected an ODE .* with friction from reactions"
    ):
        sf.simulate(model, 0.1, method="dopri5")
