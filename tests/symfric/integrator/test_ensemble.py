"""Ensembles: every member as `simulate` runs it, on every executor, whatever happens."""

import os
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest
from differentiable import oscillator, pendulum, root, switched
from ensembles import EXECUTORS, after, assert_same, explosive, with_functions_of_libm

from symfric import (
    BrownMcPhee,
    Ensemble,
    Hold,
    Law,
    Linear,
    LuGre,
    Model,
    SolveError,
    Status,
    Variable,
    rabinowicz,
    simulate,
    simulate_many,
)
from symfric.foundation.programs import CompileError
from symfric.integrator.many import chunk as chunk_module
from symfric.integrator.many import program as program_module
from symfric.model import Event

VELOCITIES = np.linspace(-0.1, 0.1, 7)
LAWS: dict[str, Law] = {"brown_mcphee": BrownMcPhee(), "lugre": LuGre()}

each_engine = pytest.mark.parametrize("backend", ["vm", "compiled"])


def assert_member(many: Ensemble, m: int, model: Model, t_end: float, **arguments: Any) -> None:
    """Member m has all signals and attempts of a simulation of its own."""
    alone = simulate(model, t_end, t_eval=many.t, **arguments)
    for name in model.signals:
        scale = np.abs(alone[name]).max() + 1e-9
        assert many[name][m] == pytest.approx(alone[name], rel=0.0, abs=1e-7 * scale)
    assert many.attempts[m] == alone.statistics.steps + alone.statistics.rejections
    assert many.reached[m] == t_end


