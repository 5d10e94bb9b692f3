"""Equations of a mechanism with variables, consistent start values and independent constraints."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.foundation.variable import stacked, starts_of, strays, symbols_of
from symfric.model import Variables
from symfric.multibody import checks
from symfric.multibody.assembly import coordinates
from symfric.multibody.constraints import Constraint
from symfric.multibody.equations import Equations, equations
from symfric.multibody.forces import Axial, Force
from symfric.multibody.joint import Joint
from symfric.multibody.kinematics import Cuts, angles
from symfric.multibody.spatial import euler_parameters
from symfric.multibody.topology import Topology

Array = NDArray[np.float64]
LONG, LONG_WITH_FRICTION = 16, 12
"""Number of links of a chain from which cuts save operations. Friction from reactions makes the
full derivatives more expensive.
"""


@final
@dataclass(frozen=True, eq=False)
class Prepared:
    """Equations with their variables and start values.

    Attributes:
        eq: equations without redundant constraints.
        q, qd: coordinates and rates with consistent start values.
        q0, qd0: the same as numbers.
        labels: names of the multipliers.
        redundant: names of the constraints that were left out.
        undetermined: joints whose normal force is undetermined because of redundant constraints.
        open_reactions: joints whose reactions are undetermined.
        singular: True if constraints that are independent nearby are not at the start.
        problems: invalid constraints.
        misfits: violations of constraints at the start, redundant ones included.
    """

    eq: Equations
    q: Variables
    qd: Variables
    q0: Array
    qd0: Array
    labels: tuple[str, ...]
    redundant: tuple[str, ...]
    undetermined: tuple[str, ...] = ()
    open_reactions: tuple[str, ...] = ()
    singular: bool = False
    problems: tuple[str, ...] = ()
    misfits: tuple[str, ...] = ()


def _misfits(made: Prepared, at: checks.Position) -> Iterator[str]:
    """Yield violations of constraints at the start, with the nearest consistent values."""
    phi, J, phi_t = (m.full() for m in at(made.q0))
    worst = int(np.abs(phi).argmax())
    if abs(phi[worst, 0]) > checks.FITS:
        near = checks.project(at, made.q0)
        offer = "no position near it satisfies them"
        if near is not None:
            pairs = zip(made.q, near, strict=True)
            offer = "near it " + ", ".join(f"{v.name} = {x:.10g}" for v, x in pairs)
            offer += "; `assembled()` takes it"
        yield (
            f"start: expected positions that satisfy {made.labels[worst]}, got "
            f"{phi[worst, 0]:.3g}; {offer}"
        )
        return
    speed = J @ made.qd0 + phi_t[:, 0]
    worst = int(np.abs(speed).argmax())
    if not np.isfinite(speed).all():
        yield f"start: expected a finite velocity of {made.labels[worst]}, got {speed[worst]:.3g}"
    elif abs(speed[worst]) > checks.FITS * max(1.0, float(np.abs(made.qd0).max())):
        near = checks.following(J, made.qd0, phi_t[:, 0])
        pairs = zip(made.qd, near, strict=True)
        yield (
            f"start: expected velocities that satisfy {made.labels[worst]}, got "
            f"{speed[worst]:.3g}; near it "
            + ", ".join(f"{v.name} = {x:.10g}" for v, x in pairs)
            + "; `assembled()` takes it"
        )


def in_absolute_coordinates(
    topology: Topology,
    tree: Prepared,
    joints: Sequence[Joint],
    forces: Sequence[Force],
    constraints: Sequence[Constraint],
    p: ca.SX,
    values: ca.DM,
) -> Prepared:
    """Return the same mechanism in absolute coordinates, from the same start."""
    kin = tree.eq.kin
    starts: dict[str, tuple[tuple[float, ...], tuple[float, ...]]] = {}
    for link in topology.links:
        motion, body = kin.motion[link.body], topology.bodies[link.body]
        com, velocity = motion.point(body.c)
        numbers = ca.Function("pose", [tree.eq.q, tree.eq.qd, p],
                              [motion.R, com, velocity, motion.w])  # fmt: skip
        R, r, v, w = numbers(tree.q0, tree.qd0, values)
        e = euler_parameters(R)
        # p' = E' w / 2
        E = np.hstack([-e[1:].full(), _skew(e[1:]) + float(e[0]) * np.eye(3)])
        rate = E.T @ w.full().ravel() / 2
        starts[link.body] = (
            (*r.full().ravel().tolist(), *e.full().ravel().tolist()),
            (*v.full().ravel().tolist(), *rate.tolist()),
        )
    links = tuple(
        replace(link, joint=replace(link.joint, start=starts[link.body][0],
                                    rate=starts[link.body][1]))
        for link in topology.links
    )  # fmt: skip
    topology = replace(topology, links=links)
    q, qd = coordinates(topology)
    wound = {turn.angle.name: turn.angle.start for turn in tree.eq.turns}
    angle = ca.Function("angle", [tree.eq.q, p], [stacked(wound.values())])
    turned = dict(zip(wound, angle(tree.q0, values).full().ravel().tolist(), strict=True))
    joints = [
        replace(j, start=turned[j.name]) if j.start is None and j.name in turned else j
        for j in joints
    ]
    return written(topology, joints, forces, constraints, q, qd, p, values)


def undeclared(
    eq: Equations, joints: Sequence[Joint], forces: Sequence[Force], p: ca.SX, u: ca.SX
) -> Iterator[str]:
    """Yield messages about undeclared symbols in forces."""
    by_name = {joint.name: joint for joint in joints}
    known = ca.vertcat(eq.q, eq.qd, angles(eq.turns), p, u, eq.kin.t)
    for force in forces:
        parts: list[ca.SX] = []
        for load in force.loads(eq.kin, by_name):
            parts += [load.value] if isinstance(load, Axial) else [load.force, load.moment]
        expected = "positions, velocities, time, parameters and inputs"
        yield from checks.undeclared(f"force '{force.name}'", parts, known, expected)


def infinite(
    made: Prepared, joints: Sequence[Joint], forces: Sequence[Force], p: ca.SX, values: ca.DM
) -> Iterator[str]:
    """Yield messages about forces that are not finite at the start, with zero inputs."""
    eq, by_name = made.eq, {joint.name: joint for joint in joints}
    given = ca.vertcat(eq.q, eq.qd, p)
    numbers = np.concatenate([made.q0, made.qd0, values.full().ravel()])
    for force in forces:
        loads = list(force.loads(eq.kin, by_name))
        parts = ca.veccat(*(x.value if isinstance(x, Axial) else x.force for x in loads))
        others = ca.vertcat(*(s for s in ca.symvar(parts) if strays(s, given)))
        found = ca.Function("load", [given, others], [parts])(numbers, 0)
        if not found.is_regular():
            yield (
                f"force '{force.name}': expected a finite force at the start, got "
                f"{checks.shown(float(ca.norm_1(found)))}; do its places coincide there?"
            )


def without_inertia(made: Prepared, p: ca.SX, values: ca.DM) -> Iterator[str]:
    """Yield messages about coordinates without inertia, at the start or near it."""
    eq = made.eq
    if not any(eq.kin.topology.bodies[link.body].ideal for link in eq.kin.topology.links):
        return
    mass = ca.Function("mass", [eq.q, p], [ca.densify(eq.mass)])
    rng = np.random.default_rng(0)
    near = made.q0 + 0.1 * rng.standard_normal(eq.n)
    found = checks.weightless(mass(near, values).full())
    if found.any():
        names = ", ".join(v.name for v, is_one in zip(made.q, found, strict=True) if is_one)
        yield (
            f"expected a mass matrix that is positive definite, got one that is not in {names}: "
            "the bodies they move have no mass (massless links, points on an axis, parallel axes) "
            "or an unphysical inertia"
        )


def without_friction(made: Prepared, p: Variables, u: Variables) -> dict[str, Array]:
    """Return accelerations, multipliers and normal forces at the start without friction."""
    eq = made.eq
    unknowns = ca.vertcat(eq.a, eq.lam)
    rows = ca.vertcat(eq.balance, eq.phi_ddot)
    turned = ca.densify(starts_of(t.angle for t in eq.turns))
    zero = [turned, ca.SX.zeros(eq.F.numel()), ca.SX(starts_of(u)), ca.SX(0)]
    symbols = [angles(eq.turns), eq.F, symbols_of(u), eq.kin.t]
    rows, normals = ca.substitute([rows, stacked(eq.normals)], symbols, zero)
    solve = ca.Function(
        "start",
        [unknowns, eq.q, eq.qd, symbols_of(p)],
        [rows, ca.jacobian(rows, unknowns), normals],
    )
    values = ca.DM(starts_of(p))
    x = np.zeros(unknowns.numel())
    right, matrix, _ = solve(x, made.q0, made.qd0, values)
    x = -np.linalg.lstsq(matrix.full(), right.full()[:, 0], rcond=None)[0]
    loads = solve(x, made.q0, made.qd0, values)[2].full().ravel()
    return {"a": x[: eq.n], "lam": x[eq.n :], "N": loads}


def _skew(a: ca.DM) -> Array:
    x, y, z = (float(v) for v in a.full().ravel())
    return np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])


def numeric(eq: Equations, p: ca.SX, values: ca.DM) -> checks.Position:
    """Return q -> (phi, phi_q, phi_t) at time 0 and the start values of the parameters."""
    parts = [eq.phi, ca.densify(eq.Phi_q), ca.densify(eq.phi_t)]
    every = ca.Function("at", [eq.q, p, eq.kin.t], parts)

    def at(q: Array) -> tuple[ca.DM, ca.DM, ca.DM]:
        phi, jacobian, rate = every.call([q, values, 0.0])
        return phi, jacobian, rate

    return at


def written(
    topology: Topology,
    joints: Sequence[Joint],
    forces: Sequence[Force],
    constraints: Sequence[Constraint],
    q: Variables,
    qd: Variables,
    p: ca.SX,
    values: ca.DM,
) -> Prepared:
    """Return the equations of independent constraints."""
    q_symbols, qd_symbols = (symbols_of(g) for g in (q, qd))
    starts = (starts_of(g) for g in (q, qd))
    q0, qd0 = (ca.DM(ca.substitute(s, p, ca.SX(values))).full().ravel() for s in starts)
    arguments = topology, joints, forces, constraints, q_symbols, qd_symbols, ca.SX.sym("t")
    eq = equations(*arguments)
    labels = labels_of(eq)
    made = Prepared(eq, q, qd, q0, qd0, labels, (), problems=tuple(_held(eq, constraints, p)))
    if not eq.m or made.problems:
        return made
    at = numeric(eq, p, values)
    made = replace(made, misfits=tuple(_misfits(made, at)))
    # a norm may be implied by closed loops, but its multiplier also carries theirs along p
    found = checks.rank(at, q0, range(eq.m - eq.norms, eq.m))
    if not found.redundant:
        return replace(made, singular=found.singular)
    return replace(
        made,
        eq=equations(*arguments, found.kept),
        labels=tuple(labels[i] for i in found.kept),
        redundant=tuple(labels[i] for i in found.redundant),
        undetermined=_undetermined(
            made,
            zip((c.joint for c in eq.contacts), eq.normals, strict=True),
            found.undetermined,
            p,
            values,
        ),
        open_reactions=_undetermined(
            made,
            ((name, ca.vertcat(*wrench)) for name, wrench in eq.reactions.items()),
            found.undetermined,
            p,
            values,
        ),
        singular=found.singular,
        problems=tuple(_fixed_already(made, constraints, found.undetermined)),
    )


def with_cuts(made: Prepared, joints: Sequence[Joint], forces: Sequence[Force]) -> Equations | None:
    """Return the equations of a long open chain with cuts; None if they would not save
    operations.
    """
    eq, topology = made.eq, made.eq.kin.topology
    loaded = ca.depends_on(stacked(eq.normals), eq.a)
    asked = any(c.law.inputs for c in eq.contacts)
    if asked or eq.m or topology.depth < (LONG_WITH_FRICTION if loaded else LONG):
        return None
    return equations(topology, joints, forces, (), eq.q, eq.qd, eq.kin.t, cuts=Cuts())


def _held(eq: Equations, constraints: Sequence[Constraint], p: ca.SX) -> Iterator[str]:
    """Yield reasons why constraints are invalid, including dependencies on other symbols."""
    known = ca.vertcat(eq.q, eq.kin.t, p)
    for constraint, part in zip(constraints, eq.held, strict=True):
        where = f"{constraint.kind} '{constraint.name}'"
        yield from (f"{where} > {text}" for text in part.problems)
        stray = strays(part.phi, known)
        if stray:
            yield (
                f"{where}: expected an expression of positions, time and parameters, got "
                f"{', '.join(stray)}; the two derivatives of an input are unknown"
            )


def _fixed_already(made: Prepared, constraints: Sequence[Constraint], free: Array) -> Iterator[str]:
    """Yield constraints in time whose multipliers take part in the combinations `free`.

    Two motions prescribed for one coordinate agree only at the start.
    """
    phi, t = made.eq.phi, made.eq.kin.t
    involved = np.abs(free).max(axis=1) > checks.RANK
    for constraint, part in zip(constraints, made.eq.held, strict=True):
        for label in part.labels:
            i = made.labels.index(label)
            if involved[i] and ca.depends_on(phi[i], t):
                others = (made.labels[k] for k in np.flatnonzero(involved) if k != i)
                yield (
                    f"{constraint.kind} '{constraint.name}': expected motion that no other "
                    f"constraint fixes, got one that depends on {', '.join(others)}"
                )


def _undetermined(
    made: Prepared, rows: Iterable[tuple[str, ca.SX]], free: Array, p: ca.SX, values: ca.DM
) -> tuple[str, ...]:
    """Return joints whose `rows` change with combinations `free` of the multipliers."""
    eq, rng = made.eq, np.random.default_rng(1)
    pairs = [(name, ca.vec(row)[i]) for name, row in rows for i in range(row.numel())]
    column = ca.substitute(stacked(row for _, row in pairs), eq.kin.t, ca.SX(0))
    given = ca.vertcat(eq.q, eq.qd, p)
    others = ca.veccat(*(s for s in ca.symvar(column) if strays(s, given)))
    jacobian = ca.densify(ca.jacobian(column, eq.lam))
    slope = ca.Function("slope", [eq.q, eq.qd, p, others], [jacobian])
    some = rng.standard_normal(others.numel())
    change = np.abs(slope(made.q0, made.qd0, values, some).full() @ free).max(axis=1)
    found = (name for (name, _), x in zip(pairs, change, strict=True) if x > 1e-7)
    return tuple(dict.fromkeys(found))


def labels_of(eq: Equations) -> tuple[str, ...]:
    """Return names of the multipliers: joint and number, those of constraints, body and "norm"."""
    labels: list[str] = []
    for loop in eq.loops:
        m = loop.phi.numel()
        labels += [f"{loop.joint.name}_lambda" + (f"_{i + 1}" if m > 1 else "") for i in range(m)]
    labels += [label for part in eq.held for label in part.labels]
    for link in eq.kin.topology.links:
        if link.joint.quaternion is not None:
            labels.append(f"{link.joint.name}_norm")
    return tuple(labels)
