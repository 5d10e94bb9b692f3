"""Plants in fixed steps: C and CasADi agree to the bit, and the step is that of the method."""

import casadi as ca
import numpy as np
import pytest
from one_program import OneProgram

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
from symfric.codegen import plant_block
from symfric.codegen.blocks.block import Block
from symfric.codegen.runner import run_vm
from symfric.codegen.verification import excitation
from symfric.foundation.programs import Compiler
from symfric.integrator.methods.tableaux import METHODS
from symfric.scenes import Arm, DoublePendulum, Drive, Rabinowicz

x, z, u = Variable("x", "m", start=1.0), Variable("z", "1", start=0.5), Variable("u", "m/s")
LEAK = Model(
    "leak",
    x=(x,),
    z=(z,),
    u=(u,),
    ode=u.symbol - z.symbol,
    alg=z.symbol + z.symbol**3 - 2 * x.symbol,
    outputs={"sum": Output(x.symbol + z.symbol + u.symbol, "1")},
)
PLANT = drive(LuGre(), free=["m", "offset"])
ORDERS = [m for m in METHODS if METHODS[m].order > 1]


def advanced(block: Block, steps: int, *inputs: float) -> dict[str, float]:
    """States and outputs after some steps with constant inputs and default parameters."""
    state = np.array([v.start for v in block.states])
    p, shown = [v.start for v in block.parameters], np.zeros(0)
    for _ in range(steps):
        state, shown = (a.full().ravel() for a in block.step(state, p, inputs))
    names = [*(v.name for v in block.states), *block.outputs]
    return dict(zip(names, [*state, *shown], strict=True))


def test_every_method_has_the_bits_of_casadi(compiler: Compiler, tmp_path) -> None:
    blocks = [plant_block(LEAK if METHODS[method].dae else PLANT, h=1e-4, method=method)
              for method in METHODS]  # fmt: skip
    blocks += [plant_block(DoublePendulum(BrownMcPhee(v_t=0.05)).model(), h=1e-3),
               plant_block(Drive(LuGre()))]  # fmt: skip
    program = OneProgram(blocks, tmp_path, compiler)
    inputs = [excitation(block, 100) for block in blocks]
    rows = program.run([*enumerate(inputs)])
    for c, given, found in zip(program.several, inputs, rows, strict=True):
        assert np.array_equal(found, run_vm(c, given), equal_nan=True), c.block.discretisation


@pytest.mark.parametrize(
    ("scene", "coordinates"),
    [(DoublePendulum, ("phi_1", "phi_2")),
     pytest.param(Arm, [f"q{k}" for k in range(1, 7)], marks=pytest.mark.slow)],
)  # fmt: skip
def test_bearing_friction_from_reactions_follows_simulate(scene, coordinates) -> None:
    model = scene(BrownMcPhee(v_t=0.05)).model()
    block = plant_block(model, h=1e-3)
    assert sum(v.name.endswith("_N") for v in block.states) == len(coordinates)
    after = advanced(block, 200, *[0.0] * len(model.u))
    exact = simulate(model, 0.2, rtol=1e-9).final
    for name in coordinates:
        assert after[name] == pytest.approx(exact[name], abs=0.01)  # order 1


def test_plants_follow_the_adaptive_simulation() -> None:
    model = drive(Viscous(sigma_2=2.0), m=0.5, offset=0.3)
    exact = simulate(model, 1.0, u={"force": 2.0}, rtol=1e-11).final
    for method in ORDERS:
        found = advanced(plant_block(model, h=5e-3, method=method), 200, 2.0)
        assert found == pytest.approx({name: exact[name] for name in found}, rel=2e-7), method
    model = rabinowicz(LuGre())
    found = advanced(plant_block(model, h=1e-3), 4000)
    exact = simulate(model, 4.0, rtol=1e-10).final
    for name in ("x", "friction"):
        assert found[name] == pytest.approx(exact[name], rel=1e-4)


def test_algebraic_variables_and_time_are_states_and_outputs_are_those_at_the_end() -> None:
    block = plant_block(LEAK, h=1e-2)
    assert [v.name for v in block.states] == ["x", "z"]
    assert block.states[1].start == pytest.approx(1.0, rel=1e-12)
    found = advanced(block, 50, 0.7)
    assert found["z"] + found["z"] ** 3 == pytest.approx(2 * found["x"], rel=1e-5)
    assert found["sum"] == pytest.approx(found["x"] + found["z"] + 0.7, rel=1e-14)
    t = ca.SX.sym("t")
    found = advanced(plant_block(Model("swing", x=(x,), ode=ca.cos(t), t=t), h=1e-2), 100)
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


def test_parameters_stay_variable_unless_they_select_a_form_or_are_folded() -> None:
    block = plant_block(rabinowicz(LuGre(), free=["mu_s", "k"]))
    assert [p.name for p in block.parameters] == ["mu_s", "k", "h"]
    block = plant_block(Rabinowicz(LuGre()))
    law = ["mu_s", "mu_d", "v_s", "sigma_0", "sigma_1", "sigma_2", "v_eps"]
    assert [p.name for p in block.parameters] == ["m", "k", "v_belt", "g", *law, "h"]
    assert block.constants == {"delta": 2.0}
    fixed = plant_block(Rabinowicz(LuGre()), fold=True, h=1e-3)
    assert fixed.parameters == ()
    assert (fixed.constants["k"], fixed.constants["h"]) == (2.1, 1e-3)
    assert advanced(block, 50) == pytest.approx(advanced(fixed, 50), rel=1e-9, abs=1e-15)
    free = plant_block(Rabinowicz(LuGre()), free=["k"], h=1e-3)
    assert [p.name for p in free.parameters] == ["k"]


def test_mechanisms_with_friction_use_backward_euler_by_default() -> None:
    for model, options, method in (
        (rabinowicz(LuGre()), {"method": "backward_euler"}, "backward Euler, order 1"),
        (Model("decay", x=(x,), ode=-x.symbol), {}, "RODAS3"),
        (DoublePendulum(LuGre()).model(), {}, "backward Euler"),
    ):
        assert method in plant_block(model, **options).discretisation
