"""Ten friction laws as in their papers and in the manual, in plain Python.

A law is a function of its numbers `p`, its forms, a sliding velocity v [m/s], a normal force N [N]
and its states z. It returns the force F [N] and the rates of the states:

    force, rates = law(p, forms, v, N, z)
"""

from collections.abc import Callable, Mapping, Sequence
from math import atan, erf, exp, pi, sin, sqrt, tanh

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
