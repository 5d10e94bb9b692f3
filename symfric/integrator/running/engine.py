"""Engines that make many attempts per call, in CasADi's virtual machine or in compiled C.

Both engines advance S in place and write one row (t0, t1, y0, y1, D) per accepted step.

The C is assembled from templates. `attempts.c` makes steps with one set of run data and searches
them for events with `search.c`, which matches `running.events` in Python. `march.c` advances over
the input intervals and writes the unknowns at the times of the result. All data are in one struct,
so that a call from Python passes a single address (`Work`).
"""

import ctypes
from collections.abc import Iterable
from pathlib import Path
from typing import final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.foundation.numeric import Array, address, bound
from symfric.integrator.compiled.columns import filled
from symfric.integrator.compiled.compiler import load
from symfric.integrator.compiled.loops import generated
from symfric.integrator.equations.blocks import Following
from symfric.integrator.equations.initial import FLOOR, SURE
from symfric.integrator.methods.attempt import GROWTH_MEMORY, RRow, SRow
from symfric.integrator.running import crossings as limits
from symfric.integrator.running.contact_modes import TURNING, ContactModes
from symfric.integrator.running.crossings import LOOKS, Crossings
from symfric.integrator.running.events import Change, Eventful, Search, Stop
from symfric.integrator.running.record import Dense, Outputs, Record

STOPS = tuple(Stop)
"""Reasons to stop, by number."""
MOST_ROWS, LEAST_ROWS, BYTES = 2048, 64, 2**20
"""Largest and smallest number of accepted steps in a buffer, and its size in bytes.

The buffer is kept between runs.
"""
BATCH, FEW = 32, 8
"""Attempts per call of the virtual machine, in general and on intervals that need only a few."""


class LoopStruct(ctypes.Structure):
    """Struct `symfric_loop` of the C code, field by field."""

    _fields_ = (
        *(
            (name, ctypes.c_void_p)
            for name in ("S", "R", "rows", "times", "out", "breaks", "data", "memory", "jumps",
                         "reach")
        ),
        ("h_min", ctypes.c_double),
        *(
            (name, ctypes.c_longlong)
            for name in ("max_rows", "max_attempts", "max_jumps", "n_times", "found", "intervals",
                         "interval", "n_data", "count", "made", "jumped")
        ),
    )  # fmt: skip


