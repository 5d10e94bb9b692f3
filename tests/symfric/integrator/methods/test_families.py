"""Families of methods: their steps against closed forms, SciPy and books, and what they cost.

Parts of all methods, and pivots that follow the numbers.
"""

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from backends import needs_compiler
from closed_forms import assemble, smooth_dae, smooth_ode
from scipy.integrate import RK45

import symfric as sf
from symfric import Model, SolveError, Status, Variable, flow, simulate, simulate_many
from symfric.foundation.numeric import NEAR, exp_phi1_phi2
from symfric.integrator.equations.initial import consistent, first_guess
from symfric.integrator.equations.inputs import input_data
from symfric.integrator.methods.attempt import (
    RRow,
    SRow,
    build_dense_step,
    build_fixed,
    build_step,
)
from symfric.integrator.methods.families import eliminated, need_ode
from symfric.integrator.methods.method import combination
from symfric.integrator.methods.tableaux import (
    BACKWARD_EULER,
    DOPRI5,
    EXPONENTIAL,
    RADAU5,
    RODAS5P,
)
from symfric.integrator.running.integrator import Integrator
from symfric.integrator.running.record import Dense
from symfric.scenes import DoublePendulum, FourBar, MechanismScene, SliderCrank

x = sf.Variable("x", "1", start=1.0)


@pytest.mark.parametrize("h", [0.01, 0.5, 1.0, 100.0])
def test_backward_euler_converges_quadratically_to_the_root(h: float) -> None:
    """x_1 + h x_1^2 = x_0; Newton's error is e+ = h e^2 / (1 + 2 h x)."""
    system = assemble(sf.Model("square", x=(x,), ode=-(x.symbol**2)))
    root = (np.sqrt(1 + 4 * h) - 1) / (2 * h)
    found = [float(build_fixed(system, replace(BACKWARD_EULER, iterations=k))(1.0, h, []))
             for k in (1, 2, 12)]  # fmt: skip
    assert found[-1] == pytest.approx(root, rel=1e-14)
    errors = np.abs(np.array(found) - root)
    if h == 0.5:
        assert errors[1] / errors[0] ** 2 == pytest.approx(h / (1 + 2 * h * root), rel=0.2)


def test_backward_euler_stays_bounded_where_the_step_resolves_nothing() -> None:
    for v_t in (1e-3, 1e-5):
        model = sf.rabinowicz(sf.BrownMcPhee(v_t=v_t))
        step = build_fixed(assemble(model), BACKWARD_EULER).mapaccum(2000)
        for h in (0.1, 0.01, 0.001):
            x = step(model.initial_state(), h, []).full()[0]
            assert np.abs(x).max() < 2.0  # the spring balances static friction at 0.57 m


def test_explicit_step_and_its_dense_output_are_those_of_scipy() -> None:
    h, system = 0.2, assemble(smooth_ode().model)

    def rates(_: float, y: np.ndarray) -> list[float]:
        return [-3 * y[0] + y[1] ** 2, y[0] - y[1] - y[1] ** 2]

    solver = RK45(
        rates, 0.0, [1.0, 1.0], 1.0, first_step=h, max_step=h, rtol=1.0, atol=1.0
    )  # fmt: skip
    solver.step()
    found = build_fixed(system, DOPRI5)([1.0, 1.0], h, [])
    assert found.full().ravel() == pytest.approx(solver.y, rel=1e-14)
    rows = build_dense_step(system, DOPRI5)([1.0, 1.0], h, []).full().reshape(-1, 2)
    dense = Dense(np.array([0.0]), np.array([h]), np.ones((1, 2)), rows[:1], rows[None, 1:])
    t = np.linspace(0.0, h, 7)
    assert dense(t) == pytest.approx(solver.dense_output()(t), rel=1e-12)


def test_exponential_functions_are_their_integrals() -> None:
    """phi_1 = int exp(x s), phi_2 = int (1 - s) exp(x s) over [0, 1]; far below zero -1/x."""
    point = ca.SX.sym("x")
    phi = exp_phi1_phi2(point)[1:]
    slopes = [ca.jacobian(one, point) for one in phi]
    function = ca.Function("phi", [point], [*phi, *slopes])
    nodes, weights = (0.5 * part for part in np.polynomial.legendre.leggauss(40))
    s = nodes + 0.5
    for at in (0.0, 1e-9, -1e-4, -0.999 * NEAR, -1.001 * NEAR, 0.5, -1.0, 2.0, -5.0, -20.0):
        phi1, phi2, *_ = map(float, function(at))
        assert phi1 == pytest.approx(weights @ np.exp(at * s), rel=1e-13)
        assert phi2 == pytest.approx(weights @ ((1 - s) * np.exp(at * s)), rel=3e-14 / NEAR)
    for at in (-1e4, -1e12, -1e300):
        assert [float(one) for one in function(at)[:2]] == pytest.approx([-1 / at] * 2, rel=2e-4)
    assert [float(slope) for slope in function(0.0)[2:]] == pytest.approx([1 / 2, 1 / 6])


