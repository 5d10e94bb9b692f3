"""Models as M y' = f: index, singular mass matrices, consistent starts."""

import casadi as ca
import numpy as np
import pytest
from closed_forms import assemble

import symfric as sf
from symfric.codegen import plant_block
from symfric.integrator.equations.initial import consistent
from symfric.integrator.equations.inputs import Input, input_data
from symfric.integrator.equations.system import System, system
from symfric.model import Monitor

x, y = sf.Variable("x", "m", start=1.0), sf.Variable("y", "m", start=2.0, nominal=0.1)
z, u = sf.Variable("z", "1"), sf.Variable("u", "N", start=3.0)
t = ca.SX.sym("t")
rates = ca.SX.sym("rates", 2)


def assembled(model: sf.Model, **inputs: Input) -> System:
    return system(model, input_data(model, inputs, 0.0, 2.0))


def value(s: System, unknowns: list[float], data: list[float]) -> list[float]:
    """Right-hand side at a point."""
    return ca.Function("f", [s.y, s.d], [s.f])(unknowns, data).full().ravel().tolist()


@pytest.mark.parametrize(
    ("model", "names"),
    [
        (sf.rabinowicz(sf.BrownMcPhee()), ["x", "v"]),
        (sf.rabinowicz(sf.LuGre()), ["x", "v", "z"]),
        (sf.Model("autonomous", x=(x,), ode=-x.symbol, t=t), ["x"]),
        (sf.Model("timed", x=(x,), ode=-t * x.symbol, t=t), ["x", "t"]),
        (sf.Model("dae", x=(x,), z=(z,), ode=-z.symbol, alg=z.symbol - x.symbol), ["x", "z"]),
        (sf.Model("both", x=(x,), z=(z,), ode=-z.symbol, alg=z.symbol - t, t=t), ["x", "z", "t"]),
    ],
    ids=lambda case: case.name if isinstance(case, sf.Model) else "",
)
def test_time_is_an_unknown_only_where_equations_depend_on_it(
    model: sf.Model, names: list[str]
) -> None:
    s = assembled(model)
    assert list(s.names) == names
    assert (s.n, s.timed) == (len(names), names[-1] == "t")
    assert s.d.numel() == 0


@pytest.mark.parametrize(
    ("signal", "unknowns", "data"),
    [
        (2.0, 2, 1),
        (sf.Hold([0.0, 1.0], [0.0, 1.0]), 2, 1),
        (sf.Linear([0.0, 1.0], [1.0, 1.0]), 2, 1),
        (sf.Linear([0.0, 1.0], [0.0, 1.0]), 3, 3),
        (ca.sin, 3, 0),
    ],
    ids=["number", "hold", "level", "linear", "expression"],
)
def test_inputs_cost_only_the_data_they_need(signal: Input, unknowns: int, data: int) -> None:
    """A linear input has value, slope and start of its interval; only it needs time."""
    s = assembled(sf.drive(sf.BrownMcPhee()), force=signal)
    assert (s.n, s.d.numel()) == (unknowns, data)


def test_parameters_come_before_input_data() -> None:
    s = assembled(sf.drive(sf.BrownMcPhee(), free=["m", "offset"]), force=2.0)
    assert [str(name) for name in ca.vertsplit(s.d)][:2] == ["m", "offset"]
    free, force = value(s, [0.0, 0.0], [4.0, 0.0, 2.0]), value(s, [0.0, 0.0], [4.0, 1.0, 5.0])
    assert free == pytest.approx([0.0, 2.0 / 4.0])
    assert force == pytest.approx([0.0, (5.0 - 1.0) / 4.0])


