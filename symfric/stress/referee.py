"""Motion of the machines with the laws of `referee_equations`, computed by SciPy.

Both files use only NumPy, SciPy and the standard library.

LSODA integrates smooth laws between the kinks of the force and of the machine. Exact Coulomb
friction is integrated from event to event: each contact slides forward, slides back or rests until
its sliding velocity passes through zero or its load exceeds mu_s N.
"""

import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from itertools import pairwise
from math import pi, sin, tanh
from typing import Any

import numpy as np
from numpy.typing import NDArray

from symfric.stress.referee_equations import DYNAMIC, LAWS, SCENES, Force, RefereeScene

Array = NDArray[np.float64]
EVALUATIONS = 150_000
"""Largest number of calls of the equations in a solve."""
PIECES = 200
"""Smallest number of steps of a solve; SciPy may miss events in longer steps."""
EVENTS = 10_000
CLOSE = 1e-14
UNKNOWN = {("exact_coulomb", "pendulum_box")}
"""Combinations in which two contacts at rest load each other; they have no equations here."""


class GaveUpError(ArithmeticError):
    """Error if SciPy does not reach the end."""


@dataclass(frozen=True)
class Signal:
    """Force over time.

    Attributes:
        kind: constant (c), hold and linear (values at t), sine (amplitude, rate [rad/s], offset)
            or pulse (height, start [s], width [s]).
        values: numbers in the parentheses of `kind`.
        t: sample times [s] of hold and linear.
    """

    kind: str
    values: tuple[float, ...]
    t: tuple[float, ...] = ()

    @property
    def kinks(self) -> tuple[float, ...]:
        """Times [s] at which the force jumps, has a kink, or changes fastest."""
        if self.kind == "pulse":
            return self.values[1], self.values[1] + self.values[2]
        return self.t

    def between(self, a: float, b: float) -> Force:
        """Return the force between the times a and b; there must be no kink between them."""
        if self.kind == "constant":
            return lambda t: self.values[0]
        if self.kind == "sine":
            size, rate, offset = self.values
            return lambda t: size * sin(rate * t) + offset
        if self.kind == "pulse":
            size, begin, width = self.values
            return lambda t: (
                size / 2 * (tanh(20 * (t - begin) / width) - tanh(20 * (t - begin - width) / width))
            )
        if self.kind == "linear":
            f, g = np.interp([a, b], self.t, self.values).tolist()
            return lambda t: f + (g - f) * (t - a) / (b - a)
        known = [v for time, v in zip(self.t, self.values, strict=True) if time < (a + b) / 2]
        held = known[-1] if known else self.values[0]
        return lambda t: held


NO_FORCE, SINE = Signal("constant", (0.0,)), Signal("sine", (2.0, pi, 0.0))


@dataclass(frozen=True)
class Question:
    """Data of a case for the referee.

    Attributes:
        law, scene, forms, p: names, options, and all numbers of law and scene.
        y: start values, states of the machine before those of the laws.
        scale: typical magnitudes of the states.
        times: times of the results, from start to end [s].
        signal: force of a drive.
    """

    law: str
    scene: str
    p: Mapping[str, float]
    y: Array
    scale: Array
    times: Array
    forms: Mapping[str, str] = field(default_factory=dict[str, str])
    signal: Signal = NO_FORCE


def knows(law: str, scene: str) -> bool:
    """Return True if the referee has equations for this law in this scene."""
    return law in LAWS and scene in SCENES and (law, scene) not in UNKNOWN


class SmoothPiece:
    """Equations between two kinks: rates of all states, with friction from the laws."""

    def __init__(self, asked: Question, a: float, b: float) -> None:
        force = asked.signal.between(a, b)
        self.asked, self.span = asked, (a, b)
        self.scene: RefereeScene = SCENES[asked.scene](asked.p, force, (a + b) / 2)
        self.rub = partial(LAWS[asked.law], asked.p, asked.forms)
        self.count = int(asked.law in DYNAMIC)
        self.by_modes = asked.law == "exact_coulomb"
        self.loads = [(0.0, 0.0)] * len(self.scene.slides)
        self.longest = (asked.times[-1] - asked.times[0]) / PIECES  # longest step [s]
        self.calls = 0

    def __call__(self, t: float, y: Sequence[float]) -> list[float]:
        """Return the rates of the states at t."""
        self.calls += 1
        if self.calls > EVALUATIONS:
            raise GaveUpError(f"no end after {EVALUATIONS} evaluations")
        n, k = self.scene.states, self.count
        y = [float(value) for value in y]
        rates: list[Sequence[float]] = [()] * len(self.scene.slides)

        def friction(i: int, v: float, N: float, F_e: float) -> float:
            z = y[n + k * i : n + k * (i + 1)]
            F, rates[i] = self.rub(v, N, z)
            self.loads[i] = N, F_e
            return F_e if self.by_modes and z[0] == 0.0 else F

        own = self.scene.motion(t, y[:n], friction)
        return [*own, *(rate for of_contact in rates for rate in of_contact)]

    def mode(self, i: int) -> int:
        """Return the index of the state that is the mode of contact `i`."""
        return self.scene.states + i

    def held(self, t: float, y: Array, i: int, mu_s: float) -> Array:
        """Return states with contact `i` at rest, or starting to slide if its load is too large."""
        velocity, rest = self.scene.slides[i]
        y[velocity], y[self.mode(i)] = rest, 0.0
        self(t, y.tolist())
        N, F_e = self.loads[i]
        y[self.mode(i)] = 0.0 if abs(F_e) <= mu_s * N else float(np.sign(F_e))
        return y

    def changed(self, t: float, y: Array, i: int, mu_s: float) -> Array:
        """Return the states after the end of the mode of contact `i`."""
        if y[self.mode(i)]:
            return self.held(t, y, i, mu_s)
        self(t, y.tolist())
        y[self.mode(i)] = np.sign(self.loads[i][1])
        return y


