"""Compiled loop around the step, assembled from C templates: attempts, events, outputs, intervals.

`attempts.c` makes steps with one set of run data and searches them for events with `search.c`,
which matches `running.events` in Python. `march.c` advances over the input intervals and writes the
unknowns at the times of the result. All data are in one struct, so a call from Python passes a
single address (`Work`). Names that begin with a dollar in the templates are substituted.
"""

import ctypes
from collections.abc import Iterable
from pathlib import Path
from string import Template
from typing import final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.foundation.numeric import address
from symfric.integrator.equations.blocks import Following
from symfric.integrator.equations.initial import FLOOR, SURE
from symfric.integrator.running.crossings import (
    ALIKE,
    FINER,
    KEPT,
    LEAST,
    LOOKS,
    RESTART,
    SHARPER,
    SOON,
    STRAIGHT,
    Crossings,
)
from symfric.integrator.running.events import Eventful
from symfric.integrator.running.record import Outputs
from symfric.integrator.step.layout import GROWTH_MEMORY, Given, State

Array = NDArray[np.float64]
MOST_ROWS, LEAST_ROWS, BYTES = 2048, 64, 2**20
"""Limits of accepted steps in a buffer, and its size in bytes; the buffer is kept between runs."""


def width(n: int, dense_rows: int) -> int:
    """Return the length of a record row (t0, t1, y0, y1, D)."""
    return 2 + 2 * n + dense_rows * n


