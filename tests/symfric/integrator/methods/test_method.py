"""Parts of all methods, and pivots that follow the numbers."""

import casadi as ca
import numpy as np
import pytest
from backends import needs_compiler
from closed_forms import assemble, smooth_dae, smooth_ode

from symfric import Model, SolveError, Status, Variable, flow, simulate, simulate_many
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


@pytest.mark.parametrize("method", sorted(name for name, m in METHODS.items() if m.dae))
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
