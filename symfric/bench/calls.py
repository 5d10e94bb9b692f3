"""Benchmarks of many short calls, of events, and of imports.

Times are processor times of whole calls from Python, the shortest of several rounds in which the
methods alternate. Ratios are relative to the first method of each task, which is symfric.
"""

import sys
from collections.abc import Callable, Iterator
from functools import partial
from math import nan
from subprocess import run
from typing import Any

import casadi as ca
import numpy as np

from symfric import Element, Model, Variable, prepare, simulate, stepper
from symfric.bench.contenders import buffered, compiled, loop, tolerances
from symfric.bench.report import Found, Progress, Report, backend, interleaved, unwarned
from symfric.foundation.numeric import Array
from symfric.foundation.programs import find_compiler
from symfric.integrator.by_peer import peer
from symfric.integrator.equations.inputs import Hold, input_data
from symfric.integrator.equations.system import system
from symfric.laws import GMS, BrownMcPhee, ExactCoulomb, Law, LuGre, MaxwellSlip
from symfric.scenes import Arm, Drive, Rabinowicz, contact

Calls = dict[str, Callable[[], object]]
SEED, RTOL = 10, 1e-6
TORQUES = (30.0, 30.0, 15.0, 2.0, 1.0, 0.2)
"""Largest torques [N m] of the joints of the arm, starting at the base."""
FREE = ("mu_s", "mu_d", "k", "v_belt")
START = {"v": 0.1}
TITLE = "Processor time of short tasks"
KNOWN = "Processor time of calls on a known model"


def bench(quick: bool = False, progress: Progress = None) -> Report:
    """Measure all tasks; with `quick`, use fewer steps, elements, points and rounds."""

    def quietly(task: Callable[[bool], Iterator[Found]]) -> list[Found]:
        with unwarned():
            return list(task(quick))

    tasks = {task.__name__.strip("_"): partial(quietly, task) for task in TASKS}
    return Report().collect(tasks, progress)


def _rows(
    task: str, per: str, times: dict[str, float], errors: dict[str, float] | None = None,
    title: str = TITLE,
) -> Iterator[Found]:  # fmt: skip
    """Yield a row for each method from its time [s] and the relative error of its result."""
    first = next(iter(times.values()))
    for who, time in times.items():
        yield title, {
            "task": task, "method": who, "time [us]": 1e6 * time, "per": per,
            "relative error": (errors or {}).get(who, nan), "ratio to the first": time / first,
        }  # fmt: skip


# ---- many short steps with different inputs ----


def _drive(quick: bool) -> Iterator[Found]:
    """Measure a belt drive in steps of 5 ms."""
    model, count = Drive(LuGre()).model(), 50 if quick else 1000
    forces = np.random.default_rng(SEED).uniform(-15.0, 15.0, (count, 1))
    yield from _stepped("drive, steps of 5 ms", model, 5e-3, forces, 2 if quick else 5)


def _arm(quick: bool) -> Iterator[Found]:
    """Measure an arm of six joints under torques held for 1 ms: smooth torques and noise."""
    model, count = Arm(BrownMcPhee()).model(), 20 if quick else 1000
    t = 1e-3 * np.arange(count)
    torques = {
        "sines": np.sin(2 * np.pi * np.outer(t, np.linspace(1.0, 4.0, 6))),
        "noise": np.random.default_rng(SEED).uniform(-1.0, 1.0, (count, 6)),
    }
    for name, u in torques.items():
        yield from _stepped(f"arm, 1 kHz, {name}", model, 1e-3, u * TORQUES, 1 if quick else 3)


def _stepped(task: str, model: Model, dt: float, u: Array, rounds: int) -> Iterator[Found]:
    """Measure the steps of a model; `u` has one row per step and one column per input."""
    hold = {v.name: Hold(dt * np.arange(len(u)), u[:, i]) for i, v in enumerate(model.u)}

    def at_once(rtol: float = RTOL) -> Array:
        run = simulate(model, dt * len(u), u=hold, rtol=rtol, samples=2, backend=backend())
        return np.array([run[v.name][-1] for v in model.x])

    plant = stepper(model, dt, rtol=RTOL, backend=backend())

    def step_by_step() -> Array:
        plant.reset()
        for row in u:
            plant.step(row)
        return plant.x.copy()

    methods = {
        "stepper": step_by_step, "one simulate, Hold": at_once,
        "casadi rosenbrock": _stepping_peer(model, dt, u),
    }  # fmt: skip
    exact = at_once(1e-10)
    scale = np.maximum([v.nominal for v in model.x], np.abs(exact))
    errors = {who: float(np.max(np.abs(run() - exact) / scale)) for who, run in methods.items()}
    times = interleaved(methods, rounds)
    yield from _rows(task, "step", {who: time / len(u) for who, time in times.items()}, errors)


