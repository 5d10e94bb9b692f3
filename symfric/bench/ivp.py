"""Correct digits and run time on published initial-value problems with known solutions."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from math import inf
from typing import Any, NamedTuple, final

import numpy as np

from symfric.bench import table
from symfric.bench.ivp_mechanisms import PROBLEMS
from symfric.bench.ivp_problems import Problem
from symfric.bench.table import best_time
from symfric.foundation.programs import find_compiler
from symfric.integrator.simulate import simulate
from symfric.model import Model
from symfric.results.trajectory import Trajectory

METHODS = ("rodas5p", "radau5")
TOLERANCES = (1e-6, 1e-8, 1e-10)


class IvpRow(NamedTuple):
    """Result of one method on one problem at one tolerance.

    Attributes:
        scd: significant correct digits of the worst signal at the end, -log10 of its relative
            error; -inf if the end was not reached.
        worst: signal with the largest error.
        wanted: required digits.
        steps, rejections: accepted and rejected steps.
        time_s: shortest time of a call [s], without building and compiling.
        drift: largest value of a constraint at an accepted step; 0 without constraints.
        message: reason why the end was not reached, else empty.
    """

    problem: str
    method: str
    rtol: float
    scd: float
    worst: str
    wanted: int
    steps: int
    rejections: int
    time_s: float
    drift: float
    message: str


@final
@dataclass(frozen=True, eq=False)
class IvpBenchmark(table.Report):
    """Results of the benchmark on initial-value problems."""

    rows: tuple[IvpRow, ...]

    def to_dict(self) -> dict[str, Any]:
        """Return the rows and the sources of the problems; infinite digits are None."""
        return table.plain(self) | {"sources": {p.name: p.source for p in PROBLEMS}}

    def shown(self) -> Iterator[table.Table | str]:
        """Yield tables of digits, steps and times, and of the drift of constraints."""
        run: dict[str, table.Column] = {"problem": "problem", "method": "method", "rtol": "rtol"}
        yield table.of(
            "Correct digits of the worst signal at the end", self.rows,
            {**run, "correct digits": table.rounded("scd", 1),
             "required digits": lambda r: r.wanted or "",
             "steps": "steps", "time per run [ms]": table.shortened("time_s", 1e3)},
        )  # fmt: skip
        yield table.of(
            "Drift of constraints that are imposed on the accelerations only",
            [r for r in self.rows if r.drift],
            {**run, "largest constraint violation": table.shortened("drift")},
        )
        yield from table.not_run(
            {f"{r.problem}, {r.method}": r.message for r in self.rows if r.message}
        )

    def drawn(self) -> tuple[Any, ...]:
        """Return the work-precision diagram: time against relative error, one panel per problem."""
        points = ((r.problem, r.method, 10**-r.scd, r.time_s) for r in self.rows if r.scd > -inf)
        return "work_precision", points, "relative error [1]"


def bench_ivp(
    *,
    quick: bool = False,
    problems: Sequence[Problem] = PROBLEMS,
    progress: table.Progress = None,
) -> IvpBenchmark:
    """Measure all problems.

    Args:
        quick: rtol 1e-6 only.
        problems: problems to measure.
        progress: called with the current item and the fraction done.
    """
    rows: list[IvpRow] = []
    for problem in table.each(problems, progress, lambda problem: problem.name):
        model = problem.model()
        for method in METHODS:
            tolerances = TOLERANCES[:1] if quick or method in problem.laborious else TOLERANCES
            rows += [measure(problem, model, method, rtol) for rtol in tolerances]
    return IvpBenchmark(tuple(rows))


def measure(
    problem: Problem, model: Model, method: str, rtol: float, backend: str | None = None
) -> IvpRow:
    """Integrate one problem and count its correct digits.

    Args:
        problem, model: problem and its equations.
        method, rtol: as in `simulate`.
        backend: as in `simulate`; default: compiled if there is a compiler.
    """
    engine = backend or ("compiled" if find_compiler() else "vm")
    solve = partial(
        simulate, model, problem.t_end, rtol=rtol, method=method, backend=engine, samples=2,
        throw=False,
    )  # fmt: skip
    solve()
    time_s, run = best_time(solve)
    scd, worst = correct_digits(problem, run) if run.status.ok else (-inf, "")
    return IvpRow(
        problem=problem.name,
        method=method,
        rtol=rtol,
        scd=scd,
        worst=worst,
        wanted=problem.digits.get(rtol, 0),
        steps=run.statistics.steps,
        rejections=run.statistics.rejections,
        time_s=time_s,
        drift=_drift(problem, run),
        message="" if run.status.ok else run.message,
    )


def correct_digits(problem: Problem, run: Trajectory) -> tuple[float, str]:
    """Return the correct digits of the worst signal at the end, and its name."""
    end = run.final
    errors = {
        name: abs(end[name] - value) / abs(value) for name, value in problem.reference.items()
    }
    worst = max(errors, key=lambda name: errors[name])
    # rounding limits the digits of a double
    return float(-np.log10(max(errors[worst], float(np.finfo(float).eps)))), worst


def _drift(problem: Problem, run: Trajectory) -> float:
    """Return the largest value of a constraint at accepted steps."""
    if not problem.drift or run.step_times.size < 2:
        return 0.0
    at = run.at(run.step_times)
    return max(float(np.abs(at[name]).max()) for name in problem.drift)
