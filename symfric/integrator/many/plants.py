"""Plants side by side in vector lanes, and plants with events one after the other.

What a lane does is what `symfric.integrator.running.plants` does, but for functions like exp, which
are within a few units of the last place of those there (`lanes.h`). The bits of a plant depend
neither on the number of lanes nor on who is beside it.

Python stands between the samples, and between what events ask for; the search for them is the
engine's (`symfric.integrator.running.events`).
"""

from typing import final

import casadi as ca
import numpy as np

from symfric.integrator.many.members import many_source
from symfric.integrator.many.vectors import c_text
from symfric.integrator.running.dense import Outputs
from symfric.integrator.running.engine import Engine, Stop
from symfric.integrator.running.events import Eventful
from symfric.integrator.running.integrator import Integrator
from symfric.integrator.running.loop import Work, filled
from symfric.integrator.running.plants import (
    AGAIN,
    ATTEMPTS,
    END,
    OVER,
    REFUSED,
    SEARCH,
    STEP_TOO_SMALL,
    STORM,
    Advance,
    Plants,
    loaded,
)
from symfric.integrator.step.layout import Given, State

LEAST = 8
"""Plants from which lanes pay."""
MOST = 10_000
"""Steps of more instructions take compilers too long as vectors."""


def pays(integrator: Integrator, plants: Plants) -> bool:
    """Whether plants go faster side by side."""
    return plants.S.shape[0] >= LEAST and integrator.instructions <= MOST


def side_by_side(integrator: Integrator, plants: Plants) -> Advance:
    """The loop in C on vectors.

    Raises:
        CompileError: there is no compiler, or it failed.
    """
    return loaded(integrator, plants, "lanes", c_source)


def c_source(integrator: Integrator) -> str:
    """C of the step on vectors, of what follows a jump, and of the loop around them."""
    s = integrator.system
    nothing = ca.Function("nothing", [ca.SX.sym("t"), s.y, s.d], [ca.SX(0, 1)])
    every = many_source(integrator.step, nothing, integrator.follows, integrator.follow)
    numbers = {
        "HELD": integrator.inputs.data.numel(), "REFUSED": REFUSED, "SEARCHED": SEARCH,
        "AGAIN": AGAIN,
    }  # fmt: skip
    defined = "".join(f"#define {name} ({value})\n" for name, value in numbers.items())
    return every + filled("members.h") + defined + c_text("plants.c")


BATCH = 50_000
"""Attempts of one call of an engine."""
WHY = {Stop.END: END, Stop.STEP_TOO_SMALL: STEP_TOO_SMALL, Stop.TERMINAL: OVER, Stop.STORM: STORM}


def with_events(
    integrator: Integrator, plants: Plants, engine: Engine, tolerance: float
) -> Advance:
    """The loop for models with events.

    Args:
        integrator, plants: what goes on.
        engine: that makes the steps.
        tolerance: of event times [s].
    """
    return _Eventful(integrator, plants, engine, tolerance).advance


@final
class _Eventful:
    """Buffers of the plant that is under way."""

    def __init__(
        self, integrator: Integrator, plants: Plants, engine: Engine, tolerance: float
    ) -> None:
        self.integrator, self.plants, self.engine = integrator, plants, engine
        system, rows = integrator.system, integrator.tableau.H.shape[0]
        if integrator.crossings is None:
            raise ValueError(f"plants of '{integrator.model.name}': expected a model with events")
        self.work = Work(system.n, integrator.step.numel_in(1), rows)
        self.events = Eventful(integrator.crossings, tolerance)
        self.work.want(Outputs.at(np.zeros(0), system.n), self.events)
        self.work.over(np.zeros(2), np.zeros((0, 1)))
        self.work.loop.h_min = plants.h_min
        self.data = Given.d(system.nx)

    def advance(self, begin: int) -> int:
        """As `Advance`."""
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
        """New inputs and the time of the next sample; whether algebraic unknowns could follow."""
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
        """Events that have happened by the start have values as if just before it."""
        events = self.integrator.model.events
        if any(event.at_start for event in events):
            S, d = self.work.S, self.work.R[self.data]
            now = self.integrator.events(S[State.T], S[State.Y], d).full().ravel()
            signs = [-e.direction if e.at_start else x for e, x in zip(events, now, strict=True)]
            self.events.jumped(np.array(signs))

    def _follow(self) -> bool:
        """Whether algebraic unknowns could follow a jump."""
        follow = self.integrator.follow
        if follow is None:
            return True
        found = follow(self.work.S[State.Y], self.work.R[self.data])
        if found is not None:
            self.work.S[State.Y] = found
        return found is not None

    def _runs(self, b: int) -> int:
        """Steps and events up to the sample; why they ended."""
        plants, manifold = self.plants, self.integrator.system.manifold
        events = self.integrator.model.events
        while plants.made[b] < plants.attempts:
            allowed = min(BATCH, plants.attempts - int(plants.made[b]))
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
