"""Ipopt, fatrop and SQP with exact derivatives, and what their answers mean."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any, ClassVar, Self, final

from ocp.solvers.convexify import Convexified, both, gradients, lagrangian
from ocp.solvers.prepared import Built, Option, Prepared, made
from ocp.solvers.watch import OVERDETERMINED, GradientHook, IterationHook
from ocp.transcription.program import Program
from symfric.foundation import checks
from symfric.foundation.status import Status

ANSWERS: dict[str, dict[str, Status]] = {
    "Ipopt": {
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
    },
    "Fatrop": {  # in the order of its return flags
        "Success": Status.SOLVED,
        "Maximum_Iterations_Exceeded": Status.MAX_ITERATIONS,
        "Stop_At_Tiny_Step": Status.NO_STEP,
        "Stop_At_Acceptable_Point": Status.ACCEPTABLE,
        "Local_Infeasibility": Status.INFEASIBLE,
    },
    "Sqp": {
        "Solve_Succeeded": Status.SOLVED,
        "Maximum_Iterations_Exceeded": Status.MAX_ITERATIONS,
        "Search_Direction_Becomes_Too_Small": Status.NO_STEP,
        "User_Requested_Stop": Status.INTERRUPTED,
    },
}
"""Solver -> its answer -> how the solve ended; every other answer is SOLVER_FAILED."""

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
"""Options of Ipopt for a start that comes with multipliers; the user's own win."""
SQP: dict[str, Option] = {
    "print_header": False,
    "print_iteration": False,
    "print_status": False,
    "max_iter": 300,
}
QP: dict[str, dict[str, Option]] = {
    "qrqp": {"print_iter": False, "print_header": False, "print_info": False},
}
"""QP solver -> options that keep it quiet."""


@dataclass(frozen=True, eq=False, init=False)
class _Method(ABC):
    """A solver with its own options by name."""

    options: Mapping[str, Option]
    max_time: float | None
    plugin: ClassVar[str]

    def __init__(self, *, max_time: float | None = None, **options: Option) -> None:
        name = type(self).__name__
        for option, value in options.items():
            if not isinstance(value, str | float | int):  # pyright: ignore[reportUnnecessaryIsInstance]
                raise checks.refused(f"{name}: option {option}", "a number or a text", value)
        if max_time is not None:
            max_time = checks.number(f"{name}: max_time", max_time, unit="s", above=0.0)
        object.__setattr__(self, "options", options)
        object.__setattr__(self, "max_time", max_time)

    def with_options(self, **options: Option) -> Self:
        """The same with further options, or other values of some."""
        return type(self)(max_time=self.max_time, **(dict(self.options) | options))

    def prepared(self, program: Program) -> Prepared:
        """Ready to solve `program`.

        Raises:
            ValueError: an option that the solver does not know (at the first run).
        """
        name, build = type(self).__name__, partial(self._build, program)
        return Prepared(program, name, self.options, build, self._read, self.max_time)

    @abstractmethod
    def _build(self, program: Program, warm: bool) -> Built:
        """CasADi's solver; `warm` where the start comes with multipliers."""

    def _made(self, program: Program, **common: Any) -> Any:
        return made(type(self).__name__, self.plugin, program, self.options, common)

    def _read(self, stats: Mapping[str, Any]) -> tuple[str, Status]:
        """The solver's answer and its meaning."""
        answer = str(stats["return_status"])
        return answer, ANSWERS[type(self).__name__].get(answer, Status.SOLVER_FAILED)


@final
@dataclass(frozen=True, eq=False, init=False)
class Ipopt(_Method):
    """Ipopt, an interior-point method, with its own options: `Ipopt(max_iter=500, print_level=5)`.

    True and False stand for its "yes" and "no".

    Attributes:
        options: see Ipopt's documentation.
        max_time: wall time [s] after which a solve ends with what it has, or None.

    Source: Waechter and Biegler, Mathematical Programming 106(1), 2006, 25-57.
    """

    plugin = "ipopt"

    def __init__(self, *, max_time: float | None = None, **options: Option) -> None:
        words = {True: "yes", False: "no"}
        given = {n: words[v] if isinstance(v, bool) else v for n, v in options.items()}
        super().__init__(max_time=max_time, **given)

    def _build(self, program: Program, warm: bool) -> Built:
        hook = IterationHook(program)
        own = {f"ipopt.{name}": value for name, value in (QUIET | (WARM if warm else {})).items()}
        function = self._made(program, **program.derivatives, iteration_callback=hook, **own)
        return Built(function, hook)


