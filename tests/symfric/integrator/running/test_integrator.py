"""Caches of integrators: nothing is computed twice, and all die with their model."""

import copy
import gc
import weakref
from concurrent.futures import ThreadPoolExecutor

import casadi as ca
import numpy as np
import pytest

import symfric.integrator.running.integrator as module
from symfric import BrownMcPhee, Model, Variable, Viscous, drive, simulate
from symfric.integrator.compiled.columns import Columns
from symfric.integrator.equations.initial import consistent
from symfric.integrator.equations.inputs import input_data
from symfric.integrator.methods.tableaux import METHODS
from symfric.integrator.running.integrator import REMEMBERED, Integrator, built
from symfric.scenes import PendulumBox, SliderCrank


@pytest.fixture
def solved(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """A line for every start that is solved for."""
    lines: list[str] = []

    def counted(system: object, where: str, *given: object) -> object:
        lines.append(where)
        return consistent(system, where, *given)  # type: ignore[arg-type]

    monkeypatch.setattr(module, "consistent", counted)
    return lines


def test_a_start_is_solved_for_once(solved: list[str]) -> None:
    model = PendulumBox(BrownMcPhee()).model(free=["m"])
    runs = [simulate(model, t_end, rtol=1e-6, backend="vm") for t_end in (0.1, 0.2, 0.1)]
    assert len(solved) == 1
    assert (runs[0]["phi"] == runs[2]["phi"]).all()
    simulate(model, 0.1, p={"m": 10.0})
    simulate(model, 0.1, p={"m": 10.0}, x0={"phi": 0.1})
    assert len(solved) == 3
    again = simulate(model, 0.1, rtol=1e-6, backend="vm")
    assert len(solved) == 4
    assert (again["x_N"] == runs[0]["x_N"]).all()


@pytest.fixture
def called(monkeypatch: pytest.MonkeyPatch) -> list[Columns]:
    """All calls of Functions of many columns."""
    calls: list[Columns] = []
    call = Columns.__call__

    def counted(self: Columns, *arguments: object, **engine: object) -> object:
        calls.append(self)
        return call(self, *arguments, **engine)  # type: ignore[arg-type]

    monkeypatch.setattr(Columns, "__call__", counted)
    return calls


def test_states_need_no_other_signals(called: list[Columns]) -> None:
    """Those of a tree are the dense output; those of loops are projected onto them."""
    run = simulate(PendulumBox(BrownMcPhee()).model(), 1.0)
    phi = run["phi"]
    assert not called
    assert phi == pytest.approx(run.signals["phi"], abs=1e-14)
    called.clear()
    scene = SliderCrank(BrownMcPhee())
    run = simulate(scene.model(), 0.02)
    crank, slider = run["crank"], run["slider"]
    assert len(called) == 1
    assert crank == pytest.approx(run.signals["crank"], abs=1e-14)
    r, length, b, c, e = (float(getattr(scene, name)) for name in "rlbce")
    across, up = b - r * np.sin(crank), c - e + r * np.cos(crank)
    assert np.abs(slider**2 + across**2 + up**2 - length**2).max() < 1e-13
    states, signals = called
    assert states.function.n_instructions() < signals.function.n_instructions() / 2


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


def test_equal_inputs_and_methods_share_an_integrator_and_the_oldest_is_dropped() -> None:
    model = cart()
    kept = [wave(model, k) for k in range(REMEMBERED + 1)]
    assert all(fresh for _, fresh in kept)
    assert wave(model, 1) == (kept[1][0], False)
    assert len({id(integrator) for integrator, _ in kept}) == REMEMBERED + 1
    assert len(model.memory["integrators"]) == REMEMBERED
    again, fresh = wave(model, 0)
    assert fresh
    assert again is not kept[0][0]
    plain = input_data(model, None, 0.0, 1.0)
    assert (
        built(model, plain, METHODS["rodas3"])[0] is not built(model, plain, METHODS["rodas4p"])[0]
    )
    assert wave(cart(), 1)[1]


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
