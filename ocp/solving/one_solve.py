"""Single solve: random starts near a given one, and conversion of the result to a solution.

This module does not refine meshes, sharpen friction or verify; `ocp.solve` does so.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import isfinite, pi
from typing import Any

import casadi as ca
import numpy as np

from ocp.formulation.phase import Array, Box, Free, Span, clipped, limits
from ocp.solving.methods import Fatrop, Ipopt, Sqp
from ocp.solving.motion import motions_of
from ocp.solving.solution import Solution
from ocp.solving.starts import rates_of
from ocp.transcription.program import Outcome
from ocp.transcription.transcribe import Transcription
from ocp.transcription.unknowns import Points, SpanPoints
from symfric.foundation import checks
from symfric.foundation.parameters import parameters
from symfric.foundation.status import Status
from symfric.foundation.variable import Variable
from symfric.model.contact import Contact

Solver = Ipopt | Fatrop | Sqp
WAVES = 4
"""Number of half waves in a perturbation."""
HALF_WAVES = np.arange(1, 4)
"""Numbers of half waves over the whole motion in a deviation."""
STILL = 0.3
"""Deviation, relative to the nominal value, of a state that is constant in the given start if all
states of its unit are constant."""
NARROW = 0.02
"""Smoothing width, relative to the largest sliding velocity, below which Newton's method may step
over the layer."""
NAMED = 3
"""Largest number of contacts in a message."""


@dataclass(frozen=True, eq=False)
class Solved:
    """Transcription of a problem, and the result of a solver."""

    transcription: Transcription
    outcome: Outcome

    @cached_property
    def points(self) -> Points:
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
        )


def perturbed(into: Transcription, points: Points, scale: float, seed: int) -> Points:
    """Return `points` with a random smooth deviation that does not depend on the mesh.

    A sum of half waves is added to each signal. Its standard deviation is `scale` times the
    magnitude of the signal: half the width of its bounds if these are finite, otherwise the larger
    of its largest and its nominal value. Free durations and chosen parameters are multiplied by
    exp(scale r / 2), r normal. Solvers project prescribed values onto their bounds.

    Args:
        into: transcription of the points.
        points: initial points, such as `initial_points(into)`.
        scale: size of the deviation; 0.1 is small, 1 spans the bounds.
        seed: seed of NumPy's default generator.
    """
    checks.number("perturbed: scale", scale, lower=0.0)
    random = np.random.default_rng(seed)

    def waves(group: Sequence[Variable], rows: Array, span: Span) -> Callable[[Array], Array]:
        """Return random sums of half waves over [0, 1], one row for each variable."""
        sizes = [scale * _magnitude(span.boxes[v.name], v.nominal, row)
                 for v, row in zip(group, rows, strict=True)]  # fmt: skip
        a = [random.standard_normal((2, WAVES)) * size / np.sqrt(WAVES) for size in sizes]

        def at(fractions: Array) -> Array:
            angles = pi * np.arange(1, WAVES + 1)[:, None] * fractions
            table = [one[0] @ np.sin(angles) + one[1] @ np.cos(angles) for one in a]
            return np.array(table).reshape(len(table), fractions.size)

        return at

    spans: list[SpanPoints] = []
    for number, (span, old) in enumerate(zip(into.problem.spans, points.spans, strict=True)):
        mesh, inner, model = into.meshes[number], into.inner_fractions(number), span.model
        x, z, u = (waves(group, rows, span) for group, rows in
                   ((model.x, old.nodes), (model.z, old.z), (model.u, old.u)))  # fmt: skip
        T = old.T * float(np.exp(0.5 * scale * random.standard_normal()))
        spans.append(
            SpanPoints(
                clipped(T, limits(span.T)) if isinstance(span.T, Free) else old.T,
                old.nodes + x(mesh),
                old.inner + x(inner),
                old.z + z(inner),
                old.u + u((mesh[1:] + mesh[:-1]) / 2),
            )
        )
    chosen: dict[str, float] = {}
    for c in into.problem.chosen:
        value = points.chosen[c.name] * np.exp(0.5 * scale * random.standard_normal())
        chosen[c.name] = float(clipped(value, (c.lower, c.upper)))
    return Points(tuple(spans), chosen)


def _magnitude(box: Box, nominal: float, row: Array) -> float:
    """Return the magnitude of a signal; see `perturbed`."""
    low, high = box
    if isfinite(low) and isfinite(high):
        return 0.5 * (high - low)
    return float(max(nominal, np.abs(row).max(initial=0.0)))


def starts_around(
    into: Transcription, begin: Points, seeds: Iterable[int], spread: float
) -> tuple[Points, ...]:
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


def _around(into: Transcription, begin: Points, spread: float, seed: int) -> Points:
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
        at = angles((mesh[1:] + mesh[:-1]) / 2)
        for row, v in zip(u, span.model.u, strict=True):
            low, high = span.boxes[v.name]
            size = 0.25 * (high - low) if isfinite(low) and isfinite(high) else v.nominal
            row += size * np.sin(at) @ waves[v.name]
        spans.append(SpanPoints(old.T, nodes, points, old.z, u))
    return Points(tuple(spans), begin.chosen)


def _ranges(into: Transcription, begin: Points) -> dict[str, float]:
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


def narrow_widths(transcription: Transcription, points: Points) -> str:
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


def along_points(span: Span, at: SpanPoints, column: ca.SX) -> Array:
    """Return `column` at the collocation points, or at nodes if there are none, (rows, points)."""
    inner = at.inner.shape[1]
    x, n = (at.inner, inner) if inner else (at.nodes[:, :-1], at.u.shape[1])
    u = np.repeat(at.u, n // at.u.shape[1], axis=1)
    z = at.z if at.z.shape[1] == n else np.zeros((at.z.shape[0], n))
    p = np.tile(span.p[:, None], (1, n))
    function = ca.Function("along", span.symbols, [column])
    return function.map(n)(np.zeros((1, n)), x, z, u, p).full()
