"""Values at the times of the result, found on the way; and what a run keeps of its steps."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import casadi as ca
import numpy as np
import pytest
from backends import needs_compiler
from numpy.typing import NDArray

import symfric.integrator.running.run as module
from symfric import (
    BrownMcPhee,
    ExactCoulomb,
    Hold,
    Linear,
    LuGre,
    Model,
    Trajectory,
    drive,
    rabinowicz,
    simulate,
)
from symfric.integrator.running.record import Run
from symfric.scenes import PendulumBox

Array = NDArray[np.float64]
each_engine = pytest.mark.parametrize(
    "backend", ["vm", pytest.param("compiled", marks=needs_compiler)]
)
TIMES = [0.0, 0.1, 0.3, 0.30001, 0.4, 0.9, 1.7, 2.0]
"""Some of them at jumps of the inputs."""
FORCE = Hold([0.0, 0.3, 0.4, 0.9], [0.0, 15.0, -15.0, 20.0])
RAMP = Linear([0.0, 0.3, 0.9], [0.0, 15.0, -25.0])
LAW = BrownMcPhee(mu_s=0.12, mu_d=0.1, v_t=0.01)

Case = tuple[Callable[[], Model], dict[str, Any]]
CASES: dict[str, Case] = {
    "one interval": (lambda: rabinowicz(BrownMcPhee()), {}),
    "held": (lambda: drive(LuGre()), {"u": {"force": FORCE}}),
    "sampled": (lambda: drive(BrownMcPhee()), {"u": {"force": RAMP}, "times": [0.1, 1.5]}),
    "events": (lambda: drive(ExactCoulomb()), {"u": {"force": lambda t: 12 * ca.sin(9 * t)}}),
    "held events": (lambda: drive(ExactCoulomb()), {"u": {"force": FORCE}}),
    "algebraic": (lambda: PendulumBox(LAW).model(), {}),
    "few steps": (lambda: rabinowicz(LuGre()), {"max_steps": 70, "throw": False}),
}


def run_of(case: str, backend: str, **further: Any) -> Trajectory:
    make, arguments = CASES[case]
    return simulate(make(), 2.0, t_eval=TIMES, backend=backend, **(arguments | further))


@each_engine
@pytest.mark.parametrize("case", CASES)
def test_outputs_are_the_dense_output_to_the_bit(case: str, backend: str) -> None:
    """`at` evaluates the records of accepted steps in NumPy, whatever ran."""
    run = run_of(case, backend)
    assert run.t.tolist() == [time for time in TIMES if time <= run.step_times[-1]]
    assert run.t.size > 1
    again = run.at(run.t)
    for name in run.units:
        assert run[name].tobytes() == again[name].tobytes(), name


@each_engine
@pytest.mark.parametrize("case", CASES)
def test_a_long_run_keeps_no_steps_and_gives_the_same(
    case: str, backend: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole, kept = run_of(case, backend), list[int]()
    keep = Run.keep

    def counted(self: Run, piece: Any) -> None:
        keep(self, piece)
        kept.append(sum(map(len, self.kept)))

    monkeypatch.setattr(Run, "keep", counted)
    monkeypatch.setattr(module, "MOST_BYTES", 200)
    bounded = run_of(case, backend)
    assert max(kept) == 1
    once = len(kept)
    assert bounded.statistics.smallest_step == whole.statistics.smallest_step
    assert bounded.final == whole.final
    for name in whole.units:
        assert bounded[name].tobytes() == whole[name].tobytes(), name
    assert len(kept) == once
    at = np.linspace(0.0, whole.step_times[-1], 57)
    for name, values in whole.at(at).items():
        assert bounded.at(at)[name].tobytes() == values.tobytes(), name
    assert len(kept) > once  # run again for what lies between, and no steps kept for that either
    assert max(kept) == 1
    assert bounded.step_times.tobytes() == whole.step_times.tobytes()


def test_tiny_motions_are_found_without_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    """The size of a motion is known when its steps are not kept."""
    model, start = drive(LuGre()), {"v": 1e-7}
    whole = simulate(model, 0.1, x0=start, samples=11)
    monkeypatch.setattr(module, "MOST_BYTES", 2000)
    bounded = simulate(model, 0.1, x0=start, samples=11)
    assert bounded["v"].tobytes() == whole["v"].tobytes()
    assert bounded.statistics.steps == whole.statistics.steps


@each_engine
def test_a_callback_may_run_another_simulation(backend: str) -> None:
    """Buffers belong to one run at a time."""
    model = rabinowicz(LuGre())

    def positions(x: float, progress: Callable[[float], None] | None = None) -> Array:
        return simulate(
            model, 20.0, x0={"x": x}, samples=21, backend=backend, progress=progress
        )["x"]  # fmt: skip

    inner, alone = list[Array](), [positions(x) for x in (0.0, 0.3)]
    outer = positions(0.0, lambda _: inner.append(positions(0.3)))
    assert outer.tobytes() == alone[0].tobytes()
    assert all(found.tobytes() == alone[1].tobytes() for found in inner)
    assert inner
    with ThreadPoolExecutor(4) as pool:
        found = list(pool.map(positions, [0.0, 0.3] * 6))
    assert [a.tobytes() for a in found] == [a.tobytes() for a in alone] * 6