def test_explicit_model_has_unit_mass_for_its_states_only() -> None:
    model = sf.Model("dae", x=(x,), z=(z,), ode=-z.symbol * t, alg=z.symbol - x.symbol, t=t)
    s = assembled(model)
    assert ca.DM(s.mass).full().tolist() == [[1, 0, 0], [0, 0, 0], [0, 0, 1]]
    assert s.mass.nnz() == 2
    assert s.algebraic == ([1], [1])
    assert value(s, [2.0, 3.0, 0.5], []) == [-1.5, 1.0, 1.0]


def test_constant_mass_matrix_is_kept_without_new_unknowns() -> None:
    residual = ca.vertcat(2 * rates[0] + rates[1] + x.symbol, 3 * rates[1] - y.symbol)
    s = assembled(sf.Model("mass", x=(x, y), xdot=rates, residual=residual))
    assert (s.n, s.names) == (2, ("x", "y"))
    assert ca.DM(s.mass).full().tolist() == [[2, 1], [0, 3]]
    assert value(s, [1.0, 2.0], []) == [-1.0, 2.0]
    assert s.algebraic == ([], [])


def test_algebraic_rows_and_columns_of_an_implicit_model_are_found() -> None:
    """Equations without rates and unknowns without rates need not stand at the same place."""
    rate = ca.SX.sym("rate")
    residual = ca.vertcat(z.symbol - 2 * x.symbol, rate + z.symbol)
    s = assembled(sf.Model("dae", x=(x,), z=(z,), xdot=rate, residual=residual))
    assert s.algebraic == ([0], [1])
    run = sf.simulate(sf.Model("dae", x=(x,), z=(z,), xdot=rate, residual=residual), 1.0, rtol=1e-9)
    assert run.final["x"] == pytest.approx(np.exp(-2), rel=1e-7)


@pytest.mark.parametrize(
    "first",
    [rates[0] ** 3 + x.symbol, rates[0] * y.symbol + x.symbol, rates[0] * rates[1] + x.symbol],
    ids=["nonlinear", "state-dependent", "product"],
)
def test_rates_become_unknowns_where_no_constant_mass_matrix_exists(first: ca.SX) -> None:
    model = sf.Model(
        "implicit", x=(x, y), xdot=rates, residual=ca.vertcat(first, rates[1] + y.symbol)
    )
    s = assembled(model)
    assert s.names == ("x", "y", "x_dot", "y_dot")
    assert s.algebraic == ([2, 3], [2, 3])
    assert value(s, [1.0, 2.0, 5.0, 7.0], [])[:2] == [5.0, 7.0]


def test_permuted_equations_of_an_implicit_model_are_no_problem() -> None:
    """Row 1 holds the rate of y and row 2 that of x: no pivot stands on the diagonal."""
    residual = ca.vertcat(rates[1] + y.symbol, rates[0] + x.symbol)
    run = sf.simulate(sf.Model("permuted", x=(x, y), xdot=rates, residual=residual), 1.0, rtol=1e-9)
    assert run.final["x"] == pytest.approx(np.exp(-1), rel=1e-8)
    assert run.final["y"] == pytest.approx(2 * np.exp(-1), rel=1e-8)


def test_monitors_and_nominal_values_are_carried_along() -> None:
    model = sf.Model(
        "watched", x=(x, y), u=(u,), ode=ca.SX([0, 0]),
        monitors=(Monitor(x.symbol - u.symbol, 1e-3), Monitor(y.symbol, 2.0)),
    )  # fmt: skip
    s = assembled(model)
    assert s.nominal.tolist() == [1.0, 0.1]
    assert ca.DM(s.monitor_nominal).full().ravel().tolist() == [1e-3, 2.0]
    assert ca.Function("m", [s.y, s.d], [s.monitors])(
        [5.0, 6.0], [3.0]
    ).full().ravel().tolist() == [2.0, 6.0]


def test_consistent_values_solve_the_algebraic_equations_and_keep_the_rest() -> None:
    model = sf.Model(
        "root", x=(x,), z=(z,), ode=-z.symbol, alg=z.symbol**3 + z.symbol - 10 * x.symbol
    )
    found = consistent(assembled(model), "here", np.array([1.0, 0.5]), np.zeros(0))
    assert found == pytest.approx([1.0, 2.0], rel=1e-12)


