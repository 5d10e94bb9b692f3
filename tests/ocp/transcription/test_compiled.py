import numpy as np
import pytest
from discretised import mechanism, one_phase

from ocp.transcription.collocation import FUNCTIONS, Engine, PointEquations
from ocp.transcription.schemes import Radau, make_meshes
from ocp.transcription.transcribe import discretise


def engine_of_a_mechanism() -> Engine:
    equations = discretise(mechanism(), Radau(2)).equations.spans[0]
    assert isinstance(equations, PointEquations)
    return equations.engine


def test_small_blocks_stay_in_the_virtual_machine() -> None:
    made = discretise(one_phase(), Radau(3))
    equations = made.equations.spans[0]
    assert isinstance(equations, PointEquations)
    made.on(make_meshes(made.problem, 500))
    assert equations.engine.at(1500) is equations.block
    assert equations.engine.expected > 0


@pytest.mark.heavy
def test_compiled_blocks_give_the_same_bits() -> None:
    engine = engine_of_a_mechanism()
    compiled = engine._compiled
    rng = np.random.default_rng(0)
    for name in FUNCTIONS:
        vm, fast = getattr(engine.block, name), getattr(compiled, name)
        arguments = [rng.uniform(0.5, 1.0, vm.size_in(i)) for i in range(vm.n_in())]
        assert fast.class_name() == "External"
        for a, b in zip(vm.call(arguments), fast.call(arguments), strict=True):
            np.testing.assert_array_equal(a.full(), b.full())
    assert engine.at(10) is compiled
