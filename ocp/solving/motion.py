"""Motions as named signals over time, and their values at any time."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ocp.formulation.phase import Array, Span
from ocp.formulation.problem import Posed, Problem
from ocp.transcription.schemes import Coefficients, Scheme
from ocp.transcription.unknowns import SpanPoints, Values
from symfric.foundation.files import json_data
from symfric.foundation.parameters import check_names
from symfric.foundation.storable import agree

SAME = 1e-6
"""Difference, in multiples of the nominal value, up to which a state is continuous at a joint."""
SAME_TIME = 1e-9
"""Difference of equal times, relative to the total duration."""


@final
@dataclass(frozen=True)
class Stretch:
    """Name, start time and duration of a phase.

    Attributes:
        name: name of the phase.
        begin: start time [s].
        T: duration [s].
    """

    name: str
    begin: float
    T: float

    @property
    def end(self) -> float:
        """End time [s]."""
        return self.begin + self.T


@final
@dataclass(frozen=True, eq=False, repr=False)
class ScenarioMotion:
    """Motion of one scenario.

    `motion["v"]` is a signal at the times `motion.t`.

    Attributes:
        name: name of the scenario; empty for a problem without scenarios.
        t: times [s], shape (n,): nodes of the mesh and collocation points. If a state jumps
            from one phase to the next, the time of the joint appears twice.
        signals: name -> values, shape (n,): states, algebraic variables, inputs and outputs; NaN in
            phases whose model does not have them. Inputs are constant from each time to the next.
        units: name -> unit.
        nodes: mask of times that are nodes of the mesh.
        t_control: start of each interval [s], shape (N,).
        controls: input -> value on each interval, shape (N,).
        phases: name, start time and duration of each phase.
        spans: indices of the phases among `problem.spans`.
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
        """Raise an error if a file contains signals that do not match the times."""
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
        """Total duration of all phases [s]."""
        return self.phases[-1].end - self.phases[0].begin

    def to_dict(self) -> dict[str, Any]:
        """Return times and signals as plain data, with None for numbers that are not finite."""
        signals = {name: row.tolist() for name, row in self.signals.items()}
        return json_data({"scenario": self.name, "t": self.t.tolist(), "signals": signals})

    def __getitem__(self, name: str) -> Array:
        if name == "t":
            return self.t
        check_names("solution", [name], self.signals)
        return self.signals[name]


class _Piece(NamedTuple):
    """Signals of one phase."""

    t: Array
    nodes: NDArray[np.bool_]
    values: dict[str, Array]
    edges: Array
    controls: dict[str, Array]


def motions_of(
    problem: Problem, meshes: Sequence[Array], scheme: Coefficients, points: Values
) -> tuple[ScenarioMotion, ...]:
    """Return the motion of each scenario.

    Args:
        problem: the problem.
        meshes: mesh of each span.
        scheme: coefficients of the scheme.
        points: values of all unknowns.
    """
    phases = len(problem.chain)
    return tuple(
        _motion(name, problem, range(k * phases, (k + 1) * phases), meshes, scheme, points)
        for k, name in enumerate(problem.scenario_names or ("",))
    )


def _motion(
    name: str, problem: Problem, numbers: Sequence[int], meshes: Sequence[Array],
    scheme: Coefficients, points: Values,
) -> ScenarioMotion:  # fmt: skip
    spans, own = [problem.spans[k] for k in numbers], [points.spans[k] for k in numbers]
    pieces: list[_Piece] = []
    phases: list[Stretch] = []
    for k, span in enumerate(spans):
        begin = phases[-1].end if phases else 0.0
        pieces.append(_piece(span, own[k], meshes[numbers[k]], scheme, points.chosen, begin))
        phases.append(Stretch(span.name, begin, own[k].T))
    units: dict[str, str] = {}
    for span in spans:
        units = span.model.signals | units  # the units of the first phase take precedence
    names = dict.fromkeys(name for span in spans for name in span.model.signals)
    inputs = dict.fromkeys(v.name for span in spans for v in span.model.u)
    several = joined(spans, own, [p.values | {"": p.nodes, "t": p.t} for p in pieces])

    def control(name: str) -> Array:
        none = [np.full(p.edges.size - 1, np.nan) for p in pieces]
        return np.concatenate([p.controls.get(name, n) for p, n in zip(pieces, none, strict=True)])

    return ScenarioMotion(
        name=name,
        t=several["t"],
        signals={name: several[name] for name in names},
        units={name: units[name] for name in names},
        nodes=several[""],
        t_control=np.concatenate([p.edges[:-1] for p in pieces]),
        controls={name: control(name) for name in inputs},
        phases=tuple(phases),
        spans=tuple(numbers),
    )


