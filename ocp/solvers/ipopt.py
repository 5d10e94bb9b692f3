"""Ipopt, the interior-point method of Waechter and Biegler (2006), with exact derivatives."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any, final

from ocp.solvers.answers import OVERDETERMINED
from ocp.solvers.prepared import Built, Option, Prepared, checked_options, checked_time, made
from ocp.solvers.watch import IterationHook
from ocp.transcription.program import Program
from symfric.foundation.status import Status

ANSWERS: dict[str, Status] = {
    "Solve_Succeeded": Status.SOLVED,
    "Feasible_Point_Found": Status.SOLVED,
    "Solved_To_Acceptable_Level": Status.ACCEPTABLE,
    "Infeasible_Problem_Detected": Status.INFEASIBLE,
    OVERDETERMINED: Status.INFEASIBLE,
    "Maximum_Iterations_Exceeded": Status.MAX_ITERATIONS,
    "Maximum_CpuTime_Exceeded": Status.TIME_LIMIT,
    "Maximum_WallTime_Exceeded": Status.TIME_LIMIT,
    "User_Requested_Stop": Status.INTERRUPTED,
    "Invalid_Number_Detected": Status.NOT_FINITE,
    "Restoration_Failed": Status.NO_STEP,
    "Search_Direction_Becomes_Too_Small": Status.NO_STEP,
    "Error_In_Step_Computation": Status.NO_STEP,
    "Diverging_Iterates": Status.UNBOUNDED,
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
"""Options of a start that comes with multipliers; the user's own win."""


@final
@dataclass(frozen=True, eq=False, init=False)
class Ipopt:
    """Ipopt with its own options by name: `Ipopt(max_iter=500, print_level=5)`.

    True and False stand for its "yes" and "no".

    Attributes:
        options: as Ipopt's documentation tells them.
        max_time: wall time [s] after which a solve ends with what it has, or None.
    """

    options: Mapping[str, Option]
    max_time: float | None

    def __init__(self, *, max_time: float | None = None, **options: Option) -> None:
        words = {True: "yes", False: "no"}
        given = {n: words[v] if isinstance(v, bool) else v for n, v in options.items()}
        object.__setattr__(self, "options", checked_options("Ipopt", given))
        object.__setattr__(self, "max_time", checked_time("Ipopt", max_time))

    def with_options(self, **options: Option) -> "Ipopt":
        """The same with further options, or other values of some."""
        return Ipopt(max_time=self.max_time, **(dict(self.options) | options))

    def prepared(self, program: Program) -> Prepared:
        """Ready to solve `program`.

        Raises:
            ValueError: an option that Ipopt does not know (at the first run).
        """
        return Prepared(
            program, "Ipopt", self.options, partial(self._build, program), _read, self.max_time
        )

    def _build(self, program: Program, warm: bool) -> Built:
        hook = IterationHook(program)
        own = QUIET | (WARM if warm else {})
        common = {
            "grad_f": program.gradient,
            "jac_g": program.jacobian,
            "hess_lag": program.hessian,
            "iteration_callback": hook,
        }
        common |= {f"ipopt.{name}": value for name, value in own.items()}
        return Built(made("Ipopt", program, self.options, common), hook)


def _read(stats: Mapping[str, Any]) -> tuple[str, Status]:
    answer = str(stats["return_status"])
    return answer, ANSWERS.get(answer, Status.SOLVER_FAILED)
