"""Solver prepared for a nonlinear program with any start and any parameters, and time limits."""

import re
from collections.abc import Callable, Mapping
from concurrent.futures import Executor
from dataclasses import dataclass, field, replace
from time import perf_counter
from typing import Any, NamedTuple, final

import casadi as ca
import numpy as np

from ocp.formulation.phase import Array
from ocp.solving.watch import FAR, FEASIBLE, Hook, Report, Seen, Watch, in_stage, interrupts
from ocp.transcription.program import (
    Iterate,
    Outcome,
    Place,
    Program,
    SolverStatistics,
    outside,
    worst_of,
)
from ocp.transcription.transcribe import Transcription
from symfric.foundation.status import Status

Option = str | float | int
Result = Mapping[str, ca.DM] | None
"""Results of a solver by name; None if it failed without any."""
LEAST = 1e-3
"""Smallest time limit of a solver [s], with which it stops at once."""
OVERDETERMINED = "Not_Enough_Degrees_Of_Freedom"
"""Return code of Ipopt for a program with more equations than unknowns."""
HINTS: dict[str, str] = {
    OVERDETERMINED: (
        "There are more equations than unknowns; use fewer end and via conditions, or more "
        "intervals."
    ),
    "Insufficient_Memory": "The memory is exhausted; use fewer intervals.",
}
"""Return code -> message, for codes that are more specific than the status."""
TRIED = (
    "It happened at a point tried by the solver, not at an iterate; bound the states to where "
    "the equations are defined."
)


class Built(NamedTuple):
    """CasADi solver and the hook that monitors it.

    Attributes:
        kept: callbacks that CasADi uses without holding a reference.
    """

    function: ca.Function
    hook: Hook
    kept: tuple[ca.Callback, ...] = ()


def reason_of(error: Exception) -> str:
    """Return the last line of an error of CasADi without its source location."""
    lines = [line for line in str(error).strip().splitlines() if line.strip()]
    return re.sub(r"^\S*:\d+: ", "", lines[-1]).strip()


def refused_options(solver: str, options: Mapping[str, Option], reason: str) -> ValueError:
    """Return an error for refused options, which names only those in `reason` if possible."""
    named = {name: value for name, value in options.items() if name in reason} or dict(options)
    return ValueError(f"{solver}: expected options of {solver}, got {named!r}; {reason}")


At = Callable[[Array, Place], str]
"""(w, place) -> text for the time of the place."""


def worst(program: Program, point: Seen, at: At) -> str:
    """Return a message about the most violated row or bound, or about the cost if feasible."""
    far = point.violation
    if far <= FEASIBLE:
        return f"The best iterate satisfies all constraints, at a cost of {point.f:.6g}."
    rows = outside(point.g, program.lower_g, program.upper_g)
    if rows.max(initial=0.0) >= far:
        place = program.rows[int(np.argmax(rows))]
        name = place.name
    else:
        bounds = outside(point.w, program.lower_w, program.upper_w)
        place = program.unknowns[int(np.argmax(bounds))]
        name = f"the bound on {place.name}"
    return f"Most violated is {name} {at(point.w, place)}, by {far:.3g} in scaled units."


def not_finite(program: Program, w: Array, values: Array, at: At) -> str:
    """Return a message about an equation or derivative that is not finite at `w`, or ""."""
    cost, slope = program.gradient(w, values)
    g, jacobian = program.jacobian(w, values)
    bad = ~np.isfinite(g.full().ravel())
    if bad.any():
        place = program.rows[int(np.argmax(bad))]
        return f"It is {place.name} {at(w, place)}."
    if not np.isfinite(float(cost)):
        return "It is the cost."
    bad = ~np.isfinite(np.array(jacobian.nonzeros()))
    if bad.any():
        rows, columns = jacobian.sparsity().get_triplet()
        k = int(np.argmax(bad))
        row, unknown = program.rows[rows[k]], program.unknowns[columns[k]]
        return f"It is the derivative of {row.name} in {unknown.name} {at(w, row)}."
    bad = ~np.isfinite(ca.densify(slope).full().ravel())
    if bad.any():
        unknown = program.unknowns[int(np.argmax(bad))]
        return f"It is the derivative of the cost in {unknown.name} {at(w, unknown)}."
    return ""


