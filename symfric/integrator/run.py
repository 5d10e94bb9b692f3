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
from symfric.integrator.events import Crossing, EventStorm, first_crossing, resets
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
            d = np.concatenate([p, inputs.values[:, k]])
            R = np.concatenate([[inputs.breaks[k + 1], tolerances.rtol], tolerances.atol, d])
            _interval(
                integrator, run, S, R, d, tolerances, backend, storm, t_start, t_end, progress
            )
            if run.status is not Status.SUCCESS or S[0] < inputs.breaks[k + 1]:
                break
    except KeyboardInterrupt:
        run.stop(Status.INTERRUPTED, f"{Status.INTERRUPTED.value} It reaches t = {S[0]:g} s.")
    if not run.dense:
        empty = np.zeros((1, integrator.tableau.H.shape[0] or 2, y.size))
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
) -> None:
    """Integrate over one input interval, on which `d` is constant."""
    eventful = bool(integrator.model.events)
    n = integrator.system.n
    fired: frozenset[int] = frozenset()
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
        piece = from_records(records, n, integrator.slope, d)
        crossing = (
            first_crossing(integrator, piece, d, fired, tolerances.event) if eventful else None
        )
        if crossing is None:
            run.keep(piece)
            fired = frozenset() if piece.t0.size else fired
            if reason is Stop.STEP_TOO_SMALL:
                run.stop(*explain(integrator, S[0], S[MEMORY:], d, S[1]))
                return
        else:
            fired = _happen(integrator, run, S, R, d, piece, crossing, tolerances, storm)
            if run.status is not Status.SUCCESS or not fired:
                return
        if progress is not None:
            progress((S[0] - t_start) / (t_end - t_start))


def _happen(
    integrator: Integrator,
    run: Run,
    S: Array,
    R: Array,
    d: Array,
    piece: Dense,
    crossing: Crossing,
    tolerances: Tolerances,
    storm: EventStorm,
) -> frozenset[int]:
    """Cut the run at an event, apply its reset and go on from there; empty when it is the end."""
    events = integrator.model.events
    run.keep(crossing.before(piece))
    y = resets(integrator, crossing, d)
    run.happened += [(crossing.t, events[i].name) for i in crossing.which]
    S[0], S[4], S[MEMORY:] = crossing.t, 0.0, y
    if any(events[i].terminal for i in crossing.which):
        run.stop(Status.TERMINATED)
        return frozenset()
    if storm.raged_at(crossing.t, crossing.which):
        run.stop(
            Status.EVENT_STORM,
            f"{Status.EVENT_STORM.value} It stands at t = {crossing.t:.9g} s, "
            f"event '{events[crossing.which[0]].name}'.",
        )
        return frozenset()
    S[MEMORY:] = consistent(integrator.system, f"model '{integrator.model.name}'", y, d)
    # the old step size is a guess only: what follows may be faster
    S[1] = max(min(S[1], tolerances.event * 1e3), 1e-3 * S[1])
    S[2], S[3] = S[1], GROWTH_MEMORY
    return frozenset(crossing.which)
