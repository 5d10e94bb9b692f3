"""Sampled plants with held inputs: all of them advance by one call, without records.

As in `symfric.integrator.running.engine` there are two engines, which do the same operations in one
order: a loop in C around the generated step, and one in Python around CasADi's virtual machine.
"""

import ctypes
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from time import perf_counter
from typing import final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.foundation.numeric import bound
from symfric.foundation.programs import find_compiler
from symfric.integrator.compiled.compiler import load
from symfric.integrator.equations.initial import FLOOR, first_step
from symfric.integrator.running import loop
from symfric.integrator.running.engine import Engine, Stop
from symfric.integrator.running.events import Eventful
from symfric.integrator.running.integrator import Integrator
from symfric.integrator.running.record import Outputs
from symfric.integrator.step.layout import Given, State

Array = NDArray[np.float64]
Counts = NDArray[np.int64]
END, ATTEMPTS, STEP_TOO_SMALL, SEARCH, AGAIN, STORM, OVER = 0, 2, 3, 4, 5, 6, -1
"""State of a plant: at its sample; out of attempts; steps too small; algebraic unknowns too far
from the last ones to follow (`symfric.integrator.equations.blocks`); resolved by the caller, to
be continued; event storm; ended by a terminal event.
"""
SAMPLES = 1000
"""The first step of a plant is that of a run of this many samples."""
REFUSED = -1
"""Return value of `Advance` if an input is not finite; nothing has changed then."""

Advance = Callable[[int], int]
"""Function that takes over inputs and goes to the next sample (1), or continues plants marked AGAIN
(0); returns the number of plants that did not get there.
"""


@final
@dataclass(eq=False)
class Plants:
    """Mutable data of plants of one model; both engines work on these arrays, row by row in memory.

    Attributes:
        S, R: columns of an attempt, one row per plant (`symfric.integrator.step.layout`).
        u: inputs to hold next, shape (plants, nu); the last run data are those held now.
        begin: start times [s]; the k-th sample of a plant is at begin + k dt.
        count: k; unchanged for a plant that has not reached its sample.
        ready: 1 if its algebraic unknowns already match the inputs to hold next.
        why: END ... OVER.
        made: attempts in its last interval.
        dt: interval [s].
        attempts: allowed in one interval.
        h_min: least step [s].
        memory: event memory, one row per plant; without columns if there are no events.
        happened: (plant, time [s], name) of the events of the last interval.
    """

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
        """Return the first step [s] to try: that of a run of `SAMPLES` samples."""
        return min(first_step(SAMPLES * self.dt, self.begin[0]), float(self.R[0, Given.H_MAX]))

    def copy(self) -> "Plants":
        """Return a copy with its own memory."""
        own = {name: getattr(self, name).copy() for name in (*SHARED, "memory", "happened")}
        return replace(self, **own)

    def back_to(self, before: "Plants") -> None:
        """Restore the state `before`, a copy, in the same memory."""
        for name in (*SHARED, "memory", "happened"):
            getattr(self, name)[:] = getattr(before, name)


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
        """Return the struct with the addresses of arrays; the caller keeps them alive."""
        addresses = (getattr(plants, name).ctypes.data for name in SHARED)
        return cls(plants.S.shape[0], plants.attempts, plants.dt, plants.h_min, *addresses)


def compiled(integrator: Integrator, plants: Plants) -> Advance:
    """Return the compiled loop.

    Raises:
        CompileError: no compiler was found, or it failed.
    """
    return loaded(integrator, plants, "plants", c_source)


def loaded(
    integrator: Integrator, plants: Plants, name: str, source: Callable[[Integrator], str]
) -> Advance:
    """Return the C function `symfric_plants` bound to arrays; the integrator caches its library."""
    kept = integrator.__dict__
    if name not in kept:
        library = load(source(integrator), "symfric_plants")
        library.symfric_plants.restype = ctypes.c_longlong
        library.symfric_plants.argtypes = [ctypes.c_void_p, ctypes.c_int]
        kept[name] = library
    function, members = kept[name].symfric_plants, _Members.of(plants)
    address = ctypes.addressof(members)

    def advance(begin: int, _alive: object = (members, plants)) -> int:
        short = int(function(address, begin))
        if short < REFUSED:
            raise MemoryError
        return short

    return advance


