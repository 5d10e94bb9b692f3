"""Sequential quadratic programming: CasADi's `sqpmethod` with convexified exact Hessians."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any, final

from ocp.solvers.convexify import Convexified
from ocp.solvers.derivatives import both
from ocp.solvers.prepared import Built, Option, Prepared, checked_options, checked_time, made
from ocp.solvers.watch import IterationHook
from ocp.transcription.program import Program
from symfric.foundation.status import Status

ANSWERS: dict[str, Status] = {
    "Solve_Succeeded": Status.SOLVED,
    "Maximum_Iterations_Exceeded": Status.MAX_ITERATIONS,
    "Search_Direction_Becomes_Too_Small": Status.NO_STEP,
    "User_Requested_Stop": Status.INTERRUPTED,
}
"""What sqpmethod answers -> how the solve ended; everything else is SOLVER_FAILED."""

DEFAULTS: dict[str, Option] = {
    "print_header": False,
    "print_iteration": False,
    "print_status": False,
    "max_iter": 300,
}
QP: dict[str, dict[str, Option]] = {
    "qrqp": {"print_iter": False, "print_header": False, "print_info": False},
}
"""QP solver -> options that keep it quiet."""


@final
@dataclass(frozen=True, eq=False, init=False)
class Sqp:
    """`sqpmethod` with its own options by name: `Sqp(max_iter=500, qpsol="qrqp")`.

    Its quadratic programs are solved by the interior-point method `piqp` if `qpsol` names no other.
    Its Hessian is the exact one without negative eigenvalues (`ocp.solvers.convexify`).

    Attributes:
        options: as CasADi's documentation of sqpmethod tells them.
        max_time: wall time [s] after which a solve ends with what it has, or None.

    Limits: convergence is linear where the exact Hessian is indefinite, and there is no way back
    from linearised constraints that contradict each other. Good for starts close by; on moves
    against friction Ipopt takes fewer iterations.
    """

    options: Mapping[str, Option]
    max_time: float | None

    def __init__(self, *, max_time: float | None = None, **options: Option) -> None:
        object.__setattr__(self, "options", checked_options("Sqp", options))
        object.__setattr__(self, "max_time", checked_time("Sqp", max_time))

    def with_options(self, **options: Option) -> "Sqp":
        """The same with further options, or other values of some."""
        return Sqp(max_time=self.max_time, **(dict(self.options) | options))

    def prepared(self, program: Program) -> Prepared:
        """Ready to solve `program`.

        Raises:
            ValueError: an option that sqpmethod does not know (at the first run).
        """
        build = partial(self._build, program)
        return Prepared(program, "Sqp", self.options, build, _read, self.max_time)

    def _build(self, program: Program, warm: bool) -> Built:
        del warm
        hook = IterationHook(program)
        hessian = Convexified(program)
        solver = str(self.options.get("qpsol", "piqp"))
        common = {
            **DEFAULTS,
            "qpsol": solver,
            "qpsol_options": QP.get(solver, {}) | {"error_on_fail": False},
            "iteration_callback": hook,
            "cache": {"nlp_jac_fg": both(program), "nlp_hess_l": hessian},
        }
        return Built(made("Sqp", program, self.options, common), hook, (hessian,))


def _read(stats: Mapping[str, Any]) -> tuple[str, Status]:
    answer = str(stats["return_status"])
    return answer, ANSWERS.get(answer, Status.SOLVER_FAILED)
