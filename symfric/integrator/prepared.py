"""Checked arguments of all entry points, and prepared simulations.

A prepared simulation has settings, inputs and equations once, start values and parameters per call.
`simulate` uses the same class, and keeps it for each model and its settings.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Hashable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property, partial
from time import perf_counter
from typing import Any, NamedTuple, final

import numpy as np
from numpy.typing import ArrayLike

from symfric.foundation import checks
from symfric.foundation.numeric import Array
from symfric.foundation.packed import state_of
from symfric.foundation.status import SolveError, Status
from symfric.integrator.compiled.columns import BACKENDS
from symfric.integrator.equations.initial import first_guess
from symfric.integrator.equations.inputs import Input, InputData, input_data, paced
from symfric.integrator.methods.method import Method
from symfric.integrator.methods.tableaux import LOOSE, chosen
from symfric.integrator.running.doubts import doubts
from symfric.integrator.running.integrator import Integrator, built, remember
from symfric.integrator.running.record import RunRecord
from symfric.integrator.running.run import MANY_STEPS, Tolerances, integrate, watchful
from symfric.integrator.stored import statistics_of, trajectory_of
from symfric.model import Model, check_model
from symfric.results.trajectory import Trajectory

MOST_SAMPLES = 10**7
"""Largest number of samples; beyond it, the array of times alone takes gigabytes."""


def check_span(
    where: str, model: Model, t_start: float, t_end: float, rtol: float, stacklevel: int = 4
) -> tuple[float, float, float]:
    """Return start and end [s] and the relative tolerance, limited to that of the model's events.

    A loose tolerance issues a warning for the line `stacklevel` calls above this function.

    Raises:
        ValueError: a value that is not a number, an empty span, or a tolerance out of range.
    """
    t_start = checks.number(f"{where}: t_start", t_start, unit="s")
    t_end = checks.number(f"{where}: t_end", t_end, unit="s")
    if t_end <= t_start:
        raise ValueError(f"{where}: expected t_end > t_start = {t_start:g} s, got {t_end:g} s")
    rtol = checks.number(f"{where}: rtol", rtol, lower=1e-13, upper=0.1)
    rtol = min((event.rtol for event in model.events if event.rtol < rtol), default=rtol)
    warn_of_loose(where, rtol, stacklevel)
    return t_start, t_end, rtol


def warn_of_loose(where: str, rtol: float, stacklevel: int) -> None:
    """Warn of a loose relative tolerance."""
    if rtol > LOOSE:
        warnings.warn(
            f"{where}: rtol = {rtol:g} is above {LOOSE:g}; whole stick phases may be lost "
            "without notice, compare with a tighter run",
            UserWarning,
            stacklevel=stacklevel,
        )


def check_times(where: str, t_start: float, t_end: float, t_eval: ArrayLike) -> Array:
    """Return `t_eval` as a new array of increasing times inside the span."""
    given: Any = t_eval
    if type(given) is np.ndarray and given.dtype == float and given.ndim == 1 and given.size:
        # the usual case, five times faster than below
        inside = t_start <= given[0] and given[-1] <= t_end
        if inside and np.count_nonzero(given[1:] > given[:-1]) == given.size - 1:
            return given.copy()
    return checks.times(f"{where}: t_eval", t_eval, t_start, t_end)


def result_times(
    where: str, t_start: float, t_end: float, t_eval: ArrayLike | None, samples: int
) -> Array:
    """Return the times of the result [s]: `t_eval`, or `samples` equally spaced ones."""
    samples = checks.count(f"{where}: samples", samples, least=2, most=MOST_SAMPLES)
    if t_eval is None:
        return np.linspace(t_start, t_end, samples)
    return check_times(where, t_start, t_end, t_eval)


def check_flags(where: str, progress: object = None, **flags: object) -> None:
    """Check that the flags are bool and that `progress`, if given, is callable."""
    for name, value in flags.items():
        if value is not True and value is not False:
            checks.flag(f"{where}: {name}", value)
    if progress is not None:
        checks.function(f"{where}: progress", progress, "a function of the fraction done")


def tolerances(
    where: str,
    rtol: float,
    atol: float | None,
    nominal: Array,
    event_tolerance: float,
    max_steps: int | None,
    max_step: float | None = None,
) -> Tolerances:
    """Return the checked tolerances and limits of a run.

    Args:
        where: name of the caller in messages.
        rtol: relative tolerance.
        atol: absolute tolerance in multiples of `nominal`; 0.1 rtol by default.
        nominal: typical magnitude of each state.
        event_tolerance: tolerance of event times [s].
        max_steps: largest number of attempts; with None it follows from the progress of the run.
        max_step: longest step [s]; unlimited by default.
    """
    relative = 0.1 * rtol if atol is None else checks.number(f"{where}: atol", atol, above=0.0)
    event = checks.number(f"{where}: event_tolerance", event_tolerance, unit="s", above=0.0)
    extends = max_steps is None
    attempts = MANY_STEPS if extends else checks.count(f"{where}: max_steps", max_steps)
    longest = np.inf
    if max_step is not None:
        longest = checks.number(f"{where}: max_step", max_step, unit="s", above=0.0)
    return Tolerances(rtol, relative * nominal, event, attempts, longest, atol is None, extends)


def stopping(
    where: str, inputs: InputData, times: ArrayLike, t_start: float, t_end: float
) -> InputData:
    """Return `inputs` with additional times [s] at which a step has to end."""
    if (isinstance(times, tuple) and not times) or np.size(times) == 0:
        return inputs
    return inputs.stopping_at(checks.times(f"{where}: times", times, t_start, t_end))


PLAIN: frozenset[type] = frozenset((float, int, bool, str, type(None)))
REMEMBERED, MOST_TIMES = 16, 10_000
"""Number of settings cached per model (the oldest is removed first), and largest cached grid."""


class Ran(NamedTuple):
    """Outcome of a prepared simulation.

    Attributes:
        trajectory: the result.
        run, integrator: record of the run, and the integrator with the pivots used last.
        guess, p: initial guess of the unknowns, and parameters.
    """

    trajectory: Trajectory
    run: RunRecord
    integrator: Integrator
    guess: Array
    p: Array


@final
@dataclass(frozen=True, eq=False)
class Prepared:
    """Simulation with fixed settings, as a function of start values, parameters and inputs.

    `prepare` returns it. A call returns the result of `simulate` with the same arguments, to the
    bit, without checking the settings again. Threads may call one object at the same time; a
    pickled object prepares itself again.

    Attributes:
        model: the equations.
        t_start, t_end: time span [s].
        method: the formula.
        tolerances: tolerances; `atol` has one entry per state of the model.
        t: times of the result [s].
        backend: the engine, as in `simulate`.
        u: inputs by name; the others keep their start values.
        stops: times [s] at which a step has to end.
    """

    model: Model
    t_start: float
    t_end: float
    method: Method
    tolerances: Tolerances
    t: Array
    backend: str
    u: Mapping[str, Input] | None = None
    stops: ArrayLike = ()

    def __getstate__(self) -> dict[str, Any]:
        return state_of(self)

    def __call__(
        self,
        x0: Mapping[str, float] | None = None,
        p: Mapping[str, float] | None = None,
        u: Mapping[str, Input] | None = None,
    ) -> Trajectory:
        """Return the trajectory for start values, parameters and inputs by name.

        Args:
            x0, p: as in `simulate`.
            u: inputs that replace those of `prepare`. Numbers and samples take 0.1 to 1 ms more,
                new functions of time require a new step.

        Raises:
            ValueError: unknown names or invalid values.
            SolveError: the integration failed; its `partial` is the trajectory so far.
        """
        own = self
        if u is not None:
            own = replace(self, u={**(self.u or {}), **self.model.named("u", u)})
        trajectory = own.run("prepared", x0, p, self.t.copy()).trajectory
        return checked(trajectory)

    @cached_property
    def inputs(self) -> InputData:
        """Inputs in terms of time and data."""
        inputs = paced(input_data(self.model, self.u, self.t_start, self.t_end), self.model)
        return stopping("simulate", inputs, self.stops, self.t_start, self.t_end)

    @property
    def integrator(self) -> Integrator:
        """Integrator with the pivots chosen by default."""
        return self._built[0]

    @cached_property
    def _built(self) -> tuple[Integrator, Tolerances, bool]:
        """Integrator, tolerances with its limits, and True if the integrator was new."""
        integrator, fresh = built(self.model, self.inputs, self.method)
        return integrator, watchful(self.tolerances, integrator, self.inputs), fresh

    def run(
        self,
        where: str,
        x0: Mapping[str, float] | None,
        p: Mapping[str, float] | None,
        looks: Array,
        progress: Callable[[float], None] | None = None,
    ) -> Ran:
        """Run once with results at the times `looks`, which belong to the result.

        Warnings name `where` and point to the line that calls the caller of this method.
        """
        model, begin, known = self.model, perf_counter(), "_built" in self.__dict__
        (integrator, allowed, fresh), inputs = self._built, self.inputs
        build_time = perf_counter() - begin if fresh and not known else 0.0
        values = model.values("p", p)
        start = model.started(x0, values, self.t_start)
        y0 = first_guess(integrator.system, model, start, self.t_start)
        if integrator.system.has_pivots:
            at_start = (y0, np.concatenate([values, inputs.values[:, 0]]))
            integrator = integrator.suited([at_start], self.t_end - self.t_start)
        compiled_before, begin = integrator.compile_time, perf_counter()
        run, own = integrate(integrator, inputs, y0, values, allowed, self.backend, progress, looks)
        compile_time = integrator.compile_time - compiled_before
        run_time = perf_counter() - begin - compile_time
        count = partial(statistics_of, integrator, run, build_time, compile_time, run_time)
        for said in doubts(own, inputs, run, values):
            run.message += f" {said}"
            warnings.warn(type(said)(f"{where} '{model.name}': {said}"), stacklevel=3)
        made = trajectory_of(model, lambda: integrator, inputs, run, values, count, self.backend)
        return Ran(made, run, own, y0, values)


def checked(trajectory: Trajectory) -> Trajectory:
    """Return a trajectory that succeeded or was interrupted.

    Raises:
        SolveError: the integration failed.
    """
    if not trajectory.status.ok and trajectory.status is not Status.INTERRUPTED:
        raise SolveError(trajectory.message, trajectory.status, trajectory)
    return trajectory


def prepare(
    model: Model,
    t_end: float,
    *,
    t_start: float = 0.0,
    u: Mapping[str, Input] | None = None,
    rtol: float = 1e-6,
    atol: float | None = None,
    t_eval: ArrayLike | None = None,
    samples: int = 2001,
    method: str = "auto",
    backend: str = "auto",
    event_tolerance: float = 1e-10,
    max_steps: int | None = None,
    max_step: float | None = None,
    times: ArrayLike = (),
) -> Prepared:
    """Prepare the simulation of a model for many calls.

        run = prepare(model, t_end, ...)      run(x0=..., p=..., u=...)

    The result of a call equals that of `simulate` with the same arguments, to the bit. A call does
    not check the settings again and does not evaluate inputs again that are functions of time.

    Args:
        model: the equations.
        t_end, t_start: time span [s].
        u: inputs by name, as in `simulate`; a call may replace them.
        rtol, atol, t_eval, samples, method, backend, event_tolerance, max_steps, max_step, times:
            as in `simulate`.

    Returns:
        The simulation as a function of start values, parameters and inputs.

    Raises:
        ValueError: bad input.

    Warns:
        UserWarning: rtol above 1e-5, where stick phases may be missed.
    """
    check_model("prepare", model)
    limits = event_tolerance, max_steps, max_step
    asked = t_start, t_end, rtol, atol, samples, method, backend, *limits
    ready, looks = prepared("prepare", model, asked, t_eval)
    looks.flags.writeable = False
    if np.size(times):  # a copy, which the caller cannot change
        times = tuple(checks.times("prepare: times", times, ready.t_start, ready.t_end))
    made = replace(ready, t=looks, u=None if u is None else model.named("u", u), stops=times)
    _ = made.integrator  # checks the inputs and builds the step
    return made


def prepared(
    where: str, model: Model, asked: tuple[Any, ...], t_eval: ArrayLike | None
) -> tuple[Prepared, Array]:
    """Return a simulation without given inputs, from a cache, and new times of its result [s].

    Args:
        where: name of the caller in messages.
        model: the equations.
        asked: arguments of `_checked`.
        t_eval: times of the result [s]; None for those of the settings.

    Raises:
        ValueError: bad input.

    Warns:
        UserWarning: a loose tolerance.
    """
    known: dict[Hashable, Prepared] = model.memory.setdefault("prepared", {})
    # 1.0 and True are equal keys, but only 1.0 is a valid time
    key = (*asked, *map(type, asked))
    # scalar arrays and expressions are numbers but not keys
    plain = PLAIN.issuperset(key[len(asked) :])
    found = known.get(key) if plain else None
    if found is None:
        found = _checked(where, model, *asked)
        if plain and found.t.size <= MOST_TIMES:
            remember(known, key, found, REMEMBERED)
    else:
        warn_of_loose(where, found.tolerances.rtol, stacklevel=4)
    if t_eval is None:
        return found, found.t.copy()
    return found, check_times(where, found.t_start, found.t_end, t_eval)


def _checked(
    where: str,
    model: Model,
    t_start: float,
    t_end: float,
    rtol: float,
    atol: float | None,
    samples: int,
    method: str,
    backend: str,
    event_tolerance: float,
    max_steps: int | None,
    max_step: float | None,
) -> Prepared:
    t_start, t_end, rtol = check_span(where, model, t_start, t_end, rtol, stacklevel=6)
    formula = chosen(where, method, rtol)
    checks.choice(f"{where}: backend", backend, BACKENDS)
    times = result_times(where, t_start, t_end, None, samples)
    limits = model.nominal("x"), event_tolerance, max_steps, max_step
    allowed = tolerances(where, rtol, atol, *limits)
    return Prepared(model, t_start, t_end, formula, allowed, times, backend)
