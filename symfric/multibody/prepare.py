"""Equations of a mechanism with variables, consistent start values and independent constraints."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple, final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.foundation.numeric import Array
from symfric.foundation.parameters import Variable
from symfric.foundation.variable import at_start, stacked, starts_of, strays, symbols_of, undeclared
from symfric.model import Variables, kinds
from symfric.multibody.constraints import Constraint
from symfric.multibody.equations import Equations, equations
from symfric.multibody.forces import Force
from symfric.multibody.kinematics import Cuts
from symfric.multibody.spatial import GROUND, euler_e, euler_parameters
from symfric.multibody.topology import Topology, absolute

Position = Callable[[Array], tuple[Array, Array, Array]]
"""Function q -> (phi, phi_q, phi_t) at time 0, shapes (m,), (m, n), (m,)."""
FITS = 1e-8
"""Largest accepted violation of a constraint at the start [m, m/s]."""
FASTEST = 1e4
"""Largest ratio of dependent to independent rates; larger ratios occur only at a dead centre."""
RANK = 1e-9
"""Fraction of the largest singular value below which singular values count as zero."""
SINGULAR = 1e-12
"""Value below which eigenvalues of a mass matrix with unit diagonal count as zero."""
LONG, LONG_WITH_FRICTION = 16, 10
"""Number of links of a chain from which cuts save operations.

