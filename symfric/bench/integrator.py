"""Run time against error on Rabinowicz's stick-slip, for symfric and other integrators."""

from collections.abc import Callable, Iterator, Mapping
from functools import partial
from importlib.util import find_spec
from time import process_time

import numpy as np

from symfric import BrownMcPhee, Law, LuGre, Model, Trajectory, rabinowicz, simulate
from symfric.bench import contenders
from symfric.bench.contenders import Contender
from symfric.bench.report import (
    Found,
    Progress,
    Report,
    backend,
    best_time,
    curves,
    ratios,
    unwarned,
)
from symfric.foundation.numeric import Array
from symfric.foundation.programs import find_compiler

T_END = 20.0
TIMES = np.linspace(0.0, T_END, 401)[1:]
STARTS = (-0.05, -0.01, 0.03, 0.06, 0.09)
"""Start velocities [m/s]; several of them, because a single result may be accidental."""
CASES: dict[str, Law] = {"rabinowicz/brown_mcphee": BrownMcPhee(), "rabinowicz/lugre": LuGre()}
TOLERANCES = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10)
ERRORS = (1e-4, 1e-5, 1e-7, 1e-9)
OURS = "symfric compiled"
RUNS = "Time of a run of 20 s against its error"
FIRST = "First call on a new model"
SLOPES = "Derivatives; ratios compare the run with derivatives to the run alone"


def bench(quick: bool = False, progress: Progress = None) -> Report:
    """Measure all installed integrators in one run.

    With `quick`, use fewer tolerances and omit SciPy. The start velocities and the tolerances
    around each error are the same, so that ratios differ only by the noise of the measurement.
    """
    makers, skipped = _integrators(quick)
    draw = curves("case", ("integrator",), "relative error", "time per run [ms]")
    report = Report((RUNS, draw), notes=[f"{who}: not run, {why}" for who, why in skipped.items()])
    tasks: dict[str, Callable[[], Iterator[Found]]] = {}
    for case, law in CASES.items():
        tasks[f"{case}: first call"] = partial(_first, case, law)  # before anything is cached
    for case, law in CASES.items():
        tasks[case] = partial(_runs, case, law, makers, quick)
    tasks["ratios"] = lambda: ratios(report.tables[RUNS], OURS, ERRORS)
    for case, law in CASES.items():
        tasks[f"{case}: derivatives"] = partial(_derivatives, case, law)
    return report.collect(tasks, progress)


Maker = Callable[..., Contender]


def _integrators(quick: bool) -> tuple[dict[str, tuple[Maker, float]], dict[str, str]]:
    """Return integrator -> (maker, smallest tolerance), and reasons for missing integrators."""
    found: dict[str, tuple[Maker, float]] = {}
    skipped: dict[str, str] = {}
    if find_compiler() is not None:
        found[OURS] = contenders.ours, 0.0
        for method in ("rodas5p", "rodas4p", "radau5", "radau9"):
            found[f"{OURS} {method}"] = partial(contenders.ours, method=method), 0.0
        found["casadi rosenbrock compiled"] = contenders.casadi, 0.0
        found["C by hand"] = contenders.by_hand, 0.0
    else:
        skipped |= dict.fromkeys((OURS, "casadi rosenbrock compiled"), "no C compiler")
    found["symfric vm"] = partial(contenders.ours, backend="vm"), 0.0
    for plugin in ("rosenbrock", "cvodes", "idas"):
        found[f"casadi {plugin}"] = partial(contenders.casadi, plugin=plugin, as_c=False), 0.0
    if not quick and find_spec("scipy") is None:
        skipped["scipy"] = "not installed"
    elif not quick:
        for method, least in (("Radau", 1e-7), ("LSODA", 1e-10)):
            found[f"scipy {method}"] = partial(contenders.scipy, method=method), least
    return found, skipped


def _first(case: str, law: Law) -> Iterator[Found]:
    """Measure the first run of a new model, with the current compiler cache."""
    run = simulate(rabinowicz(law), T_END, backend=backend()).statistics
    yield FIRST, {
        "case": case, "build time [s]": run.build_time,
        "compile or load time [s]": run.compile_time, "run time [s]": run.run_time,
    }  # fmt: skip


