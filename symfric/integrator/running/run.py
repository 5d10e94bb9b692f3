"""Drive an integrator from start to end: input intervals, events, progress, failures."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from time import perf_counter
from typing import final

import numpy as np
from numpy.typing import NDArray

from symfric.foundation.status import Status
from symfric.integrator.equations.initial import consistent, first_step, smallest_step
from symfric.integrator.equations.inputs import InputData
from symfric.integrator.running.dense import Dense, from_records, join
from symfric.integrator.running.diagnosis import explain
from symfric.integrator.running.engine import Stop
from symfric.integrator.running.events import (
    Crossing,
    EventStorm,
    first_crossing,
    resets,
    values,
)
from symfric.integrator.running.integrator import Integrator
from symfric.integrator.running.sizes import ROUNDS, ample, finer, sizes
from symfric.integrator.step.layout import Given, State

Array = NDArray[np.float64]
PACES = 8
"""Straight pieces of an input that a step may pass with events, which look at its quarters."""

ROWS, EVENT_ROWS = 2048, 64
ATTEMPTS = {"vm": 2_000, "compiled": 50_000}
"""Attempts between two looks at progress and interrupts: tens of milliseconds."""
MOST_ORDERS = 8
"""How often pivots are replaced in a run."""


@final
@dataclass(frozen=True, eq=False)
class Tolerances:
    """What a run has to meet.

    Attributes:
        rtol: relative tolerance.
        atol: absolute tolerance of each state, shape (nx,).
        event: tolerance of event times [s].
        max_steps: attempts allowed.
        max_step: longest step [s].
        follow: whether `atol` shrinks to the size of a motion that is tiny.
    """

    rtol: float
    atol: Array
    event: float
    max_steps: int
    max_step: float = np.inf
    follow: bool = False

    def given(self, t_end: float, d: Array) -> Array:
        """What an attempt towards `t_end` does not change, for run data d (..., n_d)."""
        return Given.of(t_end, self.rtol, self.max_step, self.atol, d)


@final
@dataclass(eq=False)
class Run:
    """What a run has produced so far; a mutable record that survives interrupts and failures.

    `integrator` is the one it ended with: pivots that fail on the way are replaced.
    """

    dense: list[Dense] = field(default_factory=list[Dense])
    happened: list[tuple[float, str]] = field(default_factory=list[tuple[float, str]])
    steps: int = 0
    attempts: int = 0
    smallest: float = np.inf
    engine: str = ""
    integrator: Integrator | None = None
    status: Status = Status.SUCCESS
    message: str = Status.SUCCESS.value

    def keep(self, piece: Dense) -> None:
        """Append accepted steps with their continuous solution, and count them."""
        if piece.t0.size:
            self.dense.append(piece)
            self.steps += piece.t0.size
            self.smallest = min(self.smallest, float((piece.t1 - piece.t0).min()))

    def stop(self, status: Status, message: str | None = None) -> None:
        """End the run with `status`, said in `message` or in the sentence of the status."""
        self.status, self.message = status, message or status.value


def integrate(
    integrator: Integrator,
    inputs: InputData,
    y0: Array,
    p: Array,
    tolerances: Tolerances,
    backend: str,
    progress: Callable[[float], None] | None,
) -> tuple[Run, Dense]:
    """Integrate over all input intervals; the result holds whatever was reached.

    A motion that turns out to be tiny is integrated again on its own scale (`sizes`).
    """
    nominal = integrator.system.nominal
    if integrator.model.events and inputs.pace < tolerances.max_step / PACES:
        # where a machine rests, nothing but its events tells that an input has become too strong
        tolerances = replace(tolerances, max_step=PACES * inputs.pace)
    scale, allowed = nominal, tolerances
    run, dense = _integrated(integrator, inputs, y0, p, allowed, backend, progress)
    for _ in range(ROUNDS if tolerances.follow and not ample(dense, nominal) else 0):
        own = finer(scale, sizes(dense, nominal.size), nominal)
        if own is None or not run.status.ok:
            break
        scale, allowed = own, replace(tolerances, atol=tolerances.atol * own / nominal)
        again = _integrated(run.integrator or integrator, inputs, y0, p, allowed, backend, None)
        if not again[0].status.ok and again[0].status is not Status.INTERRUPTED:
            why = again[0].message
            run.message += f" Motions that are tiny were not resolved on their own scale: {why}"
            break
        run, dense = again
    return run, dense


def _integrated(
    integrator: Integrator,
    inputs: InputData,
    y0: Array,
    p: Array,
    tolerances: Tolerances,
    backend: str,
    progress: Callable[[float], None] | None,
) -> tuple[Run, Dense]:
    """One run over all input intervals."""
    d = np.concatenate([p, inputs.values[:, 0]])
    y = integrator.start(y0, d)
    march = _March(integrator, inputs, tolerances, backend, progress, y)
    try:
        march.whole(p)
    except KeyboardInterrupt:
        reached = f"{Status.INTERRUPTED.value} It reaches t = {march.t:g} s."
        march.run.stop(Status.INTERRUPTED, reached)
    run = march.run
    run.integrator = march.integrator
    if not run.dense:
        empty = np.zeros((1, integrator.tableau.H.shape[0], y.size))
        start = inputs.breaks[:1]
        run.dense.append(Dense(start, start + 1e-300, y[None], y[None], empty))
    return run, join(run.dense)


@final
class _March:
    """One run under way: the step's memory and unknowns S, and what it has produced."""

    def __init__(
        self,
        integrator: Integrator,
        inputs: InputData,
        tolerances: Tolerances,
        backend: str,
        progress: Callable[[float], None] | None,
        y: Array,
    ) -> None:
        self.integrator, self.inputs, self.tolerances = integrator, inputs, tolerances
        self.backend, self.progress = backend, progress
        self.t_start, self.t_end = float(inputs.breaks[0]), float(inputs.breaks[-1])
        span = self.t_end - self.t_start
        self.h_min = smallest_step(span)
        h = min(first_step(span, self.t_start), tolerances.max_step)
        self.S = State.at(self.t_start, h, y)
        self.eventful = bool(integrator.model.events)
        self.storm = EventStorm(tolerances.event)
        self.run, self.d = Run(), np.zeros(0)
        self.span, self.places = span, [y.copy()]

    @property
    def t(self) -> float:
        """Time reached [s]."""
        return float(self.S[State.T])

    @property
    def y(self) -> Array:
        """Unknowns there; a view of S."""
        return self.S[State.Y]

    def whole(self, p: Array) -> None:
        """Integrate over all input intervals, each with its own run data d = (p, data)."""
        for k in range(self.inputs.breaks.size - 1):
            before, self.d = self.d, np.concatenate([p, self.inputs.values[:, k]])
            old = self.jump(before) if k else self.before_start()
            if self.run.status is Status.SUCCESS:
                self.interval(float(self.inputs.breaks[k + 1]), old)
            if self.run.status is not Status.SUCCESS:
                return

    def interval(self, end: float, old: Array | None) -> None:
        """Integrate up to `end`, on which d is constant.

        `old` holds the values of the event expressions before the jump that led here, if one did.
        """
        S, n, left = self.S, self.integrator.system.n, 0.0
        R = self.tolerances.given(end, self.d)
        while self.t < end:
            records, reason, left = self.attempts(R, left)
            if self.run.status is not Status.SUCCESS:
                return
            piece = from_records(records, n)
            crossing = self.crossing(piece, old) if self.eventful else None
            if crossing is not None:
                old = self.happen(piece, crossing)
            else:
                self.run.keep(piece)
                old = None if piece.t0.size else old
                if reason is Stop.STEP_TOO_SMALL:
                    self.run.stop(*explain(self.integrator, self.t, self.y, self.d, S[State.H]))
            if self.run.status is not Status.SUCCESS:
                return
            if self.progress is not None:
                self.progress((self.t - self.t_start) / (self.t_end - self.t_start))

    def attempts(self, R: Array, left: float) -> tuple[Array, Stop, float]:
        """A batch of attempts: records, why it stopped, time [s] the VM will still need."""
        engine = self.integrator.choose(self.backend, left)
        self.run.engine = engine.name
        allowed = min(ATTEMPTS[engine.name], self.tolerances.max_steps - self.run.attempts)
        if allowed <= 0:
            self.run.stop(
                Status.MAX_STEPS, f"{Status.MAX_STEPS.value} It stands at t = {self.t:g} s."
            )
            return np.zeros((0, 0)), Stop.ATTEMPTS, left
        began, from_t = perf_counter(), self.t
        rows = EVENT_ROWS if self.eventful else ROWS
        records, made, reason = engine.run(self.S, R, rows, allowed, self.h_min)
        self.run.attempts += made
        if reason is Stop.STEP_TOO_SMALL and self.found_pivots():
            reason = Stop.ATTEMPTS
        if engine.name == "vm":
            spent, advance = perf_counter() - began, self.t - from_t
            self.integrator.vm_time += spent
            left = spent * (self.t_end - self.t) / advance if advance > 0 else left
        return records, reason, left

    def found_pivots(self) -> bool:
        """Whether steps failed for pivots that are not sound here; others are used from now on.

        What such pivots spoil no step size mends: steps shrink to nothing there, and that is when
        to look, at the same place whatever runs the steps.
        """
        if len(self.places) > MOST_ORDERS:
            return False
        here = self.y.copy()
        points = [(y, self.d) for y in (*self.places, here)]
        other = self.integrator.suited(points, self.span)
        if other is self.integrator:
            return False
        self.integrator = other
        self.places.append(here)
        h = max(float(self.S[State.H]), first_step(self.span, self.t))
        self.S[:] = State.at(self.t, h, here)
        return True

    def crossing(self, piece: Dense, old: Array | None) -> Crossing | None:
        """The first event in `piece`."""
        return first_crossing(self.integrator, piece, self.d, old, self.tolerances.event)

    def happen(self, piece: Dense, crossing: Crossing) -> Array:
        """Cut the run at an event, carry it out and go on from there."""
        self.run.keep(crossing.before(piece))
        # steps beyond the event say nothing; its own is a guess only, what follows may be faster
        h = float(piece.t1[crossing.step] - piece.t0[crossing.step])
        h = max(min(h, self.tolerances.event * 1e3), 1e-3 * h)
        self.S[:] = State.at(crossing.t, h, crossing.y)
        return self.carry_out(crossing.which)

    def carry_out(self, which: tuple[int, ...]) -> Array:
        """Apply the resets of the events `which`; event values before them, NaN for themselves."""
        events, t = self.integrator.model.events, self.t
        old = values(self.integrator, t, self.y, self.d)
        old[list(which)] = np.nan
        self.y[:] = resets(self.integrator, t, self.y, self.d, which)
        self.run.happened += [(t, events[i].name) for i in which]
        if any(events[i].terminal for i in which):
            self.run.stop(Status.TERMINATED)
        elif self.storm.raged_at(t, which):
            self.run.stop(
                Status.EVENT_STORM,
                f"{Status.EVENT_STORM.value} It stands at t = {t:.9g} s, "
                f"event '{events[which[0]].name}'.",
            )
        else:
            self.make_consistent(moved=any(events[i].reset for i in which))
        return old

    def before_start(self) -> Array | None:
        """Event values as if just before the start, where some have happened by it; else None."""
        events = self.integrator.model.events
        if not any(event.at_start for event in events):
            return None
        now = values(self.integrator, self.t, self.y, self.d)
        return np.array(
            [-e.direction if e.at_start else x for e, x in zip(events, now, strict=True)]
        )

    def jump(self, before: Array) -> Array | None:
        """Take over new input data, which algebraic unknowns follow; event values before them."""
        old = None
        if self.eventful:
            old = values(self.integrator, self.t, self.y, before)
        self.make_consistent()
        return old

    def make_consistent(self, moved: bool = False) -> None:
        """Let the algebraic unknowns follow a jump, or stop the run where they cannot.

        Where states `moved`, those of a mechanism have to be put back onto its constraints, too.
        """
        follow, manifold = self.integrator.follow, self.integrator.system.manifold
        if follow is None and manifold is None:
            return
        if follow is not None and not (moved and manifold is not None and manifold.m):
            found = follow(self.y, self.d)
            if found is not None:
                self.y[:] = found
                return
        where = f"simulate '{self.integrator.model.name}' at t = {self.t:.9g} s"
        try:
            self.y[:] = consistent(self.integrator.system, where, self.y, self.d)
        except ValueError as error:
            self.run.stop(Status.SINGULAR, str(error))
