"""The equation that each static law prints, at any numbers, for v > 0, in plain Python.

sign(v) is the smooth sign that the law names; |v| is |v|. `p` holds the parameters by their names.
"""

from collections.abc import Callable
from math import asin, atan, e, exp, pi, sin, sqrt, tanh
from types import SimpleNamespace

Given = SimpleNamespace
Formula = Callable[[Given, float, float], float]


def falls(p: Given, share: float) -> float:
    """The coefficient that falls from mu_s to mu_d with a share."""
    return p.mu_d + (p.mu_s - p.mu_d) * share


def weight(u: float, exponent: float) -> float:
    """exp(-u^exponent), 0 where the power is beyond floats."""
    return exp(-(u**exponent)) if u < 1e30 else 0.0


def quintic(t: float) -> float:
    t = min(max(t, 0.0), 1.0)
    return t**3 * (10 - 15 * t + 6 * t * t)


def stribeck(p: Given, v: float, N: float) -> float:
    return N * falls(p, weight(v / p.v_s, p.delta)) * tanh(v / p.v_eps) + p.sigma_2 * v


def tustin(p: Given, v: float, N: float) -> float:
    return N * falls(p, exp(-v / p.v_s)) * tanh(v / p.v_eps) + p.sigma_2 * v


def benson(p: Given, v: float, N: float) -> float:
    return N * falls(p, exp(-p.d_c * v)) * tanh(v / p.v_eps)


def berger(p: Given, v: float, N: float) -> float:
    return N * falls(p, exp(-v / p.v_s)) * tanh(v / p.v_t)


def duan_singh(p: Given, v: float, N: float) -> float:
    return p.mu_d * N * (1 + (p.mu_s / p.mu_d - 1) * exp(-p.c * v)) * tanh(p.sigma * v)


def andersson(p: Given, v: float, N: float) -> float:
    return N * falls(p, weight(v / p.v_s, p.p)) * tanh(p.k_t * v) + p.sigma_2 * v


def steady_state_lugre(p: Given, v: float, N: float) -> float:
    level = p.F_C + (p.F_S - p.F_C) * weight(v / p.v_s, p.delta)
    return level * tanh(v / p.v_eps) + p.sigma_2 * v


def quarter_car_simple(p: Given, v: float, N: float) -> float:
    return p.C_e * exp(-v / p.e_1) * tanh(v / p.v_eps) + p.sigma_v * v


def lorentzian(p: Given, v: float, N: float) -> float:
    return N * falls(p, 1 / (1 + (v / p.v_s) ** 2)) * tanh(v / p.v_eps) + p.sigma_2 * v


def popp_stelter(p: Given, v: float, N: float) -> float:
    mu = p.mu_s * ((1 - p.eta) / (1 + p.d * v) + p.eta) + p.kappa * v**2
    return N * mu * tanh(v / p.v_eps)


def leine_switch(p: Given, v: float, N: float) -> float:
    return p.mu_s * N * (2 / pi) * atan(v / p.v_eps) / (1 + p.delta * v)


def bittencourt(p: Given, v: float, N: float) -> float:
    """The maximum as the law rounds it, over F_eps."""
    static = p.F_s0 + p.F_sT * p.T
    static = (static + sqrt(static**2 + p.F_eps**2)) / 2
    level = p.F_c0 + p.F_cl * N + p.F_sl * N * weight(v / p.v_sl, p.delta)
    level += static * weight(v / (p.v_s0 + p.v_sT * p.T), p.delta)
    return level * tanh(v / p.v_eps) + (p.F_v0 + p.F_vT * exp(-p.T / p.T_v)) * v


def coulomb(p: Given, v: float, N: float) -> float:
    return p.mu_d * N * tanh(v / p.v_eps)


def viscous(p: Given, v: float, N: float) -> float:
    return p.sigma_2 * v


def power_law_viscous(p: Given, v: float, N: float) -> float:
    return p.sigma_2 * v * (v**2 + p.v_eps**2) ** ((p.d - 1) / 2)


def threlfall(p: Given, v: float, N: float) -> float:
    return p.mu_d * N * tanh(3 * v / p.v_r)


def bengisu_akay(p: Given, v: float, N: float) -> float:
    u = v / p.v_0
    if u <= 1:
        return p.mu_s * N * u * (2 - u)
    return N * falls(p, exp(-((p.xi * (v - p.v_0)) ** 2)))


