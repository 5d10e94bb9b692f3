"""Strategies of `solve`: direct, by homotopy, by modes, and the order in which they are tried."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from math import isfinite, nan
from typing import Literal, NamedTuple, final

from numpy.typing import ArrayLike

from ocp.checking.mesh_refinement import Goals, refined_solve
from ocp.checking.verify import verified, verify
from ocp.complementarity import solve_relaxed, with_products
from ocp.formulation.phase import Array
from ocp.formulation.problem import Problem
from ocp.friction.event_check import verify_exactly
from ocp.friction.homotopy import FINE, LAST, Sharp, sharpened
from ocp.friction.mode_optimisation import optimise_modes, refusal
from ocp.friction.smooth_models import own_level, speeds_at, sticking
from ocp.original_law import STEPS, OriginalLaw
from ocp.solving.methods import Ipopt
from ocp.solving.one_solve import Solver
from ocp.solving.prepared import Supervisor
from ocp.solving.solution import Solution, with_sentence
from ocp.solving.starts import Start
from ocp.solving.verification import Verification
from ocp.transcription.schemes import Radau, Scheme, Shooting, make_meshes
from symfric.foundation import checks
from symfric.foundation.status import SolveError, Status

Friction = Literal["auto", "smooth", "sharpen", "modes"]
Margins = Iterator[tuple[Solution, float]]
"""Motions by modes with their friction margins."""
INTERVALS = 50
EARLY = 0.04
"""Largest smoothing width, in multiples of the speeds, from which modes are deduced."""
CLOSE_PASSES, CLOSE_INTERVALS, CLOSE_ITERATIONS = 4, 400, 60
"""Limits of a solve that starts from a motion by modes, near which a solution is expected."""
SHARED_PASSES, SHARED_ITERATIONS = 4, 150
"""Limits if scenarios share inputs. Their contacts reverse at many times, and each finer mesh takes
many iterations at these kinks for a thousandth of the cost."""
EXACT_RTOL = 1e-7
"""Relative tolerance of the simulation with exact friction, 1 % of the required accuracy."""
SHARPEST = 1e-4
"""Smallest smoothing width, in multiples of the speeds, of a direct solve."""
MISSED = (Status.TERMINAL_MISS, Status.BOUND_MISS)
FOUND = (*MISSED, Status.UNSTABLE)
"""Statuses of a motion that was found but violates its conditions."""
FAILURES = (ArithmeticError, AttributeError, LookupError, RuntimeError, TypeError, ValueError)
"""Exceptions after which the next strategy is tried."""


@final
@dataclass(frozen=True, eq=False)
class Direct:
    """Direct solves of a problem, on meshes refined by its local errors.

    Attributes:
        problem, scheme, solver, intervals: as in `ocp.solve`.
        goals: goals of mesh refinement; with one pass the mesh is not refined.
        supervisor: time limit and progress of all solves.
    """

    problem: Problem
    scheme: Scheme
    solver: Solver
    intervals: int | ArrayLike | Sequence[ArrayLike] | None
    goals: Goals
    supervisor: Supervisor

    @property
    def ipopt(self) -> Ipopt:
        """The solver if it is Ipopt, otherwise Ipopt without options."""
        return self.solver if isinstance(self.solver, Ipopt) else Ipopt()

    @property
    def meshes(self) -> list[Array]:
        """First meshes."""
        wanted = INTERVALS if self.intervals is None else self.intervals
        return make_meshes(self.problem, wanted)

    def solved(
        self, guess: Start, meshes: Sequence[Array] | None = None, *, close: bool = False
    ) -> Solution:
        """Solve the problem from `guess`; `close` limits passes, intervals and iterations."""
        goals, solver, most = self.goals, self.solver, 0
        if meshes is None:
            meshes = self.meshes
        elif self.problem.scenarios:
            passes, most = min(goals.passes, SHARED_PASSES), SHARED_ITERATIONS
            goals = replace(goals, passes=passes)
        if close:
            passes, most = min(goals.passes, CLOSE_PASSES), CLOSE_ITERATIONS
            goals = replace(goals, passes=passes, most=CLOSE_INTERVALS, patient=False)
        if most and isinstance(solver, Ipopt) and "max_iter" not in solver.options:
            solver = solver.with_options(max_iter=most)
        return refined_solve(
            self.problem, meshes, self.scheme, solver, guess, goals=goals,
            supervisor=self.supervisor,
        )  # fmt: skip

    def sharpened(self, guess: Start, starts: int, last: float) -> Iterator[Sharp]:
        """Yield motions with decreasing smoothing widths, down to `last`."""
        intervals = FINE
        if self.intervals is not None:
            meshes = make_meshes(self.problem, self.intervals)
            intervals = sum(mesh.size - 1 for mesh in meshes[: len(self.problem.chain)])
        return sharpened(
            self.problem, self.scheme, self.solver, guess, intervals=intervals, starts=starts,
            last=last, supervisor=self.supervisor,
        )  # fmt: skip


class Judged(NamedTuple):
    """A motion by modes, and True if it is valid with the user's laws and with exact friction."""

    solution: Solution
    right: bool


