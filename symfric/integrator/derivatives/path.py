"""Steps and jumps of a run to be differentiated, and the names to differentiate with respect to."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple, final

import numpy as np
from numpy.typing import NDArray

from symfric.foundation.numeric import Array
from symfric.foundation.parameters import check_names
from symfric.integrator.equations.inputs import InputData
from symfric.integrator.running.integrator import Integrator
from symfric.integrator.running.record import Dense, Jumps
from symfric.model import Model

Parameters = tuple[int, ...]
"""Row in p of each parameter, -1 for a start value."""


@final
@dataclass(frozen=True, eq=False)
class Seeds:
    """Parameters and start values to differentiate with respect to.

    Attributes:
        names: as the user wrote them: a parameter, or "x0.v" for the start value of the state v.
        parameters: row in p of each name, -1 for a start value.
        start: derivative of the start values of x with respect to each name, shape (nx, names).
    """

    names: tuple[str, ...]
    parameters: Parameters
    start: Array


def of_data(parameters: Parameters, n_d: int) -> Array:
    """Return the derivative of the run data d with respect to each name, shape (n_d, names)."""
    return np.array(np.arange(n_d)[:, None] == parameters, dtype=float)


def seeds(
    model: Model,
    names: Sequence[str],
    x0: Mapping[str, float] | None,
    p: Mapping[str, float] | None,
    t: float = 0.0,
) -> Seeds:
    """Return the seeds of the names; `x0` and `p` as in `simulate`, for a start at `t` [s].

    A start value that depends on names, such as that of a bristle in steady sliding, is
    differentiated as well.

    Raises:
        ValueError: a name that is neither a free parameter nor "x0." followed by a state.
    """
    free, states = [v.name for v in model.p], [v.name for v in model.x]
    known = [*free, *(f"x0.{name}" for name in states)]
    check_names(f"sensitivities of '{model.name}' (parameters must be free)", names, known)
    start = dict(zip(states, model.initial_state(x0, p, t).tolist(), strict=True))
    by_p, _ = model.start_slopes(x0, p, t)

    def column(name: str) -> Array:
        if name in free:
            return by_p[:, free.index(name)]
        given = {**(x0 or {}), name[3:]: start[name[3:]]}
        return model.start_slopes(given, p, t)[1][:, states.index(name[3:])]

    columns = [column(name) for name in names]
    rows = tuple(free.index(n) if n in free else -1 for n in names)
    return Seeds(tuple(names), rows, np.column_stack(columns))


class Jump(NamedTuple):
    """Events that happened together.

    Attributes:
        step: number of accepted steps before the events.
        t: time [s].
        size: full size of the step that the events cut [s]; 0 if they cut none.
        at_once: True if another jump led to the events instead of motion.
        before, after: unknowns before and after the events, shape (n,).
        which: numbers of the events.
    """

    step: int
    t: float
    size: float
    at_once: bool
    before: Array
    after: Array
    which: tuple[int, ...]


class Break(NamedTuple):
    """Time at which input data change and algebraic unknowns follow.

    Attributes:
        step: number of the first step with the new data.
        t: time [s].
    """

    step: int
    t: float


Opening = tuple[int, tuple[Jump | Break | None, ...]]
"""Number of a step, and the jumps right before it in their order; None stands for the start."""


@final
@dataclass(frozen=True, eq=False)
class RunPath:
    """Accepted steps of a run, and the data with which they were made.

    Attributes:
        integrator, inputs, p, backend: those of the run.
        dense: continuous solution.
        guess: initial guess of the consistent start values.
        happened: events that were carried out.
        tolerance: tolerance of event times [s].
        known: times of the result [s] and unknowns there, shape (n, times).
    """

    integrator: Integrator
    dense: Dense
    inputs: InputData
    p: Array
    backend: str
    guess: Array
    happened: Sequence[Jumps] = ()
    tolerance: float = 0.0
    known: tuple[Array, Array] | None = None

    def at(self, times: Array) -> list[Array]:
        """Return the times, and the unknowns y and run data d at these times, one row each."""
        y = self.dense(times)
        if self.known is not None and times is self.known[0]:
            y = self.known[1]
        return [times, y.T, self.data(self._intervals(times))]

    def data(self, interval: NDArray[np.intp]) -> Array:
        """Return the run data d on input intervals, shape (intervals, n_d)."""
        if self.inputs.values.shape[1] == 1:
            d = np.concatenate([self.p, self.inputs.values[:, 0]])
            return np.ndarray((interval.size, d.size), float, d, 0, (0, d.itemsize))
        p = np.tile(self.p, (interval.size, 1))
        return np.hstack([p, self.inputs.values[:, interval].T])

    def _intervals(self, times: Array) -> NDArray[np.intp]:
        if self.inputs.breaks.size == 2:
            return np.zeros(times.size, dtype=np.intp)
        return self.inputs.interval(times)

    @cached_property
    def jumps(self) -> list[Jump]:
        """Events that were carried out, one after another."""
        return [
            Jump(
                int(some.step[i]),
                float(some.t[i]),
                max(float(some.size[i]), 0.0),
                bool(some.size[i] == 0),
                some.before[i],
                some.after[i],
                tuple(np.flatnonzero(some.which[i]).tolist()),
            )
            for some in self.happened
            for i in range(some.t.size)
        ]

    @cached_property
    def interval(self) -> NDArray[np.intp]:
        """Input interval of each step."""
        return self._intervals((self.dense.t0 + self.dense.t1) / 2)

    @cached_property
    def size(self) -> Array:
        """Size of each step [s]; the full size if an event cut the step."""
        size = self.dense.t1 - self.dense.t0
        for jump in self.jumps:
            if jump.size:
                size[jump.step - 1] = jump.size
        return size

    @cached_property
    def theta(self) -> Array:
        """Fraction of each step up to the event that cut it."""
        return (self.dense.t1 - self.dense.t0) / self.size

    @cached_property
    def steps(self) -> list[Array]:
        """Start values y, sizes h and run data d of all steps."""
        return [self.dense.y0, self.size, self.data(self.interval)]

    def shares(self, theta: Array) -> Array:
        """Return the weights of start, end and dense output in a step's values, a row per theta."""
        found = np.empty((theta.size, self.dense.D.shape[1] + 2))
        found[:, 0], found[:, 1] = 1 - theta, theta
        for row in range(2, found.shape[1]):
            found[:, row] = theta * (found[:, row - 1] if row > 2 else found[:, 0])
        return found

    def place(self, jump: Jump) -> int:
        """Return the input interval in which events happened.

        At a break, it is the earlier interval if the events cut a step, else the later one.
        """
        if jump.size:
            return int(self.interval[jump.step - 1])
        return int(self.inputs.interval(np.array([jump.t]))[0])

    @cached_property
    def breaks(self) -> list[Break]:
        """Jumps of the inputs that algebraic unknowns follow."""
        if not self.integrator.system.algebraic[0]:
            return []
        steps = np.flatnonzero(np.diff(self.interval)) + 1
        return [Break(int(k), float(self.dense.t0[k])) for k in steps]

    @property
    def linked(self) -> bool:
        """True if there are jumps between the steps."""
        return bool(self.happened) or len(self.openings) > 1

    @cached_property
    def openings(self) -> list[Opening]:
        """Start of the run, and all jumps grouped by the step that they precede."""
        marks: list[Jump | Break] = []
        breaks = self.breaks
        for jump in self.jumps:
            # an event at the time of a break comes before it, unless the break caused the event
            before = [b for b in breaks if b.step <= jump.step and (b.t < jump.t or jump.at_once)]
            breaks = breaks[len(before) :]
            marks += [*before, jump]
        found: dict[int, list[Jump | Break | None]] = {0: [None]}
        for mark in (*marks, *breaks):
            found.setdefault(mark.step, []).append(mark)
        return [(step, tuple(own)) for step, own in found.items()]
