"""Strategies of `solve`: direct, by homotopy, by modes, and their order.

1. Models without contacts that stick, and `friction="smooth"`: direct solves on refined meshes.
2. Otherwise coarse solves with wide layers from several starts (`friction.homotopy`).
3. With one contact and a narrow law, their layers are narrowed on the coarse mesh, and the modes of
   each motion are optimised (`friction.mode_optimisation`). A valid motion ends the search, so the
   fine homotopy is skipped.
4. Otherwise the layers of the best motion are narrowed on refined meshes. Modes are sought when a
   step fails or the last width is reached, and the first valid motion ends the search.
5. The law itself follows by a direct solve or by shooting, only if the motion by modes misses under
   it. A guess with modes skips steps 2 to 4 if modes near it are valid.
"""

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Literal, NamedTuple, final

from numpy.typing import ArrayLike

from ocp.checking.mesh_refinement import Goals, refined_solve
from ocp.checking.verify import confirmed, verified, verify
from ocp.complementarity import solve_relaxed, with_products
from ocp.formulation.phase import Array
from ocp.formulation.problem import Problem
from ocp.friction.event_check import verify_exactly, without_law_states
from ocp.friction.homotopy import FINE, LAST, Sharp, resumed, sharpened
from ocp.friction.mode_optimisation import optimise_modes, refusal
from ocp.friction.smooth_models import (
    bristles,
    is_exact,
    law_states,
    narrowed,
    own_level,
    speeds_at,
    sticking,
)  # fmt: skip
from ocp.original_law import FAILURES, STEPS, OriginalLaw, reason_of
from ocp.solving.one_solve import STARTS, Task
from ocp.solving.solution import Solution, with_sentence
from ocp.solving.starts import Start
from ocp.transcription.schemes import Radau, Shooting, make_meshes
from symfric.foundation import checks
from symfric.foundation.status import Status

Friction = Literal["auto", "smooth", "sharpen", "modes"]
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
MISSED = (Status.TERMINAL_MISS, Status.BOUND_MISS)
FOUND = (*MISSED, Status.UNSTABLE)
"""Statuses of a motion that was found but violates its conditions."""
SHARPEST = 1e-4
"""Smallest smoothing width, in multiples of the speeds, of a direct solve."""


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


