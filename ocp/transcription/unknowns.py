"""Unknowns of a motion: their values, places in the program, and symbols at one place."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple, final

import casadi as ca
import numpy as np

from ocp.formulation.phase import Box, Free, Span, initial
from ocp.formulation.problem import Problem
from ocp.transcription.blocks import Array, ConstantEntries, Indices, Piece, RowBlock, Rows, select
from ocp.transcription.schemes import Coefficients
from symfric.foundation.variable import stacked


@final
@dataclass(frozen=True, eq=False)
class SpanPoints:
    """Values of all unknowns of one phase, in SI units.

    Attributes:
        T: duration [s], free or fixed.
        nodes: states at the nodes of the mesh, shape (nx, N + 1).
        inner: states at the collocation points, shape (nx, N d).
        z: algebraic variables at the collocation points, shape (nz, N d).
        u: inputs, constant on each interval, shape (nu, N).
    """

    T: float
    nodes: Array
    inner: Array
    z: Array
    u: Array


@final
@dataclass(frozen=True, eq=False)
class Values:
    """Values of all unknowns.

    Attributes:
        spans: values of each phase of each scenario.
        chosen: values of the parameters chosen with the motion.
    """

    spans: tuple[SpanPoints, ...]
    chosen: Mapping[str, float] = field(default_factory=dict[str, float])


class SpanLayout(NamedTuple):
    """Indices in w of the unknowns of one phase; shared unknowns belong to another phase.

    Attributes:
        T: index of the duration; -1 if it is fixed.
        nodes, inner, z, u: indices in the shapes of `SpanPoints`.
        extra: indices of additional unknowns of each interval, shape (k, N): corrections of closed
            loops, then violations at the collocation points.
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

    def names(self, span: Span) -> list[list[str]]:
        """Return names of nodes, inner points, algebraic variables, inputs and extra unknowns."""
        x, z, u = ([v.name for v in getattr(span.model, letter)] for letter in "xzu")
        slacks = [f"the violation of {span.penalised[k].name}" for k, _ in span.sides] * self.degree
        loops = [f"correction {k + 1}" for k in range(self.extra.shape[0] - len(slacks))]
        return [x, x, z, u, [*loops, *slacks]]

    def slacks(self, count: int) -> Indices:
        """Return the indices of `count` violations at each collocation point, (count, d, N)."""
        last = self.extra[self.extra.shape[0] - count * self.degree :]
        return last.reshape(self.degree, count, self.intervals).transpose(1, 0, 2)

    @property
    def carrying(self) -> Indices:
        """Indices of the states that define the polynomial of each interval, (nx, d + 1, N)."""
        inner = self.inner.reshape(self.inner.shape[0], self.intervals, self.degree)
        return np.concatenate([self.nodes[:, :-1, None], inner], axis=2).transpose(0, 2, 1)

    def ends(self, scheme: Coefficients) -> tuple[Indices, Array]:
        """Return indices and weights (nx, terms, N) of the states at the ends of all intervals."""
        kept = np.flatnonzero(scheme.ends)
        columns = self.carrying[:, kept]
        return columns, np.broadcast_to(scheme.ends[kept, None], columns.shape)


class Layout(NamedTuple):
    """Order of the unknowns, by time within each phase.

        w = [x_0, (u_1, (x, z)_11 ... (x, z)_1d, extra_1), x_1, ..., x_N, T] for each phase,
            chosen parameters, largest cost

    Attributes:
        spans: indices of the unknowns of each phase of each scenario.
        chosen: indices of the chosen parameters.
        largest: index of the bound of all costs if the largest cost is minimised, otherwise -1.
        size: number of unknowns.
    """

    spans: tuple[SpanLayout, ...]
    chosen: Indices
    largest: int
    size: int


