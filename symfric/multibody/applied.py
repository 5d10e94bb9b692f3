"""Applied force of a contact: the friction force for which the sliding acceleration is zero.

Laws with true sticking need this force, F_e. It follows from the constrained equations of motion,

    F_e = F + ds/dt / W,   W = G P G'     (see below)

for the sliding velocity s and the friction force F: with F_e instead of F, and all other friction
forces unchanged, s would be constant. F_e is an algebraic unknown. A sticking contact transmits
F = F_e, so its equation is ds/dt = 0 for any W. Contacts that stick independently of each other
have one such equation each; the equations together determine the forces.

In a loop of one degree of freedom, and on one joint coordinate outside loops (a bearing and its
brake), all contacts stick together: s_i = g_i(q) omega, with omega the speed along the tangent of
the constraints. The distribution of the force that holds the loop,
T = sum g_i F_i, is undetermined. The contacts share it in equal fractions of their static levels,
the distribution that holds the largest force,

    F_i = sign(g_i) S_i T / sum |g_k| S_k,   |T| <= sum |g_k| S_k,   S_i = mu_s N_i

A contact whose g_i passes through zero (a slider in its dead centre) reverses and does not stop.
For laws without modes, g_i replaces sign(g_i), which jumps there: the contact with the largest
g_i then has the largest share.

A law with modes does not need F_e while it slides; while it sticks, it needs the sign of
|F_e| - mu_s N. For such a law W is constant, with its value at the start, and F_e is exact only in
stick. Limits: in a loop of several degrees of freedom the contacts with such laws must be
independent; a loop of one degree of freedom must not have constraints that depend on time.

Accelerations under the generalised forces `right`, and the mobility of a contact:

    M^-1 right,   W_i = G_i P G_i',   P = M^-1 - M^-1 phi_q' (phi_q M^-1 phi_q')^-1 phi_q M^-1

G_i is the row of sliding velocities s_i = G_i q' + ..., and W_i is the decrease of the sliding
acceleration per unit friction force with all other forces unchanged.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import final

import casadi as ca
import numpy as np

from symfric.foundation.graph import coupled
from symfric.foundation.numeric import Array
from symfric.foundation.parameters import Variable
from symfric.laws import Law
from symfric.laws.base import smooth
from symfric.laws.base.law import FORCE, Switch
from symfric.laws.composed.isotropic import SpatialSlip
from symfric.model import Variables, kinds
from symfric.multibody.contact import UNLOADED, Contact, law_places
from symfric.multibody.equations import Equations
from symfric.multibody.joints import Floating
from symfric.multibody.prepare import PreparedMechanism
from symfric.multibody.spatial import GROUND, euler_e


def free_bodies(eq: Equations) -> bool:
    """Return True if all bodies are connected to the ground by floating joints."""
    links = eq.kin.topology.links
    return bool(links) and all(isinstance(x.joint, Floating) and x.base == GROUND for x in links)


def mirrored(M: ca.SX) -> ca.SX:
    """Return a matrix with symmetric sparsity from one that is symmetric in value only.

    An entry that is a structural zero on one side of the diagonal may be 0 x on the other side.
    """
    if M.sparsity().is_symmetric():
        return M
    upper = ca.project(M, M.sparsity() * M.T.sparsity())
    return ca.triu2symm(ca.triu(upper))


def solve_mass(eq: Equations, right: ca.SX) -> ca.SX:
    """Return M^-1 times the columns of `right`; block by block if all bodies float freely."""
    topology = eq.kin.topology
    if not free_bodies(eq):
        D, L, order = ca.ldl(mirrored(eq.mass))
        return ca.ldl_solve(ca.densify(right), D, L, order) if eq.n else right
    rows: list[ca.SX] = []
    for link in topology.links:
        body, own = topology.bodies[link.body], right[link.rows, 0]
        p, R = eq.q[link.rows, 0][3:], eq.kin.motion[link.body].R
        weight = ca.trace(body.J)
        turning = euler_e(p).T @ (R @ ca.solve(body.J, R.T @ (euler_e(p) @ own[3:])))
        rows.append(own[:3] / body.mass)
        rows.append(turning / 4 + p * (ca.dot(p, own[3:]) / weight))
    return ca.vertcat(*rows)


def mobility(eq: Equations, G: ca.SX) -> tuple[ca.SX, ca.SX]:
    """Return W of each row of `G`, with and without the constraints, shape (k, 1) each."""
    J, k = eq.Phi_q, G.size1()
    right = ca.densify(ca.vertcat(G, J).T)
    columns = ca.horzsplit(right) if free_bodies(eq) else [right]
    moved = ca.horzcat(*(solve_mass(eq, column) for column in columns))
    loose = ca.sum2(G * moved[:, :k].T)
    if not eq.m:
        return loose, loose
    across, S = J @ moved[:, :k], J @ moved[:, k:]
    D, L, order = ca.ldl(mirrored(S))
    held = ca.ldl_solve(ca.densify(across), D, L, order)
    return loose - ca.sum1(across * held).T, loose


def paths_of(J: ca.SX) -> list[tuple[list[int], list[int]]]:
    """Return the columns and rows of each loop, and each column outside loops, of J = phi_q."""
    loops = coupled(ca.DM(J.sparsity(), 1).full() != 0)
    inside = {k for columns, _ in loops for k in columns}
    return [*loops, *(([k], list[int]()) for k in range(J.size2()) if k not in inside)]


def tangent_of(J: ca.SX, columns: Sequence[int], rows: Sequence[int]) -> ca.SX:
    """Return the unit vector Z along the `columns` of a loop with J Z = 0 in its `rows`.

    Z is computed from minors; it is a smooth function of J as long as the rows have full rank. A
    coordinate outside loops has no rows.
    """
    Z = ca.SX(J.size2(), 1)
    Z[columns] = _null_direction(J[rows, columns]) if rows else 1.0
    return Z


def _null_direction(J: ca.SX) -> ca.SX:
    n = J.size2()
    minors = [ca.det(ca.densify(J[:, [j for j in range(n) if j != k]])) for k in range(n)]
    Z = ca.vertcat(*((-1) ** k * minor for k, minor in enumerate(minors)))
    return Z / ca.sqrt(ca.sumsqr(Z))


IMMOVABLE = 1e-10
"""Fraction of the unconstrained W below which the constraints hold a contact."""
MINORS = 8
"""Largest number of coordinates of a loop whose tangent is computed from minors."""
CALM = 0.1
"""Time constant [s] with which a sliding velocity left by rounding decays in stick.

