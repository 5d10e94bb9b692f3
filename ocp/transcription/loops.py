"""Numbers of the constraints of a mechanism: what closes its loops, and what follows from what."""

from collections.abc import Sequence
from typing import final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ocp.formulation.phase import Span
from symfric.model.holonomic import Holonomic

Array = NDArray[np.float64]
RANK = 1e-8
"""Singular values below this share of the largest one count as zero."""
STEPS, ITERATIONS = 20, 30
"""Stations on the way from the start of a model to named coordinates, and iterations at each."""
FINE, NEAR = 4, 5
"""The same from one point of a motion to the next."""


@final
class Loops:
    """Numbers of the constraints of a span, by nominal coordinates."""

    def __init__(self, span: Span, mechanics: Holonomic, begin: float, free: bool) -> None:
        """The span starts at the time `begin` [s], which may be chosen, or its end (`free`)."""
        self.span, self.n, self.begin = span, mechanics.n, begin
        self.start = span.model.initial_state(None, _named(span))
        q, t, p = span.model.vector("x")[: self.n], span.model.t, span.model.vector("p")
        phi = mechanics.phi
        outputs = [phi, ca.jacobian(phi, q), ca.jacobian(phi, t)]
        self._function = ca.Function("loops", [q, t, p], [ca.densify(part) for part in outputs])
        self.nominal = span.model.nominal("x")[: self.n]
        self.sizes = np.ones(phi.numel())
        A = np.abs(self.at(self.start[: self.n], 0.0)[1]).max(axis=1)
        self.sizes = np.where(A > 0, A, 1.0)
        chosen = [v.symbol for v in span.model.p if v.name in span.chosen]
        unknown = [*chosen, *([t] if free else [])]
        self.open = bool(unknown) and bool(ca.depends_on(phi, ca.vertcat(*unknown)))

    def at(self, q: Array, t: float) -> tuple[Array, Array, Array]:
        """Phi (m,), its Jacobian by nominal coordinates (m, n), and phi_t (m,), in span time."""
        values = self._function(q, self.begin + t, self.span.p)
        phi, slope, rate = (np.array(part) for part in values)
        return (
            phi.ravel() / self.sizes,
            slope * self.nominal / self.sizes[:, None],
            rate.ravel() / self.sizes,
        )

    def closed(self, q: Array, held: Sequence[int], t: float) -> tuple[Array, float]:
        """Coordinates that satisfy the constraints best with those `held` as they are in q.

        By Gauss and Newton on the way from the start of the model, the shortest change each time.
        Returns also by how much the constraints are off.
        """
        now = self._towards(self.start[: self.n], q, held, t, (STEPS, ITERATIONS))
        return now, float(np.abs(self.at(now, t)[0]).max())

    def follow(self, x: Array, times: Array, lead: Sequence[int]) -> Array:
        """Coordinates and rates x (2 n, points) moved onto the constraints, one after the other.

        As many of the coordinates `lead` as the constraints leave open keep their values, the first
        ones first.
        """
        n, found = self.n, x.copy()
        now = self.start[:n]
        for k, t in enumerate(times.tolist()):
            spare = dependent(self.at(now, t)[1], lead, (), ()) or ()
            held = [i for i in lead if i not in spare]
            now = self._towards(now, x[:n, k], held, t, (FINE, NEAR))
            free = np.setdiff1d(np.arange(n), held)
            _, A, A_t = self.at(now, t)
            v = x[n:, k] / self.nominal
            v[free] += np.linalg.lstsq(A[:, free], -A @ v - A_t, rcond=RANK)[0]
            found[:n, k], found[n:, k] = now, v * self.nominal
        return found

    def _towards(
        self, start: Array, q: Array, held: Sequence[int], t: float, pace: tuple[int, int]
    ) -> Array:
        """From `start` to the values of q that are `held`, the others by the shortest change."""
        free = np.setdiff1d(np.arange(self.n), held)
        now, begin = start.copy(), start[list(held)]
        for s in np.linspace(0.0, 1.0, pace[0] + 1)[1:]:
            now[list(held)] = (1 - s) * begin + s * q[list(held)]
            for _ in range(pace[1] if free.size else 0):
                phi, A, _ = self.at(now, t)
                if np.abs(phi).max() < 1e-13:
                    break
                change = np.linalg.lstsq(A[:, free], -phi, rcond=RANK)[0]
                largest = float(np.abs(change).max())
                now[free] += change * self.nominal[free] * min(1.0, 1.0 / max(largest, 1e-300))
                if largest < 1e-14:
                    break
        return now


def _named(span: Span) -> dict[str, float]:
    return {v.name: float(x) for v, x in zip(span.model.p, span.p, strict=True)}


def dependent(
    A: Array, given: Sequence[int], plain: Sequence[int], strict: Sequence[int]
) -> list[int] | None:
    """Columns of A to release so that the others leave all its rows to be satisfied.

    As few as possible: `plain` ones before those `given`; None where they do not suffice.
    """
    taken = {*given, *plain, *strict}
    free = [i for i in range(A.shape[1]) if i not in taken]
    u, s, _ = np.linalg.svd(A, full_matrices=False)
    rank, size = int((s > RANK * s[0]).sum()), float(s[0])
    rest = u[:, :rank].T @ A  # as many rows as are independent
    basis = _range(rest[:, free], size)
    released: list[int] = []
    for candidates in (plain, given):
        left = list(candidates)
        while basis.shape[1] < rank and left:
            beyond = rest[:, left] - basis @ (basis.T @ rest[:, left])
            norms = np.linalg.norm(beyond, axis=0)
            best = int(np.argmax(norms))
            if norms[best] <= RANK * size:
                break
            basis = np.column_stack([basis, beyond[:, best] / norms[best]])
            released.append(left.pop(best))
    return released if basis.shape[1] == rank else None


def _range(A: Array, size: float) -> Array:
    """An orthonormal basis of the columns of A."""
    if not A.size:
        return np.zeros((A.shape[0], 0))
    u, s, _ = np.linalg.svd(A, full_matrices=False)
    return u[:, s > RANK * size]
