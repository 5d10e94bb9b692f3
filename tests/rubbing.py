"""Random machines with one to four contacts, there and back again, and their motion by SciPy.

Every machine is M(q) q'' = B u - h(q, q') - J' F, with friction F_i of the sliding velocities J q'.
Its equations stand here twice: in CasADi or as a `Mechanism` for the optimiser, and in NumPy with
modes by hand for the referee, which shares no code with it.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise, product
from typing import Any

import casadi as ca
import numpy as np
from scipy.integrate import solve_ivp

from ocp import Phase, Problem, Solution, integral
from symfric import BrownMcPhee, Contact, Model, Variable
from symfric.foundation.numeric import Array
from symfric.multibody import JointFriction, JointSpringDamper, Mechanism, Revolute

WIDTH = 1e-5
"""Smoothing velocity of the laws [m/s]."""


@dataclass(frozen=True)
class Machine:
    """Equations of motion in NumPy and CasADi alike, and the requested move.

    Attributes:
        mass, bias: (sin, cos, q, q') -> rows of M, and h.
        driven: coordinates with a force.
        along: rows of J.
        levels: of each contact, (static, sliding) [N].
        goal: coordinate -> where it is to be at half time.
        built: a mechanism instead of the equations above, with names of coordinates, if any.
    """

    name: str
    size: int
    mass: Callable[..., list[list[Any]]]
    bias: Callable[..., list[Any]]
    driven: tuple[int, ...]
    along: tuple[tuple[float, ...], ...]
    levels: tuple[tuple[float, float], ...]
    goal: dict[int, float]
    free: tuple[int, ...] = ()
    limit: float = 60.0
    built: Callable[["Machine"], Model] | None = None
    names: tuple[str, ...] = ()

    def law(self, contact: int) -> BrownMcPhee:
        """The law of a contact, whose load is 1."""
        static, sliding = self.levels[contact]
        return BrownMcPhee(mu_s=static, mu_d=sliding, v_t=WIDTH)

    def model(self) -> Model:
        """For the optimiser."""
        if self.built is not None:
            return self.built(self)
        n = range(self.size)
        q = [Variable(f"q{i}", "m", nominal=0.1) for i in n]
        v = [Variable(f"v{i}", "m/s", nominal=0.5) for i in n]
        u = [Variable(f"u{i}", "N", nominal=10.0) for i in self.driven]
        Q, V = [one.symbol for one in q], [one.symbol for one in v]
        slips = [sum(a * s for a, s in zip(row, V, strict=True)) for row in self.along]
        rubs = [Contact(f"c{k}", s, 1.0, self.law(k)) for k, s in enumerate(slips)]
        right = [-one for one in self.bias(ca.sin, ca.cos, Q, V)]
        for i, force in zip(self.driven, u, strict=True):
            right[i] += force.symbol
        for row, contact in zip(self.along, rubs, strict=True):
            right = [r - a * contact.force for r, a in zip(right, row, strict=True)]
        M = ca.vertcat(*(ca.horzcat(*row) for row in self.mass(ca.sin, ca.cos, Q, V)))
        ode = ca.vertcat(*V, ca.solve(M, ca.vertcat(*right)))
        return Model(self.name, x=(*q, *v), u=tuple(u), ode=ode, contacts=tuple(rubs))

    @property
    def states(self) -> list[str]:
        """Names of coordinates and rates in the model."""
        if self.names:
            return [*self.names, *(f"{name}_rate" for name in self.names)]
        return [f"{letter}{i}" for letter in "qv" for i in range(self.size)]

    def problem(self) -> Problem:
        """There in 1 s and back to rest in another one, with least effort."""
        model, states = self.model(), self.states
        start = dict.fromkeys(states, 0.0)
        end = {s: 0.0 for i, s in enumerate(states) if i % self.size not in self.free}
        there = Phase(model, 1.0, start=start, end={states[i]: x for i, x in self.goal.items()})
        inputs = [v.name for v in model.u]
        cost = integral(lambda s: sum(s[name] ** 2 for name in inputs))
        limits = dict.fromkeys(inputs, (-self.limit, self.limit))
        return Problem(there >> Phase(model, 1.0, end=end), cost, bounds=limits)

    def rate(self, x: Array, u: Array, modes: Sequence[int]) -> tuple[Array, Array]:
        """Accelerations and forces of the contacts; 0 rests."""
        n, J = self.size, np.array(self.along)
        q, v = x[:n], x[n:]
        M = np.array(self.mass(np.sin, np.cos, q, v), dtype=float)
        right = -np.array(self.bias(np.sin, np.cos, q, v), dtype=float)
        right[list(self.driven)] += u
        F = np.array([m * d for m, (_, d) in zip(modes, self.levels, strict=True)])
        held = [i for i, m in enumerate(modes) if m == 0]
        if held:
            JM = np.linalg.solve(M, J.T).T
            free = np.linalg.solve(M, right - J.T @ F)
            F[held] = np.linalg.lstsq(JM[held] @ J[held].T, J[held] @ free, rcond=None)[0]
        return np.linalg.solve(M, right - J.T @ F), F

    def decided(self, x: Array, u: Array, modes: Sequence[int]) -> list[int]:
        """The modes from here on, of contacts without velocity by trying all of them."""
        J, n = np.array(self.along), self.size
        slip = J @ x[n:]
        still = [i for i, s in enumerate(slip) if abs(s) < 1e-9]  # rounding of a stop at a node

        def wrong(trial: list[int]) -> float:
            a, F = self.rate(x, u, trial)
            held = (abs(F[i]) / self.levels[i][0] - 1.0 for i in still if trial[i] == 0)
            slides = (-trial[i] * (J @ a)[i] for i in still if trial[i])
            return round(max([0.0, *held, *slides]), 12)

        trials = []
        for choice in product((0, 1, -1), repeat=len(still)):
            trial = dict(enumerate(modes)) | dict(zip(still, choice, strict=True))
            trials.append([*trial.values()])
        return min(trials, key=wrong)

    def event(self, contact: int) -> Callable[..., float]:
        """Return a function of (t, x, u, modes) that is positive while a contact keeps its mode."""
        J, static = np.array(self.along), self.levels[contact][0]

        def margin(_: float, x: Array, u: Array, modes: Sequence[int]) -> float:
            if modes[contact]:
                return float(modes[contact] * (J[contact] @ x[self.size :]))
            return static * (1 + 1e-9) - abs(self.rate(x, u, modes)[1][contact])

        margin.terminal, margin.direction = True, -1  # type: ignore[attr-defined]
        return margin

    def follow(self, times: Array, controls: Array) -> Array:
        """The state at the end under controls that are held from times on, shape (inputs, n)."""
        n, J = self.size, np.array(self.along)
        x, modes = np.zeros(2 * n), [0] * len(self.levels)
        events = [self.event(contact) for contact in range(len(modes))]

        def run(_: float, x: Array, u: Array, modes: Sequence[int]) -> Array:
            return np.concatenate([x[n:], self.rate(x, u, modes)[0]])

        for (begin, end), u in zip(pairwise(times.tolist()), controls.T, strict=False):
            t, status = begin, 1
            while status == 1:
                modes = self.decided(x, u, modes)
                found = solve_ivp(
                    run, (t, end), x, method="DOP853", rtol=1e-9, atol=1e-11, events=events,
                    max_step=(end - begin) / 6, args=(u, tuple(modes)),
                )  # fmt: skip
                x, t, status = found.y[:, -1].copy(), float(found.t[-1]), found.status
                if status == 1:
                    modes = [0 if len(t) else m for t, m in zip(found.t_events, modes, strict=True)]
                    held = [i for i, mode in enumerate(modes) if mode == 0]
                    if held:  # no velocity is left where a contact stops
                        x[n:] -= np.linalg.lstsq(J[held], J[held] @ x[n:], rcond=None)[0]
        return x

    def missed(self, found: Solution) -> float:
        """How far the exact motion ends from where it should, over the way that it goes."""
        names = [v.name for v in found.problem.chain[0].model.u]
        controls = np.array([found.controls[name] for name in names])
        end = self.follow(np.append(found.t_control, found.T), controls)
        requested = [i for i in range(2 * self.size) if i % self.size not in self.free]
        way = [float(np.abs(found[name]).max()) for name in self.states]
        return max(abs(end[i]) / way[i] for i in requested)


def _levels(
    random: np.random.Generator, count: int, size: float
) -> tuple[tuple[float, float], ...]:
    sliding = size * random.uniform(0.3, 1.0, count)
    more = random.uniform(1.0, 1.6, count)
    return tuple((float(d * r), float(d)) for d, r in zip(sliding, more, strict=True))


def blocks(random: np.random.Generator, count: int) -> Machine:
    """Driven blocks on guides whose mass matrix is full."""
    A = random.normal(size=(count, count)) * 0.4
    M = np.diag(random.uniform(0.8, 2.0, count)) + A @ A.T
    rows = tuple(tuple(float(i == k) for k in range(count)) for i in range(count))
    goal = {i: float(random.uniform(0.1, 0.6) * random.choice((-1, 1))) for i in range(count)}
    return Machine(
        f"blocks{count}", count, lambda s, c, q, v: M.tolist(),
        lambda s, c, q, v: [0.2 * one for one in v], tuple(range(count)), rows,
        _levels(random, count, 3.0), goal,
    )  # fmt: skip


def behind_a_spring(random: np.random.Generator, count: int) -> Machine:
    """A driven block and one behind it on a spring; one or both rub."""
    m1, m2, k = random.uniform(0.5, 1.5), random.uniform(0.3, 0.8), random.uniform(60.0, 200.0)

    def bias(s: Any, c: Any, q: Any, v: Any) -> list[Any]:
        pull = k * (q[0] - q[1]) + 1.5 * (v[0] - v[1])
        return [pull, -pull]

    rows = ((0.0, 1.0), (1.0, 0.0))[:count]
    return Machine(
        f"spring{count}", 2, lambda s, c, q, v: [[m1, 0.0], [0.0, m2]], bias, (0,), rows,
        _levels(random, count, 1.5), {1: float(random.uniform(0.2, 0.5))},
    )  # fmt: skip


def stacked(random: np.random.Generator, count: int) -> Machine:
    """A block on a driven one, carried by friction alone; the lower one rubs on the ground, too."""
    m1, m2 = random.uniform(0.8, 1.5), random.uniform(0.3, 0.6)
    rows = ((-1.0, 1.0), (1.0, 0.0))[:count]
    return Machine(
        f"stacked{count}", 2, lambda s, c, q, v: [[m1, 0.0], [0.0, m2]],
        lambda s, c, q, v: [0.1 * v[0], 0.0], (0,), rows, _levels(random, count, 2.0),
        {0: float(random.uniform(0.1, 0.4))}, free=(1,),
    )  # fmt: skip


def cart_pole(random: np.random.Generator, count: int) -> Machine:
    """A driven cart with a hanging pendulum, its rail and pin with friction."""
    m1, m2, length = random.uniform(0.8, 1.5), random.uniform(0.1, 0.3), random.uniform(0.3, 0.6)

    def mass(s: Any, c: Any, q: Any, v: Any) -> list[list[Any]]:
        return [[m1 + m2, m2 * length * c(q[1])], [m2 * length * c(q[1]), m2 * length**2]]

    def bias(s: Any, c: Any, q: Any, v: Any) -> list[Any]:
        return [-m2 * length * s(q[1]) * v[1] * v[1], m2 * 9.81 * length * s(q[1])]

    rail = _levels(random, 1, 2.0)
    pin = _levels(random, 1, 0.03)
    return Machine(
        f"cart_pole{count}", 2, mass, bias, (0,), ((1.0, 0.0), (0.0, 1.0))[:count],
        (*rail, *pin)[:count], {0: float(random.uniform(0.2, 0.6))},
    )  # fmt: skip


def arm(random: np.random.Generator, count: int) -> Machine:
    """Two links in a horizontal plane, both joints driven; a mechanism."""
    m1, m2 = float(random.uniform(0.5, 1.0)), float(random.uniform(0.2, 0.5))
    l1, l2 = float(random.uniform(0.3, 0.5)), float(random.uniform(0.2, 0.4))

    def mass(s: Any, c: Any, q: Any, v: Any) -> list[list[Any]]:
        inner, cross = m2 * l2 * l2, m2 * l1 * l2 * c(q[1])
        return [[(m1 + m2) * l1 * l1 + inner + 2 * cross, inner + cross], [inner + cross, inner]]

    def bias(s: Any, c: Any, q: Any, v: Any) -> list[Any]:
        turn = m2 * l1 * l2 * s(q[1])
        return [-turn * (2 * v[0] * v[1] + v[1] * v[1]), turn * v[0] * v[0]]

    def built(machine: Machine) -> Model:
        m = Mechanism("arm")
        m.body("upper", m1, (1e-9,) * 3)
        m.body("lower", m2, (1e-9,) * 3)
        m.frame("upper.shoulder", at=(-l1, 0.0, 0.0))
        m.frame("lower.elbow", at=(-l2, 0.0, 0.0))
        rubs = [JointFriction(machine.law(k), radius=1.0, normal=1.0) for k in range(2)]
        m.joint(Revolute("a", "ground", "upper.shoulder", friction=rubs[0]))
        m.joint(Revolute("b", "upper", "lower.elbow", friction=rubs[1]))
        for name in "ab":
            torque = m.input(f"t{name}", "N*m", nominal=1.0)
            m.force(JointSpringDamper(f"motor_{name}", name, "turn", actuator=torque))
        return m.build()

    del count
    way = random.uniform(0.3, 1.2, 2) * random.choice((-1, 1), 2)
    return Machine(
        "arm", 2, mass, bias, (0, 1), ((1.0, 0.0), (0.0, 1.0)), _levels(random, 2, 0.3),
        {0: float(way[0]), 1: float(way[1])}, limit=10.0, built=built, names=("a", "b"),
    )  # fmt: skip


KINDS: tuple[tuple[Callable[[np.random.Generator, int], Machine], int], ...] = (
    (blocks, 1), (blocks, 2), (blocks, 3), (blocks, 4), (behind_a_spring, 1), (behind_a_spring, 2),
    (stacked, 1), (stacked, 2), (cart_pole, 1), (cart_pole, 2), (arm, 2),
)  # fmt: skip


def machine(seed: int) -> Machine:
    """One of the kinds in turn, with random numbers."""
    make, count = KINDS[seed % len(KINDS)]
    return make(np.random.default_rng(seed), count)
