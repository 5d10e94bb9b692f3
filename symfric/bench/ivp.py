"""Correct digits and run time on published initial-value problems with known solutions."""

from collections.abc import Iterator, Sequence
from functools import partial
from math import nan

import numpy as np

from symfric.bench.ivp_mechanisms import PROBLEMS
from symfric.bench.ivp_problems import TEST_SET, Problem
from symfric.bench.report import Found, Progress, Report, backend, best_time, curves
from symfric.integrator.simulate import simulate
from symfric.model import Model
from symfric.results.trajectory import Trajectory

METHODS = ("rodas5p", "radau5")
TOLERANCES = (1e-6, 1e-8, 1e-10)
DIGITS = "Correct digits of the worst signal at the end"
DRIFT = "Drift of constraints that are imposed on the accelerations only"


def bench(
    quick: bool = False, problems: Sequence[Problem] = PROBLEMS, progress: Progress = None
) -> Report:
    """Measure all problems; with `quick`, at rtol 1e-6 only."""
    tasks = {problem.name: partial(_rows, problem, quick) for problem in problems}
    draw = curves("problem", ("method",), "relative error", "time per run [ms]")
    source = f"Problems and published values: {TEST_SET}."
    return Report((DIGITS, draw), notes=[source]).collect(tasks, progress)


def _rows(problem: Problem, quick: bool) -> Iterator[Found]:
    model = problem.model()
    for method in METHODS:
        tolerances = TOLERANCES[:1] if quick or method in problem.laborious else TOLERANCES
        for rtol in tolerances:
            yield from measure(problem, model, method, rtol)


def measure(
    problem: Problem, model: Model, method: str, rtol: float, engine: str | None = None
) -> Iterator[Found]:
    """Integrate one problem; yield the row of its correct digits and the row of its drift.

    Args:
        problem, model: problem and its equations.
        method, rtol: as in `simulate`.
        engine: `backend` of `simulate`; by default compiled if there is a compiler.
    """
    solve = partial(
        simulate, model, problem.t_end, rtol=rtol, method=method, backend=engine or backend(),
        samples=2, throw=False,
    )  # fmt: skip
    solve()
    time_s, run = best_time(solve)
    case = {"problem": problem.name, "method": method, "rtol": rtol}
    digits, worst = correct_digits(problem, run) if run.status.ok else (nan, "")
    yield DIGITS, case | {
        "correct digits": digits, "worst signal": worst,
        "required digits": problem.digits.get(rtol, ""), "relative error": 10**-digits,
        "steps": run.statistics.steps, "rejections": run.statistics.rejections,
        "time per run [ms]": 1e3 * time_s,
    }  # fmt: skip
    if not run.status.ok:
        yield f"{problem.name}, {method}: not run, {run.message}"
    if problem.drift and run.step_times.size > 1:
        at = run.at(run.step_times)
        drift = max(float(np.abs(at[name]).max()) for name in problem.drift)
        yield DRIFT, case | {"largest constraint violation": drift}


def correct_digits(problem: Problem, run: Trajectory) -> tuple[float, str]:
    """Return the number of correct digits of the worst signal at the end, and its name."""
    end = run.final
    errors = {
        name: abs(end[name] - value) / abs(value) for name, value in problem.reference.items()
    }
    worst = max(errors, key=lambda name: errors[name])
    # rounding limits the number of correct digits
    return -float(np.log10(max(errors[worst], float(np.finfo(float).eps)))), worst
