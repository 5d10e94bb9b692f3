"""Run time against error on Rabinowicz's stick-slip, for symfric and other integrators."""

from collections.abc import Callable, Iterator
from contextlib import redirect_stderr, suppress
from dataclasses import dataclass, field
from functools import partial
from importlib.util import find_spec
from io import StringIO
from math import exp, log, nan
from time import process_time
from typing import Any, NamedTuple, final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.bench import contenders, table
from symfric.bench.contenders import Contender, equations, tolerances
from symfric.bench.ensemble import EnsembleRow, measure_ensemble
from symfric.bench.table import best_time, unwarned
from symfric.foundation.programs import find_compiler
from symfric.integrator.by_peer import peer
from symfric.integrator.simulate import simulate
from symfric.laws import BrownMcPhee, Law, LuGre
from symfric.model import Model
from symfric.results.trajectory import Trajectory
from symfric.scenes import rabinowicz

Array = NDArray[np.float64]
T_END = 20.0
TIMES = np.linspace(0.0, T_END, 401)[1:]
STARTS = (-0.05, -0.01, 0.03, 0.06, 0.09)
"""Start velocities [m/s]; the result of a single run may be accidental."""
CASES: dict[str, Law] = {"rabinowicz/brown_mcphee": BrownMcPhee(), "rabinowicz/lugre": LuGre()}
TOLERANCES = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10)
ERRORS = (1e-4, 1e-5, 1e-7)


class Row(NamedTuple):
    """Result of one integrator at one tolerance.

    Attributes:
        error: median over the start velocities of the largest position error at 400 times,
            relative to the largest position.
        time_s: median over the start velocities of the shortest processor time of a call [s].
        steps: median number of steps (evaluations for SciPy).
    """

    case: str
    integrator: str
    rtol: float
    error: float
    time_s: float
    steps: int


class SensitivityRow(NamedTuple):
    """Cost of the derivatives of the final state of a run with respect to parameters.

    Attributes:
        case: scene and law.
        integrator: integrator.
        parameters: number of parameters.
        rtol: relative tolerance.
        plain_s: time of the run alone [s].
        forward: time with derivatives of all states, relative to the run alone.
        adjoint: time with the gradient of the position, relative to the run alone; None if it
            failed.
        error: largest relative error of a derivative of the position.
    """

    case: str
    integrator: str
    parameters: int
    rtol: float
    plain_s: float
    forward: float
    adjoint: float | None
    error: float


@final
@dataclass(frozen=True, eq=False)
class Benchmark(table.Report):
    """Results of the integrator benchmark.

    Attributes:
        rows: every integrator at every tolerance.
        skipped: integrator -> reason why it was not run.
        first: build, compile and run time [s] of the first call, by case.
        ensemble: ensembles of runs.
        sensitivities: cost of derivatives.
    """

    rows: tuple[Row, ...]
    skipped: dict[str, str]
    first: dict[str, dict[str, float]] = field(default_factory=dict[str, dict[str, float]])
    ensemble: tuple[EnsembleRow, ...] = ()
    sensitivities: tuple[SensitivityRow, ...] = ()

    def time_at(self, case: str, integrator: str, error: float) -> float:
        """Return the time [s] to reach `error`, log-log interpolated; NaN if not reached."""
        points = sorted(
            (r.error, r.time_s)
            for r in self.rows
            if r.case == case and r.integrator == integrator and r.error > 0
        )
        best: list[tuple[float, float]] = []
        for e, t in points:  # from the most accurate; keep rows that are cheaper than all before
            if not best or t < best[-1][1]:
                best.append((e, t))
        below = [p for p in best if p[0] <= error]
        above = [p for p in best if p[0] > error]
        if not below:
            return nan
        if not above:
            return below[-1][1]
        (e0, t0), (e1, t1) = below[-1], above[0]
        share = (log(error) - log(e0)) / (log(e1) - log(e0))
        return exp(log(t0) + share * (log(t1) - log(t0)))

    def ratios(self, reference: str = "symfric compiled") -> list[dict[str, Any]]:
        """Return times relative to `reference` at equal error, where both integrators reach it."""
        found: list[dict[str, Any]] = []
        for case in dict.fromkeys(r.case for r in self.rows):
            for error in ERRORS:
                base = self.time_at(case, reference, error)
                for name in dict.fromkeys(r.integrator for r in self.rows):
                    time = self.time_at(case, name, error)
                    row = {"case": case, "error": error, "integrator": name, "time_s": time}
                    found += [row | {"ratio": time / base}] if time / base == time / base else []
        return found

    def to_dict(self) -> dict[str, Any]:
        """Return all results as plain data."""
        return table.plain(self) | {"ratios": table.plain(self.ratios())}

    def shown(self) -> Iterator[table.Table | str]:
        """Yield tables of runs, ratios, ensembles and derivatives."""
        yield table.of(
            "Time of a run of 20 s against its error", self.rows,
            {"case": "case", "integrator": "integrator", "rtol": "rtol",
             "relative error": table.shortened("error"),
             "time per run [ms]": table.shortened("time_s", 1e3), "steps": "steps"},
        )  # fmt: skip
        yield table.Table(
            "Time at equal error",
            ["case", "relative error", "integrator", "time per run [ms]",
             "ratio to symfric compiled"],
            [[r["case"], r["error"], r["integrator"], table.short(1e3 * r["time_s"]),
              round(r["ratio"], 2)]
             for r in self.ratios()],
        )  # fmt: skip
        yield table.of(
            "Ensembles, and a Python loop over cvodes at the same rtol",
            self.ensemble,
            {"case": "case", "members": "members", "threads": "workers",
             "time per member [us]": table.rounded("member_s", 1, 1e6),
             "parallel efficiency": table.rounded("efficiency", 2),
             "ratio of cvodes to symfric": table.rounded("ratio", 1)},
        )  # fmt: skip
        yield table.of(
            "Derivatives; ratios compare the run with derivatives to the run alone",
            self.sensitivities,
            {"case": "case", "integrator": "integrator", "parameters": "parameters",
             "time per run [ms]": table.rounded("plain_s", 3, 1e3),
             "ratio, forward": table.rounded("forward", 1),
             "ratio, adjoint": lambda r: "failed" if r.adjoint is None else f"{r.adjoint:.1f}"},
        )  # fmt: skip
        yield from table.not_run(self.skipped)

    def drawn(self) -> tuple[Any, ...]:
        """Return the work-precision diagram: time against error, one panel per case."""
        return "work_precision", ((r.case, r.integrator, r.error, r.time_s) for r in self.rows)