def lay_out(
    problem: Problem, degree: int, intervals: Sequence[int], extra: Sequence[int]
) -> Layout:
    """Return the indices of all unknowns in one vector, ordered by phase and interval.

    Args:
        problem: the problem.
        degree: number of collocation points of an interval.
        intervals: number of intervals of each phase.
        extra: number of additional unknowns of an interval of each phase.
    """
    spans: list[SpanLayout] = []
    first, phases = 0, len(problem.chain)
    for number, (span, N, more) in enumerate(zip(problem.spans, intervals, extra, strict=True)):
        model, alike = span.model, spans[number % phases] if number >= phases else None
        nx, nz, nu = len(model.x), len(model.z), len(model.u)
        shared = [i for i, v in enumerate(model.u) if alike and v.name in problem.shared_inputs]
        own = [i for i in range(nu) if i not in shared]
        after = len(own) + degree * (nx + nz)
        starts = first + nx + (after + more + nx) * np.arange(N)

        def at(offset: int, count: int, starts: Indices = starts) -> Indices:
            return offset + np.arange(count)[:, None] + starts[None, :]

        points = (starts[:, None] + len(own) + (nx + nz) * np.arange(degree)).ravel()
        nodes = np.hstack([first + np.arange(nx)[:, None], at(after + more, nx)])
        u = np.empty((nu, N), np.int64)
        u[own] = at(0, len(own))
        first += nodes.shape[1] * nx + N * (after + more)
        duration = first if isinstance(span.T, Free) else -1
        if alike:
            u[shared], duration = alike.u[shared], alike.T
        else:
            first += duration >= 0
        inner, z = at(0, nx, points), at(nx, nz, points)
        spans.append(SpanLayout(duration, nodes, inner, z, u, at(after, more)))
    chosen = first + np.arange(len(problem.chosen))
    first, worst = first + chosen.size, problem.kind == "worst"
    return Layout(tuple(spans), chosen, first if worst else -1, first + worst)


def time_scale(span: Span) -> float:
    """Return the magnitude of a free duration [s]; 1 for a fixed one."""
    return span.T.start if isinstance(span.T, Free) else 1.0


def scale_of(problem: Problem, layout: Layout) -> Array:
    """Return SI values of the unknowns divided by w, shape (n,)."""
    scale = np.ones(layout.size)
    for span, own in zip(problem.spans, layout.spans, strict=True):
        for letter, columns in (("x", own.nodes), ("x", own.inner), ("z", own.z), ("u", own.u)):
            scale[columns] = span.model.nominal(letter)[:, None]
        if own.T >= 0:
            scale[own.T] = time_scale(span)
    scale[layout.chosen] = [choice.nominal for choice in problem.chosen]
    return scale


class Data(NamedTuple):
    """Parameters of the program that belong to one phase, MX.

    Attributes:
        p: parameters of the model, (n_p, 1).
        T: duration [s] if it is fixed.
        before: total fixed duration of the previous phases [s].
        mesh: fractions of T that bound the intervals, (N + 1, 1).
    """

    p: ca.MX
    T: ca.MX
    before: ca.MX
    mesh: ca.MX

    def theta(self, interval: Indices, offset: Array, weights: Array | None = None) -> ca.MX:
        """Return theta of `LocalUnknowns` at fractions `offset` of each `interval`, (k, places).

        `weights` are quadrature weights for an interval of length 1, by default zeros.
        """
        places = interval.size
        weights = np.zeros(places) if weights is None else weights
        start = self.mesh[interval.tolist()].T
        h = self.mesh[(interval + 1).tolist()].T - start
        common = ca.repmat(ca.vertcat(self.p, self.T, self.before), 1, places)
        return ca.vertcat(common, h, start + ca.DM(offset).T * h, ca.DM(weights).T * h)


class Grid(NamedTuple):
    """Common data of all pieces of a program.

    Attributes:
        layout: places of the unknowns.
        scheme: coefficients on an interval.
        data: parameters of each phase.
        nodes: for each phase, fraction of T with conditions -> index of its node.
        released: for each phase, fraction of T -> state that follows from others -> its range.
    """

    layout: Layout
    scheme: Coefficients
    data: Sequence[Data]
    nodes: Sequence[Mapping[float, int]]
    released: Sequence[Mapping[float, Mapping[int, Box]]]


def data_of(problem: Problem, p: ca.MX, intervals: Sequence[int]) -> list[Data]:
    """Return the parameters of each phase, which are parts of p = [p, T, mesh] of each phase."""
    data: list[Data] = []
    first, before = 0, ca.MX(0)
    for number, (span, N) in enumerate(zip(problem.spans, intervals, strict=True)):
        n = first + len(span.model.p)
        before = before if number % len(problem.chain) else ca.MX(0)
        data.append(Data(p[first:n], p[n], before, p[n + 1 : n + N + 2]))
        before = before if isinstance(span.T, Free) else before + p[n]
        first = n + N + 2
    return data


Columns = Indices | tuple[Indices, Array]
"""Columns (k, places), or columns and weights (k, terms, places); see `blocks.select`."""


