"""The interface between equations and solvers."""

import pickle
from copy import copy
from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

from symfric import BrownMcPhee, Model, Output, Variable, rabinowicz, simulate
from symfric.model import Event, Monitor
from symfric.scenes import Arm

x, y = Variable("x", "m", start=1.0, nominal=0.1), Variable("y", "m/s")
w, u, k = Variable("w", "N"), Variable("u", "N", start=2.0), Variable("k", "N/m", start=3.0)


def oscillator() -> Model:
    """x' = y, y' = w, 0 = w + k x - u."""
    return Model(
        "oscillator",
        x=(x, y),
        z=(w,),
        u=(u,),
        p=(k,),
        ode=ca.vertcat(y.symbol, w.symbol),
        alg=w.symbol + k.symbol * x.symbol - u.symbol,
        outputs={"energy": Output(k.symbol * x.symbol**2 / 2, "J")},
    )


def test_functions_have_named_arguments_and_the_values_of_the_equations() -> None:
    model = oscillator()
    point = {"t": 0.0, "x": [1.0, 2.0], "z": 3.0, "u": 4.0, "p": 5.0}
    assert model.function("ode")(**point)["ode"].full().ravel().tolist() == [2.0, 3.0]
    assert model.function("alg")(**point)["alg"].full().ravel().tolist() == [4.0]
    assert float(model.function("energy")(**point)["energy"]) == 2.5
    residual = model.function("residual")
    assert residual.name_in() == ["t", "xdot", "x", "z", "u", "p"]
    assert residual(xdot=[2.5, 3.5], **point)["residual"].full().ravel().tolist() == [0.5, 0.5, 4.0]


def test_signals_stack_in_the_order_of_their_names() -> None:
    model = oscillator()
    assert model.signals == {"x": "m", "y": "m/s", "w": "N", "u": "N", "energy": "J"}
    stacked = model.function("signals")(0.0, [1.0, 2.0], 3.0, 4.0, 5.0)
    assert stacked.full().ravel().tolist() == [1.0, 2.0, 3.0, 4.0, 2.5]


def test_absent_groups_are_columns_without_rows() -> None:
    model = Model("decay", x=(x,), ode=-x.symbol)
    assert [model.vector(letter).shape for letter in "xzup"] == [(1, 1), (0, 1), (0, 1), (0, 1)]
    assert model.function("ode").size_in("u") == (0, 1)
    assert model.nominal("x").tolist() == [0.1]
    assert model.nominal("p").shape == (0,)


def test_values_are_starts_replaced_by_name() -> None:
    model = oscillator()
    assert model.values("p").tolist() == [3.0]
    assert model.values("u", {"u": 5}).tolist() == [5.0]
    assert model.initial_state({"y": -1.0}).tolist() == [1.0, -1.0]


def test_start_values_may_depend_on_states_and_parameters() -> None:
    a = Variable("a", "1", start=2.0)
    b = Variable("b", "1", start=a.symbol * k.symbol)
    c = Variable("c", "1", start=b.symbol + 1)
    model = Model("chain", x=(c, a, b), p=(k,), ode=ca.SX(3, 1))
    assert model.initial_state().tolist() == [7.0, 2.0, 6.0]
    assert model.initial_state({"a": 1.0}, {"k": 5.0}).tolist() == [6.0, 1.0, 5.0]
    assert model.initial_state({"b": 0.0}).tolist() == [1.0, 2.0, 0.0]


def test_implicit_model_has_a_residual_and_no_ode() -> None:
    xdot = ca.SX.sym("xdot")
    model = Model("implicit", x=(x,), xdot=xdot, residual=xdot**3 + x.symbol)
    assert model.ode is None
    assert float(model.function("residual")(0, 2.0, 1.0, [], [], [])) == 9.0
    with pytest.raises(ValueError, match=r"model 'implicit': expected one of alg, .*got ode"):
        model.function("ode")


stray = ca.SX.sym("stray")
BAD = {
    "wrong ode rows": ({"x": (x,), "ode": ca.SX(2, 1)}, r"ode: expected 1 row .* got 2"),
    "wrong alg rows": (
        {"x": (x,), "ode": ca.SX(1, 1), "alg": ca.SX(1, 1)},
        r"alg: expected 0 rows, got 1",
    ),
    "wrong residual rows": ({"x": (x,), "residual": ca.SX(2, 1)}, r"residual: expected 1 row"),
    "undeclared symbol": (
        {"x": (x,), "ode": x.symbol * stray},
        r"expected only declared symbols, got stray; declare",
    ),
    "undeclared in an output": (
        {"x": (x,), "ode": x.symbol, "outputs": {"o": Output(stray, "1")}},
        r"got stray",
    ),
    "repeated name": ({"x": (x,), "u": (Variable("x", "1"),), "ode": x.symbol}, r"once, got x"),
    "output named like a state": (
        {"x": (x,), "ode": x.symbol, "outputs": {"x": Output(x.symbol, "m")}},
        r"got x",
    ),
    "state named t": ({"x": (Variable("t", "s"),), "ode": ca.SX(1, 1)}, r"none of .* got t"),
    "a circle of start values": (
        {
            "x": (Variable("a", "1", symbol=stray, start=x.symbol), replace(x, start=2 * stray)),
            "ode": ca.SX(2, 1),
        },
        r"start: expected start values without circular dependencies, got a, x",
    ),
    "row for a column": ({"x": (x, Variable("y", "1")), "ode": ca.SX(1, 2)}, r"ode: .* got a row"),
    "symbol of the same name": (
        {"x": (x,), "ode": ca.SX.sym("x")},
        r"another symbol than that of the variable x",
    ),
    "time nobody gave": ({"x": (x,), "ode": ca.SX.sym("t")}, r"give the symbol of time as t=t"),
    "contact forgotten": ({"x": (x,), "ode": ca.SX.sym("g_F")}, r"missing in contacts="),
    "Greek letter": ({"x": (Variable("φ_1", "rad"),), "ode": ca.SX(1, 1)}, r"got φ_1; write phi_1"),
    "one variable, no tuple": ({"x": x, "ode": ca.SX(1, 1)}, r"got variable 'x' .*; write \(x,\)"),
    "output named ode": (
        {"x": (x,), "ode": x.symbol, "outputs": {"ode": Output(x.symbol, "m")}},
        r"got ode",
    ),
    "name that C does not take": (
        {"x": (Variable("v rel", "m/s"),), "ode": ca.SX(1, 1)},
        r"C identifiers, got v rel",
    ),
    "reset of an unknown state": (
        {"x": (x,), "ode": x.symbol, "events": (Event("hit", x.symbol, reset={"q": 0.0}),)},
        r"event 'hit': expected resets of x, got q",
    ),
    "undeclared in an event": (
        {"x": (x,), "ode": x.symbol, "events": (Event("hit", x.symbol - stray),)},
        r"got stray",
    ),
    "undeclared in a monitor": (
        {"x": (x,), "ode": x.symbol, "monitors": (Monitor(stray, 1.0),)},
        r"got stray",
    ),
    "vector output": (
        {"x": (x,), "ode": x.symbol, "outputs": {"two": Output(ca.SX(2, 1), "1")}},
        r"scalar expressions, got output 'two'",
    ),
}


