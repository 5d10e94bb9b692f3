"""Ipopt through CasADi: options, progress, interrupts, and what its answers mean."""

import re
import signal
import threading
from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from time import perf_counter
from types import FrameType
from typing import final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ocp.transcribe import Transcription
from symfric.foundation.status import Status

Array = NDArray[np.float64]
Option = str | float | int

ANSWERS: dict[str, Status] = {
    "Solve_Succeeded": Status.SOLVED,
    "Feasible_Point_Found": Status.SOLVED,
    "Solved_To_Acceptable_Level": Status.ACCEPTABLE,
    "Infeasible_Problem_Detected": Status.INFEASIBLE,
    "Maximum_Iterations_Exceeded": Status.MAX_ITERATIONS,
    "User_Requested_Stop": Status.INTERRUPTED,
    "Invalid_Number_Detected": Status.NOT_FINITE,
}
"""What Ipopt answers -> how the solve ended; everything else is SOLVER_FAILED."""

QUIET: dict[str, Option] = {"print_level": 0, "sb": "yes"}
WARM: dict[str, Option] = {
    "warm_start_init_point": "yes",
    "mu_init": 1e-6,
    "warm_start_bound_push": 1e-9,
    "warm_start_bound_frac": 1e-9,
    "warm_start_slack_bound_push": 1e-9,
    "warm_start_slack_bound_frac": 1e-9,
    "warm_start_mult_bound_push": 1e-9,
}


@final
@dataclass(frozen=True)
class Progress:
    """The optimisation after an iteration.

    Attributes:
        iteration: how many so far.
        cost: J at this iterate.
        violation: largest violation of an equation or constraint, scaled.
    """

    iteration: int
    cost: float
    violation: float


@final
@dataclass(frozen=True, eq=False)
class Iterate:
    """Unknowns and multipliers: all it takes to start again from here."""

    w: Array
    lam_w: Array
    lam_g: Array


@final
@dataclass(frozen=True)
class SolverStatistics:
    """What an optimisation cost.

    Attributes:
        unknowns, constraints: size of the nonlinear program.
        jacobian_nonzeros, hessian_nonzeros: of the constraints; of the Lagrangian (one triangle).
        iterations: of Ipopt.
        build_time, solve_time: wall time [s] for making the program and its derivatives, and for
            solving it.
        verify_time: wall time [s] of the re-simulation.
    """

    unknowns: int
    constraints: int
    jacobian_nonzeros: int
    hessian_nonzeros: int
    iterations: int
    build_time: float
    solve_time: float
    verify_time: float = 0.0


@final
@dataclass(frozen=True, eq=False)
class Outcome:
    """What Ipopt returned.

    Attributes:
        iterate: the last one.
        cost: J there.
        violations: of each constraint there, scaled.
        status: how it ended; `answer` is Ipopt's word for it.
    """

    iterate: Iterate
    cost: float
    violations: Array
    status: Status
    answer: str
    statistics: SolverStatistics


def optimise(
    program: Transcription,
    start: Iterate,
    p: Array,
    options: Mapping[str, Option],
    progress: Callable[[Progress], object] | None = None,
) -> Outcome:
    """Run Ipopt with exact derivatives from `start`; never raises on a failed solve.

    Raises:
        ValueError: an option that Ipopt does not know.
    """
    begin = perf_counter()
    watch = _Watch(program, progress)
    try:
        solver = ca.nlpsol(
            "solver",
            "ipopt",
            program.nlp,
            {"print_time": False, "show_eval_warnings": False, "iteration_callback": watch}
            | {f"ipopt.{name}": value for name, value in (QUIET | dict(options)).items()},
        )
    except RuntimeError as error:
        reason = re.sub(r"^\S*:\d+: ", "", str(error).strip().splitlines()[-1])
        raise ValueError(f"options: expected options of Ipopt, got {options!r}; {reason}") from None
    built = perf_counter()
    (lower_w, upper_w), (lower_g, upper_g) = program.bounds(), program.constraint_bounds()
    with _interrupts(watch):
        result = solver(
            x0=start.w,
            p=p,
            lbx=lower_w,
            ubx=upper_w,
            lbg=lower_g,
            ubg=upper_g,
            lam_x0=start.lam_w,
            lam_g0=start.lam_g,
        )
    if watch.error is not None:
        raise watch.error
    last = _last(program, solver, watch, result, start, p)
    return _outcome(program, solver, last, built - begin, perf_counter() - built)


