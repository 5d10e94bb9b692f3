"""Benchmarks of short calls, events, gradients, signals and import.

Times are processor times of whole calls from Python, the shortest of several rounds in which all
contenders take turns. Ratios are relative to the first method of each task, which is symfric.
"""

import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from math import nan
from typing import Any, NamedTuple, final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.bench import table
from symfric.bench.contenders import buffered, compiled, tolerances
from symfric.bench.table import interleaved, unwarned
from symfric.foundation.programs import find_compiler
from symfric.integrator.by_peer import peer
from symfric.integrator.compiled.background import wait
from symfric.integrator.equations.inputs import Hold, input_data
from symfric.integrator.equations.system import system
from symfric.integrator.simulate import simulate
from symfric.integrator.stepper import stepper
from symfric.laws import GMS, BrownMcPhee, Law, LuGre, MaxwellSlip
from symfric.laws.dynamic.maxwell_slip import Element
from symfric.model import Model
from symfric.results.trajectory import Trajectory
from symfric.scenes import Arm, Drive, FourBar, Rabinowicz

Array = NDArray[np.float64]
Calls = dict[str, Callable[[], object]]
SEED, RTOL = 10, 1e-6
TORQUES = (30.0, 30.0, 15.0, 2.0, 1.0, 0.2)
"""Largest torques [N m] of the joints of the arm, from the base on."""
FREE = ("mu_s", "mu_d", "k", "v_belt")


class CallRow(NamedTuple):
    """Cost of one method for a task.

    Attributes:
        task: task and scene.
        who: method.
        time_us: shortest processor time per unit [us].
        per: unit: step, run, call or import.
        error: relative error of the result, NaN if it has none.
        ratio: time relative to the first method of the task.
    """

    task: str
    who: str
    time_us: float
    per: str
    error: float
    ratio: float


@final
@dataclass(frozen=True, eq=False)
class CallBenchmark(table.Report):
    """Results of the benchmark of short calls."""

    rows: tuple[CallRow, ...]

    def to_dict(self) -> dict[str, Any]:
        """Return the rows as plain data, without errors that are NaN."""
        rows = table.plain(self.rows)
        return {"rows": [{k: v for k, v in row.items() if v is not None} for row in rows]}

    def shown(self) -> Iterator[table.Table | str]:
        """Yield the table of tasks and methods."""
        yield table.of(
            "Processor time of short tasks", self.rows,
            {"task": "task", "method": "who", "time [us]": table.shortened("time_us"),
             "per": "per", "relative error": table.shortened("error"),
             "ratio to the first": table.rounded("ratio", 2)},
        )  # fmt: skip


def bench_calls(*, quick: bool = False, progress: table.Progress = None) -> CallBenchmark:
    """Measure all tasks on this machine.

    Args:
        quick: fewer steps, elements, points and rounds; for tests.
        progress: called with the current item and the fraction done.
    """
    tasks = (_drive, _arm, _events, _gradient, _signals, _imports)
    rows: list[CallRow] = []
    for task in table.each(tasks, progress, lambda task: task.__name__.strip("_")):
        with unwarned():
            rows += task(quick)
    return CallBenchmark(tuple(rows))


def _rows(
    task: str, per: str, calls: Calls, errors: dict[str, float], count: int, rounds: int
) -> Iterator[CallRow]:
    best = interleaved(calls, rounds)
    first = next(iter(best.values()))
    for who, time in best.items():
        yield CallRow(task, who, 1e6 * time / count, per, errors[who], time / first)


# ---- many short steps with different inputs ----


def _drive(quick: bool) -> Iterator[CallRow]:
    """Measure a belt drive in steps of 5 ms."""
    model, count = Drive(LuGre()).model(), 50 if quick else 1000
    forces = np.random.default_rng(SEED).uniform(-15.0, 15.0, (count, 1))
    yield from _stepped("drive, steps of 5 ms", model, 5e-3, forces, 2 if quick else 5)


