"""The strategies of `solve`: directly, by homotopy, by modes, and what is done where one fails."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from math import isfinite, nan
from typing import Literal, final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ocp.checking.mesh_refinement import Goals, refined_solve
from ocp.checking.verification import Verification
from ocp.checking.verify import verified
from ocp.checking.verify import verify as verify_solution
from ocp.formulation.problem import Problem
from ocp.friction.event_check import verify_exactly
from ocp.friction.homotopy import FINE, LAST, Sharp, sharpened
from ocp.friction.mode_optimisation import optimise_modes, refusal
from ocp.friction.smooth_models import has_jumps, own_level, speeds_at
from ocp.original_law import STEPS, OriginalLaw
from ocp.solving.methods import Ipopt
from ocp.solving.motion import Stored
from ocp.solving.one_solve import Solver
from ocp.solving.prepared import Clock
from ocp.solving.solution import Solution
from ocp.solving.starts import Start
from ocp.transcription.program import Report
from ocp.transcription.schemes import Radau, Scheme, Shooting, make_meshes
from symfric.foundation import checks
from symfric.foundation.status import SolveError, Status

Array = NDArray[np.float64]
Friction = Literal["auto", "smooth", "sharpen", "modes"]
INTERVALS = 50
EARLY = 0.04
"""Layers, in multiples of the speeds, from which on the modes of a motion may be read."""
CLOSE_PASSES, CLOSE_INTERVALS, CLOSE_ITERATIONS = 4, 400, 60
"""Limits of a solve that starts at a motion by modes: its law is near, or not found."""
SHARED_PASSES, SHARED_ITERATIONS = 4, 150
"""Limits where scenarios share inputs: their contacts turn round at many instants, and each finer
mesh is a search among kinks for a thousandth of the cost."""
STOPPED = (Status.INTERRUPTED, Status.TIME_LIMIT)
EXACT_RTOL = 1e-7
"""Relative tolerance of the motion with exact friction: a hundredth of what matters."""
SHARPEST = 1e-4
"""Layers, in multiples of the speeds, that are too narrow for one solve with them."""
MISSED = (Status.TERMINAL_MISS, Status.BOUND_MISS)
FOUND = (*MISSED, Status.UNSTABLE)
"""How a motion ends that was found and does not do what it should."""
FAILURES = (ArithmeticError, AttributeError, LookupError, RuntimeError, TypeError, ValueError)
"""What a strategy of friction may raise where it fails: another one is taken then."""


@final
@dataclass(frozen=True, eq=False)
class Direct:
    """Direct solves of a problem, on meshes that follow from its errors.

    Attributes:
        problem, scheme, solver, intervals, progress: as in `ocp.solve`.
        goals: when a mesh is fine enough; one pass does not refine.
        clock: runs for all solves.
    """

    problem: Problem
    scheme: Scheme
    solver: Solver
    intervals: int | ArrayLike | Sequence[ArrayLike] | None
    goals: Goals
    clock: Clock
    progress: Report | None

    def solved(
        self, guess: Start, meshes: Sequence[Array] | None = None, *, close: bool = False
    ) -> Solution:
        """The problem from `guess`; with `close` a solver that loses its way is stopped early."""
        goals, solver, most = self.goals, self.solver, 0
        if meshes is None:
            wanted = INTERVALS if self.intervals is None else self.intervals
            meshes = make_meshes(self.problem, wanted)
        elif self.problem.scenarios:
            goals, most = replace(goals, passes=min(goals.passes, SHARED_PASSES)), SHARED_ITERATIONS
        if close:
            passes, most = min(goals.passes, CLOSE_PASSES), CLOSE_ITERATIONS
            goals = replace(goals, passes=passes, most=CLOSE_INTERVALS, patient=False)
        if most and isinstance(solver, Ipopt) and "max_iter" not in solver.options:
            solver = solver.with_options(max_iter=most)
        return refined_solve(
            self.problem, meshes, self.scheme, solver, guess, self.progress,
            goals=goals, limit=self.clock.within,
        )  # fmt: skip

    def sharpened(self, guess: Start, starts: int, last: float) -> Iterator[Sharp]:
        """Motions with narrower and narrower layers, down to `last`."""
        intervals = FINE
        if self.intervals is not None:
            meshes = make_meshes(self.problem, self.intervals)
            intervals = sum(mesh.size - 1 for mesh in meshes[: len(self.problem.chain)])
        return sharpened(
            self.problem, self.scheme, self.solver, guess, intervals=intervals, starts=starts,
            last=last, clock=self.clock, progress=self.progress,
        )  # fmt: skip


@final
@dataclass(frozen=True, eq=False)
class Judged:
    """A motion by modes, and whether it is right with the user's laws and with exact friction."""

    solution: Solution
    right: bool

    @property
    def worth(self) -> tuple[bool, bool, float]:
        """The larger the better: right before wrong, solved before failed, then by cost."""
        return self.right, self.solution.ok, -self.solution.cost


