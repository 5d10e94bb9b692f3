"""The force that a contact would have to carry for no sliding acceleration.

Laws with true rest ask for it. In a mechanism it follows from the equations of motion with their
constraints,

    F_e = F + ds/dt / W,   W = G P G'     (see below)

for the sliding velocity s and the friction force F: with F_e instead of F, and all other friction
forces as they are, s would not change. It is an algebraic unknown F_e of its own. A contact at
rest carries it, F = F_e, so that the equation says ds/dt = 0 whatever W is; contacts that rest
independently of each other share what holds them by their equations together.

In a loop of one degree of freedom all contacts rest together: s_i = g_i(q) omega, with omega the
speed along the tangent of its constraints. No equation tells how they share the force that holds
the loop, T = sum g_i F_i. They hold it as long as they can, and that is with equal shares of what
each can hold at most,

    F_i = sign(g_i) S_i T / sum |g_k| S_k,   |T| <= sum |g_k| S_k,   S_i = mu_s N_i

A contact whose g_i passes through zero (a slider in its dead centre) turns and does not stop.
Laws without modes get g_i in place of sign(g_i), which does not jump there: the contact that moves
most carries most.

A law by modes slides without asking for F_e; what it needs is the sign of |F_e| - mu_s N at rest.
For it W is a constant, that of the start, and costs nothing, and F_e is that of rest only at rest.
Limits: a loop of several degrees of freedom takes as many such contacts as are independent; a loop
of one has no constraint that moves with time.

Accelerations under forces, and how easily a contact is moved:

    M^-1 right,   W_i = G_i P G_i',   P = M^-1 - M^-1 phi_q' (phi_q M^-1 phi_q')^-1 phi_q M^-1

G_i is the row of sliding velocities s_i = G_i q' + ..., W_i the sliding acceleration that a unit
friction force takes away while all other forces stay.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import chain
from typing import final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.foundation.graph import coupled
from symfric.foundation.parameters import Variable
from symfric.foundation.variable import at_start, starts_of, symbols_of
from symfric.laws import Law
from symfric.laws.base import smooth
from symfric.laws.base.law import FORCE, Switch
from symfric.laws.composed.isotropic import SpatialSlip
from symfric.model import Variables, kinds
from symfric.multibody.equations import Equations
from symfric.multibody.joint import Contact
from symfric.multibody.joints import Floating
from symfric.multibody.spatial import GROUND, euler_e


def mirrored(M: ca.SX) -> ca.SX:
    """A symmetric matrix from one that is symmetric in value, but not in its zeros.

    What cancels on one side of the diagonal by itself may stand as 0 x there on the other.
    """
    if M.sparsity().is_symmetric():
        return M
    upper = ca.project(M, M.sparsity() * M.T.sparsity())
    return ca.triu2symm(ca.triu(upper))


def solve_mass(eq: Equations, right: ca.SX) -> ca.SX:
    """M^-1 times the columns of `right`, by blocks where bodies float freely."""
    topology = eq.kin.topology
    if not _free(eq):
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


def _free(eq: Equations) -> bool:
    """Return True if all bodies hang freely on the ground."""
    links = eq.kin.topology.links
    return bool(links) and all(isinstance(x.joint, Floating) and x.base == GROUND for x in links)


def mobility(eq: Equations, G: ca.SX) -> tuple[ca.SX, ca.SX]:
    """W of each row of `G`, and what it would be without the constraints, shape (k, 1) each."""
    J, k = eq.Phi_q, G.size1()
    right = ca.densify(ca.vertcat(G, J).T)
    columns = ca.horzsplit(right) if _free(eq) else [right]
    moved = ca.horzcat(*(solve_mass(eq, column) for column in columns))
    loose = ca.sum2(G * moved[:, :k].T)
    if not eq.m:
        return loose, loose
    across, S = J @ moved[:, :k], J @ moved[:, k:]
    D, L, order = ca.ldl(mirrored(S))
    held = ca.ldl_solve(ca.densify(across), D, L, order)
    return loose - ca.sum1(across * held).T, loose


def null_direction(J: ca.SX) -> ca.SX:
    """The unit vector Z with J Z = 0 of a matrix (n - 1, n), of its minors: smooth at full rank."""
    n = J.size2()
    minors = [ca.det(ca.densify(J[:, [j for j in range(n) if j != k]])) for k in range(n)]
    Z = ca.vertcat(*((-1) ** k * minor for k, minor in enumerate(minors)))
    return Z / ca.sqrt(ca.sumsqr(Z))


Array = NDArray[np.float64]
IMMOVABLE = 1e-10
"""Share of W that constraints leave of what it is without them, below which they hold a contact."""
MINORS = 8
"""Coordinates of a loop of one degree of freedom at most; its tangent is made of their minors."""
UNLOADED = 1e-12
"""Force [N] that keeps shares finite where nothing presses; at break-away it must not show."""
CALM = 0.1
"""Time [s] in which a rest forgets a sliding velocity that rounding has left in it, so that none
drifts; to laws by modes F_e matters at rest alone."""


@final
@dataclass(frozen=True, eq=False)
class Rest:
    """Contacts that come to rest together, and the force that then holds them.

    Attributes:
        name: of the contact, or of the loop.
        members: numbers of the contacts.
        along: g_i = s_i / omega of each.
        rate: omega; the sliding velocity of a contact by itself.
        change: its rate of change, at rest at least.
        force: F_e or T, an algebraic variable.
        inertia: 1 / W of omega.
        by_modes: whether its laws rest by a mode.
        direction: of a loop by modes, the sign of omega, 0 at rest.
        still: names of the joint rates that are zero at rest.
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
        """F_e of each member, of which `levels` [N] are what they can hold."""
        if not self.is_loop:
            return [self.force.symbol]
        above = [S + UNLOADED for S in levels]
        signs = [forward(g) if self.by_modes else g for g in self.along]
        weights = [sign * S for sign, S in zip(signs, above, strict=True)]
        total = sum((g * w for g, w in zip(self.along, weights, strict=True)), start=ca.SX(0))
        return [w / total * self.force.symbol for w in weights]

    def capacity(self, levels: Sequence[ca.SX]) -> ca.SX:
        """The largest force along omega that `levels` hold."""
        pairs = zip(self.along, levels, strict=True)
        return sum((smooth.magnitude(g, 0.0) * S for g, S in pairs), start=ca.SX(0))

    @property
    def is_loop(self) -> bool:
        """Return True if its members move together along the tangent of constraints."""
        return not self.along[0].is_one()

    def needed(self, forces: Sequence[ca.SX]) -> ca.SX:
        """What is zero at the right force, shape (1, 1)."""
        held = sum((g * F for g, F in zip(self.along, forces, strict=True)), start=ca.SX(0))
        change = self.change + self.rate / CALM if self.by_modes else self.change
        return held + self.inertia * change - self.force.symbol


