"""What a warm start needs: named values, free of models and meshes."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import NDArray

from ocp.formulation.problem import Problem
from ocp.solvers.outcome import Iterate
from ocp.transcription.schemes import Scheme
from ocp.transcription.unknowns import Points

Array = NDArray[np.float64]


@final
@dataclass(frozen=True, eq=False)
class StoredSpan:
    """One phase of one scenario.

    Attributes:
        scenario, phase: their numbers.
        T: duration [s].
        mesh: fractions of T that bound the intervals, shape (N + 1,).
        nodes: where the collocation points of an interval are, start included, shape (d + 1,).
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
        """A signal at fractions of T; None where there is none of this name.

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
        if self.nodes.size == 1:  # shooting: nothing is known inside of an interval
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
        status, message, cost: how it ended.
        structure: of the nonlinear program; where it and all meshes are the same, the multipliers
            of `iterate` are used, too.
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
    """A signal at fractions of the whole duration of some phases; None where one lacks it."""
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
    """The spans of a solution by name."""
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
    """A text that is the same for programs with the same unknowns and rows on the same mesh."""
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