def _runs(
    case: str, law: Law, makers: Mapping[str, tuple[Maker, float]], quick: bool
) -> Iterator[Found]:
    """Measure every integrator at every tolerance, as medians over the start velocities.

    The error is the largest position error at 400 times, relative to the largest position. For
    SciPy, the number of evaluations replaces that of steps.
    """
    model = rabinowicz(law)
    exact = [
        simulate(model, T_END, x0={"v": v}, rtol=1e-12, t_eval=TIMES, method="rodas4p")["x"]
        for v in STARTS
    ]
    for name, (make, least) in makers.items():
        if name == "C by hand" and not isinstance(law, BrownMcPhee):
            continue
        for rtol in TOLERANCES[:5] if quick else TOLERANCES:
            if rtol < least:
                continue
            with unwarned():
                solve = make(model, TIMES, ("x",), rtol).solve
                rows: list[tuple[float, float, int]] = []
                for v, reference in zip(STARTS, exact, strict=True):
                    time_s, ((x,), count) = best_time(partial(solve, v=v), clock=process_time)
                    error = np.abs(x - reference).max() / np.abs(reference).max()
                    rows.append((error, time_s, count()))
            error, time_s, steps = map(float, np.median(rows, axis=0))
            yield RUNS, {
                "case": case, "integrator": name, "rtol": rtol, "relative error": error,
                "time per run [ms]": 1e3 * time_s, "steps": int(steps),
            }  # fmt: skip


# ---- derivatives, forward and adjoint, relative to the run alone ----

RTOL, V = 1e-6, 0.02
FREE = ("mu_s", "mu_d", "k", "m", "v_belt", "g")
Call = Callable[[], Array]


def _derivatives(case: str, law: Law) -> Iterator[Found]:
    """Measure derivatives of the final state with respect to one and to all parameters.

    The forward ratio is that of the derivatives of all states, the adjoint ratio that of the
    gradient of the position. The error is the largest relative error of a derivative of the
    position.
    """
    for names in (FREE[:1], FREE):
        model = rabinowicz(law, free=names)
        slopes = _run(model, "vm", names, rtol=1e-11).sensitivities
        exact = np.array([slopes[name]["x"][0] for name in names])
        ways = {
            f"symfric {engine}": _of_ours(model, engine, names)
            for engine in dict.fromkeys((backend(), "vm"))
        }
        for integrator, (alone, forward, adjoint) in ways.items():
            base, _ = _repeated(alone)
            forward_s, found = _repeated(forward)
            adjoint_s, _ = _repeated(adjoint)
            yield SLOPES, {
                "case": case, "integrator": integrator, "parameters": len(names), "rtol": RTOL,
                "time per run [ms]": 1e3 * base, "ratio, forward": forward_s / base,
                "ratio, adjoint": adjoint_s / base,
                "relative error": float(np.max(np.abs(found / exact - 1))),
            }  # fmt: skip


def _repeated(call: Call) -> tuple[float, Array]:
    """Return the shortest time [s] of calls after the first one, and their result.

    The calls continue for two seconds, since derivatives and signals are compiled in the background
    during the first calls.
    """
    call()
    return best_time(call, budget=2.0, most=100)


def _run(model: Model, engine: str, names: tuple[str, ...], rtol: float = RTOL) -> Trajectory:
    return simulate(
        model, T_END, x0={"v": V}, rtol=rtol, t_eval=[T_END], backend=engine, sensitivities=names,
        method="radau5",
    )  # fmt: skip


def _of_ours(model: Model, engine: str, names: tuple[str, ...]) -> tuple[Call, Call, Call]:
    def forward() -> Array:
        slopes = _run(model, engine, names).sensitivities
        return np.array([slopes[name]["x"][0] for name in names])

    return (
        lambda: _run(model, engine, ())["x"],
        forward,
        lambda: np.array(list(_run(model, engine, names).gradient({"x": 1.0}).values())),
    )
