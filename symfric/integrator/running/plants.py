"""Sampled plants with held inputs; one call advances all of them, without records.

As in `symfric.integrator.running.engine`, there are two engines, which do the same operations in
the same order: a loop in C around the generated step, and a loop in Python around CasADi's virtual
machine.
"""

import ctypes
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from enum import IntEnum
from typing import ClassVar, final

import numpy as np
from numpy.typing import NDArray

from symfric.foundation.numeric import Array, bound, evaluate
from symfric.integrator.compiled.columns import densified, filled
from symfric.integrator.compiled.compiler import load
from symfric.integrator.equations.initial import FLOOR, first_step
from symfric.integrator.methods.attempt import RRow, SRow
from symfric.integrator.running.engine import FOLDER, Engine, Work, c_source
from symfric.integrator.running.events import Eventful, Stop
from symfric.integrator.running.integrator import Integrator
from symfric.integrator.running.record import Outputs

Counts = NDArray[np.int64]


class Why(IntEnum):
    """State of a plant.

    END: the plant is at its sample. ATTEMPTS: it is out of attempts. STEP_TOO_SMALL: its steps are
    too small. SEARCH: its algebraic unknowns are too far from the last ones to follow
    (`symfric.integrator.equations.blocks`). AGAIN: the caller has resolved this, and the plant is
    to be continued. STORM: event storm. OVER: a terminal event has ended the plant.
    """

    OVER = -1
    END = 0
    ATTEMPTS = 2
    STEP_TOO_SMALL = 3
    SEARCH = 4
    AGAIN = 5
    STORM = 6


SAMPLES = 1000
"""Number of samples of a run whose first step is that of a plant."""
Advance = Callable[[int], int]
"""Function that takes over inputs and goes to the next sample (1), or continues AGAIN plants (0).

It returns the number of plants that did not reach their sample.
"""


@final
@dataclass(eq=False)
class Plants:
    """Data of plants of one model; mutable, and shared by both engines.

    Attributes:
        S, R: columns of an attempt, one row per plant (`symfric.integrator.methods.attempt`).
        u: inputs to hold next, shape (plants, nu); the last run data in R are those held now.
        begin: start times [s]; the k-th sample of a plant is at begin + k dt.
        count: k of each plant; unchanged for a plant that has not reached its sample.
        ready: 1 if the algebraic unknowns already match the inputs to hold next.
        why: state of each plant, a `Why`.
        made: number of attempts in the last interval.
        dt: sampling interval [s].
        attempts: number of attempts allowed in one interval.
        h_min: smallest step [s].
        memory: event memory, one row per plant; without columns if there are no events.
        happened: (plant, time [s], name) of the events of the last interval.
    """

    REFUSED: ClassVar[int] = -1
    """Return value of `Advance` if an input is not finite; nothing has changed then."""

    S: Array
    R: Array
    u: Array
    begin: Array
    count: Counts
    ready: Counts
    why: Counts
    made: Counts
    dt: float
    attempts: int
    h_min: float
    memory: Array
    happened: list[tuple[int, float, str]] = field(default_factory=list[tuple[int, float, str]])

    def first_step(self) -> float:
        """Return the first step [s] to try, that of a run over `SAMPLES` samples."""
        return min(first_step(SAMPLES * self.dt, self.begin[0]), float(self.R[0, RRow.H_MAX]))

    def copy(self) -> "Plants":
        """Return a copy with its own arrays."""
        own = {name: getattr(self, name).copy() for name in (*SHARED, "memory", "happened")}
        return replace(self, **own)

    def back_to(self, before: "Plants") -> None:
        """Restore the state of `before`, a copy, in the same arrays."""
        for name in (*SHARED, "memory", "happened"):
            getattr(self, name)[:] = getattr(before, name)


MEMBERS = (FOLDER / "members.h").read_text(encoding="utf-8")
"""C declaration of the struct of the arrays."""
SHARED = ("S", "R", "u", "begin", "count", "ready", "why", "made")
"""Arrays that C reads and writes, in this order."""


