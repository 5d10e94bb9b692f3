"""Mass under PID control with friction."""

import casadi as ca

from symfric import Law, Model, Variable, contact


def hunting(
    law: Law, k_d: float | Variable, k_i: float, k_p: float = 60.0, *, target: float = 0.0
) -> Model:
    """Mass of 1 kg that starts 5 cm above a target of 0, or at 0 below another target."""
    start = 0.0 if target else 0.05
    x, v, e = Variable("x", "m", start=start), Variable("v", "m/s"), Variable("e", "m s")
    pull = -k_p * (x - target) - k_d * v - k_i * e
    guide = contact("guide", law, v.symbol, 9.81, {"v": 0.0}, F_e=pull)
    rates = ca.vertcat(v.symbol, pull - guide.force, x.symbol - target)
    p = (k_d,) if isinstance(k_d, Variable) else ()
    return Model("hunting", x=(x, v, e), p=p, ode=rates, contacts=(guide,))
