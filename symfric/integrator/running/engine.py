"""Run many step attempts per call, either in CasADi's virtual machine or in compiled C.

Both engines advance S in place and write a row (t0, t1, y0, y1, D) per accepted step.
"""

import ctypes
from dataclasses import dataclass, field
from enum import IntEnum
from typing import Protocol, final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.foundation.numeric import bound
from symfric.integrator.compiled.compiler import load
from symfric.integrator.equations.blocks import Following
from symfric.integrator.equations.initial import FLOOR
from symfric.integrator.running.crossings import Crossings
from symfric.integrator.running.events import Change, Eventful, Happened, Search
from symfric.integrator.running.loop import Work, loop_source, width
from symfric.integrator.running.record import pieces_of
from symfric.integrator.step.layout import Given, State

Array = NDArray[np.float64]


class Stop(IntEnum):
    """Reason why an engine returned.

    It includes requests of events (`running.events`) and algebraic unknowns that need a full search
    after a jump of inputs.
    """

    END = 0
    FULL = 1
    ATTEMPTS = 2
    STEP_TOO_SMALL = 3
    TERMINAL = 4
    STORM = 5
    FOLLOW = 6
    SEARCH = 7


STOPS = tuple(Stop)
"""Reasons by number."""
BATCH, FEW = 32, 8
"""Attempts per call of the virtual machine, and in intervals that need only a few."""


class Engine(Protocol):
    """Engine that runs attempts until the end, a full record, an attempt limit or a tiny step."""

    @property
    def name(self) -> str:
        """Name of the engine: vm or compiled."""
        ...

    def march(self, work: Work, attempts: int) -> tuple[Array, int, Stop]:
        """Advance `work` over its input intervals, and fill its outputs.

        A step below `h_min`, or below the resolution of t (`FLOOR`), stops it.

        Returns:
            Records (overwritten by the next call), the attempts made and the reason to stop.
        """
        ...


@final
class _Batch:
    """Buffers and mapped function for a fixed number of attempts in one call of the virtual
    machine.
    """

    def __init__(self, step: ca.Function, size: int) -> None:
        self.size = size
        self.S, self.S_out = np.zeros(step.numel_in(0)), np.zeros((size, step.numel_in(0)))
        self.R, self.D = np.zeros((size, step.numel_in(1))), np.zeros((size, step.numel_out(1)))
        attempts = step.mapaccum("batch", size)
        self.call = bound(attempts, (self.S, self.R), (self.S_out, self.D))


