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

SIDES = {1: "up", -1: "down"}
"""Outputs of mode models: room of a contact at rest to both sides, "<contact>_grip_<side>"."""

NEWTON_STEPS = 2
"""A normal force is the smoothed absolute value of reactions, affine but near zero."""


def rubbing(model: Model) -> tuple[Contact, ...]:
    """The contacts that can rest: friction that is zero at v = 0 has no modes."""
    return tuple(contact for contact in model.contacts if jumps(model, contact))


def holding(model: Model, modes: Mapping[str, int], contact: str) -> tuple[ca.SX, dict[int, ca.SX]]:
    """The force [N] that holds `contact` at rest, or would, and what the static level leaves of it.

    Args:
        model: the model with contacts.
        modes: +1, 0 or -1 of each contact; `contact` may slip or rest.
        contact: name of the one in question.

    Returns:
        The force, and side -> room to that side, negative where friction cannot hold; SX (1, 1) in
        the symbols of the mode model of `modes`. They do not depend on algebraic variables where
        the equations are affine in these: at the start of an interval they are what states and
        inputs there ask for.
    """
    moving, held = mode_model(model, modes), mode_model(model, {**modes, contact: 0})
    symbols = [held.t, *(held.vector(letter) for letter in "xzup")]
    z = symbols[2]
    newton = z - ca.solve(ca.densify(ca.jacobian(held.alg, z)), held.alg)
    step = ca.Function("step", symbols, [newton])
    names = [f"{contact}_reaction", *(f"{contact}_grip_{side}" for side in SIDES.values())]
    asked = ca.Function("asked", symbols, [held.expression(name) for name in names])
    t, x, u, p = moving.t, *(moving.vector(letter) for letter in "xup")
    known = {v.name: v.symbol for v in moving.z}  # each mode model has its own reactions
    found = ca.vertcat(*(known.get(v.name, ca.SX(0)) for v in held.z))
    for _ in range(NEWTON_STEPS):
        found = step(t, x, found, u, p)
    force, *rooms = (ca.SX(value) for value in asked.call([t, x, found, u, p]))
    return force, dict(zip(SIDES, rooms, strict=True))


def excess(model: Model, modes: Mapping[str, int], contact: str, side: int) -> ca.SX:
    """By how much [N] the force that would hold `contact` exceeds its static level to a side."""
    return -holding(model, modes, contact)[1][side]