class _Members(ctypes.Structure):
    """Struct `symfric_members` of members.h."""

    _fields_ = (
        *((name, ctypes.c_longlong) for name in ("members", "attempts")),
        *((name, ctypes.c_double) for name in ("dt", "h_min")),
        *((name, ctypes.c_void_p) for name in SHARED),
    )

    @classmethod
    def of(cls, plants: Plants) -> "_Members":
        """Return the struct with the addresses of the arrays; the caller keeps the arrays alive."""
        addresses = (getattr(plants, name).ctypes.data for name in SHARED)
        return cls(plants.S.shape[0], plants.attempts, plants.dt, plants.h_min, *addresses)


def compiled(integrator: Integrator, plants: Plants) -> Advance:
    """Return the compiled loop.

    Raises:
        CompileError: no compiler was found, or it failed.
    """
    return loaded(integrator, plants, "plants", plants_source)


def loaded(
    integrator: Integrator, plants: Plants, name: str, source: Callable[[Integrator], str]
) -> Advance:
    """Return the C function `symfric_plants` bound to arrays; the integrator caches the library."""
    if name not in integrator.memory:
        library = load(source(integrator), "symfric_plants")
        library.symfric_plants.restype = ctypes.c_longlong
        library.symfric_plants.argtypes = [ctypes.c_void_p, ctypes.c_int]
        integrator.memory[name] = library
    function, members = integrator.memory[name].symfric_plants, _Members.of(plants)
    address = ctypes.addressof(members)

    def advance(begin: int, _alive: object = (members, plants)) -> int:
        short = int(function(address, begin))
        if short < Plants.REFUSED:
            raise MemoryError
        return short

    return advance


def plants_source(integrator: Integrator) -> str:
    """Return the C of the step, of the update after a jump, and of the loop around them."""
    follow, data = integrator.follow, RRow.d(integrator.system.nx).start
    n_d, nu = integrator.system.d.numel(), integrator.inputs.data.numel()
    others = () if follow is None else (follow.round,)
    plants = filled(
        FOLDER / "plants.c",
        nu=nu, data=data, held=data + n_d - nu, follows=int(follow is not None),
        search=Why.SEARCH, again=Why.AGAIN, refused=Plants.REFUSED,
    )  # fmt: skip
    attempts = c_source(integrator.step, integrator.tableau.H.shape[0], *others)
    jump = "" if follow is None else follow.c_source
    return attempts + jump + MEMBERS + plants


