"""Run time against error of ours and other integrators on Rabinowicz's stick-slip."""

from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from functools import partial
from importlib.util import find_spec
from math import exp, log, nan
from pathlib import Path
from time import process_time
from typing import TYPE_CHECKING, Any, final

import numpy as np
from numpy.typing import NDArray

from symfric.bench import peers
from symfric.bench.by_hand import ByHand
from symfric.bench.ensemble import EnsembleRow, measure_ensemble
from symfric.bench.sensitivities import SensitivityRow, measure_sensitivities
from symfric.bench.timing import best_time, unwarned
from symfric.foundation.compiler import find_compiler
from symfric.integrator.simulate import simulate
from symfric.laws import BrownMcPhee, Law, LuGre
from symfric.model import Model
from symfric.scenes import Rabinowicz, rabinowicz

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Array = NDArray[np.float64]
T_END = 20.0
TIMES = np.linspace(0.0, T_END, 401)[1:]
STARTS = (-0.05, -0.01, 0.03, 0.06, 0.09)
"""Start velocities [m/s]; one run alone may be lucky."""
CASES: dict[str, Law] = {"rabinowicz/brown_mcphee": BrownMcPhee(), "rabinowicz/lugre": LuGre()}
TOLERANCES = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10)
ERRORS = (1e-4, 1e-5, 1e-7)


@final
@dataclass(frozen=True)
class Row:
    """One integrator at one tolerance.

    Attributes:
        error: median over the start velocities of the largest position error at 400 times,
            relative to the largest position.
        time_s: median over them of the shortest processor time of a call [s].
        steps: median number of steps (evaluations for SciPy, 0 for compiled peers).
    """

    case: str
    integrator: str
    rtol: float
    error: float
    time_s: float
    steps: int


@final
@dataclass(frozen=True, eq=False)
class Benchmark:
    """All rows of one run of the benchmark.

    Attributes:
        rows: every integrator at every tolerance.
        skipped: integrator -> why it was not run.
        first: build, compile and run time [s] of the first call, by case and cache state.
        ensemble: many runs at once.
        sensitivities: what derivatives cost.
    """

    rows: tuple[Row, ...]
    skipped: dict[str, str]
    first: dict[str, dict[str, float]] = field(default_factory=dict[str, dict[str, float]])
    ensemble: tuple[EnsembleRow, ...] = ()
    sensitivities: tuple[SensitivityRow, ...] = ()

    def time_at(self, case: str, integrator: str, error: float) -> float:
        """Time [s] to reach `error`, log-log interpolated on the best rows; NaN if not reached."""
        points = sorted(
            (r.error, r.time_s)
            for r in self.rows
            if r.case == case and r.integrator == integrator and r.error > 0
        )
        best: list[tuple[float, float]] = []
        for e, t in points:  # from the most accurate on; keep what is cheaper than all before
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
        """Time of every integrator divided by that of `reference`, at equal error."""
        names = list(dict.fromkeys(r.integrator for r in self.rows))
        found: list[dict[str, Any]] = []
        for case in dict.fromkeys(r.case for r in self.rows):
            for error in ERRORS:
                base = self.time_at(case, reference, error)
                found += [
                    {
                        "case": case,
                        "error": error,
                        "integrator": name,
                        "time_s": self.time_at(case, name, error),
                        "ratio": self.time_at(case, name, error) / base,
                    }
                    for name in names
                ]
        return found

    def to_dict(self) -> dict[str, Any]:
        """Rows, ratios (those that were reached), what was skipped, first results and the rest."""
        ratios = [r for r in self.ratios() if r["ratio"] == r["ratio"]]
        return {
            "rows": [asdict(row) for row in self.rows],
            "ratios": ratios,
            "skipped": self.skipped,
            "first": self.first,
            "ensemble": [asdict(row) for row in self.ensemble],
            "sensitivities": [asdict(row) for row in self.sensitivities],
        }

    def plot(self, path: str | Path | None = None) -> "Figure":
        """Work-precision diagram: time against error, a panel per case."""
        from symfric.bench.pictures import plot_work_precision  # noqa: PLC0415

        lines: dict[str, dict[str, list[tuple[float, float]]]] = {}
        for row in self.rows:
            case = lines.setdefault(row.case, {})
            case.setdefault(row.integrator, []).append((row.error, row.time_s))
        return plot_work_precision(lines, path)


