"""Initial guesses of the optimiser from prescribed values, the user's guess or a solution."""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from functools import partial
from math import isfinite
from pathlib import Path
from typing import Protocol, runtime_checkable

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from ocp.formulation.phase import Array, Box, Free, Link, Span, clipped, initial, limits
from ocp.formulation.problem import Problem
from ocp.solving.motion import SpanMotion, along, span_motions, structure_of
from ocp.solving.solution import Solution
from ocp.transcription.program import Iterate
from ocp.transcription.transcribe import Transcription
from ocp.transcription.unknowns import SpanPoints, Values
from symfric.foundation import checks
from symfric.model import Model

Guess = float | ArrayLike | Callable[[Array], ArrayLike]
"""A constant, equally spaced samples from 0 to the end, or a function of the times [s]."""


@runtime_checkable
class SignalSource(Protocol):
    """Signals over time, such as a run of `simulate` or of a closed loop.

    Attributes:
        t: times [s], shape (n,).
        signals: name -> values, shape (n,).
    """

    @property
    def t(self) -> Array: ...  # noqa: D102

    @property
    def signals(self) -> Mapping[str, Array]: ...  # noqa: D102


Start = Mapping[str, Guess] | Solution | SignalSource | Values | None
"""Guesses by name, a solution of this or a similar problem, a run, points, or None."""


def start_of(into: Transcription, guess: Start) -> tuple[Iterate, bool]:
    """Return the first iterate, and True if it has multipliers.

    It has multipliers if `guess` is a solution of a program with the same unknowns and rows on the
    same meshes. The motion of any other solution is transferred by name.

    Raises:
        ValueError: invalid guesses; see `initial_points`.
    """
    rows = into.program.g.numel()
    if isinstance(guess, Values):
        _check_shapes(into, guess)
        return Iterate.cold(into.pack(guess), rows), False
    if not isinstance(guess, Solution):
        if guess is not None and not isinstance(guess, Mapping | SignalSource):  # pyright: ignore[reportUnnecessaryIsInstance]
            hint = "a file is read by ocp.load(path)" if isinstance(guess, str | Path) else ""
            what = "values by name, a solution, a run, or points"
            raise checks.refused("guess", what, guess, hint)
        return Iterate.cold(into.pack(initial_points(into, guess)), rows), False
    spans = span_motions(guess.problem, guess.scheme, guess.meshes, guess.points)
    w, old = into.pack(resample(into, spans, guess.chosen)), guess.iterate
    same = (
        len(guess.meshes) == len(into.meshes)
        and all(np.array_equal(a, b) for a, b in zip(guess.meshes, into.meshes, strict=True))
        and (old.lam_w.size, old.lam_g.size) == (w.size, rows)
        and structure_of(guess.problem, guess.scheme) == structure_of(into.problem, into.scheme)
    )
    return (replace(old, w=w), True) if same else (Iterate.cold(w, rows), False)


def _check_shapes(into: Transcription, points: Values) -> None:
    """Raise ValueError if the shapes of `points` do not match the meshes and models."""

    def shapes(of: Values) -> list[tuple[tuple[int, ...], ...]]:
        return [tuple(a.shape for a in (s.nodes, s.inner, s.z, s.u)) for s in of.spans]

    fitting = initial_points(into)
    if shapes(points) != shapes(fitting):
        name, nodes = into.problem.spans[0].name, fitting.spans[0].nodes
        raise ValueError(
            f"guess: expected points of {len(fitting.spans)} phases, {name} with states at the "
            f"nodes of shape {nodes.shape}, got points of other meshes or models; pass the "
            "solution itself, which is transferred by name"
        )


def initial_points(
    into: Transcription, given: Mapping[str, Guess] | SignalSource | None = None
) -> Values:
    """Return initial points from `given` values by name, and default values for other signals.

    A run is stretched to the duration; free durations are scaled to its duration.

    States are piecewise linear through the middles of their conditions at the start, at via points
    and at the end, over all phases in which they are continuous. A state that is the rate of
    another state (x' = v) is the slope of this state: with v = 0, where a friction law is steepest,
    Ipopt needs ten times the iterations or fails. States that are conditioned only by an output are
    constant. Algebraic variables have their start value. Inputs are zero, or the middle of their
    bounds if zero is outside.

    Raises:
        ValueError: a name is unknown, or values are not finite or not one per time.
    """
    problem = into.problem
    models = [span.model for span in problem.spans]
    known = dict.fromkeys(v.name for m in models for group in (m.x, m.z, m.u) for v in group)
    t, rows = (
        _signals(given, known) if isinstance(given, SignalSource) else (None, dict[str, Array]())
    )
    durations = _durations(problem, None if t is None else float(t[-1]))
    total = float(sum(durations[: len(problem.chain)]))
    if t is not None:
        given = {n: partial(np.interp, xp=total / t[-1] * t, fp=row) for n, row in rows.items()}
    guesses = checks.named("guess", given, list(known))

    def value(number: int, name: str, fractions: Array) -> Array | None:
        if name not in guesses:
            return None
        begin = _begin(problem, durations, number)
        return _evaluate(name, guesses[name], begin + fractions * durations[number], total)

    return into.consistent(points_from(into, durations, value))