The second number is for friction from reactions, which makes dense derivatives more expensive.
"""


@final
@dataclass(frozen=True, eq=False)
class PreparedMechanism:
    """Equations of a mechanism with their variables and start values.

    Attributes:
        eq: equations without redundant constraints.
        p, u: parameters and inputs.
        q, qd: coordinates and rates with consistent start values.
        q0, qd0: start values of q and qd as numbers.
        labels: names of the multipliers.
        redundant: names of the multipliers of omitted constraints.
        undetermined: joints and elements whose normal force is undetermined because of redundant
            constraints, as messages name them.
        open_reactions: joints whose reactions are undetermined.
        singular: True if constraints are dependent at the start but independent near it.
        problems: messages about invalid constraints.
        misfits: messages about constraints violated at the start, including redundant ones.
    """

    eq: Equations
    p: Variables
    u: Variables
    q: Variables
    qd: Variables
    q0: Array
    qd0: Array
    labels: tuple[str, ...]
    redundant: tuple[str, ...] = ()
    undetermined: tuple[str, ...] = ()
    open_reactions: tuple[str, ...] = ()
    singular: bool = False
    problems: tuple[str, ...] = ()
    misfits: tuple[str, ...] = ()

    def numbers(
        self, *expressions: ca.SX, others: Callable[[int], Array] = np.zeros
    ) -> list[Array]:
        """Return the values of expressions of q, qd, p and t at the start, as matrices.

        `others` returns the values of all other symbols, given the number of these symbols.
        """
        eq, p = self.eq, symbols_of(self.p)
        known = ca.vertcat(eq.q, eq.qd, p, eq.kin.t)
        rest = stacked(undeclared(ca.veccat(*expressions), known))
        f = ca.Function("start", [known, rest], [ca.densify(e) for e in expressions])
        values = ca.DM(starts_of(self.p)).full().ravel()
        at = np.concatenate([self.q0, self.qd0, values, [0.0]])
        return [value.full() for value in f.call([at, others(rest.numel())])]

    @property
    def position(self) -> Position:
        """Function q -> (phi, phi_q, phi_t) at time 0 with the start values of the parameters."""
        eq = self.eq
        parts = [eq.phi, ca.densify(eq.Phi_q), ca.densify(eq.phi_t)]
        every = ca.Function("at", [eq.q, symbols_of(self.p), eq.kin.t], parts)
        values = ca.DM(starts_of(self.p))

        def at(q: Array) -> tuple[Array, Array, Array]:
            phi, jacobian, rate = (part.full() for part in every.call([q, values, 0.0]))
            return phi[:, 0], jacobian, rate[:, 0]

        return at


def coordinates(topology: Topology) -> tuple[Variables, Variables]:
    """Return the joint coordinates and their rates as variables of a model."""
    q: list[Variable] = []
    qd: list[Variable] = []
    for link in topology.links:
        joint = link.joint
        quaternion = range(0) if joint.quaternion is None else range(joint.quaternion, link.n)
        given = zip(joint.coordinates, joint.starts, joint.rates, strict=True)
        for i, ((_, unit), begin, rate) in enumerate(given):
            name = joint.coordinate(i)
            per_second = "1/s" if i in quaternion else f"{unit}/s"
            q.append(Variable(name, unit, start=begin, doc="joint coordinate", kind=kinds.POSITION))
            qd.append(
                Variable(f"{name}_rate", per_second, start=rate, doc="joint rate", kind=kinds.RATE)
            )
    return tuple(q), tuple(qd)


def written(
    topology: Topology, forces: Sequence[Force], constraints: Sequence[Constraint], p: Variables,
    u: Variables = (),
) -> PreparedMechanism:  # fmt: skip
    """Return the equations of motion with independent constraints only."""
    q, qd = coordinates(topology)
    q0, qd0 = (at_start(starts_of(group), p).full().ravel() for group in (q, qd))
    t = ca.SX.sym("t")
    arguments = topology, forces, constraints, symbols_of(q), symbols_of(qd), t
    eq = equations(*arguments)
    labels = tuple(eq.multipliers)
    made = PreparedMechanism(
        eq, p, u, q, qd, q0, qd0, labels, problems=tuple(_held(eq, constraints, p))
    )
    if not eq.m or made.problems:
        return made
    at = made.position
    made = replace(made, misfits=tuple(_misfits(made, at)))
    # norms are kept even if loops imply them: their multipliers also contain loop terms along p
    found = rank(at, q0, range(eq.m - eq.norms, eq.m))
    if not found.redundant:
        return replace(made, singular=found.singular)
    normals = zip((c.place for c in eq.contacts), eq.normals, strict=True)
    reactions = ((name, ca.vertcat(*wrench)) for name, wrench in eq.reactions.items())
    return replace(
        made,
        eq=equations(*arguments, found.kept),
        labels=tuple(labels[i] for i in found.kept),
        redundant=tuple(labels[i] for i in found.redundant),
        undetermined=_undetermined(made, normals, found.undetermined),
        open_reactions=_undetermined(made, reactions, found.undetermined),
        singular=found.singular,
        problems=tuple(_fixed_already(made, constraints, found.undetermined)),
    )


def _held(eq: Equations, constraints: Sequence[Constraint], p: Variables) -> Iterator[str]:
    """Yield reasons why constraints are invalid, including symbols that they must not contain."""
    known = ca.vertcat(eq.q, eq.kin.t, symbols_of(p))
    for constraint, part in zip(constraints, eq.held, strict=True):
        where = f"{constraint.kind} '{constraint.name}'"
        yield from (f"{where} > {text}" for text in part.problems)
        stray = strays(part.phi, known)
        if stray:
            yield (
                f"{where}: expected an expression of positions, time and parameters, got "
                f"{', '.join(stray)}; the two derivatives of an input are unknown"
            )


def _misfits(made: PreparedMechanism, at: Position) -> Iterator[str]:
    """Yield messages about constraints violated at the start, with the nearest valid values."""
    phi, J, phi_t = at(made.q0)
    speed = J @ made.qd0 + phi_t
    fast = FITS * max(1.0, float(np.abs(made.qd0).max()))
    if np.abs(phi).max() > FITS:
        near = project(at, made.q0)
        yield _offer("positions", made, phi, made.q, near)
    elif not np.isfinite(speed).all():
        worst = int(np.abs(speed).argmax())
        yield f"start: expected a finite velocity of {made.labels[worst]}, got {speed[worst]:.3g}"
    elif np.abs(speed).max() > fast:
        yield _offer("velocities", made, speed, made.qd, following(J, made.qd0, phi_t))


def _offer(
    what: str, made: PreparedMechanism, off: Array, group: Variables, near: Array | None
) -> str:
    """Return the message about the largest entry of `off`.

    The message offers the consistent values `near` for the variables in `group`.
    """
    worst = int(np.abs(off).argmax())
    offer = "no position near it satisfies them"
    if near is not None:
        pairs = zip(group, near, strict=True)
        offer = "near it " + ", ".join(f"{v.name} = {x:.10g}" for v, x in pairs)
        offer += "; `assembled()` takes it"
    return (
        f"start: expected {what} that satisfy {made.labels[worst]}, got {off[worst]:.3g}; {offer}"
    )


def _undetermined(
    made: PreparedMechanism, rows: Iterable[tuple[str, ca.SX]], free: Array
) -> tuple[str, ...]:
    """Return the joints whose `rows` depend on the combinations `free` of the multipliers."""
    pairs = [(name, ca.vec(row)[i]) for name, row in rows for i in range(row.numel())]
    slopes = ca.jacobian(stacked(row for _, row in pairs), made.eq.lam)
    (slopes,) = made.numbers(slopes, others=np.random.default_rng(1).standard_normal)
    change = np.abs(slopes @ free).max(axis=1)
    found = (name for (name, _), x in zip(pairs, change, strict=True) if x > 1e-7)
    return tuple(dict.fromkeys(found))


def _fixed_already(
    made: PreparedMechanism, constraints: Sequence[Constraint], free: Array
) -> Iterator[str]:
    """Yield messages about constraints in time with multipliers in the combinations `free`.

    For example, two prescribed motions of one coordinate agree only at the start.
    """
    phi, t = made.eq.phi, made.eq.kin.t
    involved = np.abs(free).max(axis=1) > RANK
    for constraint, part in zip(constraints, made.eq.held, strict=True):
        for label in part.labels:
            i = made.labels.index(label)
            if involved[i] and ca.depends_on(phi[i], t):
                others = (made.labels[k] for k in np.flatnonzero(involved) if k != i)
                yield (
                    f"{constraint.kind} '{constraint.name}': expected motion that no other "
                    f"constraint fixes, got one that depends on {', '.join(others)}"
                )


def in_absolute_coordinates(
    tree: PreparedMechanism, constraints: Sequence[Constraint]
) -> PreparedMechanism:
    """Return the equations of the mechanism in absolute coordinates, with the same start."""
    kin = tree.eq.kin
    starts: dict[str, tuple[tuple[float, ...], tuple[float, ...]]] = {}
    for name, body in kin.topology.bodies.items():
        if name == GROUND:
            continue
        com, velocity = kin.motion[name].point(body.c)
        R, r, v, w = tree.numbers(kin.motion[name].R, com, velocity, kin.motion[name].w)
        e = euler_parameters(ca.DM(R))
        # p' = E' w / 2
        rate = ca.DM(euler_e(ca.SX(e))).full().T @ w.ravel() / 2
        pose = (*r.ravel().tolist(), *e.full().ravel().tolist())
        starts[name] = pose, (*v.ravel().tolist(), *rate.tolist())
    (wound,) = tree.numbers(ca.SX(starts_of(turn.angle for turn in tree.eq.turns)))
    names = (turn.angle.name for turn in tree.eq.turns)
    turned = dict(zip(names, wound.ravel().tolist(), strict=True))
    joints = [
        replace(j, start=turned[j.name]) if j.start is None and j.name in turned else j
        for j in kin.topology.joints.values()
    ]
    topology = absolute(kin.topology.bodies, joints, starts)
    return written(topology, tree.eq.forces, constraints, tree.p, tree.u)


def without_friction(made: PreparedMechanism) -> tuple[Array, Array, Array]:
    """Return the accelerations, multipliers and normal forces at the start without friction."""
    eq = made.eq
    unknowns = ca.vertcat(eq.a, eq.lam)
    turned = ca.densify(starts_of(turn.angle for turn in eq.turns))
    symbols = [eq.angles, eq.F, symbols_of(made.u), eq.kin.t, eq.N]
    zero = [turned, ca.SX.zeros(eq.F.numel()), ca.SX(starts_of(made.u)), ca.SX(0)]
    zero.append(ca.SX.ones(eq.N.numel()))
    expressions = [ca.vertcat(eq.balance, eq.phi_ddot), stacked(eq.normals)]
    rows, normals = ca.substitute(expressions, symbols, zero)
    is_mass = not eq.m and not ca.depends_on(eq.mass, ca.vertcat(*symbols))
    slopes = eq.mass if is_mass else ca.jacobian(rows, unknowns)
    arguments = [unknowns, eq.q, eq.qd, symbols_of(made.p)]
    solve = ca.Function("start", arguments, [rows, slopes, normals])
    at = made.q0, made.qd0, ca.DM(starts_of(made.p))
    right, matrix, _ = solve(0, *at)
    x = -np.linalg.lstsq(matrix.full(), right.full()[:, 0], rcond=None)[0]
    return x[: eq.n], x[eq.n :], solve(x, *at)[2].full().ravel()


def with_cuts(made: PreparedMechanism) -> Equations | None:
    """Return the equations with cuts; None if cuts do not save operations.

    Cuts save operations in long open chains.
    """
    eq, topology = made.eq, made.eq.kin.topology
    loaded = ca.depends_on(stacked(eq.normals), eq.a)
    applied = any(c.law.inputs for c in eq.contacts)
    if applied or eq.m or topology.depth < (LONG_WITH_FRICTION if loaded else LONG):
        return None
    return equations(topology, eq.forces, (), eq.q, eq.qd, eq.kin.t, cuts=Cuts())


class Rank(NamedTuple):
    """Independent and redundant constraints.

    Attributes:
        kept: indices of independent constraints, which determine the motion.
        redundant: indices of all other constraints.
        undetermined: combinations of multipliers without effect on the motion, shape (m, k).
        singular: True if the rank at the start is lower than near it.
    """

    kept: tuple[int, ...]
    redundant: tuple[int, ...]
    undetermined: Array
    singular: bool


def rank(at: Position, q: Array, first: Sequence[int]) -> Rank:
    """Return the independent constraints near q, by Gram-Schmidt with pivoting.

    Args:
        at: function q -> (phi, phi_q, phi_t).
        q: start position, shape (n,).
        first: indices of constraints that are always kept; they must be independent.
    """
    here = at(q)[1]
    near = here
    rng = np.random.default_rng(0)
    for size in (1e-3, 1e-2):
        guess = project(at, q + size * rng.standard_normal(q.size))
        if guess is not None:
            other = at(guess)[1]
            near = other if _rank(other) > _rank(near) else near
    u, s, _ = np.linalg.svd(near)
    r = int((s > RANK * max(1.0, s[0])).sum()) if s.size else 0
    kept = tuple(sorted(_independent(near, r, first)))
    redundant = tuple(i for i in range(near.shape[0]) if i not in kept)
    return Rank(kept, redundant, u[:, r:], _rank(here) < r)


def _rank(A: Array) -> int:
    return int(np.linalg.matrix_rank(A, tol=RANK * max(1.0, float(np.abs(A).max(initial=0.0)))))


def _independent(A: Array, r: int, first: Sequence[int]) -> list[int]:
    """Return the indices of r independent rows, beginning with `first`, by Gram-Schmidt.

    The next row is the first whose remainder is more than half the largest, so that the constraints
    of the joints that were added first are kept.
    """
    left, chosen = A.copy(), list[int]()
    for k in range(r):
        size = np.linalg.norm(left, axis=1)
        i = first[k] if k < len(first) else int(np.argmax(size > 0.5 * size.max()))
        chosen.append(i)
        direction = left[i] / size[i]
        left -= np.outer(left @ direction, direction)
    return chosen


def weightless(M: Array) -> NDArray[np.bool_]:
    """Return a mask of the coordinates in which the mass matrix M (n, n) is not positive definite.

    M is scaled to unit diagonal, so that the result does not depend on units.
    """
    own = np.diag(M)
    if not (own > 0).all():
        return own <= 0
    least, along = np.linalg.eigh((M + M.T) / 2 / np.sqrt(np.outer(own, own)))
    return (least[0] < SINGULAR) & (np.abs(along[:, 0]) > 0.1)


def following(J: Array, wanted: Array, phi_t: Array) -> Array:
    """Return rates near `wanted` that satisfy J rates + phi_t = 0.

    Nonzero rates are kept if changes of the zero rates can satisfy the equations; otherwise the
    nearest rates in the sense of least squares are returned.
    """
    if not J.size:
        return wanted
    miss, rest = J @ wanted + phi_t, wanted == 0.0
    step = np.zeros_like(wanted)
    step[rest] = np.linalg.lstsq(J[:, rest], miss, rcond=1e-10)[0]
    fits = np.abs(J @ step - miss).max() <= FITS * (1.0 + np.abs(miss).max())
    near_a_dead_centre = np.abs(step).max() > FASTEST * max(1.0, np.abs(wanted).max())
    if not fits or near_a_dead_centre:
        step = np.linalg.lstsq(J, miss, rcond=None)[0]
    return wanted - step


def project(at: Position, q: Array, iterations: int = 30) -> Array | None:
    """Return q near the given one that satisfies the constraints; None if Gauss-Newton fails."""
    for _ in range(iterations):
        phi, J, _ = at(q)
        if not phi.size or np.abs(phi).max() < 1e-13:
            return q
        step = np.linalg.lstsq(J, phi, rcond=1e-10)[0]
        if not np.isfinite(step).all():
            return None
        q = q - step
    return q if np.abs(at(q)[0]).max() < FITS else None