def bench_integrator(
    *, quick: bool = False, progress: Callable[[str, float], None] | None = None
) -> Benchmark:
    """Measure all integrators that this machine has, in one run.

    Args:
        quick: fewer tolerances, start velocities and members, no SciPy; for tests.
        progress: called with what is measured and the fraction done.
    """
    tolerances = TOLERANCES[2:5] if quick else TOLERANCES
    starts = STARTS[:1] if quick else STARTS
    everyone, skipped = _kinds(quick)
    rows: list[Row] = []
    first: dict[str, dict[str, float]] = {}
    total, done = len(CASES) * len(everyone), 0
    for case, law in CASES.items():
        model, kinds = rabinowicz(law), dict(everyone)
        if find_compiler() is not None and isinstance(law, BrownMcPhee):
            kinds["C by hand"] = (_by_hand, 0.0)
        first[case] = _first(law)
        reference = [_reference(model, v) for v in starts]
        for name, (make, most_accurate) in kinds.items():
            if progress is not None:
                progress(f"{case}: {name}", done / total)
            done += 1
            with unwarned():
                rows += [
                    _measure(case, name, rtol, make(model, TIMES, rtol), starts, reference)
                    for rtol in tolerances
                    if rtol >= most_accurate
                ]
    many: list[EnsembleRow] = []
    slopes: list[SensitivityRow] = []
    for case, law in CASES.items():
        if progress is not None:
            progress(f"{case}: ensembles and derivatives", 1.0)
        many += measure_ensemble(case, law, quick)
        slopes += measure_sensitivities(case, law, quick)
    return Benchmark(tuple(rows), skipped, first, tuple(many), tuple(slopes))


Maker = Callable[[Model, Array, float], peers.Solve]


def _kinds(quick: bool) -> tuple[dict[str, tuple[Maker, float]], dict[str, str]]:
    """Integrator -> (how to make it, tightest tolerance worth its time); what is missing."""
    compiler = find_compiler() is not None
    kinds: dict[str, tuple[Maker, float]] = {}
    skipped: dict[str, str] = {}
    if compiler:
        ours = partial(peers.ours, backend="compiled")
        kinds["symfric compiled"] = (partial(ours, method="auto"), 0.0)
        kinds["symfric compiled rodas4p"] = (partial(ours, method="rodas4p"), 0.0)
        kinds["symfric compiled radau5"] = (partial(ours, method="radau5"), 0.0)
        rosenbrock = partial(peers.casadi, plugin="rosenbrock", compiled=True)
        kinds["casadi rosenbrock compiled"] = (rosenbrock, 0.0)
    else:
        for name in ("symfric compiled", "casadi rosenbrock compiled"):
            skipped[name] = "no C compiler"
    kinds["symfric vm"] = (partial(peers.ours, backend="vm", method="auto"), 0.0)
    for plugin in ("rosenbrock", "cvodes", "idas"):
        kinds[f"casadi {plugin}"] = (partial(peers.casadi, plugin=plugin, compiled=False), 0.0)
    if quick:
        return kinds, skipped
    if find_spec("scipy") is None:
        skipped["scipy"] = "not installed"
    else:
        kinds["scipy Radau"] = (partial(peers.scipy, method="Radau"), 1e-7)
        kinds["scipy LSODA"] = (partial(peers.scipy, method="LSODA"), 1e-10)
    return kinds, skipped


def _by_hand(model: Model, times: Array, rtol: float) -> peers.Solve:
    """Radau5 in C for this equation alone."""
    del model  # its defaults
    run = ByHand(Rabinowicz(BrownMcPhee()))

    def solve(v: float) -> tuple[Array, Callable[[], int]]:
        (x, _), steps = run(v, times, rtol)
        return x, lambda: steps

    return solve


def _reference(model: Model, v: float) -> Array:
    """Position by the other of our methods at a tolerance far below all measured ones."""
    return simulate(
        model, T_END, x0={"v": v}, rtol=1e-12, t_eval=TIMES, method="rodas4p"
    )["x"]  # fmt: skip


def _measure(
    case: str,
    name: str,
    rtol: float,
    solve: peers.Solve,
    starts: tuple[float, ...],
    reference: list[Array],
) -> Row:
    errors, seconds, steps = [], [], []
    for v, exact in zip(starts, reference, strict=True):
        time, (x, count) = best_time(partial(solve, v), clock=process_time)
        errors.append(float(np.abs(x - exact).max() / np.abs(exact).max()))
        seconds.append(time)
        steps.append(count())
    return Row(
        case,
        name,
        rtol,
        float(np.median(errors)),
        float(np.median(seconds)),
        int(np.median(steps)),
    )


def _first(law: Law) -> dict[str, float]:
    """Build, compile and run times [s] of a model that was never run, as this machine stands."""
    result = simulate(
        rabinowicz(law), T_END, backend="compiled" if find_compiler() else "vm"
    ).statistics
    return {
        "build_s": result.build_time,
        "compile_or_load_s": result.compile_time,
        "run_s": result.run_time,
    }
