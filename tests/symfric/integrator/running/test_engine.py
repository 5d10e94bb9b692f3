"""Virtual machine and compiled loop: the same steps, the same reasons to stop."""

import numpy as np
import pytest
from backends import each_backend, needs_compiler
from closed_forms import assemble, smooth_ode

from symfric import BrownMcPhee, LuGre, Model, rabinowicz
from symfric.foundation.numeric import Array
from symfric.integrator.methods.tableaux import ADAPTIVE, RODAS5P
from symfric.integrator.running.engine import CompiledEngine, Engine, VmEngine, Work, loop_source
from symfric.integrator.running.events import Stop
from symfric.integrator.step.attempt import Given, State, build_step

ROWS = RODAS5P.H.shape[0]

KINDS = ("vm", "compiled")


def engine(kind: str, model: Model, method: str = "rodas5p") -> Engine:
    step, rows = build_step(assemble(model), ADAPTIVE[method]), ADAPTIVE[method].H.shape[0]
    return CompiledEngine(loop_source(step, rows)) if kind == "compiled" else VmEngine(step)


def run(
    runner: Engine, S: Array, R: Array, rows: int, attempts: int, h_min: float, dense: int = ROWS
) -> tuple[Array, int, Stop]:
    """Advance S up to the end in R; records, attempts made, why it stopped."""
    work = Work(S.size - State.MEMORY, R.size, dense, rows)
    work.S[:], work.R[:] = S, R
    work.over(np.array([S[State.T], R[Given.T_END]]), np.zeros((0, 1)))
    work.loop.h_min = h_min
    records, made, stop = runner.march(work, attempts)
    S[:] = work.S
    return records, made, stop


def start(y: tuple[float, ...], h: float = 1e-6) -> Array:
    return np.array([0.0, h, h, 1.0, 0.0, *y])


def data(n: int, t_end: float, rtol: float = 1e-8) -> Array:
    return Given.of(t_end, rtol, np.inf, np.full(n, 0.1 * rtol), [])


BELT = rabinowicz(BrownMcPhee())
BRISTLE = rabinowicz(LuGre())


@needs_compiler
def test_both_engines_stop_after_the_same_attempt() -> None:
    """4f644ad's virtual machine went on to the end of its batch of 32."""
    runners = [engine(kind, BRISTLE) for kind in KINDS]
    for rows, attempts, h_min in ((9999, 7, 0.0), (9999, 45, 0.0), (20, 999, 0.0), (50, 60, 0.0),
                                  (9999, 999, 2e-2), (9999, 999, 3e-3)):  # fmt: skip
        found = list[object]()
        for runner in runners:
            S = start((0.0, 0.05, -1e-5))
            records, made, stop = run(runner, S, data(3, 5.0, 1e-6), rows, attempts, h_min)
            found.append((records.tobytes(), made, stop, S.tobytes()))
        assert found[0] == found[1], (rows, attempts, h_min)


@each_backend
def test_records_are_a_chain_from_start_to_end(backend: str) -> None:
    """At the end nothing is done."""
    runner, S = engine(backend, smooth_ode().model), start((1.0, 1.0))
    records, _, _ = run(runner, S, data(2, 1.0), 9999, 9999, 0.0)
    t0, t1, y0, y1 = records[:, 0], records[:, 1], records[:, 2:4], records[:, 4:6]
    assert (t0[0], t1[-1], S[0]) == (0.0, 1.0, 1.0)
    assert (t1[:-1] == t0[1:]).all()
    assert (y1[:-1] == y0[1:]).all()
    assert y0[0].tolist() == [1.0, 1.0]
    assert y1[-1].tolist() == S[State.MEMORY :].tolist()
    assert y1 == pytest.approx(np.array([smooth_ode().exact(t) for t in t1]), rel=1e-6)
    before = S.copy()
    records, made, stop = run(runner, S, data(2, 1.0), 9, 9, 0.0)
    assert (records.shape[0], made, stop, S.tolist()) == (0, 0, Stop.END, before.tolist())


@each_backend
def test_full_record_is_continued_without_a_trace(backend: str) -> None:
    runner = engine(backend, BELT)
    whole, made, _ = run(runner, start((0.0, 0.0)), data(2, 3.0), 9999, 99999, 0.0)
    S, parts, attempts, stop = start((0.0, 0.0)), [], 0, Stop.FULL
    while stop is Stop.FULL:
        records, count, stop = run(runner, S, data(2, 3.0), 20, 99999, 0.0)
        parts.append(records)
        attempts += count
    assert (stop, attempts) == (Stop.END, made)
    assert len(parts) > 2
    np.testing.assert_array_equal(np.vstack(parts), whole)


def test_source_of_a_model_does_not_change_when_it_is_built_again() -> None:
    """Its hash is the name in the cache."""
    one, other = (
        loop_source(build_step(assemble(rabinowicz(LuGre())), RODAS5P), ROWS) for _ in range(2)
    )
    assert one == other
