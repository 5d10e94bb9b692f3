"""Random starts near a given one: the same ends, other ways between them."""

from collections.abc import Callable, Iterable, Sequence
from math import isfinite, pi

import numpy as np
from numpy.typing import NDArray

from ocp.formulation.phase import (
    Box,
    Free,
)
from ocp.solving.starts import rates_of
from ocp.transcription.transcription import Transcription
from ocp.transcription.unknowns import (
    Points,
    SpanPoints,
)
from symfric.foundation import checks

Array = NDArray[np.float64]
WAVES = 4
"""Half waves of which a perturbation is made."""
Wave = Callable[[Array], Array]
HALF_WAVES = np.arange(1, 4)
"""Numbers of half waves over the whole motion of which a deviation is made."""
STILL = 0.3
"""Share of the nominal value by which a state deviates that stays where it is in the given start
and has no other of its unit to take the size from."""


def perturbed(into: Transcription, points: Points, scale: float, seed: int) -> Points:
    """`points` with a random smooth deviation, the same one on every mesh.

    Each signal is moved by a sum of half waves whose standard deviation is `scale` times its
    magnitude: half the width of its bounds where these are finite, else its largest value or its
    nominal one. Free durations and chosen parameters are multiplied by exp(scale r / 2), r normal.
    Values that are asked for stay: solvers put them back to their bounds.

    Args:
        into: what the points belong to.
        points: what to start from, `initial_points(into)`.
        scale: 0.1 is close by, 1 anywhere within the bounds.
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
    """A random sum of half waves over [0, 1] with standard deviation `size`."""
    a = random.standard_normal((2, WAVES)) * size / np.sqrt(WAVES)

    def at(fractions: Array) -> Array:
        angles = pi * np.arange(1, WAVES + 1)[:, None] * fractions
        return a[0] @ np.sin(angles) + a[1] @ np.cos(angles)

    return at


def _rows(waves: Sequence[Wave], fractions: Array) -> Array:
    table = [wave(fractions) for wave in waves]
    return np.array(table).reshape(len(table), fractions.size)


def _size(box: Box, nominal: float, row: Array) -> float:
    """The magnitude of a signal."""
    low, high = box
    if isfinite(low) and isfinite(high):
        return 0.5 * (high - low)
    return float(max(nominal, np.abs(row).max(initial=0.0)))


def starts_around(
    into: Transcription, begin: Points, seeds: Iterable[int], spread: float
) -> tuple[Points, ...]:
    """`begin` for the seed 0, a random smooth deviation from it for any other.

    A state deviates by half waves over the whole motion, `spread` times the distance it goes in
    `begin`, less in short waves; the rate of another state (x' = v) by the rate of its deviation,
    so that both belong together. Inputs deviate by `spread` times a quarter of their range.

    Args:
        into: what the points belong to.
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
    """State -> how far it goes in `begin`, over all spans."""
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
    return {name: way or alike[units[name]] or STILL * nominals[name] for name, way in gone.items()}


def _reach(box: Box, nominal: float) -> float:
    """How far an input deviates."""
    low, high = box
    return 0.25 * (high - low) if isfinite(low) and isfinite(high) else nominal
