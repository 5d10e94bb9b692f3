"""Status of a solve, and related errors and warnings."""

from enum import Enum, unique
from typing import Any


@unique
class Status(Enum):
    """Status of a simulation, an optimisation or a fit; the value is the sentence for users."""

    SUCCESS = "The end was reached within the tolerances."
    TERMINATED = "A terminal event ended the simulation."
    EVENT_STORM = (
        "Events accumulate without time advancing (Zeno); give the model a mode in which the "
        "contact sticks."
    )
    INTERRUPTED = "Interrupted by the user; the result is what was reached by then."
    MAX_STEPS = (
        "The maximum number of steps was used up; loosen rtol, raise max_steps or look for a "
        "discontinuity."
    )
    STEP_TOO_SMALL = (
        "The step became too small; a discontinuity or a singular equation is near this time."
    )
    NOT_FINITE = "An equation returned NaN or infinity."
    JAMMED = "Friction jams: reactions grow with the friction that they cause, without bound."
    SINGULAR = "The iteration matrix became singular."
    SOLVER_FAILED = "The solver gave up."
    SOLVED = "The optimality conditions hold within the tolerance."
    ACCEPTABLE = "The optimality conditions hold only within the acceptable tolerance."
    INFEASIBLE = (
        "No point satisfies all constraints near the last iterate; check bounds and boundary "
        "values, give a better guess or more time."
    )
    MAX_ITERATIONS = "The maximum number of iterations was reached; give a better guess."
    TIME_LIMIT = (
        "The time limit was reached before the optimality conditions held; raise it or start "
        "from this result."
    )
    NO_STEP = (
        "No step makes progress although the conditions do not hold: nearly dependent or badly "
        "scaled constraints, or a derivative that jumps, are near this point."
    )
    UNBOUNDED = (
        "The unknowns grow without bound: no finite minimum of the cost was found; bound the "
        "inputs or the states, or check the sign of the cost."
    )
    NO_DESCENT = (
        "No step improves the fit, although the derivatives predict one: this is not a minimum; "
        "start elsewhere or narrow the bounds."
    )
    DOUBTFUL = (
        "The best fit of this model was found, but the residuals show that it does not explain the "
        "data; use another model, or use the values with care."
    )
    IMPLAUSIBLE = (
        "The optimality conditions hold, but the result is implausible: the record and the "
        "requested fit contradict each other."
    )
    TERMINAL_MISS = (
        "The optimiser met its conditions, but the re-simulated control misses the target; "
        "use more intervals."
    )
    BOUND_MISS = (
        "The optimiser met its conditions, but the re-simulated motion leaves a bound between "
        "them; use more intervals, or a narrower bound."
    )
    UNSTABLE = (
        "The motion is correct between nodes, but it is unstable: the control alone, without "
        "feedback, does not hold it; track it with a controller."
    )

    @property
    def stopped(self) -> bool:
        """True if the user or the time limit ended the solve."""
        return self in (Status.INTERRUPTED, Status.TIME_LIMIT)

    @property
    def ok(self) -> bool:
        """True if the result can be used."""
        return self in USABLE


USABLE = Status.SUCCESS, Status.TERMINATED, Status.SOLVED, Status.ACCEPTABLE, Status.DOUBTFUL


class SolveError(RuntimeError):
    """Error for a failed solve; `status` is the reason and `partial` the result so far."""

    def __init__(self, message: str, status: Status, partial: Any = None) -> None:
        super().__init__(message)
        self.status = status
        self.partial = partial


class OverloadWarning(UserWarning):
    """Warning about friction above its static level, for example of bristles that do not relax."""


class LimitWarning(UserWarning):
    """Warning about a state or an input that leaves its bounds."""


class EnergyWarning(UserWarning):
    """Warning about friction that adds energy to the motion, as a law with a wrong sign does."""