def bench_integrator(*, quick: bool = False, progress: table.Progress = None) -> Benchmark:
    """Measure all installed integrators in one run.

    Args:
        quick: fewer tolerances, start velocities and members, no SciPy; for tests.
        progress: called with the current item and the fraction done.
    """
    rtols = TOLERANCES[2:5] if quick else TOLERANCES
    starts = STARTS[:1] if quick else STARTS
    everyone, skipped = _integrators(quick)
    rows: list[Row] = []
    first = {case: _first(law) for case, law in CASES.items()}
    models = {case: rabinowicz(law) for case, law in CASES.items()}
    exact = {case: [_reference(model, v) for v in starts] for case, model in models.items()}
    tasks = [(case, name) for case in CASES for name in everyone]
    for case, name in table.each(tasks, progress, ": ".join):
        make, most_accurate = everyone[name]
        if name == "C by hand" and not isinstance(CASES[case], BrownMcPhee):
            continue
        with unwarned():
            rows += [
                _measured(case, name, rtol, make(models[case], TIMES, ("x",), rtol), starts,
                          exact[case])
                for rtol in rtols
                if rtol >= most_accurate
            ]  # fmt: skip
    many: list[EnsembleRow] = []
    slopes: list[SensitivityRow] = []
    for case, law in table.each([*CASES.items()], progress, lambda item: f"{item[0]}: derivatives"):
        many += measure_ensemble(case, law, quick)
        slopes += measure_sensitivities(case, law, quick)
    return Benchmark(tuple(rows), skipped, first, tuple(many), tuple(slopes))


Maker = Callable[..., Contender]


def _integrators(quick: bool) -> tuple[dict[str, tuple[Maker, float]], dict[str, str]]:
    """Return integrator -> (maker, smallest tolerance), and reasons for missing integrators."""
    found: dict[str, tuple[Maker, float]] = {}
    skipped: dict[str, str] = {}
    if find_compiler() is not None:
        for name, method in (("", "auto"), (" rodas4p", "rodas4p"), (" radau5", "radau5")):
            found[f"symfric compiled{name}"] = (partial(contenders.ours, method=method), 0.0)
        found["casadi rosenbrock compiled"] = (contenders.casadi, 0.0)
    else:
        names = ("symfric compiled", "casadi rosenbrock compiled")
        skipped |= dict.fromkeys(names, "no C compiler")
    found["symfric vm"] = (partial(contenders.ours, backend="vm"), 0.0)
    for plugin in ("rosenbrock", "cvodes", "idas"):
        make = partial(contenders.casadi, plugin=plugin, as_c=False)
        found[f"casadi {plugin}"] = (make, 0.0)
    if find_spec("scipy") is None and not quick:
        skipped["scipy"] = "not installed"
    elif not quick:
        found["scipy Radau"] = (partial(contenders.scipy, method="Radau"), 1e-7)
        found["scipy LSODA"] = (partial(contenders.scipy, method="LSODA"), 1e-10)
    if find_compiler() is not None:
        found["C by hand"] = (contenders.by_hand, 0.0)
    return found, skipped


def _reference(model: Model, v: float) -> Array:
    """Return the position by another method at a tolerance far below all measured ones."""
    return simulate(
        model, T_END, x0={"v": v}, rtol=1e-12, t_eval=TIMES, method="rodas4p"
    )["x"]  # fmt: skip