@final
@dataclass(frozen=True)
class Verifier:
    """Verification within a tolerance; none where `active` is False."""

    tolerance: float
    active: bool

    def checked(self, solution: Solution) -> Solution:
        """`solution` with its verification.

        Of a motion by modes the states of laws are not known: their simulated values are no miss,
        and local errors are not evaluated.
        """
        if not self.active or solution.status in STOPPED:
            return solution
        chain = solution.problem.chain
        laws = {c.name: c for phase in chain for c in phase.model.contacts if c.states}
        try:
            if not (solution.modes and laws):
                return verified(solution, self.tolerance)
            found = _without_states_of_laws(solution, verify_solution(solution, self.tolerance))
        except FAILURES as error:
            return _with_sentence(solution, f"It was not verified: {_reason(error)}.")
        names = ", ".join(f"{name}: {type(c.law).__name__}" for name, c in laws.items())
        said = f"{solution.message} Friction with states ({names}) was taken as its steady sliding"
        said += " and its static level, and the motion verified with the law itself."
        if not found.ok and solution.ok:
            said = f"ocp '{solution.problem.name}': {found.sentence} {said}"
            solution = replace(solution, status=found.status)
        return replace(solution, verification=found, message=said)

    def judged(self, exact: Solution) -> Judged:
        """A motion by modes that is checked, simulated with exact friction as well."""
        if not self.active or exact.status in STOPPED or not (exact.ok or exact.status in MISSED):
            return Judged(exact, exact.ok)
        try:
            exactly = verify_exactly(exact, self.tolerance, EXACT_RTOL)
            found = _without_states_of_laws(exact, exactly)
        except FAILURES as error:
            said = f"With exact Coulomb friction it was not simulated: {_reason(error)}."
            return Judged(_with_sentence(exact, said), exact.ok)
        if not found.ok:
            said = f"{exact.message} With exact Coulomb friction: {found.sentence}"
            return Judged(replace(exact, message=said), right=False)
        said = f"{exact.message} With exact Coulomb friction it misses by {found.largest:.1g}"
        if not exact.ok:
            said += " only: the layers of the law creep at rest and break away later; make them "
            said += "narrower, or allow this by `tolerance`"
        return Judged(replace(exact, message=f"{said}."), exact.ok)


