"""Re-simulation of the models under an optimised control, from start to end.

A `PhaseMotion` contains the data of one optimised phase that the simulation requires.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple, final

import casadi as ca
import numpy as np
from numpy.polynomial import legendre

from ocp.formulation.phase import Array, Span, clipped
from ocp.formulation.problem import Problem
from ocp.transcription.unknowns import Values
from symfric.foundation.variable import stacked
from symfric.integrator import Hold, simulate
from symfric.results.trajectory import Trajectory

REST = 1e-3
"""Magnitude of a state, in multiples of its nominal value, that counts as zero."""
RTOL = 1e-9
"""Relative tolerance of the re-simulation."""
PARTS = 4
"""Number of parts of a step in which zeros are sought."""
BISECTIONS = 40
GAUSS_POINTS, GAUSS_WEIGHTS = legendre.leggauss(4)


@final
@dataclass(frozen=True, eq=False)
class Arc:
    """Optimised motion of one phase.

    Attributes:
        number: index of the phase in its problem.
        span: model and conditions of the phase.
        begin: start time of the phase since the start of the problem [s].
        T: duration [s].
        mesh: fractions of T that bound the intervals, shape (N + 1,).
        nodes: states at the nodes of the mesh, shape (nx, N + 1).
        u: inputs, constant on each interval, shape (nu, N).
        p: parameters of the model, with chosen values, shape (n_p,).
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
    def intervals(self) -> int:
        """Number N of intervals."""
        return self.mesh.size - 1

    @cached_property
    def times(self) -> Array:
        """Times of the nodes [s], shape (N + 1,)."""
        times = self.begin + self.T * self.mesh
        times[-1] = self.begin + self.T
        return times

    @cached_property
    def sizes(self) -> Array:
        """Largest magnitude of each state in the arc, at least `REST` nominal values, (nx,)."""
        largest = np.abs(self.nodes).max(axis=1, initial=0.0)
        return np.maximum(largest, REST * self.span.model.nominal("x"))

    def state(self, node: int) -> dict[str, float]:
        """Return the states at a node by name."""
        values = self.nodes[:, node].tolist()
        return {v.name: x for v, x in zip(self.span.model.x, values, strict=True)}

    def parameters(self) -> dict[str, float]:
        """Return the parameters by name, clipped to their bounds because of rounding errors."""
        pairs = zip(self.span.model.p, self.p, strict=True)
        return {v.name: clipped(float(x), (v.lower, v.upper)) for v, x in pairs}


def arcs_of(problem: Problem, meshes: Sequence[Array], points: Values) -> tuple[Arc, ...]:
    """Return the arcs of a solver's result, in the order of `problem.spans`."""
    arcs: list[Arc] = []
    every = enumerate(zip(problem.spans, meshes, points.spans, strict=True))
    for number, (span, mesh, own) in every:
        begin = float(arcs[-1].times[-1]) if span.phase else 0.0
        chosen = {name: points.chosen[name] for name in span.chosen if name in points.chosen}
        p = [chosen.get(v.name, x) for v, x in zip(span.model.p, span.p, strict=True)]
        mesh, p = np.asarray(mesh), np.array(p, dtype=float)
        arcs.append(Arc(number, span, begin, own.T, mesh, own.nodes, own.u, p))
    return tuple(arcs)


