"""The interface between equations and solvers."""

import pickle
from copy import copy
from dataclasses import replace
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from refusing import not_refused

import symfric as sf
from symfric.scenes import ALL_SCENES, Arm, FourBar

x, y = sf.Variable("x", "m", start=1.0, nominal=0.1), sf.Variable("y", "m/s")
w, u, k = (
    sf.Variable("w", "N"),
    sf.Variable("u", "N", start=2.0),
    sf.Variable("k", "N/m", start=3.0),
)


def oscillator() -> sf.Model:
    """x' = y, y' = w, 0 = w + k x - u."""
    return sf.Model(
        "oscillator",
        x=(x, y),
        z=(w,),
        u=(u,),
        p=(k,),
        ode=ca.vertcat(y.symbol, w.symbol),
        alg=w.symbol + k.symbol * x.symbol - u.symbol,
        outputs={"energy": sf.Output(k.symbol * x.symbol**2 / 2, "J")},
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
    model = sf.Model("decay", x=(x,), ode=-x.symbol)
    assert [model.vector(letter).shape for letter in "xzup"] == [(1, 1), (0, 1), (0, 1), (0, 1)]
    assert model.function("ode").size_in("u") == (0, 1)
    assert model.nominal("x").tolist() == [0.1]
    assert model.nominal("p").shape == (0,)


def test_start_values_may_depend_on_states_and_parameters() -> None:
    a = sf.Variable("a", "1", start=2.0)
    b = sf.Variable("b", "1", start=a.symbol * k.symbol)
    c = sf.Variable("c", "1", start=b.symbol + 1)
    model = sf.Model("chain", x=(c, a, b), p=(k,), ode=ca.SX(3, 1))
    assert model.initial_state().tolist() == [7.0, 2.0, 6.0]
    assert model.initial_state({"a": 1.0}, {"k": 5.0}).tolist() == [6.0, 1.0, 5.0]
    assert model.initial_state({"b": 0.0}).tolist() == [1.0, 2.0, 0.0]


def test_implicit_model_has_a_residual_and_no_ode() -> None:
    xdot = ca.SX.sym("xdot")
    model = sf.Model("implicit", x=(x,), xdot=xdot, residual=xdot**3 + x.symbol)
    assert model.ode is None
    assert float(model.function("residual")(0, 2.0, 1.0, [], [], [])) == 9.0
    with pytest.raises(ValueError, match=r"model 'implicit': expected one of alg, .*got ode"):
        model.function("ode")


def test_inconsistent_models_and_bad_values_are_refused() -> None:
    names = {"x": x, "y": y, "k": k, "s": ca.SX.sym("s"), "replace": replace}
    names |= {"m": oscillator(), "d": sf.drive(sf.Karnopp())}
    packages = sf, sf.laws, sf.model
    assert not_refused(Path(__file__).with_name("refusals.toml"), *packages, **names) == []


def test_states_of_contacts_belong_to_the_contacts() -> None:
    s, v = sf.Variable("s", "m"), sf.Variable("v", "m/s")
    slip = sf.contact("ground", sf.LuGre(), v, 9.81)
    rates = ca.vertcat(v.symbol, 1 - slip.force, 0)
    with pytest.raises(ValueError, match="x: expected the states of the model only, got z of its"):
        sf.Model("sled", x=(s, v, *slip.states), ode=rates, contacts=(slip,))


def test_details_are_written_once_and_on_request() -> None:
    x, calls = sf.Variable("x", "m"), []

    def more() -> dict[str, sf.Output]:
        calls.append("written")
        return {"twice": sf.Output(2 * x.symbol, "m")}

    model = sf.Model("m", x=(x,), ode=-x.symbol, details=more)
    assert float(model.function("ode")(0, 3, [], [], [])) == -3
    assert not calls
    assert float(model.function("twice")(0, 3, [], [], [])) == 6
    assert ca.is_equal(model.expression("x"), x.symbol)
    assert ca.is_equal(model.expression("twice"), 2 * x.symbol, 2)
    assert calls == ["written"]
    with pytest.raises(ValueError, match="got twce; did you mean twice"):
        model.expression("twce")


def test_model_without_states_is_solved() -> None:
    z, t = sf.Variable("z", "1", start=1.0), ca.SX.sym("t")
    for given in ({"alg": z.symbol**3 - t - 1}, {"residual": z.symbol**3 - t - 1}):
        run = sf.simulate(sf.Model("root", z=(z,), t=t, **given), 1.0)
        assert run.final["z"] == pytest.approx(2 ** (1 / 3), abs=1e-6)


def test_a_copy_and_a_pickle_have_the_same_symbols() -> None:
    machine = Arm(sf.BrownMcPhee()).mechanism()
    model = sf.rabinowicz(sf.BrownMcPhee())
    run = sf.simulate(model, 0.1)
    assert len(copy(machine).build().u) == 6  # its forces know the inputs
    assert ca.is_equal(copy(model).x[0].symbol, model.x[0].symbol)
    assert copy(run).model is model
    assert copy(machine).inputs[0] is machine.inputs[0]
    assert ca.is_equal(pickle.loads(pickle.dumps(model)).x[0].symbol, model.x[0].symbol)


def test_scenes_have_the_accelerations_of_their_positions() -> None:
    """Differences of the dense rates: of second order in h, and rounded by 1e-16 / h."""
    for name in ("rabinowicz", "drill_string", "nip", "clutch", "pendulum_box", "slider_crank"):
        scene = ALL_SCENES[name](sf.BrownMcPhee())
        given = {n: g.function for n, g in scene.inputs.items()}
        model = scene.model()
        run = sf.simulate(model, 0.2, u=given, rtol=1e-8, samples=5)
        found = [n for n in run.details if n.endswith("_acc")]
        moves = {v.unit for v in model.x} & {"m/s", "rad/s"}
        assert bool(found) is bool(moves), name
        assert all(run.details[n] in ("m/s^2", "rad/s^2") for n in found), name
        h, t = 1e-6, np.linspace(0.02, 0.18, 23)
        here, after, before = run.at(t), run.at(t + h), run.at(t - h)
        slopes = {v.name: (after[v.name] - before[v.name]) / (2 * h) for v in model.x}
        for n in found:  # the rate of q is the state that is the slope of q, whatever it is called
            q = n.removesuffix("_acc")
            speeds = [v.name for v in model.x if run.units[v.name] in ("m/s", "rad/s")]
            if q in speeds:  # of nothing that is a state
                rate = q
            else:
                rate = min(speeds, key=lambda r: float(np.abs(here[r] - slopes[q]).max()))
            wanted = run.of(model.expression(n), t)
            scale = max(1.0, float(np.abs(wanted).max()))
            assert np.abs(slopes[rate] - wanted).max() < 2e-3 * scale, (name, n, rate)


def test_the_acceleration_of_the_block_satisfies_newtons_law() -> None:
    run = sf.simulate(sf.rabinowicz(sf.LuGre()), 3.0, samples=301)
    np.testing.assert_allclose(run["x_acc"], (-2.1 * run["x"] - run["friction"]) / 0.8, atol=1e-12)
    assert run.unit("x_acc") == "m/s^2"


def test_a_velocity_that_a_law_keeps_has_no_acceleration() -> None:
    model = sf.rabinowicz(sf.Armstrong())
    assert [v.unit for v in model.x if v.name == "w"] == ["m/s"]
    assert [*model.further] == ["x_acc"]


def test_accelerations_cost_nothing_unless_requested() -> None:
    model = FourBar(sf.BrownMcPhee()).model()
    run = sf.simulate(model, 0.05, samples=3)
    assert "further" not in model.__dict__
    assert not any(n.endswith("_acc") for n in run.units)
    assert "theta_crank_acc" in run.details


def test_only_rates_that_are_states_have_accelerations_and_names_are_not_taken_twice() -> None:
    x, v, w = sf.Variable("x", "m"), sf.Variable("v", "m/s"), sf.Variable("w", "V")
    model = sf.Model(
        "own", x=(x, v, w), ode=ca.vertcat(v.symbol, -x.symbol, 2 * v.symbol),
        details=lambda: {"x_acc": sf.Output(7.0, "m")},
    )  # fmt: skip
    assert list(model.further) == ["x_acc"]
    assert model.further["x_acc"].unit == "m"
    rate = ca.SX.sym("rate")
    implicit = sf.Model("rc", x=(w,), xdot=rate, residual=rate + w.symbol)
    assert implicit.further == {}
    volts = sf.Model("volts", x=(w, x), ode=ca.vertcat(x.symbol, w.symbol))
    assert {n: o.unit for n, o in volts.further.items()} == {"w_acc": "m/s", "x_acc": "V/s"}


LAW = sf.RateAndState(mu_0=0.6, a=0.01, b=0.015, v_0=1e-6, D_c=1e-3)
PLATE, STRESS, ETA = 1e-9, 50e6, 5e6


def fault() -> sf.Model:
    """A patch without mass: its velocity is an algebraic variable."""
    load = sf.Variable("load", "Pa", start=3.2e7, nominal=1e7)
    v = sf.Variable("v", "m/s", start=PLATE, nominal=PLATE)
    rock = sf.contact("fault", LAW, v.symbol, STRESS)
    return sf.Model(
        "fault",
        x=(load,),
        z=(v,),
        ode=3e8 * (PLATE - v.symbol),
        alg=load.symbol - ETA * v.symbol - rock.force,
        contacts=(rock,),
    )


def test_a_law_starts_by_the_start_value_of_an_algebraic_velocity() -> None:
    steady = LAW.steady_state(PLATE, STRESS).item()
    assert fault().initial_state() == pytest.approx([3.2e7, steady])
    assert fault().initial_state({"psi": 2.0}) == pytest.approx([3.2e7, 2.0])
    with pytest.raises(ValueError, match="got v; algebraic variables follow from their equations"):
        fault().initial_state({"v": 1e-6})
    many, _ = fault().initial_states({"load": np.array([3e7, 3.1e7])}, {}, 2)
    assert many == pytest.approx(np.array([[3e7, steady], [3.1e7, steady]]))


def test_a_fault_without_mass_comes_to_creep_where_the_rock_is_stiff() -> None:
    end = sf.simulate(fault(), 3e8).final  # 3e8 Pa/m is above (b - a) STRESS / D_c
    assert end["v"] == pytest.approx(PLATE, rel=1e-3)
    mu = 0.6 + (0.01 - 0.015) * np.log(PLATE / 1e-6)
    assert end["load"] == pytest.approx(mu * STRESS, rel=1e-3)


def under_varying_load(law: sf.LuGre) -> sf.Model:
    x, v, t = sf.Variable("x", "m"), sf.Variable("v", "m/s", start=0.3), ca.SX.sym("t")
    floor = sf.contact("floor", law, v, 5 + ca.sin(t))
    return sf.Model("varying", x=(x, v), ode=ca.vertcat(v, 1 - floor.force), contacts=(floor,), t=t)


def test_a_bristle_under_a_load_that_varies_starts_at_its_steady_state() -> None:
    law = sf.LuGre()
    model = under_varying_load(law)
    for begin in (0.0, 1.5):
        steady = float(law.steady_state(0.3, 5 + np.sin(begin))[0])
        assert model.initial_state(t=begin)[2] == pytest.approx(steady, rel=1e-14)
        run = sf.simulate(model, begin + 0.5, t_start=begin, samples=3, sensitivities=["x0.v"])
        many = sf.simulate_many(
            model, begin + 0.5, t_start=begin, x0={"v": [0.3, 0.4]}, backend="vm", executor="serial"
        )
        assert run["z"][0] == pytest.approx(steady, rel=1e-14)
        assert many["x"][0, -1] == pytest.approx(run.final["x"], rel=1e-7)
        slope = (many["x"][1, -1] - many["x"][0, -1]) / 0.1
        assert run.sensitivities["x0.v"]["x"][-1] == pytest.approx(slope, rel=1e-4)


@pytest.mark.parametrize(("limit", "angles"), [(None, ("phi",)), (3.0, ()), (30.0, ())])
def test_angles_are_those_whose_turns_change_nothing(
    limit: float | None, angles: tuple[str, ...]
) -> None:
    """A stop at 30 rad ends the turns; `way` is cyclic, and an angle with a spring is neither."""
    phi, w = sf.Variable("phi", "rad"), sf.Variable("w", "rad/s")
    twist, way = sf.Variable("twist", "rad"), sf.Variable("way", "m")
    stop = 0.0 if limit is None else 100 * ca.fmax(phi - limit, 0)
    rates = ca.vertcat(w, -ca.sin(phi) - stop, -twist, w)
    model = sf.Model("m", x=(phi, w, twist, way), ode=rates)
    assert model.angles == angles and model.cyclic == ("way",)
    bump = sf.Event("bump", phi + way - 1.0)
    assert sf.Model("m", x=(phi, w, twist, way), ode=rates, events=(bump,)).cyclic == ()