@pytest.mark.parametrize("case", BAD)
def test_inconsistent_model_is_refused(case: str) -> None:
    arguments, message = BAD[case]
    with pytest.raises(ValueError, match=rf"model 'bad': .*{message}"):
        Model("bad", **arguments)


def test_all_problems_of_a_model_are_reported_at_once() -> None:
    with pytest.raises(ValueError, match=r"got x; ode: expected 2 rows .* got 1; .* got stray"):
        Model("bad", x=(x, Variable("x", "m")), ode=stray)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda m: m.function("nrg"), "model 'oscillator': expected one of .* got nrg"),
        (lambda m: m.values("p", {"kk": 1.0}), "model 'oscillator' p: .* got kk; did you mean k"),
        (lambda m: m.values("p", {"k": "stiff"}), "oscillator.k: expected a finite .* got 'stiff'"),
        (lambda m: m.initial_state({"z": 1.0}), "model 'oscillator' x0: .* got z"),
        (lambda m: m.initial_state({"x": np.nan}), "oscillator.x: expected a finite .* got nan"),
        (lambda m: m.initial_state({"x": None}), "oscillator.x: expected a finite .* got None"),
    ],
)
def test_bad_values_are_refused_by_name(call: object, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        call(oscillator())  # type: ignore[operator]


def test_start_value_that_is_not_a_number_is_refused() -> None:
    model = Model(
        "log", x=(Variable("s", "1", start=ca.log(k.symbol - 3)),), p=(k,), ode=ca.SX(1, 1)
    )
    with pytest.raises(ValueError, match=r"log\.s: expected a finite number, got -?inf"):
        model.initial_state()


def test_details_are_written_when_asked_for_and_once() -> None:
    x, calls = Variable("x", "m"), []

    def more() -> dict[str, Output]:
        calls.append("written")
        return {"twice": Output(2 * x.symbol, "m")}

    model = Model("m", x=(x,), ode=-x.symbol, details=more)
    assert float(model.function("ode")(0, 3, [], [], [])) == -3
    assert not calls
    assert float(model.function("twice")(0, 3, [], [], [])) == 6
    assert ca.is_equal(model.expression("x"), x.symbol)
    assert ca.is_equal(model.expression("twice"), 2 * x.symbol, 2)
    assert calls == ["written"]
    with pytest.raises(ValueError, match="got twce; did you mean twice"):
        model.expression("twce")


def test_details_with_known_names_are_refused() -> None:
    x = Variable("x", "m")
    model = Model("m", x=(x,), ode=-x.symbol, details=lambda: {"x": Output(x.symbol, "m")})
    with pytest.raises(ValueError, match="model 'm': details: expected new names, got x"):
        model.expression("y")


def test_model_without_states_is_solved_or_refused_in_a_sentence() -> None:
    """Both crashed in CasADi or with a division by zero."""
    z, t = Variable("z", "1", start=1.0), ca.SX.sym("t")
    for given in ({"alg": z.symbol**3 - t - 1}, {"residual": z.symbol**3 - t - 1}):
        run = simulate(Model("root", z=(z,), t=t, **given), 1.0)
        assert run.final["z"] == pytest.approx(2 ** (1 / 3), abs=1e-6)
    for model in (Model("empty"), Model("still", ode=ca.SX(0, 1))):
        with pytest.raises(ValueError, match=r"model '\w+': expected states x or unknowns z"):
            simulate(model, 1.0)


def test_a_copy_and_a_pickle_have_the_same_symbols() -> None:
    machine = Arm(BrownMcPhee()).mechanism()
    model = rabinowicz(BrownMcPhee())
    run = simulate(model, 0.1)
    assert len(copy(machine).build().u) == 6  # its forces know the inputs
    assert ca.is_equal(copy(model).x[0].symbol, model.x[0].symbol)
    assert copy(run).model is model
    assert copy(machine).inputs[0] is machine.inputs[0]
    assert ca.is_equal(pickle.loads(pickle.dumps(model)).x[0].symbol, model.x[0].symbol)
