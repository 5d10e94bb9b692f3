"""Equations of an ensemble for workers without the model, and the projection of start values."""

from dataclasses import dataclass, fields
from functools import cached_property
from threading import Lock
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from symfric.integrator.compiled.columns import Columns
from symfric.integrator.equations.blocks import Following
from symfric.integrator.equations.initial import ASSEMBLED, ITERATIONS, Equations
from symfric.integrator.equations.manifold import Manifold
from symfric.integrator.many.members import CompiledMembers, many_source
from symfric.integrator.running.integrator import Integrator

Array = NDArray[np.float64]
_LOCK = Lock()


class Assembly:
    """Projection of rows of start values on the constraints of a mechanism with `nx` states.

    The projection equals the first part of `symfric.integrator.equations.initial.consistent`.
    """

    def __init__(self, manifold: Manifold, nx: int) -> None:
        self.manifold, self.nx = manifold, nx
        self.defect, self.project, self.slope = (
            Columns(function) for function in (manifold.defect, manifold.project, manifold.slope)
        )

    def __call__(self, y: Array, d: Array) -> tuple[Array, NDArray[np.bool_]]:
        """Return projected rows of y (members, n), and True for each row that succeeded.

        Positions and velocities are projected. With charts, each row also gets an orthonormal
        basis of its tangent space.
        """
        y, closed = y.copy(), np.full(y.shape[0], self.manifold.m == 0)
        todo = np.flatnonzero(~closed)
        for _ in range(ITERATIONS):
            if not todo.size:
                break
            here = np.ascontiguousarray(y[todo]), np.ascontiguousarray(d[todo])
            (defect,) = self.defect(here, backend="auto")
            size = np.maximum(1.0, np.abs(here[0][:, : self.nx]).max(axis=1, initial=0.0))
            good = np.abs(defect).max(axis=1, initial=0.0) < ASSEMBLED * size
            closed[todo[good]] = True
            todo = todo[~good]
            if todo.size:
                (y[todo],) = self.project([here[0][~good], here[1][~good]], backend="auto")
        if self.manifold.charted:
            y[:, self.manifold.basis] = self._bases(y, d)
        return y, closed

    def _bases(self, y: Array, d: Array) -> Array:
        """Return the basis of the tangent space for each row, stacked column by column."""
        n, m = self.manifold.n, self.manifold.m
        (entries,) = self.slope([y, d], backend="auto")
        rows, columns = self.manifold.slope.size_out(0)
        slope = entries.reshape(-1, columns, rows).transpose(0, 2, 1)
        # the trailing right singular vectors span the null space
        right = np.linalg.svd(np.nan_to_num(slope[:, n : n + m, :n]))[2]
        return right[:, m:].reshape(y.shape[0], -1)


@final
@dataclass(frozen=True, eq=False)
class Program:
    """Equations of an integrator; picklable, without its caches.

    Attributes:
        where: name of the caller in messages.
        code: C of steps, signals and their loop.
        n_signals: number of signals.
        equations: the algebraic equations; None if there are none.
        nominal: typical magnitudes of the differential states.
        follow: fast update of algebraic unknowns after jumps of inputs; None for a full search.
    """

    where: str
    code: str
    n_signals: int
    equations: Equations | None
    nominal: Array
    follow: Following | None

    def __getstate__(self) -> dict[str, Any]:
        return {item.name: getattr(self, item.name) for item in fields(self)}

    @property
    def nx(self) -> int:
        """Number of differential states."""
        return self.nominal.size

    @cached_property
    def members(self) -> CompiledMembers:
        """Engine of the members; raises `CompileError` without a working compiler."""
        return CompiledMembers.of(self.code, self.n_signals)

    @cached_property
    def constraints(self) -> Columns | None:
        """Algebraic equations, evaluated for many columns."""
        return None if self.equations is None else Columns(self.equations.constraints)

    @cached_property
    def assembly(self) -> Assembly | None:
        """Projection for a mechanism with a fast update of algebraic unknowns; otherwise None."""
        if self.equations is None or self.equations.manifold is None or self.follow is None:
            return None
        return Assembly(self.equations.manifold, self.nx)


def program(integrator: Integrator) -> Program:
    """Return the program of an integrator; written once, then cached in the integrator."""
    with _LOCK:
        known: Program | None = integrator.memory.get("program")
        if known is None:
            follow = follow_of(integrator)
            step, signals = integrator.step, integrator.signals
            code = many_source(step, signals, integrator.follows, follow)
            known = integrator.memory["program"] = with_code(integrator, code)
        return known


def follow_of(integrator: Integrator) -> Following | None:
    """Return the fast update of algebraic unknowns, if members need it."""
    jumps = integrator.model.u or integrator.system.manifold is not None
    return integrator.follow if integrator.follows and jumps else None


def with_code(integrator: Integrator, code: str) -> Program:
    """Return the program of an integrator with this C."""
    s = integrator.system
    equations = Equations(s.names, s.nx, s.free, s.constraints, s.manifold)
    return Program(
        where=f"simulate_many of '{integrator.model.name}'",
        code=code,
        n_signals=integrator.signals.numel_out(0),
        equations=equations if s.algebraic[0] else None,
        nominal=s.nominal,
        follow=follow_of(integrator),
    )
