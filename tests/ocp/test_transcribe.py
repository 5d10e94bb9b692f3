from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from motions import double_integrator, fastest, least_effort, out_and_back, stage

from ocp import Problem, at_end, integral
from ocp.collocation import radau
from ocp.guess import initial_points
from ocp.transcribe import Transcription, make_mesh, transcribe
from ocp.transcribe import stage as stage_function
from symfric import BrownMcPhee, Model, Output, Variable, drive


def program(problem: Problem, intervals: int = 10, degree: int = 3) -> Transcription:
    return transcribe(problem, make_mesh(problem, intervals), radau(degree))


def smooth_motion() -> Problem:
    """Everything at once: friction, a parameter, a path bound, a free duration."""
    law = BrownMcPhee(mu_s=6.0, mu_d=4.0, v_t=0.3)
    free = fastest(drive(law, N=1.0, free=["m"]))
    return replace(free, cost=free.cost + integral(lambda s: s.force**2), bounds={"power": (0, 9)})


def with_algebraic() -> Problem:
    x, z, u = Variable("x", "m", nominal=2.0), Variable("z", "N", nominal=3.0), Variable("u", "N")
    model = Model(
        "dae",
        x=(x,),
        z=(z,),
        u=(u,),
        ode=ca.SX(z.symbol),
        alg=z.symbol + x.symbol - u.symbol,
        outputs={"y": Output(x.symbol * z.symbol, "W")},
    )
    return Problem(model, 1.0, integral(lambda s: s.u**2), bounds={"y": (-1.0, None)})


# --- mesh ---------------------------------------------------------------------------------------


def test_mesh_is_uniform_or_as_given() -> None:
    np.testing.assert_allclose(make_mesh(least_effort(), 4), [0, 0.25, 0.5, 0.75, 1])
    np.testing.assert_array_equal(make_mesh(least_effort(), [0, 0.1, 1]), [0, 0.1, 1])


def test_via_points_become_nodes() -> None:
    problem = least_effort(via={0.5: {"x": 0.5}, 0.3: {"x": 0.2}})
    np.testing.assert_allclose(make_mesh(problem, 4), [0, 0.25, 0.3, 0.5, 0.75, 1])


@pytest.mark.parametrize(
    "intervals", [0, -3, 2.5, True, [0.0], [0, 0.5], [0.1, 1.0], [0, 0.6, 0.5, 1], [[0, 1]]]
)
def test_impossible_meshes_are_refused(intervals: object) -> None:
    with pytest.raises(ValueError, match="intervals: expected"):
        make_mesh(least_effort(), intervals)


# --- size and structure -------------------------------------------------------------------------


@pytest.mark.parametrize("degree", [1, 3])
@pytest.mark.parametrize("make", [lambda: least_effort(), smooth_motion, with_algebraic])
def test_nonzeros_grow_linearly_and_the_graph_does_not_grow(make: object, degree: int) -> None:
    problem: Problem = make()

    def count(intervals: int) -> tuple[list[int], int]:
        nlp = program(problem, intervals, degree)
        multipliers = ca.MX.sym("l", nlp.g.numel())
        lagrangian = nlp.f + ca.dot(multipliers, nlp.g)
        jacobian, hessian = ca.jacobian(nlp.g, nlp.w), ca.hessian(lagrangian, nlp.w)[0]
        graph = ca.Function("g", [nlp.w, nlp.p, multipliers], [jacobian, hessian])
        sizes = [nlp.w.numel(), nlp.g.numel(), jacobian.nnz(), hessian.nnz()]
        return sizes, graph.n_instructions()

    (few, graph), (more, same), (many, still) = count(5), count(10), count(20)
    assert np.all(np.subtract(many, more) == 2 * np.subtract(more, few))
    assert np.all(np.subtract(more, few) > 0)
    assert graph == same == still


def test_program_of_the_drive_has_the_expected_size() -> None:
    """N blocks of 1 + 3*2 unknowns and 3*2 equations, the 2 start values, and T."""
    nlp = program(fastest(stage()), 50)
    assert (nlp.w.numel(), nlp.g.numel()) == (2 + 50 * 7 + 1, 50 * 6)
    # v' couples 4 nodes, force and T; x' couples 4 nodes, v and T
    jacobian = ca.jacobian_sparsity(nlp.g, nlp.w)
    assert jacobian.nnz() == 50 * 3 * ((4 + 1 + 1) + (4 + 1 + 1))


