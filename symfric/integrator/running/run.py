"""Drive an integrator from start to end: input intervals, events, progress, failures.

Absolute tolerances are fractions of each state's nominal value, which the model only guesses (a
decimetre, a turn). With them a motion of a micrometre would be resolved to a hundredth of its size,
one of a nanometre not at all. A run with such a small motion is therefore repeated on its own
scale.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from time import perf_counter
from typing import final

import numpy as np
from numpy.typing import NDArray

from symfric.foundation.numeric import evaluate
from symfric.foundation.status import Status
from symfric.integrator.equations.expressions import pieces
from symfric.integrator.equations.initial import JammedError, consistent, first_step, smallest_step
from symfric.integrator.equations.inputs import InputData
from symfric.integrator.running.diagnosis import chattering, explain
from symfric.integrator.running.engine import Stop
from symfric.integrator.running.events import Eventful
from symfric.integrator.running.integrator import Integrator
from symfric.integrator.running.loop import Work
from symfric.integrator.running.record import MOST_BYTES, Outputs, Run
from symfric.integrator.step.layout import Given, State

Array = NDArray[np.float64]
SMALL, REST = 1e-3, 1e-12
"""Sizes, in nominal values, below which a motion gets its own scale, and below which it is treated
as
zero: such values are rounding errors of the states that it is coupled to.
"""

ROUNDS = 3
"""Maximum number of repetitions: an unresolved motion may have seemed larger than it is."""


def ample(run: Run, nominal: Array) -> bool:
    """Return True if no state of a run is small all the time; most are not even small at the
    end.
    """
    # few numbers: faster than NumPy
    ends = zip(run.end.tolist(), nominal.tolist(), strict=False)
    return all(
        abs(end) >= SMALL * typical or run.farthest(i) >= SMALL * typical
        for i, (end, typical) in enumerate(ends)
    )


def own_scale(size: Array, nominal: Array) -> Array:
    """Return typical magnitudes: `nominal`, or `size` where a state moves far less."""
    small = (size < SMALL * nominal) & (size > REST * nominal)
    return np.where(small, size, nominal)


def finer(scale: Array, size: Array, nominal: Array) -> Array | None:
    """Return the scale for another run of a motion of this `size`, None if `scale` is fine
    enough.
    """
    own = np.minimum(scale, own_scale(size, nominal))
    return own if (own < 0.1 * scale).any() else None


PACES = 8
"""Linear pieces of an input that one step may span in models with events (checked at its
quarters)."""

NOWHERE = np.zeros(0)
"""Empty array of result times."""
ATTEMPTS = {"vm": 2_000, "compiled": 50_000}
"""Attempts between two checks of progress and interrupts: tens of milliseconds."""
MOST_ORDERS = 8
"""Maximum number of pivot replacements in a run."""
MANY_STEPS, MOST_STEPS = 10_000_000, 1e9
"""Attempts after which the progress rate of a run is checked, and the most it may still need
then."""


@final
@dataclass(frozen=True, eq=False)
class Tolerances:
    """Tolerances and limits of a run.

    Attributes:
        rtol: relative tolerance.
        atol: absolute tolerance of each state, shape (nx,).
        event: tolerance of event times [s].
        max_steps: attempts allowed.
        max_step: longest step [s].
        follow: True if `atol` shrinks to the size of a tiny motion.
        extends: True if more attempts are allowed while the run will reach its end.
    """

    rtol: float
    atol: Array
    event: float
    max_steps: int
    max_step: float = np.inf
    follow: bool = False
    extends: bool = False

    def given(self, t_end: float, d: Array) -> Array:
        """Return the constant data of an attempt towards `t_end`, for run data d (..., n_d)."""
        return Given.of(t_end, self.rtol, self.max_step, self.atol, d)


def integrate(
    integrator: Integrator,
    inputs: InputData,
    y0: Array,
    p: Array,
    tolerances: Tolerances,
    backend: str,
    progress: Callable[[float], None] | None,
    times: Array = NOWHERE,
) -> tuple[Run, Integrator]:
    """Integrate over all input intervals, with outputs at `times`.

    A motion that turns out to be tiny is integrated again on its own scale.

    Returns:
        The run, and the last integrator used: pivots that fail during the run are replaced.
    """
    nominal = integrator.system.nominal
    if integrator.model.events:
        # at equilibrium only the events show that an input has become large enough to start motion
        quickest = min([inputs.pace, *(pieces(f, *inputs.span).pace for f in integrator.schedules)])
        tolerances = replace(tolerances, max_step=min(tolerances.max_step, PACES * quickest))
    scale, allowed = nominal, tolerances
    run, last = _integrated(integrator, inputs, y0, p, allowed, backend, progress, times)
    for _ in range(ROUNDS if tolerances.follow and not ample(run, nominal) else 0):
        own = finer(scale, run.largest[: nominal.size], nominal)
        if own is None or not run.status.ok:
            break
        scale, allowed = own, replace(tolerances, atol=tolerances.atol * own / nominal)
        again, other = _integrated(last, inputs, y0, p, allowed, backend, None, times)
        if not again.status.ok and again.status is not Status.INTERRUPTED:
            run.message += f" Tiny motions were not resolved on their own scale: {again.message}"
            break
        run, last = again, other
    return run, last


def _integrated(
    integrator: Integrator,
    inputs: InputData,
    y0: Array,
    p: Array,
    tolerances: Tolerances,
    backend: str,
    progress: Callable[[float], None] | None,
    times: Array,
    most: float | None = None,
) -> tuple[Run, Integrator]:
    """Run once over all input intervals; keep steps of up to `most` bytes."""
    data = inputs.values[:, 0]
    y = integrator.start(y0, np.concatenate([p, data]) if data.size else p)
    work = integrator.borrow()
    march = _March(integrator, inputs, tolerances, backend, progress, y, p, times, work)
    run = march.run
    run.most = MOST_BYTES if most is None else most
    try:
        march.whole()
    except KeyboardInterrupt:
        reached = f"{Status.INTERRUPTED.value} It reaches t = {run.reached:g} s."
        run.stop(Status.INTERRUPTED, reached)
        run.outputs.back_to(run.reached)
    march.finish()
    integrator.give_back(work)
    if not run.complete:
        same = replace(tolerances, max_steps=run.attempts, extends=False)
        again = partial(_integrated, integrator, inputs, y0, p, same, backend, None)
        run.again = lambda times, most: again(times, most)[0]
    return run, march.integrator


@final
class _March:
    """Run in progress: the step's memory and unknowns S, and the results so far."""

    def __init__(
        self,
        integrator: Integrator,
        inputs: InputData,
        tolerances: Tolerances,
        backend: str,
        progress: Callable[[float], None] | None,
        y: Array,
        p: Array,
        times: Array,
        work: Work,
    ) -> None:
        self.integrator, self.inputs, self.tolerances = integrator, inputs, tolerances
        self.backend, self.progress, self.work = backend, progress, work
        self.t_start, self.t_end = inputs.span
        self.span = self.t_end - self.t_start
        system, crossings = integrator.system, integrator.crossings
        self.events = None if crossings is None else Eventful(crossings, tolerances.event)
        h = min(first_step(self.span, self.t_start), tolerances.max_step)
        State.begin(work.S, self.t_start, h, y)
        Given.begin(work.R, tolerances.rtol, tolerances.max_step, tolerances.atol, p)
        work.loop.h_min = smallest_step(self.span)
        outputs = Outputs.at(times, system.n)
        work.want(outputs, self.events)
        work.over(inputs.breaks, inputs.values)
        self.run = Run(self.t_start, y, outputs)
        self.places = [y]
        self.limit, self.limit_set_at = tolerances.max_steps, self.t_start

    @property
    def t(self) -> float:
        """Current time [s]."""
        return float(self.S[State.T])

    @property
    def S(self) -> Array:
        """Memory and unknowns of the step."""
        return self.work.S

    @property
    def y(self) -> Array:
        """Unknowns; a view of S."""
        return self.S[State.Y]

    @property
    def d(self) -> Array:
        """Run data on the current input interval, as a copy."""
        return self.work.R[Given.d(self.integrator.system.nx)].copy()

    def whole(self) -> None:
        """Integrate over all input intervals."""
        self.before_start()
        left, reason = 0.0, Stop.FULL
        while reason is not Stop.END and self.run.status is Status.SUCCESS:
            records, reason, left = self.attempts(left)
            if self.run.status is Status.SUCCESS:
                self.happen()
                self.run.keep(records.copy())
                self.heed(reason)
            if self.run.status is Status.SUCCESS and self.progress is not None:
                self.progress((self.t - self.t_start) / self.span)

    def finish(self) -> None:
        """Fill in outputs at the final time, which engines leave open."""
        outputs = self.run.outputs
        if outputs.found < outputs.times.size:
            outputs.fill(self.run.last, last=True)

    def attempts(self, left: float) -> tuple[Array, Stop, float]:
        """Make a batch of attempts; return records, reason to stop, remaining time of the VM
        [s].
        """
        engine = self.integrator.choose(self.backend, left)
        self.run.engine = engine.name
        if self.run.attempts >= self.limit and self.tolerances.extends:
            self.extend_limit()
        allowed = min(ATTEMPTS[engine.name], self.limit - self.run.attempts)
        if allowed <= 0:
            hint = chattering(self.integrator.model)
            said = f"{Status.MAX_STEPS.value} Stopped at t = {self.t:g} s.{hint}"
            self.run.stop(Status.MAX_STEPS, said)
            return self.work.rows[:0], Stop.ATTEMPTS, left
        virtual = engine.name == "vm"
        began, from_t = (perf_counter(), self.t) if virtual else (0.0, 0.0)
        records, made, reason = engine.march(self.work, allowed)
        self.run.attempts += made
        if reason is Stop.STEP_TOO_SMALL and self.found_pivots():
            reason = Stop.ATTEMPTS
        if virtual:
            spent, advance = perf_counter() - began, self.t - from_t
            self.integrator.vm_time += spent
            left = spent * (self.t_end - self.t) / advance if advance > 0 else left
        return records, reason, left

    def extend_limit(self) -> None:
        """Allow more attempts if the recent progress rate reaches the end within `MOST_STEPS`."""
        advance, self.limit_set_at = self.t - self.limit_set_at, self.t
        if (self.t_end - self.t) * MANY_STEPS <= MOST_STEPS * advance:
            self.limit += MANY_STEPS

    def found_pivots(self) -> bool:
        """Return True if steps failed because of unstable pivots, after replacing these.

        No step size compensates for unstable pivots: steps shrink to nothing. The check is
        therefore made
        there, at the same place for every engine.
        """
        if len(self.places) > MOST_ORDERS:
            return False
        here, d = self.y.copy(), self.d
        points = [(y, d) for y in (*self.places, here)]
        other = self.integrator.suited(points, self.span)
        if other is self.integrator:
            return False
        self.integrator = other
        self.places.append(here)
        h = max(float(self.S[State.H]), first_step(self.span, self.t))
        self.S[:] = State.at(self.t, h, here)
        return True

    def happen(self) -> None:
        """Record the events in the steps about to be kept."""
        if self.events is None or not self.events.count:
            return
        jumps = self.events.jumps(self.run.steps)
        events = self.integrator.model.events
        times, numbers = np.nonzero(jumps.which)
        found = zip(jumps.t[times].tolist(), numbers.tolist(), strict=True)
        self.run.happened += [(t, events[i].name) for t, i in found]
        self.run.jumps.append(jumps)

    def heed(self, reason: Stop) -> None:
        """Act on the `reason` to stop."""
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
                f"{Status.EVENT_STORM.value} Stopped at t = {self.t:.9g} s, event '{name}'.",
            )
        elif reason is Stop.SEARCH:
            self.make_consistent()
        elif reason is Stop.FOLLOW:
            last, events = self.run.jumps[-1], self.integrator.model.events
            self.make_consistent(moved=any(events[i].reset for i in np.flatnonzero(last.which[-1])))
            last.after[-1] = self.y

    def before_start(self) -> None:
        """Give events that have already happened at the start the values just before them."""
        if self.events is None:
            return
        events = self.integrator.model.events
        if any(event.at_start for event in events):
            now = evaluate(self.integrator.events, self.S[State.T : State.T + 1], self.y, self.d)
            signs = (-e.direction if e.at_start else x for e, x in zip(events, now, strict=True))
            self.events.jumped(np.array(list(signs)))

    def make_consistent(self, moved: bool = False) -> None:
        """Update the algebraic unknowns after a jump, or stop the run if that fails.

        If states `moved`, the states of a mechanism are projected back onto its constraints, too.
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
            jams = isinstance(error, JammedError)
            self.run.stop(Status.JAMMED if jams else Status.SINGULAR, str(error))