def forward(x: ca.SX) -> ca.SX:
    """1 where x >= 0, else -1."""
    return ca.SX(smooth.choose(x < 0, -1.0, 1.0))


def sliding_change(eq: Equations, slip: ca.SX) -> ca.SX:
    """Rate of change of a sliding velocity, in the accelerations of `eq`."""
    change = ca.jtimes(slip, eq.q, eq.qd) + ca.jtimes(slip, eq.qd, eq.a)
    return change + ca.jacobian(slip, eq.kin.t)


def switches_at(
    law: Law | SpatialSlip, v: ca.SX, N: ca.SX, z: ca.SX, F_e: ca.SX
) -> tuple[Switch, ...]:
    """Changes of mode of a law that may ask for F_e."""
    return law.switches(v, N, z, **({FORCE: F_e} if law.inputs else {}))


def some_switches(law: Law | SpatialSlip) -> tuple[Switch, ...]:
    """The changes of mode of a law, in no matter what numbers."""
    one = ca.SX(1.0)
    return switches_at(law, one, one, ca.SX.ones(len(law.states)), one)


def capacity_of(law: Law | SpatialSlip, N: ca.SX) -> ca.SX:
    """What a contact can hold [N] for its share in a loop; what presses it where no mode tells."""
    if isinstance(law, SpatialSlip) or not some_switches(law):
        return N
    return ca.SX(law.static_level(N))


