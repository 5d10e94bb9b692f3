"""Members of an ensemble, and plants, in the lanes of compiled vector code.

A `Program` contains the equations of an ensemble for workers that do not have the model.
"""

import ctypes
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from threading import Lock
from typing import Any, cast, final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.foundation.numeric import Array
from symfric.foundation.packed import state_of
from symfric.integrator.compiled.columns import Columns, densified
from symfric.integrator.compiled.compiler import load
from symfric.integrator.compiled.loops import generated
from symfric.integrator.equations.blocks import Following
from symfric.integrator.equations.initial import ASSEMBLED, FLOOR, ITERATIONS, AlgebraicEquations
from symfric.integrator.equations.manifold import Manifold
from symfric.integrator.many.vectors import c_text, lanes_header, vector_source
from symfric.integrator.methods.attempt import RRow, SRow
from symfric.integrator.running.integrator import Integrator
from symfric.integrator.running.plants import MEMBERS, Advance, Plants, Why, compiled, loaded

Counts = NDArray[np.int64]
_LOCK = Lock()
PAIRED = 2500
"""Number of instructions below which a step runs in two groups of lanes at once; with more, one
group uses the processor fully.
"""
LEAST_PLANTS = 8
"""Smallest number of plants for which lanes are faster."""
MOST_INSTRUCTIONS = 10_000
"""Number of instructions above which compiling a step for vectors takes too long."""


@final
@dataclass(frozen=True, eq=False)
class Stretch:
    """Intervals and times of a run of members; an array with one row is common to all members.

    Attributes:
        breaks: ends of input intervals [s], shape (k + 1,).
        data: input data in these intervals, shape (members or 1, n_data, k).
        ends: end time of each member [s], from breaks[0] to breaks[-1], shape (members,).
        h_min: smallest step of each member [s], shape (members,).
        times: times of the results [s], shape (members or 1, n); results after the end are NaN.
        max_steps: largest number of attempts of a member, including those of earlier runs.
        follow: True if algebraic unknowns also have to be updated to the data at the start.
    """

    breaks: Array
    data: Array
    ends: Array
    h_min: Array
    times: Array
    max_steps: int
    follow: bool = False

    @property
    def numbers(self) -> dict[str, int]:
        """Numbers of the struct `Many` in C; a step of 0 denotes data common to all members."""
        data, times = self.data, self.times
        return {
            "intervals": data.shape[2], "n_data": data.shape[1],
            "data_step": data[0].size if data.shape[0] > 1 else 0,
            "n_times": times.shape[1], "times_step": times.shape[1] if times.shape[0] > 1 else 0,
            "max_attempts": self.max_steps, "follow": self.follow,
        }  # fmt: skip


Advanced = tuple[Array, Counts, Array]
Runner = Callable[[Array, Array, Counts, Stretch], Advanced]
"""Function that advances members over a stretch, as `CompiledMembers.run`."""


def struct(names: str) -> type[ctypes.Structure]:
    """Return a C struct with fields of these names; those in `NUMBERS` are integers, others
    addresses.
    """
    kinds = [(n, ctypes.c_longlong if n in NUMBERS else ctypes.c_void_p) for n in names.split()]
    return type("Many", (ctypes.Structure,), {"_fields_": kinds})


NUMBERS = (
    "members", "intervals", "n_data", "data_step", "n_times", "times_step", "max_attempts",
    "follow", "n_todo", "budget",
)  # fmt: skip
_Many = struct(
    "S R members breaks intervals data n_data data_step ends h_min times n_times times_step "
    "max_attempts follow out reason made reach"
)
"""Struct `Many` of loop.h."""


@final
@dataclass(frozen=True, eq=False)
class CompiledMembers:
    """Members in the lanes of compiled vector code, which runs without the GIL."""

    library: ctypes.CDLL
    signals: int

    @classmethod
    def of(cls, source: str, signals: int) -> "CompiledMembers":
        """Return the members for the C of `many_source`, compiled or loaded from the cache."""
        library = load(source, "symfric_many", "symfric_lanes")
        library.symfric_many.argtypes = [ctypes.c_void_p]
        return cls(library, signals)

    @property
    def lanes(self) -> int:
        """Number of members that run at once."""
        return int(self.library.symfric_lanes())

    def run(self, S: Array, R: Array, made: Counts, stretch: Stretch) -> Advanced:
        """Advance members over a stretch.

        Args:
            S: columns of the members, one per row, advanced in place.
            R: run data of the members, one per row.
            made: number of attempts of each member, updated in place.
            stretch: intervals and times.

        Returns:
            Signals (members, times, signals), NaN after a member stopped; reasons to stop
            (members,); least and greatest unknowns over the start and the ends of steps (members,
            2, n).

        Raises:
            MemoryError: about a megabyte of work memory is not available.
        """
        found = np.empty((S.shape[0], stretch.times.shape[1], self.signals))
        starts, reason = np.ascontiguousarray(S), np.zeros(S.shape[0], dtype=np.int64)
        reach = np.stack([S[:, SRow.Y]] * 2, axis=1)
        given = {
            name: getattr(stretch, name) for name in ("breaks", "data", "ends", "h_min", "times")
        }
        arrays: dict[str, NDArray[Any]] = {
            name: np.ascontiguousarray(array) for name, array in (given | {"R": R}).items()
        }
        arrays |= {"S": starts, "out": found, "reason": reason, "made": made, "reach": reach}
        every = _Many(
            **{name: array.ctypes.data for name, array in arrays.items()},
            members=S.shape[0], **stretch.numbers,
        )  # fmt: skip
        if not self.library.symfric_many(ctypes.byref(every)):
            raise MemoryError
        S[:] = starts
        return found, reason, reach


