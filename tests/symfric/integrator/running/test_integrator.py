"""Caches of integrators: nothing is computed twice, and all die with their model."""

import copy
import gc
import weakref
from concurrent.futures import ThreadPoolExecutor

import casadi as ca
import pytest

import symfric.integrator.running.integrator as module
from symfric import BrownMcPhee, Model, Variable, Viscous, drive, simulate
from symfric.integrator.equations.initial import consistent
from symfric.integrator.equations.inputs import input_data
from symfric.integrator.methods.tableaux import METHODS
from symfric.integrator.running.integrator import REMEMBERED, Integrator, built
from symfric.scenes import PendulumBox


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