class Loop(ctypes.Structure):
    """Struct `symfric_loop` of the C code, field by field."""

    _fields_ = (
        *(
            (name, ctypes.c_void_p)
            for name in ("S", "R", "rows", "times", "out", "breaks", "data", "memory", "jumps")
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
        loop: counters, limits and addresses.
        outputs: requested values at given times.
        events: state of the event search; None for a model without events.
    """

    def __init__(self, n: int, given: int, dense_rows: int, rows: int | None = None) -> None:
        self.n = n
        if rows is None:
            rows = max(LEAST_ROWS, min(MOST_ROWS, BYTES // (8 * width(n, dense_rows))))
        self.S, self.R = np.zeros(State.MEMORY + n), np.zeros(given)
        self.rows = np.empty((rows, width(n, dense_rows)))
        self.loop = Loop(
            S=self.S.ctypes.data, R=self.R.ctypes.data, rows=self.rows.ctypes.data, max_rows=rows
        )
        self.address = ctypes.addressof(self.loop)
        self.outputs: Outputs = Outputs.at(np.zeros(0), n)
        self.events: Eventful | None = None
        self.breaks, self.data = np.zeros(2), np.zeros((0, 1))

    def over(self, breaks: Array, data: Array) -> None:
        """Set the input intervals: `breaks` (k + 1,) and the `data` (n_data, k) on each of them."""
        loop, self.breaks, self.data = self.loop, breaks, data
        loop.intervals, loop.n_data = breaks.size - 1, data.shape[0]
        if breaks.size > 2:
            self.breaks, self.data = np.ascontiguousarray(breaks), np.ascontiguousarray(data)
            loop.breaks, loop.data = self.breaks.ctypes.data, self.data.ctypes.data
        self.enter(0)

    def interval(self, times: Array) -> NDArray[np.intp]:
        """Return the index of the input interval of each time; at a break the later one."""
        return np.searchsorted(self.breaks[1:-1], times, side="right")

    def enter(self, interval: int) -> None:
        """Start an input interval: set its end and its data."""
        self.loop.interval = interval
        self.R[Given.T_END] = self.breaks[interval + 1]
        if self.data.shape[0]:
            self.R[-self.data.shape[0] :] = self.data[:, interval]

    def want(self, outputs: Outputs, events: Eventful | None) -> None:
        """Set the `outputs` to fill and the `events` to carry out."""
        loop, self.outputs, self.events = self.loop, outputs, events
        loop.n_times = outputs.times.size
        loop.times, loop.out = address(outputs.times), address(outputs.values)
        if events is not None:
            loop.memory, loop.jumps, loop.max_jumps = events.pointers


def filled(name: str, /, **numbers: object) -> str:
    """Return the C of a template of this folder with `numbers` substituted."""
    text = Path(__file__).with_name(name).read_text(encoding="utf-8")
    return Template(text).substitute(numbers)


def c_source(
    step: ca.Function,
    dense_rows: int,
    *others: ca.Function,
    crossings: Crossings | None = None,
) -> str:
    """Return the CasADi C of the step with the attempt loop that calls it until it must stop.

    `others` are Functions that further C calls by name. Without events, the code has no event
    search.
    """
    generator = ca.CodeGenerator("symfric_step.c", {"static_aux": True})
    called = (step, *(crossings.functions if crossings else ()))
    for function in (*called, *others):
        generator.add(function)
    n, given = step.numel_in(0) - State.MEMORY, step.numel_in(1)
    attempts = filled(
        "attempts.c",
        n=n, memory=State.MEMORY, t=State.T, h=State.H, t_end=Given.T_END, given=given,
        width=width(n, dense_rows), dense=2 + 2 * n, dense_rows=dense_rows, floor=repr(FLOOR),
        jump=crossings.width if crossings else 0, searches=int(crossings is not None),
        arg=step.sz_arg(), res=step.sz_res(),
        iw=max(1, *(f.sz_iw() for f in called)), w=max(1, *(f.sz_w() for f in called)),
    )  # fmt: skip
    return generator.dump() + search_source(crossings, given) + attempts


def loop_source(
    step: ca.Function,
    dense_rows: int,
    crossings: Crossings | None = None,
    follows: bool = False,
    follow: Following | None = None,
) -> str:
    """Return the C of the whole loop.

    Args:
        step, dense_rows: one attempt.
        crossings: events.
        follows: True if there are algebraic unknowns, which follow a jump of inputs.
        follow: update of these unknowns; without it the loop returns at each jump and each event.
    """
    others = () if follow is None else (follow.round,)
    march = filled(
        "march.c",
        follows=0 if not follows else 1 if follow is None else 2,
        settles=int(follow is not None and crossings is not None and not crossings.closes),
        data=0 if follow is None else follow.round.numel_in(1),
    )
    jump = "" if follow is None else follow.c_source
    return c_source(step, dense_rows, *others, crossings=crossings) + jump + march


def search_source(crossings: Crossings | None, given: int) -> str:
    """Return the C of the event search in an accepted step, empty without events.

    `given` is the length of R.
    """
    if crossings is None:
        return ""
    functions, m = crossings.functions, len(crossings.resets)
    return filled(
        "search.c",
        n=crossings.record.n,
        events=crossings.count,
        looks=len(LOOKS) - 1,
        resets=m,
        row=crossings.record.width,
        y0=crossings.record.y0.start,
        y1=crossings.record.y1.start,
        at_looks=", ".join(map(repr, LOOKS)),
        directions=_table(crossings.directions),
        terminal=_table(crossings.terminal),
        by_event=_table(i for i, _ in crossings.resets),
        of_state=_table(j for _, j in crossings.resets),
        kept=KEPT,
        alike=ALIKE,
        finer=FINER,
        sharper=repr(SHARPER),
        soon=repr(SOON),
        straight=repr(STRAIGHT),
        restart=repr(RESTART),
        least=repr(LEAST),
        sure=repr(SURE),
        growth=repr(GROWTH_MEMORY),
        memory=State.MEMORY,
        d=given - crossings.data,
        h_max=Given.H_MAX,
        follows=int(crossings.follows),
        arg=max(f.sz_arg() for f in functions),
        res=max(f.sz_res() for f in functions),
    )


def _table(values: Iterable[int]) -> str:
    """Return the entries of a C array, at least one."""
    return ", ".join(str(int(value)) for value in values) or "0"
