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
from symfric.integrator.running.events import Eventful, Jumps
from symfric.integrator.running.integrator import Integrator
from symfric.integrator.running.sizes import ROUNDS, ample, finer, sizes
from symfric.integrator.step.layout import Given, State

Array = NDArray[np.float64]
PACES = 8
"""Straight pieces of an input that a step may pass with events, which look at its quarters."""

ROWS = 2048
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
    jumps: list[Jumps] = field(default_factory=list[Jumps])
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
        crossings = integrator.crossings
        self.events = None if crossings is None else Eventful(crossings, tolerances.event)
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
            if k:
                self.jump(before)
            else:
                self.before_start()
            if self.run.status is Status.SUCCESS:
                self.interval(float(self.inputs.breaks[k + 1]))
            if self.run.status is not Status.SUCCESS:
                return

    def interval(self, end: float) -> None:
        """Integrate up to `end`, on which d is constant."""
        n, left = self.integrator.system.n, 0.0
        R = self.tolerances.given(end, self.d)
        while self.t < end:
            records, reason, left = self.attempts(R, left)
            if self.run.status is not Status.SUCCESS:
                return
            self.happen()
            self.run.keep(from_records(records, n))
            self.heed(reason)
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
        limits = ROWS, allowed, self.h_min
        records, made, reason = engine.run(self.S, R, *limits, self.events)
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

    def happen(self) -> None:
        """Take note of the events in the steps to come."""
        if self.events is None or not self.events.count:
            return
        jumps = self.events.jumps(self.run.steps)
        events = self.integrator.model.events
        times, numbers = np.nonzero(jumps.which)
        found = zip(jumps.t[times].tolist(), numbers.tolist(), strict=True)
        self.run.happened += [(t, events[i].name) for t, i in found]
        self.run.jumps.append(jumps)

    def heed(self, reason: Stop) -> None:
        """Do what the `reason` to stop asks for."""
        if reason is Stop.STEP_TOO_SMALL:
            h = self.S[State.H]
            self.run.stop(*explain(self.integrator, self.t, self.y, self.d, h))
        elif reason is Stop.TERMINAL:
            self.run.stop(Status.TERMINATED)
        elif reason is Stop.STORM:
            which = self.run.jumps[-1].which[-1]
            name = self.integrator.model.events[int(np.argmax(which))].name
            self.run.stop(
                Status.EVENT_STORM,
                f"{Status.EVENT_STORM.value} It stands at t = {self.t:.9g} s, event '{name}'.",
            )
        elif reason is Stop.FOLLOW:
            last, events = self.run.jumps[-1], self.integrator.model.events
            self.make_consistent(moved=any(events[i].reset for i in np.flatnonzero(last.which[-1])))
            last.after[-1] = self.y

    def before_start(self) -> None:
        """Events that have happened by the start have values as if just before it."""
        if self.events is None:
            return
        events = self.integrator.model.events
        if any(event.at_start for event in events):
            now = self.values(self.d)
            signs = (-e.direction if e.at_start else x for e, x in zip(events, now, strict=True))
            self.events.jumped(np.array(list(signs)))

    def jump(self, before: Array) -> None:
        """Take over new input data, from those `before`; algebraic unknowns follow."""
        if self.events is not None:
            self.events.jumped(self.values(before))
        self.make_consistent()

    def values(self, d: Array) -> Array:
        """Values of the events here with run data `d`."""
        return self.integrator.events(self.t, self.y, d).full().ravel()

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
