"""Ensembles: members equal runs of `simulate`, on every executor; failures are reported."""

import os
import re
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from functools import cache
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest
from backends import made
from device_cases import CASES, VELOCITIES
from differentiable import oscillator, pendulum, switched
from ensembles import Inline, after, assert_same, explosive, with_functions_of_libm

import symfric as sf
from symfric.foundation.programs import CompileError
from symfric.integrator import ensemble as module
from symfric.integrator.many import chunk as chunk_module
from symfric.integrator.many import members as program_module
from symfric.model import Event

each_engine = pytest.mark.parametrize("backend", ["vm", "compiled"])


@cache
def of_libm(case: str) -> sf.Model:
    """The model of a case, whose compiled members have the functions of libm."""
    return CASES[case][0]()


def alone_as(many: sf.Ensemble, m: int, model: sf.Model, t_end: Any, **given: Any) -> None:
    """Member m has signals and attempts of a simulation of its own, up to last digits."""
    end = float(np.broadcast_to(t_end, (len(many),))[m])

    def own(value: Any) -> Any:
        if isinstance(value, sf.Hold | sf.Linear):
            return type(value)(value.t, value.values[m]) if np.ndim(value.values) > 1 else value
        return value if callable(value) or np.ndim(value) == 0 else value[m]

    for group in {"x0", "u", "p"} & given.keys():
        given[group] = {name: own(value) for name, value in given[group].items()}
    times = np.asarray(given.pop("t_eval", [end]))
    inside = times[times <= end]
    alone = sf.simulate(model, end, t_eval=inside, throw=False, **given)
    assert alone.status.ok is (m not in many.failed)
    for name in model.signals:
        found, expected = many[name][m], alone[name]
        scale = np.abs(expected).max(initial=0.0) + 1e-9
        assert found[: expected.size] == pytest.approx(expected, rel=0.0, abs=1e-7 * scale), name
        assert np.isnan(found[expected.size :]).all()
    assert many.attempts[m] == alone.statistics.steps + alone.statistics.rejections
    assert many.reached[m] == (end if alone.status.ok else pytest.approx(alone.step_times[-1]))