@final
@dataclass(frozen=True, eq=False)
class ModeSearch:
    """The search for an exact motion next to a sharpened one.

    Attributes:
        direct: solves of the problem itself.
        verifier: of what is found.
        margin: share of its static level that a contact at rest keeps from it.
    """

    direct: Direct
    verifier: Verifier
    margin: float

    def near(self, sharp: Sharp) -> Judged:
        """The exact motion next to a sharpened one, verified with the user's laws."""
        direct, problem = self.direct, self.direct.problem
        speeds = speeds_at(problem, sharp.scales, sharp.level)
        solver = direct.solver if isinstance(direct.solver, Ipopt) else Ipopt()
        found = optimise_modes(
            sharp.solution, problem, speeds, solver=solver, scheme=direct.scheme,
            progress=direct.progress, margin=self.margin, clock=direct.clock,
        )  # fmt: skip
        exact, margin = next(found)
        if exact.status in STOPPED and not exact.modes:
            by = "The time limit was reached" if exact.status is Status.TIME_LIMIT else "Stopped"
            said = f"ocp '{problem.name}': {by} while modes were sought; friction is still smooth."
            both = _after(exact, sharp.solution)
            stopped = replace(both, status=exact.status, message=said, cause=exact.cause)
            return Judged(stopped, right=False)
        exact = self.verifier.checked(_after(sharp.solution, exact))
        if exact.status in MISSED and states_of_laws(problem) and not direct.clock.over:
            exact = self.by_original_law(exact)
            if exact.verified:
                return Judged(exact, True)
        narrow = own_level(problem, sharp.scales) < SHARPEST
        if exact.status in MISSED and not narrow and not direct.clock.over:
            own = self.verifier.checked(direct.solved(exact, exact.meshes, close=True))
            if own.verified:
                return Judged(_after(exact, replace(own, modes=exact.modes)), True)
            exact = _after(own, exact)
        one = self.verifier.judged(exact)
        return self._closer(one, margin, found, sharp.solution) if one.right else one

    def _closer(
        self, one: Judged, margin: float, others: Iterator[tuple[Solution, float]], sharp: Solution
    ) -> Judged:
        """The motion whose rests come closest to their levels of those that are right."""
        kept, slope, best, last = margin, nan, one, one.solution
        for exact, less in others:
            last = _after(sharp, exact)
            if exact.status is Status.INTERRUPTED:
                return Judged(last, right=False)
            if exact.ok:
                slope = max(0.0, one.solution.cost - exact.cost) / (margin - less)
            if exact.status in STOPPED or less < self.margin:
                break
            nearer = self.verifier.judged(self.verifier.checked(last)) if exact.ok else one
            if exact.ok and nearer.right:
                best, kept = nearer, less
                break
        if last is one.solution:
            return one
        found = replace(best.solution, statistics=last.statistics)
        costs = f"about {slope * kept:.2g} of {found.cost:.6g}" if isfinite(slope) else "is open"
        few = "" if kept <= self.margin else "; with less none was found that is right"
        said = f"Rests keep {kept:.2g} of their static levels, which costs {costs}{few}."
        return Judged(_with_sentence(found, said), right=True)

    def by_original_law(self, exact: Solution) -> Solution:
        """A motion that misses with a law with states, found with that law itself by shooting.

        `exact`, with the reason, where that does not succeed.
        """
        direct, tolerance = self.direct, self.verifier.tolerance
        scheme = direct.scheme
        scheme = scheme if isinstance(scheme, Shooting) else Shooting("exponential", STEPS)
        solver = direct.solver if isinstance(direct.solver, Ipopt) else Ipopt()
        common = direct.problem, scheme, solver, tolerance, direct.clock, direct.progress
        try:
            own = OriginalLaw(*common).solved(exact)
        except FAILURES as error:  # mechanisms, algebraic variables
            return _with_sentence(exact, f"With the law itself: {_reason(error)}.")
        own = _after(exact, own)
        if not own.verified:
            said = f"{exact.message} By {scheme} with the law itself: {own.message}"
            kept = replace(exact, message=said, statistics=own.statistics)
            stopped = own.status in STOPPED
            return replace(kept, status=own.status, cause=own.cause) if stopped else kept
        return replace(own, modes=exact.modes)


def solved(search: ModeSearch, friction: Friction, guess: Start, starts: int) -> Solution:
    """The solution by the strategy that the problem of `search.direct` needs."""
    problem, scheme = search.direct.problem, search.direct.scheme
    holding, shooting = has_jumps(problem), isinstance(scheme, Shooting)
    known = isinstance(guess, Solution | Stored)
    static = friction == "auto" and not known and bool(states_of_laws(problem))
    if shooting and static and not (_refused(problem) or _events(problem)):
        return _by_shooting(search, guess, starts)
    if friction in ("sharpen", "modes") and (shooting or not holding):
        what = "collocation, such as Radau(3)" if shooting else "a contact that holds at rest"
        raise ValueError(f"solve: friction '{friction}': expected {what}, got none")
    if friction == "smooth" or shooting or not holding:
        if events := _events(problem):
            raise ValueError(
                f"solve: expected models without events, got {checks.listed(events)}; with "
                "collocation friction='modes' or 'sharpen' replaces laws that have them"
            )
        return search.verifier.checked(search.direct.solved(guess))
    return _by_homotopy(search, friction, guess, starts)


def _by_shooting(search: ModeSearch, guess: Start, starts: int) -> Solution:
    """Laws with states by the user's shooting, from the motion with their static side."""
    collocation = replace(search.direct, scheme=Radau())
    unverified = replace(search.verifier, active=False)
    static = _by_homotopy(
        replace(search, direct=collocation, verifier=unverified), "modes", guess, starts
    )
    if static.status in STOPPED or not static.ok:
        return static
    own = search.by_original_law(static)
    return own if own.verification is not None else search.verifier.checked(own)