def joined(
    spans: Sequence[Span], points: Sequence[SpanPoints], values: Sequence[Mapping[str, Any]]
) -> dict[str, NDArray[Any]]:
    """Return values by name over consecutive phases, NaN in phases without the name.

    A time at which no state jumps appears once, with the values of the later phase.
    """
    kept = [next(iter(own.values())).size for own in values]
    for k in range(len(spans) - 1):
        kept[k] -= not _jumps(spans[k], points[k], spans[k + 1], points[k + 1])
    pairs = [*zip(values, kept, strict=True)]
    return {
        name: np.concatenate([v[name][:n] if name in v else np.full(n, np.nan) for v, n in pairs])
        for name in dict.fromkeys(name for own in values for name in own)
    }


def at_times(motion: ScenarioMotion, times: Array, series: Mapping[str, Array]) -> dict[str, Array]:
    """Return values by name, given at `times` that include those of `motion`, at its times."""
    if times.size == motion.t.size:
        return dict(series)
    at = np.searchsorted(times, motion.t + SAME_TIME * motion.T, side="right") - 1
    return {name: row[at] for name, row in series.items()}


def _jumps(before: Span, old: SpanPoints, after: Span, new: SpanPoints) -> bool:
    """Return True if a state jumps at the joint of two phases, or if their states differ."""
    if [v.name for v in before.model.x] != [v.name for v in after.model.x]:
        return True
    gap = np.abs(new.nodes[:, 0] - old.nodes[:, -1])
    return bool((gap > SAME * after.model.nominal("x")).any())


class PhaseValues(NamedTuple):
    """Values of a phase at its nodes and collocation points in the order of time.

    Attributes:
        fractions: fractions of T, shape (n,).
        nodes: mask of nodes of the mesh.
        x, z, u: states, algebraic variables and inputs, shapes (nx, n), (nz, n) and (nu, n).
    """

    fractions: Array
    nodes: NDArray[np.bool_]
    x: Array
    z: Array
    u: Array