def in_vm(integrator: Integrator, plants: Plants) -> Advance:
    """Return the loop in Python; needs no compiler."""
    step, follow, nx = integrator.step, integrator.follow, integrator.system.nx
    S, R, after = (np.zeros(k) for k in (step.numel_in(0), step.numel_in(1), step.numel_in(0)))
    attempt = bound(step, (S, R), (after,))
    data, held = Given.d(nx), plants.u.shape[1]

    def runs(b: int) -> int:
        S[:], R[:], made = plants.S[b], plants.R[b], 0
        end = R[Given.T_END]
        while S[State.T] < end and made < plants.attempts and _large(S, plants.h_min):
            attempt()
            S[:] = after
            made += 1
        plants.S[b] = S
        plants.made[b] += made
        if S[State.T] >= end:
            return END
        return ATTEMPTS if _large(S, plants.h_min) else STEP_TOO_SMALL

    def takes_over(b: int) -> bool:
        own = plants.R[b]
        plants.count[b] += plants.S[b, State.T] >= own[Given.T_END]
        plants.made[b] = 0
        own[Given.T_END] = plants.begin[b] + plants.count[b] * plants.dt
        own[own.size - held :] = plants.u[b]
        if follow is None or plants.ready[b]:
            return True
        found = follow(plants.S[b, State.Y], own[data])
        if found is None:
            return False
        plants.S[b, State.Y] = found
        return True

    def advance(begin: int) -> int:
        if begin and not np.isfinite(plants.u).all():
            return REFUSED
        for b in range(plants.S.shape[0]):
            if begin and not takes_over(b):
                plants.why[b] = SEARCH
            elif begin or plants.why[b] == AGAIN:
                plants.ready[b] = 0
                plants.why[b] = runs(b)
        return int(np.count_nonzero(plants.why))

    return advance


def _large(S: Array, h_min: float) -> bool:
    """Return True if the step is long enough to continue; False for NaN."""
    h = S[State.H]
    return bool(h >= h_min and h >= FLOOR * abs(S[State.T]))


EVENTFUL_ATTEMPTS = 50_000
"""Attempts per call of an engine."""
WHY = {Stop.END: END, Stop.STEP_TOO_SMALL: STEP_TOO_SMALL, Stop.TERMINAL: OVER, Stop.STORM: STORM}


def with_events(
    integrator: Integrator, plants: Plants, engine: Engine, tolerance: float
) -> Advance:
    """Return the loop for models with events: one plant after the other, by an engine of runs.

    Python handles the samples and event requests; the engine searches for events
    (`symfric.integrator.running.events`).

    Args:
        integrator, plants: model and data.
        engine: makes the steps.
        tolerance: of event times [s].
    """
    return _Eventful(integrator, plants, engine, tolerance).advance


@final
class _Eventful:
    """Loop for models with events, with buffers for one plant."""

    def __init__(
        self, integrator: Integrator, plants: Plants, engine: Engine, tolerance: float
    ) -> None:
        self.integrator, self.plants, self.engine = integrator, plants, engine
        system, rows = integrator.system, integrator.tableau.H.shape[0]
        if integrator.crossings is None:
            raise ValueError(f"plants of '{integrator.model.name}': expected a model with events")
        self.work = loop.Work(system.n, integrator.step.numel_in(1), rows)
        self.events = Eventful(integrator.crossings, tolerance)
        self.work.want(Outputs.at(np.zeros(0), system.n), self.events)
        self.work.over(np.zeros(2), np.zeros((0, 1)))
        self.work.loop.h_min = plants.h_min
        self.data = Given.d(system.nx)

    def advance(self, begin: int) -> int:
        """Advance all plants, as `Advance`."""
        plants = self.plants
        if begin and not np.isfinite(plants.u).all():
            return REFUSED
        if begin:
            plants.happened.clear()
        for b in range(plants.S.shape[0]):
            if plants.why[b] == OVER or not (begin or plants.why[b] == AGAIN):
                continue
            self.work.S[:], self.work.R[:] = plants.S[b], plants.R[b]
            self.events.memory[:] = plants.memory[b]
            first = bool(plants.ready[b])
            follows = self._takes_over(b, first) if begin else True
            plants.why[b] = self._runs(b) if follows else SEARCH
            plants.S[b], plants.R[b] = self.work.S, self.work.R
            plants.memory[b] = self.events.memory
        return int(np.count_nonzero(plants.why > 0))

    def _takes_over(self, b: int, first: bool) -> bool:
        """Take over inputs and the next sample time; return False if unknowns could not follow."""
        plants, S, R = self.plants, self.work.S, self.work.R
        plants.count[b] += S[State.T] >= R[Given.T_END]
        plants.made[b] = plants.ready[b] = 0
        R[Given.T_END] = plants.begin[b] + plants.count[b] * plants.dt
        R[R.size - plants.u.shape[1] :] = plants.u[b]
        if first:
            self._before_start()
            return True
        self.events.entered()
        return self._follow()

    def _before_start(self) -> None:
        """Give events that have already happened at the start the values just before them."""
        events = self.integrator.model.events
        if any(event.at_start for event in events):
            S, d = self.work.S, self.work.R[self.data]
            now = self.integrator.events(S[State.T], S[State.Y], d).full().ravel()
            signs = [-e.direction if e.at_start else x for e, x in zip(events, now, strict=True)]
            self.events.jumped(np.array(signs))

    def _follow(self) -> bool:
        """Update algebraic unknowns after a jump; return False if that fails."""
        follow = self.integrator.follow
        if follow is None:
            return True
        found = follow(self.work.S[State.Y], self.work.R[self.data])
        if found is not None:
            self.work.S[State.Y] = found
        return found is not None

    def _runs(self, b: int) -> int:
        """Make steps and events up to the sample; return the reason to stop."""
        plants, manifold = self.plants, self.integrator.system.manifold
        events = self.integrator.model.events
        while plants.made[b] < plants.attempts:
            allowed = min(EVENTFUL_ATTEMPTS, plants.attempts - int(plants.made[b]))
            _, made, stop = self.engine.march(self.work, allowed)
            plants.made[b] += made
            jumps = self.events.jumps(0)
            for t, which in zip(jumps.t.tolist(), jumps.which, strict=True):
                plants.happened += [(b, t, events[int(i)].name) for i in np.flatnonzero(which)]
            if stop in WHY:
                return WHY[stop]
            if stop is Stop.FOLLOW:
                moved = any(events[int(i)].reset for i in np.flatnonzero(jumps.which[-1]))
                if (moved and manifold is not None and manifold.m) or not self._follow():
                    return SEARCH
        return ATTEMPTS