@final
@dataclass(frozen=True, eq=False)
class Loop:
    """Coordinates that constraints couple: their numbers, and those of the constraints."""

    columns: tuple[int, ...]
    rows: tuple[int, ...]

    @property
    def freedom(self) -> int:
        """Degrees of freedom."""
        return len(self.columns) - len(self.rows)


def loops_of(eq: Equations) -> list[Loop]:
    """Coordinates in groups that no constraint couples to each other; those that some couples."""
    pattern = ca.DM(eq.Phi_q.sparsity(), 1).full() != 0
    return [Loop(tuple(columns), tuple(rows)) for columns, rows in coupled(pattern)]


@final
class _Maker:
    """Makes the groups of contacts that rest together, of one mechanism at its start."""

    def __init__(
        self, where: str, eq: Equations, start: tuple[Variables, Variables, Array], p: Variables
    ) -> None:
        self.where, self.eq = where, eq
        self.q, self.qd, self.a0 = start
        self.p = p

    def numbers(self, expression: ca.SX) -> Array:
        """An expression at the start, without friction."""
        symbols = ca.vertcat(symbols_of(self.q), symbols_of(self.qd), self.eq.a, self.eq.kin.t)
        values = ca.vertcat(starts_of(self.q), starts_of(self.qd), ca.SX(self.a0), 0.0)
        return at_start(ca.substitute(ca.SX(expression), symbols, values), self.p).full()

    def refuse(self, contacts: Sequence[Contact], expected: str, advice: str) -> ValueError:
        """The error for contacts whose laws cannot rest here."""
        law = type(contacts[0].friction.law).__name__
        joints = ", ".join(dict.fromkeys(f"'{c.joint}'" for c in contacts))
        return ValueError(
            f"{self.where} > joint {joints} > friction > law: expected {expected}, got {law}, "
            f"which asks for the force of rest; {advice}"
        )

    def made(
        self, name: str, members: Sequence[int], along: Sequence[ca.SX], rate: ca.SX,
        change: ca.SX, G: ca.SX, columns: Sequence[int],
    ) -> Rest:  # fmt: skip
        """One group; `G` are the derivatives of its rate by the joint rates."""
        contacts = [self.eq.contacts[i] for i in members]
        W, loose = mobility(self.eq, G)
        here, free = (float(self.numbers(x)[0, 0]) for x in (W, loose))
        if not here > IMMOVABLE * free:
            raise self.refuse(
                contacts,
                "one that needs v and N alone where constraints prescribe the sliding",
                "start elsewhere if this is a dead centre",
            )
        modes = {bool(some_switches(c.law)) for c in contacts}
        if len(modes) > 1:
            raise self.refuse(
                contacts, "laws that all rest by modes, or none, in one loop", "give all one form"
            )
        by_modes, single = modes == {True}, columns == ()
        start = float(self.numbers(change)[0, 0]) / here
        own = {f"{contacts[0].name}_rate"} if single else {self.qd[k].name for k in columns}
        direction: Variables = ()
        if by_modes and not single:
            begin = ca.SX(smooth.sign(rate, 0.0))
            doc = "sense in which the loop moves, 0 at rest"
            variable = Variable(f"{name}_direction", "1", start=begin, doc=doc, kind=kinds.MODE)
            direction = (variable,)
        unit = contacts[0].unit("N") if single else ""
        doc = f"friction force of no sliding acceleration of {name}"
        force = Variable(
            f"{name}_{FORCE}", unit, start=start, nominal=max(1.0, abs(start)), doc=doc
        )
        return Rest(
            name, tuple(members), tuple(along), rate, change, force,
            ca.SX(1 / here) if by_modes else 1 / W[0], by_modes, direction,
            tuple(v.name for v in self.qd if v.name in own),
        )  # fmt: skip

    def single(self, i: int) -> Rest:
        """A contact by itself."""
        contact = self.eq.contacts[i]
        change = sliding_change(self.eq, contact.slip)
        G = ca.jacobian(contact.slip, self.eq.qd)
        return self.made(contact.name, [i], [ca.SX(1)], contact.slip, change, G, ())

    def loop(self, loop: Loop, members: Sequence[int]) -> Rest:
        """All contacts of a loop of one degree of freedom."""
        eq, columns = self.eq, list(loop.columns)
        contacts = [eq.contacts[i] for i in members]
        J = eq.Phi_q[list(loop.rows), columns]
        if ca.depends_on(eq.phi[list(loop.rows), 0], eq.kin.t):
            raise self.refuse(
                contacts, "one that needs v and N alone in a loop that moves with time",
                "a smooth law goes on",
            )  # fmt: skip
        if len(columns) > MINORS:
            raise self.refuse(
                contacts, f"a loop of at most {MINORS} coordinates", "build joint coordinates"
            )
        if {s.name for c in contacts for s in some_switches(c.law)} - {"stick", "slip"}:
            raise self.refuse(
                contacts, "one that stops at v = 0 alone in a loop", "ExactCoulomb does"
            )
        Z = ca.SX(eq.n, 1)
        Z[columns] = null_direction(J)
        along = [ca.jacobian(c.slip, eq.qd) @ Z for c in contacts]
        name = f"{contacts[0].name}_loop"
        return self.made(name, members, along, ca.dot(Z, eq.qd), ca.dot(Z, eq.a), Z.T, loop.columns)