def _arm(quick: bool) -> Iterator[CallRow]:
    """Measure an arm of six joints under torques held for 1 ms: smooth ones, and noise."""
    model, count = Arm(BrownMcPhee()).model(), 20 if quick else 1000
    t = 1e-3 * np.arange(count)
    smooth = np.sin(2 * np.pi * np.outer(t, np.linspace(1.0, 4.0, 6))) * TORQUES
    noise = np.random.default_rng(SEED).uniform(-1.0, 1.0, (count, 6)) * TORQUES
    rounds = 1 if quick else 3
    yield from _stepped("arm, 1 kHz, sines", model, 1e-3, smooth, rounds)
    yield from _stepped("arm, 1 kHz, noise", model, 1e-3, noise, rounds)


def _stepped(task: str, model: Model, dt: float, u: Array, rounds: int) -> Iterator[CallRow]:
    """Measure the steps of a model; `u` has one row per step and one column per input."""
    names = [v.name for v in model.u]
    hold = {n: Hold(dt * np.arange(len(u)), u[:, i]) for i, n in enumerate(names)}

    def at_once(rtol: float = RTOL) -> Array:
        run = simulate(model, dt * len(u), u=hold, rtol=rtol, samples=2, backend=_backend())
        return np.array([run[v.name][-1] for v in model.x])

    plant = stepper(model, dt, rtol=RTOL, backend=_backend())

    def step_by_step() -> Array:
        plant.reset()
        for row in u:
            plant.step(row)
        return plant.x.copy()

    methods: dict[str, Callable[[], Array]] = {
        "stepper": step_by_step, "one simulate, Hold": at_once,
        "casadi rosenbrock": _stepping_peer(model, dt, u),
    }  # fmt: skip
    exact = at_once(1e-10)
    scale = np.array([v.nominal for v in model.x])
    scale = np.maximum(scale, np.abs(exact))
    errors = {who: float(np.max(np.abs(run() - exact) / scale)) for who, run in methods.items()}
    yield from _rows(task, "step", dict(methods), errors, len(u), rounds)


def _stepping_peer(model: Model, dt: float, u: Array) -> Callable[[], Array]:
    """Return the steps of CasADi's `rosenbrock`, compiled if possible and called by its buffer."""
    inputs = input_data(model, {v.name: Hold([0.0, dt], [0.0, 1.0]) for v in model.u}, 0.0, dt)
    whole = system(model, inputs)
    problem = peer(whole, inputs, np.zeros(0), tolerances(whole, RTOL), "rosenbrock")
    solver = ca.integrator("stepping", "rosenbrock", problem.dae, 0.0, dt, problem.options)
    function = compiled(solver)[0] if find_compiler() else solver
    x, z, data = (
        ca.MX.sym("x", whole.nx),
        ca.MX.sym("z", solver.numel_in("z0")),
        ca.MX.sym("u", u.shape[1]),
    )
    ends = function(x0=x, z0=z, u=data)
    whole_call = ca.Function("step", [ca.vertcat(x, z, data)], [ca.vertcat(ends["xf"], ends["zf"])])
    given, call, found = buffered(whole_call)
    start = model.initial_state() / whole.nominal

    def solve() -> Array:
        given[:] = 0.0
        given[: start.size] = start
        for row in u:
            given[found.size :] = row
            call()
            given[: found.size] = found
        return found[: start.size] * whole.nominal

    return solve


# ---- events ----


def _events(quick: bool) -> Iterator[CallRow]:
    """Measure exact Maxwell-slip elements with events, and their smooth form."""
    elements = 4 if quick else 30
    pairs: dict[str, Callable[[str], Law]] = {
        f"rabinowicz gms, {elements} elements": partial(_gms, elements),
        "rabinowicz maxwell_slip, 4 elements": lambda form: MaxwellSlip(form=form),
    }
    for task, law in pairs.items():
        models = {form: Rabinowicz(law(form)).model() for form in ("smooth", "event")}

        def run(form: str, of: dict[str, Model] = models) -> Trajectory:
            return simulate(of[form], 20.0, rtol=RTOL, samples=401, backend=_backend())

        calls: Calls = {form: partial(run, form) for form in models}
        yield from _rows(task, "run", calls, dict.fromkeys(calls, nan), 1, 1 if quick else 3)


