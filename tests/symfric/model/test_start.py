"""Where states start: numbers, and expressions in what else there is."""

import casadi as ca
import numpy as np
import pytest

from symfric import LuGre, Model, RateAndState, Variable, contact, simulate, simulate_many

LAW = RateAndState(mu_0=0.6, a=0.01, b=0.015, v_0=1e-6, D_c=1e-3)
PLATE, STRESS, ETA = 1e-9, 50e6, 5e6


def fault() -> Model:
    """A patch without mass: its velocity is an algebraic variable."""
    load = Variable("load", "Pa", start=3.2e7, nominal=1e7)
    v = Variable("v", "m/s", start=PLATE, nominal=PLATE)
    rock = contact("fault", LAW, v.symbol, STRESS)
    return Model(
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
    end = simulate(fault(), 3e8).final  # 3e8 Pa/m is above (b - a) STRESS / D_c
    assert end["v"] == pytest.approx(PLATE, rel=1e-3)
    mu = 0.6 + (0.01 - 0.015) * np.log(PLATE / 1e-6)
    assert end["load"] == pytest.approx(mu * STRESS, rel=1e-3)


def under_varying_load(law: LuGre) -> Model:
    x, v, t = Variable("x", "m"), Variable("v", "m/s", start=0.3), ca.SX.sym("t")
    floor = contact("floor", law, v, 5 + ca.sin(t))
    return Model("varying", x=(x, v), ode=ca.vertcat(v, 1 - floor.force), contacts=(floor,), t=t)


def test_a_bristle_under_a_load_that_varies_starts_at_its_steady_state() -> None:
    law = LuGre()
    model = under_varying_load(law)
    for begin in (0.0, 1.5):
        steady = float(law.steady_state(0.3, 5 + np.sin(begin))[0])
        assert model.initial_state(t=begin)[2] == pytest.approx(steady, rel=1e-14)
        run = simulate(model, begin + 0.5, t_start=begin, samples=3, sensitivities=["x0.v"])
        many = simulate_many(
            model, begin + 0.5, t_start=begin, x0={"v": [0.3, 0.4]}, backend="vm", executor="serial"
        )
        assert run["z"][0] == pytest.approx(steady, rel=1e-14)
        assert many["x"][0, -1] == pytest.approx(run.final["x"], rel=1e-7)
        slope = (many["x"][1, -1] - many["x"][0, -1]) / 0.1
        assert run.sensitivities["x0.v"]["x"][-1] == pytest.approx(slope, rel=1e-4)
