"""Tasks of an ensemble: plain data, known by every digit, solved by a process with nothing else."""

import pickle
import subprocess
import sys
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from differentiable import oscillator, switched

from symfric import BrownMcPhee, Hold, Model, rabinowicz, simulate
from symfric.integrator.equations.inputs import Input, input_data
from symfric.integrator.many.chunk import Chunk, Job, digest, solve_chunk
from symfric.integrator.methods.tableaux import RODAS5P
from symfric.integrator.running.integrator import Integrator
from symfric.integrator.step.attempt import Given, State


def task(
    model: Model, start: list[float], backend: str = "vm", u: dict[str, Input] | None = None
) -> tuple[Job, Chunk]:
    """Two equal members over a second, results at three times."""
    inputs = input_data(model, u, 0.0, 1.0)
    integrator = Integrator(model, inputs, RODAS5P)
    times = np.array([0.0, 0.5, 1.0])
    p, atol = model.values("p"), 1e-7 * integrator.system.nominal
    S = State.at(0.0, 1e-8, start)
    R = Given.of(1.0, 1e-6, 1.0, atol, [*p, *inputs.values[:, 0]])
    job = Job.of(integrator, inputs.breaks, times, backend, 10_000)
    return job, Chunk(np.tile(S, (2, 1)), np.tile(R, (2, 1)), inputs.values[None], np.full(2, 1.0))


@pytest.mark.parametrize("backend", ["vm", "compiled"])
def test_task_survives_the_way_to_a_process_that_has_nothing_else(
    backend: str, tmp_path: Path
) -> None:
    job, chunk = task(rabinowicz(BrownMcPhee()), [0.0, 0.02], backend)
    (tmp_path / "task").write_bytes(pickle.dumps((job, chunk)))
    program = (
        "import pickle, sys; from symfric.integrator.many.chunk import solve_chunk;"
        "job, chunk = pickle.load(open('task', 'rb'));"
        "pickle.dump(solve_chunk(job, chunk), open('result', 'wb'))"
    )
    subprocess.run([sys.executable, "-c", program], cwd=tmp_path, check=True)
    there, here = pickle.loads((tmp_path / "result").read_bytes()), solve_chunk(job, chunk)
    np.testing.assert_array_equal(there.signals, here.signals)
    np.testing.assert_array_equal(there.attempts, here.attempts)
    alone = simulate(
        rabinowicz(BrownMcPhee()), 1.0, x0={"v": 0.02}, t_eval=[0.0, 0.5, 1.0], backend=backend
    )
    assert here.signals[1, :, 0] == pytest.approx(alone["x"], rel=1e-9)


@pytest.mark.parametrize("backend", ["vm", "compiled"])
def test_chunk_is_not_changed_by_solving_it(backend: str) -> None:
    u: dict[str, Input] = {"u": Hold([0.0, 0.5], [1.0, -1.0])}
    for model, start in ((oscillator(), [1.0, 0.0]), (switched(), [1.0, 0.0])):
        job, chunk = task(model, start, backend, u)
        S, R = chunk.S.copy(), chunk.R.copy()
        first, second = solve_chunk(job, chunk), solve_chunk(job, chunk)
        np.testing.assert_array_equal(chunk.S, S)
        np.testing.assert_array_equal(chunk.R, R)
        np.testing.assert_array_equal(first.signals, second.signals)


def test_equal_jobs_have_one_digest_and_every_field_counts() -> None:
    job, _ = task(switched(), [1.0, 0.0])
    same, _ = task(switched(), [1.0, 0.0])
    assert job.digest() == same.digest()
    others = {
        str: lambda value: value + " ",
        bool: lambda value: not value,
        int: lambda value: value + 1,
        tuple: lambda value: (*value, "more"),
        np.ndarray: lambda value: value + 1e-15,
    }

    def changed(whole: Any) -> list[Any]:
        values = {f.name: getattr(whole, f.name) for f in fields(whole) if f.name != "program"}
        return [
            replace(whole, **{name: others[type(value)](value)}) for name, value in values.items()
        ]

    every = changed(job) + [replace(job, program=other) for other in changed(job.program)]
    assert len(every) == len(fields(job)) - 1 + len(fields(job.program))
    assert len({other.digest() for other in every} - {job.digest()}) == len(every)


def test_digest_sees_what_numpy_does_not_print() -> None:
    zeros, other = np.zeros(5000), np.zeros(5000)
    other[2500] = 1e-300
    assert repr(zeros) == repr(other)
    assert digest(zeros) != digest(other)
    assert digest(zeros) != digest(zeros.reshape(50, 100))
    assert digest("ab", "c") != digest("a", "bc")
