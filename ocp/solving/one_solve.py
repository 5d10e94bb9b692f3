"""Results of single solves and of several starts, their comparison, and solutions made of them."""

from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import BrokenExecutor
from dataclasses import dataclass, field, replace
from functools import cached_property, reduce
from math import isfinite, pi
from time import time
from typing import Any, final

import casadi as ca
import numpy as np

from ocp.formulation.phase import Array, Span
from ocp.formulation.problem import Problem
from ocp.solving.methods import Fatrop, Ipopt, Sqp
from ocp.solving.motion import along_points, motions_of
from ocp.solving.optimum import Optimum
from ocp.solving.prepared import LEAST, Prepared, Supervisor
from ocp.solving.solution import Solution
from ocp.solving.starts import rates_of
from ocp.solving.watch import Progress, in_stage
from ocp.transcription.program import Iterate, Outcome, SolverStatistics
from ocp.transcription.schemes import Radau, Scheme
from ocp.transcription.transcribe import Transcription
from ocp.transcription.unknowns import SpanPoints, Values
from symfric.foundation import checks
from symfric.foundation.executors import in_order
from symfric.foundation.parameters import parameters
from symfric.foundation.status import Status
from symfric.foundation.variable import Variable
from symfric.model.contact import Contact

Solver = Ipopt | Fatrop | Sqp
NARROW = 0.02
"""Smoothing width, relative to the largest sliding velocity, below which Newton's method may step
over the layer."""
NAMED = 3
"""Largest number of contacts in a message."""
FINALISTS = 3
"""Number of coarse solutions that are continued."""
ALIKE = 1e-3
"""Relative difference of J below which motions count as equal."""
STAYED = 1e-5
"""Largest change of scaled unknowns of a solution that counts as its own start."""
STARTS = 6
"""Default number of coarse solves of a problem with friction; the best one is continued."""
SPREAD = 0.5
"""Spread of further starts around the given one; see `starts_around`."""
HALF_WAVES = np.arange(1, 4)
"""Numbers of half waves over the whole motion in a deviation."""
STILL = 0.3
"""Deviation, relative to the nominal value, of a state that is constant in the given start if all
states of its unit are constant."""


@final
@dataclass(frozen=True, eq=False)
class Task:
    """Problem, and the means to solve it.

    Attributes:
        problem, scheme, solver: as in `ocp.solve`.
        supervisor: time limit and progress of all solves.
    """

    problem: Problem
    scheme: Scheme = field(default_factory=Radau)
    solver: Solver = field(default_factory=Ipopt)
    supervisor: Supervisor = field(default_factory=Supervisor)

    @property
    def ipopt(self) -> Ipopt:
        """The solver if it is Ipopt, otherwise Ipopt without options."""
        return self.solver if isinstance(self.solver, Ipopt) else Ipopt()


@dataclass(frozen=True, eq=False)
class Solved:
    """Transcription of a problem, and the result of a solver."""

    transcription: Transcription
    outcome: Outcome

    @cached_property
    def points(self) -> Values:
        """Unknowns of the motion in SI units."""
        return self.transcription.unpack(self.outcome.iterate.w)

    @property
    def ok(self) -> bool:
        """True if the solver found a solution."""
        return self.outcome.status.ok

    @property
    def solution(self) -> Solution:
        """Result as a `Solution`, without verification."""
        made, outcome, points = self.transcription, self.outcome, self.points
        stuck = outcome.status in (Status.MAX_ITERATIONS, Status.NO_STEP) or outcome.cycles
        kinks = narrow_widths(made, points) if stuck and not outcome.status.ok else ""
        return Solution(
            problem=made.problem,
            status=outcome.status,
            message=f"ocp '{made.problem.name}': {outcome.sentence} {kinks}".rstrip(),
            cost=outcome.cost,
            motions=motions_of(made.problem, made.meshes, made.scheme.coefficients(), points),
            chosen=dict(points.chosen),
            statistics=outcome.statistics,
            scheme=made.scheme,
            meshes=made.meshes,
            points=points,
            iterate=outcome.iterate,
            cause=outcome.cause,
            optimum=Optimum(made, outcome.iterate, made.program.values),
        )


