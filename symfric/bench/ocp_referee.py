"""Referee of controls: exact Coulomb friction with stiction, by events, in NumPy and SciPy.

Each contact sticks (0) or slips forwards (1) or backwards (-1). The forces of sticking contacts
follow from v' = 0. A mode ends when a sticking force exceeds its static level, when a sliding
velocity becomes zero, or when the control jumps. At rest the first combination of modes is taken
in which no sticking force exceeds its level and all accelerations have the sign of their slip; the
combinations with most sticking contacts come first.
"""

import math
from collections.abc import Callable, Sequence
from itertools import pairwise, product
from typing import Any, NamedTuple

import numpy as np
from scipy.integrate import solve_ivp

from symfric.bench.ocp_cases import UNBOUNDED, MoveCase
from symfric.foundation.numeric import Array

RTOL = 1e-9
MARGIN = 1e-9
"""Relative excess over the static level at which sticking ends."""
REST = 1e-13
"""Speed [m/s] of the wrong sign at which a slip ends; it is positive where a slip begins."""
MOST = 5000
"""Largest number of events."""


class ControlVerdict(NamedTuple):
    """Cost of a control under exact friction, and its largest relative miss.

    The miss of a state is relative to its largest prescribed or reached magnitude. It includes
    violations of bounds at the ends of the intervals of the control.
    """

    cost: float
    miss: float


def judged(case: MoveCase, edges: Array, controls: Array, rtol: float = RTOL) -> ControlVerdict:
    """Return the verdict on a control that is constant between `edges`.

    It is NaN if the integration fails, a body lifts off, or events accumulate.

    Args:
        case: the problem.
        edges: limits of the intervals [s], from 0 to T, shape (N + 1,).
        controls: values of the input, shape (N,); they are clipped to the limits of the case.
        rtol: relative tolerance of the integration.
    """
    state, modes, events = np.array([*case.start, 0.0]), (), 0
    targets = [[ends.get(i, 0.0) for i in range(len(case.start))] for ends in case.ends.values()]
    largest = np.abs([case.start, *targets]).max(axis=0)
    off: dict[int, float] = {}
    marks = np.unique(np.concatenate([edges, [s * case.T for s in case.ends]]).round(12))
    for t, end in pairwise(marks):
        k = min(max(int(np.searchsorted(edges, 0.5 * (t + end))) - 1, 0), len(controls) - 1)
        u = float(np.clip(controls[k], -case.limit, case.limit))
        modes, leaving = _modes(case, state, u, modes), frozenset[int]()
        while end - t > 1e-13 * case.T:
            run = _run(case, state, u, modes, (t, end), rtol)
            state, t = run.y[:, -1].copy(), float(run.t[-1])
            largest = np.maximum(largest, np.abs(run.y[:-1]).max(axis=1))
            if run.status == 1:
                hit = frozenset(i for i, at in enumerate(run.t_events) if at.size)
                leaving = frozenset(i for i in hit if modes[i] == 0)
                state[[case.slips[i] for i in hit]] = 0.0
                modes = _modes(case, state, u, modes, leaving)
                events += 1
            lifted = min(_loads(case, state.tolist()[:-1], u)) < 0.0
            if events > MOST or run.status < 0 or lifted:
                return ControlVerdict(math.nan, math.nan)
        for s, ends in case.ends.items():
            if abs(t - s * case.T) < 1e-9 * case.T:
                for i, value in ends.items():
                    off[i] = max(off.get(i, 0.0), abs(state[i] - value))
        for i in range(len(case.start)):
            low, high = case.bounds.get(i, UNBOUNDED)
            off[i] = max(off.get(i, 0.0), low - state[i], state[i] - high)
    miss = max((off[i] / largest[i] for i in off if off[i] > 0), default=0.0)
    return ControlVerdict(
        float(state[-1] + case.final(math, state[:-1].tolist(), 0.0)), float(miss)
    )


def _loads(case: MoveCase, x: Sequence[float], u: float) -> list[float]:
    return case.normal(math, x, u)[: len(case.slips)]


