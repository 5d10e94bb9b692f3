"""Whether a contact breaks away: the force that would hold it, against its static level.

A contact at rest stays there as long as the force this takes is below its static level, and slips
from the instant at which that level is reached. Whether it leaves rest is thus a question to the
control *behind* that instant, which may be another one than before it, and has to be asked in the
mode of slipping, where nothing holds the contact. The answer is a part of the algebraic unknowns
of the model in which it rests,

    0 = alg(x, z, u),    with 0 = d slip / dt among its rows and the force among z,

found by Newton's method from the values of slipping: in one step where the equations are affine in
z, as without normal forces that follow from reactions.
"""

from collections.abc import Mapping

import casadi as ca

from ocp.friction.mode_models import jumps, mode_model
from symfric.model import Contact, Model

NEWTON_STEPS = 2
"""A normal force is the smoothed absolute value of reactions, affine but near zero."""


def rubbing(model: Model) -> tuple[Contact, ...]:
    """The contacts that can rest: friction that is zero at v = 0 has no modes."""
    return tuple(contact for contact in model.contacts if jumps(model, contact))


def excess(model: Model, modes: Mapping[str, int], contact: str) -> ca.SX:
    """By how much [N] the force that would hold `contact` at rest exceeds its static level.

    Args:
        model: the model with contacts.
        modes: +1, 0 or -1 of each contact; `contact` slips, and the pull is to its side.
        contact: name of the one in question.

    Returns:
        SX (1, 1) in the symbols of the mode model of `modes`: negative where friction can hold.
    """
    moving, held = mode_model(model, modes), mode_model(model, {**modes, contact: 0})
    symbols = [held.t, *(held.vector(letter) for letter in "xzup")]
    z = symbols[2]
    newton = z - ca.solve(ca.densify(ca.jacobian(held.alg, z)), held.alg)
    step = ca.Function("step", symbols, [newton])
    side = "up" if modes[contact] > 0 else "down"
    grip = held.expression(f"{contact}_grip_{side}")
    room = ca.Function("room", symbols, [grip])
    t, x, u, p = moving.t, *(moving.vector(letter) for letter in "xup")
    known = {v.name for v in moving.z}
    found = ca.vertcat(*(v.symbol if v.name in known else ca.SX(0) for v in held.z))
    for _ in range(NEWTON_STEPS):
        found = step(t, x, found, u, p)
    return -ca.SX(room(t, x, found, u, p))
