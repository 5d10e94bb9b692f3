"""Small optimal control problems whose answer is known on paper."""

from math import inf

import casadi as ca

from ocp import TIME, Free, Problem, integral
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


def least_effort(**changes: object) -> Problem:
    """Unit move from rest to rest in 1 s with least integral of a^2."""
    known: dict[str, object] = {
        "model": double_integrator(),
        "T": 1.0,
        "cost": integral(lambda s: s.a**2),
        "final": {"x": 1.0, "v": 0.0},
    }
    return Problem(**(known | changes))


def stage(v_t: float = 1e-3, mu_s: float = 6.0, **more: object) -> Model:
    """1 kg with Brown-McPhee friction: 4 N sliding, `mu_s` N to break away."""
    law = BrownMcPhee(mu_s=mu_s, mu_d=4.0, v_t=v_t, mu_v=0.0)
    return drive(law, m=1.0, N=1.0, **more)


def fastest(model: Model) -> Problem:
    """1 m from rest to rest with |force| <= 20 N in the shortest time."""
    return Problem(
        model,
        Free(0.1, 10.0, guess=1.0),
        TIME,
        final={"x": 1.0, "v": 0.0},
        bounds={"force": (-20.0, 20.0)},
    )


def out_and_back() -> Problem:
    """The study's trap: 1 m out and back in 2 s, with a reversal between the nodes."""
    law = BrownMcPhee(mu_s=6.0, mu_d=4.0, v_t=1e-2, mu_v=0.5, N_t=1e-3)
    return Problem(
        drive(law, m=1.0, N=1.0),
        2.0,
        integral(lambda s: s.force**2),
        via={0.5: {"x": 1.0}},
        final={"x": 0.0, "v": 0.0},
        bounds={"force": (-20.0, 20.0)},
    )