def _gms(count: int, form: str) -> Law:
    """Return elements of equal shares and different stiffnesses, 1e5 N/m in total."""
    weights = np.linspace(5.0, 1.0, count)
    stiffness = 1e5 * weights / weights.sum()
    return GMS(elements=tuple(Element(float(k), 1.0 / count) for k in stiffness), form=form)


# ---- gradients ----


def _gradient(quick: bool) -> Iterator[CallRow]:
    """Measure the gradient of the mean square position at 401 times by four parameters.

    Errors are relative to the sum of the magnitudes of the terms.
    """
    model, times = Rabinowicz(BrownMcPhee()).model(free=FREE), np.linspace(0.0, 20.0, 401)

    def run(rtol: float = RTOL, sensitivities: tuple[str, ...] = FREE) -> Trajectory:
        return simulate(
            model, 20.0, rtol=rtol, t_eval=times, sensitivities=sensitivities, backend=_backend(),
            method="radau5",
        )  # fmt: skip

    def slopes(rtol: float = RTOL) -> Array:
        found = run(rtol).sensitivities
        return np.array([found[name]["x"] for name in FREE])

    weights = run(1e-11)["x"]

    def adjoint() -> Array:
        return np.array(list(run().gradient({"x": weights}).values()))

    exact = slopes(1e-11)
    scale = np.abs(exact) @ np.abs(weights)
    methods: dict[str, Callable[[], Array]] = {
        "run": lambda: run(sensitivities=())["x"],
        "forward": lambda: slopes() @ weights,
        "adjoint": adjoint,
    }
    errors = {"run": nan} | {
        who: float(np.max(np.abs(methods[who]() - exact @ weights) / scale))
        for who in ("forward", "adjoint")
    }
    yield from _rows("gradient, 4 parameters", "run", dict(methods), errors, 1, 2 if quick else 20)


# ---- signals ----

OFTEN = 60
"""Number of calls after which signals are compiled in the background."""


def _signals(quick: bool) -> Iterator[CallRow]:
    """Measure all signals of a mechanism at 2001 times."""
    for name, scene in {"four_bar": FourBar(BrownMcPhee()), "arm": Arm(BrownMcPhee())}.items():
        runs = {
            backend: simulate(scene.model(), 0.1, samples=51 if quick else 2001, backend=backend)
            for backend in dict.fromkeys((_backend(), "vm"))
        }
        calls: Calls = {who: partial(run.at, run.t) for who, run in runs.items()}
        for call in calls.values():
            for _ in range(1 if quick else OFTEN):
                call()
        wait()
        yield from _rows(
            f"signals of {name}", "call", calls, dict.fromkeys(calls, nan), 1, 1 if quick else 3
        )


# ---- import ----


def _imports(quick: bool) -> Iterator[CallRow]:
    """Measure imports of the package, of a first simulation and of CasADi in a new interpreter."""
    texts = {
        "import symfric": "import symfric",
        "from symfric import simulate, ...": "from symfric import LuGre, rabinowicz, simulate",
        "import casadi": "import casadi",
    }
    best = dict.fromkeys(texts, np.inf)
    for _ in range(1 if quick else 7):
        for who, text in texts.items():
            best[who] = min(best[who], _spent_by(text))
    for who, time in best.items():
        yield CallRow("import", who, 1e6 * time, "import", nan, time / best["import symfric"])


def _spent_by(text: str) -> float:
    """Return the processor time [s] of an import in a new interpreter."""
    code = f"from time import process_time as now; t = now(); {text}; print(now() - t)"
    done = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    return float(done.stdout)


def _backend() -> str:
    return "compiled" if find_compiler() else "vm"
