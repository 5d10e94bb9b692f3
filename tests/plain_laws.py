"""Friction laws once more, as the papers print them: branches, signs and powers of Python floats.

Independent of the library, to compare with. Levels in newton; every law is written for v > 0.
"""

from math import atan, cos, e, erf, exp, pi, sin, sqrt, tan, tanh

F_C, F_S = 1.0, 1.5


def coulomb_tanh(v: float) -> float:
    return tanh(v / 1e-3)


def coulomb_atan(v: float) -> float:
    return 2 * atan(v / 1e-3) / pi


def coulomb_erf(v: float) -> float:
    return erf(v / 1e-3)


def coulomb_sqrt(v: float) -> float:
    return v / sqrt(v**2 + 1e-6)


def coulomb_saturation(v: float) -> float:
    return v / 1e-3 if v < 1e-3 else 1.0


def coulomb_quadratic(v: float) -> float:
    u = v / 1e-3
    return 2 * u - u**2 if u < 1 else 1.0


def threlfall(v: float) -> float:
    return 1 - exp(-3 * v / 1e-3) if v <= 1e-3 else 0.95


def modified_threlfall(v: float) -> float:
    return (1 - exp(-3 * v / 1e-3)) / (1 - exp(-3)) if v <= 1e-3 else 1.0


def ambrosio(v: float) -> float:
    if v <= 2e-4:
        return 0.0
    return (v - 2e-4) / 8e-4 if v < 1e-3 else 1.0


def bengisu_akay(v: float) -> float:
    if v <= 1e-3:
        return F_S - F_S / 1e-6 * (v - 1e-3) ** 2
    return F_C + (F_S - F_C) * exp(-1e3 * (v - 1e-3))


def cubic_step(x: float, x0: float, h0: float, x1: float, h1: float) -> float:
    """The function STEP of ADAMS."""
    if x <= x0:
        return h0
    if x >= x1:
        return h1
    d = (x - x0) / (x1 - x0)
    return h0 + (h1 - h0) * d * d * (3 - 2 * d)


def velocity_based(v: float) -> float:
    return cubic_step(v, -1e-3, -1.0, 1e-3, 1.0) * cubic_step(v, 1e-3, F_S, 1.5e-3, F_C)


def benson(v: float) -> float:
    return F_C + (F_S - F_C) * exp(-1e3 * v)


def andersson(v: float) -> float:
    return (F_C + (F_S - F_C) * exp(-((v / 1e-3) ** 2))) * tanh(1e4 * v)


def hollars(v: float) -> float:
    return min(v / 1e-3, 1.0) * (F_C + 2 * (F_S - F_C) / (1 + (v / 1e-3) ** 2))


def exudyn(v: float) -> float:
    if v <= 1e-3:
        return F_S * v / 1e-3
    return F_C + (F_S - F_C) * exp(-(v - 1e-3) / 1e-3)


def quintic(t: float) -> float:
    return 10 * t**3 - 15 * t**4 + 6 * t**5


def step5(v: float) -> float:
    u = v / 1e-3
    if u < 1:
        return F_S * quintic(u)
    if u < 3:
        return F_S - (F_S - F_C) * quintic((u - 1) / 2)
    return F_C


def brown_mcphee(v: float) -> float:
    return F_C * tanh(4 * v / 1e-3) + (F_S - F_C) * (v / 1e-3) / ((v / 2e-3) ** 2 + 3 / 4) ** 2


def simscape_breakaway(v: float) -> float:
    v_st = sqrt(2) * 1e-3
    bump = sqrt(2 * e) * (F_S - F_C) * exp(-((v / v_st) ** 2)) * v / v_st
    return bump + F_C * tanh(v / 1e-4)


def specker(v: float) -> float:
    excess = F_S - F_C * tanh(1e-3 / 1e-4)
    return excess * (v / 1e-3) * exp(0.5 - 0.5 * (v / 1e-3) ** 2) + F_C * tanh(v / 1e-4)


def makkar_dixon(v: float) -> float:
    return 0.5 * (tanh(1e4 * v) - tanh(1e3 * v)) + tanh(1e4 * v)


def leine_slip(v: float) -> float:
    return F_S / (1 + 3 * v)


def leine_atan(v: float) -> float:
    return 2 * F_S / pi * atan(1e6 * v) / (1 + 3 * v)