@final
@dataclass(frozen=True, eq=False)
class VmEngine:
    """Engine in CasADi's virtual machine: batches of attempts in one call; needs no compiler.

    It makes the same attempts as the compiled loop, bit for bit: both evaluate one graph operation
    by
    operation, each rounded once (`compiled.compiler.FLAGS`), with one math library.
    """

    step: ca.Function
    size: int
    follows: bool = False
    name: str = "vm"
    _batches: dict[int, list["_Batch"]] = field(default_factory=dict[int, list["_Batch"]])

    @classmethod
    def of(cls, step: ca.Function, size: int = BATCH, follows: bool = False) -> "VmEngine":
        """Return the engine for a step Function; with `follows`, unknowns follow jumps of
        inputs.
        """
        return cls(step, size, follows)

    def _batch(self, size: int) -> "_Batch":
        """Return a free batch of `size` attempts, to be given back after use."""
        try:
            return self._batches.setdefault(size, []).pop()
        except IndexError:
            return _Batch(self.step, size)

    def _attempts(
        self,
        S: Array,
        R: Array,
        rows: int,
        attempts: int,
        h_min: float,
        events: Eventful | None,
        size: int,
    ) -> tuple[Array, int, Stop]:
        """Advance S; return the records, the attempts made and the reason to stop.

        Events in `events`, if given, are carried out; `size` attempts are made in one call.
        """
        batch, search = self._batch(size), None if events is None else events.search
        S_out, D = batch.S_out, batch.D
        batch.R[:] = R
        found: list[Array] = []
        count = made = 0
        t_end = R[Given.T_END]
        surely = max(h_min, FLOOR * max(abs(t_end), abs(S[State.T])))
        asked = Happened.NOTHING
        while S[State.T] < t_end and count < rows and made < attempts and _large(S, h_min).all():
            if asked or (events is not None and events.full):
                break
            batch.S[:] = S
            batch.call()
            before = np.vstack([S, S_out[:-1]])
            took = S_out[:, State.T] > before[:, State.T]
            used = size
            if not (
                S_out[-1, State.T] < t_end
                and S_out[:, State.H].min() >= surely
                and size <= min(rows - count, attempts - made)
            ):  # discard attempts of the batch that the compiled loop would not make
                room = np.cumsum(took) - took < rows - count
                goes = (before[:, State.T] < t_end) & _large(before, h_min) & room
                used = min(size if goes.all() else int(np.argmin(goes)), attempts - made)
                took[used:] = False
            found.append(
                np.hstack(
                    [
                        before[took, State.T, None],
                        S_out[took, State.T, None],
                        before[took, State.Y],
                        S_out[took, State.Y],
                        D[took],
                    ]
                )
            )
            if search is not None:
                found[-1], used, asked = _searched(search, found[-1], S_out, (took, used), R)
            count += found[-1].shape[0]
            made += used
            S[:] = S_out[used - 1]
        self._batches[size].append(batch)
        n = S.size - State.MEMORY
        records = np.vstack(found) if found else np.zeros((0, width(n, D.shape[1] // n)))
        full = count >= rows or (events is not None and events.full)
        return records, made, Stop(asked) if asked else _reason(S, R, full, h_min)

    def march(self, work: Work, attempts: int) -> tuple[Array, int, Stop]:
        """Advance `work`; return the records, the attempts made and the reason to stop."""
        loop, found, count, made = work.loop, list[Array](), 0, 0
        size = self.size
        if work.events is not None:
            work.events.count = work.events.steps = 0
        while True:
            limits = loop.max_rows - count, attempts - made, loop.h_min
            records, tried, stop = self._attempts(work.S, work.R, *limits, work.events, size)
            size = self.size if tried > FEW else min(self.size, FEW)
            found.append(records)
            count, made = count + records.shape[0], made + tried
            if records.shape[0]:
                work.outputs.fill(pieces_of(records, work.n))
            if stop is not Stop.END or loop.interval + 1 == loop.intervals:
                break
            work.enter(loop.interval + 1)
            if work.events is not None:
                work.events.entered()
            if self.follows:
                stop = Stop.SEARCH
                break
            if count == loop.max_rows or made == attempts:
                stop = Stop.FULL if count == loop.max_rows else Stop.ATTEMPTS
                break
        return found[0] if len(found) == 1 else np.vstack(found), made, stop


def _searched(
    search: Search,
    records: Array,
    S_out: Array,
    attempts: tuple[NDArray[np.bool_], int],
    R: Array,
) -> tuple[Array, int, Happened]:
    """Return the records of a batch up to its first events, the attempts used and the event
    request.

    Args:
        records, S_out: of the batch; the attempt that led to events continues after them.
        attempts: mask of accepted attempts, and how many attempts count.
        R: run data of the batch.
    """
    took, used = attempts
    accepted, i = np.flatnonzero(took), 0
    while (i := i + search.without(records[i:], R)) < accepted.size:
        k = int(accepted[i])
        change, asked = search(records[i], S_out[k], R)
        i += 1
        if change:
            return records[: i - (change is Change.DROPPED)], k + 1, asked
    return records, used, Happened.NOTHING


def _large(S: Array, h_min: float) -> NDArray[np.bool_]:
    """Return True if the steps of columns S (..., MEMORY + n) are long enough; False for NaN."""
    return S[..., State.H] >= np.maximum(h_min, FLOOR * np.abs(S[..., State.T]))


def _reason(S: Array, R: Array, full: bool, h_min: float) -> Stop:
    if S[State.T] >= R[Given.T_END]:
        return Stop.END
    if not _large(S, h_min).all():
        return Stop.STEP_TOO_SMALL
    return Stop.FULL if full else Stop.ATTEMPTS


@final
@dataclass(frozen=True, eq=False)
class CompiledEngine:
    """Engine in a compiled loop around the generated C of the step; releases the GIL."""

    library: ctypes.CDLL
    name: str = "compiled"

    @classmethod
    def of(
        cls,
        step: ca.Function,
        dense_rows: int,
        crossings: Crossings | None = None,
        follows: bool = False,
        follow: Following | None = None,
        source: str = "",
    ) -> "CompiledEngine":
        """Compile the loop of these parts (`loop_source`), or load it from the cache.

        `source` is its C if already generated.
        """
        source = source or loop_source(step, dense_rows, crossings, follows, follow)
        library = load(source, "symfric_march")
        library.symfric_march.restype = ctypes.c_int
        library.symfric_march.argtypes = [ctypes.c_void_p]
        return cls(library)

    def march(self, work: Work, attempts: int) -> tuple[Array, int, Stop]:
        """Advance `work`; return records in its buffer, the attempts made and the reason to
        stop.
        """
        loop, outputs = work.loop, work.outputs
        loop.max_attempts, loop.found = attempts, outputs.found
        reason = self.library.symfric_march(work.address)
        outputs.found = loop.found
        if work.events is not None:
            work.events.count = loop.jumped
        return work.rows[: loop.count], loop.made, STOPS[reason]