def _last(
    program: Transcription,
    solver: ca.Function,
    watch: "_Watch",
    result: Mapping[str, ca.DM],
    start: Iterate,
    p: Array,
) -> Mapping[str, ca.DM]:
    """The last iterate: after some errors Ipopt returns zeros, then it is the last one seen."""
    if ANSWERS.get(solver.stats()["return_status"], Status.SOLVER_FAILED).ok:
        return result
    if watch.last:
        return watch.last
    g = ca.Function("g", [program.w, program.p], [program.g])(start.w, p)
    values = {"x": start.w, "f": np.nan, "g": g, "lam_x": start.lam_w, "lam_g": start.lam_g}
    return {name: ca.DM(value) for name, value in values.items()}


def _outcome(
    program: Transcription,
    solver: ca.Function,
    last: Mapping[str, ca.DM],
    build_time: float,
    solve_time: float,
) -> Outcome:
    stats = solver.stats()
    answer = str(stats["return_status"])
    w, g, lam_w, lam_g = (last[name].full().ravel() for name in ("x", "g", "lam_x", "lam_g"))
    statistics = SolverStatistics(
        unknowns=w.size,
        constraints=g.size,
        jacobian_nonzeros=solver.get_function("nlp_jac_g").nnz_out("jac_g_x"),
        hessian_nonzeros=solver.get_function("nlp_hess_l").nnz_out(0),
        iterations=int(stats["iter_count"]),
        build_time=build_time,
        solve_time=solve_time,
    )
    return Outcome(
        Iterate(w, lam_w, lam_g),
        float(last["f"]),
        violations(program, g),
        ANSWERS.get(answer, Status.SOLVER_FAILED),
        answer,
        statistics,
    )


def violations(program: Transcription, g: Array) -> Array:
    """How far each constraint is outside its bounds."""
    lower, upper = program.constraint_bounds()
    return np.maximum(0.0, np.maximum(lower - g, g - upper))


class _Watch(ca.Callback):
    """Keeps the last iterate, reports each one and stops when asked to."""

    def __init__(
        self, program: Transcription, progress: Callable[[Progress], object] | None
    ) -> None:
        super().__init__()
        n, m = program.w.numel(), program.g.numel()
        self.rows = {"x": n, "lam_x": n, "g": m, "lam_g": m, "f": 1, "lam_p": program.p.numel()}
        self.program, self.progress = program, progress
        self.last: dict[str, ca.DM] = {}
        self.iteration = -1
        self.stop = False
        self.error: BaseException | None = None
        self.construct("watch", {})

    def get_n_in(self) -> int:
        return ca.nlpsol_n_out()

    def get_n_out(self) -> int:
        return 1

    def get_name_in(self, i: int) -> str:
        return ca.nlpsol_out(i)

    def get_sparsity_in(self, i: int) -> ca.Sparsity:
        return ca.Sparsity.dense(self.rows[ca.nlpsol_out(i)], 1)

    def eval(self, arg: Sequence[ca.DM]) -> list[float]:
        self.iteration += 1
        self.last = {ca.nlpsol_out(i): value for i, value in enumerate(arg)}
        if self.progress is not None:
            worst = violations(self.program, self.last["g"].full().ravel()).max(initial=0.0)
            try:
                self.progress(Progress(self.iteration, float(self.last["f"]), float(worst)))
            # An exception must cross C++: it is kept here and raised again behind it.
            except BaseException as error:  # noqa: BLE001
                self.error, self.stop = error, True
        return [float(self.stop)]


@contextmanager
def _interrupts(watch: _Watch) -> Generator[None, None, None]:
    """Turn the first Ctrl-C into a stop after the current iteration, which keeps the iterate."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.getsignal(signal.SIGINT)

    def stop(number: int, frame: FrameType | None) -> None:
        del number, frame
        watch.stop = True
        signal.signal(signal.SIGINT, before)  # the second one ends the program as usual

    signal.signal(signal.SIGINT, stop)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
