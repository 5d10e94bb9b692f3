"""Run many members to common times, in compiled code or in CasADi's virtual machine.

Both advance the members' columns S in place and return their signals; no steps are kept.
"""

import ctypes
from dataclasses import dataclass
from typing import Any, Protocol, final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.integrator.compiled.columns import Columns, densified
from symfric.integrator.compiled.compiler import load
from symfric.integrator.equations.blocks import Following
from symfric.integrator.equations.initial import FLOOR
from symfric.integrator.many.vectors import c_text, lanes_header, vector_source
from symfric.integrator.running.engine import VmEngine, Work
from symfric.integrator.running.events import Stop
from symfric.integrator.running.integrator import Integrator
from symfric.integrator.running.plants import (
    AGAIN,
    MEMBERS,
    REFUSED,
    SEARCH,
    Advance,
    Plants,
    loaded,
)
from symfric.integrator.running.record import Dense, Outputs
from symfric.integrator.step.layout import Given, State

Array = NDArray[np.float64]
Counts = NDArray[np.int64]
ROWS, ATTEMPTS = 2048, 2000
PAIRED = 2500
"""Steps with fewer instructions run in two groups of lanes at once; larger ones use the processor
fully with one.
"""
LEAST_PLANTS = 8
"""Least number of plants for which lanes are faster."""
MOST_INSTRUCTIONS = 10_000
"""Steps with more instructions take compilers too long as vectors."""


@final
@dataclass(frozen=True, eq=False)
class Stretch:
    """Intervals and times of a run of members; an array of one row is common to all of them.

    Attributes:
        breaks: ends of input intervals [s], shape (k + 1,).
        data: input data on them, shape (members or 1, n_data, k).
        ends: end of each member [s], from breaks[0] to breaks[-1], shape (members,).
        h_min: smallest step of each member [s], shape (members,).
        times: times of the results [s], shape (members or 1, n); NaN is returned after the end.
        max_steps: attempts allowed, counting earlier ones.
        follow: True if algebraic unknowns have to follow the data at the start, too.
    """

    breaks: Array
    data: Array
    ends: Array
    h_min: Array
    times: Array
    max_steps: int
    follow: bool = False


Follow = tuple[str, float] | tuple[()]
Advanced = tuple[Array, Counts, Array]


class Members(Protocol):
    """Runner of members."""

    def run(self, S: Array, R: Array, made: Counts, stretch: Stretch) -> Advanced:
        """Advance members over a stretch.

        Args:
            S: start columns S, one per row, advanced in place.
            R: run data R, one per row.
            made: attempts of each member, updated in place.
            stretch: intervals and times.

        Returns:
            Signals (members, times, signals), NaN after a member stopped; reasons to stop
            (members,);
            least and greatest unknowns at the start and the ends of steps (members, 2, n).
        """
        ...


