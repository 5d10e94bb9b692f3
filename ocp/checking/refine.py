"""A mesh that follows from errors: finer where it has to be, as coarse as it may be elsewhere."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from math import ceil, inf, sqrt
from typing import final

import numpy as np
from numpy.typing import NDArray

from symfric.foundation.brief import brief

Array = NDArray[np.float64]

GROWTH = 3.0
"""A mesh grows by no more than this factor at once: errors are estimates."""
LEAST_PARTS = 0.5
"""At most two intervals of the same density become one at once."""
MOST_PARTS = 16.0
"""An interval is split in at most so many parts at once."""
STEEPEST = 2.0
"""Neighbouring intervals differ in length by no more than about this factor."""
SAME_NUMBER = 0.4
"""A mesh that needs no more intervals than it has keeps them down to this share: nothing that
depends on their number is made again."""


@final
@dataclass(frozen=True, eq=False)
class MeshErrors:
    """What the intervals of one span get wrong.

    Attributes:
        local: relative local error of each interval, shape (N,).
        losses: cost lost in each of them by holding the inputs (see `holding_losses`).
        outside: which of them leave a bound between the nodes.
    """

    local: Array
    losses: Array
    outside: NDArray[np.bool_] = field(default_factory=lambda: np.zeros(0, dtype=bool))

    __repr__ = brief


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
) -> tuple[Array, ...]:
    """New meshes on which local errors are below `local`, and the lost cost below `loss`.

    Interval k needs n_k parts. A local error e falls as n^-(p+1) with the order p where the motion
    is smooth, which is trusted for longer intervals only; where it is too large the motion is not,
    and half of that is. Losses E_k fall as n^-2, so that their sum is `loss` with the fewest
    intervals for

        n_k = E_k^(1/3) sqrt(sum E^(1/3) / loss)

    The larger of both, at least two parts where a bound is left between nodes, is spread evenly:
    nodes move, and where their number may stay as it is it does.

    Args:
        meshes: fractions that bound the intervals of each span.
        errors: what they get wrong.
        keep: fractions of each span that stay nodes.
        local, loss: what is allowed; `loss` for all spans together, in units of J.
        order: of the scheme.
        most: intervals of all spans together.
        for_loss: intervals that are made for the sake of losses alone.
    """
    roots = [np.cbrt(e.losses) for e in errors]
    total = sum(float(root.sum()) for root in roots)
    share = sqrt(total / loss) if loss > 0 else 0.0
    intervals = sum(mesh.size - 1 for mesh in meshes)
    lost = min(1.0, min(GROWTH * intervals, for_loss) / max(share * total, 1.0))
    parts: list[Array] = []
    for mesh, own, root in zip(meshes, errors, roots, strict=True):
        excess = 2.0 * np.where(np.isfinite(own.local), own.local, 1e30 * local) / local
        n = np.where(excess > 1.0, excess ** (2.0 / (order + 1)), excess ** (1.0 / (order + 1)))
        n = np.maximum(np.minimum(n, GROWTH), lost * share * root)
        if own.outside.size:
            n = np.where(own.outside, np.maximum(n, 2.0), n)
        parts.append(_graded(np.clip(n, LEAST_PARTS, MOST_PARTS), np.diff(mesh)))
    shrink = min(1.0, most / sum(float(n.sum()) for n in parts))
    return tuple(
        _spread(mesh, n * shrink, sorted({0.0, *fixed, 1.0}))
        for mesh, n, fixed in zip(meshes, parts, keep, strict=True)
    )


def _graded(parts: Array, lengths: Array) -> Array:
    """More parts beside short intervals, so that lengths change gradually."""
    density = parts / lengths
    for k in range(1, density.size):
        density[k] = max(density[k], density[k - 1] / STEEPEST)
    for k in range(density.size - 2, -1, -1):
        density[k] = max(density[k], density[k + 1] / STEEPEST)
    return density * lengths


def _spread(mesh: Array, parts: Array, keep: Sequence[float]) -> Array:
    """Nodes at equal amounts of `parts`, with whole numbers between the fractions to keep."""
    done = np.concatenate([[0.0], np.cumsum(parts)])
    at = np.interp(keep, mesh, done)
    wanted = np.diff(at)
    scale = 1.0
    old = mesh.size - 1
    if SAME_NUMBER * old <= sum(map(ceil, wanted)) <= old:
        scale = old / max(float(wanted.sum()), 1e-9)
    counts = [max(1, ceil(scale * n - 1e-9)) for n in wanted]
    while scale > 1.0 and sum(counts) > old and max(counts) > 1:
        counts[int(np.argmax(counts))] -= 1  # rounded up more than once
    pieces = [
        np.interp(np.linspace(low, high, n, endpoint=False), done, mesh)
        for low, high, n in zip(at[:-1], at[1:], counts, strict=True)
    ]
    new = np.concatenate([*pieces, [1.0]])
    first = np.cumsum([0, *counts[:-1]])
    new[first] = keep[:-1]
    return new
