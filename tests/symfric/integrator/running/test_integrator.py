"""What an integrator remembers and leaves out: nothing is computed that a run does not need."""

import numpy as np
import pytest

import symfric.integrator.running.integrator as module
from symfric import BrownMcPhee, simulate
from symfric.integrator.compiled.columns import Columns
from symfric.integrator.equations.initial import consistent
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


def test_states_of_a_tree_are_the_dense_output(called: list[Columns]) -> None:
    run = simulate(PendulumBox(BrownMcPhee()).model(), 1.0)
    phi = run["phi"]
    assert not called
    assert phi == pytest.approx(run.signals["phi"], abs=1e-14)
    assert len(called) == 1


def test_states_of_loops_are_put_onto_them_without_the_other_signals(called: list[Columns]) -> None:
    run = simulate(SliderCrank(BrownMcPhee()).model(), 0.02)
    crank, slider = run["crank"], run["slider"]
    assert len(called) == 1
    assert crank == pytest.approx(run.signals["crank"], abs=1e-14)
    scene = SliderCrank(BrownMcPhee())
    across = float(scene.b) - float(scene.r) * np.sin(crank)
    up = float(scene.c) - float(scene.e) + float(scene.r) * np.cos(crank)
    assert np.abs(slider**2 + across**2 + up**2 - float(scene.l) ** 2).max() < 1e-13
    states, signals = called
    assert states.function.n_instructions() < signals.function.n_instructions() / 2
