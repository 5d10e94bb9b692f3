"""Shooting equations of periodic orbits with exact derivatives, and their solution.

The period T is divided into equal segments. With the flow phi of the model,

    phi(T/m, x_i) = x_{i+1},   i = 0 ... m-1,   x_m = S x_0,

where S = 1, or the signs of a symmetric orbit, whose T is half of its period. The unknowns are the
independent coordinates of each x_i (constraints of mechanisms and sticking contacts are kept), and
T unless it is given. Without a given period, the correction of x_0 is orthogonal to its rate. The
derivatives of phi are those of `simulate`, with saltation matrices at events. `solved` finds an
orbit by damped Newton steps. Cyclic states, on which nothing depends, keep their start values and
need not return, and angles return up to whole turns.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple, final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.dynamics.equations import Indices, ModelEquations, equations, independent
from symfric.foundation import checks
from symfric.foundation.numeric import Array
from symfric.foundation.status import SolveError
from symfric.integrator import Input, Trajectory, simulate
from symfric.model import Model

METHOD = "rodas5p"


class Segment(NamedTuple):
    """Flow from one state over a time.

    Attributes:
        run: the run, with `t` at its start and end.
        start, end: consistent states there, shape (nx,).
        rates: rates of the states there, shape (2, nx).
        S: derivatives of the end by the start, shape (nx, nx), 0 for modes.
        of_p: derivatives of the end by each parameter, shape (nx, names).
    """

    run: Trajectory
    start: Array
    end: Array
    rates: Array
    S: Array
    of_p: Array


class LinearisedShooting(NamedTuple):
    """Shooting equations at one point, linearised.

    Attributes:
        r: residuals, shape (rows,).
        J: derivatives by the coordinates of all x_i, then by T unless it is given, then by the
            parameters, shape (rows, columns); without the phase condition.
        phase: row of the phase condition, shape (columns,); empty if T is given.
        monodromy: derivative of S phi(T, x_0) in the coordinates of x_0, shape (k, k).
        bases: indices of the coordinates and basis of the directions, of each x_i.
        segments: the flows.
        time: T.
        p: values of the parameters.
    """

    r: Array
    J: Array
    phase: Array
    monodromy: Array
    bases: tuple[tuple[Indices, Array], ...]
    segments: tuple[Segment, ...]
    time: float
    p: Array

    def multipliers(self, *, driven: bool, symmetric: bool = False) -> NDArray[np.complex128]:
        """Return the Floquet multipliers of a period, the largest first.

        That of the direction of motion is left out unless the period is given.
        """
        found = np.linalg.eigvals(self.monodromy).astype(complex) ** (1 + symmetric)
        if not driven:
            found = np.delete(found, int(np.argmin(np.abs(found - 1))))
        return found[np.argsort(-np.abs(found))]


@final
@dataclass(frozen=True, eq=False)
class OrbitShooting:
    """Shooting equations of a model.

    Attributes:
        model: the model.
        u: inputs by name.
        names: free parameters with respect to which the flow is differentiated.
        scale: magnitudes of the states, shape (nx,).
        signs: S, shape (nx,).
        rtol: relative tolerance of the runs.
        driven: True if the period is given.
    """

    model: Model
    u: Mapping[str, Input]
    names: tuple[str, ...]
    scale: Array
    signs: Array
    rtol: float
    driven: bool

    @cached_property
    def eq(self) -> ModelEquations:
        """Equations of the model with constraints and slips."""
        return equations("periodic_orbit", self.model, timed=True)

    @cached_property
    def states(self) -> Indices:
        """Indices of the states that are neither modes nor cyclic."""
        return np.setdiff1d(self.returning, self.eq.modes)

    @cached_property
    def returning(self) -> Indices:
        """Indices of the states that are equal after a period: all but the cyclic ones."""
        return np.setdiff1d(np.arange(len(self.model.x)), self.eq.cyclic)

    @cached_property
    def angles(self) -> Indices:
        """Indices of the angles of which a whole turn changes nothing."""
        names = self.model.angles
        return np.flatnonzero([v.name in names for v in self.model.x])

    def without_turns(self, change: Array) -> Array:
        """Return changes of the states, shape (nx, ...), without whole turns of angles."""
        left = change.copy()
        left[self.angles] -= 2 * np.pi * np.round(left[self.angles] / (2 * np.pi))
        return left

    @cached_property
    def rate(self) -> ca.Function:
        """Function (t, x, z, u, p) -> rates of the states."""
        return self.model.function("ode")

    def basis(self, x: Array, p: Array) -> tuple[Indices, Array]:
        """Return indices of independent states near `x`, and the directions that they span."""
        eq, nx = self.eq, x.size
        stuck = eq.stuck(x)
        if not eq.constraints.numel() and not stuck:
            return self.states, np.eye(nx)[:, self.states]
        y, d = np.zeros(eq.y.numel()), np.concatenate([np.zeros(len(self.model.u)), p])
        y[:nx] = x
        of_C, of_slips = (slope.full()[:, :nx] for slope in eq.slopes(y, d)[1:3])
        C = np.vstack([of_C, of_slips[stuck], np.eye(nx)[eq.modes]])
        return independent(C, eq.scale[:nx], self.states)

    def flow(self, x: Array, t: float, T: float, p: Mapping[str, float]) -> Segment:
        """Return the flow from `x` at the time `t` over `T`.

        Raises:
            ValueError: the run fails, or the flow has no derivative.
        """
        states = [v.name for v in self.model.x]
        seeds = [f"x0.{states[i]}" for i in self.states]
        try:
            run = simulate(
                self.model, t + T, t_start=t, x0=dict(zip(states, x.tolist(), strict=True)),
                u=self.u, p=p, rtol=self.rtol, t_eval=(t, t + T), method=METHOD,
                sensitivities=[*seeds, *self.names],
            )  # fmt: skip
        except SolveError as error:
            raise ValueError(f"the run of a trial orbit fails: {error}") from error
        slopes = run.sensitivities
        ends = np.array([run[name] for name in states]).T
        by = np.zeros((x.size, x.size))
        for i, seed in zip(self.states, seeds, strict=True):
            by[:, i] = [slopes[seed][name][-1] for name in states]
        of_p = np.array([[slopes[q][name][-1] for q in self.names] for name in states])
        values = self.model.values("p", p)
        groups = [np.array([run[v.name] for v in g]) for g in (self.model.z, self.model.u)]
        rates = [
            self.rate(run.t[i], ends[i], *(g[:, i] if g.size else [] for g in groups), values)
            .full().ravel() for i in (0, 1)
        ]  # fmt: skip
        return Segment(
            run, ends[0], ends[1], np.array(rates), by, of_p.reshape(x.size, len(self.names))
        )

    def linear(self, X: Array, T: float, p: Mapping[str, float]) -> LinearisedShooting:
        """Return the shooting equations at the states X (m, nx) and the time T of all segments."""
        m, values = len(X), self.model.values("p", p)
        parts = tuple(self.flow(x, i * T / m, T / m, p) for i, x in enumerate(X))
        bases = tuple(self.basis(part.start, values) for part in parts)
        at = np.cumsum([0, *(chosen.size for chosen, _ in bases)])
        more = 0 if self.driven else 1
        r, J = np.zeros(at[-1]), np.zeros((at[-1], at[-1] + more + len(self.names)))
        monodromy = bases[0][1]
        for i, part in enumerate(parts):
            after, sign = (i + 1) % m, self.signs if i == m - 1 else np.ones(part.end.size)
            chosen, _ = bases[after]
            rows, columns = slice(at[after], at[after + 1]), slice(at[i], at[i + 1])
            end, S = sign * part.end, sign[:, None] * part.S
            r[rows] = self.without_turns(end - parts[after].start)[chosen]
            J[rows, columns] += (S @ bases[i][1])[chosen]
            J[rows, at[after] : at[after + 1]] -= np.eye(chosen.size)
            if more:
                J[rows, at[-1]] = (sign * part.rates[1])[chosen] / m
            J[rows, at[-1] + more :] = (sign[:, None] * part.of_p)[chosen]
            monodromy = S @ monodromy if i == m - 1 else bases[after][1] @ (S @ monodromy)[chosen]
        phase = np.zeros(J.shape[1] if more else 0)
        if more:
            chosen, T_0 = bases[0]
            phase[: chosen.size] = (parts[0].rates[0] / self.scale**2) @ T_0
        return LinearisedShooting(r, J, phase, monodromy[bases[0][0]], bases, parts, T, values)


ITERATIONS, HALVINGS = 30, 6
"""Largest numbers of Newton steps, and of halvings of one step."""
CLOSED = 100.0
"""Largest difference of start and end of an orbit, in multiples of rtol and of the ranges."""
LONGEST = 0.3
"""Largest change of the period in one step, relative to the period."""
DEPENDENT = 1e-12
"""Relative singular value below which corrections are not determined."""


def solved(
    problem: OrbitShooting, starts: Array, time: float, p: Mapping[str, float]
) -> LinearisedShooting:
    """Return the shooting equations at the orbit near `starts` (m, nx) and the time of a period.

    Raises:
        ValueError: no orbit was found.
    """
    where = f"periodic_orbit: expected an orbit of '{problem.model.name}' near the guess"
    at = tried(problem, starts, time, p)
    if isinstance(at, ValueError):
        raise ValueError(f"{where}, got none: {at}") from at
    before = np.inf
    for _ in range(ITERATIONS):
        now = residual(problem, at)
        if now <= problem.rtol or (now <= CLOSED * problem.rtol and now > before / 4):
            return at
        before, better = now, _improved(problem, at, p)
        if isinstance(better, ValueError):
            if now <= CLOSED * problem.rtol:
                return at
            raise ValueError(f"{where}, got none: {better}; give a run that has settled more")
        at = better
    raise ValueError(f"{where}, got none in {ITERATIONS} steps; give a run that has settled more")


def tried(
    problem: OrbitShooting, starts: Array, time: float, p: Mapping[str, float]
) -> LinearisedShooting | ValueError:
    """Return the linearised equations, or the error of a run."""
    try:
        return problem.linear(starts, time, p)
    except ValueError as error:
        return error


def residual(problem: OrbitShooting, at: LinearisedShooting) -> float:
    """Return the largest residual relative to the magnitudes of the states."""
    scales = np.concatenate([problem.scale[chosen] for chosen, _ in at.bases])
    return float(np.abs(at.r / scales).max(initial=0.0))


def moved(problem: OrbitShooting, at: LinearisedShooting, step: Array) -> tuple[Array, float]:
    """Return the states and the time after a step of the coordinates."""
    starts, k = list[Array](), 0
    for (chosen, directions), segment in zip(at.bases, at.segments, strict=True):
        starts.append(segment.start + directions @ step[k : k + chosen.size])
        k += chosen.size
    return np.array(starts), at.time + (0.0 if problem.driven else float(step[k]))


def _improved(
    problem: OrbitShooting, at: LinearisedShooting, p: Mapping[str, float]
) -> LinearisedShooting | ValueError:
    """Return the equations after a damped Newton step, or the reason why there is none."""
    step, now, share = _step(problem, at), residual(problem, at), 1.0
    if not problem.driven:
        share = min(1.0, LONGEST * at.time / max(abs(float(step[-1])), 1e-300))
    found: LinearisedShooting | ValueError = ValueError("the iteration does not converge")
    for _ in range(HALVINGS):
        found = tried(problem, *moved(problem, at, share * step), p)
        if not isinstance(found, ValueError):
            if residual(problem, found) < (1 - share / 4) * now:
                return found
            found = ValueError("the iteration does not converge")
        share /= 2
    return found


def _step(problem: OrbitShooting, at: LinearisedShooting) -> Array:
    """Return the Newton step of the coordinates and of the time."""
    rows = np.concatenate([problem.scale[chosen] for chosen, _ in at.bases])
    if problem.driven:
        scaled = at.J * rows / rows[:, None]
        return rows * np.linalg.lstsq(scaled, -at.r / rows, rcond=DEPENDENT)[0].astype(float)
    columns = np.append(rows, at.time)
    phase = at.phase * columns
    scaled = np.vstack([at.J * columns / rows[:, None], phase / np.abs(phase).max()])
    right = np.append(-at.r / rows, 0.0)
    return columns * np.linalg.lstsq(scaled, right, rcond=DEPENDENT)[0].astype(float)


REPEATED, SAMPLES = 1e-6, 100
"""Largest difference after a period, relative to the range of values, and number of samples."""


def check_period(
    model: Model, u: Mapping[str, Input], p: Mapping[str, float], period: float | None
) -> None:
    """Check a period [s] of inputs and equations at constant states; samples are not compared.

    Raises:
        ValueError: a missing period, or a time after which the values do not repeat.
    """
    where = "periodic_orbit: period"
    moving = [name for name, x in u.items() if checks.as_number(x) is None]
    if period is None and moving:
        raise checks.refused(
            where, f"the period [s] of the input {moving[0]}", None, "give period="
        )
    ode: Any = model.ode
    rates = ca.vertcat(ode, *(x(model.t) for x in u.values() if callable(x)))
    if not ca.depends_on(rates, model.t):
        return
    if period is None:
        raise checks.refused(where, "the period [s] of the equations", None, "give period=")
    f = ca.Function("rates", [model.t, *map(model.vector, "xzup")], [rates])
    values = model.values("p", p)
    fixed = model.started(None, values, 0.0), model.nominal("z"), model.values("u", None), values
    times = period * (np.arange(2 * SAMPLES) + 1 / np.pi) / SAMPLES
    rows = np.hstack([f(t, *fixed).full() for t in times])
    off = np.abs(rows[:, :SAMPLES] - rows[:, SAMPLES:]).max(axis=1)
    if (off > REPEATED * np.ptp(rows, axis=1) + 1e-12 * np.abs(rows).max(axis=1)).any():
        raise checks.refused(where, "a period [s] of the inputs and of the equations", period)
