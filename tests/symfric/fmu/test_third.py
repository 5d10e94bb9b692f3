"""Units of FMI 3.0 through their C interface, mechanisms and fixed steps."""

import ctypes as c

import numpy as np
import pytest
from backends import needs_compiler
from units import DISCARD, ERROR, OK, Third, over

from symfric import simulate
from symfric.codegen import plant_block
from symfric.codegen.layout import CBlock
from symfric.codegen.runner import run_vm
from symfric.emitter.c99 import DOUBLE

pytestmark = needs_compiler
RTOL = 1e-9


def unit_of(exported, name, **options):
    archive, model = exported(name, 3, rtol=RTOL, **options)
    return Third(archive), model


def test_a_mechanism_has_the_bits_of_simulate(exported):
    unit, model = unit_of(exported, "pendulum")
    times = np.arange(9) / 4
    assert unit.begin(stop=2.0) == OK
    found = over(unit, times, list(model.signals))
    same = simulate(model, 2.0, t_eval=times, rtol=RTOL)
    assert (found == np.array([same[n] for n in model.signals]).T).all()
    assert unit.reached.value == 2.0
    assert not any(flag.value for flag in unit.flags)
    assert unit.step(2.0, 0.5) == DISCARD
    unit.free()


@pytest.mark.heavy
def test_a_mechanism_with_loops_starts_closed_where_it_is_told(exported):
    unit, model = unit_of(exported, "loop")
    x0 = {"crank": 1.1}
    assert unit.begin(**x0) == OK
    times = np.arange(5) / 8
    names = [v.name for v in model.x]
    found = over(unit, times, names)
    same = simulate(model, 0.5, x0=x0, t_eval=times, rtol=RTOL)
    for column, name in zip(found.T, names, strict=True):
        assert np.abs(column - same[name]).max() <= 10 * RTOL * np.abs(same[name]).max()
    unit.free()


def test_steps_of_a_fixed_length_are_those_of_the_plant(exported):
    unit, model = unit_of(exported, "drive", step=1e-3)
    assert unit.begin(force=1.7) == OK
    times = np.arange(33) / 8 * 0.25
    found = over(unit, times, ["x", "v", "attempts"])
    block = plant_block(model, h=1 / 1024, name="plant")
    same = run_vm(CBlock(block, DOUBLE), np.full((1024, 1), 1.7))
    names = [*(s.name for s in block.states), *block.outputs]
    assert found[-1, 2] == 1024  # 1/32 s in 32 equal steps of at most 1 ms
    for i, name in enumerate(("x", "v")):
        column = same[31::32, names.index(name)]
        assert np.abs(found[1:, i] - column).max() <= 1e-13
    assert unit.step(1.0, 0.3) == OK
    before = unit.get("attempts")[0]
    assert unit.step(1.3, 0.1) == OK  # 1.4 less 1.3 is a little more than 0.1
    assert unit.get("attempts")[0] == before + 100
    unit.free()


def test_all_calls_of_the_standard_are_there_and_refuse_what_no_unit_has(exported):
    unit, _ = unit_of(exported, "drive", step=1e-3)
    one, number, flag = (c.c_uint32 * 1)(0), (c.c_int32 * 1)(), c.c_size_t(1)
    assert unit.call("GetInt32", one, flag, number, flag) == ERROR
    assert unit.call("GetInt32", one, c.c_size_t(0), number, c.c_size_t(0)) == OK
    assert unit.call("EnterEventMode") == ERROR
    assert not unit.library.fmi3InstantiateModelExchange(None, None, None, 0, 0, None, None)
    assert unit.call("GetClock", one, flag, number) == ERROR
    unit.free()