class SimulatedArc(NamedTuple):
    """Simulated motion of an arc, or of a part of an arc.

    Attributes:
        arc: the optimised arc.
        trajectory: motion of the model; the simulation may have failed before `end`.
        end: end of the part that is used [s].
    """

    arc: Arc
    trajectory: Trajectory
    end: float

    @property
    def begin(self) -> float:
        """Start time of the simulation [s]."""
        return self.trajectory.span[0]

    @property
    def ok(self) -> bool:
        """True if the simulation reached `end`."""
        return self.trajectory.status.ok and self.trajectory.span[1] >= self.end

    @property
    def at_start(self) -> bool:
        """True if the run begins at the start of its arc."""
        return self.begin == self.arc.times[0]

    @property
    def at_end(self) -> bool:
        """True if the run ends at the end of its arc."""
        return self.end == self.arc.times[-1]

    @property
    def looks(self) -> Array:
        """Times at which conditions are evaluated [s]: all steps, and both sides of each node."""
        inside = self.arc.times[(self.arc.times > self.begin) & (self.arc.times <= self.end)]
        every = np.concatenate([self.trajectory.looks, np.nextafter(inside, -np.inf), inside])
        last = min(self.end, self.trajectory.span[1])
        return np.unique(every[(every >= self.begin) & (every <= last)])

    def of(self, column: ca.SX, times: Array | float) -> Array:
        """Return values of a column of expressions in symbols of the model, shape (rows, n)."""
        at, rows = np.atleast_1d(times), column.numel()
        if not rows:
            return np.zeros((0, at.size))
        return np.reshape(self.trajectory.of(ca.densify(column), at), (rows, at.size))

    def signals(self, time: float) -> list[Array]:
        """Return [t, x, z, u, p] at one time."""
        model = self.arc.span.model
        values = [self.of(model.vector(letter), time)[:, 0] for letter in "xzu"]
        return [np.array([time]), *values, self.arc.p]

    def integral(self, expression: ca.SX, kinks: Sequence[ca.SX] = ()) -> float:
        """Return the integral of an expression over the run, by Gauss quadrature over each step.

        Steps are divided where an expression in `kinks` is zero.
        """
        if ca.SX(expression).is_zero():
            return 0.0
        steps = self.trajectory.step_times
        ends = np.unique(np.concatenate([steps[steps < self.end], [self.end]]))
        for kink in kinks:
            ends = np.unique(np.concatenate([ends, self._zeros(kink, ends)]))
        half = np.diff(ends)[:, None] / 2
        times = ends[:-1, None] + half * (1.0 + GAUSS_POINTS)
        values = self.of(expression, times.ravel()).reshape(times.shape)
        return float((half * GAUSS_WEIGHTS * values).sum())

    def _zeros(self, kink: ca.SX, ends: Array) -> Array:
        """Return the times between `ends` at which an expression changes its sign."""
        parts = np.linspace(0.0, 1.0, PARTS + 1)[1:-1]
        inside = ends[:-1, None] + np.diff(ends)[:, None] * parts
        looks = np.unique(np.concatenate([np.nextafter(ends[1:], -np.inf), ends, inside.ravel()]))
        values = self.of(kink, looks)[0]
        low, high = (looks[k : k + looks.size - 1][values[:-1] * values[1:] < 0] for k in (0, 1))
        sign = np.sign(self.of(kink, low)[0])
        for _ in range(BISECTIONS):
            middle = (low + high) / 2
            before = sign * self.of(kink, middle)[0] > 0
            low, high = np.where(before, middle, low), np.where(before, high, middle)
        return low


def resimulated(
    arcs: Sequence[Arc],
    rtol: float = RTOL,
    follow: Callable[[Arc, Mapping[str, float]], SimulatedArc | None] | None = None,
) -> tuple[SimulatedArc, ...]:
    """Simulate the models under the optimised controls, which are constant on each interval.

    A phase starts at the simulated end of the previous one, according to its links. States without
    a link start at their optimised values. If a run fails, the later phases of its scenario are
    omitted, because they have no start.

    `follow` returns the run of an arc from given start values, or None if it fails. By default it
    simulates the user's model.
    """
    runs: list[SimulatedArc] = []
    for arc in arcs:
        start, links = arc.state(0), arc.span.links
        if arc.span.phase:
            before = runs[-1] if runs else None
            if before is None or not before.ok or before.arc.number != arc.number - 1:
                continue
            ends = before.of(stacked(link.expression for link in links), before.end)[:, 0]
            start |= {link.state: float(x) for link, x in zip(links, ends, strict=True)}
        made = follow(arc, start) if follow else run_from(arc, 0, start, rtol)
        runs += [] if made is None else [made]
    return tuple(runs)


def run_from(arc: Arc, node: int, start: Mapping[str, float], rtol: float = RTOL) -> SimulatedArc:
    """Simulate the model from a node to the end of the arc."""
    times, model = arc.times[node:], arc.span.model
    u = {v.name: Hold(times[:-1], row[node:]) for v, row in zip(model.u, arc.u, strict=True)}
    begin, end = float(times[0]), float(times[-1])
    trajectory = simulate(
        model, end, t_start=begin, x0=dict(start), u=u, p=arc.parameters(), rtol=rtol,
        times=times[1:-1], throw=False,
    )  # fmt: skip
    return SimulatedArc(arc, trajectory, end)