@final
class Work:
    """Buffers of one run, shared with the engines; reused by later runs.

    Attributes:
        S, R: memory and unknowns of the step, and the constant data of an attempt.
        rows: buffer of records.
        reach: smallest and largest unknowns at the start and at the ends of steps, shape (2, n).
        loop: counters, limits and addresses.
        outputs: requested values at given times.
        events: state of the event search; None for a model without events.
    """

    def __init__(
        self, n: int, given: int, dense_rows: int, rows: int | None = None,
        events: Eventful | None = None,
    ) -> None:  # fmt: skip
        self.n, width = n, Record(n, dense_rows).width
        if rows is None:
            rows = max(LEAST_ROWS, min(MOST_ROWS, BYTES // (8 * width)))
        self.S, self.R = np.zeros(SRow.MEMORY + n), np.zeros(given)
        self.rows, self.reach = np.empty((rows, width)), np.zeros((2, n))
        self.loop = LoopStruct(
            S=self.S.ctypes.data, R=self.R.ctypes.data, rows=self.rows.ctypes.data, max_rows=rows,
            reach=self.reach.ctypes.data,
        )  # fmt: skip
        self.address = ctypes.addressof(self.loop)
        self.outputs: Outputs = Outputs.at(np.zeros(0), n)
        self.breaks, self.data = np.zeros(2), np.zeros((0, 1))
        self.events = events
        if events is not None:
            self.loop.memory, self.loop.jumps, self.loop.max_jumps = events.pointers

    def begin(self, t: float, h: float, y: Array) -> None:
        """Start at time `t` [s] from the unknowns `y` with the step `h` [s]."""
        self.S[: SRow.MEMORY] = SRow.fresh(t, h)
        self.S[SRow.Y] = self.reach[:] = y

    def over(self, breaks: Array, data: Array) -> None:
        """Set the input intervals: `breaks` (k + 1,) and the `data` (n_data, k) on each of them."""
        loop, self.breaks, self.data = self.loop, breaks, data
        loop.intervals, loop.n_data = breaks.size - 1, data.shape[0]
        if breaks.size > 2:
            self.breaks, self.data = np.ascontiguousarray(breaks), np.ascontiguousarray(data)
            loop.breaks, loop.data = address(self.breaks), address(self.data)
        self.enter(0)

    def enter(self, interval: int) -> None:
        """Start an input interval: set its end and its data."""
        self.loop.interval = interval
        self.R[RRow.T_END] = self.breaks[interval + 1]
        if self.data.shape[0]:
            self.R[-self.data.shape[0] :] = self.data[:, interval]

    def want(self, outputs: Outputs) -> None:
        """Set the `outputs` to fill."""
        loop, self.outputs = self.loop, outputs
        loop.n_times = outputs.times.size
        loop.times, loop.out = address(outputs.times), address(outputs.values)


class _Batch:
    """Buffers and mapped Function for a fixed number of attempts per virtual machine call."""

    def __init__(self, step: ca.Function, size: int) -> None:
        self.S, self.S_out = np.zeros(step.numel_in(0)), np.zeros((size, step.numel_in(0)))
        self.R, self.D = np.zeros((size, step.numel_in(1))), np.zeros((size, step.numel_out(1)))
        attempts = step.mapaccum("batch", size)
        self.call = bound(attempts, (self.S, self.R), (self.S_out, self.D))


@final
class VmEngine:
    """Engine in CasADi's virtual machine, with a batch of attempts per call; it needs no compiler.

    It makes the same attempts as the compiled loop, bit for bit: both evaluate one graph operation
    by operation, round each operation once (`compiled.compiler.FLAGS`), and use the same math
    library.
    """

    name = "vm"

    def __init__(self, step: ca.Function, size: int = BATCH, follows: bool = False) -> None:
        self.step, self.size, self.follows = step, size, follows
        self._batches: dict[int, list[_Batch]] = {}

    def _attempts(self, work: Work, rows: int, attempts: int, size: int) -> tuple[Array, int, Stop]:
        """Advance S; return the records, the attempts made and the reason to stop.

        S advances up to the end time in R, by `size` attempts per call.
        """
        try:
            batch = self._batches.setdefault(size, []).pop()
        except IndexError:
            batch = _Batch(self.step, size)
        S, R, events, h_min = work.S, work.R, work.events, work.loop.h_min
        S_out, D, t_end = batch.S_out, batch.D, R[RRow.T_END]
        batch.R[:] = R
        surely = max(h_min, FLOOR * max(abs(t_end), abs(S[SRow.T])))
        found, count, made, request = list[Array](), 0, 0, None
        while S[SRow.T] < t_end and count < rows and made < attempts and _large(S, h_min).all():
            if request or (events is not None and events.full):
                break
            batch.S[:] = S
            batch.call()
            before = np.vstack([S, S_out[:-1]])
            took = S_out[:, SRow.T] > before[:, SRow.T]
            used = size
            if not (
                S_out[-1, SRow.T] < t_end
                and S_out[:, SRow.H].min() >= surely
                and size <= min(rows - count, attempts - made)
            ):  # discard attempts of the batch that the compiled loop would not make
                fits = np.cumsum(took) - took < rows - count
                goes = (before[:, SRow.T] < t_end) & _large(before, h_min) & fits
                used = min(size if goes.all() else int(np.argmin(goes)), attempts - made)
                took[used:] = False
            times = before[took, SRow.T, None], S_out[took, SRow.T, None]
            found.append(np.hstack([*times, before[took, SRow.Y], S_out[took, SRow.Y], D[took]]))
            if events is not None:
                found[-1], used, request = _searched(events.search, found[-1], S_out, took, used, R)
            count += found[-1].shape[0]
            made += used
            S[:] = S_out[used - 1]
        self._batches[size].append(batch)
        records = np.vstack([work.rows[:0], *found]) if len(found) != 1 else found[0]
        if request is None:
            request = Stop.ATTEMPTS
            if S[SRow.T] >= t_end:
                request = Stop.END
            elif not _large(S, h_min).all():
                request = Stop.STEP_TOO_SMALL
            elif count >= rows or (events is not None and events.full):
                request = Stop.FULL
        return records, made, request

    def march(self, work: Work, attempts: int) -> tuple[Array, int, Stop]:
        """Advance `work`; return the records, the number of attempts and the reason to stop."""
        loop, found, count, made = work.loop, list[Array](), 0, 0
        size = self.size
        if work.events is not None:
            work.events.count = work.events.steps = 0
        while True:
            left = loop.max_rows - count, attempts - made
            records, tried, stop = self._attempts(work, *left, size)
            size = self.size if tried > FEW else min(self.size, FEW)
            found.append(records)
            count, made = count + records.shape[0], made + tried
            if records.shape[0]:
                piece = Dense.of(records, work.n)
                work.outputs.fill(piece)
                np.minimum(work.reach[0], piece.y1.min(axis=0), out=work.reach[0])
                np.maximum(work.reach[1], piece.y1.max(axis=0), out=work.reach[1])
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
    search: Search, records: Array, S_out: Array, took: NDArray[np.bool_], used: int, R: Array
) -> tuple[Array, int, Stop | None]:
    """Return the records of a batch up to its first events, the attempts used, and any request.

    Args:
        search: event search.
        records, S_out: accepted steps and states of the batch; the state of the attempt with events
            is changed to continue after them.
        took, used: mask of accepted attempts, and number of attempts that count.
        R: run data of the batch.
    """
    accepted, i = np.flatnonzero(took), 0
    while (i := i + search.without(records[i:], R)) < accepted.size:
        k = int(accepted[i])
        change, request = search(records[i], S_out[k], R)
        i += 1
        if change:
            return records[: i - (change is Change.DROPPED)], k + 1, request
    return records, used, None


def _large(S: Array, h_min: float) -> NDArray[np.bool_]:
    """Return a mask of the columns S (..., MEMORY + n) with long enough steps; False for NaN."""
    return S[..., SRow.H] >= np.maximum(h_min, FLOOR * np.abs(S[..., SRow.T]))


@final
class CompiledEngine:
    """Engine in compiled C, a loop around the generated C of the step; it releases the GIL."""

    name = "compiled"

    def __init__(self, source: str) -> None:
        """Compile the `loop_source`, or load it from the cache."""
        self.library = load(source, "symfric_march")
        self.library.symfric_march.restype = ctypes.c_int
        self.library.symfric_march.argtypes = [ctypes.c_void_p]

    def march(self, work: Work, attempts: int) -> tuple[Array, int, Stop]:
        """Advance `work`; return records in its buffer, number of attempts and reason to stop."""
        loop, outputs = work.loop, work.outputs
        loop.max_attempts, loop.found = attempts, outputs.found
        reason = self.library.symfric_march(work.address)
        outputs.found = loop.found
        if work.events is not None:
            work.events.count = loop.jumped
        return work.rows[: loop.count], loop.made, STOPS[reason]


Engine = VmEngine | CompiledEngine
"""Engine that makes attempts until it has to stop.

It stops at the end, a full record, an attempt limit, an event that the caller has to handle, or a
step below `h_min` or the resolution of t (`FLOOR`).
"""
FOLDER = Path(__file__).parent


def c_source(
    step: ca.Function, dense_rows: int, *others: ca.Function, crossings: Crossings | None = None
) -> str:
    """Return the CasADi C of the step, with the attempt loop that calls it until it must stop.

    `others` are Functions that other C code calls by name. Without events, the code contains no
    event search.
    """
    called = (step, *(crossings.functions if crossings else ()))
    n, given = step.numel_in(0) - SRow.MEMORY, step.numel_in(1)
    attempts = filled(
        FOLDER / "attempts.c", *called,
        n=n, memory=SRow.MEMORY, t=SRow.T, h=SRow.H, t_end=RRow.T_END, given=given,
        width=Record(n, dense_rows).width, dense=2 + 2 * n, dense_rows=dense_rows, floor=FLOOR,
        jump=crossings.width if crossings else 0, searches=int(crossings is not None),
    )  # fmt: skip
    search = "" if crossings is None else search_source(crossings, given)
    return generated("symfric_step", *called, *others) + search + attempts


def loop_source(
    step: ca.Function,
    dense_rows: int,
    crossings: Crossings | None = None,
    follows: bool = False,
    follow: Following | None = None,
    modes: ContactModes | None = None,
) -> str:
    """Return the C of the whole loop.

    Args:
        step, dense_rows: Function of one attempt, and number of rows of its dense output.
        crossings: Functions of the events, if any.
        follows: True if there are algebraic unknowns, which have to follow a jump of inputs.
        follow: update of these unknowns; without it, the loop returns at each jump and each event.
        modes: decision of the modes of several contacts; without it, the loop returns for it.
    """
    settles = follow is not None and crossings is not None and not crossings.closes
    march = filled(
        FOLDER / "march.c",
        follows=0 if not follows else 1 if follow is None else 2,
        settles=int(settles),
        decides=int(modes is not None),
        decide="" if modes is None or crossings is None else decide_source(modes, crossings),
        data=follow.round.numel_in(1) if follow else crossings.data if crossings else 0,
    )
    others = [*([] if follow is None else [follow.round]), *([] if modes is None else [modes.look])]
    source = c_source(step, dense_rows, *others, crossings=crossings)
    return source + ("" if follow is None else follow.c_source) + march


def decide_source(modes: ContactModes, crossings: Crossings) -> str:
    """Return the C of the decision of the modes of several contacts."""
    return filled(
        FOLDER / "decide.c", modes.look,
        contacts=len(modes.contacts), at=_table(c.mode for c in modes.contacts),
        still=", ".join(map(repr, modes.still.tolist())), turning=TURNING,
        decided=_table(crossings.decided),
    )  # fmt: skip


def search_source(crossings: Crossings, given: int, *, decides: bool = True) -> str:
    """Return the C of the event search in an accepted step; `given` is the length of R.

    `decides`: True if the caller decides the modes of several contacts together.
    """
    record, resets = crossings.record, crossings.resets
    changes = [own if decides else 0 for own in crossings.changes]
    return filled(
        FOLDER / "search.c", *crossings.functions,
        n=record.n, row=record.width, y0=record.y0.start, y1=record.y1.start,
        events=crossings.count, resets=len(resets),
        directions=_table(crossings.directions), terminal=_table(crossings.terminal),
        changes=_table(changes),
        by_event=_table(i for i, _ in resets), of_state=_table(j for _, j in resets),
        follows=int(crossings.follows),
        looks=len(LOOKS) - 1, at_looks=", ".join(map(repr, LOOKS)), kept=limits.KEPT,
        alike=limits.ALIKE, finer=limits.FINER, sharper=limits.SHARPER, soon=limits.SOON,
        straight=limits.STRAIGHT, restart=limits.RESTART, least=limits.LEAST, sure=SURE,
        growth=GROWTH_MEMORY, memory=SRow.MEMORY, d=given - crossings.data, h_max=RRow.H_MAX,
    )  # fmt: skip


def _table(values: Iterable[int]) -> str:
    """Return the entries of a C array, at least one."""
    return ", ".join(str(int(value)) for value in values) or "0"
