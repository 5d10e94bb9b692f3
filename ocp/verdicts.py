"""Verification of motions with their laws and with exact friction, and its messages."""

from contextlib import suppress
from dataclasses import dataclass, replace
from typing import NamedTuple

from ocp.checking.verify import verified, verify
from ocp.formulation.problem import Problem
from ocp.friction.event_check import verify_exactly
from ocp.friction.smooth_models import is_exact, narrowed
from ocp.solving.solution import Solution, with_sentence
from ocp.solving.verification import Verification
from symfric.foundation import checks
from symfric.foundation.status import SolveError, Status

EXACT_RTOL = 1e-7
"""Relative tolerance of the simulation with exact friction, 1 % of the required accuracy."""
MISSED = (Status.TERMINAL_MISS, Status.BOUND_MISS)
FOUND = (*MISSED, Status.UNSTABLE)
"""Statuses of a motion that was found but violates its conditions."""
FAILURES = (ArithmeticError, AttributeError, LookupError, RuntimeError, TypeError, ValueError)
"""Exceptions after which the next strategy is tried."""


class Judged(NamedTuple):
    """A motion by modes with the verdict of simulations.

    Attributes:
        solution: the motion.
        right: True if it is valid with the user's laws and with exact friction.
        exact: True if it is valid with exact friction only.
    """

    solution: Solution
    right: bool
    exact: bool = False


@dataclass(frozen=True, eq=False)
class Judge:
    """Verification of motions.

    Attributes:
        tolerance: tolerance of the verification.
        verify: True to verify motions.
    """

    tolerance: float
    verify: bool

    def checked(self, solution: Solution) -> Solution:
        """Return `solution` with its verification.

        The law states of a motion by modes are unknown, so their simulated values are not compared,
        and local errors are not evaluated.
        """
        if not self.verify or solution.status.stopped:
            return solution
        chain = solution.problem.chain
        laws = {c.name: c for phase in chain for c in phase.model.contacts if c.states}
        try:
            if not (solution.modes and laws):
                return verified(solution, self.tolerance)
            found = _without_law_states(solution, verify(solution, self.tolerance))
            if is_exact(solution.problem) and (found.ok or not solution.ok):
                return replace(solution, verification=found)
        except FAILURES as error:
            return with_sentence(solution, f"It was not verified: {reason_of(error)}.")
        names = ", ".join(f"{name}: {type(c.law).__name__}" for name, c in laws.items())
        text = f"{solution.message} Friction with states ({names}) was taken as its steady sliding"
        text += " and its static level, and the motion verified with the law itself."
        if not found.ok and solution.ok:
            text = f"ocp '{solution.problem.name}': {found.sentence} {text}"
            solution = replace(solution, status=found.status)
        return replace(solution, verification=found, message=text)

    def judged(self, solution: Solution) -> Judged:
        """Return a motion by modes with the verdict of a simulation with exact friction."""
        if not self.verify or not (solution.ok or solution.status in FOUND):
            return Judged(solution, solution.ok)
        if solution.ok and is_exact(solution.problem):
            text = "It was verified with exact Coulomb friction, the law of the model."
            return Judged(with_sentence(solution, text), right=True)
        try:
            exact = verify_exactly(solution, self.tolerance, EXACT_RTOL)
            exact = _without_law_states(solution, exact)
        except FAILURES as error:
            text = f"With exact Coulomb friction it was not simulated: {reason_of(error)}."
            return Judged(with_sentence(solution, text), solution.ok)
        if exact.ok and not solution.ok:
            return Judged(self._creeping(solution, exact.largest), right=False, exact=True)
        text = f"it misses by {exact.largest:.1g}." if exact.ok else exact.sentence
        text = f"With exact Coulomb friction{'' if exact.ok else ':'} {text}"
        return Judged(with_sentence(solution, text), right=exact.ok)

    def _creeping(self, solution: Solution, exact: float) -> Solution:
        """Return a motion that is right only with exact friction, where it misses by `exact`."""
        found, layers = solution.verification, ""
        if found is None or not found.misses:
            return solution
        grows = (
            f" and whose errors grow by a factor of {found.growth:.1g}" if found.unstable else ""
        )
        for factor in (0.5 * self.tolerance / found.largest, 0.05 * self.tolerance / found.largest):
            problem, narrow = narrowed(solution.problem, factor)
            with suppress(*FAILURES):
                if narrow and verify(replace(solution, problem=problem), self.tolerance).ok:
                    shown = checks.listed([f"{name} {v:.1g} m/s" for name, v in narrow.items()])
                    layers = f"a layer of {shown}, "
                    break
        text = (
            f"ocp '{solution.problem.name}': The motion is right with exact Coulomb friction "
            f"(largest miss {exact:.1g}), but under the laws of the model, whose layers creep at "
            f"rest{grows}, {found.misses[0].sentence}; {layers}feedback along the motion, or the "
            "law ExactCoulomb closes the gap."
        )
        return replace(solution, message=text)


def law_states(problem: Problem) -> set[str]:
    """Return the names of the states of laws, which a motion by modes does not contain."""
    contacts = [c for phase in problem.chain for c in phase.model.contacts]
    return {v.name for c in contacts for v in c.states}


def bristles(problem: Problem) -> bool:
    """Return True if a law has states other than the mode of `ExactCoulomb`."""
    return bool(law_states(problem)) and not is_exact(problem)


def _without_law_states(solution: Solution, found: Verification) -> Verification:
    """Return `found` without checks of law states and local errors."""
    hidden = law_states(solution.problem)
    if not hidden:
        return found
    kept = [m for m in found.checked if m.name not in hidden and m.what != "local error"]
    return replace(found, checked=tuple(kept), restarted=None)


def reason_of(error: Exception) -> str:
    """Return the message of `error` as a clause, with its type if it is an internal error."""
    first = (str(error).strip().splitlines() or [""])[0].rstrip(".")
    if isinstance(error, ValueError | SolveError):
        return first
    return f"internal error, {type(error).__name__}: {first}"
