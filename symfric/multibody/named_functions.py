"""Equations of a mechanism as named CasADi Functions."""

import casadi as ca

from symfric.foundation.variable import stacked, starts_of, symbols_of
from symfric.model import Variables
from symfric.multibody.contact import places_of
from symfric.multibody.mechanism import Mechanism
from symfric.multibody.slips import slips
from symfric.multibody.spatial import GROUND


def functions(
    mechanism: Mechanism, p: Variables = (), formulation: str = "joint"
) -> dict[str, ca.Function]:
    """Return Functions of coordinates q, rates qd, accelerations a, inputs u and parameters p.

    Functions that depend on time, through prescribed motion or forces, have a last argument t.

    Args:
        mechanism: the mechanism.
        p: parameters, as for `Mechanism.build`.
        formulation: "joint" or "absolute".

    Returns:
        mass: (q, p) -> M, shape (n, n).
        bias: (q, qd, u, p) -> Coriolis forces minus applied forces, without friction: the negative
            of M a + phi_q' lam.
        constraints: (q, p) -> phi, shape (m, 1), and its Jacobian phi_q.
        inverse_dynamics: (q, qd, a, lam, z, u, p) -> the additional generalised forces required for
            the accelerations a, including friction, whose normal forces are explicit in a and lam.
            z are the internal states of the laws.
        energy: (q, qd, p) -> kinetic and potential energy [J].
        poses: (q, p) -> [R_WB, p_WB] of every body, concatenated to shape (3, 4 bodies).

    Raises:
        ValueError: as `Mechanism.build`.

    Limits: q does not contain the number of full turns of a joint that closes a loop; springs about
    the axis of such a joint are evaluated at the equivalent angle that is nearest to the start.
    """
    eq = mechanism.prepare(p, formulation).eq
    where = f"mechanism '{mechanism.name}'"
    if applied := [c for c in eq.contacts if c.law.inputs]:
        law = type(applied[0].friction.law).__name__
        raise ValueError(
            f"{where} > {applied[0].law_place}: expected one that needs only v and N, got {law}, "
            "whose force in stick depends on the motion; use `build`"
        )
    contacts = slips(eq, [1.0] * len(eq.contacts))
    forces = stacked(c.force for c in contacts)
    for c in contacts:
        if c.N is not c.normal:
            normal = c.contact.explicit_normal(c.normal, c.force, c.N)
            forces = ca.substitute(forces, c.N, normal)
    if ca.depends_on(forces, eq.F):
        names = places_of(c.contact for c in contacts if ca.depends_on(c.normal, eq.F))
        raise ValueError(
            f"{where} > {names} > friction: expected a normal force that does not depend on "
            "friction; use `build` for a model, or a constant normal force"
        )
    still = [ca.SX.zeros(x.numel()) for x in (eq.a, eq.lam, eq.F)]
    (bias,) = ca.substitute([eq.balance], [eq.a, eq.lam, eq.F], still)
    bodies = [m for name, m in eq.kin.motion.items() if name != GROUND]
    poses = ca.horzcat(ca.SX(3, 0), *(ca.horzcat(m.R, m.p) for m in bodies))
    u, parameters = (symbols_of(group) for group in (mechanism.inputs, p))
    every = {
        "q": eq.q, "qd": eq.qd, "a": eq.a, "lam": eq.lam,
        "z": symbols_of(v for c in contacts for v in c.states), "u": u, "p": parameters,
        "t": eq.kin.t,
    }  # fmt: skip
    turned = ca.densify(starts_of(turn.angle for turn in eq.turns))

    def function(name: str, arguments: str, **results: ca.SX) -> ca.Function:
        expressions = [ca.densify(result) for result in results.values()]
        expressions = ca.substitute(expressions, [eq.angles], [turned])
        named = arguments.split()
        if ca.depends_on(ca.veccat(*expressions), eq.kin.t):
            named.append("t")
        symbols = [every[argument] for argument in named]
        return ca.Function(name, symbols, expressions, named, list(results), {"cse": True})

    moved = ca.substitute(eq.balance, eq.F, forces)
    made = (
        function("mass", "q p", M=eq.mass),
        function("bias", "q qd u p", bias=bias),
        function("constraints", "q p", phi=eq.phi, phi_q=eq.Phi_q),
        function("inverse_dynamics", "q qd a lam z u p", missing=moved),
        function("energy", "q qd p", kinetic=eq.kinetic, potential=eq.potential),
        function("poses", "q p", poses=poses),
    )
    return {each.name(): each for each in made}
