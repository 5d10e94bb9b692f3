"""The equation that each static law prints, in plain Python: branches, signs, powers of floats.

Independent of the library. `p` is a law with numbers, of which only parameters and options are
read. Equations hold for v > 0, those of laws with further inputs for either sign.
"""

from collections.abc import Callable
from math import asin, atan, copysign, cos, e, erf, exp, log, pi, sin, sqrt, tan, tanh
from types import SimpleNamespace
from typing import Any

Formula = Callable[[Any, float, float], float]
SIGNS: dict[str, Callable[[float], float]] = {
    "tanh": tanh,
    "atan": lambda u: 2 * atan(u) / pi,
    "erf": erf,
    "sqrt": lambda u: u / sqrt(1 + u**2),
    "saturation": lambda u: min(u, 1.0),
    "quadratic": lambda u: 2 * u - u**2 if u < 1 else 1.0,
}


def sign(v: float, width: float) -> float:
    return tanh(v / width) if width else 1.0


def falls(p: Any, share: float) -> float:
    """The coefficient that falls from mu_s to mu_d with a share."""
    return p.mu_d + (p.mu_s - p.mu_d) * share


def weight(u: float, exponent: float) -> float:
    """exp(-u^exponent), 0 where the power is beyond floats."""
    return exp(-(u**exponent)) if u < 1e30 else 0.0


def quintic(t: float) -> float:
    t = min(max(t, 0.0), 1.0)
    return t**3 * (10 - 15 * t + 6 * t * t)


def cubic(t: float) -> float:
    """STEP of ADAMS."""
    t = min(max(t, 0.0), 1.0)
    return t * t * (3 - 2 * t)


def coulomb(p: Any, v: float, N: float) -> float:
    return p.mu_d * N * SIGNS[p.shape](v / p.v_eps)


def viscous(p: Any, v: float, N: float) -> float:
    return p.sigma_2 * v


def power_law_viscous(p: Any, v: float, N: float) -> float:
    return p.sigma_2 * v * (v**2 + p.v_eps**2) ** ((p.d - 1) / 2)


def stribeck(p: Any, v: float, N: float) -> float:
    return N * falls(p, weight(v / p.v_s, p.delta)) * sign(v, p.v_eps) + p.sigma_2 * v


def tustin(p: Any, v: float, N: float) -> float:
    return N * falls(p, exp(-v / p.v_s)) * sign(v, p.v_eps) + p.sigma_2 * v


def benson(p: Any, v: float, N: float) -> float:
    return N * falls(p, exp(-p.d_c * v)) * sign(v, p.v_eps)


def berger(p: Any, v: float, N: float) -> float:
    return N * falls(p, exp(-v / p.v_s)) * tanh(v / p.v_t)


def duan_singh(p: Any, v: float, N: float) -> float:
    return p.mu_d * N * (1 + (p.mu_s / p.mu_d - 1) * exp(-p.c * v)) * tanh(p.sigma * v)


def andersson(p: Any, v: float, N: float) -> float:
    return N * falls(p, weight(v / p.v_s, p.p)) * tanh(p.k_t * v) + p.sigma_2 * v


def steady_state_lugre(p: Any, v: float, N: float) -> float:
    level = p.F_C + (p.F_S - p.F_C) * weight(v / p.v_s, p.delta)
    return level * sign(v, p.v_eps) + p.sigma_2 * v


def quarter_car_simple(p: Any, v: float, N: float) -> float:
    return p.C_e * exp(-v / p.e_1) * tanh(v / p.v_eps) + p.sigma_v * v


def lorentzian(p: Any, v: float, N: float) -> float:
    return N * falls(p, 1 / (1 + (v / p.v_s) ** 2)) * sign(v, p.v_eps) + p.sigma_2 * v


def popp_stelter(p: Any, v: float, N: float) -> float:
    mu = p.mu_s * ((1 - p.eta) / (1 + p.d * v) + p.eta) + p.kappa * v**2
    return N * mu * sign(v, p.v_eps)


def leine_switch(p: Any, v: float, N: float) -> float:
    """For the original, beyond its band."""
    direction = 1.0 if p.form == "original" else 2 / pi * atan(v / p.v_eps)
    return p.mu_s * N * direction / (1 + p.delta * v)


def bittencourt(p: Any, v: float, N: float) -> float:
    """The maximum as the law rounds it, over F_eps."""
    static = p.F_s0 + p.F_sT * p.T
    static = (static + sqrt(static**2 + p.F_eps**2)) / 2
    level = p.F_c0 + p.F_cl * N + p.F_sl * N * weight(v / p.v_sl, p.delta)
    level += static * weight(v / (p.v_s0 + p.v_sT * p.T), p.delta)
    return level * tanh(v / p.v_eps) + (p.F_v0 + p.F_vT * exp(-p.T / p.T_v)) * v


