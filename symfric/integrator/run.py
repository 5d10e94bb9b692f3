"""Drive an integrator from start to end: input intervals, events, progress, failures."""

from collections.abc import Callable
from dataclasses import dataclass, field
from time import perf_counter
from typing import final

import numpy as np
from numpy.typing import NDArray

from symfric.integrator.dense import Dense, from_records, join
from symfric.integrator.diagnosis import explain
from symfric.integrator.engine import Stop
from symfric.integrator.events import (
    Crossing,
    EventStorm,
    first_crossing,
    resets,
    values,
)
from symfric.integrator.initial import consistent, first_step
from symfric.integrator.inputs import Drivers
from symfric.integrator.integrator import Integrator
from symfric.integrator.step import GROWTH_MEMORY, MEMORY
from symfric.status import Status

Array = NDArray[np.float64]
ROWS, EVENT_ROWS = 2048, 64
ATTEMPTS = {"vm": 2_000, "compiled": 50_000}
"""Attempts between two looks at progress and interrupts: tens of milliseconds."""


@final
@dataclass(frozen=True, eq=False)
class Tolerances:
    """What a run has to meet.

    Attributes:
        rtol: relative tolerance.
        atol: absolute tolerance of each state, shape (nx,).
        event: tolerance of event times [s].
        max_steps: attempts allowed.
    """

    rtol: float
    atol: Array
    event: float
    max_steps: int


@final
@dataclass(eq=False)
class Run:
    """What a run has produced so far; a mutable record that survives interrupts and failures."""

    dense: list[Dense] = field(default_factory=list[Dense])
    happened: list[tuple[float, str]] = field(default_factory=list[tuple[float, str]])
    steps: int = 0
    attempts: int = 0
    smallest: float = np.inf
    engine: str = ""
    status: Status = Status.SUCCESS
    message: str = Status.SUCCESS.value

    def keep(self, piece: Dense) -> None:
        """Add accepted steps."""
        if piece.t0.size:
            self.dense.append(piece)
            self.steps += piece.t0.size
            self.smallest = min(self.smallest, float((piece.t1 - piece.t0).min()))

    def stop(self, status: Status, message: str | None = None) -> None:
        """End with `status`."""
        self.status, self.message = status, message or status.value


def integrate(
    integrator: Integrator,
    inputs: Drivers,
    y0: Array,
    p: Array,
    tolerances: Tolerances,
    backend: str,
    progress: Callable[[float], None] | None,
) -> tuple[Run, Dense]:
    """Integrate over all input intervals; the result holds whatever was reached."""
    run = Run()
    t_start, t_end = float(inputs.breaks[0]), float(inputs.breaks[-1])
    d = np.concatenate([p, inputs.values[:, 0]])
    y = consistent(integrator.system, f"model '{integrator.model.name}'", y0, d)
    h = first_step(t_end - t_start)
    S = np.concatenate([[t_start, h, h, GROWTH_MEMORY, 0.0], y])
    storm = EventStorm(t_end - t_start, tolerances.event)
    try:
        for k in range(inputs.breaks.size - 1):
            before, d = d, np.concatenate([p, inputs.values[:, k]])
            old = _jump(integrator, run, S, before, d) if k else None
            if run.status is not Status.SUCCESS:
                break
            R = np.concatenate([[inputs.breaks[k + 1], tolerances.rtol], tolerances.atol, d])
            _interval(
                integrator,
                run,
                S,
                R,
                d,
                tolerances,
                backend,
                storm,
                t_start,
                t_end,
                progress,
                old,
            )
            if run.status is not Status.SUCCESS or S[0] < inputs.breaks[k + 1]:
                break
    except KeyboardInterrupt:
        run.stop(Status.INTERRUPTED, f"{Status.INTERRUPTED.value} It reaches t = {S[0]:g} s.")
    if not run.dense:
        empty = np.zeros((1, integrator.tableau.H.shape[0], y.size))
        start = np.array([t_start])
        run.dense.append(Dense(start, start + 1e-300, y[None], y[None], empty))
    return run, join(run.dense)