@final
@dataclass(frozen=True, eq=False)
class HomotopyStep(Solved):
    """Solve with the smoothing width `level` and the `values` of all parameters.

    Attributes:
        accepted: False if the solve jumped to a worse motion.
        error: largest local error of an interval.
        errors: local errors of each interval, (N,) for each phase.
    """

    values: Array
    level: float
    accepted: bool = True
    error: float = np.inf
    errors: tuple[Array, ...] = ()

    @property
    def good(self) -> bool:
        """True if the homotopy can continue from this step."""
        return self.accepted and self.ok

    @property
    def ended(self) -> bool:
        """True if the user or the time limit has stopped the solver."""
        return self.outcome.status.stopped


def rank(outcome: Outcome) -> tuple[bool, bool, float]:
    """Return the order of outcomes: a stopped one, then by cost, or by violation if not solved."""
    ok = outcome.status.ok
    return not outcome.status.stopped, not ok, outcome.cost if ok else outcome.violation


def least(steps: Sequence[HomotopyStep]) -> HomotopyStep:
    """Return the stopped step, or the cheapest one, or the least violated if none is solved."""
    return min(steps, key=lambda step: rank(step.outcome))


def same_cost(a: Outcome, b: Outcome) -> bool:
    """Return True if the costs of two outcomes indicate the same motion."""
    return abs(a.cost - b.cost) <= ALIKE * abs(b.cost)


def finalists(steps: Sequence[HomotopyStep]) -> list[HomotopyStep]:
    """Return the best steps with different costs, which indicate different motions."""
    kept: list[HomotopyStep] = []
    for step in sorted(steps, key=lambda one: (not one.good, one.outcome.cost)):
        new = not any(same_cost(step.outcome, one.outcome) for one in kept)
        if not kept or (new and step.good and len(kept) < FINALISTS):
            kept.append(step)
    return kept


def narrow_widths(transcription: Transcription, points: Values) -> str:
    """Return a message about contacts with narrow smoothing widths, or "" if there are none.

    It names contacts that stick or reverse, and contacts whose widths smooth a quantity other than
    the sliding velocity.
    """
    messages: dict[str, str] = {}
    for span, at in zip(transcription.problem.spans, points.spans, strict=True):
        for contact in span.model.contacts:
            widths = list(_narrow(contact, span, at))
            if widths and contact.name not in messages:
                messages[contact.name] = f"contact '{contact.name}' has {' and '.join(widths)}"
    if not messages:
        return ""
    names = checks.listed(list(messages.values()), NAMED)
    return f"Friction is smoothed over a small width: {names}; raise it or use friction='auto'."


def _narrow(contact: Contact, span: Span, at: SpanPoints) -> Iterator[str]:
    """Yield the widths of a contact that are small relative to its motion, with their values."""

    def number(value: Any) -> float:  # parameters of a law may be parameters of the model
        return float(ca.Function("number", [span.model.vector("p")], [ca.SX(value)])(span.p))

    slip = along_points(span, at, contact.slip)[0]
    fastest = float(np.abs(slip).max(initial=0.0))
    turns = slip.size > 0 and bool(slip.min() <= 0.0 <= slip.max())
    law: Any = contact.law  # type Parametric
    known = parameters(law)
    for name, exponent in law.widths.items():
        value = number(known[name].value)
        if turns and 0.0 < value**exponent < NARROW * fastest:
            unit = contact.unit(known[name].unit)
            yield f"{name} = {value:.3g} {unit}".removesuffix(" 1")
    for name, variable in contact.widths.items():
        yield f"{name} = {number(variable.start):.3g} {variable.unit}"