def _signals(run: SignalSource, known: Collection[str]) -> tuple[Array, dict[str, Array]]:
    """Return the times of a run since its start [s], and its signals among `known`."""
    t = checks.array("guess: times of the run", run.t)
    if t.size < 2 or np.diff(t).min() < 0.0 or t[0] == t[-1]:
        raise checks.refused("guess: times of the run", "increasing times [s]", t)
    shared = [name for name in known if name in run.signals]
    rows = {n: checks.array(f"guess of {n}", run.signals[n])[: t.size] for n in shared}
    if not rows or any(row.size < t.size for row in rows.values()):
        what = f"one of {', '.join(known)}, with a value for each time"
        raise checks.refused("guess: signals of the run", what, [*run.signals])
    return t - t[0], rows


def resample(
    into: Transcription, spans: Sequence[SpanMotion], chosen: Mapping[str, float]
) -> Values:
    """Return the motion of a solution on other meshes, phases or models with equal names.

    If the number of phases is equal, each phase is transferred separately. Otherwise the total
    motion is stretched to the total duration.
    """
    problem, durations = into.problem, _durations(into.problem)
    old: dict[int, list[SpanMotion]] = {}
    for part in spans:
        old.setdefault(part.span.scenario, []).append(part)
    sources = [old.get(span.scenario, old[min(old)]) for span in problem.spans]
    same = len(problem.chain) == len(sources[0])
    for number, span in enumerate(problem.spans):
        if same and isinstance(span.T, Free):
            T = sources[number][span.phase].points.T
            durations[number] = float(clipped(T, limits(span.T)))
    total = float(sum(durations[: len(problem.chain)]))

    def value(number: int, name: str, fractions: Array) -> Array | None:
        if same:
            return sources[number][problem.spans[number].phase].at(name, fractions)
        begin = _begin(problem, durations, number)
        return along(sources[number], name, (begin + fractions * durations[number]) / total)

    points = points_from(into, durations, value)
    known = {c.name: clipped(chosen[c.name], (c.lower, c.upper)) for c in problem.chosen
             if c.name in chosen}  # fmt: skip
    return replace(points, chosen=dict(points.chosen) | known)


Value = Callable[[int, str, Array], Array | None]
"""(index of the phase, name, fractions of T) -> initial values of the signal, None if unknown."""


def points_from(into: Transcription, durations: Sequence[float], value: Value) -> Values:
    """Return points of all phases from known values, with default values of other signals."""
    problem, phases = into.problem, len(into.problem.chain)
    points: list[SpanPoints] = []
    lines = _Lines((), ())
    for number, span in enumerate(problem.spans):
        if not span.phase:
            lines = _Lines(problem.spans[number : number + phases], durations[number:])
        mesh, inner, at = into.meshes[number], into.inner_fractions(number), into.fractions(number)
        model, x = span.model, dict[str, Array]()
        for v in model.x:
            row = value(number, v.name, at)
            x[v.name] = lines.of(span.phase, v.name, at) if row is None else row
        for rate, name in rates_of(model).items():
            if value(number, rate, at) is None:
                x[rate] = np.gradient(x[name], at * durations[number])
        lines.ends[span.phase] = {name: float(row[-1]) for name, row in x.items()}

        def rows(names: list[str], start: list[float], at: Array, number: int = number) -> Array:
            known = [value(number, name, at) for name in names]
            full = (
                np.full(at.size, y) if r is None else r for r, y in zip(known, start, strict=True)
            )
            return np.array([*full]).reshape(len(names), at.size)

        table = np.array([*x.values()]).reshape(len(x), at.size)
        start, rest = (
            [float(v.start) for v in model.z],
            [_rest(span.boxes[v.name]) for v in model.u],
        )
        z = rows([v.name for v in model.z], start, inner)
        u = rows([v.name for v in model.u], rest, (mesh[1:] + mesh[:-1]) / 2)
        nodes, points_inside = (table[:, np.searchsorted(at, part)] for part in (mesh, inner))
        points.append(SpanPoints(durations[number], nodes, points_inside, z, u))
    return Values(tuple(points), {choice.name: choice.guess for choice in problem.chosen})


