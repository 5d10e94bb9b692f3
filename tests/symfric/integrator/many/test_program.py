"""What an ensemble runs is written and compiled once, and dies with its model."""

import gc
import weakref
from typing import Any

import numpy as np
import pytest
from differentiable import oscillator, switched

import symfric.integrator.compiled.compiler as compiler
import symfric.integrator.many.program as module
import symfric.integrator.running.integrator as built
from symfric import Model, simulate, simulate_many
from symfric.foundation.programs import Compiler


@pytest.mark.parametrize("make", [oscillator, switched])
def test_another_call_builds_writes_and_compiles_nothing(
    make: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """a055f62 built and wrote anew for every call: 15 ms of the belt, 574 of the arm."""
    made: list[str] = []

    def counted(place: Any, name: str) -> None:
        real = getattr(place, name)

        def call(*arguments: Any, **options: Any) -> Any:
            made.append(name)
            return real(*arguments, **options)

        monkeypatch.setattr(place, name, call)

    counted(built, "Integrator")
    counted(module, "_written")
    counted(compiler, "opened")
    counted(Compiler, "run")
    model = make()
    first = simulate_many(model, 1.0, x0={"x": [0.5, 1.0]}, backend="compiled")
    assert made[:2] == ["Integrator", "_written"]
    made.clear()
    again = simulate_many(model, 1.0, x0={"x": [1.0, 0.5]}, u={"u": 0.0}, backend="compiled")
    assert made == []
    np.testing.assert_array_equal(again["x"], first["x"][::-1])
    simulate(model, 1.0, backend="vm")
    assert made == []
    simulate_many(model, 1.0, method="rodas4p", backend="compiled")
    assert made[:2] == ["Integrator", "_written"]


def test_it_dies_with_its_model() -> None:
    def seen() -> weakref.ref[Model]:
        model = oscillator()
        simulate_many(model, 1.0)
        return weakref.ref(model)

    gone, before = seen(), len(module._KNOWN)
    gc.collect()
    assert gone() is None
    assert len(module._KNOWN) < before
