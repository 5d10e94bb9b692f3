"""Caches of integrators: nothing is computed twice, and all die with their model.

Dense output, values at the times of the result, and the steps that a run keeps.
"""

import copy
import gc
import weakref
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import casadi as ca
import numpy as np
import pytest
from backends import each_backend, made

import symfric as sf
import symfric.integrator.running.integrator as module
import symfric.integrator.running.run as of_run
from symfric import BrownMcPhee, Model, Variable, Viscous, drive, simulate
from symfric.foundation.numeric import Array
from symfric.integrator.compiled.columns import Columns
from symfric.integrator.equations.initial import consistent
from symfric.integrator.equations.inputs import input_data
from symfric.integrator.methods.tableaux import METHODS
from symfric.integrator.running.integrator import REMEMBERED, Integrator, built
from symfric.integrator.running.record import RunRecord, hermite
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


def test_a_run_builds_only_the_functions_that_it_needs() -> None:
    model = cart()
    simulate(model, 0.1, backend="vm", samples=2)
    (integrator,) = model.memory["integrators"].values()
    assert not {"f", "resets", "_event_functions", "signals"} & vars(integrator).keys()


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


def cubic(t: Array) -> Array:
    return np.stack([1 + t - 2 * t**2 + t**3, 4 - t**3])


def cubic_slope(t: Array) -> Array:
    return np.stack([1 - 4 * t + 3 * t**2, -3 * t**2])


def test_hermite_interpolation_reproduces_cubics() -> None:
    t = np.array([0.0, 0.3, 1.0, 1.1, 2.5])
    fine = np.linspace(0, 2.5, 77)
    assert hermite(t, cubic(t), cubic_slope(t))(fine) == pytest.approx(cubic(fine), abs=1e-13)


@pytest.mark.parametrize("method", ["rodas5p", "rodas4p", "rodas3"])
def test_dense_output_is_as_accurate_as_the_steps(method: str) -> None:
    model = sf.rabinowicz(sf.LuGre())
    run = sf.simulate(model, 8.0, method=method, rtol=1e-6)
    reference = sf.simulate(model, 8.0, rtol=1e-11)
    at_steps = np.abs(run.at(run.step_times)["x"] - reference.at(run.step_times)["x"]).max()
    between = np.abs(run["x"] - reference["x"]).max()
    assert between < 3 * at_steps + 1e-6


TIMES = [0.0, 0.1, 0.3, 0.30001, 0.4, 0.9, 1.7, 2.0]
"""Some of them at jumps of the inputs."""
FORCE = sf.Hold([0.0, 0.3, 0.4, 0.9], [0.0, 15.0, -15.0, 20.0])
RAMP = sf.Linear([0.0, 0.3, 0.9], [0.0, 15.0, -25.0])
LAW = sf.BrownMcPhee(mu_s=0.12, mu_d=0.1, v_t=0.01)

Case = tuple[Callable[[], sf.Model], dict[str, Any]]
CASES: dict[str, Case] = {
    "one interval": (lambda: sf.rabinowicz(sf.BrownMcPhee()), {}),
    "held": (lambda: sf.drive(sf.LuGre()), {"u": {"force": FORCE}}),
    "sampled": (lambda: sf.drive(sf.BrownMcPhee()), {"u": {"force": RAMP}, "times": [0.1, 1.5]}),
    "events": (lambda: sf.drive(sf.ExactCoulomb()), {"u": {"force": lambda t: 12 * ca.sin(9 * t)}}),
    "held events": (lambda: sf.drive(sf.ExactCoulomb()), {"u": {"force": FORCE}}),
    "algebraic": (lambda: PendulumBox(LAW).model(), {}),
    "few steps": (lambda: sf.rabinowicz(sf.LuGre()), {"max_steps": 70, "throw": False}),
}


def run_of(case: str, backend: str, **further: Any) -> sf.Trajectory:
    make, arguments = CASES[case]
    return sf.simulate(made(make), 2.0, t_eval=TIMES, backend=backend, **(arguments | further))


@each_backend
@pytest.mark.parametrize("case", CASES)
def test_outputs_are_the_dense_output_whether_or_not_steps_are_kept(
    case: str, backend: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """`at` evaluates the records of accepted steps in NumPy; a long run is run again for it."""
    whole, kept, keep = run_of(case, backend), list[int](), RunRecord.keep
    assert whole.t.tolist() == [time for time in TIMES if time <= whole.step_times[-1]]
    assert whole.t.size > 1

    def counted(self: RunRecord, piece: Any) -> None:
        keep(self, piece)
        kept.append(sum(map(len, self.kept)))

    monkeypatch.setattr(RunRecord, "keep", counted)
    monkeypatch.setattr(of_run, "MOST_BYTES", 200)
    bounded = run_of(case, backend)
    assert bounded.statistics.smallest_step == whole.statistics.smallest_step
    assert bounded.final == whole.final
    once, again = len(kept), whole.at(whole.t)
    for name in whole.units:
        assert bounded[name].tobytes() == whole[name].tobytes() == again[name].tobytes(), name
    assert len(kept) == once
    at = np.linspace(0.0, whole.step_times[-1], 57)
    for name, values in whole.at(at).items():
        assert bounded.at(at)[name].tobytes() == values.tobytes(), name
    assert len(kept) > once  # run again for what lies between, and no steps kept for that either
    assert max(kept) == 1
    assert bounded.step_times.tobytes() == whole.step_times.tobytes()


def test_tiny_motions_are_found_without_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    """The size of a motion is known when its steps are not kept."""
    model, start = sf.drive(sf.LuGre()), {"v": 1e-7}
    whole = sf.simulate(model, 0.1, x0=start, samples=11)
    monkeypatch.setattr(of_run, "MOST_BYTES", 2000)
    bounded = sf.simulate(model, 0.1, x0=start, samples=11)
    assert bounded["v"].tobytes() == whole["v"].tobytes()
    assert bounded.statistics.steps == whole.statistics.steps


@each_backend
def test_a_callback_may_run_another_simulation(backend: str) -> None:
    """Buffers belong to one run at a time."""
    model = sf.rabinowicz(sf.LuGre())

    def positions(x: float, progress: Callable[[float], None] | None = None) -> Array:
        return sf.simulate(
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
