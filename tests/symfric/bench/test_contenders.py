"""Solvers of mechanisms: each watches the same positions, and says what it took."""

import numpy as np
import pytest
from backends import needs_compiler

from symfric import Model, simulate
from symfric.bench.contenders import MECHANISMS, compiled
from symfric.bench.multibody import CASES
from symfric.bench.table import compile_time

WHAT = CASES["slider_crank"]


@pytest.fixture(scope="module")
def model() -> Model:
    return WHAT.scene.model()


@needs_compiler
@pytest.mark.parametrize("name", [n for n in MECHANISMS if MECHANISMS[n][0] == "joint"])
def test_everyone_finds_the_slider(name: str, model: Model) -> None:
    exact = simulate(model, WHAT.t_end, rtol=1e-10, t_eval=WHAT.times)["slider"]
    contender = MECHANISMS[name][1](model, WHAT.times, ("slider",), 1e-5)
    found, count = contender.solve()
    assert found.shape == (1, 25)
    assert np.abs(found[0] - exact).max() < 1e-4
    assert count() > 50
    assert (contender.compile_s > 0) == ("rosenbrock" in name)


@needs_compiler
def test_compile_time_is_that_of_the_compiler() -> None:
    assert compile_time("double f(double x) { return 2 * x; }\n") > 0


@needs_compiler
def test_generated_code_gives_what_the_function_gives(model: Model) -> None:
    function = model.function("ode")
    generated, seconds = compiled(function)
    z = [v.start for v in model.z]
    x = model.initial_state()
    assert generated(0, x, z, [], []).full() == pytest.approx(function(0, x, z, [], []).full())
    assert seconds > 0
