"""Run of an integrator from start to end: input intervals, events, progress, failures.

Absolute tolerances are fractions of the nominal value of each state, which the model only guesses
(a decimetre, a turn). With such tolerances, a motion of a micrometre would be resolved to a
hundredth of its size, and one of a nanometre not at all. A run with such a small motion is
therefore repeated with tolerances on the scale of the motion.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache
from time import perf_counter
from typing import final

import numpy as np

from symfric.foundation.numeric import Array
from symfric.foundation.status import Status
from symfric.integrator.equations.expressions import pieces
from symfric.integrator.equations.initial import JammedError, consistent, first_step, smallest_step
from symfric.integrator.equations.inputs import InputData
from symfric.integrator.methods.attempt import RRow, SRow
from symfric.integrator.running.diagnosis import chattering, explain
from symfric.integrator.running.events import Stop
from symfric.integrator.running.integrator import Integrator
from symfric.integrator.running.record import MOST_BYTES, Outputs, RunRecord

SMALL, REST = 1e-3, 1e-12
"""Sizes, in nominal values, below which a motion gets its own scale, or counts as zero.

Values below the second limit are rounding errors of coupled states.
"""
ROUNDS = 3
"""Maximum number of repetitions: an unresolved motion may have seemed larger than it is."""


def own_scale(size: Array, nominal: Array) -> Array:
    """Return typical magnitudes: `nominal`, or `size` for states that move far less."""
    small = (size < SMALL * nominal) & (size > REST * nominal)
    return np.where(small, size, nominal)


def finer(scale: Array, size: Array, nominal: Array) -> Array | None:
    """Return the scale for another run of a motion of `size`; None if `scale` is fine enough.

    It repeats `own_scale` in a form that is fast for few states.
    """
    used = scale.tolist()
    each = zip(used, size.tolist(), nominal.tolist(), strict=True)
    own = [min(old, x if REST * usual < x < SMALL * usual else usual) for old, x, usual in each]
    smaller = [new < 0.1 * old for new, old in zip(own, used, strict=True)]
    return np.array(own) if any(smaller) else None


PACES = 8
"""Number of nearly linear pieces of an input that one step may span in models with events.

Events are checked at the quarters of a step.
"""

NOWHERE = np.zeros(0)
"""Empty array of result times."""
ATTEMPTS = {"vm": 2_000, "compiled": 50_000}
"""Attempts between two checks of progress and interrupts; they take tens of milliseconds."""
MOST_ORDERS = 8
"""Maximum number of pivot replacements in a run."""
MANY_STEPS, MOST_STEPS = 10_000_000, 1e9
"""Attempts after which the progress of a run is checked, and the most that it may still need."""


@final
@dataclass(frozen=True, eq=False)
class Tolerances:
    """Tolerances and limits of a run.

    Attributes:
        rtol: relative tolerance.
        atol: absolute tolerance of each state, shape (nx,).
        event: tolerance of event times [s].
        max_steps: number of attempts allowed.
        max_step: longest step [s].
        follow: True if `atol` shrinks to the size of tiny motions.
        extends: True if more attempts are allowed as long as the run is going to reach its end.
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
        return RRow.of(t_end, self.rtol, self.max_step, self.atol, d)


def integrate(
    integrator: Integrator,
    inputs: InputData,
    y0: Array,
    p: Array,
    tolerances: Tolerances,
    backend: str,
    progress: Callable[[float], None] | None,
    times: Array = NOWHERE,
) -> tuple[RunRecord, Integrator]:
    """Integrate over all input intervals, with outputs at `times`.

    A motion that turns out to be tiny is integrated again on its own scale.

    Returns:
        The run, and the last integrator used: pivots that fail during the run are replaced.
    """
    scale = nominal = integrator.system.nominal
    atol = tolerances.atol
    settings = tolerances, atol, backend, progress, times, MOST_BYTES
    march = _March(integrator, inputs, y0, p, *settings)
    run = march.run()
    for _ in range(ROUNDS if tolerances.follow else 0):
        if not run.status.ok or not _ends_small(run, integrator):
            break
        own = finer(scale, run.farthest[: nominal.size], nominal)
        if own is None:
            break
        scale, used = own, march.integrator
        march.atol, march.progress = atol * own / nominal, None
        again = march.run()
        if not again.status.ok and again.status is not Status.INTERRUPTED:
            run.message += f" Tiny motions were not resolved on their own scale: {again.message}"
            return run, used
        run = again
    return run, march.integrator


