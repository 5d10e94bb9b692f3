"""Random starts near others, to see how much of a result is luck."""

from collections.abc import Callable, Sequence
from math import isfinite, pi

import numpy as np
from numpy.typing import NDArray

from ocp.formulation.bounds import Box, Free
from ocp.transcription.transcription import Transcription
from ocp.transcription.unknowns import Points, SpanPoints
from symfric.foundation import checks

Array = NDArray[np.float64]

WAVES = 4
"""Half waves of which a perturbation is made."""


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


Wave = Callable[[Array], Array]


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