@final
@dataclass(frozen=True, eq=False)
class Search:
    """Solution of a problem by its strategies, and verification of the motions that they find.

    Attributes:
        direct: direct solves of the problem.
        tolerance: tolerance of the verification.
        verify: True to verify motions.
        margin: margin of a contact at rest, as a share of its static level.
    """

    direct: Direct
    tolerance: float
    verify: bool
    margin: float

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
        except FAILURES as error:
            return with_sentence(solution, f"It was not verified: {_reason(error)}.")
        names = ", ".join(f"{name}: {type(c.law).__name__}" for name, c in laws.items())
        text = f"{solution.message} Friction with states ({names}) was taken as its steady sliding"
        text += " and its static level, and the motion verified with the law itself."
        if not found.ok and solution.ok:
            text = f"ocp '{solution.problem.name}': {found.sentence} {text}"
            solution = replace(solution, status=found.status)
        return replace(solution, verification=found, message=text)

    def judged(self, solution: Solution) -> Judged:
        """Return a motion by modes with the verdict of a simulation with exact friction."""
        if not self.verify or not (solution.ok or solution.status in MISSED):
            return Judged(solution, solution.ok)
        try:
            exact = verify_exactly(solution, self.tolerance, EXACT_RTOL)
            exact = _without_law_states(solution, exact)
        except FAILURES as error:
            text = f"With exact Coulomb friction it was not simulated: {_reason(error)}."
            return Judged(with_sentence(solution, text), solution.ok)
        if not exact.ok:
            text = f"With exact Coulomb friction: {exact.sentence}"
            return Judged(with_sentence(solution, text), right=False)
        text = f"With exact Coulomb friction it misses by {exact.largest:.1g}"
        if not solution.ok:
            text += " only: the layers of the law creep at rest and break away later; make them "
            text += "narrower, or allow this by `tolerance`"
        return Judged(with_sentence(solution, f"{text}."), solution.ok)

    def near(self, sharp: Sharp) -> Judged:
        """Return the exact motion near a sharpened one, verified with the user's laws."""
        direct, problem = self.direct, self.direct.problem
        speeds = speeds_at(problem, sharp.scales, sharp.level)
        motions = optimise_modes(
            sharp.solution, problem, speeds, solver=direct.ipopt, scheme=direct.scheme,
            margin=self.margin, supervisor=direct.supervisor,
        )  # fmt: skip
        exact, margin = next(motions)
        if exact.status.stopped and not exact.modes:
            by = "The time limit was reached" if exact.status is Status.TIME_LIMIT else "Stopped"
            text = f"ocp '{problem.name}': {by} while modes were sought; friction is still smooth."
            both = _after(exact, sharp.solution)
            stopped = replace(both, status=exact.status, message=text, cause=exact.cause)
            return Judged(stopped, right=False)
        exact = self.checked(_after(sharp.solution, exact))
        if exact.status in MISSED and law_states(problem) and not direct.supervisor.over:
            exact = self.by_original_law(exact)
            if exact.verified:
                return Judged(exact, True)
        narrow = own_level(problem, sharp.scales) < SHARPEST
        if exact.status in MISSED and not narrow and not direct.supervisor.over:
            own = self.checked(direct.solved(exact, exact.meshes, close=True))
            if own.verified:
                return Judged(_after(exact, replace(own, modes=exact.modes)), True)
            exact = _after(own, exact)
        first = self.judged(exact)
        return self._closer(first, margin, motions, sharp.solution) if first.right else first

    def _closer(self, first: Judged, margin: float, motions: Margins, sharp: Solution) -> Judged:
        """Return the valid motion with the smallest margin of contacts at rest."""
        kept, slope, best, last = margin, nan, first, first.solution
        for exact, less in motions:
            last = _after(sharp, exact)
            if exact.status is Status.INTERRUPTED:
                return Judged(last, right=False)
            if exact.ok:
                slope = max(0.0, first.solution.cost - exact.cost) / (margin - less)
            if exact.status.stopped or less < self.margin:
                break
            nearer = self.judged(self.checked(last)) if exact.ok else first
            if exact.ok and nearer.right:
                best, kept = nearer, less
                break
        if last is first.solution:
            return first
        found = replace(best.solution, statistics=last.statistics)
        costs = f"about {slope * kept:.2g} of {found.cost:.6g}" if isfinite(slope) else "is open"
        few = "" if kept <= self.margin else "; with less none was found that is right"
        text = f"Rests keep {kept:.2g} of their static levels, which costs {costs}{few}."
        return Judged(with_sentence(found, text), right=True)

    def by_original_law(self, exact: Solution) -> Solution:
        """Return a motion with the law and its states, found by shooting from `exact`.

        If shooting fails, return `exact` with the reason in its message.
        """
        direct, scheme = self.direct, self.direct.scheme
        scheme = scheme if isinstance(scheme, Shooting) else Shooting("exponential", STEPS)
        settings = direct.ipopt, self.tolerance, direct.supervisor
        try:
            own = OriginalLaw(direct.problem, scheme, *settings).solved(exact)
        except FAILURES as error:  # shooting does not support all models
            return with_sentence(exact, f"With the law itself: {_reason(error)}.")
        own = _after(exact, own)
        if own.verified:
            return replace(own, modes=exact.modes)
        kept = with_sentence(exact, f"By {scheme} with the law itself: {own.message}")
        kept = replace(kept, statistics=own.statistics)
        stopped = own.status.stopped
        return replace(kept, status=own.status, cause=own.cause) if stopped else kept


