"""Equations of an ensemble for workers without the model, and the projection of start values."""

from dataclasses import dataclass, fields
from functools import cached_property
from threading import Lock
from typing import Any, final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.integrator.compiled.columns import Columns
from symfric.integrator.equations.blocks import Following
from symfric.integrator.equations.initial import ASSEMBLED, ITERATIONS, Equations
from symfric.integrator.equations.manifold import Manifold
from symfric.integrator.many.members import CompiledMembers, Members, VmMembers, many_source
from symfric.integrator.running.engine import VmEngine
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
        code: C of steps, signals and their loop; or the step for the virtual machine.
        signals: signals, as in `Integrator.signals`.
        equations: the algebraic equations; None if there are none.
        nominal: typical magnitudes of the differential states.
        follows: True if there are algebraic unknowns, which follow jumps of inputs.
        follow: fast update of these unknowns; None for a full search.
    """

    where: str
    code: str | ca.Function
    signals: ca.Function
    equations: Equations | None
    nominal: Array
    follows: bool
    follow: Following | None

    def __getstate__(self) -> dict[str, Any]:
        return {item.name: getattr(self, item.name) for item in fields(self)}

    @property
    def nx(self) -> int:
        """Number of differential states."""
        return self.nominal.size

    @property
    def n_signals(self) -> int:
        """Number of signals."""
        return self.signals.numel_out(0)

    @cached_property
    def members(self) -> Members:
        """Engine of the members; raises `CompileError` without a working compiler."""
        if isinstance(self.code, str):
            return CompiledMembers.of(self.code, self.n_signals)
        engine = VmEngine(self.code, follows=self.follows)
        return VmMembers(engine, Columns(self.signals), self.follow)

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


def program(integrator: Integrator, compiled: bool) -> Program:
    """Return the program of an integrator; written once, then cached in the integrator."""
    with _LOCK:
        known: dict[bool, Program] = integrator.memory.setdefault("programs", {})
        if compiled not in known:
            known[compiled] = _written(integrator, compiled)
        return known[compiled]


def _written(integrator: Integrator, compiled: bool) -> Program:
    s, step, signals = integrator.system, integrator.step, integrator.signals
    jumps = integrator.model.u or s.manifold is not None
    follow = integrator.follow if integrator.follows and jumps else None
    equations = Equations(s.names, s.nx, s.free, s.constraints, s.manifold)
    return Program(
        where=f"simulate_many of '{integrator.model.name}'",
        code=many_source(step, signals, integrator.follows, follow) if compiled else step,
        signals=signals,
        equations=equations if s.algebraic[0] else None,
        nominal=s.nominal,
        follows=integrator.follows,
        follow=follow,
    )