def _stepping_peer(model: Model, dt: float, u: Array) -> Callable[[], Array]:
    """Return the steps of CasADi's `rosenbrock`, compiled if possible and called with buffers."""
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


def _known(quick: bool) -> Iterator[Found]:
    """Measure calls on a known model: a run, a tiny one, and one with several set-valued laws."""
    whole, tiny = np.linspace(0.0, 20.0, 401), np.array([1e-6])
    cases: dict[str, tuple[Model, Array, float]] = {
        "rabinowicz brown_mcphee, 20 s": (Rabinowicz(BrownMcPhee()).model(), whole, 1e-5),
        "rabinowicz lugre, 20 s": (Rabinowicz(LuGre()).model(), whole, 1e-5),
        "rabinowicz brown_mcphee, 1 us": (Rabinowicz(BrownMcPhee()).model(), tiny, RTOL),
        "three blocks, exact_coulomb, 5 s": (_blocks(), np.linspace(0.0, 5.0, 2001), RTOL),
    }
    for task, (model, times, rtol) in cases.items():
        start = {} if model.events else START
        fixed: dict[str, Any] = {"t_eval": times, "rtol": rtol, "backend": backend()}
        prepared = prepare(model, float(times[-1]), **fixed)
        calls: Calls = {
            "simulate": partial(simulate, model, float(times[-1]), x0=start, **fixed),
            "prepared": partial(prepared, start),
        }
        if not model.events and find_compiler():
            calls["compiled loop alone"] = partial(loop(model, times, ("v",), rtol).solve, **start)
        yield from _rows(task, "run", interleaved(calls, 3 if quick else 50), title=KNOWN)


def _blocks() -> Model:
    """Return three blocks between springs, with exact Coulomb friction and a driving force.

    Source: Stewart, Numerical methods for friction problems with multiple contacts, J. Austral.
    Math. Soc. B 37, 1996.
    """
    t, starts = ca.SX.sym("t"), ((-1.0, -1.0), (1.0, 1.0), (-1.0, 1.0))
    q = [Variable(f"q{i}", "m", start=x) for i, (x, _) in enumerate(starts)]
    v = [Variable(f"v{i}", "m/s", start=x) for i, (_, x) in enumerate(starts)]
    (a, b, c), (va, vb, vc) = ([w.symbol for w in group] for group in (q, v))
    forces = [b - 2 * a - va, a - 2 * b + c - vb, b - c - vc + 10 * ca.cos(np.pi * t)]
    law = ExactCoulomb(mu_s=0.3, mu_d=0.3)
    rubbing = tuple(
        contact(f"c{i}", law, v[i], 1.0, rest={v[i].name: 0.0}, F_e=force, bare=False)
        for i, force in enumerate(forces)
    )
    rates = [force - own.force for force, own in zip(forces, rubbing, strict=True)]
    ode = ca.vertcat(va, vb, vc, *rates)
    return Model("three_blocks", t=t, x=(*q, *v), ode=ode, contacts=rubbing)


def _events(quick: bool) -> Iterator[Found]:
    """Measure exact Maxwell-slip elements with events, and their smooth form."""
    elements = 4 if quick else 30
    pairs: dict[str, Callable[[str], Law]] = {
        f"rabinowicz gms, {elements} elements": partial(_gms, elements),
        "rabinowicz maxwell_slip, 4 elements": lambda form: MaxwellSlip(form=form),
    }
    for task, law in pairs.items():
        calls: Calls = {
            form: partial(
                simulate, Rabinowicz(law(form)).model(), 20.0, rtol=RTOL, samples=401,
                backend=backend(),
            )
            for form in ("smooth", "event")
        }  # fmt: skip
        yield from _rows(task, "run", interleaved(calls, 1 if quick else 3))


def _gms(count: int, form: str) -> Law:
    """Return a law with elements of equal shares and different stiffnesses, 1e5 N/m in total."""
    weights = np.linspace(5.0, 1.0, count)
    stiffness = 1e5 * weights / weights.sum()
    return GMS(elements=tuple(Element(float(k), 1.0 / count) for k in stiffness), form=form)


# ---- imports in a new interpreter ----

IMPORTS: tuple[str, ...] = (
    "import symfric",
    "from symfric import LuGre, rabinowicz, simulate",
    "from ocp import solve",
    "from identification import Fit",
    "import casadi",
)


def _imports(quick: bool) -> Iterator[Found]:
    """Measure imports of the packages, and of CasADi alone."""
    times = dict.fromkeys(IMPORTS, np.inf)
    for _ in range(1 if quick else 7):
        for text in IMPORTS:
            code = f"from time import process_time as now; t = now(); {text}; print(now() - t)"
            done = run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
            times[text] = min(times[text], float(done.stdout))
    yield from _rows("import", "import", times)


TASKS = (_known, _drive, _arm, _events, _imports)
