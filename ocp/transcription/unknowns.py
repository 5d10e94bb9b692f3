"""Unknowns of a motion: values, their places in the program, and symbols at one place."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import final

import casadi as ca
import numpy as np

from ocp.formulation.phase import Free, Span
from ocp.transcription.blocks import Array, Block, Indices, Linear, Piece, Rows, select
from symfric.foundation.variable import stacked


@final
@dataclass(frozen=True, eq=False)
class SpanPoints:
    """Values of all unknowns of one phase, in SI units.

    Attributes:
        T: duration [s], free or fixed.
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
    """Values of all unknowns.

    Attributes:
        spans: one for each phase and scenario of the problem.
        chosen: values of the parameters chosen with the motion.
    """

    spans: tuple[SpanPoints, ...]
    chosen: Mapping[str, float] = field(default_factory=dict[str, float])


@final
@dataclass(frozen=True, eq=False)
class SpanLayout:
    """Places of the unknowns of one phase in w; shared ones belong to another phase.

    Attributes:
        T: of the duration; -1 if it is fixed.
        nodes, inner, z, u: as in `SpanPoints`.
        extra: additional unknowns of each interval, shape (k, N).
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
        """Number of collocation points of an interval."""
        return self.inner.shape[1] // self.intervals

    def points_of(self, interval: int) -> Indices:
        """Return the states that define the polynomial of an interval, shape (nx, d + 1)."""
        d = self.degree
        inner = self.inner[:, interval * d : (interval + 1) * d]
        return np.column_stack([self.nodes[:, interval], inner])


@final
@dataclass(frozen=True, eq=False)
class Layout:
    """Order of the unknowns, by time within each phase.

        w = [x_0, (u_1, (x, z)_11 ... (x, z)_1d, extra_1), x_1, ..., x_N, T] for each phase,
            chosen parameters, largest cost

    Attributes:
        spans: one for each phase and scenario.
        chosen: of chosen parameters.
        largest: bound of all costs if the largest counts; else -1.
        size: number of unknowns.
    """

    spans: tuple[SpanLayout, ...]
    chosen: Indices
    largest: int
    size: int


@final
@dataclass(frozen=True, eq=False)
class Sizes:
    """Numbers of unknowns of one phase: states, algebraic variables, inputs, extra per interval.

    Attributes:
        intervals: number of intervals N.
        like: index of the phase with the same duration and inputs; -1 if there is none.
        shared: rows of the inputs that are the same as in phase `like`.
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
    """Return places of all unknowns in one vector, by phase and interval."""
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


Columns = Indices | tuple[Indices, Array]
"""(k, places) columns, or columns and weights (k, terms, places); see `blocks.select`."""


def time_scale(span: Span) -> float:
    """Return the magnitude of a free duration [s]."""
    return span.T.start if isinstance(span.T, Free) else 1.0