def threlfall(p: Any, v: float, N: float) -> float:
    if p.form == "smooth":
        return p.mu_d * N * tanh(3 * v / p.v_r)
    return p.mu_d * N * (1 - exp(-3 * v / p.v_r) if v <= p.v_r else 0.95)


def modified_threlfall(p: Any, v: float, N: float) -> float:
    if p.form == "smooth":
        return p.mu_d * N * tanh(3 * v / p.v_r)
    return p.mu_d * N * ((1 - exp(-3 * v / p.v_r)) / (1 - exp(-3)) if v <= p.v_r else 1.0)


def bengisu_akay(p: Any, v: float, N: float) -> float:
    u = v / p.v_0
    if u <= 1:
        return p.mu_s * N * u * (2 - u)
    beyond = p.xi * (v - p.v_0)
    return N * falls(p, exp(-(beyond**2 if p.form == "smooth" else beyond)))


def velocity_based(p: Any, v: float, N: float) -> float:
    step = quintic if p.form == "smooth" else cubic
    rise = 2 * step((v + p.v_s) / (2 * p.v_s)) - 1
    return N * rise * (p.mu_s - (p.mu_s - p.mu_d) * step((v - p.v_s) / (p.v_d - p.v_s)))


def ambrosio(p: Any, v: float, N: float) -> float:
    t = (v - p.v_0) / (p.v_1 - p.v_0)
    return p.mu_d * N * (quintic(t) if p.form == "smooth" else min(max(t, 0.0), 1.0))


def step5(p: Any, v: float, N: float) -> float:
    u = v / p.v_t
    fall = (p.mu_s - p.mu_d) * quintic((u - 1) / 2)
    return N * (p.mu_s * quintic(u) - fall + p.mu_v * v)


def hollars(p: Any, v: float, N: float) -> float:
    u = v / p.v_t
    return N * (min(u, 1) * (p.mu_d + 2 * (p.mu_s - p.mu_d) / (1 + u**2)) + p.mu_v * v)


def exudyn(p: Any, v: float, N: float) -> float:
    if v <= p.v_reg:
        return N * p.mu_s * v / p.v_reg
    w = v - p.v_reg
    return N * (falls(p, exp(-w / p.v_exp)) + p.mu_v * w)


def brown_mcphee(p: Any, v: float, N: float) -> float:
    x = v / p.v_t
    dry = p.mu_d * tanh(4 * x) + (p.mu_s - p.mu_d) * x / (x**2 / 4 + 3 / 4) ** 2
    return N * dry + p.mu_v * v * tanh(4 * N / p.N_t)


def simscape_breakaway(p: Any, v: float, N: float) -> float:
    u = v / (sqrt(2) * p.v_brk)
    bump = sqrt(2 * e) * (p.mu_s - p.mu_d) * u * exp(-(u**2))
    return N * (bump + p.mu_d * tanh(10 * v / p.v_brk)) + p.sigma_2 * v


def specker(p: Any, v: float, N: float) -> float:
    top = N * (p.mu_s - p.mu_d * tanh(p.v_sp / p.v_t)) - p.sigma_2 * p.v_sp
    bump = top * (v / p.v_sp) * exp(0.5 - (v / p.v_sp) ** 2 / 2)
    return bump + p.mu_d * N * tanh(v / p.v_t) + p.sigma_2 * v


def makkar_dixon(p: Any, v: float, N: float) -> float:
    bump = p.gamma_1 * (tanh(p.gamma_2 * v) - tanh(p.gamma_3 * v))
    return bump + p.gamma_4 * tanh(p.gamma_5 * v) + p.gamma_6 * v


def self_tuning(p: Any, v: float, N: float) -> float:
    y = p.B * v
    C = 2 - (2 / pi) * asin(p.mu_d / p.mu_s)
    return p.mu_s * N * sin(C * atan((1 - p.E) * y + p.E * atan(y)))


def brittle_self_tuning(p: Any, v: float, N: float) -> float:
    share = (p.mu_s - p.mu_d) / p.difference_ref * N / p.N_ref
    B = p.B_0 + (p.B_max - p.B_0) * (1 - exp(-share))
    return self_tuning(SimpleNamespace(**{**vars(p), "B": B}), v, N)


def rui_wang(p: Any, v: float, N: float) -> float:
    y = p.B * v
    return p.D * sin(p.C * atan((1 - p.E) * y + p.E * atan(y)))


def capstan(p: Any, v: float, N: float) -> float:
    return N * (exp(p.mu_d * p.beta * sign(v, p.v_eps)) - 1)


def mixed_lubrication(p: Any, v: float, N: float) -> float:
    """With the load as the law rounds it, over N_eps."""
    H = p.eta * v / (N / p.A)
    share = (N**2 + p.N_eps**2) / N**2
    return p.mu_b * N * tanh(v / p.v_eps) * share / (share + (H / p.H_m) ** 2) + N * H / p.h_0