@pytest.mark.parametrize(
    ("law", "backend"), [("brown_mcphee", "vm"), ("lugre", "vm"), ("lugre", "compiled")]
)
def test_members_are_what_simulate_gives(
    law: str, backend: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Over start values and parameters; at the start, between the steps and at the end.

    With the functions of libm: see `test_own_functions_change_no_member` for others.
    """
    with_functions_of_libm(monkeypatch)
    model = rabinowicz(LAWS[law], free=["mu_s", "k"])
    times, mu_s = [0.0, 0.3, 2.71, 9.0], np.linspace(0.12, 0.18, 7)
    many = simulate_many(
        model, 9.0, x0={"v": VELOCITIES}, p={"mu_s": mu_s, "k": 2.0}, t_eval=times,
        backend=backend, chunk=3,
    )  # fmt: skip
    assert many.scene == "rabinowicz"
    assert many.units == model.signals
    assert many["x"].shape == (7, 4)
    assert many.status is Status.SUCCESS
    assert not many.failed
    for m in range(7):
        assert_member(
            many, m, model, 9.0, x0={"v": VELOCITIES[m]}, p={"mu_s": mu_s[m], "k": 2.0},
            backend=backend,
        )  # fmt: skip


@pytest.mark.parametrize("law", ["lugre", pytest.param("brown_mcphee", marks=pytest.mark.slow)])
def test_own_functions_change_no_member(law: str) -> None:
    """Their last digit is another than libm's; steps, which follow it, end within the tolerance."""
    model, times = rabinowicz(LAWS[law]), [2.71, 9.0]
    many = simulate_many(model, 9.0, x0={"v": VELOCITIES}, t_eval=times, backend="compiled")
    vm = simulate_many(model, 9.0, x0={"v": VELOCITIES}, t_eval=times, backend="vm", rtol=1e-10)
    plain = simulate_many(model, 9.0, x0={"v": VELOCITIES}, t_eval=times, backend="vm")
    error, of_vm = (np.abs(found["x"] - vm["x"]).max() for found in (many, plain))
    assert error < max(3 * of_vm, 1e-6)
    assert many.attempts == pytest.approx(plain.attempts, rel=0.05)


INPUTS: dict[str, tuple[Callable[[], Model], Any]] = {
    "linear": (oscillator, Linear([0.0, 0.3, 0.7], [1.0, -2.0, 3.0])),
    "function of time": (oscillator, lambda t: ca.sin(5 * t)),
    "held, algebraic unknowns follow": (switched, Hold([0.0, 0.3, 0.7], [1.0, -2.0, 3.0])),
}


@each_engine
@pytest.mark.parametrize("case", INPUTS)
def test_inputs_are_common_to_all_members(case: str, backend: str) -> None:
    make, u = INPUTS[case]
    model = make()
    times = [0.0, 0.1, 0.3, 0.5, 0.7, 0.9, 1.0]  # the jumps among them
    many = simulate_many(
        model, 1.0, x0={"x": [0.5, 1.0, 2.0]}, u={"u": u}, t_eval=times, backend=backend
    )
    for m, x in enumerate([0.5, 1.0, 2.0]):
        assert_member(many, m, model, 1.0, x0={"x": x}, u={"u": u}, backend=backend)


@each_engine
def test_algebraic_variables_start_consistently(backend: str) -> None:
    """z^3 = p x at the start, from a guess far from it."""
    many = simulate_many(root(), 0.5, p={"p": [0.1, 0.7, 300.0]}, t_eval=[0.0], backend=backend)
    assert many["z"][:, 0] == pytest.approx(np.cbrt([0.1, 0.7, 300.0]), rel=1e-9)


@each_engine
def test_mechanisms_start_on_their_constraints(backend: str) -> None:
    """One start beside the circle, one radius away from it, one that cannot be assembled."""
    x0, lengths = [0.6, 0.7, 0.6], [1.0, 1.1, 1e200]
    many = simulate_many(
        pendulum(), 1.0, x0={"x": x0}, p={"l": lengths}, t_eval=[0.0, 0.5, 1.0], backend=backend,
        executor="processes",
    )  # fmt: skip
    for m in range(2):
        assert_member(
            many, m, pendulum(), 1.0, x0={"x": x0[m]}, p={"l": lengths[m]}, backend=backend
        )
    assert list(many.failed) == [2]
    assert "from which all loops can be closed" in many.failed[2]


def test_time_may_start_anywhere() -> None:
    x, t = Variable("x", "m", start=0.0), ca.SX.sym("t")
    model = Model("swing", x=(x,), ode=ca.cos(t), t=t)
    many = simulate_many(model, 3.0, t_start=1.0, x0={"x": [0.0, 1.0]}, t_eval=[1.0, 3.0])
    rise = np.sin(3.0) - np.sin(1.0)
    assert many["x"] == pytest.approx(np.array([[0.0, rise], [1.0, 1.0 + rise]]), abs=1e-5)


@each_engine
def test_longest_step_and_times_hold_for_every_member(backend: str) -> None:
    model, how = rabinowicz(LuGre()), {"max_step": 0.01, "times": [0.1234, 0.5]}
    many = simulate_many(model, 1.0, x0={"v": VELOCITIES}, backend=backend, **how)
    assert many.attempts.min() > 100
    for m in (0, 6):
        assert_member(many, m, model, 1.0, x0={"v": VELOCITIES[m]}, backend=backend, **how)


def test_numbers_alone_are_one_member() -> None:
    many = simulate_many(oscillator(), 1.0, x0={"x": 2.0})
    assert many["x"].shape == (1, 1)
    assert many.t == pytest.approx([1.0])


@each_engine
@pytest.mark.parametrize("kind", EXECUTORS)
def test_every_executor_gives_the_same(kind: str, backend: str) -> None:
    model, x0 = rabinowicz(LuGre()), {"v": VELOCITIES}
    serial = simulate_many(model, 2.0, x0=x0, executor="serial", backend=backend, chunk=2)
    other = simulate_many(
        model, 2.0, x0=x0, executor=EXECUTORS[kind](), backend=backend, chunk=2, workers=2
    )
    assert_same(serial, other)


def test_a_worker_that_dies_leaves_what_was_finished() -> None:
    model = rabinowicz(BrownMcPhee(), free=["m"])
    with (
        ProcessPoolExecutor(1, initializer=os._exit, initargs=(1,)) as dying,  # pyright: ignore
        pytest.raises(SolveError, match=r"after 0 of 2 members .*out=FOLDER keeps") as error,
    ):
        simulate_many(model, 0.1, p={"m": [1.0, 2.0]}, executor=dying, backend="vm")
    assert error.value.partial.status is Status.INTERRUPTED
    assert np.isnan(error.value.partial["x"]).all()


def test_executor_of_dask_gives_the_same() -> None:
    distributed = pytest.importorskip("distributed", reason="extra: pip install symfric[cluster]")
    model, x0 = rabinowicz(LuGre()), {"v": VELOCITIES}
    serial = simulate_many(model, 2.0, x0=x0, executor="serial", chunk=2)
    with (
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, dashboard_address=None
        ) as cluster,
        distributed.Client(cluster) as client,
        client.get_executor() as executor,
    ):
        other = simulate_many(model, 2.0, x0=x0, executor=executor, chunk=2, workers=2)
    assert_same(serial, other)


@each_engine
@pytest.mark.parametrize("executor", ["serial", "threads", "processes"])
def test_failed_member_is_named_and_the_others_are_not_lost(executor: str, backend: str) -> None:
    p = np.array([0.1, 2.0, 0.5, 4.0, 0.0])
    many = simulate_many(
        explosive(), 1.0, p={"p": p}, t_eval=[0.1, 1.0], executor=executor, backend=backend, chunk=2
    )
    assert list(many.failed) == [1, 3]
    assert many.status is Status.SUCCESS
    assert many["x"][:, 0] == pytest.approx(1 / (1 - 0.1 * p), rel=1e-5)
    fine = [0, 2, 4]
    assert many["x"][fine, 1] == pytest.approx(1 / (1 - p[fine]), rel=1e-5)
    assert np.isnan(many["x"][[1, 3], 1]).all()
    assert many.reached == pytest.approx([1.0, 0.5, 1.0, 0.25, 1.0], rel=1e-5)
    assert many.failed[1].startswith(Status.STEP_TOO_SMALL.value)
    assert "Stopped at t = 0.5 s" in many.failed[1]


