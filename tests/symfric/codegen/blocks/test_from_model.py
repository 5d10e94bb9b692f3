"""Plants in fixed steps: C and CasADi agree to the bit, and the step is that of the method."""

from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest

from symfric import (
    BrownMcPhee,
    LuGre,
    Model,
    Output,
    Variable,
    Viscous,
    drive,
    rabinowicz,
    simulate,
)
from symfric.codegen import generate, plant_block, verify
from symfric.codegen.blocks.block import Block
from symfric.foundation.programs import Compiler
from symfric.integrator.methods.tableaux import METHODS
from symfric.model import Event
from symfric.scenes import Arm, DoublePendulum, Drive, Rabinowicz

pytestmark = pytest.mark.heavy

x, z, u = Variable("x", "m", start=1.0), Variable("z", "1", start=0.5), Variable("u", "m/s")
PENDULUM = Model(
    "leak",
    x=(x,),
    z=(z,),
    u=(u,),
    ode=u.symbol - z.symbol,
    alg=z.symbol + z.symbol**3 - 2 * x.symbol,
    outputs={"sum": Output(x.symbol + z.symbol + u.symbol, "1")},
)
PLANTS = {
    "rabinowicz lugre": rabinowicz(LuGre(), free=["mu_s"]),
    "rabinowicz brown_mcphee": rabinowicz(BrownMcPhee()),
    "drive lugre": drive(LuGre(), free=["m", "offset"]),
    "leak": PENDULUM,
}


def advanced(block: Block, steps: int, *inputs: float) -> dict[str, float]:
    """States and outputs after some steps with constant inputs and default parameters."""
    state = np.array([v.start for v in block.states])
    parameters, shown = [v.start for v in block.parameters], np.zeros(0)
    for _ in range(steps):
        state, shown = (a.full().ravel() for a in block.step(state, parameters, inputs))
    names = [*(v.name for v in block.states), *block.outputs]
    return dict(zip(names, [*state, *shown], strict=True))


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("plant", PLANTS)
def test_double_is_equal_to_the_bit(
    plant: str, method: str, compiler: Compiler, tmp_path: Path
) -> None:
    model = PLANTS[plant]
    if model.z and not METHODS[method].dae:
        pytest.skip("a method for ODEs")
    block = plant_block(model, h=1e-4, method=method)
    found = verify(generate(block, tmp_path, real="double", kit=False))
    assert found.ok, found.table()


def test_a_joint_that_rubs_by_its_reactions_is_verified(compiler: Compiler, tmp_path: Path) -> None:
    model = DoublePendulum(BrownMcPhee(v_t=0.05)).model()
    block = plant_block(model, h=1e-3)
    assert sum(v.name.endswith("_N") for v in block.states) == 2
    assert verify(generate(block, tmp_path, real="double", kit=False)).ok
    after, exact = advanced(block, 200), simulate(model, 0.2, rtol=1e-9).final
    for name in ("phi_1", "phi_2"):
        assert after[name] == pytest.approx(exact[name], abs=0.01)  # order 1


@pytest.mark.slow
def test_arm_with_friction_from_reactions_in_every_joint_is_verified(
    compiler: Compiler, tmp_path: Path
) -> None:
    model = Arm(BrownMcPhee(v_t=0.05)).model()
    block = plant_block(model, h=1e-3)
    assert [v.name for v in block.states if v.name.endswith("_N")] == [
        f"q{k}_N" for k in range(1, 7)
    ]
    assert [v.name for v in block.inputs] == [f"tau{k}" for k in range(1, 7)]
    found = verify(generate(block, tmp_path, real="double", kit=False))
    assert found.ok, found.table()
    after, exact = advanced(block, 200, *[0.0] * 6), simulate(model, 0.2, rtol=1e-9).final
    for k in range(1, 7):
        assert after[f"q{k}"] == pytest.approx(exact[f"q{k}"], abs=0.01)  # order 1


def test_float_of_a_drive_is_verified(compiler: Compiler, tmp_path: Path) -> None:
    assert verify(generate(plant_block(PLANTS["drive lugre"], h=1e-3), tmp_path, kit=False)).ok


@pytest.mark.parametrize("method", [m for m in METHODS if METHODS[m].order > 1])
def test_plant_follows_the_adaptive_simulation(method: str) -> None:
    model = drive(Viscous(sigma_2=2.0), m=0.5, offset=0.3)
    found = advanced(plant_block(model, h=5e-3, method=method), 200, 2.0)
    exact = simulate(model, 1.0, u={"force": 2.0}, rtol=1e-11).final
    assert found == pytest.approx({name: exact[name] for name in found}, rel=2e-7)


def test_stick_slip_of_the_plant_is_that_of_the_simulation() -> None:
    model = rabinowicz(LuGre())
    found = advanced(plant_block(model, h=1e-3), 8000)
    exact = simulate(model, 8.0, rtol=1e-10).final
    assert found["x"] == pytest.approx(exact["x"], rel=1e-4)
    assert found["friction"] == pytest.approx(exact["friction"], rel=1e-4)


