"""Checks of a mechanism: names, numbers, connections, start values, redundancy."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from difflib import get_close_matches
from typing import final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.foundation.checks import shown
from symfric.foundation.numeric import is_number, is_symbolic
from symfric.foundation.variable import strays
from symfric.model import Variables
from symfric.multibody.constraints import Constraint
from symfric.multibody.forces import Force
from symfric.multibody.joint import Joint, JointFriction
from symfric.multibody.spatial import GROUND, Body
from symfric.multibody.topology import Topology, body_of

Array = NDArray[np.float64]
Position = Callable[[Array], tuple[ca.DM, ca.DM, ca.DM]]
"""q -> (phi, phi_q, phi_t) as numbers at time 0."""
FITS = 1e-8
"""Largest violation of a constraint at the start [m, m/s]."""
FASTEST = 1e4
"""Largest ratio of dependent to independent rates; it is exceeded at a dead centre only."""
RANK = 1e-9
"""Singular values below this fraction of the largest count as zero."""
SINGULAR = 1e-12
"""Eigenvalues of a mass matrix of unit diagonal below this count as zero."""


def texts(part: object) -> Iterator[str]:
    """Yield messages about names and places of a part that are not texts."""
    for item in fields(part):  # type: ignore[arg-type]
        value = getattr(part, item.name)
        if item.type is str and not isinstance(value, str):
            yield f"{item.name}: expected a text, got {shown(value)}"


def naming(
    bodies: Sequence[Body],
    joints: Sequence[Joint],
    forces: Sequence[Force],
    constraints: Sequence[Constraint],
    inputs: Variables = (),
) -> Iterator[str]:
    """Yield messages about repeated or invalid names, and missing places and joints."""
    names = [("body", b.name) for b in bodies] + [("joint", j.name) for j in joints]
    names += [("force", f.name) for f in forces] + [(c.kind, c.name) for c in constraints]
    names += [("input", v.name) for v in inputs]
    every = [name for _, name in names]
    for kind, name in names:
        if not _identifier(name):
            yield f"{kind} '{name}': expected a name that is a C identifier, got {shown(name)}"
        if every.count(name) > 1:
            yield f"{kind} '{name}': expected every name once"
    known = {b.name: b for b in bodies}
    for joint in joints:
        for end in (joint.parent, joint.child):
            yield from _place(f"joint '{joint.name}'", end, known)
        if body_of(joint.parent) == body_of(joint.child):
            yield f"joint '{joint.name}': expected two bodies, got {joint.parent} twice"
    for force in forces:
        for end in force.places():
            yield from _place(f"force '{force.name}'", end, known)
        yield from _moving(f"force '{force.name}'", force.joints(), joints)
        yield from (f"force '{force.name}' > {text}" for text in force.problems())
    for constraint in constraints:
        where = f"{constraint.kind} '{constraint.name}'"
        yield from _moving(where, constraint.joints(), joints)
        yield from (f"{where} > {text}" for text in constraint.problems())


def _identifier(name: object) -> bool:
    return isinstance(name, str) and name.isascii() and name.isidentifier()


def _moving(where: str, pairs: Iterable[tuple[str, str]], joints: Sequence[Joint]) -> Iterator[str]:
    """Yield messages about missing joints, and directions in which they do not move."""
    known = {joint.name: joint for joint in joints}
    for name, direction in pairs:
        if name not in known:
            near = get_close_matches(name, list(known), n=1, cutoff=0.4)
            hint = f"; did you mean {near[0]}?" if near else ""
            yield f"{where}: expected a joint, got {name}{hint}"
        elif known[name].way(direction) not in known[name].directions:
            expected = " or ".join(known[name].directions) or "a joint that moves along an axis"
            yield f"{where} > direction: expected {expected}, got {direction or 'none'}"


def _place(where: str, place: str, bodies: Mapping[str, Body]) -> Iterator[str]:
    body, _, frame = place.partition(".")
    if body not in bodies:
        near = get_close_matches(body, list(bodies), n=1, cutoff=0.4)
        near = [f"{b.name}.{f}" for b in bodies.values() for f in b.frames if f == body] or near
        hint = f"; did you mean {' or '.join(near)}?" if near else ""
        yield f"{where}: expected a body or 'body.frame', got {place}{hint}"
    elif frame not in bodies[body].frames:
        near = [name for name in bodies[body].frames if name]
        yield f"{where}: expected one of the frames {', '.join(near) or '(none)'}, got {place}"


def weights(bodies: Sequence[Body], p: ca.SX, values: ca.DM) -> Iterator[str]:
    """Yield messages about invalid masses and inertias."""
    for body in bodies:
        if body.name == GROUND:
            continue
        where = f"body '{body.name}'"
        given = (body.mass, body.inertia, body.com, *(f.p for f in body.frames.values()))
        stray = list(undeclared(where, given, p, "parameters"))
        yield from stray or (f"{where} > {text}" for text in body.problems(p, values))


def bearings(joints: Sequence[Joint], p: ca.SX, u: ca.SX) -> Iterator[str]:
    """Yield messages about invalid start values, lengths and friction."""
    for joint in joints:
        where = f"joint '{joint.name}'"
        own = [value for name, value in vars(joint).items() if name != "friction"]
        yield from undeclared(where, own, p, "parameters")
        yield from (f"{where} > {text}" for text in joint.problems())
        n = len(joint.coordinates)
        for what, given in (("start", joint.start), ("rate", joint.rate)):
            values = joint.starts if what == "start" else joint.rates
            if given is not None and len(values) != n:
                yield f"joint '{joint.name}' > {what}: expected {n} numbers, got {len(values)}"
            bad = [x for x in values if not is_symbolic(x) and not _finite(x)]
            if bad:
                yield f"joint '{joint.name}' > {what}: expected finite numbers, got {bad[0]!r}"
        if joint.friction is not None:
            yield from _rubbing(f"{where} > friction", joint, joint.friction, ca.vertcat(p, u))


def _rubbing(where: str, joint: Joint, friction: object, known: ca.SX) -> Iterator[str]:
    if not isinstance(friction, JointFriction):
        yield f"{where}: expected JointFriction(law, radius=...), got {shown(friction)}"
        return
    yield from (f"{where}: {text}" for text in friction.problems(joint.rubs))
    law, v, N = friction.law, ca.SX.sym("v"), ca.SX.sym("N")
    z = ca.SX.sym("z", len(law.states))
    offered = {i.name: ca.SX.sym(i.name) for i in law.inputs}
    given = [value for name, value in vars(friction).items() if name != "law"]
    given += [law.force(v, N, z, **offered), law.rate(v, N, z, **offered)]
    known = ca.vertcat(v, N, z, *offered.values(), known)
    yield from undeclared(where, given, known, "parameters and inputs")


def undeclared(where: str, values: Iterable[object], known: ca.SX, expected: str) -> Iterator[str]:
    """Yield messages about undeclared symbols in `values`."""
    flat = [x for value in values for x in (value if isinstance(value, tuple | list) else [value])]
    stray = strays(ca.veccat(*(x for x in flat if isinstance(x, ca.SX))), known)
    if stray:
        hint = f"pass the variable, build(p=({stray[0]},))"
        yield f"{where}: expected only declared {expected}, got {', '.join(stray)}; {hint}"


def _finite(x: object) -> bool:
    return is_number(x) and bool(np.isfinite(float(x)))  # type: ignore[arg-type]


def connected(bodies: Sequence[Body], topology: Topology) -> Iterator[str]:
    """Yield messages about bodies without a connection, and mechanisms that cannot move."""
    hung = {GROUND, *(link.body for link in topology.links)}
    loose = [body.name for body in bodies if body.name not in hung]
    for name in loose:
        yield (
            f"body '{name}': expected joints with coordinates up to the ground, found "
            "none; a Floating joint lets it move freely"
        )
    if not loose and not topology.n:
        yield "expected bodies that can move, got none"


@final
@dataclass(frozen=True, eq=False)
class Rank:
    """Constraints that determine the motion.

    Attributes:
        kept: indices of independent constraints.
        redundant: indices of the others.
        undetermined: multiplier combinations without effect on the motion, shape (m, k).
        singular: True if the rank drops at the start position itself.
    """

    kept: tuple[int, ...]
    redundant: tuple[int, ...]
    undetermined: Array
    singular: bool


def rank(at: Position, q: Array, first: Sequence[int] = ()) -> Rank:
    """Return independent constraints near q, by elimination with full pivoting.

    Args:
        at: q -> (phi, phi_q, phi_t).
        first: constraints that are kept in any case, independent of each other.
    """
    here = at(q)[1].full()
    near = here
    rng = np.random.default_rng(0)
    for size in (1e-3, 1e-2):
        guess = project(at, q + size * rng.standard_normal(q.size))
        if guess is not None:
            other = at(guess)[1].full()
            near = other if _rank(other) > _rank(near) else near
    u, s, _ = np.linalg.svd(near)
    r = int((s > RANK * max(1.0, s[0])).sum()) if s.size else 0
    kept = tuple(sorted(_independent(near, r, first)))
    redundant = tuple(i for i in range(near.shape[0]) if i not in kept)
    return Rank(kept, redundant, u[:, r:], _rank(here) < r)


def _rank(A: Array) -> int:
    return int(np.linalg.matrix_rank(A, tol=RANK * max(1.0, float(np.abs(A).max(initial=0.0)))))


def _independent(A: Array, r: int, first: Sequence[int]) -> list[int]:
    """Return indices of r independent rows: `first`, then by Gram-Schmidt the largest remainder.

    Of equal rows the first is taken, so that the joints named first are kept completely.
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
    """Return a mask of coordinates that make the mass matrix M (n, n) not positive definite.

    Each is scaled by its own inertia, so that units and sizes do not matter.
    """
    own = np.diag(M)
    if not (own > 0).all():
        return own <= 0
    least, along = np.linalg.eigh((M + M.T) / 2 / np.sqrt(np.outer(own, own)))
    return (least[0] < SINGULAR) & (np.abs(along[:, 0]) > 0.1)


def following(J: Array, wanted: Array, phi_t: Array) -> Array:
    """Return rates near `wanted` that satisfy J rates + phi_t = 0.

    Nonzero rates are kept if possible, and the others follow; otherwise the nearest rates are
    taken.
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
    """Return the nearest q that satisfies the constraints, by Gauss-Newton; None if there is
    none.
    """
    for _ in range(iterations):
        phi, J, _ = (m.full() for m in at(q))
        if not phi.size or np.abs(phi).max() < 1e-13:
            return q
        step = np.linalg.lstsq(J, phi[:, 0], rcond=1e-10)[0]
        if not np.isfinite(step).all():
            return None
        q = q - step
    phi = at(q)[0].full()
    return q if np.abs(phi).max() < FITS else None
