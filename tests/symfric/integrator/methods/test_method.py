"""Parts of all methods, and pivots that follow the numbers."""

import casadi as ca
import numpy as np
import pytest
from closed_forms import assemble, smooth_dae, smooth_ode

from symfric import Model, SolveError, Status, Variable, flow, simulate, simulate_many
from symfric.integrator.compiled.compiler import find_compiler
from symfric.integrator.equations.inputs import input_data
from symfric.integrator.methods.families import need_ode
from symfric.integrator.methods.method import combination
from symfric.integrator.methods.tableaux import METHODS, RODAS5P
from symfric.integrator.running.integrator import Integrator

x, y = Variable("x", "1", start=1.0), Variable("y", "1", start=1.0)
rate = ca.SX.sym("rate", 2)


def test_combination_leaves_out_terms_of_weight_zero() -> None:
    a, b, c = (ca.SX.sym(name, 2) for name in "abc")
    found = combination([2.0, 0.0, -1.0], [a, b, c], ca.SX)
    assert not ca.depends_on(found, b)
    value = ca.Function("f", [a, c], [found])([1.0, 2.0], [3.0, 5.0])
    assert value.full().ravel().tolist() == [-1.0, -1.0]


@pytest.mark.parametrize("kind", [ca.SX, ca.MX])
def test_empty_combination_is_zero(kind: type) -> None:
    assert combination([], [], kind).is_zero()
    assert combination([0.0], [kind.sym("a")], kind).is_zero()


def test_ode_is_taken() -> None:
    need_ode(assemble(smooth_ode().model), "any")


@pytest.mark.parametrize(
    ("model", "message"),
    [
        (smooth_dae().model, "method Euler: expected an ODE .* got the algebraic unknowns z; use"),
        (
            Model(
                "mass", x=(x, y), xdot=rate,
                residual=ca.vertcat(2 * rate[0] + x.symbol, rate[1] + y.symbol),
            ),
            "got a mass matrix",
        ),
        (
            Model(
                "swapped", x=(x, y), xdot=rate,
                residual=ca.vertcat(rate[1] + y.symbol, rate[0] + x.symbol),
            ),
            "got a mass matrix",
        ),
    ],
    ids=["dae", "mass", "swapped"],
)  # fmt: skip
def test_anything_but_an_ode_is_refused_saying_what(model: Model, message: str) -> None:
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


@pytest.mark.parametrize("method", ["rodas5p", "rodas4p", "rodas3", "radau5"])
def test_regular_matrix_with_a_zero_pivot_is_no_singular_one(method: str) -> None:
    """The order by fill begins with s; with s = 0 every run ended with "is singular" at t = 0."""
    run = simulate(AT_START, 0.5, rtol=1e-8, method=method, backend="vm")
    assert run.status is Status.SUCCESS
    at = run.final
    s = at["x"] - 1
    assert s * at["z"] + at["w"] == pytest.approx(at["x"], rel=1e-7)
    assert at["z"] + s * at["w"] == pytest.approx(2 * at["x"], rel=1e-7)


def test_order_that_fails_on_the_way_is_replaced_there() -> None:
    """From t = 0.5 on s is zero: x' = -x."""
    run = simulate(LATER, 1.5, rtol=1e-8, backend="vm", t_eval=[1.0, 1.5])
    assert run.status is Status.SUCCESS
    assert run["x"][1] / run["x"][0] == pytest.approx(np.exp(-0.5), rel=1e-6)
    np.testing.assert_allclose(run["z"], 2 * run["x"], rtol=1e-6)


def test_same_call_takes_the_same_order_whatever_ran_before() -> None:
    model = crossed(x.symbol - 1)
    alone = simulate(model, 0.3, x0={"x": 1.5}, backend="vm")
    simulate(model, 0.3, backend="vm")
    again = simulate(model, 0.3, x0={"x": 1.5}, backend="vm")
    np.testing.assert_array_equal(alone["x"], again["x"])
    assert alone.statistics.steps == again.statistics.steps


def test_sound_order_stays_and_a_better_one_is_built_once() -> None:
    model = crossed(x.symbol - 1)
    made = Integrator(model, input_data(model, None, 0.0, 1.0), RODAS5P)

    def at(start: float) -> Integrator:
        return made.suited([(np.array([start, 0.0, 0.0]), np.zeros(0))], 1.0)

    assert at(1.5) is made
    assert at(1.0) is not made
    assert at(1.0) is at(1.0)
    assert set(at(1.0).system.orders) == {"step", "tiny"}


def test_members_of_an_ensemble_and_derivatives_go_through() -> None:
    starts = np.array([1.5, 1.0, 0.5])
    many = simulate_many(AT_START, 0.3, x0={"x": starts}, backend="vm", executor="serial")
    alone = [simulate(AT_START, 0.3, x0={"x": s}, backend="vm").final["x"] for s in starts]
    assert not many.failed
    np.testing.assert_allclose(many["x"][:, 0], alone, rtol=1e-5)
    run = simulate(AT_START, 0.3, backend="vm", rtol=1e-8, sensitivities=["x0.x"])
    ends = [simulate(AT_START, 0.3, x0={"x": 1 + e}, backend="vm", rtol=1e-10).final["x"]
            for e in (1e-4, -1e-4)]  # fmt: skip
    slope = run.sensitivities["x0.x"]["x"][-1]
    assert slope == pytest.approx((ends[0] - ends[1]) / 2e-4, rel=1e-5)


@pytest.mark.parametrize("method", sorted(name for name, m in METHODS.items() if m.dae))
def test_flow_takes_pivots_that_are_sound_at_the_start_of_the_model(method: str) -> None:
    xf = flow(AT_START, steps=50, method=method)([1.0], [], [], 0.1)
    end = simulate(AT_START, 0.1, rtol=1e-9, backend="vm").final["x"]
    assert float(xf) == pytest.approx(end, rel=2e-3 if method == "backward_euler" else 1e-6)


def test_matrix_that_is_singular_is_called_so() -> None:
    """From t = 0.5 on both equations say the same; the start is regular."""
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
    with pytest.raises(ValueError, match="for z0, z1, z2, z3, z4, z5 and 34 more near"):
        simulate(Model("many", x=(x,), z=many, ode=-x.symbol, alg=alg), 1.0)
    with pytest.raises(ValueError, match="unknowns z0, z1, z2, z3, z4, z5 and 34 more; use an"):
        simulate(
            Model("many", x=(x,), z=many, ode=-x.symbol, alg=alg),
            1.0,
            method="dopri5",
        )


def test_order_found_at_a_failure_is_used_by_every_method() -> None:
    for method in ("rodas5p", "radau5"):
        for rtol in (1e-6, 1e-9):
            run = simulate(LATER, 1.5, rtol=rtol, backend="vm", method=method, t_eval=[1.0, 1.5])
            assert run["x"][1] / run["x"][0] == pytest.approx(np.exp(-0.5), rel=10 * rtol)


def test_replaced_pivots_give_the_same_bits_in_both_engines() -> None:
    if find_compiler() is None:
        pytest.skip("no C compiler")
    runs = [simulate(LATER, 1.5, rtol=1e-8, backend=engine) for engine in ("vm", "compiled")]
    assert runs[0].statistics.steps == runs[1].statistics.steps
    np.testing.assert_array_equal(runs[0]["z"], runs[1]["z"])