@final
class InPython:
    """Loop in Python over the plants, used as an `Advance`.

    Args:
        integrator, plants: integrator of the model, and data of the plants.
        engine: engine for models with events, which it searches for
            (`symfric.integrator.running.events`).
        tolerance: tolerance of event times [s].
    """

    def __init__(
        self, integrator: Integrator, plants: Plants, engine: Engine, tolerance: float
    ) -> None:
        self.integrator, self.plants, self.engine = integrator, plants, engine
        system, step, rows = integrator.system, integrator.step, integrator.tableau.H.shape[0]
        self.events, self.data = None, RRow.d(system.nx)
        if integrator.crossings is not None:
            self.events = Eventful(integrator.crossings, tolerance)
        self.work = Work(system.n, step.numel_in(1), rows, events=self.events)
        self.after = np.zeros(step.numel_in(0))
        self.work.want(Outputs.at(np.zeros(0), system.n))
        self.work.over(np.zeros(2), np.zeros((0, 1)))
        self.work.loop.h_min = plants.h_min
        self.attempt = bound(step, (self.work.S, self.work.R), (self.after,))

    def __call__(self, begin: int) -> int:
        """Advance all plants."""
        plants, S, R = self.plants, self.work.S, self.work.R
        if begin and not np.isfinite(plants.u).all():
            return Plants.REFUSED
        if begin:
            plants.happened.clear()
        for b in range(plants.S.shape[0]):
            if plants.why[b] == Why.OVER or not (begin or plants.why[b] == Why.AGAIN):
                continue
            S[:], R[:] = plants.S[b], plants.R[b]
            if self.events is not None:
                self.events.memory[:] = plants.memory[b]
            follows = self._takes_over(b) if begin else True
            plants.why[b] = self._runs(b) if follows else Why.SEARCH
            plants.S[b], plants.R[b] = S, R
            if self.events is not None:
                plants.memory[b] = self.events.memory
        return int(np.count_nonzero(plants.why > 0))

    def _takes_over(self, b: int) -> bool:
        """Take over inputs and the next sample time; return False if unknowns could not follow."""
        plants, S, R, ready = self.plants, self.work.S, self.work.R, bool(self.plants.ready[b])
        plants.count[b] += S[SRow.T] >= R[RRow.T_END]
        plants.made[b] = plants.ready[b] = 0
        R[RRow.T_END] = plants.begin[b] + plants.count[b] * plants.dt
        R[R.size - plants.u.shape[1] :] = plants.u[b]
        if self.events is not None and ready:
            t, y, d = S[SRow.T : SRow.T + 1], S[SRow.Y], R[self.data]
            values = evaluate(self.integrator.events, t, y, d)
            self.events.started(self.integrator.model.events, values)
        elif self.events is not None:
            self.events.entered()
        return ready or self._follow()

    def _follow(self) -> bool:
        """Update algebraic unknowns after a jump; return False if that fails."""
        follow, y = self.integrator.follow, self.work.S[SRow.Y]
        found = y if follow is None else follow(y, self.work.R[self.data])
        if found is not None:
            y[:] = found
        return found is not None

    def _runs(self, b: int) -> int:
        """Make steps and events up to the sample; return the reason to stop."""
        plants, S, end = self.plants, self.work.S, self.work.R[RRow.T_END]
        if self.events is not None:
            return self._runs_with(self.events, b)
        made = 0
        while S[SRow.T] < end and made < plants.attempts and _large(S, plants.h_min):
            self.attempt()
            S[:] = self.after
            made += 1
        plants.made[b] += made
        if S[SRow.T] >= end:
            return Why.END
        return Why.ATTEMPTS if _large(S, plants.h_min) else Why.STEP_TOO_SMALL

    def _runs_with(self, events: Eventful, b: int) -> int:
        """Make steps and events up to the sample; return the reason to stop."""
        plants, manifold = self.plants, self.integrator.system.manifold
        model = self.integrator.model
        while plants.made[b] < plants.attempts:
            allowed = min(EVENTFUL_ATTEMPTS, plants.attempts - int(plants.made[b]))
            _, made, stop = self.engine.march(self.work, allowed)
            plants.made[b] += made
            jumps = events.jumps(0)
            for t, which in zip(jumps.t.tolist(), jumps.which, strict=True):
                plants.happened += [(b, t, model.events[i].name) for i in np.flatnonzero(which)]
            if stop in WHY:
                return WHY[stop]
            if stop in (Stop.FOLLOW, Stop.DECIDE):
                moved = any(model.events[i].reset for i in np.flatnonzero(jumps.which[-1]))
                closes = moved and manifold is not None and manifold.m
                if closes or not self._follow():
                    return Why.SEARCH
            if stop is Stop.DECIDE:
                S, d = self.work.S, self.work.R[RRow.d(self.integrator.system.nx)].copy()
                t, before = float(S[SRow.T]), jumps.before[-1].copy()
                S[SRow.Y] = self.integrator.decided(t, before, S[SRow.Y].copy(), d)
                events.decided()
        return Why.ATTEMPTS


def _large(S: Array, h_min: float) -> bool:
    """Return True if the step is long enough to continue; False for NaN."""
    h = S[SRow.H]
    return bool(h >= h_min and h >= FLOOR * abs(S[SRow.T]))


EVENTFUL_ATTEMPTS = 50_000
"""Attempts per call of an engine for models with events."""
WHY = {
    Stop.END: Why.END, Stop.STEP_TOO_SMALL: Why.STEP_TOO_SMALL, Stop.TERMINAL: Why.OVER,
    Stop.STORM: Why.STORM,
}  # fmt: skip


def looking(integrator: Integrator, plants: Plants, backend: str) -> Callable[[], Array]:
    """Return a function for the signals of all plants at their times, shape (plants, signals)."""
    S, d = plants.S, plants.R[:, RRow.d(integrator.system.nx)]
    if len(S) > 1:
        rows = [S[:, SRow.T], S[:, SRow.Y], d]
        return lambda: integrator.signal_columns(rows, backend=backend)[0]
    function, arguments = densified(integrator.signals), (S[0, : SRow.T + 1], S[0, SRow.Y], d[0])
    values = np.zeros((1, function.numel_out(0)))
    call = bound(function, arguments, [values])

    def look() -> Array:
        call()
        return values

    return look
