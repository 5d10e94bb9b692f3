"""Mesh refinement: repeated solves on meshes derived from error estimates.

Meshes are refined only where the estimates require it.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from math import ceil, inf, sqrt
from time import perf_counter
from typing import NamedTuple, final

import numpy as np
from numpy.typing import NDArray

from ocp.checking.interval_errors import estimated_errors, zoh_losses
from ocp.checking.resimulate import Arc, arcs_of
from ocp.checking.verify import TOLERANCE, left_between, restarted
from ocp.formulation.phase import Array
from ocp.solving.one_solve import Solved, Starts, Task, starts_around
from ocp.solving.prepared import Prepared
from ocp.solving.solution import Solution, with_sentence
from ocp.solving.starts import Start, start_of
from ocp.transcription.schemes import Shooting
from ocp.transcription.transcribe import Discretisation, Skeleton, discretise
from symfric.foundation.status import Status

GROWTH = 3.0
"""Largest growth of the number of intervals in one pass, as errors are only estimates."""
LEAST_PARTS = 0.5
"""Smallest number of parts of an interval; 0.5 merges at most two intervals in one pass."""
MOST_PARTS = 16.0
"""Largest number of parts into which one pass divides an interval."""
STEEPEST = 2.0
"""Approximate largest ratio of the lengths of neighbouring intervals."""
SAME_NUMBER = 0.4
"""Share of the number of intervals. If a pass requires fewer intervals than this share, the number
is reduced; otherwise it is kept, so that the program need not be rebuilt."""
LATER = 1e-2
"""Initial barrier parameter of Ipopt for later passes, which start near a solution."""
CAP = 150
"""Largest number of iterations on a mesh whose solution only determines the next mesh."""
FULL = 0.9
"""Share of the largest number of intervals above which a mesh counts as full."""
LEAST_TRUST = 0.2
"""Smallest trust in loss estimates, which are too large for active path conditions."""


class MeshErrors(NamedTuple):
    """Errors of the intervals of one phase.

    Attributes:
        local: relative local error of each interval, shape (N,).
        losses: loss of cost in each interval by constant inputs (see `zoh_losses`), shape (N,).
        outside: mask of intervals that violate a bound between nodes, or None if there are none.
    """

    local: Array
    losses: Array
    outside: NDArray[np.bool_] | None = None


def refined(
    meshes: Sequence[Array],
    errors: Sequence[MeshErrors],
    keep: Sequence[Iterable[float]],
    *,
    local: float,
    loss: float,
    order: int = 5,
    most: int = 1000,
    for_loss: float = inf,
    growth: float = GROWTH,
) -> tuple[Array, ...]:
    """Return new meshes with local errors below `local` and a total loss below `loss`.

    Interval k is divided into n_k parts. The local error of a smooth motion falls as n^-(p+1) with
    the order p. This is assumed where intervals are merged; where the error is too large, half this
    exponent is used. Losses E_k fall as n^-2, so the sum `loss` is reached with the fewest
    intervals for

        n_k = E_k^(1/3) sqrt(sum E^(1/3) / loss)

    The larger n_k applies, and at least two parts where a bound is violated between nodes. New
    nodes are placed at equal amounts of n, and their number is kept if possible.

    Args:
        meshes: fractions that bound the intervals of each phase.
        errors: errors of the intervals of each phase.
        keep: fractions of each phase that remain nodes.
        local, loss: tolerances; `loss` is the total of all phases in units of J.
        order: order of the scheme.
        most: largest total number of intervals.
        for_loss: largest total number of intervals for the sake of losses.
        growth: largest growth of the number of intervals.
    """
    roots = [np.cbrt(e.losses) for e in errors]
    total = sum(float(root.sum()) for root in roots)
    share = sqrt(total / loss) if loss > 0 else 0.0
    intervals = sum(mesh.size - 1 for mesh in meshes)
    lost = min(1.0, min(growth * intervals, for_loss) / max(share * total, 1.0))
    parts: list[Array] = []
    for mesh, own, root in zip(meshes, errors, roots, strict=True):
        excess = 2.0 * np.where(np.isfinite(own.local), own.local, 1e30 * local) / local
        n = np.where(excess > 1.0, excess ** (2.0 / (order + 1)), excess ** (1.0 / (order + 1)))
        n = np.maximum(np.minimum(n, growth), lost * share * root)
        if own.outside is not None:
            n = np.where(own.outside, np.maximum(n, 2.0), n)
        parts.append(_graded(np.clip(n, LEAST_PARTS, MOST_PARTS), np.diff(mesh)))
    shrink = min(1.0, most / sum(float(n.sum()) for n in parts))
    return tuple(
        _spread(mesh, n * shrink, sorted({0.0, *fixed, 1.0}))
        for mesh, n, fixed in zip(meshes, parts, keep, strict=True)
    )


def _graded(parts: Array, lengths: Array) -> Array:
    """Return `parts` with larger numbers near short intervals, so that lengths change gradually."""
    density = parts / lengths
    for k in range(1, density.size):
        density[k] = max(density[k], density[k - 1] / STEEPEST)
    for k in range(density.size - 2, -1, -1):
        density[k] = max(density[k], density[k + 1] / STEEPEST)
    return density * lengths


def _spread(mesh: Array, parts: Array, keep: Sequence[float]) -> Array:
    """Return nodes at equal amounts of `parts`, with integer counts between kept fractions."""
    done = np.concatenate([[0.0], np.cumsum(parts)])
    at = np.interp(keep, mesh, done)
    wanted, old, scale = np.diff(at), mesh.size - 1, 1.0
    if SAME_NUMBER * old <= sum(map(ceil, wanted)) <= old:
        scale = old / max(float(wanted.sum()), 1e-9)
    counts = [max(1, ceil(scale * n - 1e-9)) for n in wanted]
    while scale > 1.0 and sum(counts) > old and max(counts) > 1:
        counts[int(np.argmax(counts))] -= 1  # rounding up may exceed the old number
    pieces = [
        np.interp(np.linspace(low, high, n, endpoint=False), done, mesh)
        for low, high, n in zip(at[:-1], at[1:], counts, strict=True)
    ]
    new = np.concatenate([*pieces, [1.0]])
    new[np.cumsum([0, *counts[:-1]])] = keep[:-1]
    return new


@final
@dataclass(frozen=True)
class Goals:
    """Criteria for a sufficiently fine mesh.

    Attributes:
        local: largest relative local error of an interval.
        loss: loss of cost by constant inputs, relative to |J|.
        outside: violation of a bound between nodes, relative to its magnitude.
        passes: largest number of solves.
        most: largest total number of intervals.
        nonzeros: number of nonzeros of the Jacobian and the Hessian up to which a mesh is refined
            only to reduce the loss: 1000 intervals of a small model, 70 of an arm with six joints.
        patient: True to refine a mesh also if the solver reached its iteration limit.
    """

    local: float
    loss: float
    outside: float
    passes: int = 8
    most: int = 1000
    nonzeros: int = 150_000
    patient: bool = True

    @staticmethod
    def of(tolerance: float) -> "Goals":
        """Return the goals for a verification within `tolerance`; 1e-3 gives four digits of J.

        Local errors accumulate over the motion, usually to at most ten times the largest one. The
        verification does not require an accurate cost, but the cost is to be minimised.
        """
        return Goals(0.1 * tolerance, 0.02 * tolerance, 0.2 * tolerance)


def refined_solve(
    task: Task, meshes: Sequence[Array], guess: Start = None, goals: Goals | None = None, *,
    starts: int = 1,
) -> Solution:  # fmt: skip
    """Solve a problem repeatedly, each time on meshes derived from the remaining errors.

    A mesh is fine enough if the local error of each interval, the loss by constant inputs and the
    violations between nodes reach the `goals`. A mesh with the same number of intervals uses the
    same program.

    Args:
        task: the problem to solve, with scheme, solver, time limit and progress.
        meshes: initial meshes, such as `make_meshes(problem, 50)`.
        guess: see `ocp.solving.starts`.
        goals: criteria for a fine mesh, by default for a verification within 1e-3.
        starts: number of solves on the first mesh from starts around the guess; the best one is
            continued. If the solution is the only start, another start is tried, as the gradient
            of the cost is also zero at a saddle or a maximum.

    Returns:
        The last successful solution with the statistics of all passes, or the first solution if it
        failed. If a later pass was stopped, the solution has the status INTERRUPTED or TIME_LIMIT.
        A mesh that did not become fine enough is not a failure, as the verification evaluates the
        result.
    """
    begin = perf_counter()
    goals, solver, supervisor = goals or Goals.of(TOLERANCE), task.solver, task.supervisor
    made = discretise(task.problem, task.scheme)
    ready: dict[tuple[Skeleton, bool, bool], Prepared] = {}
    texts: list[str] = []

    def solved(meshes: Sequence[Array], guess: Start, number: int, capped: bool) -> Solution:
        began = begin if number == 1 else perf_counter()
        transcription = made.on(meshes)
        key = (transcription.skeleton, number == 1, capped)
        if key not in ready:  # meshes with equal numbers of intervals have the same program
            later: dict[str, float] = {"max_iter": CAP} if capped else {}
            if made.problem.kind != "worst":  # a small barrier prevents convergence of multipliers
                later["mu_init"] = LATER
            own = solver.with_defaults(**later) if number > 1 else solver
            ready[key] = own.prepared(transcription.program)
        start, warm = start_of(transcription, guess)
        each = Starts(transcription, solver, ready[key], transcription.program.values)
        if number == 1 and starts > 1:
            around = starts_around(transcription, transcription.unpack(start.w), range(starts))
            outcome, text = each.best(around, supervisor)
            texts.append(text)
        else:
            outcome = supervisor.run(
                transcription, ready[key], start, f"mesh {number}", warm=warm, begin=began
            )
            if number == 1 and not isinstance(guess, Solution):
                outcome, text = each.lower(outcome, start.w, supervisor)
                texts.append(text)
        return Solved(transcription, outcome).solution

    new = best = solved(meshes, guess, 1, capped=False)
    statistics, state, capped = best.statistics, Excess(), False
    for number in range(2, goals.passes + 1):
        spent = capped and goals.patient and new.status is Status.MAX_ITERATIONS
        if not new.ok and not spent:
            break
        finer, state = finer_meshes(made, new, goals, state)
        full = sum(mesh.size - 1 for mesh in new.meshes) >= FULL * goals.most
        fine = not finer or (state.stuck and full)
        if fine and new.ok:
            if state.loss > state.allowed:
                share = f"{100 * state.loss / abs(best.cost):.1g} %"
                text = f"Inputs that vary in the intervals would lower the cost by about {share}."
                best = with_sentence(best, text)
            break
        capped = not fine and number < goals.passes
        new = solved(new.meshes if fine else finer, new, number, capped)
        statistics = statistics.then(new.statistics)
        if new.status.stopped:
            message = f"{new.message} The result is the solution on the previous mesh."
            best = replace(best, status=new.status, message=message, cause=new.cause)
        best = new if new.ok else best
    return with_sentence(replace(best, statistics=statistics), " ".join(filter(None, texts)))


class Excess(NamedTuple):
    """Errors of a mesh in comparison with its goals.

    Attributes:
        local: largest local error in multiples of its goal.
        lost: estimated loss of cost by constant inputs.
        cost: J.
        allowed: goal of the loss.
        trust: ratio of the actual gain by refinement to the estimated loss.
        stuck: True if the last refinement gained little.
    """

    local: float = np.inf
    lost: float = np.inf
    cost: float = np.inf
    allowed: float = 0.0
    trust: float = 1.0
    stuck: bool = False

    @property
    def loss(self) -> float:
        """Estimated loss of cost by constant inputs, corrected by `trust`."""
        return self.trust * self.lost

    @property
    def whole(self) -> float:
        """Largest excess, in multiples of the goals."""
        return max(self.local, self.loss / self.allowed if self.allowed > 0 else 0.0)

    def then(self, local: float, lost: float, cost: float, allowed: float) -> "Excess":
        """Return the excess after another pass, with the trust updated by the gain of this pass."""
        trust = self.trust
        if max(self.local, local) <= 1.0 and np.isfinite(self.lost) and self.lost > 2 * lost:
            gained = (self.cost - cost) / (self.lost - lost)
            trust = float(np.clip(gained, LEAST_TRUST, 1.0))
        now = Excess(local, lost, cost, allowed, trust)
        return now._replace(stuck=now.whole > 0.7 * self.whole)


def finer_meshes(
    made: Discretisation, solution: Solution, goals: Goals, before: Excess
) -> tuple[tuple[Array, ...], Excess]:
    """Return refined meshes, or () if the goals are reached, and the excess over the goals."""
    problem, phases = made.problem, len(made.problem.chain)
    arcs = arcs_of(problem, solution.meshes, solution.points)
    on = made.on(solution.meshes)
    local = estimated_errors(on, solution.iterate.w, on.program.values, arcs)
    losses = zoh_losses(on, solution.iterate)
    allowed = goals.loss * abs(solution.cost)
    worst = max(float(e.max(initial=0.0)) for e in local) / goals.local
    lost = sum(float(loss.sum()) for loss in losses)
    now = before.then(worst, lost, solution.cost, allowed)
    statistics = solution.statistics
    spare = goals.nonzeros / (statistics.jacobian_nonzeros + statistics.hessian_nonzeros)
    fine = worst <= 1.0 and (now.loss <= allowed or not allowed or spare < 1 / FULL)
    outside = _outside(arcs, goals) if fine else None
    if outside is not None and not any(bool(mask.any()) for mask in outside):
        return (), now
    errors: list[MeshErrors] = []
    for k in range(phases):  # all scenarios have the same mesh
        largest, loss = np.max(local[k::phases], axis=0), np.sum(losses[k::phases], axis=0)
        beyond = np.any(outside[k::phases], axis=0) if outside else None
        errors.append(MeshErrors(largest, now.trust * loss, beyond))
    meshes = solution.meshes[:phases]
    keep = [tuple(span.nodes) for span in problem.spans[:phases]]
    new = refined(
        meshes, errors, keep, local=goals.local, loss=0.8 * allowed, most=goals.most,
        order=4 if isinstance(made.scheme, Shooting) else made.scheme.order,
        for_loss=spare * sum(mesh.size - 1 for mesh in meshes),
    )  # fmt: skip
    return new * (len(arcs) // phases), now


def _outside(arcs: Sequence[Arc], goals: Goals) -> list[NDArray[np.bool_]]:
    """Return masks of the intervals that violate a bound between their nodes.

    The simulations restart at optimised nodes, so they remain near the optimised motion.
    """
    masks = [np.zeros(arc.intervals, dtype=bool) for arc in arcs]
    for number, runs in groupby(restarted(arcs, 10 * goals.local)[0], lambda run: run.arc.number):
        masks[number] = left_between([*runs], goals.outside)
    return masks