def rests(
    where: str, eq: Equations, start: tuple[Variables, Variables, Array], p: Variables
) -> tuple[Rest, ...]:
    """Contacts whose laws ask for F_e, in groups that rest together.

    Args:
        where: for messages.
        eq: the equations of motion.
        start: coordinates, rates, and the accelerations without friction at the start.
        p: parameters.

    Raises:
        ValueError: constraints hold a contact, or leave open what contacts at rest carry.
    """
    asking = [i for i, c in enumerate(eq.contacts) if c.law.inputs]
    if not asking:
        return ()
    make, found = _Maker(where, eq, start, p), list[Rest]()
    alone, of_loop = list[int](), dict[int, list[int]]()
    loops = loops_of(eq)
    for i in asking:
        moves = set(ca.jacobian(eq.contacts[i].slip, eq.qd).sparsity().get_col())
        touched = [k for k, loop in enumerate(loops) if moves & {*loop.columns}]
        inside = len(touched) == 1 and moves <= {*loops[touched[0]].columns}
        if inside and loops[touched[0]].freedom == 1:
            of_loop.setdefault(touched[0], []).append(i)
        else:
            alone.append(i)
    found += [make.loop(loops[k], members) for k, members in of_loop.items()]
    found += [make.single(i) for i in alone]
    rows = ca.vertcat(eq.Phi_q, *(ca.jacobian(eq.contacts[i].slip, eq.qd) for i in alone))
    if eq.m and alone and np.linalg.matrix_rank(make.numbers(ca.densify(rows))) < rows.size1():
        raise make.refuse(
            [eq.contacts[i] for i in alone],
            "no more of them in a loop than it has degrees of freedom",
            "how they share what they hold is open; a smooth law in the others goes on",
        )
    return tuple(sorted(found, key=lambda rest: rest.members))


def applied_forces(groups: Sequence[Rest], levels: Sequence[ca.SX]) -> dict[int, ca.SX]:
    """Number of a contact -> its F_e, given what every contact can hold [N]."""
    pairs = (
        zip(
            rest.members,
            rest.shares([levels[i] for i in rest.members]),
            strict=True,
        )
        for rest in groups
    )
    return dict(chain.from_iterable(pairs))
