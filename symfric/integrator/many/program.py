"""Equations of an ensemble as plain data, and projection of start values onto constraints."""

from dataclasses import dataclass, fields
from functools import lru_cache, partial
from threading import Lock
from typing import Any, final
from weakref import WeakKeyDictionary

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.integrator.compiled.columns import Columns
from symfric.integrator.equations.initial import ASSEMBLED, ITERATIONS, Equations
from symfric.integrator.equations.manifold import Manifold
from symfric.integrator.many.members import CompiledMembers, Follow, Members, VmMembers, many_source
from symfric.integrator.running.integrator import Integrator

Array = NDArray[np.float64]


@final
@dataclass(frozen=True, eq=False)
class Assembly:
    """Projection of start values onto constraints, for the rows of matrices.

    It corresponds to the first part of `symfric.integrator.equations.initial.consistent`.
    """

    manifold: Manifold
    nx: int
    defect: Columns
    project: Columns
    slope: Columns

    @classmethod
    def of(cls, manifold: Manifold, nx: int) -> "Assembly":
        """Build from a mechanism with `nx` states."""
        functions = (manifold.defect, manifold.project, manifold.slope)
        return cls(manifold, nx, *(Columns(function) for function in functions))

    def __call__(self, y: Array, d: Array) -> tuple[Array, NDArray[np.bool_]]:
        """Project positions and velocities in rows of y (members, n); return y and a mask of
        successes.

        With charts, each row gets an orthonormal basis of its tangent space.
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
        """Return bases of the tangent spaces, columns below each other."""
        n, m = self.manifold.n, self.manifold.m
        (entries,) = self.slope([y, d], backend="auto")
        rows, columns = self.manifold.slope.size_out(0)
        slope = entries.reshape(-1, columns, rows).transpose(0, 2, 1)
        # the trailing right singular vectors span the null space
        right = np.linalg.svd(np.nan_to_num(slope[:, n : n + m, :n]))[2]
        return right[:, m:].reshape(y.shape[0], -1)


Rows = tuple[tuple[float, ...], ...]
Packed = tuple[tuple[str, str | int], ...]


@final
@dataclass(frozen=True, eq=False)
class Program:
    """Equations of an integrator for workers without the model; picklable.

    Attributes:
        where: for messages.
        code: C of steps, signals and their loop, or the serialised step for the virtual machine.
        compiled: True for C.
        signals: the serialised Function of the signals.
        n_signals: number of signals.
        constraints: the serialised algebraic equations, "" if there are none.
        free: as `System.free`, row by row.
        manifold: the constraints of a mechanism, Functions serialised; () for other models.
        names: of the unknowns.
        nominal: typical magnitudes of the differential states.
        follow: update of algebraic unknowns after jumps of inputs in the virtual machine: the
            serialised round and its contraction; ("", 0) for a full search, () without such
            unknowns.
    """

    where: str
    code: str
    compiled: bool
    signals: str
    n_signals: int
    constraints: str
    free: Rows
    manifold: Packed
    names: tuple[str, ...]
    nominal: Array
    follow: Follow

    @property
    def nx(self) -> int:
        """Number of differential states."""
        return self.nominal.size

    def load(self) -> Members:
        """Return the runner of the members; compiled once in a process."""
        if self.compiled:
            return _compiled(self.code, self.n_signals)
        return _vm(self.code, self.signals, self.follow)

    def equations(self) -> tuple[Equations, Columns]:
        """Return the algebraic equations, and their constraints for many columns."""
        return _equations(self.names, self.nx, self.free, self.constraints, self.manifold)

    def assembly(self) -> Assembly | None:
        """Return the projection of a mechanism with a fast update of algebraic unknowns, else
        None.
        """
        if not self.manifold or not self.follow or not self.follow[0]:
            return None
        return _assembly(self.manifold, self.nx)


_KNOWN: WeakKeyDictionary[Integrator, dict[bool, Program]] = WeakKeyDictionary()
_LOCK = Lock()


def program(integrator: Integrator, compiled: bool) -> Program:
    """Return the program of an integrator, written once and cached during its lifetime."""
    with _LOCK:
        known = _KNOWN.setdefault(integrator, {})
        if compiled not in known:
            known[compiled] = _written(integrator, compiled)
        return known[compiled]


def _written(integrator: Integrator, compiled: bool) -> Program:
    s, step = integrator.system, integrator.step
    jumps = integrator.model.u or s.manifold is not None
    follow = integrator.follow if integrator.follows and jumps else None
    how: Follow = ("", 0.0) if integrator.follows else ()
    if follow is not None:
        how = (str(follow.round.serialize()), follow.contraction)
    source = partial(many_source, step, integrator.signals, integrator.follows, follow)
    return Program(
        where=f"simulate_many of '{integrator.model.name}'",
        code=source() if compiled else str(step.serialize()),
        compiled=compiled,
        signals=str(integrator.signals.serialize()),
        n_signals=integrator.signals.numel_out(0),
        constraints=str(s.constraints.serialize()) if s.algebraic[0] else "",
        free=tuple(map(tuple, s.free.tolist())),
        manifold=_packed(s.manifold),
        names=s.names,
        nominal=s.nominal,
        follow=how,
    )


def _packed(manifold: Manifold | None) -> Packed:
    """Return a mechanism's constraints as plain data, () if there are none."""
    if manifold is None:
        return ()
    values = ((f.name, getattr(manifold, f.name)) for f in fields(manifold))
    return tuple(
        (name, str(value.serialize()) if isinstance(value, ca.Function) else value)
        for name, value in values
    )


@lru_cache(16)
def _equations(
    names: tuple[str, ...],
    nx: int,
    free: Rows,
    constraints: str,
    manifold: Packed,
) -> tuple[Equations, Columns]:
    function = ca.Function.deserialize(constraints)
    mechanism = _manifold(manifold) if manifold else None
    return Equations(names, nx, np.array(free), function, mechanism), Columns(function)


@lru_cache(16)
def _manifold(manifold: Packed) -> Manifold:
    values: dict[str, Any] = {
        name: ca.Function.deserialize(value) if isinstance(value, str) else value
        for name, value in manifold
    }
    return Manifold(**values)


@lru_cache(16)
def _assembly(manifold: Packed, nx: int) -> Assembly:
    return Assembly.of(_manifold(manifold), nx)


@lru_cache(16)
def _compiled(code: str, signals: int) -> CompiledMembers:
    return CompiledMembers.of(code, signals)


@lru_cache(16)
def _vm(step: str, signals: str, follow: Follow) -> VmMembers:
    return VmMembers.of(step, signals, follow)