def as_fraction(w: Array, place: Place) -> str:
    """Return the time of a place as a fraction of the duration, which need not be known."""
    del w
    return f"at {place.fraction:.4g} of the duration"


@final
@dataclass(frozen=True, eq=False)
class Prepared:
    """Solver prepared for a program by `solver.prepared(program)`, for one run at a time.

    Attributes:
        program: the program.
        solver: name of the solver for messages.
        options: the user's options.
        build: function that creates the CasADi solver and its hook; its argument is True if the
            start has multipliers.
        read: function from the statistics of CasADi to the return code and the status.
        max_time: wall time [s] after which a run is stopped.
        told_time: total time limit [s] for messages if `max_time` is the remaining time.
    """

    program: Program
    solver: str
    options: Mapping[str, Option]
    build: Callable[[bool], Built]
    read: Callable[[Mapping[str, Any]], tuple[str, Status]]
    max_time: float | None = None
    told_time: float | None = None
    _built: dict[bool, Built] = field(default_factory=dict[bool, Built])

    def run(
        self,
        start: Iterate,
        values: Array | None = None,
        progress: Report | None = None,
        warm: bool = False,
        at: At = as_fraction,
        begin: float | None = None,
    ) -> Outcome:
        """Solve from `start` and return the outcome; a failed solve raises no exception.

        Args:
            start: unknowns and multipliers; the latter are used only if `warm`.
            values: values of the parameters of the program, by default `program.values`.
            progress: function called with a `Progress` after each iteration. Ctrl-C, or an
                exception in the function, stops the solver after the iteration. The outcome then
                has the status INTERRUPTED, the best iterate, and the exception as `cause`.
            warm: True to start near a solution with its multipliers.
            at: function (w, place) -> text for the time of a place, for the message.
            begin: value of `perf_counter` when building the program began, by default now.

        Raises:
            ValueError: unknown options, or a start that is not finite.
        """
        begin = perf_counter() if begin is None else begin
        program = self.program
        values = program.values if values is None else values
        w = np.clip(_finite(start, program), program.lower_w, program.upper_w)
        watch = Watch(program, progress, self.max_time)
        result, answer, status = None, OVERDETERMINED, Status.INFEASIBLE
        lower, upper = program.bounds
        overdetermined = (lower == upper).sum() > w.size  # refused by all solvers
        if not overdetermined and warm not in self._built:
            self._built[warm] = self.build(warm)
        built = perf_counter()
        if not overdetermined:
            result, answer, status = self._called(self._built[warm], watch, {
                "lbx": program.lower_w, "ubx": program.upper_w, "lbg": program.lower_g,
                "ubg": program.upper_g, "x0": w, "p": values, "lam_x0": start.lam_w,
                "lam_g0": start.lam_g,
            })  # fmt: skip
        if watch.halt is not None:
            status = watch.halt
        elif not status.ok and watch.last is not None and not watch.last.finite:
            status = Status.NOT_FINITE
        point = self._point(result, watch, status, w, values)
        return Outcome(
            iterate=Iterate(point.w, point.lam_w, point.lam_g),
            cost=point.f,
            violation=point.violation,
            status=status,
            sentence=self._sentence(watch, point, status, answer, values, at),
            cycles=not status.ok and watch.cycles,
            statistics=SolverStatistics(
                unknowns=w.size,
                constraints=program.g.numel(),
                jacobian_nonzeros=program.jacobian.nnz_out(1),
                hessian_nonzeros=program.hessian.nnz_out(0),
                iterations=watch.iterations,
                build_time=built - begin,
                solve_time=perf_counter() - built,
            ),
            cause=watch.error,
        )

    def _called(
        self, solver: Built, watch: Watch, arguments: Mapping[str, Array]
    ) -> tuple[Result, str, Status]:
        """Return the result of the solver, its return code and its status."""
        solver.hook.watch = watch
        try:
            with interrupts(watch):
                result = solver.function(**arguments)
        except RuntimeError as error:  # some solvers check options and structure only here
            reason = reason_of(error)
            if "option" in reason.lower():
                raise refused_options(self.solver, self.options, reason) from None
            return None, reason, Status.SOLVER_FAILED
        finally:
            solver.hook.watch = None
        if watch.error is not None and not isinstance(watch.error, Exception):
            raise watch.error
        stats = solver.function.stats()
        watch.counted = int(stats["iter_count"])
        answer, status = self.read(stats)
        if answer == "Invalid_Option":
            reason = "they do not go together, or need a missing library"
            raise refused_options(self.solver, self.options, reason)
        return result, answer, status

    def _point(self, result: Result, watch: Watch, status: Status, w: Array, values: Array) -> Seen:
        """Return the solution, or the best known point of a failed solve."""
        program = self.program
        if status.ok and result is not None:
            names = ("x", "f", "g", "lam_x", "lam_g")
            x, f, g, lam_x, lam_g = (result[n].full().ravel() for n in names)
            return Seen(x, float(f[0]), g, lam_x, lam_g, worst_of(program, x, g))
        if watch.best is not None:
            return watch.best
        # No iterate is known, and the result is zero after some errors, so use the start.
        f, g = program.gradient(w, values)[0], program.jacobian(w, values)[0].full().ravel()
        lam_w, lam_g = np.zeros(w.size), np.zeros(g.size)
        return Seen(w, float(f), g, lam_w, lam_g, worst_of(program, w, g))

    def _sentence(
        self, watch: Watch, point: Seen, status: Status, answer: str, values: Array, at: At
    ) -> str:
        """Return a message with the reason for the end, the worst row at `point`, and a remedy."""
        if status.ok:
            return status.value
        count, limit = watch.iterations, self.told_time or self.max_time
        reason = HINTS.get(answer, status.value)
        if watch.error is not None:
            reason = f"Stopped by an exception in progress after {count} iterations: "
            reason += f"{watch.error!r}."
        elif watch.halt is Status.INTERRUPTED:
            reason = f"Stopped by the user after {count} iterations; the result is the best "
            reason += "iterate."
        elif status is Status.TIME_LIMIT:
            reason = "The time limit" if limit is None else f"The time limit of {limit:g} s"
            reason += f" ended {self.solver} after {count} iterations; allow more time or continue "
            reason += "from the result, which is the best iterate."
        elif watch.halt is Status.UNBOUNDED:
            reason = (
                f"{status.value} Unknowns were {FAR:g} times their nominal values after {count} "
            )
            reason += "iterations; if such values are right, give larger nominal ones."
        if watch.halt is None:
            reason += f" ({self.solver} after {count} iterations: {answer}.)"
        if status is Status.NOT_FINITE:
            tried = [seen for seen in (watch.last, point) if seen is not None]
            named = (not_finite(self.program, seen.w, values, at) for seen in tried)
            return f"{reason} {next(filter(None, named), TRIED)}"
        if watch.cycles:
            reason += " The last iterations repeat without improvement, as at a kink."
        return f"{reason} {worst(self.program, point, at)}"


