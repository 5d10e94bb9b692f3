"""Choice of a method: run time against error of the integration methods on the user's model."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from math import exp, inf, isnan, log, nan
from pathlib import Path
from time import process_time
from typing import TYPE_CHECKING, Any, NamedTuple, final

import numpy as np
from numpy.typing import ArrayLike

from symfric.foundation import checks
from symfric.foundation.files import write_table
from symfric.foundation.programs import find_compiler
from symfric.foundation.shown import Showing, Shown, TextTable, among
from symfric.foundation.status import SolveError, Status
from symfric.integrator import Input, Trajectory, simulate
from symfric.integrator.methods.tableaux import ADAPTIVE
from symfric.model import Model, check_model

if TYPE_CHECKING:
    from matplotlib.figure import Figure

METHODS = ("rodas5p", "rodas4p", "radau5", "radau9")
"""Methods that are compared by default."""
RTOLS = (1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10)
"""Relative tolerances by default."""
FINEST = 1e-13
"""Smallest relative tolerance of the reference, which is that of `simulate`."""
RESOLVED = 3.0
"""Ratio to the error of the reference above which a measured error is known within 50 %."""


class WorkPoint(NamedTuple):
    """Cost and error of one method at one tolerance.

    Attributes:
        method: name of the method.
        rtol: relative tolerance; a model with events is integrated at most at that of its events.
        error: largest relative error of a compared signal.
        time_s: shortest processor time of a complete call [s].
        steps, rejections: numbers of accepted and rejected steps.
        evaluations, factorisations: numbers of right-hand sides and of LU factorisations.
        resolved: False if the error is less than three times that of the reference; the point is
            then neither drawn nor used by `WorkPrecision.time_at`.
    """

    method: str
    rtol: float
    error: float
    time_s: float
    steps: int
    rejections: int
    evaluations: int
    factorisations: int
    resolved: bool


@final
@dataclass(frozen=True, eq=False, repr=False)
class WorkPrecision(Showing):
    """Run time against error, returned by `work_precision`.

    `print` shows the time of each method at powers of ten of the error; `table` has all points.

    Attributes:
        model: name of the model.
        span: start and end of the runs [s].
        engine: "compiled" or "vm", the same for all runs.
        signals: names of the compared signals.
        samples: number of times of each result.
        rounds: number of interleaved measurements of each point.
        reference: description of the reference.
        reference_error: estimated error of the reference.
        points: measured points, by method and then by tolerance.
        failed: method and tolerance -> reason, for runs that failed or were refused.
    """

    model: str
    span: tuple[float, float]
    engine: str
    signals: tuple[str, ...]
    samples: int
    rounds: int
    reference: str
    reference_error: float
    points: tuple[WorkPoint, ...]
    failed: Mapping[str, str]

    @property
    def methods(self) -> tuple[str, ...]:
        """Names of the measured methods."""
        return tuple(dict.fromkeys(point.method for point in self.points))

    @property
    def table(self) -> list[dict[str, Any]]:
        """Points as plain numbers and texts with the engine, for CSV and data frames."""
        return [{"engine": self.engine, **point._asdict()} for point in self.points]

    def time_at(self, method: str, error: float) -> float:
        """Return the time [s] in which `method` reaches `error`, interpolated log-log.

        The result is NaN if no resolved point of the method has an error this small. If all points
        are more accurate, it is the time of the fastest point.
        """
        checks.choice("time_at: method", method, self.methods)
        error = checks.number("time_at: error", error, above=0.0)
        return time_at([(p.error, p.time_s) for p in self._line(method)], error)

    def _line(self, method: str) -> list[WorkPoint]:
        """Return the resolved points of a method."""
        return [point for point in self.points if point.method == method and point.resolved]

    def shown(self) -> Shown:
        """Return the time of each method at powers of ten of the error."""
        errors = [p.error for p in self.points if p.resolved and p.error > 0.0]
        first, last = (int(np.ceil(np.log10(end(errors, default=1.0)))) for end in (max, min))
        rows: list[tuple[str, ...]] = []
        for error in (10.0**k for k in range(first, last - 1, -1)):
            times = [1e3 * self.time_at(method, error) for method in self.methods]
            if not all(map(isnan, times)):
                cells = ("-" if isnan(time) else f"{time:.3g}" for time in times)
                rows.append((f"{error:.0e}", *cells))
        start, end, hidden = *self.span, sum(not p.resolved for p in self.points)
        said = [f"{name}: {reason}" for name, reason in self.failed.items()]
        if hidden:
            said.append(
                f"{hidden} of {len(self.points)} points are not shown: their error is below "
                f"{RESOLVED:g} times that of the reference"
            )
        header = ("error", *(f"{method} [ms]" for method in self.methods))
        return Shown(
            f"work and precision of '{self.model}' from {start:g} to {end:g} s, {self.engine}",
            (
                f"time: a call with {self.samples} results, processor time, least of "
                f"{self.rounds} interleaved rounds",
                f"error: largest error relative to the largest value, of {among(self.signals)}",
                f"reference: {self.reference}, with an error of {self.reference_error:.0e}",
            ),
            TextTable(header, tuple(rows), numbers=tuple(range(1, len(header)))),
            tuple(said),
        )

    def plot(self, path: str | Path | None = None) -> Figure:
        """Draw time against error with a curve for each method; save the figure to `path` if given.

        Errors below that of the reference are hatched.
        """
        from symfric.foundation.panels import grid, save  # noqa: PLC0415  (slow to import)
        from symfric.foundation.style import MARKERS, line  # noqa: PLC0415  (slow to import)

        figure, ((axis,),) = grid(1, 1)
        for k, method in enumerate(self.methods):
            points = self._line(method)
            axis.loglog(
                [point.error for point in points], [1e3 * point.time_s for point in points],
                marker=MARKERS[k % len(MARKERS)], markersize=4, label=method, **line(k),
            )  # fmt: skip
        left, right = axis.get_xlim()
        unknown = RESOLVED * self.reference_error
        if left < unknown < right:
            axis.axvspan(left, unknown, facecolor="none", edgecolor="0.8", hatch="//", zorder=0)
        axis.set_xlim(right, left)
        axis.set_xlabel(f"relative error of {among(self.signals)}")
        axis.set_ylabel(f"processor time [ms], {self.engine}")
        axis.set_title(self.model, fontsize="medium")
        axis.legend()
        return save(figure, path)

    def thumbnail(self) -> Figure:
        """Return the figure."""
        return self.plot()

    def to_csv(self, path: str | Path) -> None:
        """Write the points as CSV, one per line."""
        head = ("engine", *WorkPoint._fields)
        write_table(path, head, (row.values() for row in self.table))


def time_at(points: Iterable[tuple[float, float]], error: float) -> float:
    """Return the time to reach `error`, interpolated log-log between points (error, time).

    Only points that are faster than all more accurate ones count. NaN if no point reaches `error`.
    """
    best: list[tuple[float, float]] = []
    for e, t in sorted(points):
        if e > 0 and t < (best[-1][1] if best else inf):
            best.append((e, t))
    below, above = ([p for p in best if (p[0] > error) is side] for side in (False, True))
    if not below:
        return nan
    if not above:
        return below[-1][1]
    at, times = np.log([below[-1], above[0]]).T
    return exp(np.interp(log(error), at, times))


def work_precision(
    model: Model,
    t_end: float,
    *,
    t_start: float = 0.0,
    x0: Mapping[str, float] | None = None,
    u: Mapping[str, Input] | None = None,
    p: Mapping[str, float] | None = None,
    methods: Sequence[str] = METHODS,
    rtols: Sequence[float] = RTOLS,
    signals: Sequence[str] | None = None,
    t_eval: ArrayLike | None = None,
    samples: int = 401,
    backend: str | None = None,
    rounds: int = 5,
    progress: Callable[[float], None] | None = None,
) -> WorkPrecision:
    """Measure run time against error for several methods and tolerances on `model`.

        error = max over signals and times of |x - x_reference| / max |x_reference|

    One engine makes all runs. An equal call precedes every timed call, so that neither building nor
    compiling is measured. The rounds alternate between all points, so that other load of the
    machine affects all methods equally. The time of a point is the shortest processor time of a
    call of `simulate`, including the evaluation of `signals` at the result times.

    The reference is a run of radau5 at a hundredth of the smallest of `rtols`, or 1e-13 if that is
    larger. Its error is estimated by the difference from a run of rodas5p, an independent formula,
    at the same tolerance. Errors below three times this estimate are unresolved.

    Args:
        model, t_end, t_start, x0, u, p, t_eval, samples: as in `simulate`.
        methods: names of methods with error control, or "auto".
        rtols: relative tolerances, in any order.
        signals: names of compared signals; by default all states. The error of a bristle that slips
            within microseconds is much larger than that of the motion.
        backend: "compiled" or "vm"; by default "compiled" if there is a C compiler.
        rounds: number of measurements of each point.
        progress: called with the fraction done.

    Returns:
        The measured points, with text, figure and CSV.

    Raises:
        ValueError: bad input.
        SolveError: the reference failed.
        KeyboardInterrupt: a run was interrupted (Ctrl-C).

    Limits: an error is meaningless if the motion is chaotic over the span. A method that fails at a
    tolerance, or cannot integrate the model, is listed in `failed`.
    """
    where = "work_precision"
    check_model(where, model)
    methods = checks.names(f"{where}: methods", methods, ["auto", *ADAPTIVE])
    given = {
        checks.number(f"{where}: rtols", rtol, lower=1e-12, upper=0.1)
        for rtol in checks.many(f"{where}: rtols", rtols, "relative tolerances")
    }
    tolerances = sorted(given, reverse=True)  # the curves are drawn in this order
    if not methods or not tolerances:
        raise ValueError(f"{where}: expected at least one method and one tolerance, got none")
    engine = "compiled" if find_compiler() else "vm"
    if backend is not None:
        engine = checks.choice(f"{where}: backend", backend, ["compiled", "vm"])
    rounds = checks.count(f"{where}: rounds", rounds)
    if progress is not None:
        checks.function(f"{where}: progress", progress, "a function of the fraction done")

    def run(method: str, rtol: float) -> Trajectory:
        made = simulate(
            model, t_end, t_start=t_start, x0=x0, u=u, p=p, rtol=rtol, t_eval=t_eval,
            samples=samples, method=method, backend=engine,
        )  # fmt: skip
        if made.status is Status.INTERRUPTED:  # its time is not that of a run
            raise KeyboardInterrupt
        return made

    finest = max(FINEST, min(tolerances) / 100)
    exact, other = run("radau5", finest), run("rodas5p", finest)
    names = tuple(variable.name for variable in model.x)
    if signals is not None:
        names = checks.names(f"{where}: signals", signals, exact.units) or names
    own = distance(names, other, exact)
    points, failed = _measured(run, methods, tolerances, names, exact, rounds, progress)
    return WorkPrecision(
        model.name, exact.span, engine, names, exact.t.size, rounds,
        f"Radau5 at rtol {finest:.0e}", own,
        tuple(p._replace(resolved=p.error > RESOLVED * own) for p in points), failed,
    )  # fmt: skip


def distance(names: Iterable[str], one: Trajectory, exact: Trajectory) -> float:
    """Return the largest difference of a signal relative to its largest value; inf if cut short."""
    if one.t.size < exact.t.size:
        return inf
    return max(
        float(np.abs(one[name] - exact[name]).max() / (np.abs(exact[name]).max() or 1.0))
        for name in names
    )


def _measured(
    run: Callable[[str, float], Trajectory],
    methods: Sequence[str],
    rtols: Sequence[float],
    names: Sequence[str],
    exact: Trajectory,
    rounds: int,
    progress: Callable[[float], None] | None,
) -> tuple[list[WorkPoint], dict[str, str]]:
    """Return the points, with the shortest times of interleaved rounds, and reasons of failures."""
    found: dict[tuple[str, float], WorkPoint] = {}
    failed: dict[str, str] = {}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # loose tolerances are measured deliberately
        for method, rtol in product(methods, rtols):
            try:
                made = run(method, rtol)
            except (SolveError, ValueError) as error:
                failed[f"{method} at {rtol:.0e}"] = str(error)
                continue
            cost = made.statistics
            found[method, rtol] = WorkPoint(
                method, rtol, distance(names, made, exact), inf, cost.steps, cost.rejections,
                cost.evaluations, cost.factorisations, False,
            )  # fmt: skip
        for k in range(rounds):
            for (method, rtol), point in found.items():
                run(method, rtol)  # the settings of the last few calls are cached
                begin = process_time()
                made = run(method, rtol)
                for name in names:
                    made[name]
                spent = process_time() - begin
                found[method, rtol] = point._replace(time_s=min(point.time_s, spent))
            if progress is not None:
                progress((k + 1) / rounds)
    return [*found.values()], failed
