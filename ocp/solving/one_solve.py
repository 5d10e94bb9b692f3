"""A single solve: a problem on meshes, a solver and a start give a solution.

Nothing is refined, sharpened or verified here; `ocp.solve` does that with this module. Random
starts near a given one keep its ends, and vary the path between them.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from math import isfinite, pi
from time import perf_counter
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike, NDArray

from ocp.formulation.phase import Box, Free, Span
from ocp.formulation.problem import Problem
from ocp.solving.methods import Fatrop, Ipopt, Sqp
from ocp.solving.motion import Motion, motion_of
from ocp.solving.prepared import Prepared
from ocp.solving.solution import Solution
from ocp.solving.starts import Start, rates_of, start_of
from ocp.transcription.program import Outcome, Report
from ocp.transcription.schemes import Radau, Scheme, make_meshes
from ocp.transcription.transcribe import discretise
from ocp.transcription.transcription import Transcription
from ocp.transcription.unknowns import Points, SpanPoints
from symfric.foundation import checks
from symfric.foundation.parameters import parameters
from symfric.foundation.status import Status
from symfric.model.contact import Contact

Array = NDArray[np.float64]
WAVES = 4
"""Number of half waves in a perturbation."""
Wave = Callable[[Array], Array]
HALF_WAVES = np.arange(1, 4)
"""Numbers of half waves over the whole motion in a deviation."""
STILL = 0.3
"""Deviation, over the nominal value, of a state that is constant in the given start and has no
other state of its unit to define its size."""


def perturbed(into: Transcription, points: Points, scale: float, seed: int) -> Points:
    """Return `points` with a random smooth deviation, the same one on every mesh.

    Each signal is moved by a sum of half waves whose standard deviation is `scale` times its
    magnitude: half the width of its bounds if these are finite, else its largest value or its
    nominal one. Free durations and chosen parameters are multiplied by exp(scale r / 2), r normal.
    Prescribed values stay: solvers project them onto their bounds.

    Args:
        into: transcription of the points.
        points: initial points, `initial_points(into)`.
        scale: 0.1 is a small deviation, 1 fills the bounds.
        seed: of NumPy's default generator.
    """
    checks.number("perturbed: scale", scale, lower=0.0)
    random = np.random.default_rng(seed)
    spans: list[SpanPoints] = []
    for number, (span, old) in enumerate(zip(into.problem.spans, points.spans, strict=True)):
        mesh, inner = into.meshes[number], into.inner_fractions(number)
        model = span.model
        x = [_wave(random, scale * _size(span.box(v.name), v.nominal, row))
             for v, row in zip(model.x, old.nodes, strict=True)]  # fmt: skip
        z = [_wave(random, scale * _size(span.box(v.name), v.nominal, row))
             for v, row in zip(model.z, old.z, strict=True)]  # fmt: skip
        u = [_wave(random, scale * _size(span.box(v.name), v.nominal, row))
             for v, row in zip(model.u, old.u, strict=True)]  # fmt: skip
        factor = float(np.exp(0.5 * scale * random.standard_normal()))
        spans.append(
            SpanPoints(
                _within(old.T * factor, span.T) if isinstance(span.T, Free) else old.T,
                old.nodes + _rows(x, mesh),
                old.inner + _rows(x, inner),
                old.z + _rows(z, inner),
                old.u + _rows(u, (mesh[1:] + mesh[:-1]) / 2),
            )
        )
    chosen = {
        c.name: float(
            np.clip(
                points.chosen[c.name] * np.exp(0.5 * scale * random.standard_normal()),
                c.lower,
                c.upper,
            )
        )
        for c in into.problem.chosen
    }
    return Points(tuple(spans), chosen)


def _within(value: float, box: Free) -> float:
    return min(max(value, box.lower), box.upper)


def _wave(random: np.random.Generator, size: float) -> Wave:
    """Return a random sum of half waves over [0, 1] with standard deviation `size`."""
    a = random.standard_normal((2, WAVES)) * size / np.sqrt(WAVES)

    def at(fractions: Array) -> Array:
        angles = pi * np.arange(1, WAVES + 1)[:, None] * fractions
        return a[0] @ np.sin(angles) + a[1] @ np.cos(angles)

    return at


def _rows(waves: Sequence[Wave], fractions: Array) -> Array:
    table = [wave(fractions) for wave in waves]
    return np.array(table).reshape(len(table), fractions.size)


def _size(box: Box, nominal: float, row: Array) -> float:
    """Return the magnitude of a signal."""
    low, high = box
    if isfinite(low) and isfinite(high):
        return 0.5 * (high - low)
    return float(max(nominal, np.abs(row).max(initial=0.0)))


def starts_around(
    into: Transcription, begin: Points, seeds: Iterable[int], spread: float
) -> tuple[Points, ...]:
    """Return `begin` for the seed 0, and a random smooth deviation from it for any other.

    A state deviates by half waves over the whole motion, `spread` times its range in
    `begin`, less in short waves; the rate of another state (x' = v) by the rate of that deviation,
    so that both are consistent. Inputs deviate by `spread` times a quarter of their range.

    Args:
        into: transcription of the points.
        begin: the first start.
        seeds: of NumPy's default generator.
        spread: of the deviations; 0.5 leads to most local optima of a swing-up.
    """
    return tuple(_around(into, begin, spread, seed) if seed else begin for seed in seeds)


def _around(into: Transcription, begin: Points, spread: float, seed: int) -> Points:
    problem, phases = into.problem, len(into.problem.chain)
    random = np.random.default_rng(seed)
    names = {v.name for s in problem.spans for group in (s.model.x, s.model.u) for v in group}
    waves = {name: spread * random.standard_normal(HALF_WAVES.size) for name in sorted(names)}
    sizes = _distances(into, begin)
    spans: list[SpanPoints] = []
    for number, (span, old) in enumerate(zip(problem.spans, begin.spans, strict=True)):
        first = number - span.phase
        whole = sum(points.T for points in begin.spans[first : first + phases])
        start = sum(points.T for points in begin.spans[first:number]) / whole
        mesh, inner = into.meshes[number], into.inner_fractions(number)
        positions = rates_of(span.model)
        nodes, points, u = old.nodes.copy(), old.inner.copy(), old.u.copy()
        for states, fractions in ((nodes, mesh), (points, inner)):
            at = pi * (start + old.T / whole * fractions)[:, None] * HALF_WAVES
            for row, v in zip(states, span.model.x, strict=True):
                name = positions.get(v.name)
                if name is None:
                    row += sizes[v.name] * (np.sin(at) / HALF_WAVES) @ waves[v.name]
                else:
                    row += sizes[name] * pi / whole * np.cos(at) @ waves[name]
        middles = pi * (start + old.T / whole * (mesh[1:] + mesh[:-1]) / 2)[:, None] * HALF_WAVES
        for row, v in zip(u, span.model.u, strict=True):
            row += _reach(span.box(v.name), v.nominal) * np.sin(middles) @ waves[v.name]
        spans.append(SpanPoints(old.T, nodes, points, old.z, u))
    return Points(tuple(spans), begin.chosen)


def _distances(into: Transcription, begin: Points) -> dict[str, float]:
    """Return state -> its range in `begin`, over all phases."""
    ranges: dict[str, list[float]] = {}
    units: dict[str, str] = {}
    nominals: dict[str, float] = {}
    for span, points in zip(into.problem.spans, begin.spans, strict=True):
        for v, row in zip(span.model.x, points.nodes, strict=True):
            ranges.setdefault(v.name, []).extend((float(row.min()), float(row.max())))
            units[v.name], nominals[v.name] = v.unit, v.nominal
    gone = {name: max(found) - min(found) for name, found in ranges.items()}
    alike = {
        unit: max(gone[name] for name in gone if units[name] == unit) for unit in units.values()
    }
    return {n: size or alike[units[n]] or STILL * nominals[n] for n, size in gone.items()}


def _reach(box: Box, nominal: float) -> float:
    """Return the size of the deviation of an input."""
    low, high = box
    return 0.25 * (high - low) if isfinite(low) and isfinite(high) else nominal


NARROW = 0.02
"""Smoothing width, over the largest sliding velocity, that Newton steps may jump over."""
NAMED = 3
"""Largest number of contacts in a message."""
Solver = Ipopt | Fatrop | Sqp


def narrow_widths(transcription: Transcription, points: Points) -> str:
    """Return a message on contacts with narrow smoothing widths, or "".

    It names contacts that stick or reverse, or whose widths smooth another quantity than their
    sliding velocity.
    """
    found: dict[str, str] = {}
    for span, at in zip(transcription.problem.spans, points.spans, strict=True):
        for contact in span.model.contacts:
            widths = list(_narrow(contact, span, at))
            if widths and contact.name not in found:
                found[contact.name] = f"contact '{contact.name}' has {' and '.join(widths)}"
    if not found:
        return ""
    names = checks.listed(list(found.values()), NAMED)
    return f"Friction is smoothed over a small width: {names}; raise it or use friction='auto'."


def _narrow(contact: Contact, span: Span, at: SpanPoints) -> Iterator[str]:
    """Yield the widths of a contact that are small against its motion, each with its value."""
    slip = along_points(span, at, contact.slip)[0]
    fastest = float(np.abs(slip).max(initial=0.0))
    turns = slip.size > 0 and bool(slip.min() <= 0.0 <= slip.max())
    law: Any = contact.law  # which is Parametric
    known = parameters(law)
    for name, exponent in law.widths.items():
        value = _width_number(known[name].value, span)
        width = value if exponent > 0 else 1.0 / value
        if turns and 0.0 < width < NARROW * fastest:
            unit = contact.unit(known[name].unit)
            yield f"{name} = {value:.3g} {unit}".removesuffix(" 1")
    for name, variable in contact.widths.items():
        yield f"{name} = {_width_number(variable.start, span):.3g} {variable.unit}"


def _width_number(value: Any, span: Span) -> float:
    """Return the value of a parameter of a law, which may be one of the model."""
    function = ca.Function("number", [span.model.vector("p")], [ca.SX(value)])
    return float(function(span.p))


def along_points(span: Span, at: SpanPoints, column: ca.SX) -> Array:
    """Return values at the collocation points, or at the nodes without any, (rows, points)."""
    inner = at.inner.shape[1]
    x, n = (at.inner, inner) if inner else (at.nodes[:, :-1], at.u.shape[1])
    u = np.repeat(at.u, n // at.u.shape[1], axis=1)
    z = at.z if at.z.shape[1] == n else np.zeros((at.z.shape[0], n))
    p = np.tile(span.p[:, None], (1, n))
    function = ca.Function("along", span.symbols, [column])
    return function.map(n)(np.zeros((1, n)), x, z, u, p).full()


def solve_once(
    problem: Problem,
    intervals: int | ArrayLike = 50,
    scheme: Scheme | None = None,
    solver: Solver | None = None,
    guess: Start = None,
    progress: Report | None = None,
) -> Solution:
    """Solve `problem` on one mesh; a failure is reported by the status of the solution.

    Args:
        problem: the problem to solve.
        intervals: number of equal intervals of each phase, fractions of T, or one of these for
            each phase.
        scheme: `Radau(3)` if none.
        solver: `Ipopt()` if none.
        guess: see `ocp.solving.starts`.
        progress: called with a `Progress` after each iteration.

    Raises:
        ValueError: bad input.
    """
    begin = perf_counter()
    scheme = Radau() if scheme is None else scheme
    transcription = discretise(problem, scheme).on(make_meshes(problem, intervals))
    prepared = (Ipopt() if solver is None else solver).prepared(transcription.program)
    written = perf_counter() - begin
    solution = solve_on(transcription, prepared, guess, progress)
    statistics = solution.statistics
    return replace(
        solution, statistics=replace(statistics, build_time=statistics.build_time + written)
    )


def solve_on(
    transcription: Transcription,
    prepared: Prepared,
    guess: Start = None,
    progress: Report | None = None,
    values: ArrayLike | None = None,
    warm: bool | None = None,
) -> Solution:
    """Solve an existing program, possibly many times.

    Args:
        transcription: the problem on meshes.
        prepared: a solver for `transcription.program`, or for another transcription by the same
            `Discretisation` with the same number of intervals.
        guess, progress: as in `solve_once`.
        values: numbers of the parameters, `transcription.values(...)`; None: its own.
        warm: use the multipliers of the guess; None: if it has matching ones.
    """
    start, fits = start_of(transcription, guess)
    numbers = transcription.program.values if values is None else values
    outcome = prepared.run(
        start,
        numbers,
        progress,
        fits if warm is None else warm and fits,
        transcription.when,
    )
    return solution_of(transcription, outcome)


def solution_of(transcription: Transcription, outcome: Outcome) -> Solution:
    """Return the outcome of a solver as a solution."""
    problem = transcription.problem
    points = transcription.unpack(outcome.iterate.w)
    return Solution(
        problem=problem,
        status=outcome.status,
        message=_message(transcription, outcome, points),
        cost=outcome.cost,
        motions=motions_of(transcription, points),
        chosen=dict(points.chosen),
        statistics=outcome.statistics,
        scheme=transcription.scheme,
        meshes=transcription.meshes,
        points=points,
        iterate=outcome.iterate,
        cause=outcome.cause,
    )


def _message(transcription: Transcription, outcome: Outcome, points: Points) -> str:
    """Return the message of the solver, and a note on friction that may have stopped it."""
    text = f"ocp '{transcription.problem.name}': {outcome.sentence}"
    stuck = outcome.status in (Status.MAX_ITERATIONS, Status.NO_STEP) or outcome.cycles
    kinks = narrow_widths(transcription, points) if stuck and not outcome.status.ok else ""
    return f"{text} {kinks}".rstrip()


def motions_of(transcription: Transcription, points: Points) -> tuple[Motion, ...]:
    """Return the motion of each scenario."""
    problem, phases = transcription.problem, len(transcription.problem.chain)
    names = problem.scenario_names or ("",)
    scheme = transcription.scheme.coefficients()
    found: list[Motion] = []
    for k, name in enumerate(names):
        part = slice(k * phases, (k + 1) * phases)
        spans = [(number, problem.spans[number]) for number in range(part.start, part.stop)]
        meshes = transcription.meshes[part]
        found.append(motion_of(name, spans, points.spans[part], meshes, scheme, points.chosen))
    return tuple(found)
