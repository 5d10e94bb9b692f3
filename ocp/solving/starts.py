"""Starts of the optimiser: straight lines between prescribed values, guesses, or a solution."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from math import isfinite
from pathlib import Path

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike, NDArray

from ocp.formulation.phase import Box, Free, Link, Span
from ocp.formulation.problem import Problem
from ocp.solving.motion import Stored, StoredSpan, along, structure_of
from ocp.solving.solution import Solution
from ocp.transcription.program import Iterate
from ocp.transcription.transcription import Transcription
from ocp.transcription.unknowns import Points, SpanPoints
from symfric.foundation import checks
from symfric.model import Model

Array = NDArray[np.float64]

Guess = float | ArrayLike | Callable[[Array], ArrayLike]
"""A constant, samples at equal distances from 0 to the end, or a function of the times [s]."""

Start = Mapping[str, Guess] | Solution | Stored | Points | None
"""Guesses by name, a solution of this or of a similar problem, points, or nothing."""

STARTS = 6
"""Number of coarse solves of a problem with friction, of which the best continues."""


def start_of(into: Transcription, guess: Start) -> tuple[Iterate, bool]:
    """Return the first iterate, and whether it has multipliers.

    It has them if `guess` is a solution of a program with the same unknowns and rows on the same
    meshes; from other solutions the motion is transferred by name.

    Raises:
        ValueError: invalid guesses, see `initial_points`.
    """
    rows = into.program.g.numel()
    if isinstance(guess, Points):
        _check_shapes(into, guess)
        return Iterate.cold(into.pack(guess), rows), False
    if not isinstance(guess, Solution | Stored):
        if guess is not None and not isinstance(guess, Mapping):  # pyright: ignore[reportUnnecessaryIsInstance]
            hint = "a file is read by ocp.load(path)" if isinstance(guess, str | Path) else ""
            raise checks.refused("guess", "values by name, a solution, or points", guess, hint)
        return Iterate.cold(into.pack(initial_points(into, guess)), rows), False
    stored = guess.stored if isinstance(guess, Solution) else guess
    w = into.pack(resample(into, stored))
    old = stored.iterate
    meshes = [span.mesh for span in stored.spans]
    same = (
        len(meshes) == len(into.meshes)
        and all(np.array_equal(a, b) for a, b in zip(meshes, into.meshes, strict=True))
        and (old.lam_w.size, old.lam_g.size) == (w.size, rows)
        and stored.structure == structure_of(into.problem, into.scheme)
    )
    return (replace(old, w=w), True) if same else (Iterate.cold(w, rows), False)


def _check_shapes(into: Transcription, points: Points) -> None:
    """Raise ValueError for points of other meshes or models."""
    fitting = initial_points(into)
    names = ("nodes", "inner", "z", "u")
    for number, wanted in enumerate(fitting.spans):
        given = points.spans[number] if number < len(points.spans) else None
        shapes = [None if given is None else getattr(given, name).shape for name in names]
        if len(points.spans) != len(fitting.spans) or shapes != [
            getattr(wanted, name).shape for name in names
        ]:
            raise ValueError(
                f"guess: expected points of {len(fitting.spans)} phases, "
                f"{into.problem.spans[number].name} with states at the nodes of shape "
                f"{wanted.nodes.shape}, got points of other meshes or models; pass the solution "
                "itself, which is transferred by name"
            )


def initial_points(into: Transcription, given: Mapping[str, Guess] | None = None) -> Points:
    """Return initial points: `given` values by name, straight lines and mid values for the rest.

    States follow straight lines through the middles of their conditions at the start, at via points
    and at the end, over all phases in which they are continuous. A state that is the rate of
    another one (x' = v) takes the slope of that one: with v = 0, where a friction law is steepest,
    Ipopt needs ten times the iterations or fails. States with a condition only through an output
    stay constant. Algebraic variables keep their start value; inputs are zero, or in the middle of
    their bounds if zero is outside.

    Raises:
        ValueError: unknown name, or values that are not finite or not one per time.
    """
    problem = into.problem
    known = {
        v.name: None
        for span in problem.spans
        for group in (span.model.x, span.model.z, span.model.u)
        for v in group
    }
    guesses = checks.named("guess", given, list(known))
    durations = _durations(problem)
    total = _total(problem, durations)

    def value(number: int, name: str, fractions: Array) -> Array | None:
        if name not in guesses:
            return None
        begin = _begin(problem, durations, number)
        return _evaluate(name, guesses[name], begin + fractions * durations[number], total)

    return into.consistent(_points(into, durations, value))


def resample(into: Transcription, stored: Stored) -> Points:
    """Return the motion of a solution on other meshes, phases or models with equal names.

    With the same number of phases, each phase is transferred to its counterpart; otherwise the
    whole motion is stretched over the whole duration.
    """
    problem = into.problem
    scenarios = {span.scenario for span in stored.spans}
    durations = _durations(problem)
    old: dict[int, list[StoredSpan]] = {s: [] for s in scenarios}
    for span in stored.spans:
        old[span.scenario].append(span)
    same = len(problem.chain) == len(next(iter(old.values())))
    if same:
        for number, span in enumerate(problem.spans):
            source = old.get(span.scenario, old[min(old)])[span.phase]
            if isinstance(span.T, Free):
                durations[number] = float(np.clip(source.T, span.T.lower, span.T.upper))

    def value(number: int, name: str, fractions: Array) -> Array | None:
        span = problem.spans[number]
        there = old.get(span.scenario, old[min(old)])
        if same:
            return there[span.phase].at(name, fractions)
        begin = _begin(problem, durations, number)
        at = (begin + fractions * durations[number]) / _total(problem, durations)
        return along(there, name, at)

    points = _points(into, durations, value)
    names = {choice.name: choice for choice in problem.chosen}
    kept = {
        name: float(np.clip(v, names[name].lower, names[name].upper))
        for name, v in stored.chosen.items()
        if name in names
    }
    return replace(points, chosen=dict(points.chosen) | kept)


Value = Callable[[int, str, Array], Array | None]
"""(index of the phase, name, fractions of T) -> initial values of the signal, if known."""


def _points(into: Transcription, durations: Sequence[float], value: Value) -> Points:
    """Return points of all phases from known values; straight lines elsewhere."""
    problem, phases = into.problem, len(into.problem.chain)
    found: list[SpanPoints] = []
    for first in range(0, len(problem.spans), phases):
        lines = _Lines(problem, durations, first)
        for number in range(first, first + phases):
            span = problem.spans[number]
            mesh, inner = into.meshes[number], into.inner_fractions(number)
            at = into.fractions(number)
            x: dict[str, Array] = {}
            for v in span.model.x:
                given = value(number, v.name, at)
                x[v.name] = lines.of(number, v.name, at) if given is None else given
            for rate, name in rates_of(span.model).items():
                if value(number, rate, at) is None:
                    x[rate] = np.gradient(x[name], at * durations[number])
            lines.keep(number, {name: float(row[-1]) for name, row in x.items()})
            table = _table(list(x.values()), at.size)
            z = [_given_or(value(number, v.name, inner), float(v.start), inner.size)
                 for v in span.model.z]  # fmt: skip
            middles = (mesh[1:] + mesh[:-1]) / 2
            u = [_given_or(value(number, v.name, middles), _rest(span.box(v.name)), middles.size)
                 for v in span.model.u]  # fmt: skip
            found.append(
                SpanPoints(
                    durations[number],
                    table[:, np.searchsorted(at, mesh)],
                    table[:, np.searchsorted(at, inner)],
                    _table(z, inner.size),
                    _table(u, middles.size),
                )
            )
    return Points(tuple(found), {choice.name: choice.guess for choice in problem.chosen})


def _table(rows: Sequence[Array], columns: int) -> Array:
    return np.array(rows).reshape(len(rows), columns)


def _given_or(values: Array | None, default: float, count: int) -> Array:
    return np.full(count, default) if values is None else values


class _Lines:
    """Straight lines through the prescribed states of one scenario."""

    def __init__(self, problem: Problem, durations: Sequence[float], first: int) -> None:
        self._spans = {first + k: problem.spans[first + k] for k in range(len(problem.chain))}
        self._durations = durations
        self._begin = {n: _begin(problem, durations, n) for n in self._spans}
        self._ends: dict[int, dict[str, float]] = {}

    def keep(self, number: int, ends: dict[str, float]) -> None:
        """Record the states at the end of a phase, from which states may jump."""
        self._ends[number] = ends

    def of(self, number: int, name: str, fractions: Array) -> Array:
        """Return a state at fractions of a phase."""
        run = [number]
        while (link := self._link(run[0], name)) is not None and _plain(link, self._before(run[0])):
            run.insert(0, run[0] - 1)
        while (
            (after := self._link(run[-1] + 1, name)) is not None
            and _plain(after, self._spans[run[-1]])
        ):  # fmt: skip
            run.append(run[-1] + 1)
        knots: dict[float, float] = {}
        jump = self._link(run[0], name)
        if jump is not None and run[0] - 1 in self._ends:
            knots[self._begin[run[0]]] = self._landing(run[0], jump)
        for k in run:
            for s, boxes in self._spans[k].nodes.items():
                if name in boxes and _asked(self._spans[k], name, s):
                    knots[self._begin[k] + s * self._durations[k]] = _middle(boxes[name])
        knots = dict(sorted(knots.items())) or {0.0: _rest(self._spans[number].box(name))}
        at = self._begin[number] + fractions * self._durations[number]
        return np.interp(at, list(knots), list(knots.values()))

    def _before(self, number: int) -> Span:
        return self._spans[number - 1]

    def _link(self, number: int, name: str) -> Link | None:
        if number not in self._spans:
            return None
        return next((link for link in self._spans[number].links if link.state == name), None)

    def _landing(self, number: int, link: Link) -> float:
        """Return the start of a state that jumps."""
        span = self._before(number)
        function = ca.Function("landing", span.symbols, [link.expression])
        x = [self._ends[number - 1][v.name] for v in span.model.x]
        z = [float(v.start) for v in span.model.z]
        u = [_rest(span.box(v.name)) for v in span.model.u]
        return float(function(self._begin[number], x, z, u, span.p))


def _plain(link: Link, before: Span) -> bool:
    """Return True if the state is continuous."""
    return any(
        v.name == link.state and ca.is_equal(link.expression, v.symbol) for v in before.model.x
    )


def _asked(span: Span, name: str, fraction: float) -> bool:
    """Return True if a state has a condition there other than its general bounds."""
    box = span.nodes[fraction][name]
    finite = isfinite(box[0]) or isfinite(box[1])
    return finite and (box != span.box(name) or (span.phase == 0 and fraction == 0.0))


def _durations(problem: Problem) -> list[float]:
    """Return initial durations [s], scaled to a prescribed sum."""
    spans = problem.spans
    found = [span.T.start if isinstance(span.T, Free) else float(span.T) for span in spans]
    for phases, total in problem.durations:
        wanted = total.start if isinstance(total, Free) else float(total)
        for first in range(0, len(spans), len(problem.chain)):
            numbers = [first + k for k in phases]
            free = [n for n in numbers if isinstance(spans[n].T, Free)]
            rest = wanted - sum(found[n] for n in numbers if n not in free)
            have = sum(found[n] for n in free)
            for n in free:
                T = spans[n].T
                if isinstance(T, Free):
                    found[n] = min(max(found[n] * rest / have, T.lower), T.upper)
    return found


def _begin(problem: Problem, durations: Sequence[float], number: int) -> float:
    """Return the start of a phase [s]."""
    first = number - number % len(problem.chain)
    return float(sum(durations[first:number]))


def _total(problem: Problem, durations: Sequence[float]) -> float:
    return float(sum(durations[: len(problem.chain)]))


def _evaluate(name: str, guess: Guess, times: Array, T: float) -> Array:
    try:
        made = guess(times) if callable(guess) else guess
    except (TypeError, ArithmeticError, RuntimeError) as error:
        what = f"for {name} a number, samples, or a function of the times"
        raise checks.refused("guess", what, error) from error
    values = checks.array(f"guess of {name}", made, ndim=None)
    sizes = (1, times.size) if callable(guess) else range(1, values.size + 1)
    if values.ndim > 1 or values.size not in sizes:
        raise ValueError(
            f"guess: expected for {name} a number, samples, or a function that returns one value "
            f"per time, got an array of shape {values.shape}"
        )
    if callable(guess) or values.ndim == 0:
        return np.array(np.broadcast_to(values, times.shape))
    return np.interp(times, np.linspace(0.0, T, values.size), values)


def rates_of(model: Model) -> dict[str, str]:
    """Return state -> the state whose time derivative it is."""
    ode = model.function("ode")(model.t, *(model.vector(letter) for letter in "xzup"))
    return {
        other.name: v.name
        for i, v in enumerate(model.x)
        for other in model.x
        if ca.is_equal(ode[i], other.symbol)
    }


def _middle(box: Box) -> float:
    """Return the middle of a range, or its finite end."""
    low, high = box
    if isfinite(low) and isfinite(high):
        return (low + high) / 2
    return low if isfinite(low) else high


def _rest(box: Box) -> float:
    """Return zero, or the middle of a range that does not contain it."""
    return 0.0 if box[0] <= 0.0 <= box[1] else _middle(box)