@each_engine
@pytest.mark.parametrize("case", CASES)
def test_members_are_those_of_simulate(
    case: str, backend: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With the functions of libm: see `test_functions_of_lanes_change_no_member` for others."""
    with_functions_of_libm(monkeypatch)
    (_, t_end, given), model = CASES[case], of_libm(case)
    many = sf.simulate_many(model, t_end, backend=backend, chunk=3, **given)
    assert (many.scene, many.units, many.status) == (model.name, model.signals, sf.Status.SUCCESS)
    none = {m for m, why in many.failed.items() if "loops can be closed" in why}
    if "too many" in case:
        assert (list(many.failed), many.attempts[1]) == ([1], 1000)
        assert many.failed[1].startswith(sf.Status.MAX_STEPS.value)
    for m in {0, len(many) // 2, len(many) - 1} - none:
        if "jams" not in case:
            alone_as(many, m, model, t_end, backend=backend, **given)


@pytest.mark.parametrize(
    "law", [sf.LuGre(), pytest.param(sf.BrownMcPhee(), marks=pytest.mark.slow)]
)
def test_functions_of_lanes_change_no_member(law: Any) -> None:
    """Their last digits differ from libm's; steps follow them within the tolerance."""
    model, given = sf.rabinowicz(law), {"x0": {"v": VELOCITIES}, "t_eval": [2.71, 9.0]}
    many, plain = (sf.simulate_many(model, 9.0, backend=b, **given) for b in ("compiled", "vm"))
    exact = sf.simulate_many(model, 9.0, backend="vm", rtol=1e-10, **given)
    error, of_vm = (np.abs(found["x"] - exact["x"]).max() for found in (many, plain))
    assert error < max(3 * of_vm, 1e-6)
    assert many.attempts == pytest.approx(plain.attempts, rel=0.05)


def kicked() -> sf.Model:
    """x' = u - x, which starts again from 1 at x = 3/2."""
    x, u = sf.Variable("x", "m", start=1.0), sf.Variable("u", "m/s", start=0.0)
    again = Event("again", x.symbol - 1.5, reset={"x": 1.0})
    return sf.Model("kicked", x=(x,), u=(u,), ode=u.symbol - x.symbol, events=(again,))


def cubic() -> sf.Model:
    """z^3 + z/100 = u: after a large jump of u only a damped search finds z."""
    x, z, u = (
        sf.Variable("x", "m"),
        sf.Variable("z", "m/s", start=1.0),
        sf.Variable("u", "m/s", start=1.0),
    )
    alg = z.symbol**3 + 0.01 * z.symbol - u.symbol
    return sf.Model("cubic", x=(x,), z=(z,), u=(u,), ode=z.symbol, alg=alg)


ROWS = np.array([[1, 1, 1], [2, -1, 3], [0, 0, 0], [1, 2, 3], [-1, 4, 0.5]], dtype=float)
OWN = {
    "numbers": (oscillator, ROWS[:, 0]),
    "held": (oscillator, sf.Hold([0.0, 0.3, 0.7], ROWS)),
    "held, algebraic unknowns follow": (switched, sf.Hold([0.0, 0.3, 0.7], ROWS)),
    "linear, algebraic unknowns follow": (switched, sf.Linear([0.2, 0.3, 0.7], ROWS)),
    "held, some jump far": (cubic, sf.Hold([0.0, 0.3, 0.7], 0.01 + 9.0 * ROWS**2)),
    "linear, events": (kicked, sf.Linear([0.0, 0.3, 0.7], ROWS)),
}


@each_engine
@pytest.mark.parametrize("case", OWN)
def test_members_have_inputs_and_ends_of_their_own(case: str, backend: str) -> None:
    """Some rows do not rise, some members end at a jump, one after a thousandth of the others."""
    (make, u), ends = OWN[case], np.array([1.0, 0.3, 0.95, 0.001, 0.7])
    model, times = made(make), np.array([0.0, 0.1, 0.3, 0.5, 0.7, 0.9, 1.0])  # the jumps among them
    given: dict[str, Any] = {"x0": {"x": 1.25}, "u": {"u": u}, "backend": backend}
    many = sf.simulate_many(model, ends, t_eval=times, chunk=3, **given)
    assert not many.failed
    for m in range(5):
        alone_as(many, m, model, ends, t_eval=times, **given)
    many = sf.simulate_many(model, ends, **given)  # each looked at where it ends
    assert many.t.tolist() == ends[:, None].tolist()
    assert many["x"].shape == (5, 1)
    assert many["x"][1, 0] == pytest.approx(
        sf.simulate_many(model, ends, t_eval=[0.3], **given)["x"][1, 0]
    )


@each_engine
def test_a_search_after_a_jump_does_not_disturb_the_others(
    backend: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """z^3 + z/100 = u: after a large jump of u a damped search finds z, and the run continues."""
    x, z = sf.Variable("x", "m", start=0.0), sf.Variable("z", "m/s", start=0.0)
    u = sf.Variable("u", "m/s", start=0.0)
    alg = z.symbol**3 + 0.01 * z.symbol - u.symbol
    model = sf.Model("cubic", x=(x,), z=(z,), u=(u,), ode=z.symbol, alg=alg)
    rows = np.array([[0.01, 0.01, 0.01], [0.01, 8.0, 1.0], [1.0, 1.1, 1.0], [1.0, 8.0, 1e-3]])
    searched: list[int] = []
    real = chunk_module.consistent_many

    def counted(equations: Any, together: Any, where: str, y: Any, d: Any) -> Any:
        searched.append(y.shape[0])
        return real(equations, together, where, y, d)

    monkeypatch.setattr(chunk_module, "consistent_many", counted)
    many = sf.simulate_many(
        model, 0.9, u={"u": sf.Hold([0.0, 0.3, 0.6], rows)}, t_eval=[0.1, 0.3, 0.5, 0.6, 0.9],
        backend=backend, executor="serial",
    )  # fmt: skip
    assert not many.failed
    if backend == "compiled":
        assert searched[0] == 4
        assert 1 <= sum(searched[1:]) <= 4
    level = rows[:, [0, 1, 1, 2, 2]]
    assert many["z"] ** 3 + 0.01 * many["z"] == pytest.approx(level, rel=1e-6)


def test_mechanisms_are_assembled_together(monkeypatch: pytest.MonkeyPatch) -> None:
    def alone(*arguments: Any) -> Any:
        pytest.fail(f"a member was assembled alone: {arguments[2]}")

    monkeypatch.setattr(chunk_module, "consistent_many", alone)
    given: dict[str, Any] = {"x0": {"x": [0.6, 0.7, 0.65]}, "t_eval": [0.0, 0.5]}
    many = sf.simulate_many(pendulum(), 0.5, backend="compiled", **given)
    assert not many.failed
    for m in range(3):
        alone_as(many, m, pendulum(), 0.5, **given)


def test_time_may_start_anywhere_and_numbers_are_one_member() -> None:
    x, t = sf.Variable("x", "m", start=0.0), ca.SX.sym("t")
    model = sf.Model("swing", x=(x,), ode=ca.cos(t), t=t)
    many = sf.simulate_many(model, 3.0, t_start=1.0, x0={"x": [0.0, 1.0]}, t_eval=[1.0, 3.0])
    rise = np.sin(3.0) - np.sin(1.0)
    assert many["x"] == pytest.approx(np.array([[0.0, rise], [1.0, 1.0 + rise]]), abs=1e-5)
    many = sf.simulate_many(oscillator(), 1.0, x0={"x": 2.0}, u={"u": 3.0}, p={"k": [4.0]})
    assert many["x"].shape == (1, 1)
    assert many.t == pytest.approx([1.0])
    assert (many.fixed, list(many.varied)) == ({"x0.x": 2.0, "u.u": 3.0}, ["k"])


def bouncing(terminal: bool) -> sf.Model:
    """A ball under gravity that returns half of its speed, or stays down."""
    h, v = sf.Variable("h", "m", start=1.0), sf.Variable("v", "m/s", start=0.0)
    reset = {} if terminal else {"v": -v.symbol / 2}
    ground = Event("ground", h.symbol, direction=-1, terminal=terminal, reset=reset)
    return sf.Model("ball", x=(h, v), ode=ca.vertcat(v.symbol, -9.81), events=(ground,))


EXECUTORS: dict[str, Any] = {
    "threads": lambda: "threads", "processes": lambda: "processes",
    "threads of the user": lambda: ThreadPoolExecutor(2), "executor of the user": Inline,
}  # fmt: skip
SHARED: dict[str, tuple[Any, float, dict[str, Any]]] = {
    "fails": (explosive, 1.0, {"p": {"p": [0.1, 2.0, 0.5, 4.0, 0.0]}, "t_eval": [0.1, 1.0]}),
    "mechanism": (pendulum, 1.0, CASES["mechanism, one not to be assembled"][2]),
    "events": (
        lambda: sf.drive(sf.ExactCoulomb()), 2.0,
        {"t_eval": [1.0, 2.0],
         "u": {"force": sf.Linear([0.0, 1.0, 2.0], np.outer([1.0, 2.0, 3.0], [0.0, 9.0, -9.0]))}},
    ),
    "bounces": (
        lambda: bouncing(terminal=False), 0.7,
        {"x0": {"h": [0.3, 1.0, 5.0]}, "t_eval": [0.0, 0.4, 0.7]},
    ),
}  # fmt: skip


@each_engine
@pytest.mark.parametrize("case", SHARED)
def test_every_executor_gives_the_same(case: str, backend: str) -> None:
    make, t_end, given = SHARED[case]
    model, common = made(make), {**given, "backend": backend, "chunk": 2}
    serial = sf.simulate_many(model, t_end, executor="serial", **common)
    every = backend == "compiled" and case in ("fails", "events")
    kinds = EXECUTORS if every else ("threads", "executor of the user")
    for kind in kinds:
        other = sf.simulate_many(model, t_end, executor=EXECUTORS[kind](), workers=2, **common)
        assert_same(serial, other)
    if case == "fails":
        p, fine = np.array(given["p"]["p"]), [0, 2, 4]
        assert (list(serial.failed), serial.status) == ([1, 3], sf.Status.SUCCESS)
        assert serial["x"][:, 0] == pytest.approx(1 / (1 - 0.1 * p), rel=1e-5)
        assert serial["x"][fine, 1] == pytest.approx(1 / (1 - p[fine]), rel=1e-5)
        assert np.isnan(serial["x"][[1, 3], 1]).all()
        assert serial.reached == pytest.approx([1.0, 0.5, 1.0, 0.25, 1.0], rel=1e-5)
        together = f"{sf.Status.STEP_TOO_SMALL.value} Stopped at t = 0.5 s; run it with simulate"
        reasons = {"vm": "stopped at t = 0.5000.* grows without bound", "compiled": together}
        assert re.search(reasons[backend], serial.failed[1])
    elif case == "mechanism":
        assert list(serial.failed) == [2]
        assert "from which all loops can be closed" in serial.failed[2]
    else:
        for m in range(3):
            alone_as(serial, m, model, t_end, backend=backend, **given)


def test_a_dead_worker_leaves_the_finished_members() -> None:
    model = sf.rabinowicz(sf.BrownMcPhee(), free=["m"])
    with (
        ProcessPoolExecutor(1, initializer=os._exit, initargs=(1,)) as dying,  # pyright: ignore
        pytest.raises(sf.SolveError, match=r"after 0 of 2 members .*out=FOLDER keeps") as error,
    ):
        sf.simulate_many(model, 0.1, p={"m": [1.0, 2.0]}, executor=dying, backend="vm")
    assert error.value.partial.status is sf.Status.INTERRUPTED
    assert np.isnan(error.value.partial["x"]).all()


@each_engine
def test_failed_members_are_named(backend: str) -> None:
    """z^2 = x without a solution for x < 0; x' = NaN for x < 0."""
    x, z = sf.Variable("x", "m", start=1.0), sf.Variable("z", "m", start=1.0)
    for events in ((), (Event("end", x.symbol - 16.0),)):
        alg = z.symbol**2 - x.symbol
        model = sf.Model("root", x=(x,), z=(z,), ode=ca.SX(0.0), alg=alg, events=events)
        many = sf.simulate_many(model, 1.0, x0={"x": [4.0, -1.0, 9.0]}, backend=backend)
        assert list(many.failed) == [1]
        assert "found no solution of the algebraic equations for z" in many.failed[1]
        assert many["z"][[0, 2], 0] == pytest.approx([2.0, 3.0])
        assert np.isnan(many["z"][1, 0])
        assert (many.attempts[1], np.nan_to_num(many.reached[1])) == (0, 0.0)
    outputs = {"none": sf.Output(0.0, "1"), "twice": sf.Output(2 * x.symbol, "m")}
    model = sf.Model("broken", x=(x,), ode=-ca.exp(ca.log(x.symbol)), outputs=outputs)
    many = sf.simulate_many(model, 1.0, x0={"x": [1.0, -1.0]}, t_eval=[0.0, 1.0], backend=backend)
    assert list(many.failed) == [1]
    assert many["x"][:, 0].tolist() == [1.0, -1.0]  # each has its start
    assert np.isnan(many["x"][1, 1])
    assert (many.reached[1], many["none"][0].tolist()) == (0.0, [0.0, 0.0])
    assert many["twice"][0] == pytest.approx([2.0, 2 * np.exp(-1.0)], rel=1e-5)


@pytest.mark.parametrize("executor", ["serial", "threads"])
def test_progress_rises_to_one_and_an_interrupt_keeps_finished_members(executor: str) -> None:
    shares: list[float] = []
    given: dict[str, Any] = {"x0": {"x": np.ones(60)}, "chunk": 2, "executor": executor}
    sf.simulate_many(oscillator(), 1.0, progress=shares.append, **given)
    assert shares == pytest.approx(np.arange(1, 31) / 30)
    many = sf.simulate_many(oscillator(), 1.0, progress=after(3), **given)
    assert many.status is sf.Status.INTERRUPTED
    finished = np.isfinite(many["x"][:, 0])
    assert 6 <= finished.sum() < 60
    np.testing.assert_array_equal(finished, np.isfinite(many.reached))
    np.testing.assert_array_equal(finished, many.attempts > 0)
    assert not many.failed


def test_an_interrupt_of_a_run_ends_the_ensemble(monkeypatch: pytest.MonkeyPatch) -> None:
    """A run with events reports an interrupt by its status."""
    real = chunk_module.integrate

    def pressed(*arguments: Any) -> Any:
        def interrupt(_: float) -> None:
            raise KeyboardInterrupt

        return real(*arguments[:-2], interrupt, arguments[-1])

    monkeypatch.setattr(chunk_module, "integrate", pressed)
    many = sf.simulate_many(kicked(), 1.0, x0={"x": [0.5, 1.0]}, backend="vm", executor="serial")
    assert many.status is sf.Status.INTERRUPTED
    assert np.isnan(many.reached).all()


def test_events_end_members_or_are_too_many(tmp_path: Path) -> None:
    heights, times = np.array([0.2, 1.0, 50.0]), np.array([0.1, 0.3, 0.6])
    many = sf.simulate_many(bouncing(terminal=True), 1.0, x0={"h": heights}, t_eval=times)
    assert not many.failed
    falls = np.sqrt(2 * heights / 9.81)
    assert many.reached == pytest.approx(np.minimum(falls, 1.0), rel=1e-8)
    np.testing.assert_array_equal(np.isfinite(many["h"]), times <= falls[:, None])
    # the Zeno time of the first ball is 3 sqrt(2 h/g)
    many = sf.simulate_many(bouncing(terminal=False), 1.0, x0={"h": [0.1, 1.0]})
    assert list(many.failed) == [0]
    assert many.failed[0].startswith(sf.Status.EVENT_STORM.value)
    assert many.reached[0] == pytest.approx(3 * np.sqrt(0.2 / 9.81), rel=1e-3)
    for _ in range(2):  # the second time from the folder
        for terminal, end in ((True, np.sqrt(0.4 / 9.81)), (False, 0.4)):
            model = bouncing(terminal)
            many = sf.simulate_many(model, 0.4, x0={"h": [0.2, 1.0]}, out=tmp_path)
            assert many.reached == pytest.approx([end, 0.4])
    assert len(list(tmp_path.iterdir())) == 2


def test_without_a_working_compiler_the_virtual_machine_is_used(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    model = oscillator()
    expected = sf.simulate_many(model, 1.0, backend="vm")

    def broken(*_: Any) -> None:
        raise CompileError("broken")

    with monkeypatch.context() as patch:
        patch.setattr(program_module.CompiledMembers, "of", broken)
        assert_same(sf.simulate_many(model, 1.0), expected)
        with pytest.raises(CompileError, match="broken"):
            sf.simulate_many(model, 1.0, backend="compiled")
    monkeypatch.setattr(module, "find_compiler", lambda: None)
    assert_same(sf.simulate_many(model, 1.0), expected)
