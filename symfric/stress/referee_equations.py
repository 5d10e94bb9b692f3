"""Ten friction laws as in their papers, and six machines as in textbooks, in plain Python.

A law is a function of its numbers `p`, its forms, a sliding velocity v [m/s], a normal force N [N]
and its states z. It returns the force F [N] and the rates of the states:

    force, rates = law(p, forms, v, N, z)

A scene is created from its numbers `p`, its force over time, and a time between the two kinks for
which it is valid. It returns the rates at t of its states y, without those of laws. Each contact
calls `rub(i, v, N, F_e)` for its friction force, with the sliding velocity v, the normal force N
and the force F_e that it would carry at rest.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import asin, atan, cos, erf, exp, hypot, inf, pi, sin, sqrt, tan, tanh

Numbers = Mapping[str, float]
Forms = Mapping[str, str]
Found = tuple[float, tuple[float, ...]]
"""Force and rates."""
Law = Callable[[Numbers, Forms, float, float, Sequence[float]], Found]


def sign(x: float, width: float) -> float:
    """Return the sign of x, smoothed to tanh(x / width)."""
    if width == 0.0:
        return float((x > 0) - (x < 0))
    return tanh(x / width)


def clip(x: float, low: float, high: float) -> float:
    """Return the number between low and high that is nearest to x."""
    return min(max(x, low), high)


def decay(x: float) -> float:
    """Return exp(-x) for x >= 0, or zero if it is below the smallest double."""
    return exp(-min(x, 800.0))


def power(x: float, n: float, width: float) -> float:
    """Return |x|^n, smoothed at rest."""
    return x * x if n == 2.0 else (x * x + width * width) ** (n / 2) - width**n


def stribeck_weight(p: Numbers, v: float, width: float) -> float:
    """Return exp(-|v/v_s|^delta), smoothed at rest for delta other than 2."""
    u, n, w = v / p["v_s"], p["delta"], width / p["v_s"]
    if n == 2.0 or w == 0.0:
        return decay(abs(u) ** n)
    return decay(u**2 * (u**2 + w**2) ** (n / 2 - 1))


SIGNS: dict[str, Callable[[float], float]] = {
    "tanh": tanh,
    "atan": lambda u: 2 / pi * atan(u),
    "erf": erf,
    "sqrt": lambda u: u / sqrt(1 + u * u),
    "saturation": lambda u: clip(u, -1.0, 1.0),
    "quadratic": lambda u: clip(u, -1.0, 1.0) * (2 - abs(clip(u, -1.0, 1.0))),
}


def coulomb(p: Numbers, forms: Forms, v: float, N: float, _: Sequence[float]) -> Found:
    """F = mu_d N s(v / v_eps)."""
    if p["v_eps"] == 0.0:
        return p["mu_d"] * N * sign(v, 0.0), ()
    return p["mu_d"] * N * SIGNS[forms.get("shape", "tanh")](v / p["v_eps"]), ()


def stribeck(p: Numbers, _: Forms, v: float, N: float, __: Sequence[float]) -> Found:
    """F = N [mu_d + (mu_s - mu_d) exp(-|v/v_s|^delta)] tanh(v / v_eps) + sigma_2 v."""
    mu = p["mu_d"] + (p["mu_s"] - p["mu_d"]) * stribeck_weight(p, v, 1e-4 * p["v_eps"])
    return mu * N * sign(v, p["v_eps"]) + p["sigma_2"] * v, ()


def brown_mcphee(p: Numbers, _: Forms, v: float, N: float, __: Sequence[float]) -> Found:
    """Brown-McPhee friction.

    x = v/v_t, F = N [mu_d tanh 4x + (mu_s - mu_d) x/(x^2/4 + 3/4)^2] + mu_v v tanh(4 N/N_t).
    """
    x = v / p["v_t"]
    peak = (p["mu_s"] - p["mu_d"]) * x / (x**2 / 4 + 3 / 4) ** 2
    return N * (p["mu_d"] * tanh(4 * x) + peak) + p["mu_v"] * v * tanh(4 * N / p["N_t"]), ()


def specker(p: Numbers, _: Forms, v: float, N: float, __: Sequence[float]) -> Found:
    """Specker friction.

    F_p = N [mu_s - mu_d tanh(v_sp/v_t)] - sigma_2 v_sp,   r = v/v_sp,

    F = F_p r exp((1 - r^2)/2) + mu_d N tanh(v/v_t) + sigma_2 v.
    """
    mu_s, mu_d, v_sp, v_t, sigma_2 = p["mu_s"], p["mu_d"], p["v_sp"], p["v_t"], p["sigma_2"]
    F_p, r = N * (mu_s - mu_d * tanh(v_sp / v_t)) - sigma_2 * v_sp, v / v_sp
    bump = F_p * r * sqrt(exp(1.0)) * decay(r**2 / 2)
    return bump + mu_d * N * tanh(v / v_t) + sigma_2 * v, ()


def dahl(p: Numbers, _: Forms, v: float, N: float, z: Sequence[float]) -> Found:
    """Dahl friction with exponent n.

    rho = 1 - sigma_0 z sign(v) / (mu_d N),   dz/dt = v rho |rho|^(n-1),   F = sigma_0 z.
    """
    F, n = p["sigma_0"] * z[0], p["n"]
    if n == 1.0:
        return F, (v - v * sign(v, p["v_eps"]) * F / (p["mu_d"] * N),)
    rho = 1 - sign(v, p["v_eps"]) * F / (p["mu_d"] * N)
    return F, (v * rho * (rho**2 + p["rho_eps"] ** 2) ** ((n - 1) / 2),)


def bristle(
    p: Numbers,
    v: float,
    N: float,
    z: float,
    damping: float,
    share: Callable[[float], float] = lambda z_ss: 1.0,
) -> Found:
    """Bristle friction.

    g = N [mu_d + (mu_s - mu_d) exp(-|v/v_s|^delta)],   dz/dt = v - alpha sigma_0 |v| z / g,

    F = sigma_0 z + sigma_1(v) dz/dt + sigma_2 v; `damping` is sigma_1(v), `share` alpha(g/sigma_0).
    """
    g = N * (p["mu_d"] + (p["mu_s"] - p["mu_d"]) * stribeck_weight(p, v, p["v_eps"]))
    rate = v - share(g / p["sigma_0"]) * p["sigma_0"] * v * sign(v, p["v_eps"]) * z / g
    return p["sigma_0"] * z + damping * rate + p["sigma_2"] * v, (rate,)


def lugre(p: Numbers, _: Forms, v: float, N: float, z: Sequence[float]) -> Found:
    """`bristle` with alpha = 1."""
    return bristle(p, v, N, z[0], p["sigma_1"])


def lugre_passive(p: Numbers, _: Forms, v: float, N: float, z: Sequence[float]) -> Found:
    """`bristle` with velocity-dependent damping sigma_1 exp(-(v/v_d)^2)."""
    return bristle(p, v, N, z[0], p["sigma_1"] * decay((v / p["v_d"]) ** 2))


def elasto_plastic(p: Numbers, _: Forms, v: float, N: float, z: Sequence[float]) -> Found:
    """`bristle` with alpha a smooth step over (z sign(v) - z_ba)/(z_ss - z_ba)."""
    z_ba, v_eps = p["z_ba"], p["v_eps"]

    def alpha(z_ss: float) -> float:
        r = clip((z[0] * sign(v, v_eps) - z_ba) / (z_ss - z_ba), 0.0, 1.0)
        if v_eps == 0.0:
            return (1 + sin(pi * (r - 1 / 2))) / 2
        return 10 * r**3 - 15 * r**4 + 6 * r**5

    return bristle(p, v, N, z[0], p["sigma_1"], alpha)


def bouc_wen(p: Numbers, _: Forms, v: float, N: float, z: Sequence[float]) -> Found:
    """dz/dt = v/x_0 [A - |z|^n (beta sign(v z) + gamma)],   x_0 = mu_d N / sigma_0,   F = mu_d N z.

    The subtracted term is |v| (beta sign(z) + gamma sign(v)) |z|^n with smoothed sign and |z|.
    """
    t, s = sign(v, p["v_eps"]), sign(z[0], p["z_eps"])
    spent = power(z[0], p["n"], p["z_eps"]) * v * t * (p["beta"] * s + p["gamma"] * t)
    return p["mu_d"] * N * z[0], (p["sigma_0"] / (p["mu_d"] * N) * (p["A"] * v - spent),)


def exact_coulomb(p: Numbers, forms: Forms, v: float, N: float, z: Sequence[float]) -> Found:
    """F = mu N mode + sigma_2 v in sliding; the scene determines the force at rest.

    mu = mu_d or, with the form "stribeck", mu_d + (mu_s - mu_d) exp(-(v/v_s)^2); `z` is the mode.
    """
    mu = p["mu_d"]
    if forms.get("form", "jump") == "stribeck":
        mu += (p["mu_s"] - p["mu_d"]) * decay((v / p["v_s"]) ** 2)
    return mu * N * z[0] + p["sigma_2"] * v, (0.0,)


STATIC: dict[str, Law] = {
    "coulomb": coulomb, "stribeck": stribeck, "brown_mcphee": brown_mcphee, "specker": specker,
}  # fmt: skip
DYNAMIC: dict[str, Law] = {
    "dahl": dahl, "lugre": lugre, "lugre_passive": lugre_passive, "elasto_plastic": elasto_plastic,
    "bouc_wen": bouc_wen, "exact_coulomb": exact_coulomb,
}  # fmt: skip
"""Laws with one state."""
LAWS = STATIC | DYNAMIC


# ---- machines ----

Force = Callable[[float], float]
Friction = Callable[[int, float, float, float], float]
Motion = Callable[[float, Sequence[float], Friction], Sequence[float]]

ROUNDING, CLOSE, LOOPS = 4e-16, 1e-11, 60
WIDTH = 1e-4
"""Smoothing [N] of the magnitude of the force of a bearing."""


class UnsolvableError(ArithmeticError):
    """Error if the search for consistent accelerations and normal forces fails."""


@dataclass(frozen=True)
class RefereeScene:
    """Equations of a machine and the sliding velocities of its contacts.

    Attributes:
        states: number of states of the machine, without those of laws.
        motion: equations.
        slides: for each contact, (number of a velocity state, its value at rest).
        breaks: times at which the equations have a kink [s].
    """

    states: int
    motion: Motion
    slides: tuple[tuple[int, float], ...]
    breaks: tuple[float, ...] = ()


def belt(p: Numbers, _: Force, __: float) -> RefereeScene:
    """Block on a belt.

    x' = v,   m v' = -k x - F(v - v_belt, m g).
    """
    m, k, v_belt, g = p["m"], p["k"], p["v_belt"], p["g"]

    def motion(t: float, y: Sequence[float], rub: Friction) -> Sequence[float]:
        x, v = y
        return v, (-k * x - rub(0, v - v_belt, m * g, -k * x)) / m

    return RefereeScene(2, motion, ((1, v_belt),))


def drive(p: Numbers, force: Force, _: float) -> RefereeScene:
    """Mass under a force.

    x' = v,   m v' = force - offset - F(v, N).
    """

    def motion(t: float, y: Sequence[float], rub: Friction) -> Sequence[float]:
        pull = force(t) - p["offset"]
        return y[1], (pull - rub(0, y[1], p["N"], pull)) / p["m"]

    return RefereeScene(2, motion, ((1, 0.0),))


def two_blocks(p: Numbers, _: Force, __: float) -> RefereeScene:
    """Two blocks on a belt, connected by a spring.

    m_i v_i' = -k_i x_i +- k_c (x_2 - x_1) - F(v_i - v_belt, m_i g).
    """
    m_1, m_2, v_belt, g = p["m_1"], p["m_2"], p["v_belt"], p["g"]

    def motion(t: float, y: Sequence[float], rub: Friction) -> Sequence[float]:
        x_1, x_2, v_1, v_2 = y
        between = p["k_c"] * (x_2 - x_1)
        pull_1, pull_2 = between - p["k_1"] * x_1, -between - p["k_2"] * x_2
        a_1 = (pull_1 - rub(0, v_1 - v_belt, m_1 * g, pull_1)) / m_1
        a_2 = (pull_2 - rub(1, v_2 - v_belt, m_2 * g, pull_2)) / m_2
        return v_1, v_2, a_1, a_2

    return RefereeScene(4, motion, ((2, v_belt), (3, v_belt)))


def quarter_car(p: Numbers, _: Force, within: float) -> RefereeScene:
    """Quarter car over a road of three ramps.

    M_b X_b'' = f - F(X_b', N),   M_w X_w'' = -f + k_t (X_r - X_w) + b_t (X_r' - X_w'),

    f = k_s (X_w - X_b) + b_d (X_w' - X_b'),   N = N_0 + |f| / tan(theta - d_theta),
    sin d_theta = s cos(theta) / (L_d - s sin(theta)),   s = X_w - X_b.
    """
    heights = (p["middle"], p["amplitude"], -2 * p["amplitude"])
    lengths = (p["t_first"], p["t_ramp"], p["t_ramp"])
    second = p["t_0"] + p["t_first"] + p["t_hold"]
    starts = (p["t_0"], second, second + p["t_ramp"] + p["t_hold"])
    ramps = tuple(zip(heights, starts, lengths, strict=True))
    v_r = sum(h / d for h, a, d in ramps if a < within < a + d)
    height = sum(h * min(max((within - a) / d, 0.0), 1.0) for h, a, d in ramps)

    def motion(t: float, y: Sequence[float], rub: Friction) -> Sequence[float]:
        X_b, X_w, v_b, v_w = y
        X_r = height + v_r * (t - within)
        s = X_w - X_b
        f = p["k_s"] * s + p["b_d"] * (v_w - v_b)
        lean = asin(s * cos(p["theta"]) / (p["L_d"] - s * sin(p["theta"])))
        side = f / tan(p["theta"] - lean)
        N = p["N_0"] + sqrt(side**2 + p["eps"] ** 2) - p["eps"]
        a_b = (f - rub(0, v_b, N, f)) / p["M_b"]
        tyre = p["k_t"] * (X_r - X_w) + p["b_t"] * (v_r - v_w)
        return v_b, v_w, a_b, (tyre - f) / p["M_w"]

    kinks = tuple(time for _, a, d in ramps for time in (a, a + d))
    return RefereeScene(4, motion, ((2, 0.0),), kinks)


def length(*forces: float) -> float:
    """Return the magnitude of a force [N], smoothed at zero."""
    return hypot(*forces, WIDTH) - WIDTH


def pendulum(p: Numbers, _: Force, __: float) -> RefereeScene:
    """(J + m L^2) phi'' = -m g L sin(phi) - R F(R phi', N), with N the force of the bearing."""
    m, L, R, g = p["m"], p["L"], p["R"], p["g"]
    inertia, guess = p["J"] + m * L**2, [m * g]

    def motion(t: float, y: Sequence[float], rub: Friction) -> Sequence[float]:
        phi, w = y
        weight = -m * g * L * sin(phi)

        def accelerated(N: list[float]) -> tuple[list[float], list[float]]:
            a = (weight - R * rub(0, R * w, N[0], weight / R)) / inertia
            along, across = m * (L * w**2 + g * cos(phi)), m * (L * a + g * sin(phi))
            return [a], [length(along, across)]

        return w, *settled(accelerated, guess)

    return RefereeScene(2, motion, ((1, 0.0),))


def pendulum_box(p: Numbers, _: Force, __: float) -> RefereeScene:
    """Box (x) on rough ground with a hinged pendulum (phi), and friction at ground and hinge.

    (m_b + m) x'' + m L (phi'' cos(phi) - phi'^2 sin(phi)) = -F(x', N_1),
    m L x'' cos(phi) + (J + m L^2) phi'' + m g L sin(phi) = -R F(R phi', N_2),
    with N_1 the magnitude of the force of the ground and N_2 that of the hinge.
    """
    m, L, R, g, both = p["m"], p["L"], p["R"], p["g"], p["m_box"] + p["m"]
    inertia, guess = p["J"] + m * L**2, [both * g, m * g]

    def motion(t: float, y: Sequence[float], rub: Friction) -> Sequence[float]:
        _, phi, v, w = y
        c, s = cos(phi), sin(phi)

        def accelerated(N: list[float]) -> tuple[list[float], list[float]]:
            f = m * L * s * w**2 - rub(0, v, N[0], 0.0)
            T = -m * g * L * s - R * rub(1, R * w, N[1], 0.0)
            det = both * inertia - (m * L * c) ** 2
            a, b = (inertia * f - m * L * c * T) / det, (both * T - m * L * c * f) / det
            aside, up = m * (a + L * (c * b - s * w**2)), m * (g + L * (s * b + c * w**2))
            return [a, b], [length(up + p["m_box"] * g), length(aside, up)]

        return v, w, *settled(accelerated, guess)

    return RefereeScene(4, motion, ((2, 0.0), (3, 0.0)))


def settled(
    accelerated: Callable[[list[float]], tuple[list[float], list[float]]], N: list[float]
) -> list[float]:
    """Return accelerations consistent with the normal forces N, computed by Broyden's method.

    N contains the initial guess and is overwritten with the result.
    """
    n, last = range(len(N)), inf
    a, found = accelerated(N)
    gap = [found[i] - N[i] for i in n]
    inverse = [[-float(i == j) for j in n] for i in n]  # inverse Jacobian of the gap
    for _ in range(LOOPS):
        size = max(abs(gap[i]) / (1 + found[i]) for i in n)
        if size <= ROUNDING or last / 2 < size < CLOSE:  # the rest is rounding
            return a
        step = [max(-sum(inverse[i][j] * gap[j] for j in n), -0.9 * N[i]) for i in n]
        N[:] = [N[i] + step[i] for i in n]
        a, found = accelerated(N)
        before, gap, last = gap, [found[i] - N[i] for i in n], size
        turned = [sum(inverse[i][j] * (gap[j] - before[j]) for j in n) for i in n]
        back = [sum(step[j] * inverse[j][i] for j in n) for i in n]
        along = sum(step[i] * turned[i] for i in n)
        if along:
            inverse = [
                [inverse[i][j] + (step[i] - turned[i]) * back[j] / along for j in n] for i in n
            ]
    raise UnsolvableError


SCENES: dict[str, Callable[[Numbers, Force, float], RefereeScene]] = {
    "rabinowicz": belt,
    "drive": drive,
    "coupled_blocks": two_blocks,
    "quarter_car": quarter_car,
    "pendulum": pendulum,
    "pendulum_box": pendulum_box,
}
