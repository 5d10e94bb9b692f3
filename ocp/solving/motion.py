"""Motions of one scenario by name: signals over time, and values for a warm start."""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from ocp.formulation.phase import Span
from ocp.formulation.problem import Problem
from ocp.transcription.program import Iterate
from ocp.transcription.schemes import Coefficients, Scheme
from ocp.transcription.unknowns import Points, SpanPoints
from symfric.foundation.parameters import check_names
from symfric.foundation.storable import agree

Array = NDArray[np.float64]

SAME = 1e-6
"""Multiples of the nominal value by which a state may differ at a continuous joint."""


@final
@dataclass(frozen=True)
class Stretch:
    """Begin and duration of a phase.

    Attributes:
        name: of the phase.
        begin: its start [s].
        T: its duration [s].
    """

    name: str
    begin: float
    T: float

    @property
    def end(self) -> float:
        """Time at its end [s]."""
        return self.begin + self.T


@final
@dataclass(frozen=True, eq=False, repr=False)
class Motion:
    """Motion of one scenario.

    `motion["v"]` is a signal at the times `motion.t`.

    Attributes:
        name: of the scenario, empty if there is only one motion.
        t: times [s], shape (n,): nodes of the mesh and collocation points. If a state jumps
            from one phase to the next, the time of the joint appears twice.
        signals: name -> values, shape (n,): states, algebraic variables, inputs, outputs; NaN in
            phases that do not have them. An input is the value from this time on.
        units: name -> unit.
        nodes: mask of times that are nodes of the mesh.
        t_control: start of each interval [s], shape (N,).
        controls: input -> value held from there to the next one, shape (N,).
        phases: begin and duration of each.
        spans: their indices among the phases of the problem, over all scenarios.
    """

    name: str
    t: Array
    signals: dict[str, Array]
    units: dict[str, str]
    nodes: NDArray[np.bool_]
    t_control: Array
    controls: dict[str, Array]
    phases: tuple[Stretch, ...]
    spans: tuple[int, ...]

    def check_fields(self) -> None:
        """Raise an error for signals that do not match the times; for files."""
        agree(
            "Motion",
            self.t.ndim == self.t_control.ndim == 1,
            all(v.shape == self.t.shape for v in (self.nodes, *self.signals.values())),
            all(v.shape == self.t_control.shape for v in self.controls.values()),
            self.signals.keys() <= self.units.keys(),
            len(self.phases) == len(self.spans),
        )

    def __repr__(self) -> str:
        named = f" of scenario '{self.name}'" if self.name else ""
        return f"<Motion{named}: {', '.join(self.signals)} over {self.T:.6g} s>"

    @property
    def T(self) -> float:
        """Duration of all phases [s]."""
        return self.phases[-1].end - self.phases[0].begin

    def __getitem__(self, name: str) -> Array:
        if name == "t":
            return self.t
        check_names("solution", [name], self.signals)
        return self.signals[name]


@final
@dataclass(frozen=True, eq=False)
class _Piece:
    """Signals of one phase."""

    t: Array
    nodes: NDArray[np.bool_]
    values: dict[str, Array]
    edges: Array
    controls: dict[str, Array]
    jumps: bool


def motion_of(
    name: str,
    spans: Sequence[tuple[int, Span]],
    points: Sequence[SpanPoints],
    meshes: Sequence[Array],
    scheme: Coefficients,
    chosen: Mapping[str, float],
) -> Motion:
    """Return the motion of one scenario.

    Args:
        name: of the scenario.
        spans: its spans with their numbers, in order.
        points, meshes: of each of these spans.
        scheme: the collocation points.
        chosen: values of the chosen parameters.
    """
    pieces: list[_Piece] = []
    phases: list[Stretch] = []
    begin = 0.0
    for k, (_, span) in enumerate(spans):
        before = (spans[k - 1][1], points[k - 1]) if k else None
        jumps = before is not None and _jumps(*before, span, points[k])
        pieces.append(_piece(span, points[k], meshes[k], scheme, chosen, begin, jumps))
        phases.append(Stretch(span.name, begin, points[k].T))
        begin += points[k].T
    units: dict[str, str] = {}
    for _, span in spans:
        units = span.model.signals | units  # the names of the first phase come first
    ordered = list(dict.fromkeys(name for _, span in spans for name in span.model.signals))
    inputs = list(dict.fromkeys(v.name for _, span in spans for v in span.model.u))
    ends = [piece.t.size - int(k + 1 < len(pieces) and not pieces[k + 1].jumps)
            for k, piece in enumerate(pieces)]  # fmt: skip

    def joined(of: Callable[[_Piece], NDArray[Any]]) -> NDArray[Any]:
        return np.concatenate([of(p)[:n] for p, n in zip(pieces, ends, strict=True)])

    def signal(name: str) -> Array:
        return joined(lambda p: p.values.get(name, np.full(p.t.size, np.nan)))

    def control(name: str) -> Array:
        none = [np.full(p.edges.size - 1, np.nan) for p in pieces]
        return np.concatenate([p.controls.get(name, n) for p, n in zip(pieces, none, strict=True)])

    return Motion(
        name=name,
        t=joined(lambda p: p.t),
        signals={name: signal(name) for name in ordered},
        units={name: units[name] for name in ordered},
        nodes=joined(lambda p: p.nodes),
        t_control=np.concatenate([p.edges[:-1] for p in pieces]),
        controls={name: control(name) for name in inputs},
        phases=tuple(phases),
        spans=tuple(number for number, _ in spans),
    )