def solve(asked: Question, rtol: float = 1e-10) -> Array:
    """Return states at the requested times, shape (nx, times).

    Raises:
        ArithmeticError, ValueError: SciPy failed, or a number left the range of the equations.
    """
    begin, end = float(asked.times[0]), float(asked.times[-1])
    kinks = {*asked.signal.kinks, *SCENES[asked.scene](asked.p, abs, begin).breaks}
    cuts = [begin, *sorted(t for t in kinks if begin < t < end), end]
    y, found = np.array(asked.y, float), np.empty((asked.y.size, asked.times.size))
    for a, b in pairwise(cuts):
        motion = SmoothPiece(asked, a, b)
        here = (asked.times >= a) & (asked.times <= b)
        way = by_events if motion.by_modes else by_lsoda
        states, y = way(motion, y, asked.times[here], rtol)
        found[:, here] = states
    if not np.isfinite(found).all():
        raise GaveUpError("not finite")
    return found


def by_lsoda(motion: SmoothPiece, y: Array, times: Array, rtol: float) -> tuple[Array, Array]:
    """Return states at `times` and at the end, integrated by LSODA."""
    from scipy.integrate import odeint  # noqa: PLC0415  (slow to import)

    at = np.unique([*motion.span, *times])  # LSODA needs times that differ by more than rounding
    at = at[np.append(True, np.diff(at) > CLOSE * np.abs(at).max())]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the error message repeats the warning
        states, info = odeint(
            motion, y, at, rtol=rtol, atol=1e-3 * rtol * motion.asked.scale, tcrit=[motion.span[1]],
            tfirst=True, mxstep=10 * EVALUATIONS, hmax=motion.longest, full_output=True,
        )  # fmt: skip
    if info["message"] != "Integration successful.":
        raise GaveUpError(info["message"])
    nearest = np.abs(at[:, None] - times).argmin(0)
    return states[nearest].T, states[-1]


def by_events(motion: SmoothPiece, y: Array, times: Array, rtol: float) -> tuple[Array, Array]:
    """Return states at `times` and at the end, integrated from event to event."""
    from scipy.integrate import solve_ivp  # noqa: PLC0415  (slow to import)

    asked, (t, end) = motion.asked, motion.span
    contacts, mu_s = range(len(motion.scene.slides)), asked.p["mu_s"]
    found, y = np.empty((y.size, times.size)), y.copy()
    for i in contacts:
        if y[motion.mode(i)] == 0.0:
            y = motion.held(t, y, i, mu_s)
    for _ in range(EVENTS):
        ends = [
            ending(motion, i, y[motion.mode(i)], mu_s, t + 1e-9 * motion.longest) for i in contacts
        ]
        done: Any = solve_ivp(
            motion, (t, end), y, method="LSODA", rtol=rtol, atol=1e-3 * rtol * asked.scale,
            max_step=motion.longest, dense_output=True, events=ends,
        )  # fmt: skip
        if not done.success:
            raise GaveUpError(done.message)
        here = (times >= t) & (times <= done.t[-1])
        if here.any():
            found[:, here] = done.sol(times[here])
        t, y = float(done.t[-1]), done.y[:, -1].copy()
        if done.status == 0:
            return found, y
        for i in contacts:
            if done.t_events[i].size:
                y = motion.changed(t, y, i, mu_s)
    raise GaveUpError(f"no end after {EVENTS} events")


def ending(
    motion: SmoothPiece, i: int, mode: float, mu_s: float, begun: float
) -> Callable[[float, Array], float]:
    """Return a function of time and states that passes through zero when a mode ends."""
    velocity, rest = motion.scene.slides[i]

    def sliding(t: float, y: Array) -> float:
        return mode * (y[velocity] - rest) if t > begun else 1.0

    def resting(t: float, y: Array) -> float:
        motion(t, y.tolist())
        N, F_e = motion.loads[i]
        return abs(F_e) - mu_s * N

    event: Any = sliding if mode else resting
    event.terminal, event.direction = True, -1.0 if mode else 1.0
    return event