def sampled(points: SpanPoints, mesh: Array, scheme: Coefficients) -> PhaseValues:
    """Return the values of `points` at the times of a `ScenarioMotion`."""
    N, d = mesh.size - 1, scheme.degree
    inside = scheme.nodes[1:-1] if d and scheme.meets_end else scheme.nodes[1:]
    shown = inside.size
    fractions = (mesh[:-1, None] + np.diff(mesh)[:, None] * np.append(0.0, inside)).ravel()

    def together(nodes: Array, inner: Array) -> Array:
        blocks = inner.reshape(nodes.shape[0], N, d)[:, :, :shown]
        held = np.concatenate([nodes[:, :-1, None], blocks], axis=2)
        return np.column_stack([held.reshape(nodes.shape[0], N * (shown + 1)), nodes[:, -1]])

    # z at a node is the value at the end of the previous interval; shooting does not provide it
    z = np.full((points.z.shape[0], N + 1), np.nan)
    if d:
        blocks = points.z.reshape(points.z.shape[0], N, d)
        z = np.column_stack([blocks[:, 0, 0], blocks @ scheme.inner_ends])
    at = np.arange(fractions.size + 1)
    return PhaseValues(
        np.append(fractions, 1.0),
        at % (shown + 1) == 0,
        together(points.nodes, points.inner),
        together(z, points.z),
        points.u[:, np.minimum(at // (shown + 1), N - 1)],
    )


def _piece(
    span: Span, points: SpanPoints, mesh: Array, scheme: Coefficients,
    chosen: Mapping[str, float], begin: float,
) -> _Piece:  # fmt: skip
    """Return the signals of one phase at its nodes and collocation points."""
    model, at = span.model, sampled(points, mesh, scheme)
    t, n = begin + points.T * at.fractions, at.fractions.size
    p = np.array([chosen.get(v.name, number) for v, number in zip(model.p, span.p, strict=True)])
    signals, p = model.function("signals").map(n), np.tile(p[:, None], (1, n))
    rows = signals(t[None, :], at.x, at.z, at.u, p).full()
    values = dict(zip(model.signals, rows, strict=True))
    controls = {v.name: row for v, row in zip(model.u, points.u, strict=True)}
    return _Piece(t, at.nodes, values, begin + points.T * mesh, controls)


def along_points(
    span: Span, at: SpanPoints, column: ca.SX, *, starts: bool = False,
    t: Array | float = 0.0, p: Array | None = None,
) -> Array:  # fmt: skip
    """Return `column` at the collocation points, or at the starts of intervals, (rows, points).

    Without collocation points (shooting) the values are those at the starts. `t` are the times, and
    `p` the values of the parameters, by default those of `span`.
    """
    N, inner = at.u.shape[1], at.inner.shape[1]
    x, n = (at.nodes[:, :-1], N) if starts or not inner else (at.inner, inner)
    z = at.z[:, :: at.z.shape[1] // n] if at.z.size else np.zeros((at.z.shape[0], n))
    u, p = np.repeat(at.u, n // N, axis=1), np.tile((span.p if p is None else p)[:, None], (1, n))
    function = ca.Function("along", span.symbols, [ca.densify(column)]).map(n)
    return function(np.broadcast_to(t, (1, n)), x, z, u, p).full()


class SpanMotion(NamedTuple):
    """Motion of a phase, with signals at any time.

    Attributes:
        span: the phase.
        mesh: fractions of T that bound the intervals, shape (N + 1,).
        nodes: start and collocation points of the interval [0, 1], shape (d + 1,).
        points: values of the unknowns.
    """

    span: Span
    mesh: Array
    nodes: Array
    points: SpanPoints

    def at(self, name: str, fractions: Array) -> Array | None:
        """Return a signal at fractions of T, or None if the phase does not have it.

        States are evaluated by the polynomial of the interval. Algebraic variables are interpolated
        linearly between collocation points. Inputs are constant on each interval.
        """
        x, z, u = ([v.name for v in getattr(self.span.model, letter)] for letter in "xzu")
        interval = np.searchsorted(self.mesh, fractions, side="right") - 1
        interval = np.clip(interval, 0, self.mesh.size - 2)
        if name in x:
            return self._state(x.index(name), fractions, interval)
        if name in z and self.nodes.size > 1:
            inner = self.mesh[:-1, None] + np.diff(self.mesh)[:, None] * self.nodes[1:]
            return np.interp(fractions, inner.ravel(), self.points.z[z.index(name)])
        return self.points.u[u.index(name)][interval] if name in u else None

    def _state(self, i: int, fractions: Array, k: NDArray[np.intp]) -> Array:
        nodes = self.points.nodes[i]
        s = (fractions - self.mesh[k]) / np.diff(self.mesh)[k]
        if self.nodes.size == 1:  # shooting provides no values inside an interval
            return (1 - s) * nodes[k] + s * nodes[k + 1]
        weights = np.ones((self.nodes.size, s.size))
        for i_node, node in enumerate(self.nodes):
            for j, other in enumerate(self.nodes):
                if i_node != j:
                    weights[i_node] *= (s - other) / (node - other)
        inner = self.points.inner[i].reshape(self.mesh.size - 1, -1)
        values = np.einsum("is,si->s", weights, np.column_stack([nodes[:-1], inner])[k])
        return np.where(fractions >= 1.0, nodes[-1], values)


def span_motions(
    problem: Problem | Posed, scheme: Scheme, meshes: Sequence[Array], points: Values
) -> list[SpanMotion]:
    """Return the motions of all phases and scenarios."""
    nodes = scheme.coefficients().nodes
    every = zip(problem.spans, meshes, points.spans, strict=True)
    return [SpanMotion(span, mesh, nodes, values) for span, mesh, values in every]


def along(spans: Sequence[SpanMotion], name: str, fractions: Array) -> Array | None:
    """Return a signal at fractions of the total duration, or None if a phase does not have it."""
    ends = np.cumsum([span.points.T for span in spans])
    times = fractions * ends[-1]
    which = np.minimum(np.searchsorted(ends, times, side="right"), len(spans) - 1)
    signal = np.zeros(fractions.size)
    for k in np.unique(which):
        span, here = spans[k], which == k
        begin, T = ends[k] - span.points.T, span.points.T
        values = span.at(name, np.clip((times[here] - begin) / T, 0.0, 1.0))
        if values is None:
            return None
        signal[here] = values
    return signal


def structure_of(problem: Problem | Posed, scheme: Scheme) -> str:
    """Return a text that identifies the unknowns and rows of a program on a given mesh."""

    def described(span: Span) -> list[Any]:
        groups = [[v.name for v in group] for group in (span.model.x, span.model.z, span.model.u)]
        rows = [[s, [row.name for row in rows]] for s, rows in span.rows_at.items()]
        names = [[row.name for row in part] for part in (span.path, span.joins, span.penalised)]
        states, fixed = [link.state for link in span.links], isinstance(span.T, float | int)
        return [span.scenario, span.phase, fixed, groups, names, rows, states]

    spans = [*map(described, problem.spans)]
    more = [list(problem.choose), list(problem.periodic), problem.kind, len(problem.durations)]
    return json.dumps([repr(scheme), spans, more, list(problem.shared_inputs)])