def c_source(integrator: Integrator) -> str:
    """Return the C of the step, of the update after a jump, and of the loop around them."""
    follow, nx = integrator.follow, integrator.system.nx
    n_d, nu = integrator.system.d.numel(), integrator.inputs.data.numel()
    others = () if follow is None else (follow.round,)
    attempts = loop.c_source(integrator.step, integrator.tableau.H.shape[0], *others)
    plants = loop.filled(
        "plants.c",
        nu=nu, data=Given.d(nx).start, held=Given.d(nx).start + n_d - nu,
        follows=int(follow is not None), search=SEARCH, again=AGAIN, refused=REFUSED,
    )  # fmt: skip
    return (
        attempts + ("" if follow is None else follow.c_source) + loop.filled("members.h") + plants
    )


@final
@dataclass(eq=False)
class Looks:
    """Signals of all plants at their current times: in the virtual machine until compiling saves
    time.

    Attributes:
        integrator: of the plants.
        plants: their current data.
        values: the signals, shape (plants, signals), overwritten by each call.
    """

    integrator: Integrator
    plants: Plants
    values: Array
    spent: float = 0.0
    _compiled: Callable[[], None] | None = None

    def __call__(self, backend: str) -> Array:
        """Compute the signals by "vm", "compiled" or "auto"."""
        if self._compiled is None and self._pays(backend):
            self._compiled = self._in_c()
        if self._compiled is not None:
            self._compiled()
        else:
            began = perf_counter()
            self._in_vm()
            self.spent += perf_counter() - began
        return self.values

    def _pays(self, backend: str) -> bool:
        if backend == "vm" or find_compiler() is None:
            return False
        n = self.integrator.signals.n_instructions()
        return backend == "compiled" or self.spent > 2 * (0.1 + 1.5e-4 * n)

    def _in_vm(self) -> None:
        function, nx = self.integrator.signals, self.integrator.system.nx
        p, data = self.plants, Given.d(nx)
        for S, R, out in zip(p.S, p.R, self.values, strict=True):
            bound(function, (S[State.T : State.T + 1], S[State.Y], R[data]), (out,))()

    def _in_c(self) -> Callable[[], None]:
        library = load(look_source(self.integrator), "symfric_look")
        library.symfric_look.restype = None
        library.symfric_look.argtypes = [ctypes.c_void_p] * 2
        members, out = _Members.of(self.plants), self.values.ctypes.data
        address = ctypes.addressof(members)

        def look(_alive: object = (members, library)) -> None:
            library.symfric_look(address, out)

        return look


def look_source(integrator: Integrator) -> str:
    """Return the C of the signals and of the loop over plants."""
    function, nx = integrator.signals, integrator.system.nx
    generator = ca.CodeGenerator("symfric_look.c", {"static_aux": True})
    generator.add(function)
    look = loop.filled(
        "look.c",
        columns=integrator.step.numel_in(0), given=integrator.step.numel_in(1),
        memory=State.MEMORY, t=State.T, data=Given.d(nx).start, rows=function.numel_out(0),
        arg=function.sz_arg(), res=function.sz_res(), name=function.name(),
        iw=max(1, function.sz_iw()), w=max(1, function.sz_w()),
    )  # fmt: skip
    return generator.dump() + loop.filled("members.h") + look
