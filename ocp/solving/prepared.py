"""A solver prepared for a nonlinear program, for any start and any parameters."""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from time import perf_counter
from typing import Any, final

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike, NDArray

from ocp.solving.watch import (
    OVERDETERMINED,
    At,
    Halt,
    Hook,
    Seen,
    Watch,
    interrupts,
    plainly,
    sentence,
)
from ocp.transcription.program import (
    Iterate,
    Outcome,
    Program,
    Report,
    SolverStatistics,
    in_stage,
    outside,
    worst_of,
)
from ocp.transcription.transcription import Transcription
from symfric.foundation import checks
from symfric.foundation.status import Status

Array = NDArray[np.float64]
Option = str | float | int
LEAST = 1e-3
"""Least time limit of a solver [s]; it then stops at once."""


@final
@dataclass(frozen=True, eq=False)
class Built:
    """A CasADi solver and the hook that monitors it.

    Attributes:
        kept: callbacks that CasADi uses but does not keep alive.
    """

    function: ca.Function
    hook: Hook
    kept: tuple[ca.Callback, ...] = ()


HALTED = {
    Halt.USER: Status.INTERRUPTED,
    Halt.ERROR: Status.INTERRUPTED,
    Halt.TIME: Status.TIME_LIMIT,
    Halt.FAR: Status.UNBOUNDED,
}
"""Reason to stop -> status of the solve."""

LEAN: dict[str, Any] = {
    "print_time": False,
    "show_eval_warnings": False,
    "calc_lam_p": False,
    "no_nlp_grad": True,
}
"""Options for no output and no unused derivatives."""


def made(
    solver: str,
    plugin: str,
    program: Program,
    options: Mapping[str, Option],
    common: Mapping[str, Any],
) -> ca.Function:
    """Return the CasADi solver of `program`; the user's `options` override `common`.

    Raises:
        ValueError: options that the solver refuses, with its name and message.
    """
    prefix = "" if plugin == "sqpmethod" else f"{plugin}."
    own = {f"{prefix}{name}": value for name, value in options.items()}
    try:
        return ca.nlpsol("solver", plugin, program.nlp, LEAN | dict(common) | own)
    except (RuntimeError, NotImplementedError) as error:
        if not options:
            raise
        raise refused_options(solver, options, reason_of(error)) from None


def reason_of(error: Exception) -> str:
    """Return the last line of an error of CasADi, without the place in its source."""
    lines = [line for line in str(error).strip().splitlines() if line.strip()]
    return re.sub(r"^\S*:\d+: ", "", lines[-1]).strip()


def refused_options(solver: str, options: Mapping[str, Option], reason: str) -> ValueError:
    """Return the error for refused options, restricted to those in the reason if possible."""
    named = {name: value for name, value in options.items() if name in reason} or dict(options)
    return ValueError(f"{solver}: expected options of {solver}, got {named!r}; {reason}")


