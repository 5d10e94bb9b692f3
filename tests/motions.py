"""Small optimal control problems whose answer is known on paper."""

from math import inf

import casadi as ca

from symfric import BrownMcPhee, Model, Output, Variable, drive


def double_integrator(a_max: float = inf) -> Model:
    """x'' = a with |a| <= a_max; output power a v."""
    x = Variable("x", "m")
    v = Variable("v", "m/s")
    a = Variable("a", "m/s^2", lower=-a_max, upper=a_max)
    return Model(
        "double integrator",
        x=(x, v),
        u=(a,),
        ode=ca.vertcat(v.symbol, a.symbol),
        outputs={"power": Output(a.symbol * v.symbol, "W")},
    )


def stage(v_t: float = 1e-3, mu_s: float = 6.0, **more: object) -> Model:
    """1 kg with Brown-McPhee friction: 4 N sliding, `mu_s` N to break away."""
    law = BrownMcPhee(mu_s=mu_s, mu_d=4.0, v_t=v_t, mu_v=0.0)
    return drive(law, m=1.0, N=1.0, **more)