@final
@dataclass(frozen=True, eq=False)
class VmMembers:
    """Members in CasADi's virtual machine, by the engine of single runs; needs no compiler."""

    engine: VmEngine
    signals: Columns
    follow: Following | None

    @classmethod
    def of(cls, step: str, signals: str, follow: Follow) -> "VmMembers":
        """Build from the serialised Functions of the step, the signals and the update after
        jumps.
        """
        engine = VmEngine(ca.Function.deserialize(step), follows=bool(follow))
        how = None
        if follow and follow[0]:
            how = Following(ca.Function.deserialize(follow[0]), follow[1])
        return cls(engine, Columns(ca.Function.deserialize(signals)), how)

    def run(self, S: Array, R: Array, made: Counts, stretch: Stretch) -> Advanced:
        """Advance members over a stretch."""
        members, n = S.shape[0], S.shape[1] - State.MEMORY
        step, n_d = self.engine.step, self.signals.function.numel_in(2)
        found = np.full(
            (members, stretch.times.shape[1], self.signals.function.numel_out(0)), np.nan
        )
        reason, reach = np.zeros(members, dtype=np.int64), np.stack([S[:, State.Y]] * 2, axis=1)
        work = Work(n, step.numel_in(1), step.numel_out(1) // n, ROWS)
        for m in range(members):
            work.S[:], work.R[:] = S[m], R[m]
            at, y, made[m], reason[m] = self._member(work, stretch, m, int(made[m]), reach[m])
            S[m] = work.S
            d = np.tile(work.R[work.R.size - n_d :], (at.size, 1))
            d[:, n_d - work.data.shape[0] :] = work.data[:, work.interval(at)].T
            first = int(
                np.count_nonzero(stretch.times[m % stretch.times.shape[0]] < stretch.breaks[0])
            )
            found[m, first : first + at.size] = self.signals([at, y, d])[0]
        return found, reason, reach

    def _member(
        self, work: Work, stretch: Stretch, m: int, made: int, reach: Array
    ) -> tuple[Array, Array, int, Stop]:
        """Advance a member.

        Returns:
            Times that it reached, unknowns there, attempts made, reason to stop.
        """
        breaks, end = stretch.breaks, stretch.ends[m]
        breaks = np.concatenate([breaks[:1], breaks[1:][breaks[1:] < end], [end]])
        times, data = (rows[m % rows.shape[0]] for rows in (stretch.times, stretch.data))
        outputs = Outputs.at(times[times >= breaks[0]], work.n)
        work.want(outputs, None)
        work.over(breaks, data[:, : breaks.size - 1])
        work.loop.h_min = stretch.h_min[m]
        stop = Stop.SEARCH if stretch.follow else Stop.FULL
        while stop in (Stop.SEARCH, Stop.FULL) or (
            stop is Stop.ATTEMPTS and made < stretch.max_steps
        ):
            if stop is Stop.SEARCH and not self._follows(work):
                break
            allowed = min(ATTEMPTS, stretch.max_steps - made)
            records, count, stop = self.engine.march(work, allowed)
            ends, made = Dense.of(records, work.n).y1, made + count
            reach[0] = np.minimum(reach[0], ends.min(axis=0, initial=np.inf))
            reach[1] = np.maximum(reach[1], ends.max(axis=0, initial=-np.inf))
        if stop is not Stop.SEARCH:
            outputs.stand(work.S[State.T], work.S[State.Y])
        return outputs.times[: outputs.found], outputs.reached.T, made, stop

    def _follows(self, work: Work) -> bool:
        """Update the algebraic unknowns after a jump of data; return False if that fails."""
        if self.follow is None:
            return not self.engine.follows
        y, n_d = work.S[State.Y], self.signals.function.numel_in(2)
        found = self.follow(y, work.R[work.R.size - n_d :])
        if found is not None:
            y[:] = found
        return found is not None


_POINTER, _COUNT = ctypes.c_void_p, ctypes.c_longlong


class _Many(ctypes.Structure):
    """Struct `Many` of loop.h."""

    _fields_ = (
        ("S", _POINTER), ("R", _POINTER), ("members", _COUNT),
        ("breaks", _POINTER), ("intervals", _COUNT),
        ("data", _POINTER), ("n_data", _COUNT), ("data_step", _COUNT),
        ("ends", _POINTER), ("h_min", _POINTER),
        ("times", _POINTER), ("n_times", _COUNT), ("times_step", _COUNT), ("max_attempts", _COUNT),
        ("follow", _COUNT),
        ("out", _POINTER), ("reason", _POINTER), ("made", _POINTER), ("reach", _POINTER),
    )  # fmt: skip


@final
@dataclass(frozen=True, eq=False)
class CompiledMembers:
    """Members in the lanes of compiled vector code; releases the GIL."""

    library: ctypes.CDLL
    signals: int

    @classmethod
    def of(cls, source: str, signals: int) -> "CompiledMembers":
        """Build from the C of `many_source`; compiles, or loads from the cache."""
        library = load(source, "symfric_many", "symfric_lanes")
        library.symfric_many.argtypes = [ctypes.c_void_p]
        return cls(library, signals)

    @property
    def lanes(self) -> int:
        """Number of members that run at once."""
        return int(self.library.symfric_lanes())

    def run(self, S: Array, R: Array, made: Counts, stretch: Stretch) -> Advanced:
        """Advance members over a stretch.

        Raises:
            MemoryError: about a megabyte is missing.
        """
        members, times, data = S.shape[0], stretch.times, stretch.data
        found = np.empty((members, times.shape[1], self.signals))
        starts, reason = np.ascontiguousarray(S), np.zeros(members, dtype=np.int64)
        reach = np.stack([S[:, State.Y]] * 2, axis=1)
        given = {
            "R": R, "breaks": stretch.breaks, "data": data, "ends": stretch.ends,
            "h_min": stretch.h_min, "times": times,
        }  # fmt: skip
        arrays: dict[str, NDArray[Any]] = {k: np.ascontiguousarray(a) for k, a in given.items()}
        arrays |= {"S": starts, "out": found, "reason": reason, "made": made, "reach": reach}
        every = _Many(
            **{name: array.ctypes.data for name, array in arrays.items()},
            members=members, intervals=data.shape[2], n_data=data.shape[1],
            data_step=data[0].size if data.shape[0] > 1 else 0, n_times=times.shape[1],
            times_step=times.shape[1] if times.shape[0] > 1 else 0,
            max_attempts=stretch.max_steps, follow=stretch.follow,
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
        step, signals: of an `Integrator`.
        follows: True if there are algebraic unknowns, which follow jumps of inputs.
        follow: update of these unknowns; without it members stop at each jump.
        lanes: of the vectors; by default as many as the processor supports. The bits are the same.
    """
    n = step.numel_in(0) - State.MEMORY
    step = step if step.is_a("SXFunction") else step.expand()
    groups = 2 if step.n_instructions() < PAIRED else 1
    (of_step, work), (of_values, more) = (
        vector_source("symfric_step", step, groups),
        vector_source("symfric_values", densified(signals)),
    )
    sizes = {
        "N": n, "MEMORY": State.MEMORY, "T": State.T, "H": State.H, "SIZE_R": step.numel_in(1),
        "T_END": Given.T_END, "N_D": signals.numel_in(2), "ROWS": step.numel_out(1) // n,
        "SIGNALS": signals.numel_out(0), "FLOOR": repr(FLOOR), "WORK": max(work, more),
        "GROUPS": groups,
    }  # fmt: skip
    sizes["FOLLOWS"] = 0 if not follows else 1 if follow is None else 2
    jump = ""
    if follow is not None:
        generator = ca.CodeGenerator("symfric_round.c", {"static_aux": True})
        generator.add(follow.round)
        jump = generator.dump() + follow.c_source
    defined = "".join(f"#define {name} {value}\n" for name, value in sizes.items())
    return f"{jump}{lanes_header(lanes)}\n{of_step}{of_values}{defined}{c_text('loop.h')}"


def pays(integrator: Integrator, plants: Plants) -> bool:
    """Return True if plants run faster in lanes."""
    return plants.S.shape[0] >= LEAST_PLANTS and integrator.instructions <= MOST_INSTRUCTIONS


def side_by_side(integrator: Integrator, plants: Plants) -> Advance:
    """Return the loop for plants in the lanes of vectors, from sample to sample.

    A lane repeats `symfric.integrator.running.plants`, except that functions like exp differ by a
    few units of the last place (`lanes.h`). The bits of a plant depend neither on the number of
    lanes nor on the other plants.

    Raises:
        CompileError: no compiler was found, or it failed.
    """
    return loaded(integrator, plants, "lanes", plants_source)


def plants_source(integrator: Integrator) -> str:
    """Return the C of the step on vectors, of the update after a jump, and of the loop around
    them.
    """
    s = integrator.system
    nothing = ca.Function("nothing", [ca.SX.sym("t"), s.y, s.d], [ca.SX(0, 1)])
    every = many_source(integrator.step, nothing, integrator.follows, integrator.follow)
    numbers = {
        "HELD": integrator.inputs.data.numel(), "REFUSED": REFUSED, "SEARCHED": SEARCH,
        "AGAIN": AGAIN,
    }  # fmt: skip
    defined = "".join(f"#define {name} ({value})\n" for name, value in numbers.items())
    return every + MEMBERS + defined + c_text("plants.c")