def solved(search: Search, friction: Friction, guess: Start, starts: int) -> Solution:
    """Solve the problem of `search.direct` by the strategy that it requires."""
    direct, check = search.direct, search.checked
    if any(row.is_product for span in direct.problem.spans for row in span.path):
        return _by_relaxation(search, friction, guess)
    problem, shooting = direct.problem, isinstance(direct.scheme, Shooting)
    holding = any(sticking(phase.model) for phase in problem.chain)
    static = friction == "auto" and not isinstance(guess, Solution) and bool(law_states(problem))
    if shooting and static and not (_refused(problem) or _events(problem)):
        return _by_shooting(search, guess, starts)
    if friction in ("sharpen", "modes") and (shooting or not holding):
        what = "collocation, such as Radau(3)" if shooting else "a contact that holds at rest"
        raise ValueError(f"solve: friction '{friction}': expected {what}, got none")
    if friction != "smooth" and holding and not shooting:
        return _by_homotopy(search, friction, guess, starts)
    if events := _events(problem):
        raise ValueError(
            f"solve: expected models without events, got {checks.listed(events)}; with "
            "collocation friction='modes' or 'sharpen' replaces laws that have them"
        )
    return check(direct.solved(guess))


def _by_relaxation(search: Search, friction: Friction, guess: Start) -> Solution:
    """Solve a problem with complementary signals, with the friction of its models."""
    direct = search.direct
    problem, meshes = direct.problem, direct.meshes
    if friction != "smooth" and any(sticking(phase.model) for phase in problem.chain):
        raise ValueError(
            "solve: expected friction='smooth' with complementary(...), as modes and widths of "
            f"friction are not sought together with it, got {friction!r}"
        )
    settings = direct.goals, direct.supervisor
    found = solve_relaxed(problem, meshes, direct.scheme, direct.solver, guess, *settings)
    return with_products(search.checked(found))


