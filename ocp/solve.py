"""Solve a problem: as it is, or with friction by way of smooth layers and modes; then look."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal, final, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ocp.checking.refining import Goals, refined_solve
from ocp.checking.verification import Verification
from ocp.checking.verify import verified
from ocp.checking.verify import verify as verify_solution
from ocp.friction.own_law import STEPS, OwnLaw
from ocp.friction.polish import polish, refusal
from ocp.friction.referee import verify_exactly
from ocp.friction.scales import has_jumps, own_level, speeds_at
from ocp.friction.sharpen import FINE, LAST, STARTS, Sharp, sharpened
from ocp.result.solution import Solution
from ocp.result.stored import Stored
from ocp.solvers.fatrop import Fatrop
from ocp.solvers.ipopt import Ipopt
from ocp.solvers.outcome import Report
from ocp.solvers.sqp import Sqp
from ocp.solving.clock import Clock
from ocp.solving.one_solve import Solver
from ocp.solving.starts import Start
from ocp.text.doubts import doubts
from ocp.text.problem import Problem
from ocp.transcription.grid import make_meshes
from ocp.transcription.schemes import Legendre, Radau, Scheme, Shooting
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


def solve(
    problem: Problem,
    *,
    scheme: Scheme | None = None,
    intervals: int | ArrayLike | Sequence[ArrayLike] | None = None,
    solver: Solver | None = None,
    guess: Start = None,
    friction: Friction = "auto",
    tolerance: float = 1e-3,
    refine: bool = True,
    verify: bool = True,
    starts: int = STARTS,
    progress: Report | None = None,
    max_time: float | None = None,
    throw: bool = True,
) -> Solution:
    """Solve `problem`, and simulate its models under the control that was found.

    "Solved" only says that a discretised problem is. What the models do under the control, at the
    ends, on the way and between the nodes, says the verification, which decides: a solution that
    misses is none.

    Where a contact holds at rest, one solve of the problem as it stands ends in the next of many
    local optima and misses. `friction` says what is done:

        "auto"     "modes" where the layer of the law is narrower than a hundredth of the speeds;
                   else "sharpen" down to the law itself. Without contacts that hold, "smooth".
        "modes"    layers from wide to narrow, then the modes of each contact, slip and stick, with
                   the instants between them (`ocp.friction.polish`): for exact Coulomb friction
                   with stiction, whatever smooths it. `solution.modes` tells them. A law with
                   states (LuGre, GMS) is replaced by its steady sliding and its static level, and
                   the result verified with the law itself. If it misses, `Shooting` with
                   exponential steps goes on from there with the law itself where it can; the
                   message says so. `scheme=Shooting(...)` with "auto" always does.
        "sharpen"  layers from wide to narrow, down to those of the law, or as far as it gets.
        "smooth"   the models as they are, states of laws included.

    Args:
        problem: what to solve.
        scheme: `Radau(3)` if none; or `Legendre(d)`, `Shooting(method, steps)`.
        intervals: their number for each phase, fractions of T, or a list of these; 50 if none, and
            with friction so many that the whole motion has 60. Refinement changes them.
        solver: `Ipopt()` if none; or `Fatrop()`, `Sqp()`.
        guess: values by name (see `ocp.solving.starts`), a solution, or one that was saved. With
            friction, further starts are made around it.
        friction: see above.
        tolerance: of the verification, relative to the largest magnitude of each state.
        refine: make the mesh finer where intervals err or where it costs to hold the inputs over
            them; with False it stays, where no friction is sharpened.
        verify: simulate the models under the control.
        starts: with friction, number of coarse solves of which the best goes on.
        progress: called with a `Progress` after each iteration. Ctrl-C, or an exception raised
            here, stops the solver.
        max_time: wall time [s] for all; what was found by then is returned.
        throw: raise `SolveError` on failure; with False the solution is returned as it is.

    Raises:
        ValueError: bad input.
        SolveError: not solved, stopped, or not verified; its `partial` is the best solution there
            is, with its statistics and verification.

    Limits: a local optimum. With friction it is the best of a few starts.
    """
    checks.kind("solve", problem, Problem, "a problem, such as Problem(Phase(model, T=1.0), cost)")
    tolerance = checks.number("solve: tolerance", tolerance, above=0.0)
    for name, flag in (("refine", refine), ("verify", verify), ("throw", throw)):
        checks.flag(f"solve: {name}", flag)
    starts = checks.count("solve: starts", starts)
    if progress is not None:
        checks.function("solve: progress", progress, "a function of the progress")
    if friction not in get_args(Friction):
        raise checks.refused("solve: friction", f"one of {', '.join(get_args(Friction))}", friction)
    if max_time is not None:
        max_time = checks.number("solve: max_time", max_time, unit="s", above=0.0)
    scheme = Radau() if scheme is None else scheme
    if not isinstance(scheme, Radau | Legendre | Shooting):  # pyright: ignore[reportUnnecessaryIsInstance]
        raise checks.refused("solve: scheme", "a scheme, such as Radau(3)", scheme)
    solver = Ipopt() if solver is None else solver
    if not isinstance(solver, Ipopt | Fatrop | Sqp):  # pyright: ignore[reportUnnecessaryIsInstance]
        raise checks.refused("solve: solver", "a solver, such as Ipopt()", solver)
    job = _Job(
        problem=problem, scheme=scheme, solver=solver, intervals=intervals, guess=guess,
        friction=friction, tolerance=tolerance, refine=refine, verify=verify, starts=starts,
        progress=progress, clock=Clock(max_time),
    )  # fmt: skip
    solution = job.solved()
    odd = "" if solution.ok else doubts(problem)
    if odd:
        solution = replace(solution, message=f"{solution.message} {odd}")
    if throw and not solution.ok:
        raise SolveError(solution.message, solution.status, solution) from solution.cause
    return solution


@final
@dataclass(frozen=True, eq=False)
class _Job:
    """One call of `solve`."""

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
        return not refusal(self.problem) and not any(s.model.events for s in self.problem.spans)

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
        """Layers from wide to narrow, and what comes then."""
        reason = refusal(self.problem) if self.friction != "sharpen" else "not asked for"
        if reason and self.friction == "modes":
            raise ValueError(f"solve: friction 'modes': {reason}")
        path = sharpened(
            self.problem,
            self.scheme,
            self.solver,
            self.guess,
            intervals=self.intervals if isinstance(self.intervals, int) else FINE,
            starts=self.starts,
            last=0.0 if reason else LAST,
            clock=self.clock,
            progress=self.progress,
        )
        tried: list[_Exact] = []
        reached = next(path)
        while reached.solution.ok:
            own = own_level(self.problem, reached.scales)
            if self.friction != "modes" and reached.level <= own * 1.001:
                smooth = self.plain(reached.solution, reached.solution.meshes)
                return self.checked(_after(reached.solution, smooth))
            readable = reached.level <= LAST * 1.001 or (
                reached.level <= EARLY and not reached.steady
            )
            if readable and not reason:
                tried.append(self.polished(reached))
                if tried[-1].right or tried[-1].solution.status in STOPPED:
                    return tried[-1].solution
            following = next(path, None)
            if following is None:
                break
            reached = following
        if tried:
            return max(tried, key=lambda one: one.worth).solution
        return self.unpolished(reached)

    def polished(self, sharp: Sharp) -> "_Exact":
        """The exact motion next to a sharpened one, verified with the user's own laws."""
        solver = self.solver if isinstance(self.solver, Ipopt) else Ipopt()
        limits = [t for t in (solver.max_time, self.clock.left) if t is not None]
        solver = Ipopt(max_time=min(limits, default=None), **solver.options)
        speeds = speeds_at(self.problem, sharp.scales, sharp.level)
        exact = polish(
            sharp.solution, self.problem, speeds,
            solver=solver, scheme=self.scheme, progress=self.progress,
        )  # fmt: skip
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
        return self.judged(exact)

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
        except ValueError as error:  # mechanisms, algebraic variables
            return replace(exact, message=f"{exact.message} With the law itself: {error}.")
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
        found = self.told(verify_exactly(exact, self.tolerance, EXACT_RTOL))
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

    def unpolished(self, sharp: Sharp) -> Solution:
        """What there is when modes were not found: the motion with layers that are left."""
        found = sharp.solution
        if found.status in STOPPED or not found.ok:
            return found
        widths = speeds_at(self.problem, sharp.scales, sharp.level)
        told = ", ".join(f"{name} over {width:.2g}" for name, width in widths.items())
        said = f"{found.message} Friction is still smooth: {told} (m/s or rad/s)."
        return self.checked(replace(found, message=said))

    def checked(self, solution: Solution) -> Solution:
        """`solution` with its verification.

        Of a motion by modes the states of laws are not known: what the simulation makes of them is
        no miss, and a local error cannot be told.
        """
        if not self.verify or solution.status in STOPPED:
            return solution
        laws = {c.name: c for phase in self.problem.chain for c in phase.model.contacts if c.states}
        if not (solution.modes and laws):
            return verified(solution, self.tolerance)
        found = self.told(verify_solution(solution, self.tolerance))
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