@final
@dataclass(frozen=True, eq=False)
class Starts:
    """Solves of one program from several starts.

    Attributes:
        transcription, solver: the program and its solver.
        ready: the solver prepared for the program; None if it is not prepared yet.
        values: values of the parameters of the program.
    """

    transcription: Transcription
    solver: Solver
    ready: Prepared | None
    values: Array

    @cached_property
    def prepared(self) -> Prepared:
        """Solver prepared for the program."""
        return self.ready or self.solver.prepared(self.transcription.program)

    def run(self, w: Array, supervisor: Supervisor, stage: str = "") -> Outcome:
        """Solve from the unknowns `w`."""
        start = Iterate.cold(w, self.transcription.program.g.numel())
        return supervisor.run(self.transcription, self.prepared, start, stage, self.values)

    def until(self, w: Array, deadline: float | None) -> Outcome:
        """Solve from the unknowns `w` before the time of day `deadline` [s]."""
        left = None if deadline is None else max(LEAST, deadline - time())
        return self.run(w, Supervisor(left))

    def outcomes(
        self, tries: Sequence[Values], supervisor: Supervisor, stages: Sequence[str]
    ) -> Iterator[Outcome]:
        """Yield the outcomes in the order of `tries`; a stopped one is the last.

        With an executor, progress is reported after each solve.
        """
        starts, made = [self.transcription.pack(points) for points in tries], self.transcription
        if supervisor.executor is None or len(tries) < 2:
            for w, stage in zip(starts, stages, strict=True):
                yield (outcome := self.run(w, supervisor, stage))
                if outcome.status.stopped:
                    return
            return
        left, sent = supervisor.left, replace(self, ready=None)
        deadline = None if left is None else time() + left
        results = in_order(supervisor.executor, Starts.until, sent, [(w, deadline) for w in starts])
        done: list[Outcome] = []
        try:
            for outcome, stage in zip(results, stages, strict=True):
                done.append(outcome)
                report = in_stage(supervisor.progress, stage, made)
                if report is not None:
                    count, w = outcome.statistics.iterations, outcome.iterate.w
                    report(Progress(count, outcome.cost, outcome.violation, stage, w))
                yield outcome
                if outcome.status.stopped:
                    return
        except (KeyboardInterrupt, BrokenExecutor) as error:
            if not done:
                raise
            user = isinstance(error, KeyboardInterrupt)
            why = "Stopped by the user" if user else "A process of the executor ended"
            why += f" after {len(done)} of {len(tries)} starts; the result is the best of them."
            yield min(done, key=rank)._replace(status=Status.INTERRUPTED, sentence=why)
        finally:
            results.close()

    def best(self, tries: Sequence[Values], supervisor: Supervisor) -> tuple[Outcome, str]:
        """Return the best outcome, with the statistics of all, and a sentence about the others."""
        stages = [f"start {number}" for number in range(1, len(tries) + 1)]
        found = [*self.outcomes(tries, supervisor, stages)]
        best = min(found, key=rank)
        solved = [one for one in found if one.status.ok]
        same = sum(same_cost(one, best) for one in solved)
        text = f"The best of {len(tries)} starts is continued: {len(solved)} were solved, "
        text += f"{same} at the same cost."
        total = reduce(SolverStatistics.then, [one.statistics for one in found])
        return best._replace(statistics=total), text if best.status.ok else ""

    def lower(self, found: Outcome, w: Array, supervisor: Supervisor) -> tuple[Outcome, str]:
        """Return `found` and "", or a better outcome and a sentence if `found` is the start `w`.

        The gradient of the cost is zero not only at a minimum: a body that rests at the start also
        satisfies the optimality conditions of the largest distance from it.
        """
        if not found.status.ok or np.abs(found.iterate.w - w).max(initial=0.0) > STAYED:
            return found, ""
        start = starts_around(self.transcription, self.transcription.unpack(w), (1,))
        other = self.best(start, supervisor)[0]
        total = found.statistics.then(other.statistics)
        lower = other.status.ok and other.cost < found.cost - ALIKE * max(abs(other.cost), STAYED)
        if not (lower or other.status is Status.UNBOUNDED):
            return found._replace(statistics=total), ""
        text = "The first start satisfies the optimality conditions, but another one costs less."
        return other._replace(statistics=total), text