def _by_shooting(search: Search, guess: Start, starts: int) -> Solution:
    """Solve with laws with states by shooting, started from the motion with static friction."""
    collocation = replace(search, direct=replace(search.direct, scheme=Radau()), verify=False)
    static = _by_homotopy(collocation, "modes", guess, starts)
    if static.status.stopped or not static.ok:
        return static
    own = search.by_original_law(static)
    return own if own.verification is not None else search.checked(own)


def _by_homotopy(search: Search, friction: Friction, guess: Start, starts: int) -> Solution:
    """Return the first valid motion on the path of decreasing widths.

    If there is none, return the best motion, with a message about the steps that failed.
    """
    problem, check = search.direct.problem, search.checked
    reason = _refused(problem) if friction != "sharpen" else "not requested"
    if reason and friction == "modes":
        raise ValueError(f"solve: friction 'modes': {reason}")
    path = search.direct.sharpened(guess, starts, 0.0 if reason else LAST)
    try:
        sharp = next(path)
    except FAILURES as error:
        if _events(problem):
            raise
        smooth = check(search.direct.solved(guess))
        return with_sentence(smooth, f"Friction was not sharpened: {_reason(error)}.")
    tried, text = list[Judged](), f"No motion by modes was sought: {reason}." if reason else ""
    while sharp.solution.ok:
        if friction != "modes" and sharp.level <= own_level(problem, sharp.scales) * 1.001:
            smooth = search.direct.solved(sharp.solution, sharp.solution.meshes)
            return check(_after(sharp.solution, smooth))
        early = sharp.level <= EARLY and not sharp.steady
        if not reason and (early or sharp.level <= LAST * 1.001):
            try:
                tried.append(search.near(sharp))
                if tried[-1].right or tried[-1].solution.status.stopped:
                    return tried[-1].solution
            except FAILURES as error:
                text = f"Modes were not found: {_reason(error)}."
        try:
            sharp, before = next(path, sharp), sharp
        except FAILURES as error:
            text, before = f"{text} Friction was not sharpened further: {_reason(error)}.", sharp
        if sharp is before:
            break
    if any(one.solution.ok or one.solution.status in FOUND for one in tried):
        best = max(tried, key=lambda one: (one.right, one.solution.ok, -one.solution.cost))
        return best.solution
    if tried:
        last = tried[-1].solution.message.removeprefix(f"ocp '{problem.name}': ")
        text = f"{text} Modes were not found: {last}".lstrip()
    text = "" if friction == "sharpen" else text
    if not sharp.solution.ok:
        return with_sentence(sharp.solution, text)
    widths = speeds_at(problem, sharp.scales, sharp.level)
    layers = ", ".join(f"{name} over {width:.2g}" for name, width in widths.items())
    text = f"Friction is still smooth: {layers} (m/s or rad/s). {text}"
    return with_sentence(check(sharp.solution), text)


def law_states(problem: Problem) -> set[str]:
    """Return the names of the states of laws, which a motion by modes does not contain."""
    contacts = [c for phase in problem.chain for c in phase.model.contacts]
    return {v.name for c in contacts for v in c.states}


def _without_law_states(solution: Solution, found: Verification) -> Verification:
    """Return `found` without checks of law states and local errors."""
    hidden = law_states(solution.problem)
    if not hidden:
        return found
    kept = [m for m in found.checked if m.name not in hidden and m.what != "local error"]
    return replace(found, checked=tuple(kept), restarted=None)


def _events(problem: Problem) -> list[str]:
    """Return the names of events of the models, which direct solves ignore."""
    return [*dict.fromkeys(e.name for span in problem.spans for e in span.model.events)]


def _refused(problem: Problem) -> str:
    """Return the reason why a search for modes is impossible, or "" if it is possible."""
    try:
        return refusal(problem)
    except FAILURES as error:
        return _reason(error)


def _reason(error: Exception) -> str:
    """Return the message of `error` as a clause, with its type if it is an internal error."""
    first = (str(error).strip().splitlines() or [""])[0].rstrip(".")
    if isinstance(error, ValueError | SolveError):
        return first
    return f"internal error, {type(error).__name__}: {first}"


def _after(first: Solution, later: Solution) -> Solution:
    """Return `later` with the statistics of both solves."""
    return replace(later, statistics=first.statistics.then(later.statistics))
