"""Tasks of an ensemble: plain data, written once, known by every digit, solved by any process."""

import gc
import pickle
import weakref
from dataclasses import fields, is_dataclass, replace
from typing import Any

import casadi as ca
import numpy as np
import pytest
from differentiable import oscillator, switched

import symfric.integrator.compiled.compiler as compiler
import symfric.integrator.many.members as module
import symfric.integrator.running.integrator as built
from symfric import BrownMcPhee, Hold, Model, simulate, simulate_many
from symfric.foundation.programs import Compiler
from symfric.integrator.equations.initial import first_guess
from symfric.integrator.equations.inputs import Input, input_data
from symfric.integrator.equations.system import system
from symfric.integrator.many.chunk import Chunk, Job, digest
from symfric.integrator.many.members import Assembly, program
from symfric.integrator.methods.tableaux import RODAS5P
from symfric.integrator.running.integrator import Integrator
from symfric.integrator.step.attempt import Given, State
from symfric.scenes import Pendulum


def task(model: Model, start: list[float], u: dict[str, Input] | None = None) -> tuple[Job, Chunk]:
    """Two equal members over a second, results at three times."""
    inputs = input_data(model, u, 0.0, 1.0)
    integrator = Integrator(model, inputs, RODAS5P)
    p, atol = model.values("p"), 1e-7 * integrator.system.nominal
    S = State.at(0.0, 1e-8, start)
    R = Given.of(1.0, 1e-6, 1.0, atol, [*p, *inputs.values[:, 0]])
    times = np.array([0.0, 0.5, 1.0])
    job = Job(program(integrator), inputs.breaks, times, 10_000)
    return job, Chunk(np.tile(S, (2, 1)), np.tile(R, (2, 1)), inputs.values[None], np.full(2, 1.0))


def test_solving_does_not_change_a_chunk() -> None:
    u: dict[str, Input] = {"u": Hold([0.0, 0.5], [1.0, -1.0])}
    for model, start in ((oscillator(), [1.0, 0.0]), (switched(), [1.0, 0.0])):
        job, chunk = task(model, start, u)
        S, R = chunk.S.copy(), chunk.R.copy()
        first, second = job.solve(chunk), job.solve(chunk)
        np.testing.assert_array_equal(chunk.S, S)
        np.testing.assert_array_equal(chunk.R, R)
        np.testing.assert_array_equal(first.signals, second.signals)


def test_equal_jobs_have_one_digest_and_every_field_counts() -> None:
    job, _ = task(switched(), [1.0, 0.0])
    same, _ = task(switched(), [1.0, 0.0])
    assert digest(job) == digest(same) == digest(pickle.loads(pickle.dumps(job)))
    x = ca.SX.sym("x")
    changes: dict[type, Any] = {
        str: lambda v: v + " ", bool: lambda v: not v, int: lambda v: v + 1,
        tuple: lambda v: (*v, "more"), np.ndarray: lambda v: v + 1e-15, type(None): lambda v: 1,
        ca.Function: lambda v: ca.Function("other", [x], [2 * x]),
    }  # fmt: skip

    def changed(whole: object) -> list[Any]:
        """Copies of `whole`, each with one field changed at any depth."""
        if not is_dataclass(whole):
            return [None]
        found = []
        for item in fields(whole):
            value = getattr(whole, item.name)
            new = changes.get(type(value), changed)(value)
            found += [
                replace(whole, **{item.name: n}) for n in (new if type(new) is list else [new])
            ]
        return found

    every = changed(job)
    assert len(every) > 12
    assert len({digest(one) for one in every} - {digest(job)}) == len(every)
    zeros, tiny = np.zeros(5000), np.zeros(5000)
    tiny[2500] = 1e-300
    assert repr(zeros) == repr(tiny)
    assert digest(zeros) != digest(tiny)
    assert digest(zeros) != digest(zeros.reshape(50, 100))
    assert digest("ab", "c") != digest("a", "bc")


@pytest.mark.parametrize("make", [oscillator, switched])
def test_another_call_builds_writes_and_compiles_nothing(
    make: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    made: list[str] = []

    def counted(place: Any, name: str) -> None:
        real = getattr(place, name)

        def call(*arguments: Any, **options: Any) -> Any:
            made.append(name)
            return real(*arguments, **options)

        monkeypatch.setattr(place, name, call)

    for place, name in (
        (built, "Integrator"), (module, "with_code"), (compiler, "opened"), (Compiler, "run"),
    ):  # fmt: skip
        counted(place, name)
    model = make()
    first = simulate_many(model, 1.0, x0={"x": [0.5, 1.0]}, backend="compiled")
    assert made[:2] == ["Integrator", "with_code"]
    made.clear()
    again = simulate_many(model, 1.0, x0={"x": [1.0, 0.5]}, u={"u": 0.0}, backend="compiled")
    simulate(model, 1.0, backend="vm")
    assert made == []
    np.testing.assert_array_equal(again["x"], first["x"][::-1])
    simulate_many(model, 1.0, method="rodas4p", backend="compiled")
    assert made[:2] == ["Integrator", "with_code"]
    gone = weakref.ref(model)
    del model
    gc.collect()
    assert gone() is None  # programs die with their model


def test_each_member_has_the_charts_of_its_own_start() -> None:
    """Bases of the tangent space of a pendulum in absolute coordinates."""
    model = Pendulum(BrownMcPhee()).mechanism().build(formulation="absolute")
    whole = system(model, input_data(model, None, 0.0, 1.0))
    manifold, d = whole.manifold, np.tile(model.values("p"), (3, 1))
    assert manifold is not None and manifold.charted
    guess = first_guess(whole, model, model.initial_state(None, None, 0.0), 0.0)
    y, closed = Assembly(manifold, whole.nx)(np.outer([1.0, 1.01, 0.99], guess), d)
    assert closed.all()
    n, m = manifold.n, manifold.m
    for row in y:
        slope, V = manifold.slope(row, d[0]).full(), row[manifold.basis].reshape(n - m, n)
        assert pytest.approx(np.eye(n - m), abs=1e-12) == V @ V.T
        assert slope[n : n + m, :n] @ V.T == pytest.approx(np.zeros((m, n - m)), abs=1e-12)
