"""Units for model exchange: rates, algebraic variables, events, through the C interface."""

import numpy as np
import pytest
from backends import needs_compiler
from scipy.integrate import solve_ivp
from units import ERROR, OK, Rates
from wires import wire

from symfric import simulate
from symfric.fmu import export_fmu

pytestmark = needs_compiler


def test_rates_are_those_of_the_model_at_any_state(opened):
    unit, model = opened(Rates, "pendulum", {})
    ode, alg = model.function("ode"), model.function("alg")
    p, u = model.values("p"), model.values("u")
    for x in np.random.default_rng(0).uniform(-2.0, 2.0, (20, len(model.x))):
        found = unit.rates(0.3, x)
        z = unit.get(*(v.name for v in model.z))
        assert np.abs(alg(0.3, x, z, u, p).full()).max() < 1e-9 * (1 + np.abs(z).max())
        expected = ode(0.3, x, z, u, p).full().ravel()
        assert np.abs(found - expected).max() < 1e-9 * (1 + np.abs(expected).max())
        assert (unit.get(*(f"der({v.name})" for v in model.x)) == found).all()


def test_another_integrator_follows_simulate(opened):
    unit, model = opened(Rates, "smooth drive", {"force": 1.7, "v": 0.2})
    found = solve_ivp(unit.rates, (0.0, 1.0), unit.x, method="LSODA", rtol=1e-9, atol=1e-11)
    same = simulate(model, 1.0, u={"force": 1.7}, x0={"v": 0.2}, rtol=1e-10)
    assert np.abs(found.y[:, -1] - [same.final[v.name] for v in model.x]).max() < 1e-8


def test_events_are_indicated_handled_and_end_the_run(opened):
    unit, _ = opened(Rates, "wire", {})
    assert unit.update() == (False, False, False)
    assert unit.events == 2
    signs = unit.column("GetEventIndicators", 2)
    assert signs[0] > 0 > signs[1]
    unit.at(0.1, np.array([0.5, -2.0]))
    assert not unit.completed()
    unit.at(0.15, np.array([-5e-10, -2.0]))  # too near for an importer to be sure of the event
    assert unit.column("GetEventIndicators", 2)[0] > 0
    unit.at(0.2, np.array([-1e-8, -2.0]))
    assert unit.column("GetEventIndicators", 2)[0] < 0
    assert unit.completed()
    assert unit.update() == (True, False, True)
    assert unit.x.tolist() == [-1e-8, 1.0]
    assert unit.update() == (False, False, False)
    unit.at(0.3, np.array([0.1, 1.0]))  # through the floor in the other direction
    assert not unit.completed()
    unit.at(0.4, np.array([4.0, 1.0]))
    assert unit.update() == (False, True, False)


def test_a_block_that_sticks_exactly_breaks_away(opened):
    unit, _ = opened(Rates, "sticking drive", {"force": 0.5})
    while unit.update()[0]:
        pass
    assert (unit.rates(0.0, unit.x) == 0.0).all()
    assert unit.set(force=1.7) == OK
    assert unit.update()[2]
    while unit.update()[0]:
        pass
    assert unit.get("mode")[0] == 1.0
    assert unit.rates(0.0, unit.x)[1] == pytest.approx((1.7 - 0.1 * 0.8 * 9.81) / 0.8)


@pytest.mark.parametrize("name", ["wire", "pendulum"])
def test_directional_derivatives_agree_with_differences(name, opened):
    unit, model = opened(Rates, name, {})
    x = np.array([0.8, -0.3])
    unit.at(0.0, x)
    knowns = [v.name for v in (*model.x, *model.u, *model.p[:2])]
    unknowns = [*(f"der({v.name})" for v in model.x), *(v.name for v in model.z), *model.outputs]
    at = dict(zip(knowns, [*x, *unit.get(*knowns[2:])], strict=True))

    def values(known: str, value: float) -> np.ndarray:
        unit.at(0.0, np.array([value if known == n else at[n] for n in knowns[:2]]))
        assert known in knowns[:2] or unit.set(**{known: value}) == OK
        return unit.get(*unknowns)

    for known in knowns:
        h = 1e-6 * max(1.0, abs(at[known]))
        expected = (values(known, at[known] + h) - values(known, at[known] - h)) / (2 * h)
        values(known, at[known])
        found = unit.along(unknowns, {known: 2.0}) / 2.0
        assert np.abs(found - expected).max() < 1e-6 * (1.0 + np.abs(expected).max()), known


@pytest.mark.heavy
def test_rates_close_loops_and_keep_closed_ones(opened):
    unit, model = opened(Rates, "loop", {})
    same = simulate(model, 0.2, rtol=1e-10)
    final = np.array([same.final[v.name] for v in model.x])
    x, how = unit.x, {"method": "LSODA", "rtol": 1e-10, "atol": 1e-12}
    found = solve_ivp(unit.rates, (0.0, 0.2), x, **how)
    assert np.abs(found.y[:, -1] - final).max() < 1e-6 * np.abs(final).max()
    back = solve_ivp(unit.rates, (0.0, 0.2), x + np.array([0.0, 1e-3, 0.0, 0.0]), **how)
    unit.at(0.2, back.y[:, -1])
    closed = unit.get(*(v.name for v in model.x))  # signals are those of the closed mechanism
    assert np.abs(closed[:2] - back.y[:2, -1]).max() < 2e-6


def test_invalid_calls_of_the_importer_are_refused(opened, tmp_path):
    unit, _ = opened(Rates, "wire")
    assert unit.call("SetTime", 0) == ERROR
    assert "before the initialisation" in unit.messages[-1]
    assert unit.begin(x=5.9) == OK
    unit.at(0.0, np.array([7.0, 0.0]))
    assert unit.call("GetContinuousStateDerivatives", np.zeros(2).ctypes, 2) == ERROR
    assert "equation of v returned NaN" in unit.messages[-1]
    with pytest.raises(ValueError, match="no step"):
        export_fmu(wire(), tmp_path / "u.fmu", kind="model-exchange", step=1e-3)