def _measured(
    case: str,
    name: str,
    rtol: float,
    contender: Contender,
    starts: tuple[float, ...],
    reference: list[Array],
) -> Row:
    errors, seconds, steps = [], [], []
    for v, exact in zip(starts, reference, strict=True):
        time, ((x,), count) = best_time(partial(contender.solve, v=v), clock=process_time)
        errors.append(float(np.abs(x - exact).max() / np.abs(exact).max()))
        seconds.append(time)
        steps.append(count())
    error, time_s = float(np.median(errors)), float(np.median(seconds))
    return Row(case, name, rtol, error, time_s, int(np.median(steps)))


def _first(law: Law) -> dict[str, float]:
    """Return build, compile and run times [s] of a new model, with the current compiler cache."""
    backend = "compiled" if find_compiler() else "vm"
    result = simulate(rabinowicz(law), T_END, backend=backend).statistics
    times = (result.build_time, result.compile_time, result.run_time)
    return dict(zip(("build_s", "compile_or_load_s", "run_s"), times, strict=True))


# ---- derivatives, forward and adjoint, relative to the run alone ----

RTOL, V = 1e-6, 0.02
FREE = ("mu_s", "mu_d", "k", "m", "v_belt", "g")
Call = Callable[[], Array]


def measure_sensitivities(case: str, law: Law, quick: bool) -> Iterator[SensitivityRow]:
    """Measure derivatives by one and by all parameters with symfric and CasADi's integrators."""
    for count in (1, len(FREE)):
        names = FREE[:count]
        model = rabinowicz(law, free=names)
        slopes = _run(model, "vm", names, rtol=1e-11).sensitivities
        exact = np.array([slopes[name]["x"][0] for name in names])
        for backend in ("compiled", "vm") if find_compiler() else ("vm",):
            yield _costs(case, f"symfric {backend}", exact, *_of_ours(model, backend, names))
        for plugin in () if quick else ("rosenbrock", "cvodes"):
            yield _costs(case, f"casadi {plugin}", exact, *_of_peer(model, plugin))


def _costs(
    case: str, integrator: str, exact: Array, alone: Call, forward: Call, adjoint: Call
) -> SensitivityRow:
    base, _ = _repeated(alone)
    forward_s, found = _repeated(forward)
    ratio = None
    with (
        redirect_stderr(StringIO()),
        suppress(RuntimeError),
    ):  # SUNDIALS prints more than the exception
        ratio = _repeated(adjoint)[0] / base
    error = float(np.max(np.abs(found / exact - 1)))
    return SensitivityRow(
        case, integrator, exact.size, RTOL, base, forward_s / base, ratio, error
    )  # fmt: skip


def _repeated(call: Call) -> tuple[float, Array]:
    """Return the shortest time of later calls; the first call builds and compiles."""
    call()
    return best_time(call)


def _run(model: Model, backend: str, names: tuple[str, ...], rtol: float = RTOL) -> Trajectory:
    return simulate(
        model, T_END, x0={"v": V}, rtol=rtol, t_eval=[T_END], backend=backend, sensitivities=names,
        method="radau5",
    )  # fmt: skip


def _of_ours(model: Model, backend: str, names: tuple[str, ...]) -> tuple[Call, Call, Call]:
    def forward() -> Array:
        slopes = _run(model, backend, names).sensitivities
        return np.array([slopes[name]["x"][0] for name in names])

    return (
        lambda: _run(model, backend, ())["x"],
        forward,
        lambda: np.array(list(_run(model, backend, names).gradient({"x": 1.0}).values())),
    )


def _of_peer(model: Model, plugin: str) -> tuple[Call, Call, Call]:
    """Return the calls of CasADi's integrator, with start values that depend on parameters."""
    whole, inputs = equations(model, T_END)
    name = "rosenbrock" if plugin == "rosenbrock" else "sundials"
    values = model.values("p")
    problem = peer(whole, inputs, values, tolerances(whole, RTOL), name)
    solver = ca.integrator("solver", plugin, problem.dae, 0.0, T_END, problem.options)
    p, seed = ca.MX.sym("p", len(model.p)), ca.DM.eye(len(model.p))
    x0 = model.initial_state({"v": V}) / whole.nominal
    by_p = model.start_by_parameters({"v": V}) / whole.nominal[:, None]
    start = x0 + ca.mtimes(ca.DM(by_p), p - ca.DM(values))
    x = solver(x0=start, p=p)["xf"]
    ahead = ca.Function("ahead", [p], [ca.jtimes(x, p, seed)])
    back = ca.Function("back", [p], [ca.gradient(x[0], p)])
    return (
        lambda: solver(x0=x0, p=values)["xf"].full(),
        lambda: ahead(values).full()[0] * whole.nominal[0],
        lambda: back(values).full(),
    )
