"""Optimal control problems with dry friction, in formulas for any arithmetic.

    min  final(x(T)) + integral of running(x, u) dt     x' = rate(x, u, F)
    F_i = sliding_i N_i sgn(v_i) if v_i != 0,   |F_i| <= static_i N_i if v_i = 0

with one input u and the friction force F_i of each contact. The formulas use functions of the
module `m` only (`math`, `casadi` or `sympy`), so that the referee and all contenders read the same
text.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from math import inf, pi
from typing import Any, final

import casadi as ca

from ocp import Chain, Phase, Problem, at_end, integral
from ocp.problems import GRAVITY, READY
from symfric import BrownMcPhee, Contact, Model, Variable

Box = tuple[float, float]
Rate = Callable[[Any, Sequence[Any], Any, Sequence[Any]], list[Any]]
Value = Callable[[Any, Sequence[Any], Any], Any]


@final
@dataclass(frozen=True, eq=False)
class MoveCase:
    """Problem of one input with dry friction.

    Attributes:
        name: name; symfric solves the problem of this name in `ocp.problems` if there is one.
        source: publication or example with the statement, and what was changed.
        states: names of the states.
        rate: (m, x, u, F) -> x', affine in F.
        slips: index of the sliding velocity of each contact.
        levels: (static, sliding) friction force of each contact at the normal force 1.
        start: states at t = 0.
        ends: fraction of T -> index of a state -> its value.
        limit: largest |u|.
        T: duration [s].
        intervals: number of equal intervals of the control, an even number.
        speed: typical sliding speed, the unit of the widths of smooth laws.
        running, final: cost (m, x, u) per time and at the end.
        normal: (m, x, u) -> normal force of each contact.
        bounds: index of a state -> its bounds.
        size: index of a state -> its magnitude, 1 by default.
    """

    name: str
    source: str
    states: tuple[str, ...]
    rate: Rate
    slips: tuple[int, ...]
    levels: tuple[Box, ...]
    start: tuple[float, ...]
    ends: Mapping[float, Mapping[int, float]]
    limit: float
    T: float
    intervals: int = 50
    speed: float = 1.0
    running: Value = lambda m, x, u: u**2
    final: Value = lambda m, x, u: 0.0
    normal: Callable[[Any, Sequence[Any], Any], list[Any]] = lambda m, x, u: [1.0, 1.0, 1.0]
    bounds: Mapping[int, Box] = field(default_factory=dict[int, Box])
    size: Mapping[int, float] = field(default_factory=dict[int, float])

    def smooth(self, m: Any, x: Sequence[Any], u: Any, width: float) -> list[Any]:
        """Return x' with the smooth friction of Brown and McPhee of a width in units of `speed`.

        F = N (sliding tanh(4 s) + (static - sliding) s / (s^2 / 4 + 3 / 4)^2),   s = v / width
        """
        loads, forces = self.normal(m, x, u), list[Any]()
        for i, (static, sliding), N in zip(self.slips, self.levels, loads, strict=False):
            s = x[i] / (width * self.speed)
            peak = (static - sliding) * s / (s**2 / 4 + 0.75) ** 2 if static > sliding else 0.0
            forces.append(N * (sliding * m.tanh(4 * s) + peak))
        return self.rate(m, x, u, forces)

    def guess(self, fraction: float) -> list[float]:
        """Return the states at a fraction of T on lines between the prescribed values."""
        values = list(self.start)
        for i in range(len(values)):
            at, known = [0.0], [values[i]]
            for s, ends in sorted(self.ends.items()):
                if i in ends:
                    at.append(s)
                    known.append(ends[i])
            for (a, b), (p, q) in zip(pairwise(at), pairwise(known), strict=True):
                if a <= fraction <= b:
                    values[i] = p + (q - p) * (fraction - a) / (b - a)
        return values

    def problem(self, width: float = 1e-6) -> Problem:
        """Return the problem for symfric; `width` is that of its smooth law, as in `smooth`."""
        ready = READY.get(self.name)
        return ready.make(v_t=width * self.speed) if ready else _stated(self, width)


def _stated(case: MoveCase, width: float) -> Problem:
    x = tuple(
        Variable(name, "1", start=at, nominal=case.size.get(i, 1.0))
        for i, (name, at) in enumerate(zip(case.states, case.start, strict=True))
    )
    u = Variable("u", "1", nominal=case.limit)
    symbols = [v.symbol for v in x]
    contacts = tuple(
        Contact(
            f"contact_{k}", symbols[i], N,
            BrownMcPhee(mu_s=static, mu_d=sliding, v_t=width * case.speed),
        )
        for k, (i, (static, sliding), N) in enumerate(
            zip(case.slips, case.levels, case.normal(ca, symbols, u.symbol), strict=False)
        )
    )  # fmt: skip
    rate = case.rate(ca, symbols, u.symbol, [c.force for c in contacts])
    model = Model(case.name, x=x, u=(u,), ode=ca.vertcat(*rate), contacts=contacts)
    marks = [0.0, *sorted(case.ends)]
    start = dict(zip(case.states, case.start, strict=True))
    phases = Chain(
        tuple(
            Phase(
                model, T=(b - a) * case.T, start=start if a == 0.0 else {},
                end={case.states[i]: value for i, value in case.ends[b].items()},
            )
            for a, b in pairwise(marks)
        )
    )  # fmt: skip
    cost = integral(lambda s: case.running(ca, [s[n] for n in case.states], s.u))
    cost += at_end(lambda s: case.final(ca, [s[n] for n in case.states], s.u))
    bounds = {case.states[i]: box for i, box in case.bounds.items()}
    return Problem(phases, cost, bounds={"u": (-case.limit, case.limit), **bounds})


# ---- predefined problems, derived again by hand ----


def _rest(*values: float) -> dict[int, float]:
    return dict(enumerate(values))


def _cart(cart: float, bob: float, length: float, damping: float = 0.0) -> Rate:
    """Return the rates of a cart with a pendulum: x, theta from the vertical below, x', theta'."""

    def rate(m: Any, x: Sequence[Any], u: Any, F: Sequence[Any]) -> list[Any]:
        s, c = m.sin(x[1]), m.cos(x[1])
        push = u - F[0] - damping * x[2] + bob * length * x[3] ** 2 * s
        along = (push + bob * GRAVITY * s * c) / (cart + bob * s**2)
        return [x[2], x[3], along, -(along * c + GRAVITY * s) / length]

    return rate


def _spring(guided: bool) -> Rate:
    """Return the rates of motor and load: x, X, x', X'; a guided motor also has friction."""

    def rate(m: Any, x: Sequence[Any], u: Any, F: Sequence[Any]) -> list[Any]:
        spring = 200.0 * (x[0] - x[1]) + 2.0 * (x[2] - x[3])
        dry = F[0] + 0.5 * x[2] if guided else 0.0
        return [x[2], x[3], (u - spring - dry) / 0.5, spring - F[-1] - 0.5 * x[3]]

    return rate


def _tray_load(m: Any, x: Sequence[Any], u: Any) -> list[Any]:
    return [(2.0 * x[0] * u + 2.0 * x[1] * x[3] + GRAVITY * m.cos(x[2])) / (1.0 + 2.0 * x[0] ** 2)]


def _tray(m: Any, x: Sequence[Any], u: Any, F: Sequence[Any]) -> list[Any]:
    N = _tray_load(m, x, u)[0]
    return [x[1], x[0] * x[3] ** 2 - GRAVITY * m.sin(x[2]) - F[0], x[3], 2.0 * (u - x[0] * N)]


GUIDE = (6.0, 4.0)
BACK = {0.5: {1: 0.3}, 1.0: _rest(0.0, 0.0, 0.0, 0.0)}
OURS = "ready problem of symfric"

# ---- problems of other authors ----


def _coil(m: Any, x: Sequence[Any], u: Any, F: Sequence[Any]) -> list[Any]:
    spring = 2.4e3 * (x[0] - x[2])
    current = (u - 12.0 * x[1] - 2.0 * x[4]) / 2e-3
    return [x[1], (12.0 * x[4] - spring - F[0]) / 1.03, x[3], spring / 0.56, current]


def _blocks(m: Any, x: Sequence[Any], u: Any, F: Sequence[Any]) -> list[Any]:
    (a, b, c), (p, q, r) = x[:3], x[3:]
    return [p, q, r, b - 2.0 * a - p - F[0], a - 2.0 * b + c - q - F[1], b - c - r + u - F[2]]


CASES = (
    MoveCase(
        "out_and_back", OURS, ("x", "v"), lambda m, x, u, F: [x[1], u - F[0] - 0.5 * x[1]], (1,),
        (GUIDE,), (0.0, 0.0), {0.5: {0: 1.0}, 1.0: _rest(0.0, 0.0)}, limit=20.0, T=2.0,
    ),
    MoveCase(
        "pendulum", OURS, ("phi", "phi_rate"),
        lambda m, x, u, F: [x[1], u - F[0] - GRAVITY * m.sin(x[0])], (1,), ((0.15, 0.1),),
        (0.0, 0.0), {1.0: _rest(pi, 0.0)}, limit=3.0, T=5.0, intervals=100, size={0: 3.0, 1: 5.0},
    ),
    MoveCase(
        "cart_pendulum", OURS, ("x", "theta", "x_rate", "theta_rate"),
        _cart(1.0, 0.3, 0.5, damping=0.1), (2,), ((2.2, 1.5),), (0.0,) * 4,
        {1.0: _rest(0.8, pi, 0.0, 0.0)}, limit=20.0, T=2.0,
        bounds={0: (-2.0, 2.0)}, size={1: 3.0, 3: 5.0},
    ),
    MoveCase(
        "cart_pole", "example of nosnoc", ("x", "theta", "v", "w"), _cart(1.0, 0.1, 1.0), (2,),
        ((2.0, 2.0),), (1.0, 0.0, 0.0, 0.0), {1.0: {}}, limit=30.0, T=5.0,
        running=lambda m, x, u: (
            10.0 * x[0] ** 2 + 100.0 * (x[1] - pi) ** 2 + x[2] ** 2 + x[3] ** 2 + u**2
        ),
        final=lambda m, x, u: (
            500.0 * x[0] ** 2 + 100.0 * (x[1] - pi) ** 2 + 10.0 * (x[2] ** 2 + x[3] ** 2)
        ),
        bounds={0: (-5.0, 5.0)}, size={1: 3.0, 3: 5.0},
    ),
    MoveCase(
        "voice_coil", "example of nosnoc after Christiansen, Maurer and Zirn, CDC 2008",
        ("x1", "v1", "x2", "v2", "I"), _coil, (1,), ((2.1, 2.1),), (0.0,) * 5,
        {1.0: _rest(0.01, 0.0, 0.01, 0.0, 0.0)}, limit=5.0, T=0.08, speed=0.2,
        size={0: 0.01, 1: 0.2, 2: 0.01, 3: 0.2},
    ),
    MoveCase(
        "floating_oscillator", "Kim, Kased and Singh, Optim. Control Appl. Meth. 29, 2008, 257, "
        "with given time and least squared force", ("x1", "x2", "v1", "v2"),
        lambda m, x, u, F: [x[2], x[3], u - F[0] - (x[0] - x[1]), x[0] - x[1]], (2,),
        ((0.5, 0.5),), (0.0,) * 4, {1.0: _rest(1.0, 1.0, 0.0, 0.0)}, limit=2.0, T=6.0,
    ),
    MoveCase(
        "pushed_block", "example of opty (10 m out and back, friction with slack variables), with "
        "given time and least squared force", ("x", "v"), lambda m, x, u, F: [x[1], u - F[0]], (1,),
        ((5.886, 5.886),), (0.0, 0.0), {0.5: _rest(10.0, 0.0), 1.0: _rest(0.0, 0.0)}, limit=400.0,
        T=4.0, speed=10.0, size={0: 10.0, 1: 10.0},
    ),
    MoveCase(
        "capsule", "two-mass robot after Chernousko, J. Appl. Math. Mech. 66, 2002: 50 mm on rough "
        "ground by an inner mass of +- 0.1 m", ("x", "v", "s", "r"),
        lambda m, x, u, F: [x[1], -u - F[0], x[3], (1.0 / 0.5 + 1.0) * u + F[0]], (1,),
        ((2.0, 1.5),), (0.0,) * 4, {1.0: _rest(0.05, 0.0, 0.0, 0.0)}, limit=10.0, T=2.0, speed=0.1,
        bounds={2: (-0.1, 0.1)}, size={0: 0.05, 1: 0.1, 2: 0.1},
    ),
    MoveCase(
        "parcel_on_tray", OURS, ("x", "v", "tilt", "tilt_rate"), _tray, (1,), ((0.4, 0.3),),
        (0.3, 0.0, 0.0, 0.0), {1.0: _rest(0.0, 0.0, 0.0, 0.0)}, limit=15.0, T=1.5,
        normal=_tray_load, bounds={2: (-1.2, 1.2)},
    ),
    MoveCase(
        "load_through_spring", OURS, ("x_motor", "x", "v_motor", "v"), _spring(guided=False), (3,),
        (GUIDE,), (0.0,) * 4, BACK, limit=40.0, T=2.0,
    ),
    MoveCase(
        "two_blocks", OURS, ("x_motor", "x", "v_motor", "v"), _spring(guided=True), (2, 3),
        ((3.0, 2.0), GUIDE), (0.0,) * 4, BACK, limit=40.0, T=2.0,
    ),
    MoveCase(
        "three_blocks", "Stewart, J. Austral. Math. Soc. B 37, 1996, 288-308: the third block, now "
        "pushed by the input, stops at 1", ("q1", "q2", "q3", "v1", "v2", "v3"), _blocks, (3, 4, 5),
        ((0.3, 0.3),) * 3, (-1.0, 1.0, -1.0, -1.0, 1.0, 1.0),
        {1.0: {2: 1.0, 3: 0.0, 4: 0.0, 5: 0.0}}, limit=10.0, T=5.0,
    ),
)  # fmt: skip
QUICK = ("out_and_back", "pendulum", "cart_pole", "floating_oscillator", "pushed_block")
UNBOUNDED: Box = (-inf, inf)