def test_equations_of_an_interval_know_its_own_unknowns_and_the_last_state_before() -> None:
    nlp = program(least_effort(), 40)
    rows, columns = map(np.array, ca.jacobian_sparsity(nlp.g, nlp.w).get_triplet())
    distance = columns - nlp.layout.nx - rows // 6 * nlp.layout.block
    assert distance.min() == -nlp.layout.nx
    assert distance.max() == nlp.layout.block - 1


def test_bounds_only_where_asked() -> None:
    nlp = program(least_effort(bounds={"v": (None, 1.5), "a": (-9.0, 8.0)}))
    lower, upper = (nlp.unpack(bound) for bound in nlp.bounds())
    np.testing.assert_array_equal(lower.x[:, [0, -1]], [[0, 1], [0, 0]])
    np.testing.assert_array_equal(upper.x[:, [0, -1]], [[0, 1], [0, 0]])
    assert np.isinf(lower.x[:, 1:-1]).all()
    assert np.isinf(upper.x[0, 1:-1]).all()
    assert (upper.x[1, 1:-1] == 1.5).all()
    assert (lower.u == -9.0).all()
    assert (upper.u == 8.0).all()


def test_via_bounds_stand_at_their_node() -> None:
    nlp = program(out_and_back(), 10)
    lower, upper = (nlp.unpack(bound) for bound in nlp.bounds())
    (node,) = np.flatnonzero(np.isclose(nlp.fractions, 0.5))
    assert lower.x[0, node] == upper.x[0, node] == 1.0
    assert np.isinf(lower.x[1, node])
    assert np.isinf(lower.x[0, node - 1])


# --- equations ----------------------------------------------------------------------------------


def test_a_known_motion_satisfies_all_equations() -> None:
    """x = t^3/6 under a = t is a polynomial of degree 3; a held input makes it t^2/2."""
    nlp = program(least_effort(T=2.0), 4)
    t = 2.0 * nlp.fractions
    points = replace(initial_points(nlp), x=np.array([t**2 / 2, t]), u=np.ones((1, 4)))
    f, g = ca.Function("fg", [nlp.w, nlp.p], [nlp.f, nlp.g])(nlp.pack(points), [])
    np.testing.assert_allclose(g.full(), 0.0, atol=1e-12)
    assert float(f) == pytest.approx(2.0)  # a^2 over 2 s


def test_equations_of_every_interval_are_taken_at_its_own_time() -> None:
    """x' = t + u under u = 1: x = t^2/2 + t, whose end the cost knows."""
    x, u, t = Variable("x", "m"), Variable("u", "1"), ca.SX.sym("t")
    clock = Model("clock", x=(x,), u=(u,), ode=ca.SX(t + u.symbol), t=t)
    nlp = program(Problem(clock, 2.0, at_end(lambda s: s.x**2)), 4)
    s = 2.0 * nlp.fractions
    points = replace(initial_points(nlp), x=(s**2 / 2 + s)[None], u=np.ones((1, 4)))
    f, g = ca.Function("fg", [nlp.w, nlp.p], [nlp.f, nlp.g])(nlp.pack(points), [])
    np.testing.assert_allclose(g.full(), 0.0, atol=1e-12)
    assert float(f) == pytest.approx(16.0)


def test_rows_of_the_constraints_are_named() -> None:
    nlp = program(with_algebraic(), 2, degree=2)
    names = [name for name, _ in nlp.constraint_names()]
    assert names[:6] == [
        "the equation of x",
        "the algebraic equation 1",
        "the equation of x",
        "the algebraic equation 1",
        "the bound on y",
        "the bound on y",
    ]
    assert len(names) == nlp.g.numel()
    times = [s for _, s in nlp.constraint_names()]
    np.testing.assert_allclose(times[:6], [1 / 6, 1 / 6, 0.5, 0.5, 1 / 6, 0.5])


