"""One call of `solve`: the way that a problem needs, and what is done where one ends early."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from math import isfinite, nan
from typing import Literal, final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ocp.checking.refining import Goals, refined_solve
from ocp.checking.verification import Verification
from ocp.checking.verify import verified
from ocp.checking.verify import verify as verify_solution
from ocp.formulation.problem import Problem
from ocp.friction.own_law import STEPS, OwnLaw
from ocp.friction.polish import polish, refusal
from ocp.friction.referee import verify_exactly
from ocp.friction.scales import has_jumps, own_level, speeds_at
from ocp.friction.sharpen import FINE, LAST, Sharp, sharpened
from ocp.result.motion import Stored
from ocp.result.solution import Solution
from ocp.solvers.methods import Ipopt
from ocp.solvers.outcome import Report
from ocp.solving.clock import Clock
from ocp.solving.one_solve import Solver
from ocp.solving.starts import Start
from ocp.transcription.grid import make_meshes
from ocp.transcription.schemes import Radau, Scheme, Shooting
from symfric.foundation import checks
from symfric.foundation.status import SolveError, Status

Array = NDArray[np.float64]
Friction = Literal["auto", "smooth", "sharpen", "modes"]
INTERVALS = 50
EARLY = 0.04
"""Layers, in multiples of the speeds, from which on the modes of a motion may be read."""
CLOSE_PASSES, CLOSE_INTERVALS, CLOSE_ITERATIONS = 4, 400, 60
"""What a solve is allowed that starts at a motion by modes: its law is near, or not found."""
SHARED_PASSES, SHARED_ITERATIONS = 4, 150
"""What is allowed where scenarios share inputs: their contacts turn round at many instants, and
each finer mesh is a search among kinks for a thousandth of the cost."""
STOPPED = (Status.INTERRUPTED, Status.TIME_LIMIT)
EXACT_RTOL = 1e-7
"""Relative tolerance of the motion with exact friction: a hundredth of what matters."""
SHARPEST = 1e-4
"""Layers, in multiples of the speeds, that are too narrow for one solve with them."""
MISSED = (Status.TERMINAL_MISS, Status.BOUND_MISS)
FOUND = (*MISSED, Status.UNSTABLE)
"""How a motion ends that was found and does not do what it should."""
FAILURES = (ArithmeticError, AttributeError, LookupError, RuntimeError, TypeError, ValueError)
"""What may come out of a way of friction that fails: another way is gone then."""


@final
@dataclass(frozen=True, eq=False)
class Job:
    """One call of `solve`, with arguments that are what they should be.

    Attributes:
        see `ocp.solve`; `clock` runs for all of it.
    """

    problem: Problem
    scheme: Scheme
    solver: Solver
    intervals: int | ArrayLike | Sequence[ArrayLike] | None
    guess: Start
    friction: Friction
    tolerance: float
    refine: bool
    verify: bool
    starts: int
    resting_margin: float
    progress: Report | None
    clock: Clock

    def solved(self) -> Solution:
        """By the way that the problem needs."""
        holding, shooting = has_jumps(self.problem), isinstance(self.scheme, Shooting)
        if shooting and self.by_static_side:
            return self.shot()
        if self.friction in ("sharpen", "modes") and (shooting or not holding):
            what = "collocation, such as Radau(3)" if shooting else "a contact that holds at rest"
            raise ValueError(f"solve: friction '{self.friction}': expected {what}, got none")
        if self.friction == "smooth" or shooting or not holding:
            events = dict.fromkeys(e.name for span in self.problem.spans for e in span.model.events)
            if events:
                raise ValueError(
                    f"solve: expected models without events, got {checks.listed(events)}; with "
                    "collocation friction='modes' or 'sharpen' replaces laws that have them"
                )
            return self.checked(self.plain(self.guess))
        return self.sharp()

    @property
    def by_static_side(self) -> bool:
        """Whether shooting starts from what collocation finds with the static side of laws."""
        known = isinstance(self.guess, Solution | Stored)
        return self.friction == "auto" and not known and bool(self.hidden) and self.smoothable

    @property
    def smoothable(self) -> bool:
        """Whether the modes of the problem can be sought."""
        return not (self.refused or self.by_events)

    @property
    def by_events(self) -> bool:
        """Whether a model has events, which no solve of it as it stands follows."""
        return any(span.model.events for span in self.problem.spans)

    @property
    def refused(self) -> str:
        """Why modes cannot be sought; mostly empty."""
        try:
            return refusal(self.problem)
        except FAILURES as error:
            return _why(error)

    def shot(self) -> Solution:
        """Laws with states by the user's shooting, from the motion with their static side."""
        static = replace(self, scheme=Radau(), friction="modes", verify=False).sharp()
        if static.status in STOPPED or not static.ok:
            return static
        own = self.by_own_law(static)
        return own if own.verification is not None else self.checked(own)

    def plain(
        self, guess: Start, meshes: Sequence[Array] | None = None, *, close: bool = False
    ) -> Solution:
        """The models as they are; from `close` by, a solver that loses its way is left."""
        goals, solver, most = Goals.of(self.tolerance), self.solver, 0
        if meshes is None:
            wanted = INTERVALS if self.intervals is None else self.intervals
            meshes = make_meshes(self.problem, wanted)
        elif self.problem.scenarios:
            goals, most = replace(goals, passes=SHARED_PASSES), SHARED_ITERATIONS
        if close:
            most = CLOSE_ITERATIONS
            goals = replace(goals, passes=CLOSE_PASSES, most=CLOSE_INTERVALS, patient=False)
        if most and isinstance(solver, Ipopt) and "max_iter" not in solver.options:
            solver = solver.with_options(max_iter=most)
        return refined_solve(
            self.problem, meshes, self.scheme, solver, guess, self.progress,
            goals=goals if self.refine else replace(goals, passes=1), limit=self.clock.within,
        )  # fmt: skip

    def sharp(self) -> Solution:
        """Layers from wide to narrow, and what comes then; without them where these fail."""
        reason = self.refused if self.friction != "sharpen" else "not asked for"
        if reason and self.friction == "modes":
            raise ValueError(f"solve: friction 'modes': {reason}")
        path = sharpened(
            self.problem,
            self.scheme,
            self.solver,
            self.guess,
            intervals=self.first_intervals,
            starts=self.starts,
            last=0.0 if reason else LAST,
            clock=self.clock,
            progress=self.progress,
        )
        try:
            reached = next(path)
        except FAILURES as error:
            if self.by_events:
                raise
            smooth = self.checked(self.plain(self.guess))
            return _said(smooth, f"Friction was not sharpened: {_why(error)}.")
        return self.along(path, reached, reason)

    @property
    def first_intervals(self) -> int:
        """Intervals of the whole motion before refinement, where layers narrow."""
        if self.intervals is None:
            return FINE
        meshes = make_meshes(self.problem, self.intervals)
        return sum(mesh.size - 1 for mesh in meshes[: len(self.problem.chain)])

    def along(self, path: Iterator[Sharp], reached: Sharp, reason: str) -> Solution:
        """The first motion on the way that is right; else the best one, and what was not done.

        Args:
            path: to narrower layers.
            reached: its first motion.
            reason: why modes are not sought; empty where they are.
        """
        tried, said = list[_Exact](), f"No motion by modes was sought: {reason}." if reason else ""
        while reached.solution.ok:
            own = own_level(self.problem, reached.scales)
            if self.friction != "modes" and reached.level <= own * 1.001:
                smooth = self.plain(reached.solution, reached.solution.meshes)
                return self.checked(_after(reached.solution, smooth))
            readable = reached.level <= LAST * 1.001 or (
                reached.level <= EARLY and not reached.steady
            )
            if readable and not reason:
                try:
                    tried.append(self.polished(reached))
                    if tried[-1].right or tried[-1].solution.status in STOPPED:
                        return tried[-1].solution
                except FAILURES as error:
                    said = f"Modes were not found: {_why(error)}."
            try:
                following = next(path, None)
            except FAILURES as error:
                said, following = f"{said} Friction was not sharpened further: {_why(error)}.", None
            if following is None:
                break
            reached = following
        if any(one.solution.ok or one.solution.status in FOUND for one in tried):
            return max(tried, key=lambda one: one.worth).solution
        if tried:
            last = tried[-1].solution.message.removeprefix(f"ocp '{self.problem.name}': ")
            said = f"{said} Modes were not found: {last}".lstrip()
        return self.unpolished(reached, "" if self.friction == "sharpen" else said)

    def polished(self, sharp: Sharp) -> "_Exact":
        """The exact motion next to a sharpened one, verified with the user's own laws."""
        speeds = speeds_at(self.problem, sharp.scales, sharp.level)
        found = polish(
            sharp.solution, self.problem, speeds,
            solver=self.solver if isinstance(self.solver, Ipopt) else Ipopt(), scheme=self.scheme,
            progress=self.progress, margin=self.resting_margin, clock=self.clock,
        )  # fmt: skip
        exact, margin = next(found)
        if exact.status in STOPPED and not exact.modes:
            by = "The time limit was reached" if exact.status is Status.TIME_LIMIT else "Stopped"
            name = self.problem.name
            said = f"ocp '{name}': {by} while modes were sought; friction is still smooth."
            both = _after(exact, sharp.solution)
            stopped = replace(both, status=exact.status, message=said, cause=exact.cause)
            return _Exact(stopped, right=False)
        exact = self.checked(_after(sharp.solution, exact))
        if exact.status in MISSED and self.hidden and not self.clock.over:
            exact = self.by_own_law(exact)
            if exact.verified:
                return _Exact(exact, True)
        narrow = own_level(self.problem, sharp.scales) < SHARPEST
        if exact.status in MISSED and not narrow and not self.clock.over:
            own = self.checked(self.plain(exact, exact.meshes, close=True))
            if own.verified:
                return _Exact(_after(exact, replace(own, modes=exact.modes)), True)
            exact = _after(own, exact)
        one = self.judged(exact)
        return self.closer(one, margin, found, sharp.solution) if one.right else one

    def closer(
        self,
        one: "_Exact",
        margin: float,
        others: Iterator[tuple[Solution, float]],
        sharp: Solution,
    ) -> "_Exact":
        """The motion whose rests come closest to their levels of those that are right."""
        kept, slope, best, last = margin, nan, one, one.solution
        for exact, less in others:
            last = _after(sharp, exact)
            if exact.status is Status.INTERRUPTED:
                return _Exact(last, right=False)
            if exact.ok:
                slope = max(0.0, one.solution.cost - exact.cost) / (margin - less)
            if exact.status in STOPPED or less < self.resting_margin:
                break
            if exact.ok and (nearer := self.judged(self.checked(last))).right:
                best, kept = nearer, less
                break
        if last is one.solution:
            return one
        found = replace(best.solution, statistics=last.statistics)
        costs = f"about {slope * kept:.2g} of {found.cost:.6g}" if isfinite(slope) else "is open"
        few = "" if kept <= self.resting_margin else "; with less none was found that is right"
        said = f"Rests keep {kept:.2g} of their static levels, which costs {costs}{few}."
        return _Exact(_said(found, said), right=True)

    def by_own_law(self, exact: Solution) -> Solution:
        """A motion that misses with a law with states, found with that law itself by shooting.

        `exact`, with the reason, where that does not succeed.
        """
        scheme = (
            self.scheme if isinstance(self.scheme, Shooting) else Shooting("exponential", STEPS)
        )
        solver = self.solver if isinstance(self.solver, Ipopt) else Ipopt()
        way = OwnLaw(self.problem, scheme, solver, self.tolerance, self.clock, self.progress)
        try:
            own = way.solved(exact)
        except FAILURES as error:  # mechanisms, algebraic variables
            return _said(exact, f"With the law itself: {_why(error)}.")
        own = _after(exact, own)
        if not own.verified:
            said = f"{exact.message} By {scheme} with the law itself: {own.message}"
            kept = replace(exact, message=said, statistics=own.statistics)
            stopped = own.status in STOPPED
            return replace(kept, status=own.status, cause=own.cause) if stopped else kept
        return replace(own, modes=exact.modes)

    def judged(self, exact: Solution) -> "_Exact":
        """A motion by modes with what the law by events, which smooths nothing, says of it."""
        if not self.verify or exact.status in STOPPED or not (exact.ok or exact.status in MISSED):
            return _Exact(exact, exact.ok)
        try:
            found = self.told(verify_exactly(exact, self.tolerance, EXACT_RTOL))
        except FAILURES as error:
            said = f"With exact Coulomb friction it was not simulated: {_why(error)}."
            return _Exact(_said(exact, said), exact.ok)
        if not found.ok:
            said = f"{exact.message} With exact Coulomb friction: {found.sentence}"
            return _Exact(replace(exact, message=said), right=False)
        said = f"{exact.message} With exact Coulomb friction it misses by {found.largest:.1g}"
        if not exact.ok:
            said += (
                " only: the layers of the law creep at rest and break away later; make them "
                "narrower, or allow this by `tolerance`"
            )
        return _Exact(replace(exact, message=f"{said}."), exact.ok)

    def unpolished(self, sharp: Sharp, why: str) -> Solution:
        """What there is when modes were not found, and `why`: the motion with layers left."""
        found = sharp.solution
        if found.status in STOPPED or not found.ok:
            return _said(found, why)
        widths = speeds_at(self.problem, sharp.scales, sharp.level)
        told = ", ".join(f"{name} over {width:.2g}" for name, width in widths.items())
        said = f"Friction is still smooth: {told} (m/s or rad/s). {why}"
        return _said(self.checked(found), said)

    def checked(self, solution: Solution) -> Solution:
        """`solution` with its verification.

        Of a motion by modes the states of laws are not known: what the simulation makes of them is
        no miss, and a local error cannot be told.
        """
        if not self.verify or solution.status in STOPPED:
            return solution
        laws = {c.name: c for phase in self.problem.chain for c in phase.model.contacts if c.states}
        try:
            if not (solution.modes and laws):
                return verified(solution, self.tolerance)
            found = self.told(verify_solution(solution, self.tolerance))
        except FAILURES as error:
            return _said(solution, f"It was not verified: {_why(error)}.")
        names = ", ".join(f"{name}: {type(c.law).__name__}" for name, c in laws.items())
        said = (
            f"{solution.message} Friction with states ({names}) was taken as its steady sliding "
            "and its static level, and the motion verified with the law itself."
        )
        if not found.ok and solution.ok:
            said = f"ocp '{self.problem.name}': {found.sentence} {said}"
            solution = replace(solution, status=found.status)
        return replace(solution, verification=found, message=said)

    def told(self, found: Verification) -> Verification:
        """What can be told of a motion by modes: nothing of the states of laws, if there are any.

        Intervals that start without them err.
        """
        if not self.hidden:
            return found
        kept = [m for m in found.checked if m.name not in self.hidden and m.what != "local error"]
        return replace(found, checked=tuple(kept), restarted=None)

    @property
    def hidden(self) -> set[str]:
        """States of laws, which a motion by modes does not know."""
        contacts = [c for phase in self.problem.chain for c in phase.model.contacts]
        return {v.name for c in contacts for v in c.states}


def _said(solution: Solution, sentence: str) -> Solution:
    """`solution` with a sentence more."""
    return replace(solution, message=f"{solution.message} {sentence}".rstrip())


def _why(error: Exception) -> str:
    """What failed, as a clause: what is not written for users begins with its kind."""
    first = (str(error).strip().splitlines() or [""])[0].rstrip(".")
    told = isinstance(error, ValueError | SolveError)
    return first if told else f"internal error, {type(error).__name__}: {first}"


def _after(first: Solution, later: Solution) -> Solution:
    """`later` with what both have cost."""
    return replace(later, statistics=first.statistics.then(later.statistics))


@final
@dataclass(frozen=True, eq=False)
class _Exact:
    """A motion by modes, and whether it is right with the user's laws and with exact friction."""

    solution: Solution
    right: bool

    @property
    def worth(self) -> tuple[bool, bool, float]:
        """The larger the better: right before wrong, solved before failed, then by cost."""
        return self.right, self.solution.ok, -self.solution.cost
