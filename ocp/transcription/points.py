"""Where every unknown stands: named points of a motion to a vector and back."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import final

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


@final
@dataclass(frozen=True, eq=False)
class SpanPoints:
    """Values of everything that is chosen in one span, in SI units.

    Attributes:
        T: duration [s], chosen or fixed.
        nodes: states at the nodes of the mesh, shape (nx, N + 1).
        inner: states at the collocation points, shape (nx, N d).
        z: algebraic variables there, shape (nz, N d).
        u: inputs, constant on each interval, shape (nu, N).
    """

    T: float
    nodes: Array
    inner: Array
    z: Array
    u: Array


@final
@dataclass(frozen=True, eq=False)
class Points:
    """Values of everything that is chosen.

    Attributes:
        spans: one for each span of the problem.
        chosen: values of the parameters that are chosen with the motion.
    """

    spans: tuple[SpanPoints, ...]
    chosen: Mapping[str, float] = field(default_factory=dict[str, float])


@final
@dataclass(frozen=True, eq=False)
class SpanLayout:
    """Where the unknowns of one span stand in w; what it shares with another stands there.

    Attributes:
        T: of the duration; -1 where it is fixed.
        nodes, inner, z, u: as in `SpanPoints`.
        extra: further unknowns of each interval, shape (k, N).
    """

    T: int
    nodes: Indices
    inner: Indices
    z: Indices
    u: Indices
    extra: Indices

    @property
    def intervals(self) -> int:
        """Number N of intervals."""
        return self.u.shape[1]

    @property
    def degree(self) -> int:
        """Collocation points of an interval."""
        return self.inner.shape[1] // self.intervals

    def points_of(self, interval: int) -> Indices:
        """States that carry the polynomial of an interval, shape (nx, d + 1)."""
        d = self.degree
        inner = self.inner[:, interval * d : (interval + 1) * d]
        return np.column_stack([self.nodes[:, interval], inner])


@final
@dataclass(frozen=True, eq=False)
class Layout:
    """The order of the unknowns, which is that of time within each span.

        w = [x_0, (u_1, (x, z)_11 ... (x, z)_1d, extra_1), x_1, ..., x_N, T] of each span,
            chosen parameters, largest cost

    Attributes:
        spans: one for each span.
        chosen: parameters that are chosen.
        largest: bound of all costs where the largest counts; -1 elsewhere.
        size: number of unknowns.
    """

    spans: tuple[SpanLayout, ...]
    chosen: Indices
    largest: int
    size: int


@final
@dataclass(frozen=True, eq=False)
class Sizes:
    """Unknowns of one span: states, algebraic variables, inputs and more an interval.

    Attributes:
        intervals: number of intervals N.
        like: number of the span whose duration and inputs are the same; -1 where there is none.
        shared: rows of the inputs that are the same as in span `like`.
    """

    nx: int
    nz: int
    nu: int
    extra: int
    intervals: int
    free_time: bool
    like: int = -1
    shared: tuple[int, ...] = ()


def lay_out(sizes: Sequence[Sizes], degree: int, chosen: int, largest: bool) -> Layout:
    """Places of all unknowns in one vector, span by span and interval by interval."""
    spans: list[SpanLayout] = []
    first = 0
    for s in sizes:
        own = [i for i in range(s.nu) if i not in s.shared]
        xz = s.nx + s.nz
        width = len(own) + degree * xz + s.extra + s.nx
        starts = first + s.nx + width * np.arange(s.intervals)

        def at(offset: int, count: int, starts: Indices = starts) -> Indices:
            return offset + np.arange(count)[:, None] + starts[None, :]

        points = (starts[:, None] + len(own) + xz * np.arange(degree)).ravel()
        u = np.empty((s.nu, s.intervals), np.int64)
        u[own] = at(0, len(own))
        after = len(own) + degree * xz
        start = first + np.arange(s.nx)[:, None]
        first += s.nx + width * s.intervals
        duration = first if s.free_time else -1
        if s.like >= 0:
            u[list(s.shared)] = spans[s.like].u[list(s.shared)]
            duration = spans[s.like].T
        first += s.free_time and s.like < 0
        spans.append(
            SpanLayout(
                duration,
                np.hstack([start, at(after + s.extra, s.nx)]),
                at(0, s.nx, points),
                at(s.nx, s.nz, points),
                u,
                at(after, s.extra),
            )
        )
    parameters = first + np.arange(chosen)
    first += chosen
    return Layout(tuple(spans), parameters, first if largest else -1, first + largest)