class _Lines:
    """Piecewise linear motion through the prescribed states of one scenario.

    Attributes:
        ends: states at the end of each phase so far, which determine states that jump.
    """

    def __init__(self, spans: Sequence[Span], durations: Sequence[float]) -> None:
        self._spans, self._durations = spans, durations
        self._begins = [float(sum(durations[:k])) for k in range(len(spans))]
        self.ends: dict[int, dict[str, float]] = {}

    def of(self, phase: int, name: str, fractions: Array) -> Array:
        """Return the values of a state at fractions of T of a phase."""
        first, last = phase, phase
        while self._continues(first, name):
            first -= 1
        while self._continues(last + 1, name):
            last += 1
        knots: dict[float, float] = {}
        jump = self._link(first, name)
        if jump is not None and first - 1 in self.ends:
            knots[self._begins[first]] = self._landing(first, jump)
        for k in range(first, last + 1):
            span = self._spans[k]
            for s, boxes in span.nodes.items():
                if name in boxes and _prescribed(span, name, s):
                    knots[self._begins[k] + s * self._durations[k]] = _middle(boxes[name])
        knots = dict(sorted(knots.items())) or {0.0: _rest(self._spans[phase].boxes[name])}
        at = self._begins[phase] + fractions * self._durations[phase]
        return np.interp(at, list(knots), list(knots.values()))

    def _link(self, phase: int, name: str) -> Link | None:
        links = self._spans[phase].links if phase < len(self._spans) else ()
        return next((link for link in links if link.state == name), None)

    def _continues(self, phase: int, name: str) -> bool:
        """Return True if a state is continuous at the start of a phase."""
        link = self._link(phase, name)
        return link is not None and self._spans[phase - 1].same_state(link.expression) == name

    def _landing(self, phase: int, link: Link) -> float:
        """Return the value of a state after its jump at the start of a phase."""
        span = self._spans[phase - 1]
        function = ca.Function("landing", span.symbols, [link.expression])
        x = [self.ends[phase - 1][v.name] for v in span.model.x]
        z = [float(v.start) for v in span.model.z]
        u = [_rest(span.boxes[v.name]) for v in span.model.u]
        return float(function(self._begins[phase], x, z, u, span.p))


def _prescribed(span: Span, name: str, fraction: float) -> bool:
    """Return True if a state has a condition at `fraction` in addition to its bounds."""
    box = span.nodes[fraction][name]
    finite = isfinite(box[0]) or isfinite(box[1])
    return finite and (box != span.boxes[name] or (span.phase == 0 and fraction == 0.0))


def _durations(problem: Problem, total: float | None = None) -> list[float]:
    """Return the initial durations [s], scaled to prescribed sums; free ones, first to `total`."""
    spans = problem.spans
    durations = [initial(span.T) for span in spans]
    if total is not None:
        factor = total / sum(durations[: len(problem.chain)])
        pairs = zip(durations, spans, strict=True)
        durations = [float(clipped(T * factor, limits(span.T))) for T, span in pairs]
    for phases, whole in problem.durations:
        for first in range(0, len(spans), len(problem.chain)):
            numbers = [first + k for k in phases]
            free = [n for n in numbers if isinstance(spans[n].T, Free)]
            rest = initial(whole) - sum(durations[n] for n in numbers if n not in free)
            have = sum(durations[n] for n in free)
            for n in free:
                durations[n] = clipped(durations[n] * rest / have, limits(spans[n].T))
    return durations


def _begin(problem: Problem, durations: Sequence[float], number: int) -> float:
    """Return the start time of a phase [s]."""
    first = number - number % len(problem.chain)
    return float(sum(durations[first:number]))


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
    """Return state -> other state, for each state that is the time derivative of another one."""
    ode = model.function("ode")(model.t, *(model.vector(letter) for letter in "xzup"))
    return {
        other.name: v.name
        for i, v in enumerate(model.x)
        for other in model.x
        if ca.is_equal(ode[i], other.symbol)
    }


def _middle(box: Box) -> float:
    """Return the middle of a range, or its finite bound."""
    low, high = box
    if isfinite(low) and isfinite(high):
        return (low + high) / 2
    return low if isfinite(low) else high


def _rest(box: Box) -> float:
    """Return zero, or the middle of `box` if it does not contain zero."""
    return 0.0 if box[0] <= 0.0 <= box[1] else _middle(box)