def test_consistent_values_are_untouched_without_algebraic_equations() -> None:
    start = np.array([1.0, 2.0])
    found = consistent(assembled(sf.rabinowicz(sf.BrownMcPhee())), "here", start, np.zeros(0))
    assert found is start


px, py = sf.Variable("x", "m", start=1.0), sf.Variable("y", "m")
pu, v, lam = sf.Variable("u", "m/s"), sf.Variable("v", "m/s"), sf.Variable("lam", "N/m")
X, Y, U, V, L = (w.symbol for w in (px, py, pu, v, lam))
CONSTRAINTS = {3: X**2 + Y**2 - 1, 2: X * U + Y * V, 1: U**2 + V**2 - L * (X**2 + Y**2) - 9.81 * Y}


def pendulum(index: int) -> sf.Model:
    ode = ca.vertcat(U, V, -L * X, -L * Y - 9.81)
    return sf.Model("pendulum", x=(px, py, pu, v), z=(lam,), ode=ode, alg=CONSTRAINTS[index])


@pytest.mark.parametrize("index", [2, 3])
def test_constraint_that_says_nothing_of_its_multiplier_is_refused(index: int) -> None:
    """This was "factorise: found no pivot for equations [4]"."""
    with pytest.raises(ValueError, match=r"^model 'pendulum': .* determine lam .*; differentiate"):
        assemble(pendulum(index))


def test_differentiated_constraint_is_taken() -> None:
    assert assemble(pendulum(1)).names == ("x", "y", "u", "v", "lam")
    run = sf.simulate(pendulum(1), 1.0, rtol=1e-9, backend="vm")
    assert run.final["x"] ** 2 + run.final["y"] ** 2 == pytest.approx(1.0, abs=1e-6)


def test_equation_given_twice_is_refused() -> None:
    rates = ca.SX.sym("rates", 2)
    same = rates[0] - rates[1] + X
    model = sf.Model("twice", x=(px, py), xdot=rates, residual=ca.vertcat(same, 2 * same))
    with pytest.raises(ValueError, match=r"model 'twice': .* determine x, y at given states"):
        assemble(model)


def test_charge_that_is_fixed_by_a_constraint_is_refused() -> None:
    """(x^2 + y^2) / 2 has a rate and is given at the same time."""
    rates = ca.SX.sym("rates", 2)
    residual = ca.vertcat(X * rates[0] + Y * rates[1] + X, X**2 + Y**2 - 1)
    with pytest.raises(ValueError, match="determine x_dot, y_dot at"):
        assemble(sf.Model("fixed", x=(px, py), xdot=rates, residual=residual))


a, b = sf.Variable("a", "V", start=2.0), sf.Variable("b", "V", start=0.0)
c = sf.Variable("c", "A")
R = sf.Variable("R", "Ohm", start=1.0)
A, B, r = a.symbol, b.symbol, ca.SX.sym("rates", 2)
METHODS = ("rodas5p", "rodas4p", "rodas3", "radau5")


def coupled(capacity: float = 0.5) -> sf.Model:
    """A capacitor between two nodes: its current leaves one and enters the other.

    C (a' - b') = -a / R = (b - 2) / R: a + b = 2, 2 C a' = -a / R. M is C [1 -1; -1 1].
    """
    current = capacity * (r[0] - r[1])
    residual = ca.vertcat(current + A / R.symbol, -current + (B - 2) / R.symbol)
    return sf.Model("coupled", x=(a, b), p=(R,), xdot=r, residual=residual)


def varactor(scale: float = 1.0) -> sf.Model:
    """The same with C = 1 + (a - b)^2, and b = -a."""
    current = scale * (1 + (A - B) ** 2) * (r[0] - r[1])
    residual = ca.vertcat(current + scale * A, -current + scale * B)
    return sf.Model("varactor", x=(a, b), xdot=r, residual=residual)