@pytest.mark.parametrize("rate", [1e-6, 1.0, 1e3, 1e9])
def test_equation_linear_in_its_unknown_is_solved_exactly(rate: float) -> None:
    """x' = 1 - rate x from 2; only an unknown with a slope of its own costs an exponential."""
    point = sf.Variable("point", "1")
    rates = ca.vertcat(1 - rate * x.symbol, x.symbol)
    step = build_fixed(assemble(sf.Model("affine", x=(x, point), ode=rates)), EXPONENTIAL)
    exact = 2 * np.exp(-rate) - np.expm1(-rate) / rate
    assert float(step([2.0, 0.0], 1.0, [])[0]) == pytest.approx(exact, rel=1e-13)
    codes = [step.instruction_id(k) for k in range(step.n_instructions())]
    assert codes.count(ca.OP_EXPM1) == 1


def test_bristles_stay_within_their_travel_at_any_step() -> None:
    """|z| <= g/sigma_0 at the friction's peak, though sigma_0 |v| h / g is a thousand."""
    step = build_fixed(assemble(sf.rabinowicz(sf.LuGre())), EXPONENTIAL)
    limit = 0.8 * 9.81 * sf.LuGre().mu_s / sf.LuGre().sigma_0
    for v in (-3.0, -0.1, 0.3, 3.0):
        z = float(step([0.0, v, 0.0], 0.1, [])[2])
        assert abs(z) <= limit * (1 + 1e-12)
        assert np.sign(z) == np.sign(v - 0.1)


@pytest.mark.parametrize(
    ("law", "attempt", "step", "divisions"),
    [(sf.BrownMcPhee(), 1002, 451, 46), (sf.LuGre(), 1273, 645, 49)],
    ids=["bm", "lugre"],
)
def test_attempt_costs_no_more_instructions_than_it_did(
    law: sf.Law, attempt: int, step: int, divisions: int
) -> None:
    """Other methods must not make the default one dearer; a division takes the time of ten others.

    9 tangents take 18 divisions and 241 instructions: libm's took more time, in branches.
    """
    system = assemble(sf.rabinowicz(law))
    whole = build_step(system, RODAS5P)
    operations = [whole.instruction_id(k) for k in range(whole.n_instructions())]
    assert len(operations) <= attempt
    assert operations.count(ca.OP_DIV) <= divisions
    assert build_fixed(system, RODAS5P).n_instructions() <= step


@pytest.mark.parametrize("kind", [ca.SX, ca.MX], ids=["flat", "blocks"])
def test_failed_iteration_is_rejected_and_the_step_halved(kind: type) -> None:
    """x' = -1000 (x - 1)^3 from 2: a Jacobian at the start says little about the end."""
    model = sf.Model("cubic", x=(x,), ode=-1000 * (x.symbol - 1) ** 3)
    step = build_step(assemble(model), RADAU5, kind)
    R = RRow.of(1.0, 0.05, 1.0, [0.05], [])  # an error of this size would be allowed
    after = step(SRow.at(0.0, 0.01, [2.0]), R)[0].full().ravel()
    assert after[SRow.Y].tolist() == [2.0]
    assert after[SRow.H] == pytest.approx(0.005)


@pytest.mark.parametrize("law", [sf.BrownMcPhee(), sf.LuGre()], ids=["brown_mcphee", "lugre"])
def test_no_slip_is_lost_at_loose_tolerance(law: sf.Law) -> None:
    """At rtol = 1e-3 Rodas5P is off by several parts in a thousand, Radau by less than 3e-4."""
    model, t = sf.rabinowicz(law), np.linspace(0.1, 20.0, 200)
    start = {"v": np.linspace(-0.1, 0.1, 20)}
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
    """The scene without friction."""
    mechanism = scene.mechanism()
    mechanism.joints = [replace(joint, friction=None) for joint in mechanism.joints]
    return mechanism.build()


