"""Fatrop, an interior-point method that factorises stage by stage (Vanroye et al., 2023)."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any, final

from ocp.solvers.derivatives import gradients, lagrangian
from ocp.solvers.prepared import Built, Option, Prepared, checked_options, checked_time, made
from ocp.solvers.watch import GradientHook
from ocp.transcription.program import Program, Stages
from symfric.foundation import checks
from symfric.foundation.status import Status

ANSWERS: tuple[tuple[str, Status], ...] = (
    ("Success", Status.SOLVED),
    ("Maximum_Iterations_Exceeded", Status.MAX_ITERATIONS),
    ("Stop_At_Tiny_Step", Status.NO_STEP),
    ("Stop_At_Acceptable_Point", Status.ACCEPTABLE),
    ("Local_Infeasibility", Status.INFEASIBLE),
)
"""Fatrop's return flag -> its name and how the solve ended; others are SOLVER_FAILED."""


@final
@dataclass(frozen=True, eq=False, init=False)
class Fatrop:
    """Fatrop with its own options by name: `Fatrop(max_iter=500, mu_init=0.1)`.

    It needs stages: unknowns that couple only neighbouring intervals. A free duration, a parameter
    chosen with the trajectory, scenarios and conditions between the two ends couple all of them;
    such a program is refused with the reason, and Ipopt solves it.

    Attributes:
        options: as fatrop's documentation tells them.
        max_time: wall time [s] after which a solve ends with what it has, or None.

    Limits: multipliers of a start are not used, and best iterates of solves that were stopped come
    without them. CasADi 3.8 takes a time that grows with N^2 to hand over the stages: 0.5 s at
    N = 200, 16 s at N = 1000. Values that are no numbers are refused here, as fatrop ignores them.
    """

    options: Mapping[str, Option]
    max_time: float | None

    def __init__(self, *, max_time: float | None = None, **options: Option) -> None:
        for name, value in options.items():  # fatrop itself would silently take no notice
            checks.number(f"Fatrop: option {name}", float(value) if value in (0, 1) else value)
        object.__setattr__(self, "options", checked_options("Fatrop", options))
        object.__setattr__(self, "max_time", checked_time("Fatrop", max_time))

    def with_options(self, **options: Option) -> "Fatrop":
        """The same with further options, or other values of some."""
        return Fatrop(max_time=self.max_time, **(dict(self.options) | options))

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
        build = partial(self._build, program, program.stages)
        return Prepared(program, "Fatrop", self.options, build, _read, self.max_time)

    def _build(self, program: Program, stages: Stages, warm: bool) -> Built:
        del warm
        hook = GradientHook(program, program.w.numel())
        common = {
            "fatrop.print_level": 0,
            "structure_detection": "manual",
            "N": len(stages.nx) - 1,
            "nx": list(stages.nx),
            "nu": list(stages.nu),
            "ng": list(stages.ng),
            "no_nlp_grad": False,
            "cache": {
                "nlp_grad": gradients(program),
                "nlp_grad_f": hook,
                "nlp_jac_g": program.jacobian,
                "nlp_hess_l": lagrangian(program),
            },
        }
        return Built(made("Fatrop", program, self.options, common), hook)


def _read(stats: Mapping[str, Any]) -> tuple[str, Status]:
    flag = int(stats["fatrop"]["return_flag"])
    if 0 <= flag < len(ANSWERS):
        return ANSWERS[flag]
    return f"return flag {flag}", Status.SOLVER_FAILED
