"""Mechanisms: run time at equal error compared with other tools, cost of the step, counts."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache, partial
from importlib.util import find_spec
from math import inf, nan
from time import process_time
from typing import final

import numpy as np

from symfric.bench import exudyn_peer, mechanisms
from symfric.bench.contenders import MECHANISMS, Array, Contender
from symfric.bench.mechanisms import SIZES, chain
from symfric.bench.report import Found, Progress, Report, Row, best_time, curves, unwarned
from symfric.foundation.programs import find_compiler
from symfric.integrator.simulate import simulate
from symfric.laws import BrownMcPhee
from symfric.scenes import MechanismScene, PendulumBox, SliderCrank

OURS, LOOP, EXUDYN = "symfric", "symfric loop", "exudyn"
ERRORS = (1e-4, 2e-5, 1e-5)
TOLERANCES = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7)
STEPS = (250, 500, 1000, 1250, 2500, 5000)
"""Numbers of steps of Exudyn, whose step size is fixed."""
CRANK = BrownMcPhee(mu_s=0.1, mu_d=0.08, v_t=0.01)
RUNS = "Time of a run against its error"
RATIOS = "Loosest tolerance that keeps an error"
SETTING = "rtol (Exudyn: number of steps)"


@final
@dataclass(frozen=True, eq=False)
class Case:
    """Scene and its compared states.

    Attributes:
        scene: machine.
        t_end: end time [s]; positions are compared at 25 equal intervals.
        watched: formulation -> compared states, the same positions in each formulation.
    """

    scene: MechanismScene
    t_end: float
    watched: dict[str, tuple[str, ...]]

    @property
    def times(self) -> Array:
        """Times at which positions are compared [s]."""
        return np.linspace(0.0, self.t_end, 26)[1:]


CASES: dict[str, Case] = {
    "slider_crank": Case(
        SliderCrank(CRANK), 0.25, {"joint": ("slider",), "absolute": ("block_x",)}
    ),
    "pendulum_box": Case(PendulumBox(BrownMcPhee()), 15.0, {"joint": ("x",)}),
}


def bench(quick: bool = False, links: Sequence[int] = SIZES, progress: Progress = None) -> Report:
    """Measure everything in one run on one machine, so that ratios hold.

    Args:
        quick: three tolerances and joint coordinates only, short runs.
        links: lengths of the chains.
        progress: called with the current item and the fraction done.
    """
    kinds = ("joint",) if quick else mechanisms.BOTH
    draw = curves("case", ("integrator",), "relative error", "time per run [ms]")
    report = Report((RUNS, draw))
    tasks: dict[str, Callable[[], Iterable[Found]]] = {
        f"{case}: {name}": partial(_runs, case, name, quick)
        for case, what in CASES.items()
        for name, (formulation, _) in MECHANISMS.items()
        if find_compiler() and formulation in what.watched and formulation in kinds
    }
    if not find_compiler():
        report.notes.append("runs: not run, no C compiler")
    elif quick or find_spec(EXUDYN) is None:
        why = "takes too long for --quick" if quick else "not installed (extra 'bench')"
        report.notes.append(f"{EXUDYN}: not run, {why}")
    else:
        tasks[EXUDYN] = _exudyn
    make = partial(chain, law=BrownMcPhee(v_t=0.01))
    tasks |= {
        "ratios": lambda: ratios(report.tables.get(RUNS, [])),
        "compilation": partial(mechanisms.compilation, kinds),
        "counts": partial(mechanisms.counts, kinds),
        "chains": partial(mechanisms.chains, make, links),
        "reference values": mechanisms.facts,
        "constraints": partial(mechanisms.norms, kinds),
        "energy": partial(mechanisms.drifts, 1.0 if quick else mechanisms.DRIFT_S),
    }
    return report.collect(tasks, progress)


def _runs(case: str, name: str, quick: bool) -> Iterator[Found]:
    """Measure one integrator at all tolerances."""
    what, (formulation, make) = CASES[case], MECHANISMS[name]
    model = what.scene.mechanism().build(formulation=formulation)
    for rtol in TOLERANCES[2:5] if quick else TOLERANCES:
        solver = partial(make, model, what.times, what.watched[formulation], rtol)
        yield _run(case, name, rtol, solver)


def _exudyn() -> Iterator[Found]:
    times = CASES["slider_crank"].times
    for steps in STEPS:
        solver = partial(exudyn_peer.slider_crank, SliderCrank(CRANK), CRANK, times, steps)
        yield _run("slider_crank", EXUDYN, steps, solver)


def _run(case: str, name: str, setting: float, make: Callable[[], Contender]) -> Found:
    """Return time and error of one integrator at one setting; a note if it fails.

    The error is the largest position error at 25 times over the largest position. The compile time
    is 0 if one compilation serves all tolerances.
    """
    try:
        with unwarned():
            contender = make()
            time_s, (found, count) = best_time(contender.solve, budget=0.2, clock=process_time)
    except RuntimeError as error:
        last = str(error).strip().splitlines()[-1]
        return f"{case}: {name} at {setting:g}: not run, {last.rpartition(': ')[2]}"
    exact = _exact(case)
    error = float(np.abs(found - exact).max() / np.abs(exact).max()) if found.size else inf
    return RUNS, {
        "case": case, "integrator": name, SETTING: setting, "relative error": error,
        "steps": count(), "time per run [ms]": 1e3 * time_s,
        "compile time [s]": contender.compile_s,
    }  # fmt: skip


@cache
def _exact(case: str) -> Array:
    """Return positions by another method at a tolerance far below all measured ones."""
    what = CASES[case]
    run = simulate(
        what.scene.model(), what.t_end, rtol=1e-12, t_eval=what.times, method="rodas4p"
    )  # fmt: skip
    return np.array([run[name] for name in what.watched["joint"]])


def ratios(rows: Sequence[Row]) -> Iterator[Found]:
    """Yield times of all integrators relative to symfric, at each of the errors that both keep.

    Each integrator has the fewest requested steps whose error is at most the bound. Times are
    relative to `simulate` in joint coordinates, and to its compiled loop without the overhead of
    Python.
    """
    for case in dict.fromkeys(r["case"] for r in rows):
        own = [r for r in rows if r["case"] == case]
        for bound in ERRORS:
            kept = [r for r in own if float(r["relative error"]) <= bound]
            loosest = {
                name: min((r for r in kept if r["integrator"] == name), key=_effort, default=None)
                for name in dict.fromkeys(r["integrator"] for r in own)
            }
            base, loop = (_time(loosest.get(name)) for name in (OURS, LOOP))
            for row in loosest.values():
                if row and base == base:
                    yield RATIOS, {
                        "case": case, "error bound": bound, "integrator": row["integrator"],
                        SETTING: row[SETTING], "relative error": row["relative error"],
                        "steps": row["steps"], "time per run [ms]": _time(row),
                        "ratio to simulate": _time(row) / base,
                        "ratio to the loop": _time(row) / loop,
                    }  # fmt: skip


def _effort(row: Row) -> float:
    """Return a number that increases with the requested number of steps."""
    return (1.0 if row["integrator"] == EXUDYN else -1.0) * float(row[SETTING])


def _time(row: Row | None) -> float:
    return float(row["time per run [ms]"]) if row else nan
