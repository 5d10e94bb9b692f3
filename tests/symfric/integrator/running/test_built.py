"""Integrators live as long as their model, and few of them."""

import copy
import gc
import weakref
from concurrent.futures import ThreadPoolExecutor

import casadi as ca
import pytest

import symfric.integrator.running.integrator as module
from symfric import Model, Variable, Viscous, drive, simulate
from symfric.integrator.equations.inputs import input_data
from symfric.integrator.methods.tableaux import METHODS
from symfric.integrator.running.integrator import REMEMBERED, Integrator, built


def cart() -> Model:
    return drive(Viscous())


def wave(model: Model, k: int) -> tuple[Integrator, bool]:
    # exponents are structure, other numbers data
    inputs = input_data(model, {"force": lambda t: (1 + ca.sin(t)) ** (k + 0.5)}, 0.0, 1.0)
    return built(model, inputs, METHODS["rodas3"])


def test_a_model_that_was_simulated_dies_with_its_last_reference() -> None:
    """4f644ad kept every model for ever: 0.12 MB each, 3.7 MB an arm."""
    seen = list[weakref.ref[object]]()
    for _ in range(3):
        model = cart()
        run = simulate(model, 0.1, backend="vm", samples=2)
        integrator = next(iter(model.memory["integrators"].values()))
        seen += [weakref.ref(model), weakref.ref(integrator)]
        assert run.final["v"] == 0.0
    del model, run, integrator
    gc.collect()
    assert sum(ref() is not None for ref in seen) == 0


def test_equal_inputs_and_methods_share_an_integrator_others_do_not() -> None:
    model = cart()
    first, fresh = wave(model, 1)
    assert fresh
    assert wave(model, 1) == (first, False)
    assert wave(model, 2)[0] is not first
    assert built(model, input_data(model, None, 0.0, 1.0), METHODS["rodas3"])[0] is not first
    assert built(model, input_data(model, None, 0.0, 1.0), METHODS["rodas4p"])[1]
    assert wave(cart(), 1)[1]


def test_the_oldest_goes_when_there_are_too_many() -> None:
    model = cart()
    kept = [wave(model, k)[0] for k in range(REMEMBERED + 1)]
    assert len(model.memory["integrators"]) == REMEMBERED
    assert [wave(model, k)[1] for k in range(1, REMEMBERED + 1)] == [False] * REMEMBERED
    again, fresh = wave(model, 0)
    assert fresh
    assert again is not kept[0]


def test_threads_that_build_at_once_get_one_integrator(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "REMEMBERED", 2)
    model = cart()
    with ThreadPoolExecutor(4) as pool:
        found = list(pool.map(lambda k: wave(model, k % 3)[0], range(24)))
    assert len(model.memory["integrators"]) == 2
    assert all(isinstance(one, Integrator) for one in found)


def test_a_copy_of_a_model_remembers_nothing() -> None:
    model = Model("decay", x=(x := Variable("x", "m", start=1.0),), ode=-x.symbol)
    simulate(model, 0.1, backend="vm")
    assert "integrators" not in copy.copy(model).memory
    assert simulate(copy.copy(model), 0.1, backend="vm").final == simulate(model, 0.1).final