def many_source(
    step: ca.Function,
    signals: ca.Function,
    follows: bool = False,
    follow: Following | None = None,
    lanes: int = 0,
) -> str:
    """Return the C of the step and of the signals on vectors, with the loop over members.

    Args:
        step, signals: Functions of an `Integrator`.
        follows: True if there are algebraic unknowns, which follow jumps of inputs.
        follow: update of these unknowns; without it, members stop at each jump.
        lanes: number of lanes of a vector; by default as many as the processor supports. It does
            not affect the bits of the results.
    """
    step = step if step.is_a("SXFunction") else step.expand()
    groups = 2 if step.n_instructions() < PAIRED else 1
    of_step, work = vector_source("symfric_step", step, groups)
    of_values, more = vector_source("symfric_values", densified(signals))
    sizes = loop_sizes(step, signals, follows, follow)
    sizes |= {"WORK": max(work, more), "GROUPS": groups}
    jump = ""
    if follow is not None:
        jump = generated("symfric_round", follow.round) + follow.c_source
    written = f"{jump}{lanes_header(lanes)}\n{of_step}{of_values}"
    return written + defined(sizes) + c_text("loop.h")


def loop_sizes(
    step: ca.Function, signals: ca.Function, follows: bool, follow: Following | None
) -> dict[str, object]:
    """Return the macros of a loop over members: sizes, and indices in S and R."""
    n = step.numel_in(0) - SRow.MEMORY
    return {
        "N": n, "MEMORY": SRow.MEMORY, "T": SRow.T, "H": SRow.H, "SIZE_R": step.numel_in(1),
        "T_END": RRow.T_END, "N_D": signals.numel_in(2), "ROWS": step.numel_out(1) // n,
        "SIGNALS": signals.numel_out(0), "FLOOR": repr(FLOOR),
        "FOLLOWS": 0 if not follows else 1 if follow is None else 2,
    }  # fmt: skip


def defined(macros: Mapping[str, object]) -> str:
    """Return the C that defines these macros."""
    return "".join(f"#define {name} {value}\n" for name, value in macros.items())


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
    equations: AlgebraicEquations | None
    nominal: Array
    follow: Following | None

    def __getstate__(self) -> dict[str, Any]:
        return state_of(self)

    @property
    def nx(self) -> int:
        """Number of differential states."""
        return self.nominal.size

    @cached_property
    def members(self) -> CompiledMembers:
        """Engine of the members; raises `CompileError` without a working compiler."""
        return CompiledMembers.of(self.code, self.n_signals)

    @cached_property
    def constraints(self) -> Columns:
        """Algebraic equations, evaluated for many columns; only if there are some."""
        return Columns(cast("AlgebraicEquations", self.equations).constraints)

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
    """Return the fast update of algebraic unknowns if members need it, otherwise None."""
    jumps = integrator.model.u or integrator.system.manifold is not None
    return integrator.follow if integrator.follows and jumps else None


def with_code(integrator: Integrator, code: str) -> Program:
    """Return the program of an integrator, with its equations in C as `code`."""
    s = integrator.system
    equations = AlgebraicEquations(s.names, s.nx, s.free, s.constraints, s.manifold)
    return Program(
        where=f"simulate_many of '{integrator.model.name}'",
        code=code,
        n_signals=integrator.signals.numel_out(0),
        equations=equations if s.algebraic[0] else None,
        nominal=s.nominal,
        follow=follow_of(integrator),
    )


def fastest(integrator: Integrator, plants: Plants) -> Advance:
    """Return the compiled loop of plants from sample to sample, in lanes if that is faster.

    A lane computes the same as `symfric.integrator.running.plants`, except that functions like exp
    differ by a few units in the last place (`lanes.h`). The bits of a plant depend neither on the
    number of lanes nor on the other plants.

    Raises:
        CompileError: no compiler was found, or it failed.
    """
    if plants.S.shape[0] < LEAST_PLANTS or integrator.instructions > MOST_INSTRUCTIONS:
        return compiled(integrator, plants)
    return loaded(integrator, plants, "lanes", plants_source)


def plants_source(integrator: Integrator) -> str:
    """Return the C of the step on vectors, of the update after a jump, and of the loop."""
    s = integrator.system
    nothing = ca.Function("nothing", [ca.SX.sym("t"), s.y, s.d], [ca.SX(0, 1)])
    every = many_source(integrator.step, nothing, integrator.follows, integrator.follow)
    numbers = {
        "HELD": integrator.inputs.data.numel(), "REFUSED": f"({Plants.REFUSED})",
        "SEARCHED": Why.SEARCH, "AGAIN": Why.AGAIN,
    }  # fmt: skip
    return every + MEMBERS + defined(numbers) + c_text("plants.c")