def brush_tyre(p: Any, v: float, N: float, v_r: float = 0.0) -> float:
    s = p.C * v / (3 * p.mu_d * N * sqrt(v_r**2 + p.v_eps**2))
    return copysign(p.mu_d * N * (1 - (1 - min(abs(s), 1.0)) ** 3), v)


def spline(p: Any, v: float, N: float) -> float:
    """By the four cubic pieces that are not zero, with repeated control points at both ends."""
    c = [level.c for level in p.levels]
    if p.shape == "falling":
        c = [sum(c[i:]) for i in range(len(c))]
    last = len(c) - 1
    x = last * log(1 + (v / p.v_first) ** 2) / log(1 + (p.v_last / p.v_first) ** 2)
    i = int(x)
    t = x - i
    weights = ((1 - t) ** 3, 4 - 6 * t**2 + 3 * t**3, 1 + 3 * t + 3 * t**2 - 3 * t**3, t**3)
    points = [c[min(max(i + k, 0), last)] for k in (-1, 0, 1, 2)]
    return N * tanh(v / p.v_eps) * sum(a * b / 6 for a, b in zip(weights, points, strict=True))


def network(p: Any, v: float, N: float) -> float:
    x = log(1 + (v / p.v_first) ** 2) / log(1 + (p.v_last / p.v_first) ** 2)
    steps = [k.w / (1 + exp(-2 * k.a * (x - k.s))) for k in p.neurons]
    return N * tanh(v / p.v_eps) * (p.b + sum(steps))


PRINTED: dict[str, Formula] = {
    f.__name__: f
    for f in (
        *(coulomb, viscous, power_law_viscous, stribeck, tustin, benson, berger, duan_singh),
        *(andersson, steady_state_lugre, quarter_car_simple, lorentzian, popp_stelter, capstan),
        *(leine_switch, bittencourt, threlfall, modified_threlfall, bengisu_akay, velocity_based),
        *(ambrosio, step5, hollars, exudyn, brown_mcphee, simscape_breakaway, specker),
        *(makkar_dixon, self_tuning, brittle_self_tuning, rui_wang, mixed_lubrication),
        *(spline, network, brush_tyre),
    )
}
"""Law by name -> its equation (law, v, N)."""


def karnopp(p: Any, v: float, N: float, F_e: float) -> float:
    if abs(v) >= p.D_v:
        return copysign(p.mu_d * N, v) + p.sigma_2 * v
    return max(-p.mu_s * N, min(F_e, p.mu_s * N))


def awrejcewicz(p: Any, v: float, N: float, F_e: float) -> float:
    """The four branches; the slip branch starts at the static level with a Gaussian fall."""
    static, width = p.mu_s * N, p.epsilon
    if abs(v) > width:
        fall = N * falls(p, exp(-(((abs(v) - width) / p.v_s) ** 2)))
        return copysign(fall, v)
    direction = copysign(1.0, v) if v else 0.0
    A = v**2 / width**2 * (3 - 2 * abs(v) / width)
    if abs(F_e) <= static:
        return A * (static * direction - F_e) + F_e
    if v * F_e >= 0:
        return copysign(static, F_e)
    return (2 * A - 1) * static * direction


def quarter_car_general(p: Any, v: float, N: float, x_rel: float, v_rel: float) -> float:
    """Equation 24, smooth beyond the stick window."""
    f = p.k_s * x_rel + p.b_d * v_rel
    shift = x_rel * cos(p.theta) / (p.L_d - x_rel * sin(p.theta))
    lever = p.mu / tan(p.theta - atan(shift / sqrt(1 - shift**2)))
    if v == 0:
        return f
    direction = copysign(1.0, v)
    load = f if p.form == "as_printed" else direction * sqrt(f**2 + p.F_eps**2)
    return direction * p.C_e * exp(-abs(v) / p.e_1) + load * lever + p.sigma_v * v


def wojewoda(p: Any, v: float, N: float, dv: float) -> float:
    """Far from the smoothing, for v > 0."""
    return N * falls(p, copysign(exp(-p.a_1 * v / (abs(dv) + p.a_2)), dv))


def bam(p: Any, v: float, N: float, tau_m: float, tau_e: float) -> float:
    """Model M6 of the servo family for v > 0, far from the smoothing."""
    budget = p.K_s + abs(p.K_es * tau_e - p.K_ms * tau_m)
    if tau_m * tau_e < 0:
        budget += p.Q_e * tau_e**2 if abs(tau_m) > abs(tau_e) else p.Q_m * tau_m**2
    stribeck = exp(-((v / p.v_s) ** p.alpha)) * budget
    return p.K_b + abs(p.K_e * tau_e - p.K_m * tau_m) + stribeck + p.K_v * v