def test_wrong_slope_shows_in_the_row_of_its_state_only() -> None:
    nlp = program(least_effort(T=2.0), 4)
    t = 2.0 * nlp.fractions
    points = replace(initial_points(nlp), x=np.array([t**2 / 2 + 0.5 * t, t]), u=np.ones((1, 4)))
    g = ca.Function("g", [nlp.w, nlp.p], [nlp.g])(nlp.pack(points), []).full().ravel()
    wrong = {name for (name, _), value in zip(nlp.constraint_names(), g, strict=True) if value}
    large = {
        name
        for (name, _), value in zip(nlp.constraint_names(), g, strict=True)
        if abs(value) > 1e-9
    }
    assert large == {"the equation of x"} <= wrong


def test_nominal_values_scale_unknowns_and_defects() -> None:
    """Ten times the nominal values: a tenth of the unknowns and of the defects, the same cost."""
    model = double_integrator()
    larger = replace(
        model,
        x=tuple(replace(v, nominal=10.0) for v in model.x),
        u=tuple(replace(v, nominal=10.0) for v in model.u),
    )
    one, ten = program(least_effort(model=model)), program(least_effort(model=larger))
    points = replace(initial_points(one), u=np.full((1, 10), 2.0))
    f, g = ca.Function("fg", [one.w, one.p], [one.f, one.g])(one.pack(points), [])
    f_10, g_10 = ca.Function("fg", [ten.w, ten.p], [ten.f, ten.g])(ten.pack(points), [])
    np.testing.assert_allclose(ten.pack(points), one.pack(points) / 10)
    np.testing.assert_allclose(g_10.full(), g.full() / 10, atol=1e-15)
    assert float(f_10) == pytest.approx(float(f))


def test_unpack_undoes_pack() -> None:
    nlp = program(smooth_motion())
    w = np.random.default_rng(0).normal(size=nlp.w.numel())
    np.testing.assert_allclose(nlp.pack(nlp.unpack(w)), w, rtol=1e-14)


# --- derivatives --------------------------------------------------------------------------------


def error_ratios(exact: np.ndarray, at: ca.Function, h: float) -> list[float]:
    """How the error of a central difference falls when its step is halved, twice: 4 each."""
    errors = [
        float(np.linalg.norm((at(step) - at(-step)).full() / (2 * step) - exact))
        for step in (h, h / 2, h / 4)
    ]
    return [errors[0] / errors[1], errors[1] / errors[2]]


@pytest.mark.parametrize("what", ["cost", "constraints", "gradient of the Lagrangian"])
def test_derivatives_are_exact(what: str) -> None:
    """Central differences along a random direction approach the derivative with h^2."""
    nlp = program(smooth_motion(), 3)
    rng = np.random.default_rng(3)
    w_0, direction = rng.uniform(0.5, 1.5, nlp.w.numel()), rng.normal(size=nlp.w.numel())
    multipliers = rng.normal(size=nlp.g.numel())
    lagrangian = nlp.f + ca.dot(ca.DM(multipliers), nlp.g)
    expression = {
        "cost": nlp.f,
        "constraints": nlp.g,
        "gradient of the Lagrangian": ca.gradient(lagrangian, nlp.w),
    }[what]
    jacobian = ca.Function("J", [nlp.w, nlp.p], [ca.jacobian(expression, nlp.w)])
    exact = (jacobian(w_0, [1.2]) @ direction).full()
    value = ca.Function("y", [nlp.w, nlp.p], [expression])

    def along(step: float) -> ca.DM:
        return value(w_0 + step * direction, [1.2])

    assert error_ratios(exact, along, 2e-3) == pytest.approx([4.0, 4.0], abs=0.3)


def test_stage_takes_the_integral_by_the_radau_weights() -> None:
    problem = least_effort(cost=integral(lambda s: s.x**4 + s.t))
    scheme = radau(3)
    s, h, t = scheme.nodes[1:], 0.5, 2.0
    block = np.concatenate([[0.0], np.column_stack([s, 0 * s]).ravel()])  # u, then (x, v) = (s, 0)
    _, share = stage_function(problem, scheme)([0.0, 0.0], block, h, t, [])
    assert float(share) == pytest.approx(h / 5 + h * (t + h / 2))  # exact to degree 4
