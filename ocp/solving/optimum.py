"""Multipliers of a solution in SI units: costates, and the Hamiltonian along the motion.

The solver minimises f(w) with scaled rows g(w) and returns a stationary point of its Lagrangian,

    L = f + lam_g'(g - b_g) + lam_w'(w - b_w),     dJ*/db = -lam

where b are the bounds that are active. All results are derivatives of the optimal cost in this
sense. The costate is the derivative of J* by the state at that time. At the start of interval k it
is the derivative of the terms of this interval by x_k. The Lagrangian of the motion,

    J + int costate'(f - x') dt  ~  J + sum_j w_j costate_j'(h f_j - x'(s_j)),

defines the costate at a collocation point: the multiplier of its row h f_j - x'(s_j) = 0 divided by
the quadrature weight w_j. For implicit rows h (M a - Q) = 0 of a mechanism it is -M' lam / w_j.

Source: Bryson and Ho, Applied Optimal Control, 1975, 2.7, 3.1; Garg et al., Automatica 46, 2010,
1843-1851 (costates by collocation).
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any, final

import casadi as ca
import numpy as np

from ocp.formulation.phase import Array
from ocp.solving.motion import along_points, joined, sampled
from ocp.transcription.blocks import Piece
from ocp.transcription.program import Iterate, cost_weight
from ocp.transcription.transcribe import Transcription
from ocp.transcription.unknowns import SpanPoints, Values
from symfric.foundation.storable import agree

Sparse = Any
"""Sparse matrix of SciPy, which has no stubs."""
STATIONARY = 1e-4
"""Largest residual of the optimality conditions, relative to the largest term of a component."""


@final
@dataclass(frozen=True, eq=False)
class Optimum:
    """Program of a solution, with its unknowns, multipliers and values of parameters.

    Attributes:
        transcription: the transcribed problem; for a motion by modes, that of its arcs.
        iterate: unknowns and multipliers, scaled.
        values: values of the parameters of the program.
    """

    transcription: Transcription
    iterate: Iterate
    values: Array

    def check_fields(self) -> None:
        """Raise an error if a file contains meshes or multipliers that do not fit its problem."""
        made, found = self.transcription, self.iterate
        meshes = [mesh.tolist() for mesh in made.meshes if mesh.ndim == 1 and mesh.size > 1]
        agree(
            "Optimum",
            len(meshes) == len(made.meshes) == len(made.problem.spans),
            all([mesh[0], mesh[-1]] == [0.0, 1.0] for mesh in meshes),
            all(a < b for mesh in meshes for a, b in pairwise(mesh)),
        )
        agree(
            "Optimum",
            found.w.shape == found.lam_w.shape == made.program.lower_w.shape,
            found.lam_g.shape == made.program.lower_g.shape,
            self.values.shape == made.program.values.shape,
        )

    @cached_property
    def slope(self) -> Array:
        """Gradient of the cost, scaled, shape (n,)."""
        return np.asarray(ca.densify(self._cost[1])).ravel()

    @property
    def cost(self) -> float:
        """Cost J."""
        return float(self._cost[0])

    @cached_property
    def _cost(self) -> Sequence[ca.DM]:
        return self.transcription.program.gradient.call([self.iterate.w, self.values])

    @cached_property
    def rows(self) -> tuple[Array, Sparse]:
        """Rows g, shape (m,), and their Jacobian, a sparse matrix (m, n), scaled."""
        g, J = self.transcription.program.jacobian(self.iterate.w, self.values)
        return np.asarray(g).ravel(), J.sparse()

    @property
    def size(self) -> float:
        """Largest component of the gradient of the cost; 1 if it is zero."""
        return float(np.abs(self.slope).max()) or 1.0

    @property
    def residual(self) -> float:
        """Largest residual of stationarity, relative to the largest term of the Lagrangian."""
        lam_w, (_, J) = self.iterate.lam_w, self.rows
        with np.errstate(invalid="ignore"):  # NaN for multipliers that are not finite
            total = self.slope + J.T @ self.iterate.lam_g + lam_w
            terms = abs(J).T @ np.abs(self.iterate.lam_g) + np.abs(self.slope) + np.abs(lam_w)
            return float(np.abs(total).max() / max(terms.max(), 1e-300))

    @cached_property
    def points(self) -> Values:
        """Unknowns of the motion in SI units."""
        return self.transcription.unpack(self.iterate.w)

    @cached_property
    def costates(self) -> tuple[SpanPoints, ...]:
        """Costates [cost/unit] of each phase, at nodes and collocation points.

        At a node it is the limit after the node; at the last node of a phase, the limit before.
        """
        made, lam, (_, J) = self.transcription, self.iterate.lam_g, self.rows
        parity, d = np.full(lam.size, -1), made.scheme.coefficients().degree
        for piece in self._dynamics(d):
            parity[piece.at] = piece.interval % 2
        halves = [J.T @ np.where(parity == side, lam, 0.0) for side in (0, 1)]
        found: list[SpanPoints] = []
        for number, (own, points) in enumerate(
            zip(made.layout.spans, self.points.spans, strict=True)
        ):
            k, N = np.arange(own.intervals + 1), own.intervals
            nodes = np.where(k % 2, halves[1][own.nodes], halves[0][own.nodes])
            nodes[:, :N] += self.slope[own.nodes[:, :N]]  # costs of intervals, with shooting
            nodes[:, N] = -halves[(N - 1) % 2][own.nodes[:, N]]
            inner = self._inner(number) if d else np.zeros((nodes.shape[0], 0))
            size, none = made.program.scale[own.nodes], np.zeros((0, inner.shape[1]))
            found.append(SpanPoints(points.T, nodes / size, inner, none, np.zeros((0, N))))
        return tuple(found)

    def _dynamics(self, degree: int) -> Iterator[Piece]:
        """Yield the pieces of the equations of intervals."""
        spans = self.transcription.layout.spans
        for piece in self.transcription.skeleton.pieces:
            inside = piece.order & Piece.LAST
            known = (inside == 0) | ((inside >= 2) & (inside < 2 + degree))
            own = piece.order >> 6 == (np.int64(piece.span) << 34) + piece.interval
            if piece.places >= spans[piece.span].intervals and bool((known & own).all()):
                yield piece

    def _inner(self, number: int) -> Array:
        """Return the costates of a phase at its collocation points, (nx, N d)."""
        made, span = self.transcription, self.transcription.problem.spans[number]
        scheme, lam, n = made.scheme.coefficients(), self.iterate.lam_g, len(span.model.x)
        piece = next(
            piece
            for piece in self._dynamics(scheme.degree)
            if piece.span == number and (piece.order & Piece.LAST).any()
        )
        values = lam[piece.at[:n]] / piece.rows.scale[:n, None]
        values /= np.tile(scheme.weights, piece.places // scheme.degree)
        mechanics = span.model.holonomic
        if mechanics is not None:
            mass = ca.jacobian(mechanics.implicit[: mechanics.n], mechanics.a)
            columns = [
                M.reshape(mass.shape, order="F") for M in self._along(number, ca.vec(mass)).T
            ]
            own = values[mechanics.n : 2 * mechanics.n]
            own[:] = np.column_stack([-M.T @ v for M, v in zip(columns, own.T, strict=True)])
        return values

    def _along(self, number: int, column: ca.SX, *, end: bool = False) -> Array:
        """Return `column` of a phase as `along_points` does, or at its end."""
        made, points = self.transcription, self.points.spans[number]
        span, mesh, first = made.problem.spans[number], made.meshes[number], self.offset(number)
        fractions = made.inner_fractions(number) if points.inner.size else mesh[:-1]
        if end:
            fractions, nodes = mesh[-1:], points.nodes[:, [-1, -1]]
            points = SpanPoints(points.T, nodes, nodes[:, :0], points.z[:, -1:], points.u[:, -1:])
        p = self.values[first : first + len(span.model.p)].copy()
        for i, v in enumerate(span.model.p):
            p[i] = self.points.chosen[v.name] if v.name in span.chosen else p[i]
        begin = sum(s.T for s in self.points.spans[number - span.phase : number])
        return along_points(span, points, column, t=begin + points.T * fractions, p=p)

    def offset(self, number: int) -> int:
        """Return the index in `values` of the first parameter of a phase."""
        spans, meshes = self.transcription.problem.spans, self.transcription.meshes
        return sum(
            len(s.model.p) + 1 + m.size for s, m in [*zip(spans, meshes, strict=True)][:number]
        )

    @property
    def hamiltonians(self) -> tuple[SpanPoints, ...]:
        """Hamiltonian H of each phase of the first scenario, as its only "state"."""
        return tuple(map(self._hamiltonian, range(len(self.transcription.problem.chain))))

    def _hamiltonian(self, number: int) -> SpanPoints:
        """Return H = L + costate' x' + E_t [cost/s] of a phase, with end costs E(t, x).

        At nodes it is the polynomial through the collocation points of the next interval.

        Raises:
            ValueError: a mechanism, or a model with algebraic variables, with shooting.
        """
        made, points, dual = self.transcription, self.points.spans[number], self.costates[number]
        model, scheme = made.problem.spans[number].model, made.scheme.coefficients()
        N, d, none = points.u.shape[1], scheme.degree, np.zeros((0, points.inner.shape[1]))
        running = self._costs(number)
        if d:
            h, inner = np.diff(made.meshes[number]) * points.T, points.inner.reshape(-1, N, d)
            carrying = np.concatenate([points.nodes[:, :-1, None], inner], axis=2)
            rates = (carrying @ scheme.slopes / h[:, None]).reshape(-1, N * d)
            inside = (running + (dual.inner * rates).sum(axis=0)).reshape(N, d)
            starts = inside @ _at_start(scheme.nodes[1:])
            nodes = np.append(starts, inside[-1] @ scheme.inner_ends)[None, :]
            return SpanPoints(points.T, nodes, inside.reshape(1, N * d), none, np.zeros((0, N)))
        if model.ode is None or model.z:
            raise ValueError(
                f"hamiltonian of '{model.name}': expected collocation for a mechanism or a model "
                f"with algebraic variables, got {made.scheme}; use Radau(3)"
            )
        rates = self._along(number, model.ode)
        starts = running + (dual.nodes[:, :-1] * rates).sum(axis=0)
        nodes = np.append(starts, starts[-1])[None, :]
        return SpanPoints(points.T, nodes, np.zeros((1, 0)), none, np.zeros((0, N)))

    def _costs(self, number: int) -> Array:
        """Return L + E_t at the collocation points of a phase, or at the starts of intervals."""
        made, spans = self.transcription, self.transcription.problem.spans
        last = number - spans[number].phase + len(made.problem.chain)
        weight = cost_weight(made.problem, made.skeleton.largest, self.iterate.lam_g, number)
        total = self._along(number, spans[number].integrand)[0]
        for k in range(number, last):
            total = total + self._along(k, ca.jacobian(spans[k].end, spans[k].model.t), end=True)[0]
        return weight * total

    def over_time(self, values: Sequence[SpanPoints], letters: str = "x") -> dict[str, Array]:
        """Return `values` by name at the times "t" of the first scenario; see `ScenarioMotion`.

        Args:
            values: values of each phase; durations T determine the times.
            letters: groups of variables "x", "z" and "u"; "H" for a Hamiltonian.
        """
        made = self.transcription
        spans, scheme = made.problem.spans[: len(made.problem.chain)], made.scheme.coefficients()
        rows: list[dict[str, Array]] = []
        begin = 0.0
        for span, own, mesh in zip(spans, values, made.meshes, strict=False):
            at = sampled(own, mesh, scheme)
            rows.append({"t": begin + own.T * at.fractions})
            begin += own.T
            for letter in letters:
                names = ["H"] if letter == "H" else [v.name for v in getattr(span.model, letter)]
                rows[-1] |= zip(names, getattr(at, letter.replace("H", "x")), strict=True)
        return joined(spans, self.points.spans, rows)


def _at_start(nodes: Array) -> Array:
    """Return the values at 0 of the polynomials through `nodes`."""
    return np.linalg.solve(np.vander(nodes, increasing=True).T, np.eye(nodes.size)[0])
