"""Models M y' = f whose mass matrix is singular: taken as they are, started consistently."""

import casadi as ca
import numpy as np
import pytest
from closed_forms import assemble

from symfric import Model, Variable, flow, simulate, simulate_many
from symfric.codegen import plant_block
from symfric.integrator.equations.initial import consistent

a, b = Variable("a", "V", start=2.0), Variable("b", "V", start=0.0)
c = Variable("c", "A")
R = Variable("R", "Ohm", start=1.0)
A, B, rates = a.symbol, b.symbol, ca.SX.sym("rates", 2)
METHODS = ("rodas5p", "rodas4p", "rodas3", "radau5")


def coupled(capacity: float = 0.5) -> Model:
    """A capacitor between two nodes: its current leaves one and enters the other.

    C (a' - b') = -a / R = (b - 2) / R: a + b = 2, 2 C a' = -a / R. M is C [1 -1; -1 1].
    """
    current = capacity * (rates[0] - rates[1])
    residual = ca.vertcat(current + A / R.symbol, -current + (B - 2) / R.symbol)
    return Model("coupled", x=(a, b), p=(R,), xdot=rates, residual=residual)


def varactor(scale: float = 1.0) -> Model:
    """The same with C = 1 + (a - b)^2, and b = -a."""
    current = scale * (1 + (A - B) ** 2) * (rates[0] - rates[1])
    residual = ca.vertcat(current + scale * A, -current + scale * B)
    return Model("varactor", x=(a, b), xdot=rates, residual=residual)


@pytest.mark.parametrize("method", METHODS)
def test_singular_mass_matrix_is_taken_as_it_is(method: str) -> None:
    """These ended with STEP_TOO_SMALL and "a discontinuity is near"."""
    run = simulate(coupled(), 3.0, rtol=1e-8, method=method, backend="vm")
    assert run.step_times.size < 3000
    np.testing.assert_allclose(run["a"], 2 * np.exp(-run.t), atol=1e-6)
    np.testing.assert_allclose(run["a"] + run["b"], 2.0, atol=1e-9)


def test_mass_matrix_stays_and_dependent_rows_lose_their_rates() -> None:
    s = assemble(coupled())
    assert s.names == ("a", "b")
    assert ca.DM(s.mass).full().tolist() == [[0.5, -0.5], [0, 0]]
    assert s.algebraic == ([1], [])
    assert s.free.tolist() == [[1], [1]]
    assert ca.Function("f", [s.y, s.d], [s.f])([2.0, 5.0], [1.0]).full().ravel() == pytest.approx(
        [-2.0, -5.0]
    )


def test_start_becomes_consistent_and_charges_stay() -> None:
    """a - b = 2, the charge of the capacitor over C, is kept; a + b = 2 is met."""
    found = consistent(assemble(coupled()), "here", np.array([3.0, 1.0]), np.array([1.0]))
    assert found == pytest.approx([2.0, 0.0], abs=1e-12)
    run = simulate(coupled(), 1.0, x0={"a": 3.0, "b": 1.0}, rtol=1e-8, backend="vm")
    assert run.final["a"] == pytest.approx(2 * np.exp(-1.0), rel=1e-6)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("scale", [1.0, 1e-6])
def test_singular_matrix_that_depends_on_states_is_no_higher_index(
    method: str, scale: float
) -> None:
    """(1 + 4 a^2) 2 a' = -a: ln a + 2 a^2 + t / 2 stays."""
    s = assemble(varactor(scale))
    assert s.names == ("a", "b", "a_dot")
    run = simulate(varactor(scale), 3.0, rtol=1e-8, method=method, backend="vm", x0={"b": -2.0})
    kept = np.log(run["a"]) + 2 * run["a"] ** 2 + run.t / 2
    np.testing.assert_allclose(kept, kept[0], atol=2e-6)
    np.testing.assert_allclose(run["b"], -run["a"], atol=1e-8)


def test_unknown_without_a_rate_may_stand_among_the_states() -> None:
    """(1 + a^2) a' = -b, 0 = b - a (1 + a^2): a' = -a. Its rate would make it index 2."""
    residual = ca.vertcat((1 + A**2) * rates[0] + B, B - A * (1 + A**2))
    model = Model("mixed", x=(a, b), xdot=rates, residual=residual)
    assert assemble(model).names == ("a", "b", "a_dot")
    run = simulate(model, 1.0, rtol=1e-8, backend="vm")
    np.testing.assert_allclose(run["a"], 2 * np.exp(-run.t), rtol=1e-6)


def test_ensembles_derivatives_and_flows_keep_the_charge_too() -> None:
    starts = np.array([2.0, 3.0, 4.0])
    many = simulate_many(
        coupled(), 1.0, x0={"a": starts, "b": starts - 2}, backend="vm", executor="serial"
    )
    np.testing.assert_allclose(many["a"][:, 0], 2 * np.exp(-1.0), rtol=1e-5)
    run = simulate(coupled(), 1.0, rtol=1e-9, backend="vm", sensitivities=["R", "x0.a"])
    slopes = run.sensitivities
    # a = (1 + (a0 - b0) / 2) exp(-t / R), whatever a0 + b0 is
    np.testing.assert_allclose(slopes["R"]["a"], 2 * run.t * np.exp(-run.t), atol=1e-5)
    np.testing.assert_allclose(slopes["x0.a"]["a"], np.exp(-run.t) / 2, atol=1e-6)
    xf = flow(coupled(), steps=40)([3.0, 1.0], [], [1.0], 1.0)
    assert xf.full().ravel() == pytest.approx([2 * np.exp(-1), 2 - 2 * np.exp(-1)], abs=1e-6)


def test_block_of_c_starts_consistently() -> None:
    made = plant_block(coupled(), h=0.01, method="rodas3")
    assert [v.start for v in made.states] == pytest.approx([2.0, 0.0])


def test_equation_that_is_not_finite_around_the_start_still_has_a_pattern() -> None:
    """The root is real far from the start only; all rates are taken for needed."""
    residual = ca.vertcat(ca.sqrt(A - 50) * rates[0] + A, rates[1] ** 3 + B)
    assert assemble(Model("far", x=(a, b), xdot=rates, residual=residual)).names == (
        "a", "b", "a_dot", "b_dot",
    )  # fmt: skip