@final
@dataclass(frozen=True, eq=False)
class Prepared:
    """A solver and a program; made by `solver.prepared(program)`. One run at a time.

    Attributes:
        program: the program.
        solver: the name of the solver, for messages.
        options: those of the user.
        build: function that makes the CasADi solver and its hook; its argument is True if the
            start has multipliers.
        read: (statistics of CasADi) -> the solver's return code and its status.
        max_time: wall time [s] after which a run is stopped.
        told_time: the limit in messages, if `max_time` is the rest of it.
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
        values: ArrayLike | None = None,
        progress: Report | None = None,
        warm: bool = False,
        at: At = plainly,
    ) -> Outcome:
        """Solve from `start`; a failure is an outcome, not an exception.

        Args:
            start: unknowns and multipliers; the latter are used if `warm`.
            values: numbers of the parameters of the program, `program.values` if none.
            progress: called with a `Progress` after each iteration. Ctrl-C stops the solver after
                the iteration, and so does an exception here; either way the outcome, with status
                INTERRUPTED, holds the best iterate, and `cause` the exception.
            warm: start near a solution, with the multipliers.
            at: (w, place) -> text for the time of a place, for the message.

        Raises:
            ValueError: unknown options, or a start of the wrong size.
        """
        begin = perf_counter()
        program = self.program
        numbers = program.values if values is None else _numbers(values, program)
        w = np.clip(_start(start, program), program.lower_w, program.upper_w)
        watch = Watch(program, progress, self.max_time)
        result, answer, status = None, OVERDETERMINED, Status.INFEASIBLE
        if _equations(program) > program.w.numel():
            built = begin  # no solver takes it
        else:
            solver = self._of(warm)
            built = perf_counter()
            sides = {"lbx": program.lower_w, "ubx": program.upper_w}
            sides |= {"lbg": program.lower_g, "ubg": program.upper_g}
            begins = {"x0": w, "p": numbers, "lam_x0": start.lam_w, "lam_g0": start.lam_g}
            result, answer, status = self._called(solver, watch, sides | begins)
        if watch.halt is not None:
            status = HALTED[watch.halt]
        elif not status.ok and watch.last is not None and not watch.last.finite:
            status = Status.NOT_FINITE
        point = self._point(result, watch, status, w, numbers)
        limit = self.told_time or self.max_time
        return Outcome(
            iterate=Iterate(point.w, point.lam_w, point.lam_g),
            cost=point.f,
            violations=outside(point.g, program.lower_g, program.upper_g),
            bound_violations=outside(point.w, program.lower_w, program.upper_w),
            status=status,
            sentence=sentence(
                program, watch, point, status, answer, self.solver, limit, numbers, at
            ),
            answer=answer,
            cycles=not status.ok and watch.cycles,
            statistics=SolverStatistics(
                unknowns=program.w.numel(),
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
    ) -> tuple[Mapping[str, ca.DM] | None, str, Status]:
        """Return the result of the solver, its return code and its status."""
        solver.hook.watch = watch
        try:
            with interrupts(watch):
                result = solver.function(**arguments)
        except RuntimeError as error:  # some solvers check options and structure only now
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
            raise refused_options(
                self.solver, self.options, "they do not go together, or need a missing library"
            )
        return result, answer, status

    def _of(self, warm: bool) -> Built:
        if warm not in self._built:
            self._built[warm] = self.build(warm)
        return self._built[warm]

    def _point(
        self,
        result: Mapping[str, ca.DM] | None,
        watch: Watch,
        status: Status,
        w: Array,
        values: Array,
    ) -> Seen:
        """Return the solution, or else the best known point."""
        program = self.program
        if status.ok and result is not None:
            names = ("x", "f", "g", "lam_x", "lam_g")
            x, f, g, lam_x, lam_g = (result[n].full().ravel() for n in names)
            return Seen(x, float(f[0]), g, lam_x, lam_g, worst_of(program, x, g))
        if watch.best is not None:
            return watch.best
        # No iterate is known, and after some errors the result is zero: use the start.
        f, g = program.gradient(w, values)[0], program.jacobian(w, values)[0].full().ravel()
        lam_w, lam_g = np.zeros(w.size), np.zeros(g.size)
        return Seen(w, float(f), g, lam_w, lam_g, worst_of(program, w, g))


@final
@dataclass(frozen=True)
class Clock:
    """Timer of a total time limit, started when created.

    Attributes:
        allowed: total wall time [s], or None for no limit.
    """

    allowed: float | None = None
    started: float = field(default_factory=perf_counter)

    @property
    def left(self) -> float | None:
        """Remaining time [s]; None without a limit."""
        if self.allowed is None:
            return None
        return max(LEAST, self.allowed - (perf_counter() - self.started))

    @property
    def over(self) -> bool:
        """True if no time remains."""
        return self.left == LEAST

    def within(self, prepared: Prepared) -> Prepared:
        """Return `prepared` with the remaining time as its limit, if that is less than its own."""
        left = self.left
        if left is None or (prepared.max_time is not None and prepared.max_time <= left):
            return prepared
        return replace(prepared, max_time=left, told_time=self.allowed)

    def run(
        self,
        transcription: Transcription,
        prepared: Prepared,
        start: Iterate,
        progress: Report | None,
        stage: str,
        values: ArrayLike | None = None,
    ) -> Outcome:
        """Solve within the remaining time, and report progress as that of a `stage`."""
        return self.within(prepared).run(
            start, values, in_stage(progress, stage), at=transcription.when
        )


def _numbers(values: ArrayLike, program: Program) -> Array:
    """Return the values of the parameters."""
    found = checks.array("values", values)
    if found.size != program.p.numel():
        raise ValueError(
            f"values: expected {program.p.numel()} numbers of parameters, got {found.size}; "
            "transcription.values(...) returns them"
        )
    return found


def _equations(program: Program) -> int:
    """Return the number of rows and unknowns with two equal bounds."""
    rows = program.lower_g == program.upper_g
    return int(rows.sum() + (program.lower_w == program.upper_w).sum())


def _start(start: Iterate, program: Program) -> Array:
    """Return the initial unknowns."""
    n, m = program.w.numel(), program.g.numel()
    sizes = (start.w.size, start.lam_w.size, start.lam_g.size)
    if sizes != (n, n, m):
        raise ValueError(f"start: expected {n} unknowns and {n} + {m} multipliers, got {sizes}")
    if not np.isfinite(start.w).all():
        place = program.unknowns[int(np.argmin(np.isfinite(start.w)))]
        raise ValueError(
            f"start: expected finite numbers, got NaN or infinity for {place.name} "
            f"{plainly(start.w, place)}"
        )
    return start.w