def _interval(
    integrator: Integrator,
    run: Run,
    S: Array,
    R: Array,
    d: Array,
    tolerances: Tolerances,
    backend: str,
    storm: EventStorm,
    t_start: float,
    t_end: float,
    progress: Callable[[float], None] | None,
    old: Array | None,
) -> None:
    """Integrate over one input interval, on which `d` is constant.

    `old` holds the values of the event expressions before the jump that led here, if one did.
    """
    eventful = bool(integrator.model.events)
    n = integrator.system.n
    h_min = 1e-15 * max(abs(t_start), abs(t_end), 1e-3)
    left = 0.0
    while S[0] < R[0]:
        engine = integrator.choose(backend, left)
        run.engine = engine.name
        allowed = min(ATTEMPTS[engine.name], tolerances.max_steps - run.attempts)
        if allowed <= 0:
            run.stop(Status.MAX_STEPS, f"{Status.MAX_STEPS.value} It stands at t = {S[0]:g} s.")
            return
        began, from_t = perf_counter(), S[0]
        records, made, reason = engine.run(S, R, EVENT_ROWS if eventful else ROWS, allowed, h_min)
        run.attempts += made
        if engine.name == "vm":
            spent = perf_counter() - began
            integrator.vm_time += spent
            advance = S[0] - from_t
            left = spent * (t_end - S[0]) / advance if advance > 0 else left
        piece = from_records(records, n)
        crossing = first_crossing(integrator, piece, d, old, tolerances.event) if eventful else None
        if crossing is None:
            run.keep(piece)
            old = None if piece.t0.size else old
            if reason is Stop.STEP_TOO_SMALL:
                run.stop(*explain(integrator, S[0], S[MEMORY:], d, S[1]))
                return
        else:
            old = _happen(integrator, run, S, d, piece, crossing, tolerances, storm)
            if run.status is not Status.SUCCESS:
                return
        if progress is not None:
            progress((S[0] - t_start) / (t_end - t_start))


def _happen(
    integrator: Integrator,
    run: Run,
    S: Array,
    d: Array,
    piece: Dense,
    crossing: Crossing,
    tolerances: Tolerances,
    storm: EventStorm,
) -> Array:
    """Cut the run at an event, carry it out and go on from there."""
    run.keep(crossing.before(piece))
    # steps beyond the event say nothing; its own is a guess only, what follows may be faster
    h = float(piece.t1[crossing.step] - piece.t0[crossing.step])
    h = max(min(h, tolerances.event * 1e3), 1e-3 * h)
    S[:MEMORY] = crossing.t, h, h, GROWTH_MEMORY, 0.0
    S[MEMORY:] = crossing.y
    return _carry_out(integrator, run, S, d, crossing.which, storm)


def _jump(integrator: Integrator, run: Run, S: Array, before: Array, d: Array) -> Array | None:
    """Take over new input data, which algebraic unknowns follow; event values before them."""
    old = values(integrator, S[0], S[MEMORY:], before) if integrator.model.events else None
    _make_consistent(integrator, run, S, d)
    return old


def _carry_out(
    integrator: Integrator, run: Run, S: Array, d: Array, which: tuple[int, ...], storm: EventStorm
) -> Array:
    """Apply the resets of the events `which`; event values before them, NaN for themselves."""
    events, t = integrator.model.events, float(S[0])
    old = values(integrator, t, S[MEMORY:], d)
    old[list(which)] = np.nan
    S[MEMORY:] = resets(integrator, t, S[MEMORY:], d, which)
    run.happened += [(t, events[i].name) for i in which]
    if any(events[i].terminal for i in which):
        run.stop(Status.TERMINATED)
    elif storm.raged_at(t, which):
        run.stop(
            Status.EVENT_STORM,
            f"{Status.EVENT_STORM.value} It stands at t = {t:.9g} s, "
            f"event '{events[which[0]].name}'.",
        )
    else:
        _make_consistent(integrator, run, S, d)
    return old


def _make_consistent(integrator: Integrator, run: Run, S: Array, d: Array) -> None:
    """Let the algebraic unknowns follow a jump, or stop the run where they cannot."""
    where = f"simulate '{integrator.model.name}' at t = {S[0]:.9g} s"
    try:
        S[MEMORY:] = consistent(integrator.system, where, S[MEMORY:], d)
    except ValueError as error:
        run.stop(Status.SINGULAR, str(error))