def velocity_based(p: Given, v: float, N: float) -> float:
    rise = 2 * quintic((v + p.v_s) / (2 * p.v_s)) - 1
    return N * rise * (p.mu_s - (p.mu_s - p.mu_d) * quintic((v - p.v_s) / (p.v_d - p.v_s)))


def ambrosio(p: Given, v: float, N: float) -> float:
    return p.mu_d * N * quintic((v - p.v_0) / (p.v_1 - p.v_0))


def step5(p: Given, v: float, N: float) -> float:
    u = v / p.v_t
    fall = (p.mu_s - p.mu_d) * quintic((u - 1) / 2)
    return N * (p.mu_s * quintic(u) - fall + p.mu_v * v)


def hollars(p: Given, v: float, N: float) -> float:
    u = v / p.v_t
    return N * (min(u, 1) * (p.mu_d + 2 * (p.mu_s - p.mu_d) / (1 + u**2)) + p.mu_v * v)


def exudyn(p: Given, v: float, N: float) -> float:
    if v <= p.v_reg:
        return N * p.mu_s * v / p.v_reg
    w = v - p.v_reg
    return N * (falls(p, exp(-w / p.v_exp)) + p.mu_v * w)


def brown_mcphee(p: Given, v: float, N: float) -> float:
    x = v / p.v_t
    dry = p.mu_d * tanh(4 * x) + (p.mu_s - p.mu_d) * x / (x**2 / 4 + 3 / 4) ** 2
    return N * dry + p.mu_v * v * tanh(4 * N / p.N_t)


def simscape_breakaway(p: Given, v: float, N: float) -> float:
    u = v / (sqrt(2) * p.v_brk)
    bump = sqrt(2 * e) * (p.mu_s - p.mu_d) * u * exp(-(u**2))
    return N * (bump + p.mu_d * tanh(10 * v / p.v_brk)) + p.sigma_2 * v


def specker(p: Given, v: float, N: float) -> float:
    top = N * (p.mu_s - p.mu_d * tanh(p.v_sp / p.v_t)) - p.sigma_2 * p.v_sp
    bump = top * (v / p.v_sp) * exp(0.5 - (v / p.v_sp) ** 2 / 2)
    return bump + p.mu_d * N * tanh(v / p.v_t) + p.sigma_2 * v


def makkar_dixon(p: Given, v: float, N: float) -> float:
    bump = p.gamma_1 * (tanh(p.gamma_2 * v) - tanh(p.gamma_3 * v))
    return bump + p.gamma_4 * tanh(p.gamma_5 * v) + p.gamma_6 * v


def self_tuning(p: Given, v: float, N: float) -> float:
    y = p.B * v
    C = 2 - (2 / pi) * asin(p.mu_d / p.mu_s)
    return p.mu_s * N * sin(C * atan((1 - p.E) * y + p.E * atan(y)))


def brittle_self_tuning(p: Given, v: float, N: float) -> float:
    share = (p.mu_s - p.mu_d) / p.difference_ref * N / p.N_ref
    B = p.B_0 + (p.B_max - p.B_0) * (1 - exp(-share))
    return self_tuning(SimpleNamespace(**{**vars(p), "B": B}), v, N)


def rui_wang(p: Given, v: float, N: float) -> float:
    y = p.B * v
    return p.D * sin(p.C * atan((1 - p.E) * y + p.E * atan(y)))


def capstan(p: Given, v: float, N: float) -> float:
    return N * (exp(p.mu_d * p.beta * tanh(v / p.v_eps)) - 1)


SMOOTH: dict[str, Formula] = {
    f.__name__: f
    for f in (
        *(stribeck, tustin, benson, berger, duan_singh, andersson, steady_state_lugre),
        *(quarter_car_simple, lorentzian, popp_stelter, leine_switch, bittencourt, coulomb),
        *(viscous, power_law_viscous, threlfall, bengisu_akay, velocity_based, ambrosio, step5),
        *(hollars, exudyn, brown_mcphee, simscape_breakaway, specker, makkar_dixon, self_tuning),
        *(brittle_self_tuning, rui_wang, capstan),
    )
} | {"modified_threlfall": threlfall}
"""Law by name -> its equation."""