@final
@dataclass(frozen=True, eq=False)
class Search:
    """Solution of a problem by its strategies, and verification of the motions that they find.

    Attributes:
        task: the problem, with scheme, solver, time limit and progress.
        intervals: as in `ocp.solve`.
        goals: goals of mesh refinement; with one pass the mesh is not refined.
        tolerance: tolerance of the verification.
        verify: True to verify motions.
        margin: margin of a contact at rest, as a share of its static level.
    """

    task: Task
    intervals: int | ArrayLike | Sequence[ArrayLike] | None
    goals: Goals
    tolerance: float
    verify: bool
    margin: float

    @property
    def meshes(self) -> list[Array]:
        """First meshes."""
        wanted = INTERVALS if self.intervals is None else self.intervals
        return make_meshes(self.task.problem, wanted)

    def direct(
        self, guess: Start, meshes: Sequence[Array] | None = None, *, close: bool = False,
        starts: int | None = None,
    ) -> Solution:  # fmt: skip
        """Solve on refined meshes from `starts` starts; `close` limits passes and iterations."""
        goals, solver, most = self.goals, self.task.solver, 0
        if meshes is None:
            meshes = self.meshes
        elif self.task.problem.scenarios:
            passes, most = min(goals.passes, SHARED_PASSES), SHARED_ITERATIONS
            goals = replace(goals, passes=passes)
        if close:
            passes, most = min(goals.passes, CLOSE_PASSES), CLOSE_ITERATIONS
            goals = replace(goals, passes=passes, most=CLOSE_INTERVALS, patient=False)
        if most:
            solver = solver.with_defaults(max_iter=most)
        task = replace(self.task, solver=solver)
        return refined_solve(task, meshes, guess, goals, starts=starts or 1)

    def sharpened(self, guess: Start, starts: int | None, last: float) -> Iterator[Sharp]:
        """Yield motions with decreasing smoothing widths, down to `last`."""
        problem, intervals = self.task.problem, FINE
        if self.intervals is not None:
            intervals = sum(mesh.size - 1 for mesh in self.meshes[: len(problem.chain)])
        return sharpened(
            self.task, guess, intervals=intervals, starts=starts or STARTS, last=last,
            rivals=last > 0 and not bristles(problem),
        )  # fmt: skip

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
            found = without_law_states(solution, verify(solution, self.tolerance))
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
            exact = without_law_states(solution, exact)
        except FAILURES as error:
            text = f"With exact Coulomb friction it was not simulated: {reason_of(error)}."
            return Judged(with_sentence(solution, text), solution.ok)
        if exact.ok and not solution.ok:
            return Judged(self._creeping(solution, exact.largest), right=False, exact=True)
        text = f"it misses by {exact.largest:.1g}." if exact.ok else exact.sentence
        text = f"With exact Coulomb friction{'' if exact.ok else ':'} {text}"
        return Judged(with_sentence(solution, text), right=exact.ok)

    def _creeping(self, solution: Solution, exact: float) -> Solution:
        """Return a motion that is valid only with exact friction, where it misses by `exact`."""
        found, layers = solution.verification, ""
        if found is None or not found.misses:
            return solution
        grows = " and whose errors grow" if found.unstable else ""
        for share in (0.5, 0.05):
            with suppress(*FAILURES):
                problem, narrow = narrowed(solution.problem, share * self.tolerance / found.largest)
                if narrow and verify(replace(solution, problem=problem), self.tolerance).ok:
                    layers = f"a layer of {checks.listed(narrow.values())}, "
                    break
        text = (
            f"ocp '{solution.problem.name}': The motion is valid with exact Coulomb friction "
            f"(largest miss {exact:.1g}), but under the laws of the model, whose layers creep at "
            f"rest{grows}, {found.misses[0].sentence}; {layers}feedback along the motion, or the "
            "law ExactCoulomb or Exact(law) closes the gap."
        )
        return replace(solution, message=text)

    def near(self, sharp: Sharp) -> Judged:
        """Return the best exact motion near a sharpened one or its rivals, with the user's laws.

        Motions with small margins of contacts at rest are tried first.
        """
        problem, each = self.task.problem, sharp.rivals or (sharp,)
        found = optimise_modes(
            [(one.solution, speeds_at(problem, one.scales, one.level)) for one in each],
            self.task,
            self.margin,
        )
        narrow = own_level(problem, sharp.scales) < SHARPEST
        margins = found.margins if narrow else (*found.margins[:1], *found.margins[1:][-1:])
        margins = margins[-1:] if bristles(problem) else margins
        judged = Judged(sharp.solution, right=False)
        for margin in margins:
            exact, last = found.motion(margin), margin == margins[-1]
            if exact.status.stopped:
                return Judged(_stopped(exact, sharp.solution), right=False)
            exact = self.checked(_after(sharp.solution, exact))
            if exact.status in MISSED and last and not self.task.supervisor.over:
                exact = self.by_original_law(exact) if bristles(problem) else exact
                own = exact if narrow or confirmed(exact) else self._by_own_law(exact)
                if confirmed(own):
                    return Judged(own, True)
                exact = _after(own, exact) if own is not exact else exact
            if exact.ok or last:
                judged = self.judged(exact)
            if judged.right:
                return Judged(with_sentence(judged.solution, found.rests(margin, exact.cost)), True)
        return judged._replace(exact=judged.exact and narrow)

    def _by_own_law(self, exact: Solution) -> Solution:
        """Return the verified motion with the laws of the problem, near a motion by modes."""
        own = self.checked(self.direct(exact, exact.meshes, close=True))
        return replace(_after(exact, own), modes=exact.modes)

    def by_original_law(self, exact: Solution) -> Solution:
        """Return a motion with the law and its states, found by shooting from `exact`."""
        scheme = self.task.scheme
        scheme = scheme if isinstance(scheme, Shooting) else Shooting("exponential", STEPS)
        return OriginalLaw(replace(self.task, scheme=scheme), self.tolerance).continued(exact)


def _stopped(exact: Solution, sharp: Solution) -> Solution:
    """Return the motion of a stopped search: with modes if there are any, otherwise smooth."""
    if exact.modes:
        return _after(sharp, exact)
    by = "The time limit was reached" if exact.status is Status.TIME_LIMIT else "Stopped"
    text = f"ocp '{exact.problem.name}': {by} while modes were sought; friction is still smooth."
    return replace(_after(exact, sharp), status=exact.status, message=text, cause=exact.cause)