@final
@dataclass(frozen=True, eq=False, init=False)
class Fatrop(_Method):
    """Fatrop with its own options by name: `Fatrop(max_iter=500, mu_init=0.1)`.

    An interior-point method that factorises stage by stage. It needs stages: unknowns that couple
    only neighbouring intervals. A free duration, a parameter chosen with the trajectory, scenarios
    and conditions between the two ends couple all of them; such a program is refused with the
    reason, and Ipopt solves it.

    Attributes:
        options: see fatrop's documentation.
        max_time: wall time [s] after which a solve ends with what it has, or None.

    Limits: multipliers of a start are not used, and best iterates of solves that were stopped come
    without them. CasADi 3.8 takes a time that grows with N^2 to hand over the stages: 0.5 s at
    N = 200, 16 s at N = 1000. Values that are no numbers are refused here, as fatrop ignores them.
    Source: Vanroye et al., FATROP, IROS 2023.
    """

    plugin = "fatrop"

    def __init__(self, *, max_time: float | None = None, **options: Option) -> None:
        for name, value in options.items():  # fatrop itself would silently take no notice
            checks.number(f"Fatrop: option {name}", float(value) if value in (0, 1) else value)
        super().__init__(max_time=max_time, **options)

    def prepared(self, program: Program) -> Prepared:
        """Ready to solve `program`.

        Raises:
            ValueError: a program without stages, or an option that fatrop does not know (the
                latter at the first run).
        """
        if program.stages is None:
            raise ValueError(
                f"Fatrop: expected a program of stages, got one with {program.unstaged}; "
                "take Ipopt()"
            )
        return super().prepared(program)

    def _build(self, program: Program, warm: bool) -> Built:
        del warm
        hook, stages = GradientHook(program, program.w.numel()), program.stages
        sizes = {name: list(getattr(stages, name)) for name in ("nx", "nu", "ng")}
        derivatives = {
            "nlp_grad": gradients(program),
            "nlp_grad_f": hook,
            "nlp_jac_g": program.jacobian,
            "nlp_hess_l": lagrangian(program),
        }
        own = {"fatrop.print_level": 0, "structure_detection": "manual", "no_nlp_grad": False}
        N = len(sizes["nx"]) - 1
        return Built(self._made(program, **own, N=N, **sizes, cache=derivatives), hook)

    def _read(self, stats: Mapping[str, Any]) -> tuple[str, Status]:
        flag, answers = int(stats["fatrop"]["return_flag"]), [*ANSWERS["Fatrop"].items()]
        if 0 <= flag < len(answers):
            return answers[flag]
        return f"return flag {flag}", Status.SOLVER_FAILED


@final
@dataclass(frozen=True, eq=False, init=False)
class Sqp(_Method):
    """`sqpmethod` with its own options by name: `Sqp(max_iter=500, qpsol="qrqp")`.

    Sequential quadratic programming. Its quadratic programs are solved by the interior-point method
    `piqp` if `qpsol` names no other. Its Hessian is the exact one without negative eigenvalues
    (`ocp.solvers.convexify`).

    Attributes:
        options: see CasADi's documentation of sqpmethod.
        max_time: wall time [s] after which a solve ends with what it has, or None.

    Limits: convergence is linear where the exact Hessian is indefinite, and there is no way back
    from linearised constraints that contradict each other. Good for starts close by; on moves
    against friction Ipopt takes fewer iterations.
    """

    plugin = "sqpmethod"

    def _build(self, program: Program, warm: bool) -> Built:
        del warm
        hook, hessian = IterationHook(program), Convexified(program)
        solver = str(self.options.get("qpsol", "piqp"))
        own = {"qpsol": solver, "qpsol_options": QP.get(solver, {}) | {"error_on_fail": False}}
        derivatives = {"nlp_jac_fg": both(program), "nlp_hess_l": hessian}
        function = self._made(program, **SQP, **own, iteration_callback=hook, cache=derivatives)
        return Built(function, hook, (hessian,))
