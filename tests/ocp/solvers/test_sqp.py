import casadi as ca
import numpy as np
import pytest
from motions import stage
from phases import fastest_move, unit_move

from ocp.formulation.expressions import integral
from ocp.formulation.phase import Free
from ocp.solving.methods import Convexified, Ipopt, Sqp
from ocp.solving.one_solve import solve_once
from ocp.transcription.program import Place, Program, Progress
from ocp.transcription.schemes import Radau, make_meshes
from ocp.transcription.transcribe import discretise
from symfric import Model, Status, Variable


def program(cost: ca.SX, w: ca.SX, fractions: list[float]) -> Program:
    """An unconstrained one."""
    p, g, none = ca.SX(0, 1), ca.SX(0, 1), np.zeros(0)
    lam_f, lam_g = ca.SX.sym("lam_f"), ca.SX.sym("lam_g", 0)
    triangle = ca.triu(ca.hessian(lam_f * cost, w)[0])
    ends = [-np.inf] * w.numel(), [np.inf] * w.numel()
    x = ca.MX.sym("x", w.numel())
    f = ca.Function("f", [w], [cost])
    return Program(
        x, ca.MX(0, 1), f(x), ca.MX(0, 1),
        ca.Function("nlp_grad_f", [w, p], [cost, ca.gradient(cost, w)], ["x", "p"],
                    ["f", "grad_f_x"]),
        ca.Function("nlp_jac_g", [w, p], [g, ca.SX(0, w.numel())], ["x", "p"], ["g", "jac_g_x"]),
        ca.Function("nlp_hess_l", [w, p, lam_f, lam_g], [triangle],
                    ["x", "p", "lam_f", "lam_g"], ["triu_hess_gamma_x_x"]),
        np.array(ends[0]), np.array(ends[1]), none, none, none, [],
        [Place(f"w_{k}", 0, s) for k, s in enumerate(fractions)], np.ones(w.numel()),
    )  # fmt: skip


def convex(made: Program, at: np.ndarray) -> np.ndarray:
    return ca.DM(Convexified(made)(at, [], 1.0, [])).full()


def test_negative_eigenvalues_vanish_block_by_block() -> None:
    w = ca.SX.sym("w", 5)
    cost = w[0] * w[3] - 2 * w[1] ** 2 + w[2] ** 2
    found = convex(program(cost, w, [0.0] * 5), np.zeros(5))
    expected = np.diag([0.5, 0.0, 2.0, 0.5, 0.0])
    expected[0, 3] = expected[3, 0] = 0.5
    np.testing.assert_allclose(found, expected, atol=1e-7)


def test_what_belongs_to_all_borders_every_block() -> None:
    """[[A_1, b_1], [b_1', c]] + ...: semidefinite, and as it was where it already is."""
    w = ca.SX.sym("w", 5)
    good = ca.sumsqr(w) + 0.5 * w[4] * ca.sum1(w[:4]) + 0.1 * w[0] * w[1]
    made = program(good, w, [0.0] * 4 + [np.nan])
    whole = ca.hessian(good, w)[0]
    np.testing.assert_allclose(convex(made, np.ones(5)), ca.DM(whole).full(), atol=1e-7)
    bad = w[4] * ca.sumsqr(w[:4]) - w[4] ** 2 - w[0] * w[1]
    found = convex(program(bad, w, [0.0] * 4 + [np.nan]), np.arange(5.0) - 3)
    assert np.linalg.eigvalsh(found).min() > -1e-12
    assert found[2, 3] == 0.0


def test_hessians_of_motions_are_made_semidefinite() -> None:
    problem = fastest_move(0.1)
    made = discretise(problem, Radau()).on(make_meshes(problem, 4)).program
    random = np.random.default_rng(0)
    w, lam = random.standard_normal(made.w.numel()), random.standard_normal(made.g.numel())
    triangle = ca.DM(made.hessian(w, made.values, 1.0, lam)).full()
    exact = triangle + np.triu(triangle, 1).T
    found = ca.DM(Convexified(made)(w, made.values, 1.0, lam)).full()
    np.testing.assert_allclose(found, found.T, atol=1e-9)
    assert np.linalg.eigvalsh(exact).min() < -0.1
    assert np.linalg.eigvalsh(found).min() > -1e-9


def test_it_finds_what_ipopt_finds(capfd: pytest.CaptureFixture[str]) -> None:
    problem = unit_move(model=stage(0.1), cost=integral(lambda s: s.force**2))
    one, two = (solve_once(problem, 20, solver=solver) for solver in (Sqp(), Ipopt()))
    assert one.ok
    assert one.cost == pytest.approx(two.cost, rel=1e-7)
    assert capfd.readouterr() == ("", "")


def test_free_durations_and_algebraic_variables_are_taken() -> None:
    x, v, z = Variable("x", "m"), Variable("v", "m/s"), Variable("z", "m/s")
    a = Variable("a", "m/s^2")
    model = Model("dae", x=(x, v), z=(z,), u=(a,), ode=ca.vertcat(z.symbol, a.symbol),
                  alg=z.symbol - v.symbol)  # fmt: skip
    cost = integral(lambda s: 1 + s.a**2)
    problem = unit_move(model=model, T=Free(0.5, 5.0), cost=cost)
    one, two = (solve_once(problem, 8, solver=solver) for solver in (Sqp(), Ipopt()))
    assert one.ok
    assert pytest.approx(two.T, rel=1e-5) == one.T


def test_it_is_watched_and_stopped() -> None:
    seen: list[Progress] = []
    hard = fastest_move(0.1)
    partial = solve_once(hard, 10, solver=Sqp(max_iter=3), progress=seen.append)
    assert partial.status is Status.MAX_ITERATIONS
    assert [p.iteration for p in seen] == [0, 1, 2, 3]
    assert "(Sqp after 3 iterations: Maximum_Iterations_Exceeded.)" in partial.message
    late = solve_once(hard, 10, solver=Sqp(max_time=1e-6))
    assert late.status is Status.TIME_LIMIT
    assert "The time limit of 1e-06 s ended Sqp after 0 iterations" in late.message


@pytest.mark.parametrize(
    "options", [{"no_such_option": 1}, {"qpsol": "nonsense"}, {"max_iter": "many"}]
)
def test_unknown_options_are_refused(options: dict[str, str | int]) -> None:
    with pytest.raises(ValueError, match=r"Sqp: expected options of Sqp, got \{.*\}; "):
        solve_once(unit_move(), 3, solver=Sqp(**options))