@final
@dataclass(frozen=True, eq=False)
class LocalUnknowns:
    """Local unknowns v and parameters theta of a phase at one time, as SX symbols.

        v = (x, z, u, T if free, free time before, chosen p),  scaled except the time before
        theta = (p, T, fixed time before, length h of the interval and place as fractions of T,
                 quadrature weight)

    Attributes:
        number: index of the phase.
        span: the phase.
        before: indices and spans of the previous phases of the same scenario.
        choices: name -> magnitude of all chosen parameters of the problem.
        inner: True if the scheme has collocation points, and thus algebraic variables.
    """

    number: int
    span: Span
    before: tuple[tuple[int, Span], ...]
    choices: Mapping[str, float]
    inner: bool = True

    @cached_property
    def free_before(self) -> list[tuple[int, Span]]:
        """Previous phases with a free duration."""
        return [(i, span) for i, span in self.before if isinstance(span.T, Free)]

    @property
    def free(self) -> bool:
        """True if the duration is free."""
        return isinstance(self.span.T, Free)

    @cached_property
    def symbols(self) -> dict[str, ca.SX]:
        """Symbols by name: x, z, u, the rest of v ("rest"), and theta."""
        model = self.span.model
        rest = self.free + bool(self.free_before) + len(self.span.chosen)
        sizes = {"x": len(model.x), "z": len(model.z) if self.inner else 0, "u": len(model.u)}
        sizes |= {"rest": rest, "theta": len(model.p) + 5}
        return {name: ca.SX.sym(name, size) for name, size in sizes.items()}

    @property
    def theta(self) -> ca.SX:
        """Local parameters, SX (k, 1)."""
        return self.symbols["theta"]

    @property
    def v(self) -> ca.SX:
        """All local unknowns, SX (n, 1)."""
        return ca.vertcat(*(self.symbols[name] for name in ("x", "z", "u", "rest")))

    @property
    def T(self) -> ca.SX:
        """Duration [s]."""
        return self.symbols["rest"][0] * time_scale(self.span) if self.free else self.theta[-5]

    @property
    def h(self) -> ca.SX:
        """Length of the interval [s]."""
        return self.theta[-3] * self.T

    @property
    def weight(self) -> ca.SX:
        """Quadrature weight of the point [s]."""
        return self.theta[-1] * self.T

    @cached_property
    def values(self) -> list[ca.SX]:
        """Arguments [t, x, z, u, p] of Functions of the model, in SI units."""
        model, chosen, symbols = self.span.model, self.span.chosen, self.symbols
        rest, theta = symbols["rest"], symbols["theta"]
        t = theta[-4] + theta[-2] * self.T
        t = t + rest[int(self.free)] if self.free_before else t
        x, u = (symbols[letter] * ca.DM(model.nominal(letter)) for letter in "xu")
        z = symbols["z"] * ca.DM(model.nominal("z")) if self.inner else ca.SX.zeros(len(model.z))
        first = rest.numel() - len(chosen)
        p = stacked(
            rest[first + chosen.index(v.name)] * self.choices[v.name]
            if v.name in chosen
            else theta[i]
            for i, v in enumerate(model.p)
        )
        return [t, x, z, u, p]

    def columns(self, layout: Layout, x: Columns, z: Columns, u: Indices) -> list[Columns]:
        """Return the parts of v for `blocks.select`, with given columns of x, z and u."""
        places = u.shape[1]
        parts: list[Columns] = [x, z, u] if self.inner else [x, u]
        if self.free:
            parts.append(np.full((1, places), layout.spans[self.number].T))
        if self.free_before:
            earlier = np.array([layout.spans[i].T for i, _ in self.free_before])
            scales = np.array([initial(span.T) for _, span in self.free_before])
            times, factors = (np.tile(a[None, :, None], places) for a in (earlier, scales))
            parts.append((times, factors))
        if self.span.chosen:
            names = list(self.choices)
            rows = layout.chosen[[names.index(name) for name in self.span.chosen]]
            parts.append(np.tile(rows[:, None], (1, places)))
        return parts

    def piece(
        self,
        grid: Grid,
        rows: Rows,
        made: RowBlock,
        columns: tuple[Columns, Columns, Indices],
        at: tuple[Indices, Array],
        order: Indices,
        *,
        extra: Sequence[Columns] = (),
        weights: Array | None = None,
        linear: ConstantEntries | None = None,
    ) -> Piece:
        """Return the piece of a block of these local unknowns.

        Args:
            grid: common data of the program.
            rows: names, sizes and ranges of the rows of the block.
            made: the block.
            columns: columns of x, z and u at all places.
            at: interval and offset of each place.
            order: order of the rows; see `Piece.order_of`.
            extra: columns of further local unknowns of the block, which follow v.
            weights: quadrature weights of the places for an interval of length 1.
            linear: linear part of the rows.
        """
        interval, offset = at
        parts = [*self.columns(grid.layout, *columns), *extra]
        return Piece(
            rows=rows,
            order=order,
            span=self.number,
            interval=interval,
            offset=offset,
            block=made,
            selection=select(parts, interval.size),
            theta=grid.data[self.number].theta(interval, offset, weights),
            linear=linear,
        )
