"""Several starts round a given one: the same ends, other ways between them."""

from collections.abc import Iterable
from math import isfinite, pi

import numpy as np
from numpy.typing import NDArray

from ocp.formulation.bounds import Box
from ocp.solving.starts import rates_of
from ocp.transcription.transcription import Transcription
from ocp.transcription.unknowns import Points, SpanPoints

Array = NDArray[np.float64]

HALF_WAVES = np.arange(1, 4)
"""Numbers of half waves over the whole motion of which a deviation is made."""
STILL = 0.3
"""Share of the nominal value by which a state deviates that stays where it is in the given start
and has no other of its unit to take the size from."""


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
    sizes = _sizes(into, begin)
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


def _sizes(into: Transcription, begin: Points) -> dict[str, float]:
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