@pytest.mark.parametrize("scene", [DoublePendulum(sf.Viscous()), FourBar(sf.Viscous())])
def test_explicit_steps_of_mechanisms_have_order_five_and_reactions(scene: MechanismScene) -> None:
    """Of positions, velocities, accelerations and multipliers; of a loop 6.3 and 5.9."""
    model = bare(scene)
    whole = assemble(model)
    guess = first_guess(whole, model, model.initial_state())
    start, step = consistent(whole, "start", guess, np.zeros(0)), build_fixed(whole, DOPRI5)

    def end(steps: int) -> np.ndarray:
        return step.mapaccum(steps)(start, 0.1 / steps, np.zeros((0, steps))).full()[:, -1]

    exact = end(512)
    errors = [np.abs((end(n) - exact) / (1 + np.abs(exact))).max() for n in (16, 32, 64)]
    assert (np.log2(np.divide(errors[:-1], errors[1:])) > 4.6).all()

    runs = [sf.simulate(model, 0.5, rtol=1e-9, method=m, samples=51) for m in ("dopri5", "rodas5p")]
    explicit, implicit = runs
    for name in model.signals:
        size = 1 + np.abs(implicit[name]).max()
        assert explicit[name] == pytest.approx(implicit[name], abs=2e-6 * size)
    assert explicit.statistics.steps < 0.7 * implicit.statistics.steps
    work = len(DOPRI5.A) * (explicit.statistics.steps + explicit.statistics.rejections)
    assert explicit.statistics.factorisations == explicit.statistics.evaluations == work


def test_friction_from_reactions_is_refused_by_explicit_methods() -> None:
    model = FourBar(sf.BrownMcPhee()).model()
    assert eliminated(assemble(model)) is None
    with pytest.raises(
        ValueError, match=r"DOPRI5: expected an ODE .* with friction from reactions"
    ):
        sf.simulate(model, 0.1, method="dopri5")


y = sf.Variable("y", "1", start=1.0)
rate = ca.SX.sym("rate", 2)


def test_combination_leaves_out_terms_of_weight_zero() -> None:
    a, b, c = (ca.SX.sym(name, 2) for name in "abc")
    found = combination([2.0, 0.0, -1.0], [a, b, c], ca.SX)
    assert not ca.depends_on(found, b)
    value = ca.Function("f", [a, c], [found])([1.0, 2.0], [3.0, 5.0])
    assert value.full().ravel().tolist() == [-1.0, -1.0]
    for kind in (ca.SX, ca.MX):
        assert combination([], [], kind).is_zero()
        assert combination([0.0], [kind.sym("a")], kind).is_zero()


def test_explicit_methods_take_an_ode_alone() -> None:
    need_ode(assemble(smooth_ode().model), "any")
    residuals = (
        ca.vertcat(2 * rate[0] + x.symbol, rate[1] + y.symbol),
        ca.vertcat(rate[1] + y.symbol, rate[0] + x.symbol),
    )
    masses = [Model("mass", x=(x, y), xdot=rate, residual=rows) for rows in residuals]
    algebraic = "method Euler: expected an ODE .* got the algebraic unknowns z; use"
    for model, message in (
        (smooth_dae().model, algebraic), *((model, "got a mass matrix") for model in masses)
    ):  # fmt: skip
        with pytest.raises(ValueError, match=message):
            need_ode(assemble(model), "Euler")


t = ca.SX.sym("t")
z = Variable("z", "N"), Variable("w", "N")
Z, W = (v.symbol for v in z)


def crossed(s: ca.SX) -> Model:
    """[s 1; 1 s] (z, w) = (x, 2 x), x' = -w. At s = 0 no pivot stands on the diagonal."""
    alg = ca.vertcat(s * Z + W - x.symbol, Z + s * W - 2 * x.symbol)
    return Model("crossed", x=(x,), z=z, ode=-W, alg=alg, t=t)


AT_START = crossed(x.symbol - 1)
LATER = crossed(ca.fmax(0.5 - t, 0))


