"""The loop over members: compiled and in the virtual machine, where they stop and go on."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from differentiable import oscillator

from symfric import Hold, Model, Output, Variable
from symfric.integrator.compiled.columns import Columns
from symfric.integrator.equations.inputs import InputData, input_data
from symfric.integrator.many.members import (
    CompiledMembers,
    Members,
    Stretch,
    VmMembers,
    many_source,
)
from symfric.integrator.methods.tableaux import RODAS5P
from symfric.integrator.running.engine import VmEngine
from symfric.integrator.running.events import Stop
from symfric.integrator.running.integrator import Integrator
from symfric.integrator.step.attempt import Given, State


def compiled(integrator: Integrator) -> Members:
    source = many_source(integrator.step, integrator.signals)
    return CompiledMembers.of(source, integrator.signals.numel_out(0))


def vm(integrator: Integrator) -> Members:
    return VmMembers(VmEngine(integrator.step), Columns(integrator.signals), None)


each_loop = pytest.mark.parametrize("make", [vm, compiled])
Make = Callable[[Integrator], Members]


def columns(inputs: InputData, model: Model, starts: list[list[float]]) -> tuple:
    S = State.at(inputs.breaks[0], 1e-8, starts)
    atol = 1e-7 * model.nominal("x")
    R = Given.of(0.0, 1e-6, np.inf, atol, [*model.values("p"), *inputs.values[:, 0]])
    return S, np.tile(R, (len(starts), 1)), np.zeros(len(starts), dtype=np.int64)


def stretch(
    inputs: InputData, times: list[float], members: int = 1, max_steps: int = 10_000
) -> Stretch:
    ends, h_min = np.full(members, inputs.breaks[-1]), np.full(members, 1e-15)
    return Stretch(inputs.breaks, inputs.values[None], ends, h_min, np.array([times]), max_steps)


@each_loop
def test_held_input_belongs_to_the_interval_that_it_begins(make: Make) -> None:
    model = oscillator()
    inputs = input_data(model, {"u": Hold([0.0, 0.3, 0.6], [1.0, -2.0, 3.0])}, 0.0, 1.0)
    S, R, made = columns(inputs, model, [[1.0, 0.0], [0.0, 0.0]])
    before = R.copy()
    found, reason, _ = make(Integrator(model, inputs, RODAS5P)).run(
        S, R, made, stretch(inputs, [0.0, 0.1, 0.3, 0.5, 0.6, 1.0], 2)
    )
    assert found[:, :, 2].tolist() == [[1.0, 1.0, -2.0, -2.0, 3.0, 3.0]] * 2
    assert found[0, 0].tolist() == [1.0, 0.0, 1.0, 2.0]
    assert reason.tolist() == [Stop.END] * 2
    np.testing.assert_array_equal(S[:, 0], 1.0)
    np.testing.assert_array_equal(S[:, State.Y], found[:, -1, :2])
    np.testing.assert_array_equal(R, before)
    assert (made > 0).all()


@each_loop
def test_attempts_made_before_count(make: Make) -> None:
    model = oscillator()
    inputs = input_data(model, None, 0.0, 100.0)
    members = make(Integrator(model, inputs, RODAS5P))
    S, R, made = columns(inputs, model, [[1.0, 0.0], [1.0, 0.0]])
    made[1] = 64
    found, reason, reach = members.run(S, R, made, stretch(inputs, [0.0, 100.0], 2, max_steps=96))
    assert reach[:, 1, 0].tolist() == [1.0, 1.0]  # it swings about zero from there
    assert (reach[:, 0, 0] < 0).all()
    assert (np.abs(reach[:, :, 1]).max(axis=1) > 1).all()
    assert reason.tolist() == [Stop.ATTEMPTS] * 2
    assert made.tolist() == [96, 96]
    assert S[1, 0] < S[0, 0] < 100.0
    assert np.isfinite(found[:, 0]).all()
    assert np.isnan(found[:, 1]).all()


@each_loop
def test_two_stretches_are_one(make: Make) -> None:
    model = oscillator()
    inputs = input_data(model, None, 0.0, 2.0)
    members, times = make(Integrator(model, inputs, RODAS5P)), [0.5, 1.5, 2.0]
    S, R, made = columns(inputs, model, [[1.0, 0.0]])
    whole, *_ = members.run(S.copy(), R, made.copy(), stretch(inputs, times))
    parts = []
    for a, b, at in ((0.0, 1.0, [0.5]), (1.0, 2.0, [1.5, 2.0])):
        part = replace(stretch(inputs, at), breaks=np.array([a, b]), ends=np.array([b]))
        parts.append(members.run(S, R, made, part)[0])
    assert np.concatenate(parts, axis=1) == pytest.approx(whole, rel=1e-5)


@each_loop
def test_member_that_cannot_start_has_its_start_alone(make: Make) -> None:
    x = Variable("x", "m", start=1.0)
    model = Model("broken", x=(x,), ode=np.nan * x.symbol)
    inputs = input_data(model, None, 0.0, 1.0)
    S, R, made = columns(inputs, model, [[1.0]])
    found, reason, _ = make(Integrator(model, inputs, RODAS5P)).run(
        S, R, made, stretch(inputs, [0.0, 0.5])
    )
    assert found[0, 0, 0] == 1.0
    assert np.isnan(found[0, 1, 0])
    assert reason.tolist() == [Stop.STEP_TOO_SMALL]
    assert S[0, 0] == 0.0


@each_loop
def test_signals_with_structural_zeros_are_filled_in(make: Make) -> None:
    x = Variable("x", "m", start=1.0)
    outputs = {"none": Output(0.0, "1"), "twice": Output(2 * x.symbol, "m")}
    model = Model("sparse", x=(x,), ode=-x.symbol, outputs=outputs)
    inputs = input_data(model, None, 0.0, 1.0)
    S, R, made = columns(inputs, model, [[1.0]])
    found, *_ = make(Integrator(model, inputs, RODAS5P)).run(S, R, made, stretch(inputs, [1.0]))
    assert found[0, 0] == pytest.approx([np.exp(-1.0), 0.0, 2 * np.exp(-1.0)], rel=1e-5)
