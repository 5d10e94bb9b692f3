"""Periodic orbits of models, stable or not, with their Floquet multipliers."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, final

import numpy as np
from numpy.typing import NDArray

from symfric.dynamics.equilibrium import Equilibrium
from symfric.dynamics.linear import linearize
from symfric.dynamics.shooting import (
    CLOSED,
    METHOD,
    LinearisedShooting,
    OrbitShooting,
    check_period,
    solved,
)
from symfric.foundation import checks
from symfric.foundation.numeric import Array
from symfric.foundation.shown import Showing, Shown, TextTable
from symfric.integrator import Input, Trajectory, simulate
from symfric.model import Model, check_model
from symfric.model.kinds import MODE
from symfric.results.sections import Cycle

if TYPE_CHECKING:
    from matplotlib.figure import Figure

ROUGH = 0.05
"""Tolerance of the returns of a run that is used as a guess."""
NEUTRAL = 1e-6
"""Distance of a multiplier from the unit circle within which stability is undecided."""
SMALL = 1e-3
"""Amplitude, relative to that of the guess, below which an orbit is taken as an equilibrium."""
PARTS = (2, 3, 4, 5, 6, 7)
"""Fractions of the period after which an orbit may have returned."""
FURTHER = 40
"""Number of periods by which a run is continued if its end is not near enough to an orbit."""
PUSH, PERIODS = 1e-3, 400
"""Deviation from an unstable equilibrium, relative to nominal values, and length of the run."""
MODE_CHANGED = 0.5
"""Difference of modes that counts as another mode."""


@final
@dataclass(frozen=True, eq=False, repr=False)
class PeriodicOrbit(Showing):
    """Periodic motion of a model.

    Attributes:
        model: the model.
        x: states at the start by name.
        period: period T [s].
        u, p: inputs, and values of the free parameters.
        multipliers: Floquet multipliers, the largest first; without that of the direction of motion
            if the period is not given. A small deviation is multiplied by them in each period.
        symmetric: True for an orbit whose second half is the mirror image of the first.
        driven: True if the period is given by inputs or by time in the equations.
        error: difference of start and end, relative to the ranges of the states, in a run with a
            hundredth of the tolerance.
        rtol: relative tolerance of the runs.
    """

    model: Model
    x: Mapping[str, float]
    period: float
    u: Mapping[str, Input]
    p: Mapping[str, float]
    multipliers: NDArray[np.complex128]
    symmetric: bool
    driven: bool
    error: float
    rtol: float

    @cached_property
    def run(self) -> Trajectory:
        """Run over one period."""
        return simulate(
            self.model, self.period, x0=self.x, u=self.u, p=self.p, rtol=self.rtol, method=METHOD
        )

    @cached_property
    def cycle(self) -> Cycle:
        """Measures of the orbit: extremes, amplitudes, means, sticking, spectrum."""
        return Cycle(self.run, self.period, 0.0, 0.0, np.zeros(1), self.error)

    @property
    def stable(self) -> bool | None:
        """True if all deviations decay, False if one grows.

        None if the largest multiplier is within 1e-6 of the unit circle: then first derivatives do
        not decide.
        """
        largest = float(np.abs(self.multipliers).max(initial=0.0))
        return None if abs(largest - 1) <= NEUTRAL else largest < 1

    @property
    def events(self) -> tuple[str, ...]:
        """Names of the events of one period in their order."""
        return tuple(name for _, name in self.run.happened)

    @property
    def drift(self) -> dict[str, float]:
        """Change in a period of each cyclic state (`Model.cyclic`), and of each angle that turns.

        No equation or event depends on a cyclic state, or changes by a whole turn of an angle.
        """
        change = {
            name: end - self.x[name] for name, end in self.run.final.items() if name in self.x
        }
        turning = [name for name in self.model.angles if abs(change[name]) > np.pi]
        return {name: change[name] for name in (*self.model.cyclic, *turning)}

    def amplitude(self, name: str) -> float:
        """Return half of the difference between the largest and smallest value of a signal."""
        return self.cycle.amplitude(name)

    def plot(self, x: str, y: str, path: str | Path | None = None) -> "Figure":
        """Plot the orbit in the plane of two signals; sticking parts of the orbit are thick.

        Args:
            x, y: names of signals or details.
            path: image file.
        """
        from symfric.dynamics.pictures import portrait  # noqa: PLC0415  (slow to import)

        return portrait(self.run, x, y, path)

    def shown(self) -> Shown:
        """Return period, stability, multipliers and the extremes of the states."""
        words = {True: "stable", False: "unstable", None: "on the limit of stability"}
        kind = ", symmetric" if self.symmetric else ""
        sizes = ", ".join(f"{abs(m):.3g}" for m in self.multipliers[:6])
        lines = [f"period {self.period:.9g} s, multipliers of size {sizes or 'none'}"]
        if self.events:
            lines.append(f"events: {', '.join(self.events)}")
        units = {v.name: v.unit for v in self.model.x}
        lines += [f"{n} changes by {d:.6g} {units[n]} in a period" for n, d in self.drift.items()]
        rows = list[tuple[str, ...]]()
        for v in self.model.x:
            low, high = self.cycle.extremes(v.name)
            rows.append((v.name, v.unit, f"{low:.6g}", f"{high:.6g}"))
        title = f"periodic orbit of '{self.model.name}'{kind}, {words[self.stable]}"
        table = TextTable(("state", "unit", "least", "greatest"), tuple(rows), numbers=(2, 3))
        return Shown(title, tuple(lines), table)


def guessed(
    model: Model, x: Mapping[str, float], period: float, u: Mapping[str, Input],
    p: Mapping[str, float], rtol: float,
) -> PeriodicOrbit:  # fmt: skip
    """Return a guess of an orbit for `periodic_orbit`, from its start and its period."""
    unknown = np.zeros(0, dtype=complex)
    return PeriodicOrbit(model, x, period, u, p, unknown, False, False, 0.0, rtol)


def periodic_orbit(
    model: Model,
    guess: "Trajectory | PeriodicOrbit | Equilibrium",
    *,
    u: Mapping[str, Input] | None = None,
    p: Mapping[str, float] | None = None,
    period: float | None = None,
    symmetric: bool = False,
    segments: int = 1,
    rtol: float = 1e-9,
) -> PeriodicOrbit:
    """Return the periodic orbit near a guess, stable or unstable, by shooting.

        x(T) = x(0),   T unknown   or   x(T/2) = -x(0) of a symmetric orbit

    Cyclic states and whole turns of angles are left out (`PeriodicOrbit.drift`).

    Newton's method uses the derivatives of the flow through stick and slip. Events of laws with
    modes stay events: there is no smoothing. The order of the events may change on the way.

    Args:
        model: explicit model or mechanism.
        guess: a run that has nearly settled, which is continued if necessary; another orbit; or an
            unstable equilibrium, from which a run starts.
        u: inputs by name; functions of time need a `period`.
        p: values of free parameters; by default those of an orbit or equilibrium as the guess.
        period: period [s] of the inputs or of the time in the equations, from t = 0 on; by default
            it is an unknown. Functions of time have to repeat after it.
        symmetric: True if all states except modes without sign change their signs after half a
            period; the result is then the orbit with this symmetry.
        segments: number of parts of the period with states of their own (multiple shooting), for
            orbits whose deviations grow strongly within a period.
        rtol: relative tolerance of the runs; the orbit closes to about 100 rtol of its ranges.

    Raises:
        ValueError: bad input, or no orbit was found near the guess: the run does not repeat, the
            iteration fails or leads to an equilibrium, an event touches zero without crossing, or
            contacts have other modes at the end than at the start.
    """
    where = "periodic_orbit"
    check_model(where, model)
    checks.number(f"{where}: rtol", rtol, above=0.0, upper=1e-5)
    checks.flag(f"{where}: symmetric", symmetric)
    m = checks.count(f"{where}: segments", segments, least=1)
    if period is not None:
        checks.number(f"{where}: period", period, unit="s", above=0.0)
    if model.ode is None:
        raise checks.refused(where, "a model with explicit rates, ode", model)
    if isinstance(guess, PeriodicOrbit | Equilibrium):
        p = dict(guess.p) if p is None else p
        u = guess.u if u is None else u
    u, p = model.named("u", u), model.named("p", p)
    check_period(model, u, p, period)
    run, start, T = _start(model, guess, u, p, period, rtol)
    try:
        return found(model, run, start, T, u, p, symmetric, m, rtol, driven=period is not None)
    except ValueError:
        if period is not None or not isinstance(guess, Trajectory):
            raise
        run, time = _settled(model, guess, u, p, T)
        return found(model, run, 0.0, time, u, p, symmetric, m, rtol, driven=False)


def _settled(
    model: Model, run: Trajectory, u: Mapping[str, Input], p: Mapping[str, float], T: float
) -> tuple[Trajectory, float]:
    """Return the continuation of a run over further periods, and its period."""
    x0 = {v.name: run.final[v.name] for v in model.x}
    run = simulate(model, FURTHER * T, x0=x0, u=u, p=p, rtol=1e-7, method=METHOD)
    return run, run.period(tolerance=ROUGH).period


def found(
    model: Model, run: Trajectory, start: float, T: float, u: Mapping[str, Input],
    p: Mapping[str, float], symmetric: bool, m: int, rtol: float, *, driven: bool,
) -> PeriodicOrbit:  # fmt: skip
    """Return the orbit near the part of a run from `start` over the period T."""
    inside = run.looks[(run.looks >= start) & (run.looks <= start + T)]
    values = np.array([*run.at(inside).values()])[: len(model.x)]
    ranges = np.ptp(values, axis=1)
    nominal = model.nominal("x")
    scale = np.maximum(ranges, 1e-9 * nominal)
    scale[[v.kind == MODE for v in model.x]] = 1.0
    problem = OrbitShooting(model, u, (), scale, _signs(model, symmetric), rtol, driven)
    part = T / 2 if symmetric else T
    if not driven:
        start = _fastest(model, run, T)
        run, part = _returning(problem, run, start, part, p)
        start = 0.0
    at = np.minimum(start + part * np.arange(m) / m, run.span[1])
    starts = np.array([*run.at(at).values()])[: len(model.x)].T
    last = solved(problem, starts, part, p)
    _check(problem, last, ranges)
    orbit = _orbit(problem, p, last, symmetric)
    if not driven and (n := _fraction(orbit, problem)) > 1:
        return found(
            model, orbit.run, 0.0, orbit.period / n, u, p, symmetric, m, rtol, driven=False
        )
    return orbit


def _fraction(orbit: PeriodicOrbit, problem: OrbitShooting) -> int:
    """Return the largest n for which the orbit has returned after 1/n of its period."""
    parts = [n for n in PARTS if n % 2 or not orbit.symmetric]
    at = orbit.run.at(np.array([0.0, *(orbit.period / n for n in parts)]))
    states = np.array([at[name] for name in orbit.x])
    off = np.abs(problem.without_turns(states[:, 1:] - states[:, :1])) / problem.scale[:, None]
    off = off[problem.returning].max(axis=0)
    return max([1, *(n for n, x in zip(parts, off, strict=True) if x < 10 * CLOSED * orbit.rtol)])


def _signs(model: Model, symmetric: bool) -> Array:
    """Return the signs of the states after half a period."""
    if not symmetric:
        return np.ones(len(model.x))
    even = {
        v.name
        for c in model.contacts
        for s, v in zip(c.law.states, c.states, strict=True)
        if s.even
    }
    return np.array([1.0 if v.name in even else -1.0 for v in model.x])


def _start(
    model: Model, guess: Any, u: Mapping[str, Input], p: Mapping[str, float],
    period: float | None, rtol: float,
) -> tuple[Trajectory, float, float]:  # fmt: skip
    """Return a run that contains a period of the guess, its start and the period."""
    where = "periodic_orbit: guess"
    if isinstance(guess, PeriodicOrbit):
        run = simulate(model, 2 * guess.period, x0=guess.x, u=u, p=p, rtol=rtol, method=METHOD)
        return run, 0.0, guess.period if period is None else period
    if isinstance(guess, Equilibrium):
        guess = _pushed(model, guess, u, p)
    if not isinstance(guess, Trajectory):
        raise checks.refused(where, "a run, a periodic orbit or an equilibrium", guess)
    guess.check([v.name for v in model.x])
    if period is not None:
        first, last = guess.span
        start = period * np.floor((last - period) / period)
        if start < first or ((guess.looks >= start) & (guess.looks <= start + period)).sum() < 3:
            raise checks.refused(
                where, f"a run of {period:g} s or more, with 3 times in a period", guess
            )
        return guess, float(start), period
    cycle = guess.period(tolerance=ROUGH)
    return guess, cycle.start, cycle.period


def _pushed(
    model: Model, at: Equilibrium, u: Mapping[str, Input], p: Mapping[str, float]
) -> Trajectory:
    """Return a run that starts next to an unstable equilibrium."""
    linear = linearize(model, at)
    values: NDArray[np.complex128]
    values, vectors = (part.astype(complex) for part in np.linalg.eig(linear.A))
    k = int(np.argmax(values.real))
    fastest = complex(values[k])
    if not fastest.real > 0:
        raise ValueError(
            f"periodic_orbit: guess: expected an unstable equilibrium of '{model.name}', "
            "got another; give a run that has settled to the orbit"
        )
    direction = (at.tangent.T @ vectors[:, k]).real[: len(model.x)]
    nominal = model.nominal("x")
    size = PUSH / float(np.abs(direction / nominal).max())
    x = np.array([*at.x.values()]) + size * direction
    period = 2 * np.pi / abs(fastest)
    span = period * min(PERIODS, 30 + 3 * abs(fastest) / fastest.real)
    return simulate(model, span, x0=dict(zip(at.x, x.tolist(), strict=True)), u=u, p=p, rtol=1e-8)


def _fastest(model: Model, run: Trajectory, period: float) -> float:
    """Return the time at which the slowest contact slides fastest, a period before the end."""
    first, last = max(run.span[0], run.span[1] - 2 * period), run.span[1] - period
    times = run.looks[(run.looks >= first) & (run.looks <= last)]
    times = times if times.size else np.array([first])
    least = np.zeros(times.size)
    for k, c in enumerate(model.contacts):
        speed = np.abs(run.of(c.slip, times))
        share = speed / max(float(speed.max()), 1e-300)
        least = np.minimum(least, share) if k else share
    return float(times[int(np.argmax(least))])


def _returning(
    problem: OrbitShooting, run: Trajectory, start: float, part: float, p: Mapping[str, float]
) -> tuple[Trajectory, float]:
    """Return a run from the state at `start`, and the time at which it returns most closely."""
    names = [v.name for v in problem.model.x]
    first = run.at(start)
    x0 = {name: float(first[name][0]) for name in names}
    run = simulate(problem.model, 1.5 * part, x0=x0, u=problem.u, p=p, rtol=1e-7, method=METHOD)
    times = run.looks[run.looks >= 0.5 * part]
    at = run.at(times)
    values = problem.signs[:, None] * np.array([at[name] for name in names])
    off = problem.without_turns(values - np.array([*x0.values()])[:, None]) / problem.scale[:, None]
    return run, float(times[int(np.argmin(np.abs(off[problem.returning]).max(axis=0)))])


def _check(problem: OrbitShooting, at: LinearisedShooting, ranges: Array) -> None:
    """Raise an error for a solution that is not the orbit."""
    model, modes = problem.model, problem.eq.modes
    where = f"periodic_orbit: expected an orbit of '{model.name}' near the guess"
    for i, part in enumerate(at.segments):
        after = at.segments[(i + 1) % len(at.segments)].start
        end = problem.signs * part.end if part is at.segments[-1] else part.end
        if (np.abs(end - after)[modes] > MODE_CHANGED).any():
            raise ValueError(f"{where}, got one whose contacts do not return to their modes")
    states = [model.x[i].name for i in problem.states]
    reach = [part.run.extremes for part in at.segments]
    size = np.array([max(e[n][1] for e in reach) - min(e[n][0] for e in reach) for n in states])
    if (size < SMALL * ranges[problem.states]).all() and not problem.driven:
        raise ValueError(f"{where}, got an equilibrium; give a run with a larger motion")


def _orbit(
    problem: OrbitShooting, p: Mapping[str, float], at: LinearisedShooting, symmetric: bool
) -> PeriodicOrbit:
    """Return the orbit with its multipliers and its error."""
    model, start = problem.model, at.segments[0].start
    x = dict(zip((v.name for v in model.x), start.tolist(), strict=True))
    multipliers = at.multipliers(driven=problem.driven, symmetric=symmetric)
    rtol = max(problem.rtol / 100, 1e-13)
    finer = simulate(
        model, at.time, x0=x, u=problem.u, p=p, rtol=rtol, t_eval=(0.0, at.time), method=METHOD
    )
    ends = np.array([finer[name] for name in x])
    off = np.abs(problem.without_turns(problem.signs * ends[:, 1] - ends[:, 0])) / problem.scale
    error = float(off[problem.returning].max(initial=0.0))
    period = (1 + symmetric) * at.time
    values = dict(zip((v.name for v in model.p), model.values("p", p).tolist(), strict=True))
    return PeriodicOrbit(
        model, x, period, problem.u, values, multipliers, symmetric, problem.driven, error,
        problem.rtol,
    )  # fmt: skip
