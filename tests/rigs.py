"""Small machines that the tests drive laws with."""

from collections.abc import Callable

import casadi as ca

from symfric import Law, Model, Output, Variable
from symfric.scenes import friction_states


def prescribed_motion(law: Law, N: float, velocity: Callable[[ca.SX], ca.SX]) -> Model:
    """`law` slid with the given velocity of time from unloaded bristles: path, work, friction."""
    path = Variable("path", "m", nominal=1e-5)
    work = Variable("work", "J", nominal=1e-5)
    bristles, z = friction_states(law, 0.0, N)
    t = ca.SX.sym("t")
    v = velocity(t)
    F = law.force(v, N, z)
    return Model(
        "rig",
        x=(path, work, *bristles),
        ode=ca.vertcat(v, F * v, law.rate(v, N, z)),
        outputs={"friction": Output(F, "N"), "v": Output(v, "m/s")},
        t=t,
    )