def _jumps(before: Span, old: SpanPoints, after: Span, new: SpanPoints) -> bool:
    """True if a state jumps at the joint, or is not in both phases."""
    there = {v.name: k for k, v in enumerate(before.model.x)}
    if [*there] != [v.name for v in after.model.x]:
        return True
    gap = np.abs(new.nodes[:, 0] - old.nodes[:, -1])
    return bool((gap > SAME * after.model.nominal("x")).any())


def _piece(
    span: Span,
    points: SpanPoints,
    mesh: Array,
    scheme: Coefficients,
    chosen: Mapping[str, float],
    begin: float,
    jumps: bool,
) -> _Piece:
    """Return signals at the nodes and collocation points of one phase."""
    model, N = span.model, mesh.size - 1
    inside = scheme.nodes[1:-1] if scheme.degree and scheme.meets_end else scheme.nodes[1:]
    shown = inside.size
    fractions = mesh[:-1, None] + np.diff(mesh)[:, None] * np.append(0.0, inside)
    at = begin + points.T * np.append(fractions.ravel(), 1.0)
    d = scheme.degree

    def joined(nodes: Array, inner: Array) -> Array:
        """Return columns in the order of time."""
        blocks = inner.reshape(nodes.shape[0], N, d)[:, :, :shown]
        held = np.concatenate([nodes[:, :-1, None], blocks], axis=2)
        return np.column_stack([held.reshape(nodes.shape[0], N * (shown + 1)), nodes[:, -1]])

    x = joined(points.nodes, points.inner)
    z = joined(_at_nodes(points.z, N, scheme), points.z)
    held = points.u[:, np.minimum(np.arange(at.size) // (shown + 1), N - 1)]
    p = np.array([chosen.get(v.name, number) for v, number in zip(model.p, span.p, strict=True)])
    values = model.function("signals").map(at.size)(
        at[None, :], x, z, held, np.tile(p[:, None], (1, at.size))
    )
    return _Piece(
        at,
        np.arange(at.size) % (shown + 1) == 0,
        dict(zip(model.signals, values.full(), strict=True)),
        begin + points.T * mesh,
        {v.name: row for v, row in zip(model.u, points.u, strict=True)},
        jumps,
    )


def _at_nodes(z: Array, intervals: int, scheme: Coefficients) -> Array:
    """Return algebraic variables at the nodes: at the end of the previous interval, first at 0.

    NaN for shooting, which does not compute them.
    """
    if not scheme.degree:
        return np.full((z.shape[0], intervals + 1), np.nan)
    blocks = z.reshape(z.shape[0], intervals, scheme.degree)
    return np.column_stack([blocks[:, 0, 0], blocks @ scheme.inner_ends])


Array = NDArray[np.float64]


@final
@dataclass(frozen=True, eq=False)
class StoredSpan:
    """A phase of a scenario.

    Attributes:
        scenario, phase: their numbers.
        T: duration [s].
        mesh: fractions of T that bound the intervals, shape (N + 1,).
        nodes: collocation points of an interval, start included, shape (d + 1,).
        x: state -> values at the start and the collocation points of each interval, shape
            (N, d + 1).
        x_end: state -> value at the end.
        z: algebraic variable -> values at the collocation points, shape (N, d).
        u: input -> value of each interval, shape (N,).
    """

    scenario: int
    phase: int
    T: float
    mesh: Array
    nodes: Array
    x: Mapping[str, Array]
    x_end: Mapping[str, float]
    z: Mapping[str, Array]
    u: Mapping[str, Array]

    def at(self, name: str, fractions: Array) -> Array | None:
        """Return a signal at fractions of T; None without a signal of this name.

        A state is the polynomial of its interval, an algebraic variable is interpolated between
        the collocation points, an input is held.
        """
        if name in self.x:
            return self._state(name, fractions)
        if name in self.z and self.nodes.size > 1:
            inner = self.mesh[:-1, None] + np.diff(self.mesh)[:, None] * self.nodes[1:]
            return np.interp(fractions, inner.ravel(), self.z[name].ravel())
        if name in self.u:
            return self.u[name][self._interval(fractions)]
        return None

    def _interval(self, fractions: Array) -> NDArray[np.intp]:
        found = np.searchsorted(self.mesh, fractions, side="right") - 1
        return np.clip(found, 0, self.mesh.size - 2)

    def _state(self, name: str, fractions: Array) -> Array:
        k = self._interval(fractions)
        ends = np.append(self.x[name][1:, 0], self.x_end[name])
        s = (fractions - self.mesh[k]) / np.diff(self.mesh)[k]
        if self.nodes.size == 1:  # shooting: values inside an interval are unknown
            return (1 - s) * self.x[name][k, 0] + s * ends[k]
        weights = np.ones((self.nodes.size, s.size))
        for i, node in enumerate(self.nodes):
            for j, other in enumerate(self.nodes):
                if i != j:
                    weights[i] *= (s - other) / (node - other)
        values = np.einsum("is,si->s", weights, self.x[name][k])
        return np.where(fractions >= 1.0, ends[-1], values)


@final
@dataclass(frozen=True, eq=False, repr=False)
class Stored:
    """A solution as a start for others, on any mesh and for any model with some of its names.

    Attributes:
        name: of the problem.
        status, message, cost: of the end.
        structure: of the nonlinear program; if it and all meshes are the same, the multipliers of
            `iterate` are also used.
        spans: one for each phase and scenario.
        chosen: values of chosen parameters.
        iterate: unknowns and multipliers, scaled.
    """

    name: str
    status: str
    message: str
    cost: float
    structure: str
    spans: tuple[StoredSpan, ...]
    chosen: Mapping[str, float]
    iterate: Iterate

    def __repr__(self) -> str:
        return f"<Stored solution of '{self.name}': {self.status}, J = {self.cost:.6g}>"


def along(spans: Sequence[StoredSpan], name: str, fractions: Array) -> Array | None:
    """Return a signal at fractions of the total duration of phases; None if one lacks it."""
    ends = np.cumsum([span.T for span in spans])
    times = fractions * ends[-1]
    which = np.minimum(np.searchsorted(ends, times, side="right"), len(spans) - 1)
    found = np.zeros(fractions.size)
    for k in np.unique(which):
        span, here = spans[k], which == k
        local = np.clip((times[here] - (ends[k] - span.T)) / span.T, 0.0, 1.0)
        values = span.at(name, local)
        if values is None:
            return None
        found[here] = values
    return found


def stored_spans(
    problem: Problem, scheme: Scheme, meshes: Sequence[Array], points: Points
) -> tuple[StoredSpan, ...]:
    """Return the phases of a solution by name."""
    nodes = scheme.coefficients().nodes
    found: list[StoredSpan] = []
    for span, mesh, values in zip(problem.spans, meshes, points.spans, strict=True):
        N, d = mesh.size - 1, nodes.size - 1
        inner = values.inner.reshape(len(values.inner), N, d)
        x = np.concatenate([values.nodes[:, :-1, None], inner], axis=2)
        z = values.z.reshape(len(values.z), N, d)
        model = span.model
        found.append(
            StoredSpan(
                span.scenario,
                span.phase,
                values.T,
                mesh,
                nodes,
                {v.name: row for v, row in zip(model.x, x, strict=True)},
                {v.name: float(row[-1]) for v, row in zip(model.x, values.nodes, strict=True)},
                {v.name: row for v, row in zip(model.z, z, strict=True)},
                {v.name: row for v, row in zip(model.u, values.u, strict=True)},
            )
        )
    return tuple(found)


def structure_of(problem: Problem, scheme: Scheme) -> str:
    """Return a text that is equal for programs with equal unknowns and rows on equal meshes."""
    spans = [
        [
            span.scenario,
            span.phase,
            isinstance(span.T, float | int),
            [[v.name for v in group] for group in (span.model.x, span.model.z, span.model.u)],
            [row.name for row in span.path],
            [[s, [row.name for row in rows]] for s, rows in span.rows_at.items()],
            [link.state for link in span.links],
            [join.name for join in span.joins],
        ]
        for span in problem.spans
    ]
    more = [list(problem.choose), list(problem.periodic), problem.kind, len(problem.durations)]
    return json.dumps([repr(scheme), spans, more, list(problem.shared_inputs)])