@final
@dataclass(frozen=True, eq=False)
class Local:
    """Local unknowns v and parameters theta of a phase at one time, as SX symbols.

        v = (x, z, u, T if free, free time before, chosen p),  scaled except the time before
        theta = (p, T, fixed time before, length h of the interval and the place as fractions of T,
                 quadrature weight)

    Attributes:
        number: index of the phase.
        span: the phase.
        before: indices and phases of the same scenario before it.
        choices: names of all chosen parameters of the problem, and their magnitudes.
        inner: whether there are collocation points, and algebraic variables with them.
    """

    number: int
    span: Span
    before: tuple[tuple[int, Span], ...]
    choices: Mapping[str, float]
    inner: bool = True
    x: ca.SX = field(init=False)
    z: ca.SX = field(init=False)
    u: ca.SX = field(init=False)
    rest: ca.SX = field(init=False)
    theta: ca.SX = field(init=False)

    def __post_init__(self) -> None:
        model = self.span.model
        for letter in "xzu":
            count = len(getattr(model, letter)) if self.inner or letter != "z" else 0
            symbol = ca.SX.sym(letter, count)
            object.__setattr__(self, letter, symbol)
        rest = self.free + bool(self.free_before) + len(self.span.chosen)
        object.__setattr__(self, "rest", ca.SX.sym("rest", rest))
        object.__setattr__(self, "theta", ca.SX.sym("theta", len(model.p) + 5))

    @property
    def free(self) -> bool:
        """True if the duration is free."""
        return isinstance(self.span.T, Free)

    @property
    def free_before(self) -> list[tuple[int, Span]]:
        """Phases before it with a free duration."""
        return [(i, span) for i, span in self.before if isinstance(span.T, Free)]

    @property
    def v(self) -> ca.SX:
        """All local unknowns, SX (n, 1)."""
        return ca.vertcat(self.x, self.z, self.u, self.rest)

    @property
    def T(self) -> ca.SX:
        """Duration [s]."""
        return self.rest[0] * time_scale(self.span) if self.free else self.theta[-5]

    @property
    def h(self) -> ca.SX:
        """Length of the interval [s]."""
        return self.theta[-3] * self.T

    @property
    def weight(self) -> ca.SX:
        """Quadrature weight of the point [s]."""
        return self.theta[-1] * self.T

    @property
    def t(self) -> ca.SX:
        """Time since the start of the problem [s]."""
        t = self.theta[-4] + self.theta[-2] * self.T
        return t + self.rest[int(self.free)] if self.free_before else t

    @property
    def p(self) -> ca.SX:
        """Parameters of the model, (n_p, 1)."""
        chosen = self.span.chosen
        first = self.rest.numel() - len(chosen)
        return stacked(
            self.rest[first + chosen.index(v.name)] * self.choices[v.name]
            if v.name in chosen
            else self.theta[i]
            for i, v in enumerate(self.span.model.p)
        )

    @cached_property
    def values(self) -> list[ca.SX]:
        """[t, x, z, u, p] in SI units: arguments of Functions of the model."""
        model = self.span.model
        x, z, u = (getattr(self, letter) for letter in "xzu")
        x, u = x * ca.DM(model.nominal("x")), u * ca.DM(model.nominal("u"))
        z = z * ca.DM(model.nominal("z")) if self.inner else ca.SX.zeros(len(model.z))
        return [self.t, x, z, u, self.p]

    def columns(
        self, layout: Layout, x: Columns, z: Columns, u: Columns, places: int
    ) -> list[Columns]:
        """Return parts of `blocks.select` for v, with given columns of x, z and u at `places`."""
        parts: list[Columns] = [x, z, u] if self.inner else [x, u]
        if self.free:
            parts.append(np.full((1, places), layout.spans[self.number].T))
        if self.free_before:
            shape = (1, len(self.free_before), places)
            earlier = np.array([layout.spans[i].T for i, _ in self.free_before])
            scales = np.array([time_scale(span) for _, span in self.free_before])
            parts.append((_spread(earlier, shape), np.broadcast_to(scales[None, :, None], shape)))
        if self.span.chosen:
            names = list(self.choices)
            rows = layout.chosen[[names.index(name) for name in self.span.chosen]]
            parts.append(np.tile(rows[:, None], (1, places)))
        return parts

    def piece(
        self,
        rows: Rows,
        made: Block,
        parts: Sequence[Columns],
        data: "Data",
        at: tuple[Indices, Array],
        order: Indices,
        weights: Array | None = None,
        linear: Linear | None = None,
    ) -> Piece:
        """Return the piece of a block of these local unknowns.

        Args:
            rows: its rows.
            parts: columns of the local unknowns, see `columns`.
            data: parameters of the phase.
            at: interval and offset of each place.
            order: of the rows.
            weights: of a quadrature on an interval of length 1, at each place.
            linear: part of the rows.
        """
        interval, offset = at
        return Piece(
            rows=rows,
            order=order,
            span=self.number,
            interval=interval,
            offset=offset,
            block=made,
            selection=select(parts, interval.size),
            theta=data.theta(interval, offset, weights),
            linear=linear,
        )


def _spread(values: Indices, shape: tuple[int, int, int]) -> Indices:
    return np.broadcast_to(values[None, :, None], shape)


@final
@dataclass(frozen=True, eq=False)
class Data:
    """Parameters of the program that belong to one phase, MX.

    Attributes:
        p: of the model, (n_p, 1).
        T: duration, if it is fixed [s].
        before: fixed time before it [s].
        mesh: fractions of T that bound the intervals, (N + 1, 1).
    """

    p: ca.MX
    T: ca.MX
    before: ca.MX
    mesh: ca.MX

    def theta(self, interval: Indices, offset: Array, weights: Array | None = None) -> ca.MX:
        """Return theta of `Local` at the fractions `offset` of an `interval`, (k, places).

        `weights` belong to a quadrature on an interval of length 1; zeros by default.
        """
        places = interval.size
        weights = np.zeros(places) if weights is None else weights
        start = self.mesh[interval.tolist()].T
        h = self.mesh[(interval + 1).tolist()].T - start
        common = ca.repmat(ca.vertcat(self.p, self.T, self.before), 1, places)
        return ca.vertcat(common, h, start + ca.DM(offset).T * h, ca.DM(weights).T * h)