@each_engine
def test_member_that_uses_up_its_steps_is_named(backend: str) -> None:
    """An oscillator of 1e4 rad/s among slow ones."""
    many = simulate_many(
        oscillator(), 1.0, p={"k": [1.0, 1e8, 4.0]}, max_steps=1000, backend=backend
    )
    assert list(many.failed) == [1]
    assert many.failed[1].startswith(Status.MAX_STEPS.value)
    assert many.attempts[1] == pytest.approx(1000, abs=31)  # the virtual machine counts in batches
    assert 0 < many.reached[1] < 1


@each_engine
def test_member_without_a_consistent_start_is_named(backend: str) -> None:
    """z^2 = x has no solution for x < 0."""
    x, z = Variable("x", "m", start=1.0), Variable("z", "m", start=1.0)
    model = Model("root", x=(x,), z=(z,), ode=ca.SX(0.0), alg=z.symbol**2 - x.symbol)
    many = simulate_many(model, 1.0, x0={"x": [4.0, -1.0, 9.0]}, backend=backend)
    assert list(many.failed) == [1]
    assert "found no solution of the algebraic equations for z" in many.failed[1]
    assert many["z"][[0, 2], 0] == pytest.approx([2.0, 3.0])
    assert np.isnan(many["z"][1, 0])
    assert many.attempts[1] == 0


def test_progress_rises_to_one() -> None:
    told: list[float] = []
    simulate_many(
        oscillator(), 1.0, x0={"x": np.ones(10)}, chunk=3, executor="serial", progress=told.append
    )
    assert told == pytest.approx([0.3, 0.6, 0.9, 1.0])


@pytest.mark.parametrize("executor", ["serial", "threads", "processes"])
def test_interrupt_keeps_what_is_finished(executor: str) -> None:
    many = simulate_many(
        oscillator(), 1.0, x0={"x": np.ones(60)}, chunk=2, executor=executor, progress=after(3)
    )
    assert many.status is Status.INTERRUPTED
    finished = np.isfinite(many["x"][:, 0])
    assert 6 <= finished.sum() < 60
    np.testing.assert_array_equal(finished, np.isfinite(many.reached))
    np.testing.assert_array_equal(finished, many.attempts > 0)
    assert not many.failed


def bouncing(terminal: bool) -> Model:
    """A ball under gravity that returns half of its speed, or stays down."""
    h, v = Variable("h", "m", start=1.0), Variable("v", "m/s", start=0.0)
    ground = Event(
        "ground",
        h.symbol,
        direction=-1,
        terminal=terminal,
        reset={} if terminal else {"v": -v.symbol / 2},
    )
    return Model("ball", x=(h, v), ode=ca.vertcat(v.symbol, -9.81), events=(ground,))


@each_engine
@pytest.mark.parametrize("executor", ["serial", "threads", "processes"])
def test_models_with_events_run_one_by_one(executor: str, backend: str) -> None:
    model, times, x0 = bouncing(terminal=False), [0.0, 0.4, 0.7], {"h": [0.3, 1.0, 5.0]}
    many = simulate_many(
        model, 0.7, x0=x0, t_eval=times, executor=executor, backend=backend, chunk=2
    )
    for m, h in enumerate([0.3, 1.0, 5.0]):
        assert_member(many, m, model, 0.7, x0={"h": h}, backend=backend)


def test_terminal_event_ends_a_member_at_its_time() -> None:
    heights, times = np.array([0.2, 1.0, 50.0]), np.array([0.1, 0.3, 0.6])
    many = simulate_many(bouncing(terminal=True), 1.0, x0={"h": heights}, t_eval=times)
    assert not many.failed
    falls = np.sqrt(2 * heights / 9.81)
    assert many.reached == pytest.approx(np.minimum(falls, 1.0), rel=1e-8)
    np.testing.assert_array_equal(np.isfinite(many["h"]), times <= falls[:, None])


def test_event_storm_of_one_member_is_named() -> None:
    """The Zeno time of the first ball is 3 sqrt(2 h/g)."""
    many = simulate_many(bouncing(terminal=False), 1.0, x0={"h": [0.1, 1.0]})
    assert list(many.failed) == [0]
    assert many.failed[0].startswith(Status.EVENT_STORM.value)
    assert many.reached[0] == pytest.approx(3 * np.sqrt(0.2 / 9.81), rel=1e-3)