@final
@dataclass(frozen=True)
class Supervisor:
    """Total time limit and progress of several solves; the time starts at construction.

    Attributes:
        max_time: total wall time [s], or None for no limit.
        progress: function called with a `Progress` after each iteration.
        executor: executor of solves from several starts; None: one after the other.
    """

    max_time: float | None = None
    progress: Report | None = None
    executor: Executor | None = None
    started: float = field(default_factory=perf_counter)

    @property
    def left(self) -> float | None:
        """Remaining time [s]; None without a limit."""
        if self.max_time is None:
            return None
        return max(LEAST, self.max_time - (perf_counter() - self.started))

    @property
    def over(self) -> bool:
        """True if no time remains."""
        return self.left == LEAST

    def run(
        self, transcription: Transcription, prepared: Prepared, start: Iterate, stage: str,
        values: Array | None = None, warm: bool = False, begin: float | None = None,
    ) -> Outcome:  # fmt: skip
        """Run `prepared` within the remaining time, and report progress under the name `stage`."""
        left = self.left
        if left is not None and (prepared.max_time is None or prepared.max_time > left):
            prepared = replace(prepared, max_time=left, told_time=self.max_time)
        values = transcription.program.values if values is None else values
        report = in_stage(self.progress, stage, transcription)
        return prepared.run(start, values, report, warm, transcription.when, begin)


def _finite(start: Iterate, program: Program) -> Array:
    """Return the initial unknowns; raise ValueError if they are not finite."""
    if not np.isfinite(start.w).all():
        place = program.unknowns[int(np.argmin(np.isfinite(start.w)))]
        raise ValueError(
            f"start: expected finite numbers, got NaN or infinity for {place.name} "
            f"{as_fraction(start.w, place)}"
        )
    return start.w
