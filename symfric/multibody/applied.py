"""The force that a contact would have to carry for no sliding acceleration.

Laws with true rest ask for it. In a mechanism it follows from the equations of motion with their
constraints,

    F_e = F + ds/dt / W,   W = G P G'     (see `symfric.multibody.mass`)

for the sliding velocity s and the friction force F: with F_e instead of F, and all other friction
forces as they are, s would not change. It is an algebraic unknown F_e of its own. A contact at
rest carries it, F = F_e, so that the equation says ds/dt = 0 whatever W is; contacts that rest
together share what holds them by their equations together.

A law by modes slides without asking for F_e; what it needs is the sign of |F_e| - mu_s N at rest.
For it W is a constant, that of the start, and costs nothing.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import final

import casadi as ca

from symfric.foundation.parameters import Variable
from symfric.foundation.symbols import at_start, starts_of, symbols_of
from symfric.laws.base.law import Switch
from symfric.model import Variables
from symfric.multibody.equations import Equations
from symfric.multibody.friction import Contact
from symfric.multibody.mass import mobility

IMMOVABLE = 1e-10
"""Share of W that constraints leave of what it is without them, below which they hold a contact."""


@final
@dataclass(frozen=True, eq=False)
class Carried:
    """What the law of a contact gets besides v and N.

    Attributes:
        contact: where.
        unknown: F_e as algebraic variable, where the law asks for it.
        inputs: by name.
        change: sliding acceleration ds/dt.
    """

    contact: Contact
    unknown: Variables
    inputs: dict[str, ca.SX]
    change: ca.SX

    def needed(self, force: ca.SX, inertia: ca.SX) -> ca.SX:
        """What is zero at the right F_e, shape (1, 1); no rows where nobody asks."""
        if not self.unknown:
            return ca.SX(0, 1)
        return force + inertia * self.change - self.unknown[0].symbol

    @property
    def by_modes(self) -> bool:
        """Whether its law rests by a mode."""
        one = ca.SX(1.0)
        z = ca.SX.ones(len(self.contact.law.states))
        return bool(self.contact.law.switches(one, one, z, **dict.fromkeys(self.inputs, one)))

    def by_rates(self, eq: Equations) -> ca.SX:
        """Derivatives G of the sliding velocity by the rates, shape (1, n)."""
        return ca.jacobian(self.contact.slip, eq.qd)

    def switches(self, N: ca.SX, z: ca.SX) -> tuple[Switch, ...]:
        """Mode changes of the law.

        What stops, rests first: whether it can is only known once the equations of rest are solved.
        """
        law, slip = self.contact.law, self.contact.slip
        found = law.switches(slip, N, z, **self.inputs)
        if not self.inputs:
            return found
        idle = law.switches(slip, N, z, **{name: ca.SX(0.0) for name in self.inputs})
        return tuple(
            replace(s, reset=other.reset) if s.halts else s
            for s, other in zip(found, idle, strict=True)
        )


def carried(eq: Equations, contact: Contact) -> Carried:
    """What the law of `contact` asks for, in terms of the accelerations of `eq`."""
    slip, asked = contact.slip, [i.name for i in contact.law.inputs]
    if not asked:
        return Carried(contact, (), {}, ca.SX(0, 1))
    change = ca.jtimes(slip, eq.q, eq.qd) + ca.jtimes(slip, eq.qd, eq.a)
    change += ca.jacobian(slip, eq.kin.t)
    unknown: Variables = ()
    if "F_e" in asked:
        doc = f"friction force of no sliding acceleration in joint '{contact.joint}'"
        unknown = (Variable(f"{contact.name}_F_e", contact.unit("N"), doc=doc),)
    known = (change, *(v.symbol for v in unknown))
    every: dict[str, ca.SX] = dict(zip(("dv", "F_e"), known, strict=False))
    return Carried(contact, unknown, {name: every[name] for name in asked}, change)


def inertias(
    where: str, eq: Equations, contacts: Sequence[Carried], q: Variables, p: Variables
) -> list[ca.SX]:
    """1 / W [kg] of each contact; zero where nobody asks.

    Args:
        where: for messages.
        eq: the equations of motion.
        contacts: all of them.
        q, p: coordinates and parameters, at whose start values laws by modes take it.

    Raises:
        ValueError: constraints hold a contact, whatever friction does.
    """
    asking = [c for c in contacts if c.unknown]
    found = dict[str, ca.SX]()
    if asking:
        for c in asking:
            if (c.by_rates(eq) @ eq.Phi_q.T).nnz():
                raise ValueError(
                    f"{where} > joint '{c.contact.joint}' > friction > law: expected one that "
                    f"needs v and N alone in a loop, got {type(c.contact.friction.law).__name__}"
                )
        W, loose = mobility(eq, ca.vertcat(*(c.by_rates(eq) for c in asking)))
        at_first = ca.substitute(ca.horzcat(W, loose), ca.vertcat(symbols_of(q), eq.kin.t),
                                 ca.vertcat(starts_of(q), 0.0))  # fmt: skip
        values = at_start(at_first, p).full()
        for k, c in enumerate(asking):
            if not values[k, 0] > IMMOVABLE * values[k, 1]:
                raise ValueError(
                    f"{where} > joint '{c.contact.joint}' > friction > law: expected one that "
                    "needs v and N alone where constraints prescribe the sliding, got "
                    f"{type(c.contact.friction.law).__name__}, which asks for the force of rest; "
                    "start elsewhere if this is a dead centre"
                )
            found[c.contact.name] = ca.SX(1 / values[k, 0]) if c.by_modes else 1 / W[k]
    return [found.get(c.contact.name, ca.SX(0.0)) for c in contacts]
