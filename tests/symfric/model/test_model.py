"""The interface between equations and solvers."""

import pickle
from copy import copy
from dataclasses import replace
from pathlib import Path

import casadi as ca
import pytest
from refusing import not_refused

import symfric
import symfric.laws
import symfric.model
from symfric import BrownMcPhee, Model, Output, Variable, rabinowicz, simulate
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
    assert model.signals == {"x": "m", "y": "m/s", "w": "N", "u": "N", "energy": "J"}
    stacked = model.function("signals")(0.0, [1.0, 2.0], 3.0, 4.0, 5.0)
    assert stacked.full().ravel().tolist() == [1.0, 2.0, 3.0, 4.0, 2.5]
    assert model.values("p").tolist() == [3.0]
    assert model.values("u", {"u": 5}).tolist() == [5.0]
    assert model.initial_state({"y": -1.0}).tolist() == [1.0, -1.0]
    point = {"t": 0.0, "x": [1.0, 2.0], "z": 3.0, "u": 4.0, "p": 5.0}
    assert model.function("ode")(**point)["ode"].full().ravel().tolist() == [2.0, 3.0]
    assert model.function("alg")(**point)["alg"].full().ravel().tolist() == [4.0]
    assert float(model.function("energy")(**point)["energy"]) == 2.5
    residual = model.function("residual")
    assert residual.name_in() == ["t", "xdot", "x", "z", "u", "p"]
    assert residual(xdot=[2.5, 3.5], **point)["residual"].full().ravel().tolist() == [0.5, 0.5, 4.0]


def test_absent_groups_are_columns_without_rows() -> None:
    model = Model("decay", x=(x,), ode=-x.symbol)
    assert [model.vector(letter).shape for letter in "xzup"] == [(1, 1), (0, 1), (0, 1), (0, 1)]
    assert model.function("ode").size_in("u") == (0, 1)
    assert model.nominal("x").tolist() == [0.1]
    assert model.nominal("p").shape == (0,)


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


def test_inconsistent_models_and_bad_values_are_refused() -> None:
    names = {"x": x, "y": y, "k": k, "s": ca.SX.sym("s"), "replace": replace}
    names |= {"m": oscillator(), "d": symfric.drive(symfric.Karnopp())}
    packages = symfric, symfric.laws, symfric.model
    assert not_refused(Path(__file__).with_name("refusals.toml"), *packages, **names) == []


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


def test_model_without_states_is_solved() -> None:
    z, t = Variable("z", "1", start=1.0), ca.SX.sym("t")
    for given in ({"alg": z.symbol**3 - t - 1}, {"residual": z.symbol**3 - t - 1}):
        run = simulate(Model("root", z=(z,), t=t, **given), 1.0)
        assert run.final["z"] == pytest.approx(2 ** (1 / 3), abs=1e-6)


def test_a_copy_and_a_pickle_have_the_same_symbols() -> None:
    machine = Arm(BrownMcPhee()).mechanism()
    model = rabinowicz(BrownMcPhee())
    run = simulate(model, 0.1)
    assert len(copy(machine).build().u) == 6  # its forces know the inputs
    assert ca.is_equal(copy(model).x[0].symbol, model.x[0].symbol)
    assert copy(run).model is model
    assert copy(machine).inputs[0] is machine.inputs[0]
    assert ca.is_equal(pickle.loads(pickle.dumps(model)).x[0].symbol, model.x[0].symbol)