def _ends_small(run: RunRecord, integrator: Integrator) -> bool:
    """Return True if a state is small at the end, as few are, in a form that is fast for few."""
    sizes = integrator.memory.get("small")
    if sizes is None:
        sizes = integrator.memory["small"] = (SMALL * integrator.system.nominal).tolist()
    return any([not abs(x) >= size for x, size in zip(run.end.tolist(), sizes, strict=False)])


@lru_cache
def _first_and_smallest(t_start: float, t_end: float) -> tuple[float, float]:
    return first_step(t_end - t_start, t_start), smallest_step(t_end - t_start)


def watchful(tolerances: Tolerances, integrator: Integrator, inputs: InputData) -> Tolerances:
    """Return tolerances for models with events: no step passes over a pulse of an input.

    At equilibrium only the events show that an input has become large enough to start motion.
    """
    if not integrator.model.events:
        return tolerances
    paces = (pieces(f, *inputs.span).pace for f in integrator.schedules)
    longest = min(tolerances.max_step, PACES * min(inputs.pace, *paces, np.inf))
    return replace(tolerances, max_step=longest)


@final
@dataclass(eq=False)
class _March:
    """Run in progress; its `integrator` is replaced if pivots fail."""

    integrator: Integrator
    inputs: InputData
    y0: Array
    p: Array
    tolerances: Tolerances
    atol: Array
    backend: str
    progress: Callable[[float], None] | None
    times: Array
    most: float

    def run(self) -> RunRecord:
        """Run once over all input intervals; keep steps of up to `most` bytes."""
        integrator, allowed, inputs = self.integrator, self.tolerances, self.inputs
        (t_start, t_end), d = inputs.span, self.p
        if inputs.values.size:
            d = np.concatenate([d, inputs.values[:, 0]])
        y = integrator.start(self.y0, d)
        work = self.work = integrator.borrow()
        self.events = work.events
        if work.events is not None:
            work.events.begin(allowed.event)
        first, work.loop.h_min = _first_and_smallest(t_start, t_end)
        work.begin(t_start, min(first, allowed.max_step), y)
        RRow.fill(work.R, t_end, allowed.rtol, allowed.max_step, self.atol, d)
        outputs = Outputs.at(self.times, y.size)
        work.want(outputs)
        work.over(inputs.breaks, inputs.values)
        run = self.made = RunRecord(t_start, y, outputs, most=self.most)
        self.places, self.limit, self.limit_set_at = [y], allowed.max_steps, t_start
        try:
            self._march(t_start, t_end)
        except KeyboardInterrupt:
            reached = f"{Status.INTERRUPTED.value} It reaches t = {run.reached:g} s."
            run.stop(Status.INTERRUPTED, reached)
            outputs.back_to(run.reached)
        if outputs.found < outputs.times.size:  # engines leave the final time open
            outputs.fill(run.last, last=True)
        integrator.give_back(work)
        if not run.complete:
            same = replace(allowed, max_steps=run.attempts, extends=False)
            again = replace(self, integrator=integrator, tolerances=same, progress=None)
            run.again = lambda times, most: replace(again, times=times, most=most).run()
        return run

    @property
    def t(self) -> float:
        """Current time [s]."""
        return float(self.work.S[SRow.T])

    @property
    def y(self) -> Array:
        """Unknowns, as a view of S."""
        return self.work.S[SRow.Y]

    @property
    def d(self) -> Array:
        """Run data on the current input interval, as a copy."""
        return self.work.R[RRow.d(self.integrator.system.nx)].copy()

    def _march(self, t_start: float, t_end: float) -> None:
        """Integrate over all input intervals."""
        run, model = self.made, self.integrator.model
        if self.events is not None:
            t, d = self.work.S[SRow.T], self.work.R[RRow.d(self.integrator.system.nx)]
            self.events.started(model.events, self.integrator.events_at(t, self.y, d)[0])
        left, reason = 0.0, Stop.FULL
        while reason is not Stop.END and run.status is Status.SUCCESS:
            records, reason, left = self._attempts(left, t_end)
            if run.status is Status.SUCCESS:
                if self.events is not None and self.events.count:
                    jumps = self.events.jumps(run.steps)
                    rows, which = jumps.which.nonzero()
                    pairs = zip(jumps.t[rows].tolist(), which.tolist(), strict=True)
                    run.happened += [(t, model.events[i].name) for t, i in pairs]
                    run.jumps.append(jumps)
                run.ends = self.work.reach.copy()
                run.keep(records.copy())
                if reason is not Stop.END:
                    self._act(reason)
            if run.status is Status.SUCCESS and self.progress is not None:
                self.progress((self.t - t_start) / (t_end - t_start))

    def _attempts(self, left: float, t_end: float) -> tuple[Array, Stop, float]:
        """Make attempts; return records, reason to stop, and remaining time of the VM [s]."""
        run, engine = self.made, self.integrator.choose(self.backend, left)
        run.engine = engine.name
        if run.attempts >= self.limit and self.tolerances.extends:
            # allow more attempts if the recent progress reaches the end within `MOST_STEPS`
            advance, self.limit_set_at = self.t - self.limit_set_at, self.t
            if (t_end - self.t) * MANY_STEPS <= MOST_STEPS * advance:
                self.limit += MANY_STEPS
        allowed = min(ATTEMPTS[engine.name], self.limit - run.attempts)
        if allowed <= 0:
            hint = chattering(self.integrator.model)
            message = f"{Status.MAX_STEPS.value} Stopped at t = {self.t:g} s.{hint}"
            run.stop(Status.MAX_STEPS, message)
            return self.work.rows[:0], Stop.ATTEMPTS, left
        vm = engine.name == "vm"
        began, from_t = (perf_counter(), self.t) if vm else (0.0, 0.0)
        records, made, reason = engine.march(self.work, allowed)
        run.attempts += made
        if reason is Stop.STEP_TOO_SMALL and self._found_pivots():
            reason = Stop.ATTEMPTS
        if vm:
            spent, advance = perf_counter() - began, self.t - from_t
            self.integrator.vm_time += spent
            left = spent * (t_end - self.t) / advance if advance > 0 else left
        return records, reason, left

    def _found_pivots(self) -> bool:
        """Replace unstable pivots after a failed step; return True if pivots were the cause.

        No step size compensates for unstable pivots, and steps shrink to nothing. Pivots are
        therefore checked when this happens, at the same place for every engine.
        """
        if len(self.places) > MOST_ORDERS:
            return False
        here, d, span = self.y.copy(), self.d, float(np.diff(self.inputs.span)[0])
        other = self.integrator.suited([(y, d) for y in (*self.places, here)], span)
        if other is self.integrator:
            return False
        self.integrator = other
        self.places.append(here)
        h = max(float(self.work.S[SRow.H]), first_step(span, self.t))
        self.work.S[:] = SRow.at(self.t, h, here)
        return True

    def _act(self, reason: Stop) -> None:
        """Handle the `reason` for which an engine returned."""
        run, events = self.made, self.integrator.model.events
        if reason is Stop.STEP_TOO_SMALL:
            h = self.work.S[SRow.H]
            run.stop(*explain(self.integrator, self.t, self.y, self.d, h))
        elif reason is Stop.TERMINAL:
            run.stop(Status.TERMINATED)
        elif reason is Stop.STORM:
            name = events[int(np.argmax(run.jumps[-1].which[-1]))].name
            stopped = f"Stopped at t = {self.t:.9g} s, event '{name}'."
            run.stop(Status.EVENT_STORM, f"{Status.EVENT_STORM.value} {stopped}")
        elif reason is Stop.SEARCH:
            self._make_consistent()
        elif reason in (Stop.FOLLOW, Stop.DECIDE):
            last = run.jumps[-1]
            self._make_consistent(any(events[i].reset for i in np.flatnonzero(last.which[-1])))
            if reason is Stop.DECIDE and run.status is Status.SUCCESS and self.events is not None:
                before = last.before[-1].copy()
                self.y[:] = self.integrator.decided(self.t, before, self.y.copy(), self.d)
                self.events.decided()
            last.after[-1] = self.y

    def _make_consistent(self, moved: bool = False) -> None:
        """Update the algebraic unknowns after a jump, or stop the run if that fails.

        If states `moved`, the states of a mechanism are also projected back onto its constraints.
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
            self.made.stop(Status.JAMMED if jams else Status.SINGULAR, str(error))