@pytest.mark.parametrize("method", METHODS)
def test_singular_mass_matrix_is_taken_as_it_is(method: str) -> None:
    """These ended with STEP_TOO_SMALL and "a discontinuity is near"."""
    run = sf.simulate(coupled(), 3.0, rtol=1e-8, method=method, backend="vm")
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
    run = sf.simulate(coupled(), 1.0, x0={"a": 3.0, "b": 1.0}, rtol=1e-8, backend="vm")
    assert run.final["a"] == pytest.approx(2 * np.exp(-1.0), rel=1e-6)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("scale", [1.0, 1e-6])
def test_singular_matrix_that_depends_on_states_is_no_higher_index(
    method: str, scale: float
) -> None:
    """(1 + 4 a^2) 2 a' = -a: ln a + 2 a^2 + t / 2 stays."""
    s = assemble(varactor(scale))
    assert s.names == ("a", "b", "a_dot")
    run = sf.simulate(varactor(scale), 3.0, rtol=1e-8, method=method, backend="vm", x0={"b": -2.0})
    kept = np.log(run["a"]) + 2 * run["a"] ** 2 + run.t / 2
    np.testing.assert_allclose(kept, kept[0], atol=2e-6)
    np.testing.assert_allclose(run["b"], -run["a"], atol=1e-8)


def test_unknown_without_a_rate_may_stand_among_the_states() -> None:
    """(1 + a^2) a' = -b, 0 = b - a (1 + a^2): a' = -a. Its rate would make it index 2."""
    residual = ca.vertcat((1 + A**2) * r[0] + B, B - A * (1 + A**2))
    model = sf.Model("mixed", x=(a, b), xdot=r, residual=residual)
    assert assemble(model).names == ("a", "b", "a_dot")
    run = sf.simulate(model, 1.0, rtol=1e-8, backend="vm")
    np.testing.assert_allclose(run["a"], 2 * np.exp(-run.t), rtol=1e-6)


def test_ensembles_derivatives_and_flows_keep_the_charge_too() -> None:
    starts = np.array([2.0, 3.0, 4.0])
    many = sf.simulate_many(
        coupled(), 1.0, x0={"a": starts, "b": starts - 2}, backend="vm", executor="serial"
    )
    np.testing.assert_allclose(many["a"][:, 0], 2 * np.exp(-1.0), rtol=1e-5)
    run = sf.simulate(coupled(), 1.0, rtol=1e-9, backend="vm", sensitivities=["R", "x0.a"])
    slopes = run.sensitivities
    # a = (1 + (a0 - b0) / 2) exp(-t / R), whatever a0 + b0 is
    np.testing.assert_allclose(slopes["R"]["a"], 2 * run.t * np.exp(-run.t), atol=1e-5)
    np.testing.assert_allclose(slopes["x0.a"]["a"], np.exp(-run.t) / 2, atol=1e-6)
    xf = sf.flow(coupled(), steps=40)([3.0, 1.0], [], [1.0], 1.0)
    assert xf.full().ravel() == pytest.approx([2 * np.exp(-1), 2 - 2 * np.exp(-1)], abs=1e-6)


def test_block_of_c_starts_consistently() -> None:
    made = plant_block(coupled(), h=0.01, method="rodas3")
    assert [v.start for v in made.states] == pytest.approx([2.0, 0.0])


def test_equation_that_is_not_finite_around_the_start_still_has_a_pattern() -> None:
    """The root is real far from the start only; all rates are taken for needed."""
    residual = ca.vertcat(ca.sqrt(A - 50) * r[0] + A, r[1] ** 3 + B)
    assert assemble(sf.Model("far", x=(a, b), xdot=r, residual=residual)).names == (
        "a", "b", "a_dot", "b_dot",
    )  # fmt: skip