def _by_homotopy(search: ModeSearch, friction: Friction, guess: Start, starts: int) -> Solution:
    """Layers from wide to narrow, and modes where these are found; directly where layers fail."""
    problem = search.direct.problem
    reason = _refused(problem) if friction != "sharpen" else "not requested"
    if reason and friction == "modes":
        raise ValueError(f"solve: friction 'modes': {reason}")
    path = search.direct.sharpened(guess, starts, 0.0 if reason else LAST)
    try:
        reached = next(path)
    except FAILURES as error:
        if _events(problem):
            raise
        smooth = search.verifier.checked(search.direct.solved(guess))
        return _with_sentence(smooth, f"Friction was not sharpened: {_reason(error)}.")
    return _along(search, friction, path, reached, reason)


def _along(
    search: ModeSearch, friction: Friction, path: Iterator[Sharp], reached: Sharp, reason: str
) -> Solution:
    """The first right motion on `path` from `reached`; else the best one, and what was not done.

    With a `reason` modes are not sought.
    """
    problem, check = search.direct.problem, search.verifier.checked
    tried, said = list[Judged](), f"No motion by modes was sought: {reason}." if reason else ""
    while reached.solution.ok:
        if friction != "modes" and reached.level <= own_level(problem, reached.scales) * 1.001:
            smooth = search.direct.solved(reached.solution, reached.solution.meshes)
            return check(_after(reached.solution, smooth))
        early = reached.level <= EARLY and not reached.steady
        if not reason and (early or reached.level <= LAST * 1.001):
            try:
                tried.append(search.near(reached))
                if tried[-1].right or tried[-1].solution.status in STOPPED:
                    return tried[-1].solution
            except FAILURES as error:
                said = f"Modes were not found: {_reason(error)}."
        try:
            following = next(path, None)
        except FAILURES as error:
            said, following = f"{said} Friction was not sharpened further: {_reason(error)}.", None
        if following is None:
            break
        reached = following
    if any(one.solution.ok or one.solution.status in FOUND for one in tried):
        return max(tried, key=lambda one: one.worth).solution
    if tried:
        last = tried[-1].solution.message.removeprefix(f"ocp '{problem.name}': ")
        said = f"{said} Modes were not found: {last}".lstrip()
    said = "" if friction == "sharpen" else said
    found = reached.solution
    if found.status in STOPPED or not found.ok:
        return _with_sentence(found, said)
    widths = speeds_at(problem, reached.scales, reached.level)
    told = ", ".join(f"{name} over {width:.2g}" for name, width in widths.items())
    said = f"Friction is still smooth: {told} (m/s or rad/s). {said}"
    return _with_sentence(check(found), said)


def states_of_laws(problem: Problem) -> set[str]:
    """States of laws, which a motion by modes does not know."""
    contacts = [c for phase in problem.chain for c in phase.model.contacts]
    return {v.name for c in contacts for v in c.states}


def _without_states_of_laws(solution: Solution, found: Verification) -> Verification:
    """The verification of a motion by modes without states of laws and intervals that need them."""
    hidden = states_of_laws(solution.problem)
    if not hidden:
        return found
    kept = [m for m in found.checked if m.name not in hidden and m.what != "local error"]
    return replace(found, checked=tuple(kept), restarted=None)


def _events(problem: Problem) -> list[str]:
    """Names of events of the models, which no direct solve of the problem follows."""
    return [*dict.fromkeys(e.name for span in problem.spans for e in span.model.events)]


def _refused(problem: Problem) -> str:
    """Return the reason why modes cannot be sought, usually ""."""
    try:
        return refusal(problem)
    except FAILURES as error:
        return _reason(error)


def _with_sentence(solution: Solution, sentence: str) -> Solution:
    """`solution` with a sentence more."""
    return replace(solution, message=f"{solution.message} {sentence}".rstrip())


def _reason(error: Exception) -> str:
    """The failure as a clause: one that is not written for users begins with its kind."""
    first = (str(error).strip().splitlines() or [""])[0].rstrip(".")
    told = isinstance(error, ValueError | SolveError)
    return first if told else f"internal error, {type(error).__name__}: {first}"


def _after(first: Solution, later: Solution) -> Solution:
    """`later` with what both have cost."""
    return replace(later, statistics=first.statistics.then(later.statistics))