def starts_around(
    into: Transcription, begin: Values, seeds: Iterable[int], spread: float = SPREAD
) -> tuple[Values, ...]:
    """Return `begin` for the seed 0, and `begin` with a random smooth deviation for other seeds.

    The deviation of a state is a sum of half waves over the whole motion, with amplitudes of
    `spread` times its range in `begin`, smaller in short waves. The deviation of a rate of another
    state (x' = v) is the rate of that deviation. Amplitudes of inputs are `spread` times a quarter
    of the range of their bounds, or times their nominal value.

    Args:
        into: transcription of the points.
        begin: the first start.
        seeds: seeds of NumPy's default generator.
        spread: relative size of the deviations; 0.5 finds most local optima of a swing-up.
    """
    return tuple(_around(into, begin, spread, seed) if seed else begin for seed in seeds)


def _around(into: Transcription, begin: Values, spread: float, seed: int) -> Values:
    problem, phases = into.problem, len(into.problem.chain)
    random = np.random.default_rng(seed)
    names = {v.name for s in problem.spans for group in (s.model.x, s.model.u) for v in group}
    waves = {name: spread * random.standard_normal(HALF_WAVES.size) for name in sorted(names)}
    sizes = _ranges(into, begin)
    spans: list[SpanPoints] = []
    for number, (span, old) in enumerate(zip(problem.spans, begin.spans, strict=True)):
        first = number - span.phase
        whole = sum(points.T for points in begin.spans[first : first + phases])
        start = sum(points.T for points in begin.spans[first:number]) / whole
        mesh, positions = into.meshes[number], rates_of(span.model)

        def angles(fractions: Array, start: float = start, share: float = old.T / whole) -> Array:
            return pi * (start + share * fractions)[:, None] * HALF_WAVES

        nodes, points, u = old.nodes.copy(), old.inner.copy(), old.u.copy()
        for states, fractions in ((nodes, mesh), (points, into.inner_fractions(number))):
            at = angles(fractions)
            for row, v in zip(states, span.model.x, strict=True):
                name = positions.get(v.name)
                if name is None:
                    row += sizes[v.name] * (np.sin(at) / HALF_WAVES) @ waves[v.name]
                else:
                    row += sizes[name] * pi / whole * np.cos(at) @ waves[name]
                row[:] = np.clip(row, *span.boxes[v.name])
        at = angles((mesh[1:] + mesh[:-1]) / 2)
        for row, v in zip(u, span.model.u, strict=True):
            low, high = span.boxes[v.name]
            size = 0.25 * (high - low) if isfinite(low) and isfinite(high) else v.nominal
            row += size * np.sin(at) @ waves[v.name]
        spans.append(SpanPoints(old.T, nodes, points, old.z, u))
    return Values(tuple(spans), begin.chosen)


def _ranges(into: Transcription, begin: Values) -> dict[str, float]:
    """Return state -> range of its values in `begin`, over all phases.

    A constant state has the largest range of the states of its unit.
    """
    states: dict[str, Variable] = {}
    values: dict[str, list[float]] = {}
    for span, points in zip(into.problem.spans, begin.spans, strict=True):
        for v, row in zip(span.model.x, points.nodes, strict=True):
            values.setdefault(v.name, []).extend((float(row.min()), float(row.max())))
            states[v.name] = v
    ranges = {name: max(found) - min(found) for name, found in values.items()}
    largest: dict[str, float] = {}
    for name, v in states.items():
        largest[v.unit] = max(largest.get(v.unit, 0.0), ranges[name])
    return {
        n: size or largest[states[n].unit] or STILL * states[n].nominal
        for n, size in ranges.items()
    }