It prevents drift. Only laws with modes use it; they evaluate F_e only in stick.
"""


@final
@dataclass(frozen=True, eq=False)
class Rest:
    """Group of contacts that stick together, and the force that holds them in stick.

    Attributes:
        name: name of the contact or of the loop.
        members: numbers of the contacts.
        along: g_i = s_i / omega of each contact.
        rate: omega; for a single contact its sliding velocity.
        change: time derivative of `rate`, exact at least in stick.
        force: F_e or T, an algebraic variable.
        inertia: 1 / W of omega.
        by_modes: True if the laws of the contacts stick by a mode.
        direction: for a loop with modes the sign of omega, 0 in stick; otherwise empty.
        still: names of the joint rates that are zero in stick.
    """

    name: str
    members: tuple[int, ...]
    along: tuple[ca.SX, ...]
    rate: ca.SX
    change: ca.SX
    force: Variable
    inertia: ca.SX
    by_modes: bool
    direction: Variables
    still: tuple[str, ...]

    def shares(self, levels: Sequence[ca.SX]) -> list[ca.SX]:
        """Return F_e of each member, given the static levels of the members [N]."""
        if not self.is_loop:
            return [self.force.symbol]
        above = [S + UNLOADED for S in levels]
        signs = [forward(g) if self.by_modes else g for g in self.along]
        weights = [sign * S for sign, S in zip(signs, above, strict=True)]
        total = sum((g * w for g, w in zip(self.along, weights, strict=True)), start=ca.SX(0))
        return [w / total * self.force.symbol for w in weights]

    def capacity(self, levels: Sequence[ca.SX]) -> ca.SX:
        """Return the largest force along omega that the static levels `levels` hold."""
        pairs = zip(self.along, levels, strict=True)
        return sum((smooth.magnitude(g, 0.0) * S for g, S in pairs), start=ca.SX(0))

    @property
    def is_loop(self) -> bool:
        """Return True if the members move together along the tangent of constraints."""
        return len(self.members) > 1 or not self.along[0].is_one()

    def needed(self, forces: Sequence[ca.SX]) -> ca.SX:
        """Return the residual of the equation for the applied force, shape (1, 1)."""
        held = sum((g * F for g, F in zip(self.along, forces, strict=True)), start=ca.SX(0))
        change = self.change + self.rate / CALM if self.by_modes else self.change
        return held + self.inertia * change - self.force.symbol


def forward(x: ca.SX) -> ca.SX:
    """Return 1 where x >= 0, else -1."""
    return ca.SX(smooth.choose(x < 0, -1.0, 1.0))


def switches_at(
    law: Law | SpatialSlip, v: ca.SX, N: ca.SX, z: ca.SX, F_e: ca.SX
) -> tuple[Switch, ...]:
    """Return the changes of mode of a law, with F_e as an argument if the law needs it."""
    return law.switches(v, N, z, **({FORCE: F_e} if law.inputs else {}))


def some_switches(law: Law | SpatialSlip) -> tuple[Switch, ...]:
    """Return the changes of mode of a law, evaluated at arbitrary arguments."""
    one = ca.SX(1.0)
    return switches_at(law, one, one, ca.SX.ones(len(law.states)), one)


def capacity_of(law: Law | SpatialSlip, N: ca.SX) -> ca.SX:
    """Return the static level [N] of a contact in a loop.

    For laws without modes it is the normal force.
    """
    if isinstance(law, SpatialSlip) or not some_switches(law):
        return N
    return ca.SX(law.static_level(N))


@final
class _Maker:
    """Builder of the groups of contacts that stick together.

    Args:
        where: name of the mechanism in messages.
        made: equations of motion and start values.
        a0: accelerations without friction at the start.
    """

    def __init__(self, where: str, made: PreparedMechanism, a0: Array) -> None:
        self.where, self.made, self.eq, self.a0 = where, made, made.eq, a0

    def numbers(self, expression: ca.SX) -> Array:
        """Return the value of an expression at the start, without friction."""
        return self.made.numbers(ca.substitute(expression, self.eq.a, ca.SX(self.a0)))[0]

    def refuse(self, contacts: Sequence[Contact], expected: str, advice: str) -> ValueError:
        """Return the error for contacts whose laws cannot stick here."""
        law = type(contacts[0].friction.law).__name__
        return ValueError(
            f"{self.where} > {law_places(contacts)}: expected {expected}, got {law}, "
            f"which needs the applied force; {advice}"
        )

    def group(
        self, name: str, members: Sequence[int], along: Sequence[ca.SX], rate: ca.SX,
        change: ca.SX, G: ca.SX, columns: Sequence[int],
    ) -> Rest:  # fmt: skip
        """Return one group; `G` is the derivative of `rate` with respect to the joint rates."""
        contacts, rates = [self.eq.contacts[i] for i in members], self.made.qd
        W, loose = mobility(self.eq, G)
        here, free = (float(self.numbers(x)[0, 0]) for x in (W, loose))
        if not here > IMMOVABLE * free:
            what = "one that needs only v and N, because constraints prescribe the sliding"
            raise self.refuse(contacts, what, "start elsewhere if this is a dead centre")
        modes = {bool(some_switches(c.law)) for c in contacts}
        if len(modes) > 1:
            what = "laws in one loop that all stick by modes, or none"
            raise self.refuse(contacts, what, "use one form")
        by_modes, single = modes == {True}, columns == ()
        start = float(self.numbers(change)[0, 0]) / here
        still = {contacts[0].rate} if single else {rates[k].name for k in columns}
        direction: Variables = ()
        if by_modes and not single:
            begin = ca.SX(smooth.sign(rate, 0.0))
            doc = "direction of the motion of the loop, 0 in stick"
            direction = (Variable(f"{name}_direction", "1", start=begin, doc=doc, kind=kinds.MODE),)
        unit = contacts[0].unit("N") if single else ""
        doc = f"friction force of {name} for zero sliding acceleration"
        nominal = max(1.0, abs(start))
        force = Variable(f"{name}_{FORCE}", unit, start=start, nominal=nominal, doc=doc)
        return Rest(
            name, tuple(members), tuple(along), rate, change, force,
            ca.SX(1 / here) if by_modes else 1 / W[0], by_modes, direction,
            tuple(v.name for v in rates if v.name in still),
        )  # fmt: skip

    def single(self, i: int) -> Rest:
        """Return the group of a single contact."""
        eq, contact = self.eq, self.eq.contacts[i]
        slip, G = contact.slip, ca.jacobian(contact.slip, eq.qd)
        change = ca.jtimes(slip, eq.q, eq.qd) + ca.jtimes(slip, eq.qd, eq.a)
        change += ca.jacobian(slip, eq.kin.t)
        return self.group(contact.name, [i], [ca.SX(1)], slip, change, G, ())

    def loop(self, columns: list[int], rows: list[int], members: Sequence[int]) -> Rest:
        """Return the group of all contacts of a loop of one degree of freedom."""
        eq, contacts = self.eq, [self.eq.contacts[i] for i in members]
        if rows and ca.depends_on(eq.phi[rows, 0], eq.kin.t):
            what = "one that needs only v and N in a loop that moves with time"
            raise self.refuse(contacts, what, "use a smooth law")
        if len(columns) > MINORS:
            what = f"a loop of at most {MINORS} coordinates"
            raise self.refuse(contacts, what, "build joint coordinates")
        if {s.name for c in contacts for s in some_switches(c.law)} - {"stick", "slip"}:
            what = "one that stops only at v = 0 in a loop"
            raise self.refuse(contacts, what, "use ExactCoulomb")
        Z = tangent_of(eq.Phi_q, columns, rows)
        along = [ca.jacobian(c.slip, eq.qd) @ Z for c in contacts]
        name = f"{contacts[0].name}_loop"
        return self.group(name, members, along, ca.dot(Z, eq.qd), ca.dot(Z, eq.a), Z.T, columns)


def rests(where: str, made: PreparedMechanism, a0: Array) -> tuple[Rest, ...]:
    """Return the groups of contacts whose laws need F_e.

    Raises:
        ValueError: constraints hold a contact, or the forces of sticking contacts are undetermined.
    """
    eq = made.eq
    applied = {i: ca.jacobian(c.slip, eq.qd) for i, c in enumerate(eq.contacts) if c.law.inputs}
    if not applied:
        return ()
    make = _Maker(where, made, a0)
    paths, alone, together = paths_of(eq.Phi_q), list[int](), dict[int, list[int]]()
    for i, slopes in applied.items():
        moves = set(slopes.sparsity().get_col())
        touched = [k for k, (columns, _) in enumerate(paths) if moves & {*columns}]
        columns, rows = paths[touched[0]] if len(touched) == 1 else ((), ())
        if moves <= {*columns} and len(columns) == len(rows) + 1:
            together.setdefault(touched[0], []).append(i)
        else:
            alone.append(i)
    outside = {k: members for k, members in together.items() if not paths[k][1]}
    alone += [together.pop(k)[0] for k, members in outside.items() if len(members) == 1]
    found = [make.loop(*paths[k], members) for k, members in together.items()]
    found += [make.single(i) for i in alone]
    held = [*alone, *(members[0] for members in outside.values() if len(members) > 1)]
    rows = ca.vertcat(eq.Phi_q, *(applied[i] for i in held))
    if alone and np.linalg.matrix_rank(make.numbers(rows)) < rows.size1():
        raise make.refuse(
            [eq.contacts[i] for i in held],
            "no more of them in a loop than it has degrees of freedom"
            if eq.m
            else "no more of them between joints than independent sliding velocities",
            "the distribution of their forces is undetermined; use smooth laws in the others",
        )
    return tuple(sorted(found, key=lambda rest: rest.members))