@pytest.mark.parametrize("method", ["backward_euler", "radau5", "rodas5p"])
def test_regular_matrix_with_a_zero_pivot_is_not_singular(method: str) -> None:
    """The order by fill begins with s; with s = 0 every run ended with "is singular" at t = 0.

    In `LATER` s is zero from t = 0.5 on, where x' = -x.
    """
    fixed = method == "backward_euler"
    xf = flow(AT_START, steps=50, method=method)([1.0], [], [], 0.1)
    end = simulate(AT_START, 0.1, rtol=1e-9, backend="vm").final["x"]
    assert float(xf) == pytest.approx(end, rel=2e-3 if fixed else 1e-6)
    if fixed:
        return
    at = simulate(AT_START, 0.5, rtol=1e-8, method=method, backend="vm").final
    s = at["x"] - 1
    assert s * at["z"] + at["w"] == pytest.approx(at["x"], rel=1e-7)
    assert at["z"] + s * at["w"] == pytest.approx(2 * at["x"], rel=1e-7)
    for rtol in (1e-6, 1e-9):
        run = simulate(LATER, 1.5, rtol=rtol, backend="vm", method=method, t_eval=[1.0, 1.5])
        assert run["x"][1] / run["x"][0] == pytest.approx(np.exp(-0.5), rel=10 * rtol)
        np.testing.assert_allclose(run["z"], 2 * run["x"], rtol=100 * rtol)


def test_same_call_takes_the_same_order_whatever_ran_before() -> None:
    model = crossed(x.symbol - 1)
    alone = simulate(model, 0.3, x0={"x": 1.5}, backend="vm")
    simulate(model, 0.3, backend="vm")
    again = simulate(model, 0.3, x0={"x": 1.5}, backend="vm")
    np.testing.assert_array_equal(alone["x"], again["x"])
    assert alone.statistics.steps == again.statistics.steps
    made = Integrator(model, input_data(model, None, 0.0, 1.0), RODAS5P)

    def at(start: float) -> Integrator:
        return made.suited([(np.array([start, 0.0, 0.0]), np.zeros(0))], 1.0)

    assert at(1.5) is made
    assert made is not at(1.0) is at(1.0)
    assert set(at(1.0).system.orders) == {"step", "tiny"}


def test_members_of_an_ensemble_and_derivatives_go_through() -> None:
    starts = np.array([1.5, 1.0, 0.5])
    many = simulate_many(AT_START, 0.3, x0={"x": starts}, backend="vm", executor="serial")
    alone = [simulate(AT_START, 0.3, x0={"x": s}, backend="vm").final["x"] for s in starts]
    assert not many.failed
    np.testing.assert_allclose(many["x"][:, 0], alone, rtol=1e-5)
    run = simulate(AT_START, 0.3, backend="vm", rtol=1e-8, sensitivities=["x0.x"])
    above, below = (
        simulate(AT_START, 0.3, x0={"x": 1 + e}, backend="vm", rtol=1e-10).final["x"]
        for e in (1e-4, -1e-4)
    )
    slope = run.sensitivities["x0.x"]["x"][-1]
    assert slope == pytest.approx((above - below) / 2e-4, rel=1e-5)


def test_matrix_that_is_singular_is_called_so() -> None:
    """From t = 0.5 on both equations are the same; the start is regular."""
    s = ca.fmin(2 * t, 1)
    alg = ca.vertcat(s * Z + W - x.symbol, Z + s * W - x.symbol)
    with pytest.raises(SolveError) as caught:
        simulate(Model("lost", x=(x,), z=z, ode=-Z, alg=alg, t=t), 1.0, backend="vm")
    assert caught.value.status is Status.SINGULAR
    assert "the iteration matrix is singular in z, w" in str(caught.value)


def test_long_lists_of_unknowns_are_cut() -> None:
    """Forty unknowns stood in one sentence."""
    many = tuple(Variable(f"z{i}", "N") for i in range(40))
    alg = ca.vertcat(*(v.symbol**2 + 1 for v in many))
    model, names = Model("many", x=(x,), z=many, ode=-x.symbol, alg=alg), "z0, z1, z2, z3, z4, z5"
    with pytest.raises(ValueError, match=f"for {names} and 34 more near"):
        simulate(model, 1.0)
    with pytest.raises(ValueError, match=f"unknowns {names} and 34 more; use an"):
        simulate(model, 1.0, method="dopri5")


@needs_compiler
def test_replaced_pivots_give_the_same_bits_in_both_engines() -> None:
    runs = [simulate(LATER, 1.5, rtol=1e-8, backend=engine) for engine in ("vm", "compiled")]
    assert runs[0].statistics.steps == runs[1].statistics.steps
    np.testing.assert_array_equal(runs[0]["z"], runs[1]["z"])