def _forces(case: MoveCase, x: Sequence[float], u: float, modes: Sequence[int]) -> list[float]:
    """Return the friction forces; sticking ones solve v' = 0, in which F is affine."""
    loads = _loads(case, x, u)
    F = [mode * level[1] * N for mode, level, N in zip(modes, case.levels, loads, strict=True)]
    stuck = [i for i, mode in enumerate(modes) if mode == 0]
    if stuck:
        base = case.rate(math, x, u, F)
        rows = [case.slips[i] for i in stuck]
        units = ([*F[:i], F[i] + 1.0, *F[i + 1 :]] for i in stuck)
        by_force = [case.rate(math, x, u, unit) for unit in units]
        A = [[column[r] - base[r] for column in by_force] for r in rows]
        held = _solved(A, [-base[r] for r in rows])
        for i, force in zip(stuck, held, strict=True):
            F[i] = force
    return F


def _solved(A: list[list[float]], b: list[float]) -> list[float]:
    return [b[0] / A[0][0]] if len(b) == 1 else np.linalg.solve(A, b).tolist()


def _run(
    case: MoveCase,
    start: Array,
    u: float,
    modes: tuple[int, ...],
    span: tuple[float, float],
    rtol: float,
) -> Any:
    """Integrate the states and the cost with constant modes up to the first event.

    A sliding velocity may become zero and recover within one step. Then it is negative at its
    minimum, and the integration to this minimum ends at the zero.
    """

    def rate(t: float, y: Array) -> list[float]:
        x = y.tolist()[:-1]
        slope = case.rate(math, x, u, _forces(case, x, u, modes))
        for i, mode in zip(case.slips, modes, strict=True):
            slope[i] = slope[i] if mode else 0.0
        return [*slope, case.running(math, x, u)]

    def event(i: int) -> Callable[[float, Array], float]:
        def distance(t: float, y: Array) -> float:
            if modes[i]:
                return modes[i] * y[case.slips[i]] + REST
            x = y.tolist()[:-1]
            level = case.levels[i][0] * _loads(case, x, u)[i] * (1 + MARGIN)
            return level - abs(_forces(case, x, u, modes)[i])

        distance.terminal, distance.direction = True, -1  # pyright: ignore[reportFunctionMemberAccess]
        return distance

    def minimum(i: int) -> Callable[[float, Array], float]:
        def change(t: float, y: Array) -> float:
            return modes[i] * rate(t, y)[case.slips[i]]

        change.direction = 1  # pyright: ignore[reportFunctionMemberAccess]
        return change

    n = len(modes)
    run = solve_ivp(
        rate, span, start, "DOP853", rtol=rtol, atol=1e-3 * rtol, max_step=case.T / 200,
        events=[*map(event, range(n)), *map(minimum, range(n))],
    )  # fmt: skip
    missed = [
        float(t)
        for i, mode in enumerate(modes)
        for t, y in zip(run.t_events[n + i], run.y_events[n + i], strict=True)
        if mode * y[case.slips[i]] < -REST
    ]
    run.t_events = run.t_events[:n]
    return _run(case, start, u, modes, (span[0], min(missed)), rtol) if missed else run


def _modes(
    case: MoveCase,
    state: Array,
    u: float,
    before: Sequence[int],
    leaving: frozenset[int] = frozenset(),
) -> tuple[int, ...]:
    """Return the modes at a state; contacts of `leaving` exceed their static level and slip."""
    x = state.tolist()[:-1]
    speeds = [x[i] for i in case.slips]
    choices = [
        ((v > 0) - (v < 0),) if v else (1, -1) if i in leaving else (0, 1, -1)
        for i, v in enumerate(speeds)
    ]
    loads = _loads(case, x, u)
    for modes in sorted(product(*choices), key=lambda modes: sum(map(abs, modes))):
        forces = _forces(case, x, u, modes)
        slope = case.rate(math, x, u, forces)
        if all(
            v or (mode * slope[i] > 0 if mode else abs(F) <= level[0] * N * (1 + MARGIN))
            for v, mode, i, F, level, N in zip(
                speeds, modes, case.slips, forces, case.levels, loads, strict=True
            )
        ):
            return modes
    return tuple(before) or (0,) * len(case.slips)
