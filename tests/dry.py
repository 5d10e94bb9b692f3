"""Dry friction by its modes, in plain NumPy and SciPy: every mode is tried, the valid one kept.

Nothing here imports symfric. A contact that slides keeps its direction until its velocity passes
through zero, one that rests until its force passes mu_s N. There all modes of the contacts at rest
are tried: rest is valid up to mu_s N, sliding where the sliding velocity grows in its direction.
Of several valid ones the one with most rest is taken, but what just broke away does slide.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import product
from math import cos, sin

import numpy as np
from mechanics import newton, size
from scipy.integrate import OdeSolution, solve_ivp
from scipy.linalg import expm
from scipy.optimize import brentq

from symfric.foundation.numeric import Array

Modes = tuple[int, ...]
Solve = Callable[[Array, Modes], tuple[Array, Array, Array]]
"""State and modes -> accelerations, friction forces and normal forces of all contacts."""


@dataclass
class DryMotion:
    """Times, modes and pieces of a motion; y = (positions, velocities)."""

    solve: Solve
    mu_s: float
    happened: list[tuple[float, Modes]] = field(default_factory=list)
    pieces: list[OdeSolution] = field(default_factory=list)

    def run(self, y: Array, t_end: float) -> "DryMotion":
        """Integrate from y at t = 0, each stretch between two changes of mode on its own."""
        k, t = y.size // 2, 0.0
        modes, broke = self.valid(y, np.sign(y[k:]).astype(int).tolist()), []
        while t < t_end:
            self.happened.append((t, modes))
            found = solve_ivp(
                self._rates(modes),
                (t, t_end), y, "DOP853", events=[self._watch(i, modes) for i in range(k)],
                dense_output=True, rtol=1e-12, atol=1e-14, max_step=0.02,
            )  # fmt: skip
            self.pieces.append(found.sol)
            t, y = float(found.t[-1]), found.y[:, -1].copy()
            if found.status != 1:
                return self
            ends = [i for i in range(k) if len(found.t_events[i])]
            broke = [i for i in ends if modes[i] == 0]
            fixed = [0 if i in ends else m for i, m in enumerate(modes)]
            y[k:] *= np.abs(fixed)
            modes = self.valid(y, fixed, broke)
        return self

    def _rates(self, modes: Modes) -> Callable[[float, Array], Array]:
        moving = np.abs(modes)
        return lambda t, y: np.concatenate([y[y.size // 2 :], moving * self.solve(y, modes)[0]])

    def valid(self, y: Array, fixed: Sequence[int], broke: Sequence[int] = ()) -> Modes:
        """The modes that satisfy all conditions where those of moving contacts are `fixed`."""
        found: list[Modes] = []
        for modes in product(*((m,) if m else (0, 1, -1) for m in fixed)):
            a, F, N = self.solve(y, modes)
            held = np.abs(F) <= self.mu_s * N + 1e-9
            pairs = zip(fixed, modes, held, a * modes > 0, strict=True)
            if all(f or (h if m == 0 else ahead) for f, m, h, ahead in pairs):
                found.append(modes)
        moving = [m for m in found if all(m[i] for i in broke)] or found
        return max(moving, key=lambda m: m.count(0))

    def _watch(self, i: int, modes: Modes) -> Callable[[float, Array], float]:
        def stops(t: float, y: Array) -> float:
            return modes[i] * float(y[y.size // 2 + i])

        def breaks(t: float, y: Array) -> float:
            _, F, N = self.solve(y, modes)
            return self.mu_s * N[i] - abs(F[i])

        watch = stops if modes[i] else breaks
        watch.direction, watch.terminal = -1, True  # type: ignore[attr-defined]
        return watch

    def at(self, times: Array) -> Array:
        """States there, a column each."""
        starts = np.array([t for t, _ in self.happened])
        pieces = np.searchsorted(starts, times, side="right") - 1
        return np.column_stack([self.pieces[i](t) for i, t in zip(pieces, times, strict=True)])


def pendulum_box(mu_d: float) -> Solve:
    """Box and point mass of the scene; y = (x, phi, x', phi'), both contacts slide at mu_d."""
    m_box, m, L, R, g = 6.0, 20.0, 0.3, 0.01, 9.81
    last = {}

    def solve(y: Array, modes: Modes) -> tuple[Array, Array, Array]:
        _, phi, _, w = y

        def residual(u: Array) -> Array:
            ax, alpha, F_x, F_phi, ground, hinge = u
            hx = m * (ax + L * (alpha * cos(phi) - w * w * sin(phi)))
            hz = m * (L * (alpha * sin(phi) + w * w * cos(phi)) + g)
            return np.array(
                [
                    m_box * ax + hx + F_x,
                    hx * L * cos(phi) + hz * L * sin(phi) + R * F_phi,
                    F_x - modes[0] * mu_d * ground if modes[0] else ax,
                    F_phi - modes[1] * mu_d * hinge if modes[1] else alpha,
                    ground - size(m_box * g + hz),
                    hinge - size(hx, hz),
                ]
            )

        u = newton(residual, last.get(modes, np.array([0.0, 0.0, 0.0, 0.0, 255.0, 196.0])))
        last[modes] = u
        return u[:2], u[2:4], u[4:]

    return solve


def blocks_on_belt(
    K: Array, mu_s: Sequence[float], mu_d: Sequence[float], v_belt: float, t_end: float
) -> tuple[list[tuple[float, int, str]], Array]:
    """Blocks of 1 kg on a belt (g = 1), held by springs of the stiffness matrix K, from rest at 0.

    Between two changes of mode x'' = -K x - F is linear with constant F for what slides and x' =
    v_belt for what rests: a matrix exponential, and a root in time.

    Returns:
        (time, block, "stick" or "slip") of what happens, and x, x' at the end.
    """
    n, t, found = len(mu_s), 0.0, list[tuple[float, int, str]]()
    y = np.zeros(2 * n)
    modes = [-1 if v_belt > 0 else 1] * n
    while True:
        free = np.array([m != 0 for m in modes])
        push = np.array([-m * mu for m, mu in zip(modes, mu_d, strict=True)]) * free
        A = np.zeros((2 * n + 1, 2 * n + 1))
        A[:n, n : 2 * n] = np.eye(n)
        A[n : 2 * n, :n] = -K * free[:, None]
        A[n : 2 * n, -1] = push
        begin = np.append(y, 1.0)

        def at(s: float, A: Array = A, begin: Array = begin) -> Array:
            return (expm(A * s) @ begin)[: 2 * n]

        def margin(s: float, i: int, modes: Sequence[int] = tuple(modes)) -> float:
            state = at(s)
            if modes[i]:
                return modes[i] * (state[n + i] - v_belt)
            return mu_s[i] - abs(float(K[i] @ state[:n]))

        s, step = 1e-9, 0.01
        while t + s < t_end:
            ends = [i for i in range(n) if margin(s + step, i) < 0.0]
            if ends:
                s, i = min((brentq(margin, s, s + step, (i,), xtol=1e-14), i) for i in ends)
                break
            s += step
        else:
            return found, at(t_end - t)
        t, y = t + s, at(s)
        if modes[i]:
            y[n + i] = v_belt
            rests = abs(float(K[i] @ y[:n])) <= mu_s[i]
            modes[i] = 0 if rests else -modes[i]
            found.append((t, i, "stick"))
        else:
            modes[i] = -int(np.sign(K[i] @ y[:n]))
            found.append((t, i, "slip"))