def popp_stelter(v: float) -> float:
    return F_S * (1 - 0.5) / (1 + v) + 0.5 * F_S + 0.1 * v**2


def stribeck(v: float, delta: float = 2.0) -> float:
    return F_C + (F_S - F_C) * exp(-((v / 1e-3) ** delta))


def steady_state_lugre_pilot(v: float) -> float:
    return 2.5498 + (4.4861 - 2.5498) * exp(-((v / 0.0012) ** 2)) + 230 * v


def steady_state_lugre_main(v: float) -> float:
    return 2.6063 + (4.2672 - 2.6063) * exp(-((v / 0.0049) ** 3.2)) + 5 * v


def lorentzian(v: float) -> float:
    return F_C + (F_S - F_C) / (1 + (v / 1e-3) ** 2)


def duan_singh(v: float) -> float:
    """|v| rounded over 1e-4/sigma, as the law says."""
    speed = v * v / sqrt(v**2 + 1e-16)
    return F_C * (1 + (F_S / F_C - 1) * exp(-1e3 * speed)) * tanh(1e4 * v)


def rui_wang(v: float) -> float:
    y = 1000 * v
    return 1.5 * sin(1.5 * atan(y - 0.5 * (y - atan(y))))


def capstan(v: float) -> float:
    return exp(0.2 * pi / 2) - 1


def awrejcewicz(v: float, F_e: float) -> float:
    """The four branches, for either sign of v; the slip branch starts at F_S with Gaussian fall."""
    width, v_s = 1e-3, 1e-2
    direction = 1.0 if v > 0 else -1.0 if v < 0 else 0.0
    if abs(v) > width:
        fall = exp(-(((abs(v) - width) / v_s) ** 2))
        return (F_C + (F_S - F_C) * fall) * direction
    A = v**2 / width**2 * (3 - 2 * abs(v) / width)
    if abs(F_e) <= F_S:
        return A * (F_S * direction - F_e) + F_e
    push = 1.0 if F_e > 0 else -1.0
    if v * push >= 0:
        return F_S * push
    return (2 * A - 1) * F_S * direction


def karnopp(v: float, F_e: float) -> float:
    if abs(v) >= 1e-3:
        return F_C if v > 0 else -F_C
    return max(-F_S, min(F_e, F_S))


def quarter_car(v: float, x_rel: float, v_rel: float, printed: bool) -> float:
    """Equation 24 at the default numbers; angles in the paper's 45 degrees."""
    f = 28900 * x_rel + 260 * v_rel
    shift = x_rel * sin(pi / 4) / (0.4 - x_rel * sin(pi / 4))
    change = atan(shift / sqrt(1 - shift**2))
    lever = cos(pi / 4 - change) / sin(pi / 4 - change)
    assert abs(lever * tan(pi / 4 - change) - 1) < 1e-12
    if v == 0:
        return f
    direction = 1.0 if v > 0 else -1.0
    load = f if printed else direction * sqrt(f**2 + 1.0)
    return direction * 180 * exp(-abs(v) / 0.01) + 0.05 * load * lever + 50 * v


def wojewoda(v: float, dv: float) -> float:
    """Far from the smoothing, for v > 0."""
    phase = 1.0 if dv > 0 else -1.0
    return F_C + phase * (F_S - F_C) * exp(-100 * v / (abs(dv) + 0.1))


def bam(v: float, tau_m: float, tau_e: float) -> float:
    """Model M6 of the servo family for v > 0, far from the smoothing."""
    s = exp(-((v / 0.2) ** 1.35))
    budget = 0.05 + abs(0.04 * tau_e - 0.06 * tau_m)
    budget += s * (0.03 + abs(0.02 * tau_e - 0.05 * tau_m))
    if tau_m * tau_e < 0:
        square = 0.01 * tau_e**2 if abs(tau_m) > abs(tau_e) else 0.02 * tau_m**2
        budget += s * square
    return budget + 0.1 * v


def bittencourt(v: float, N: float) -> float:
    level = 0.031 + 0.023 * N + 0.126 * N * exp(-((v / 9.2) ** 1.3))
    level += (1.6e-3 * 30 - 0.025) * exp(-((v / (30 - 25)) ** 1.3))
    return level + (1.3e-3 + 1.3e-3 * exp(-30 / 20.7)) * v
