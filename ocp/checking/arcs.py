"""What was optimised, as numbers that a simulation takes: one arc for each span."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import final

import numpy as np
from numpy.typing import NDArray

from ocp.formulation.phase import Span
from ocp.formulation.problem import Problem
from ocp.transcription.unknowns import Points

Array = NDArray[np.float64]

REST = 1e-3
"""A state that moves less than this many times its nominal value is as good as at rest."""


@final
@dataclass(frozen=True, eq=False)
class Arc:
    """The optimised motion of one span.

    Attributes:
        number: of the span in its problem.
        span: what was asked for.
        begin: its start since that of the problem [s].
        T: duration [s].
        mesh: fractions of T that bound the intervals, shape (N + 1,).
        nodes: states there, shape (nx, N + 1).
        u: inputs, held on each interval, shape (nu, N).
        p: parameters of the model, chosen ones as they were chosen, shape (n_p,).
    """

    number: int
    span: Span
    begin: float
    T: float
    mesh: Array
    nodes: Array
    u: Array
    p: Array

    @property
    def end(self) -> float:
        """Its last time [s]."""
        return self.begin + self.T

    @property
    def intervals(self) -> int:
        """Their number N."""
        return self.mesh.size - 1

    @cached_property
    def times(self) -> Array:
        """When the nodes are [s], shape (N + 1,)."""
        times = self.begin + self.T * self.mesh
        times[-1] = self.end
        return times

    @cached_property
    def sizes(self) -> Array:
        """Largest magnitude of each state on its way, at least `REST` nominal, shape (nx,)."""
        largest = np.abs(self.nodes).max(axis=1, initial=0.0)
        return np.maximum(largest, REST * self.span.model.nominal("x"))

    def state(self, node: int) -> dict[str, float]:
        """States at a node by name."""
        values = self.nodes[:, node].tolist()
        return {v.name: x for v, x in zip(self.span.model.x, values, strict=True)}

    def parameters(self) -> dict[str, float]:
        """Parameters by name; one that a solver has put a rounding error outside stands inside."""
        return {
            v.name: min(max(float(x), v.lower), v.upper)
            for v, x in zip(self.span.model.p, self.p, strict=True)
        }


def arcs_of(problem: Problem, meshes: Sequence[Array], points: Points) -> tuple[Arc, ...]:
    """The arcs of what a solver found, in the order of `problem.spans`."""
    found: list[Arc] = []
    for number, (span, mesh, own) in enumerate(
        zip(problem.spans, meshes, points.spans, strict=True)
    ):
        begin = found[-1].end if span.phase else 0.0
        p = _chosen(span, points.chosen)
        found.append(
            Arc(
                number=number,
                span=span,
                begin=begin,
                T=own.T,
                mesh=np.asarray(mesh),
                nodes=own.nodes,
                u=own.u,
                p=p,
            )
        )
    return tuple(found)


def _chosen(span: Span, chosen: Mapping[str, float]) -> Array:
    """Parameters of the model, with those that were chosen."""
    taken = {name: chosen[name] for name in span.chosen if name in chosen}
    return np.array(
        [taken.get(v.name, x) for v, x in zip(span.model.p, span.p, strict=True)], dtype=float
    )
