"""What may show in residuals if a model is wrong: functions of what was applied and how it moved.

From the regressors of a channel come families of columns. A right model leaves none of them in the
residuals; each family is what one kind of error leaves:

| family | columns | what is missing |
|---|---|---|
| response to a regressor | it, now and earlier | dynamics, delay, mass, viscous |
| direction of motion | sign v, v abs(v), v^3, abs(v) | Coulomb level, asymmetry, viscous terms |
| speed | bins of abs(v), each way | shape of the friction curve: Stribeck |
| time or distance since reversal | bins, each way | pre-sliding, hysteresis, dwell |
| place | harmonics of the position | ripple, cogging, gravity |
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal, final

import numpy as np

from identification.residuals.evaluation import Array
from identification.verdict.order import Count, lagged

Kind = Literal["position", "velocity", "acceleration", ""]

DELAYS = (0, 1, 2, 4, 8, 16, 32)
"""Samples by which a regressor may act late."""
BINS = 8
"""Bins of speed and of the distance since a reversal, each way."""
HARMONICS = 12
"""Of the position over its range."""
ROWS_EACH = 12
"""Rows that a column needs at least."""
MOVING = 1e-3
"""Share of the largest speed below which there is no direction."""


@final
@dataclass(frozen=True, eq=False)
class Clue:
    """A signal that residuals may depend on, shape (n,), and what it is."""

    name: str
    signal: Array
    kind: Kind = ""


@final
@dataclass(frozen=True, eq=False)
class Family:
    """Columns of one kind.

    Attributes:
        what: what they are functions of, for a sentence: "the residuals of x depend on ...".
        hint: what such a dependence means.
        columns: shape (n, q).
        smoothed: whether they come from a signal that had to be smoothed, which leaves traces.
    """

    what: str
    hint: str
    columns: Array
    smoothed: bool = False


def families(clues: Sequence[Clue], position: Count) -> Iterator[Family]:
    """The families that `clues` give; those with too many columns for the rows are thinned."""
    n = position.size
    delays = DELAYS if position.max(initial=0) > 2 * DELAYS[-1] else DELAYS[:1]
    for clue in clues:
        name, signal = clue.name, clue.signal
        if not np.ptp(signal) > 0:
            continue
        if clue.kind == "position":
            yield _of_place(name, signal, n)
            continue
        columns = np.column_stack([lagged(signal, position, d) for d in delays])
        hint = f"dynamics or a delay from {name} is missing"
        yield Family(f"{name} and its past", hint, columns, clue.kind == "acceleration")
        if clue.kind == "velocity":
            yield from _of_speed(name, signal, n)
            if position.any():
                since = _since_reversal(signal, position)
                yield Family(
                    f"the path since {name} last changed its sign",
                    "hysteresis or pre-sliding is not described",
                    _bins(since, _way(signal), _count(n)),
                )


def _of_place(name: str, x: Array, n: int) -> Family:
    turns = 2 * np.pi * (x - x.min()) / np.ptp(x)
    orders = np.arange(1, max(1, min(HARMONICS, n // (2 * ROWS_EACH))) + 1) / 2
    waves = np.outer(turns, orders)
    return Family(
        f"the place {name}",
        "something changes along the way: ripple, cogging, a spring, gravity",
        np.column_stack([np.cos(waves), np.sin(waves)]),
    )


def _count(n: int) -> int:
    """Bins each way that n rows allow."""
    return max(2, min(BINS, n // (2 * ROWS_EACH)))


def _of_speed(name: str, v: Array, n: int) -> Iterator[Family]:
    size = np.abs(v).max()
    yield Family(
        f"the direction and size of {name}",
        "friction of another level or another power of the speed is there",
        np.column_stack([_way(v), v * np.abs(v) / size**2, (v / size) ** 3, np.abs(v) / size]),
    )
    yield Family(
        f"the speed {name}",
        "the friction curve has another shape, such as a Stribeck peak",
        _bins(np.abs(v), _way(v), _count(n)),
    )


def _way(v: Array) -> Array:
    """Sign of v; 0 at standstill."""
    return np.where(np.abs(v) > MOVING * np.abs(v).max(), np.sign(v), 0.0)


def _bins(signal: Array, way: Array, count: int) -> Array:
    """One column for each bin of equal shares of `signal` and each way, (n, up to 2 count)."""
    moving = way != 0
    if not moving.any():
        return np.zeros((signal.size, 0))
    edges = np.quantile(signal[moving], np.linspace(0, 1, count + 1)[1:-1])
    bin_of = np.searchsorted(edges, signal)
    columns = [(bin_of == b) & (way == side) for b in range(count) for side in (-1, 1)]
    return np.column_stack([c for c in columns if c.any()]).astype(float)


def _since_reversal(v: Array, position: Count) -> Array:
    """Sum of abs(v) over the samples since v changed its sign or a run began."""
    way = np.sign(v)
    turned = np.ones(v.size, dtype=bool)
    turned[1:] = (way[1:] != way[:-1]) | (position[1:] == 0)
    path = np.cumsum(np.abs(v))
    last = np.maximum.accumulate(np.where(turned, np.arange(v.size), 0))
    return path - path[last]
