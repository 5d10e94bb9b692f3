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
KIND = "model-exchange"


@pytest.fixture
def unit_of(exported):
    """A new instance and the model in it by name."""

    def make(name):
        archive, model = exported(name, 3, kind=KIND)
        return Rates(archive), model

    return make


def test_rates_are_those_of_the_model_at_any_state(unit_of):
    unit, model = unit_of("pendulum")
    assert unit.begin() == OK
    ode, alg = model.function("ode"), model.function("alg")
    p, u = model.values("p"), model.values("u")
    for x in np.random.default_rng(0).uniform(-2.0, 2.0, (20, len(model.x))):
        found = unit.rates(0.3, x)
        z = unit.get(*(v.name for v in model.z))
        assert np.abs(alg(0.3, x, z, u, p).full()).max() < 1e-9 * (1 + np.abs(z).max())
        expected = ode(0.3, x, z, u, p).full().ravel()
        assert np.abs(found - expected).max() < 1e-9 * (1 + np.abs(expected).max())
        named = [f"der({v.name})" for v in model.x]
        assert (unit.get(*named) == found).all()
    unit.free()


def test_an_integrator_of_others_follows_simulate(unit_of):
    unit, model = unit_of("smooth drive")
    assert unit.begin(force=1.7, v=0.2) == OK
    begun = unit.x
    found = solve_ivp(unit.rates, (0.0, 1.0), begun, method="LSODA", rtol=1e-9, atol=1e-11)
    same = simulate(model, 1.0, u={"force": 1.7}, x0={"v": 0.2}, rtol=1e-10)
    assert np.abs(found.y[:, -1] - [same.final[v.name] for v in model.x]).max() < 1e-8
    unit.free()


def test_events_are_seen_carried_out_and_end_the_run(unit_of):
    unit, _ = unit_of("wire")
    assert unit.begin() == OK
    assert unit.update() == (False, False, False)
    assert unit.events == 2
    signs = unit.column("GetEventIndicators", 2)
    assert signs[0] > 0 > signs[1]
    unit.at(0.1, np.array([0.5, -2.0]))
    assert not unit.completed()
    unit.at(0.15, np.array([-5e-10, -2.0]))  # too near for others to be sure that it is beyond
    assert unit.column("GetEventIndicators", 2)[0] > 0
    unit.at(0.2, np.array([-1e-8, -2.0]))
    assert unit.column("GetEventIndicators", 2)[0] < 0
    assert unit.completed()
    assert unit.update() == (True, False, True)
    assert unit.x.tolist() == [-1e-8, 1.0]
    assert unit.update() == (False, False, False)
    unit.at(0.3, np.array([0.1, 1.0]))  # back through the floor: not its direction
    assert not unit.completed()
    unit.at(0.4, np.array([4.0, 1.0]))
    assert unit.update() == (False, True, False)
    unit.free()


def test_a_block_that_sticks_exactly_breaks_away(unit_of):
    unit, _ = unit_of("sticking drive")
    assert unit.begin(force=0.5) == OK
    while unit.update()[0]:
        pass
    stuck = unit.rates(0.0, unit.x)
    assert (stuck == 0.0).all()
    assert unit.set(force=1.7) == OK
    assert unit.update()[2]
    while unit.update()[0]:
        pass
    assert unit.get("mode")[0] == 1.0
    rate = unit.rates(0.0, unit.x)
    assert rate[1] == pytest.approx((1.7 - 0.1 * 0.8 * 9.81) / 0.8)
    unit.free()


@pytest.mark.parametrize("what", ["wire", "pendulum"])
def test_directional_derivatives_are_those_of_differences(what, unit_of):
    unit, model = unit_of(what)
    assert unit.begin() == OK
    x = np.array([0.8, -0.3])
    unit.at(0.0, x)
    knowns = [v.name for v in (*model.x, *model.u, *model.p[:2])]
    unknowns = [*(f"der({v.name})" for v in model.x), *(v.name for v in model.z), *model.outputs]
    at = dict(zip(knowns[:2], x, strict=True))
    at |= dict(zip(knowns[2:], unit.get(*knowns[2:]), strict=True))

    def values(name: str, value: float) -> np.ndarray:
        unit.at(0.0, np.array([value if name == n else at[n] for n in knowns[:2]]))
        if name not in knowns[:2]:
            assert unit.set(**{name: value}) == OK
        return unit.get(*unknowns)

    for name in knowns:
        h = 1e-6 * max(1.0, abs(at[name]))
        expected = (values(name, at[name] + h) - values(name, at[name] - h)) / (2 * h)
        values(name, at[name])
        found = unit.along(unknowns, {name: 2.0}) / 2.0
        assert np.abs(found - expected).max() < 1e-6 * (1.0 + np.abs(expected).max()), name
    unit.free()


@pytest.mark.heavy
def test_loops_pull_states_back_and_change_nothing_on_them(unit_of):
    unit, model = unit_of("loop")
    assert unit.begin() == OK
    x = unit.x
    same = simulate(model, 0.2, rtol=1e-10)
    found = solve_ivp(unit.rates, (0.0, 0.2), x, method="LSODA", rtol=1e-10, atol=1e-12)
    final = np.array([same.final[v.name] for v in model.x])
    assert np.abs(found.y[:, -1] - final).max() < 1e-6 * np.abs(final).max()
    off = x + np.array([0.0, 1e-3, 0.0, 0.0])
    back = solve_ivp(unit.rates, (0.0, 0.2), off, method="LSODA", rtol=1e-10, atol=1e-12)
    model_defect = model.holonomic.phi
    assert model_defect.numel() == 1
    unit.at(0.2, back.y[:, -1])
    closed = unit.get(*(v.name for v in model.x))  # signals are those on the constraints
    assert np.abs(closed[:2] - back.y[:2, -1]).max() < 2e-6
    unit.free()


def test_what_the_importer_must_not_do_is_refused(unit_of, tmp_path):
    unit, _ = unit_of("wire")
    assert unit.call("SetTime", 0) == ERROR
    assert "before the initialisation" in unit.said[-1]
    assert unit.begin(x=5.9) == OK
    unit.at(0.0, np.array([7.0, 0.0]))
    values = np.zeros(2)
    assert unit.call("GetContinuousStateDerivatives", values.ctypes, 2) == ERROR
    assert "equation of v returned NaN" in unit.said[-1]
    with pytest.raises(ValueError, match="no step"):
        export_fmu(wire(), tmp_path / "u.fmu", kind=KIND, step=1e-3)
    unit.free()
