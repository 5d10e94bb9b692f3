"""Mechanisms for tests: a chain through every joint, and what their equations give as numbers."""

from dataclasses import dataclass

import casadi as ca
import numpy as np
import pytest

from symfric.foundation.numeric import Array
from symfric.multibody import (
    Cylindrical,
    Fixed,
    Floating,
    Joint,
    JointFriction,
    Mechanism,
    Planar,
    Prismatic,
    Revolute,
    Spherical,
    Universal,
)
from symfric.multibody.equations import Equations
from symfric.multibody.prepare import PreparedMechanism

X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
in_both = pytest.mark.parametrize("formulation", ["joint", "absolute"])
in_joint_coordinates_first = pytest.mark.parametrize(
    "formulation", ["joint", pytest.param("absolute", marks=pytest.mark.slow)]
)
TREE = (Revolute, Prismatic, Cylindrical, Universal, Planar, Spherical, Fixed, Floating)


def body(m: Mechanism, name: str, seed: int) -> None:
    """An unsymmetric body with its centre of mass off its origin and two skew frames."""
    rng = np.random.default_rng(seed)
    A = rng.normal(size=(3, 3))
    spread = A @ A.T
    J = np.trace(spread) * np.eye(3) - spread
    six = (J[0, 0], J[1, 1], J[2, 2], J[0, 1], J[0, 2], J[1, 2])
    m.body(name, float(rng.uniform(1, 3)), six, com=tuple(rng.normal(size=3) * 0.2))
    for frame in ("in", "out"):
        at, z, x = rng.normal(size=(3, 3))
        m.frame(f"{name}.{frame}", tuple(at), tuple(z), tuple(x))


def begin(kind: type[Joint], seed: int) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Random coordinates and rates of a joint, those of Euler parameters as they must be."""
    q, qd = np.random.default_rng(seed + 100).normal(size=(2, len(kind.coordinates))) * 0.5
    if kind.quaternion is not None:
        p = slice(kind.quaternion, kind.quaternion + 4)
        q[p] /= np.linalg.norm(q[p])
        qd[p] -= q[p] * (q[p] @ qd[p])
    return tuple(q.tolist()), tuple(qd.tolist())


def chain(reverse: bool = False, gravity: float = 9.81) -> Mechanism:
    """A body behind every kind of joint, with the ground first or every joint turned round."""
    m = Mechanism("chain", gravity=(0.0, 0.0, -gravity))
    m.frame("ground.out", (0.1, 0.2, 0.3), (0.3, 0.4, 0.9), (1.0, 0.2, 0.1))
    last = "ground.out"
    for i, kind in enumerate(TREE):
        name = f"b{i}"
        body(m, name, seed=i)
        ends = (f"{name}.in", last) if reverse else (last, f"{name}.in")
        m.joint(kind(f"j{i}", *ends, *begin(kind, i)))
        last = f"{name}.out"
    return m


def state(made: PreparedMechanism, seed: int = 0) -> tuple[Array, Array]:
    """Random coordinates with Euler parameters of length one, and rates that keep it."""
    rng = np.random.default_rng(seed)
    q, qd = rng.normal(size=(2, made.eq.n)) * 0.7
    for link in made.eq.kin.topology.links:
        if link.joint.quaternion is not None:
            rows = slice(link.first + link.joint.quaternion, link.first + link.joint.quaternion + 4)
            q[rows] /= np.linalg.norm(q[rows])
            qd[rows] -= q[rows] * (q[rows] @ qd[rows])
    return q, qd


@dataclass(frozen=True)
class Solved:
    """Accelerations, multipliers and what follows from them."""

    a: Array
    lam: Array
    N: Array
    bodies: dict[str, Array]
    reactions: dict[str, Array]


def at_start(eq: Equations, expressions: list[ca.SX]) -> list[ca.SX]:
    """`expressions` with the angles of cut joints as the joints start."""
    starts = [ca.SX(turn.angle.start) for turn in eq.turns]
    return ca.substitute(expressions, [t.angle.symbol for t in eq.turns], starts)


def solve(eq: Equations, q: Array, qd: Array, rounds: int = 60) -> Solved:
    """Solve the equations of motion with friction laws in the contacts by Newton's method."""
    N = ca.SX.sym("N", len(eq.contacts))
    forces = [c.law.force(c.slip, N[k]) for k, c in enumerate(eq.contacts)]
    unknowns = ca.vertcat(eq.a, eq.lam, N)
    rows = ca.vertcat(eq.balance, eq.phi_ddot, ca.vertcat(ca.SX(0, 1), *eq.normals) - N)
    rows = ca.substitute(rows, eq.F, ca.vertcat(ca.SX(0, 1), *forces))
    (rows,) = at_start(eq, [rows])
    known = {s.__hash__() for s in ca.symvar(ca.vertcat(unknowns, eq.q, eq.qd))}
    inputs = ca.vertcat(ca.SX(0, 1), *(s for s in ca.symvar(rows) if s.__hash__() not in known))
    rows = ca.substitute(rows, inputs, ca.SX.zeros(inputs.numel()))
    step = ca.Function("step", [unknowns, eq.q, eq.qd], [rows, ca.jacobian(rows, unknowns)])
    x = np.zeros(unknowns.numel())
    for _ in range(rounds):
        r, J = (m.full() for m in step.call([x, q, qd]))
        x = x - np.linalg.solve(J, r[:, 0])
    every = {
        name: ca.vertcat(m.R @ m.dw_B, m.R @ m.dv_B)
        for name, m in eq.kin.motion.items()
        if name != "ground"
    }
    wrenches = {name: ca.vertcat(*w) for name, w in eq.reactions.items()}
    results = [ca.densify(e) for e in (*every.values(), *wrenches.values())]
    results = ca.substitute(at_start(eq, results), [inputs], [ca.SX.zeros(inputs.numel())])
    values = ca.Function("values", [unknowns, eq.q, eq.qd, eq.F], results)
    applied = ca.Function("F", [unknowns, eq.q, eq.qd], [ca.vertcat(ca.SX(0, 1), *forces)])
    found = [m.full().ravel() for m in values.call([x, q, qd, applied(x, q, qd)])]
    n, m = eq.n, eq.m
    return Solved(
        x[:n],
        x[n : n + m],
        x[n + m :],
        dict(zip(every, found, strict=False)),
        dict(zip(wrenches, found[len(every) :], strict=True)),
    )


def rod(friction: JointFriction | None = None, **start: float) -> Mechanism:
    """A rod on a hinge about y."""
    m = Mechanism("rod")
    at = {"to": (0.0, 0.0, 0.4), "z": Y}
    attach(m, Revolute, "hinge", "rod", mass=2.0, J=0.1, friction=friction, **at, **start)
    return m


def attach(
    m: Mechanism, kind: type[Joint], name: str, child: str, parent: str = "ground", *,
    mass: float = 1.0, J: object = 1.0, com: tuple[float, ...] = (0.0, 0.0, 0.0),
    at: tuple[float, ...] = (0.0, 0.0, 0.0), to: tuple[float, ...] = (0.0, 0.0, 0.0),
    z: tuple[float, ...] = Z, x: tuple[float, ...] | None = None, **more: object,
) -> None:  # fmt: skip
    """Add a joint with frames of the given axes on both bodies, and its child if it is new."""
    if child not in [b.name for b in m.bodies]:
        m.body(child, mass, (J, J, J) if isinstance(J, float) else J, com)
    for place, position in ((f"{parent}.{name}", at), (f"{child}.{name}", to)):
        m.frame(place, position, z, x)
    m.joint(kind(name, f"{parent}.{name}", f"{child}.{name}", **more))
