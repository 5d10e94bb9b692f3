"""Small machines that the tests drive laws with."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import pairwise

import casadi as ca

from symfric import Contact, Law, Model, Output, Variable
from symfric.scenes.base import contact

SCALE = Variable("scale", "1", start=1.0)
"""Factor of the velocity of a prescribed motion."""


def prescribed_motion(law: Law, N: float, velocity: Callable[[ca.SX], ca.SX]) -> Model:
    """`law`, unloaded at first, slid with `SCALE` times a velocity of time."""
    path = Variable("path", "m", nominal=1e-5)
    work = Variable("work", "J", nominal=1e-5)
    t = ca.SX.sym("t")
    v = SCALE.symbol * velocity(t)
    slip = contact("slide", law, v, N, rest={})
    rest = law.steady_state(0.0, N)
    states = tuple(replace(s, start=float(rest[i])) for i, s in enumerate(slip.states))
    return Model(
        "rig",
        x=(path, work, *states),
        p=(SCALE,),
        ode=ca.vertcat(v, slip.friction * v, slip.rate),
        events=slip.events(),
        outputs={"friction": Output(slip.friction, "N"), "v": Output(v, "m/s")},
        t=t,
    )


def through(points: Sequence[float], leg: float) -> Callable[[ca.SX], ca.SX]:
    """Velocity of a motion through `points`, at rest in each, `leg` seconds between them."""

    def velocity(t: ca.SX) -> ca.SX:
        v = ca.SX(0)
        for i, (a, b) in enumerate(pairwise(points)):
            half_sine = (b - a) * ca.pi / (2 * leg) * ca.sin(ca.pi * (t / leg - i))
            v = ca.if_else(ca.logic_and(t >= i * leg, t < (i + 1) * leg), half_sine, v)
        return v

    return velocity


def blocks(law: Law) -> Model:
    """Two blocks on the ground behind each other, coupled by a spring, the first one pushed."""
    names = ("x1", "x2", "v1", "v2")
    x1, x2, v1, v2 = (Variable(n, "m" if n[0] == "x" else "m/s") for n in names)
    force = Variable("force", "N")
    K = 50.0 * (x1.symbol - x2.symbol)
    one = Contact("one", v1.symbol, 20.0, law, given={"F_e": force.symbol - K}, rest={"v1": 0.0})
    two = Contact("two", v2.symbol, 10.0, law, given={"F_e": K}, rest={"v2": 0.0})
    return Model(
        "blocks",
        x=(x1, x2, v1, v2),
        u=(force,),
        ode=ca.vertcat(
            v1.symbol, v2.symbol, (force.symbol - K - one.force) / 2.0, K - two.force
        ),
        contacts=(one, two),
    )  # fmt: skip
