"""What a model becomes for the step: unknowns only where needed, mass matrices kept."""

import casadi as ca
import numpy as np
import pytest

from symfric import BrownMcPhee, Hold, Linear, LuGre, Model, Variable, drive, rabinowicz, simulate
from symfric.integrator.equations.initial import consistent
from symfric.integrator.equations.inputs import Input, input_data
from symfric.integrator.equations.system import System, system
from symfric.model import Monitor

x, y = Variable("x", "m", start=1.0), Variable("y", "m", start=2.0, nominal=0.1)
z, u = Variable("z", "1"), Variable("u", "N", start=3.0)
t = ca.SX.sym("t")
rates = ca.SX.sym("rates", 2)


def assembled(model: Model, **inputs: Input) -> System:
    return system(model, input_data(model, inputs, 0.0, 2.0))


def value(s: System, unknowns: list[float], data: list[float]) -> list[float]:
    """Right-hand side at a point."""
    return ca.Function("f", [s.y, s.d], [s.f])(unknowns, data).full().ravel().tolist()


@pytest.mark.parametrize(
    ("model", "names"),
    [
        (rabinowicz(BrownMcPhee()), ["x", "v"]),
        (rabinowicz(LuGre()), ["x", "v", "z"]),
        (Model("autonomous", x=(x,), ode=-x.symbol, t=t), ["x"]),
        (Model("timed", x=(x,), ode=-t * x.symbol, t=t), ["x", "t"]),
        (Model("dae", x=(x,), z=(z,), ode=-z.symbol, alg=z.symbol - x.symbol), ["x", "z"]),
        (Model("both", x=(x,), z=(z,), ode=-z.symbol, alg=z.symbol - t, t=t), ["x", "z", "t"]),
    ],
    ids=lambda case: case.name if isinstance(case, Model) else "",
)
def test_time_is_an_unknown_only_where_equations_depend_on_it(
    model: Model, names: list[str]
) -> None:
    s = assembled(model)
    assert list(s.names) == names
    assert (s.n, s.timed) == (len(names), names[-1] == "t")
    assert s.d.numel() == 0


@pytest.mark.parametrize(
    ("signal", "unknowns", "data"),
    [
        (2.0, 2, 1),
        (Hold([0.0, 1.0], [0.0, 1.0]), 2, 1),
        (Linear([0.0, 1.0], [1.0, 1.0]), 2, 1),
        (Linear([0.0, 1.0], [0.0, 1.0]), 3, 3),
        (ca.sin, 3, 0),
    ],
    ids=["number", "hold", "level", "linear", "expression"],
)
def test_inputs_cost_only_the_data_they_need(signal: Input, unknowns: int, data: int) -> None:
    """A linear input has value, slope and start of its interval; only it needs time."""
    s = assembled(drive(BrownMcPhee()), force=signal)
    assert (s.n, s.d.numel()) == (unknowns, data)


def test_parameters_come_before_input_data() -> None:
    s = assembled(drive(BrownMcPhee(), free=["m", "offset"]), force=2.0)
    assert [str(name) for name in ca.vertsplit(s.d)][:2] == ["m", "offset"]
    free, force = value(s, [0.0, 0.0], [4.0, 0.0, 2.0]), value(s, [0.0, 0.0], [4.0, 1.0, 5.0])
    assert free == pytest.approx([0.0, 2.0 / 4.0])
    assert force == pytest.approx([0.0, (5.0 - 1.0) / 4.0])


def test_explicit_model_has_unit_mass_for_its_states_only() -> None:
    model = Model("dae", x=(x,), z=(z,), ode=-z.symbol * t, alg=z.symbol - x.symbol, t=t)
    s = assembled(model)
    assert ca.DM(s.mass).full().tolist() == [[1, 0, 0], [0, 0, 0], [0, 0, 1]]
    assert s.mass.nnz() == 2
    assert s.algebraic == ([1], [1])
    assert value(s, [2.0, 3.0, 0.5], []) == [-1.5, 1.0, 1.0]


def test_constant_mass_matrix_is_kept_without_new_unknowns() -> None:
    residual = ca.vertcat(2 * rates[0] + rates[1] + x.symbol, 3 * rates[1] - y.symbol)
    s = assembled(Model("mass", x=(x, y), xdot=rates, residual=residual))
    assert (s.n, s.names) == (2, ("x", "y"))
    assert ca.DM(s.mass).full().tolist() == [[2, 1], [0, 3]]
    assert value(s, [1.0, 2.0], []) == [-1.0, 2.0]
    assert s.algebraic == ([], [])


def test_algebraic_rows_and_columns_of_an_implicit_model_are_found() -> None:
    """Equations without rates and unknowns without rates need not stand at the same place."""
    rate = ca.SX.sym("rate")
    residual = ca.vertcat(z.symbol - 2 * x.symbol, rate + z.symbol)
    s = assembled(Model("dae", x=(x,), z=(z,), xdot=rate, residual=residual))
    assert s.algebraic == ([0], [1])
    run = simulate(Model("dae", x=(x,), z=(z,), xdot=rate, residual=residual), 1.0, rtol=1e-9)
    assert run.final["x"] == pytest.approx(np.exp(-2), rel=1e-7)


@pytest.mark.parametrize(
    "first",
    [rates[0] ** 3 + x.symbol, rates[0] * y.symbol + x.symbol, rates[0] * rates[1] + x.symbol],
    ids=["nonlinear", "state-dependent", "product"],
)
def test_rates_become_unknowns_where_no_constant_mass_matrix_exists(first: ca.SX) -> None:
    model = Model("implicit", x=(x, y), xdot=rates, residual=ca.vertcat(first, rates[1] + y.symbol))
    s = assembled(model)
    assert s.names == ("x", "y", "x_dot", "y_dot")
    assert s.algebraic == ([2, 3], [2, 3])
    assert value(s, [1.0, 2.0, 5.0, 7.0], [])[:2] == [5.0, 7.0]


def test_permuted_equations_of_an_implicit_model_are_no_problem() -> None:
    """Row 1 holds the rate of y and row 2 that of x: no pivot stands on the diagonal."""
    residual = ca.vertcat(rates[1] + y.symbol, rates[0] + x.symbol)
    run = simulate(Model("permuted", x=(x, y), xdot=rates, residual=residual), 1.0, rtol=1e-9)
    assert run.final["x"] == pytest.approx(np.exp(-1), rel=1e-8)
    assert run.final["y"] == pytest.approx(2 * np.exp(-1), rel=1e-8)


def test_monitors_and_nominal_values_are_carried_along() -> None:
    model = Model(
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
    model = Model("root", x=(x,), z=(z,), ode=-z.symbol, alg=z.symbol**3 + z.symbol - 10 * x.symbol)
    found = consistent(assembled(model), "here", np.array([1.0, 0.5]), np.zeros(0))
    assert found == pytest.approx([1.0, 2.0], rel=1e-12)


def test_consistent_values_are_untouched_without_algebraic_equations() -> None:
    start = np.array([1.0, 2.0])
    found = consistent(assembled(rabinowicz(BrownMcPhee())), "here", start, np.zeros(0))
    assert found is start