def test_results_of_models_with_events_are_resumed_and_told_apart(tmp_path: Path) -> None:
    def reached(model: Model) -> Any:
        return simulate_many(model, 0.4, x0={"h": [0.2, 1.0]}, out=tmp_path).reached

    falls = np.sqrt(0.4 / 9.81)
    for _ in range(2):
        assert reached(bouncing(terminal=True)) == pytest.approx([falls, 0.4])
        assert reached(bouncing(terminal=False)) == pytest.approx([0.4, 0.4])
    assert len(list(tmp_path.iterdir())) == 2


def test_without_a_compiler_the_virtual_machine_takes_over(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    expected = simulate_many(oscillator(), 1.0, backend="vm")
    monkeypatch.setattr(chunk_module, "find_compiler", lambda: None)
    assert_same(simulate_many(oscillator(), 1.0), expected)


def test_with_a_broken_compiler_too(monkeypatch: pytest.MonkeyPatch) -> None:
    model = oscillator()
    expected = simulate_many(model, 1.0, backend="vm")

    def broken(code: str, signals: int) -> None:
        raise CompileError("broken")

    monkeypatch.setattr(program_module, "_compiled", broken)
    assert_same(simulate_many(model, 1.0), expected)
    with pytest.raises(CompileError, match="broken"):
        simulate_many(model, 1.0, backend="compiled")


def test_loose_tolerance_warns() -> None:
    with pytest.warns(UserWarning, match="simulate_many: rtol = 0.001 is above 1e-05"):
        simulate_many(oscillator(), 1.0, rtol=1e-3)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"x0": {"w": [1.0]}}, "model 'oscillator' x0: expected one of x, v, got w"),
        (
            {"p": {"kk": [1.0]}},
            "model 'oscillator' p: expected one of k, c, got kk; did you mean k",
        ),
        (
            {"x0": {"x": np.ones(2)}, "p": {"k": np.ones(3)}},
            r"arrays of one length, got x0\.x of shape \(2,\), p\.k of shape \(3,\)",
        ),
        ({"x0": {"x": np.ones((2, 2))}}, r"of one length, got x0\.x of shape \(2, 2\)"),
        ({"x0": {"x": []}}, "expected at least one member, got empty arrays"),
        (
            {"x0": {"x": [1.0, np.nan]}, "p": {"k": np.inf}},
            r"simulate_many: x0\.x: expected finite numbers, got nan at 1",
        ),
        (
            {"u": {"u": np.ones(2)}, "x0": {"x": np.ones(3)}},
            r"of one length, got .*u\.u of shape \(2",
        ),
        (
            {"u": {"u": Hold([0.0, 0.5], np.ones((2, 2)))}, "t_end": [1.0, 1.0, 2.0]},
            r"one length, got u\.u of shape \(2, 2\), t_end of shape \(3,\)",
        ),
        ({"u": {"u": np.ones((2, 2))}}, r"simulate_many: u\.u: expected a sequence of numbers"),
        ({"u": {"u": []}}, "expected at least one member, got empty arrays"),
        ({"t_end": []}, "expected at least one member, got empty arrays"),
        ({"t_end": [1.0, 0.0]}, r"expected t_end > t_start = 0 s, got 0 s for member 1"),
        ({"t_end": [1.0, np.nan]}, r"simulate_many: t_end: expected finite numbers, got nan at 1"),
        ({"t_end": "end"}, "simulate_many: t_end: expected"),
        ({"t_end": -1.0}, "simulate_many: expected t_end > t_start = 0 s, got -1 s"),
        ({"rtol": 1.0}, "simulate_many: rtol: expected 1e-13 <= number <= 0.1, got 1"),
        ({"t_eval": [0.5, 0.2]}, r"t_eval: expected increasing times in \[0, 1\] s"),
        ({"t_eval": [2.0]}, r"t_eval: expected increasing times in \[0, 1\] s"),
        ({"method": "euler"}, "simulate_many: method: expected one of .*, got euler"),
        ({"backend": "gpu"}, "backend: expected one of auto, vm, compiled, cuda, got gpu"),
        ({"executor": "mpi"}, "executor: expected one of serial, threads, processes, got mpi"),
        ({"chunk": 0}, "simulate_many: chunk: expected a whole number >= 1, got 0"),
        ({"workers": 0}, "simulate_many: workers: expected a whole number >= 1, got 0"),
    ],
)
def test_bad_input_is_refused_saying_where(arguments: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        simulate_many(**({"model": oscillator(), "t_end": 1.0} | arguments))


def test_unknown_signal_is_refused() -> None:
    with pytest.raises(ValueError, match="ensemble of 'oscillator': expected one of x, v, u, ener"):
        _ = simulate_many(oscillator(), 1.0)["force"]