def test_algebraic_variables_start_consistent_and_are_states() -> None:
    block = plant_block(PENDULUM, h=1e-2)
    assert [v.name for v in block.states] == ["x", "z"]
    assert block.states[1].start == pytest.approx(1.0, rel=1e-12)
    found = advanced(block, 50, 0.0)
    assert found["z"] + found["z"] ** 3 == pytest.approx(2 * found["x"], rel=1e-5)


def test_outputs_are_those_at_the_end_of_the_step() -> None:
    found = advanced(plant_block(PENDULUM, h=1e-2), 3, 0.7)
    assert found["sum"] == pytest.approx(found["x"] + found["z"] + 0.7, rel=1e-14)


def test_time_is_a_state_where_the_equations_depend_on_it() -> None:
    t = ca.SX.sym("t")
    block = plant_block(Model("swing", x=(x,), ode=ca.cos(t), t=t), h=1e-2)
    found = advanced(block, 100)
    assert found["t"] == pytest.approx(1.0, rel=1e-12)
    assert found["x"] == pytest.approx(1.0 + np.sin(1.0), rel=1e-7)


def test_implicit_model_becomes_a_plant() -> None:
    """x'^3 + x' + x = 0, with the rate r as a further state: from dx = -(1 + 3 r^2) dr and
    dt = dx / r follows t = [-ln|r| - 3/2 r^2] between its ends."""
    rate = ca.SX.sym("rate")
    model = Model("drain", x=(x,), xdot=rate, residual=rate**3 + rate + x.symbol)
    block = plant_block(model, h=1e-2, method="rodas4p")
    r_0, r_1 = block.states[1].start, advanced(block, 100)["x_dot"]
    assert r_0**3 + r_0 == pytest.approx(-1.0)
    assert np.log(r_0 / r_1) + 1.5 * (r_0**2 - r_1**2) == pytest.approx(1.0, rel=1e-7)


def test_free_parameters_and_the_step_size_stay_variable() -> None:
    block = plant_block(rabinowicz(LuGre(), free=["mu_s", "k"]))
    assert [p.name for p in block.parameters] == ["mu_s", "k", "h"]
    fixed = plant_block(rabinowicz(LuGre(), free=["mu_s", "k"]), h=1e-3)
    assert [p.name for p in fixed.parameters] == ["mu_s", "k"]
    assert fixed.constants["h"] == 1e-3
    assert advanced(block, 20) == pytest.approx(advanced(fixed, 20), rel=1e-12)


def test_description_names_method_and_source() -> None:
    block = plant_block(rabinowicz(LuGre()), method="backward_euler", name="belt")
    assert block.name == "belt"
    assert "backward Euler, order 1" in block.discretisation
    assert METHODS["backward_euler"].source in block.sources


def test_all_parameters_of_a_scene_are_variable_but_those_that_choose_a_form() -> None:
    block = plant_block(Rabinowicz(LuGre()))
    own = ["m", "k", "v_belt", "g"]
    law = ["mu_s", "mu_d", "v_s", "sigma_0", "sigma_1", "sigma_2", "v_eps"]
    assert [p.name for p in block.parameters] == [*own, *law, "h"]
    assert block.constants == {"delta": 2.0}
    fixed = plant_block(Rabinowicz(LuGre()), fold=True, h=1e-3)
    assert fixed.parameters == ()
    assert fixed.constants["k"] == 2.1
    assert advanced(block, 50) == pytest.approx(advanced(fixed, 50), rel=1e-9, abs=1e-15)
    assert [p.name for p in plant_block(Rabinowicz(LuGre()), free=["k"], h=1e-3).parameters] == [
        "k"
    ]


BOUNCE = Model("ball", x=(x,), ode=-x.symbol, events=(Event("hit", x.symbol - 0.5),))
LATE = Model("clock", x=(x,), ode=-x.symbol, outputs={"now": Output(BOUNCE.t, "s")}, t=BOUNCE.t)


@pytest.mark.parametrize(
    ("model", "arguments", "message"),
    [
        (BOUNCE, {}, "expected a model without events, got 1"),
        (LATE, {}, "got now; make time a state"),
        (PENDULUM, {"h": 0.0}, r"h: expected a number > 0 \[s\]"),
        (PENDULUM, {"method": "rodas5"}, "did you mean rodas5p"),
        (PENDULUM, {"method": "exponential"}, "got the algebraic unknowns z"),
        (PENDULUM, {"name": "int"}, "free C identifier"),
        (PENDULUM, {"fold": True}, "fold: expected with a scene only, got a model"),
        (Drive(LuGre()), {"free": ["mass"]}, "free: expected one of .* got mass"),
    ],
)
def test_what_cannot_be_a_plant_is_refused(
    model: Model, arguments: dict[str, Any], message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        plant_block(model, **arguments)