def solved(search: Search, friction: Friction, guess: Start, starts: int | None) -> Solution:
    """Solve the problem of `search` by the strategy that it requires."""
    problem, shooting = search.task.problem, isinstance(search.task.scheme, Shooting)
    if any(row.is_product for span in problem.spans for row in span.path):
        return _by_relaxation(search, friction, guess)
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
    return search.checked(search.direct(guess, starts=starts))


def _by_relaxation(search: Search, friction: Friction, guess: Start) -> Solution:
    """Solve a problem with complementary signals, with the friction of its models."""
    meshes = search.meshes
    if friction != "smooth" and any(sticking(phase.model) for phase in search.task.problem.chain):
        raise ValueError(
            "solve: expected friction='smooth' with complementary(...), as modes and widths of "
            f"friction are not sought together with it, got {friction!r}"
        )
    found = solve_relaxed(search.task, meshes, guess, search.goals)
    return with_products(search.checked(found))


def _by_shooting(search: Search, guess: Start, starts: int | None) -> Solution:
    """Solve with laws with states by shooting, started from the motion with static friction."""
    collocation = replace(search, task=replace(search.task, scheme=Radau()), verify=False)
    static = _by_homotopy(collocation, "modes", guess, starts)
    if static.status.stopped or not static.ok:
        return static
    own = search.by_original_law(static)
    return own if own.verification is not None else search.checked(own)


def _by_homotopy(search: Search, friction: Friction, guess: Start, starts: int | None) -> Solution:
    """Return the first valid motion on the path of decreasing widths.

    If there is none, return the best motion, with a message about the steps that failed.
    """
    problem, check = search.task.problem, search.checked
    reason = _refused(problem) if friction != "sharpen" else "not requested"
    if reason and friction == "modes":
        raise ValueError(f"solve: friction 'modes': {reason}")
    if isinstance(guess, Solution) and guess.modes and starts is None and not reason:
        with suppress(*FAILURES):
            last = resumed(search.task, guess)
            if last.solution.ok and (found := search.near(last)).right:
                return found.solution
    path = search.sharpened(guess, starts, 0.0 if reason else LAST)
    try:
        sharp = next(path)
    except FAILURES as error:
        if _events(problem):
            raise
        smooth = check(search.direct(guess, starts=starts))
        return with_sentence(smooth, f"Friction was not sharpened: {reason_of(error)}.")
    tried, ended = list[Judged](), False
    text = f"No motion by modes was sought: {reason}." if reason else ""
    while sharp.solution.ok:
        if friction != "modes" and sharp.level <= own_level(problem, sharp.scales) * 1.001:
            smooth = search.direct(sharp.solution, sharp.solution.meshes)
            return check(_after(sharp.solution, smooth))
        early = sharp.level <= EARLY and not sharp.steady
        if not reason and (sharp.rivals or early or ended or sharp.level <= LAST * 1.001):
            try:
                tried.append(search.near(sharp))
                last = tried[-1]  # narrower layers would not change a motion that is exact
                if last.right or last.exact or last.solution.status.stopped:
                    return tried[-1].solution
            except FAILURES as error:
                text = f"Modes were not found: {reason_of(error)}."
        if ended:
            break
        try:
            sharp, before = next(path, sharp), sharp
        except FAILURES as error:
            text, before = f"{text} Friction was not sharpened further: {reason_of(error)}.", sharp
        ended = sharp is before
        if ended and (tried or reason):  # otherwise modes are sought once, from the last motion
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


def _events(problem: Problem) -> list[str]:
    """Return the names of events of the models, which direct solves ignore."""
    return [*dict.fromkeys(e.name for span in problem.spans for e in span.model.events)]


def _refused(problem: Problem) -> str:
    """Return the reason why a search for modes is impossible, or "" if it is possible."""
    try:
        return refusal(problem)
    except FAILURES as error:
        return reason_of(error)


def _after(first: Solution, later: Solution) -> Solution:
    """Return `later` with the statistics of both solves."""
    return replace(later, statistics=first.statistics.then(later.statistics))
