"""Ten friction laws as in their papers and in the manual, in plain Python.

A law is created from its numbers `p` and its forms. It returns the force F [N] and the rates of its
states for a sliding velocity v [m/s], a normal force N [N] and states z:

    force, rates = law(p, forms)(v, N, z)
"""

from collections.abc import Callable, Mapping, Sequence
from math import atan, erf, exp, pi, sin, sqrt, tanh

Rub = Callable[[float, float, Sequence[float]], tuple[float, tuple[float, ...]]]
Numbers = Mapping[str, float]
Forms = Mapping[str, str]


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


def coulomb(p: Numbers, forms: Forms) -> Rub:
    """F = mu_d N s(v / v_eps)."""
    mu_d, v_eps, s = p["mu_d"], p["v_eps"], SIGNS[forms.get("shape", "tanh")]
    if v_eps == 0.0:
        return lambda v, N, _: (mu_d * N * sign(v, 0.0), ())
    return lambda v, N, _: (mu_d * N * s(v / v_eps), ())


def stribeck(p: Numbers, _: Forms) -> Rub:
    """F = N [mu_d + (mu_s - mu_d) exp(-|v/v_s|^delta)] tanh(v / v_eps) + sigma_2 v."""
    mu_s, mu_d, v_eps, sigma_2 = p["mu_s"], p["mu_d"], p["v_eps"], p["sigma_2"]

    def rub(v: float, N: float, _: Sequence[float]) -> tuple[float, tuple[float, ...]]:
        mu = mu_d + (mu_s - mu_d) * stribeck_weight(p, v, 1e-4 * v_eps)
        return mu * N * sign(v, v_eps) + sigma_2 * v, ()

    return rub


def brown_mcphee(p: Numbers, _: Forms) -> Rub:
    """Brown-McPhee friction.

    x = v/v_t, F = N [mu_d tanh 4x + (mu_s - mu_d) x/(x^2/4 + 3/4)^2] + mu_v v tanh(4 N/N_t).
    """
    mu_s, mu_d, v_t, mu_v, N_t = p["mu_s"], p["mu_d"], p["v_t"], p["mu_v"], p["N_t"]

    def rub(v: float, N: float, _: Sequence[float]) -> tuple[float, tuple[float, ...]]:
        x = v / v_t
        peak = (mu_s - mu_d) * x / (x**2 / 4 + 3 / 4) ** 2
        return N * (mu_d * tanh(4 * x) + peak) + mu_v * v * tanh(4 * N / N_t), ()

    return rub


def specker(p: Numbers, _: Forms) -> Rub:
    """Specker friction.

    F_p = N [mu_s - mu_d tanh(v_sp/v_t)] - sigma_2 v_sp,   r = v/v_sp,

    F = F_p r exp((1 - r^2)/2) + mu_d N tanh(v/v_t) + sigma_2 v.
    """
    mu_s, mu_d, v_sp, v_t, sigma_2 = p["mu_s"], p["mu_d"], p["v_sp"], p["v_t"], p["sigma_2"]

    def rub(v: float, N: float, _: Sequence[float]) -> tuple[float, tuple[float, ...]]:
        F_p, r = N * (mu_s - mu_d * tanh(v_sp / v_t)) - sigma_2 * v_sp, v / v_sp
        bump = F_p * r * sqrt(exp(1.0)) * decay(r**2 / 2)
        return bump + mu_d * N * tanh(v / v_t) + sigma_2 * v, ()

    return rub


def dahl(p: Numbers, _: Forms) -> Rub:
    """Dahl friction with exponent n.

    rho = 1 - sigma_0 z sign(v) / (mu_d N),   dz/dt = v rho |rho|^(n-1),   F = sigma_0 z.
    """
    sigma_0, mu_d, n, v_eps, rho_eps = (p[k] for k in ("sigma_0", "mu_d", "n", "v_eps", "rho_eps"))

    def rub(v: float, N: float, z: Sequence[float]) -> tuple[float, tuple[float, ...]]:
        F = sigma_0 * z[0]
        if n == 1.0:
            return F, (v - v * sign(v, v_eps) * F / (mu_d * N),)
        rho = 1 - sign(v, v_eps) * F / (mu_d * N)
        return F, (v * rho * (rho**2 + rho_eps**2) ** ((n - 1) / 2),)

    return rub


def bristle(
    p: Numbers,
    damping: Callable[[float], float],
    share: Callable[[float, float, float], float] = lambda v, z, z_ss: 1.0,
) -> Rub:
    """Bristle friction.

    g = N [mu_d + (mu_s - mu_d) exp(-|v/v_s|^delta)],   dz/dt = v - alpha sigma_0 |v| z / g,

    F = sigma_0 z + sigma_1(v) dz/dt + sigma_2 v; `share` is alpha(v, z, g / sigma_0).
    """
    mu_s, mu_d, sigma_0, sigma_2, v_eps = (
        p[k] for k in ("mu_s", "mu_d", "sigma_0", "sigma_2", "v_eps")
    )

    def rub(v: float, N: float, z: Sequence[float]) -> tuple[float, tuple[float, ...]]:
        g = N * (mu_d + (mu_s - mu_d) * stribeck_weight(p, v, v_eps))
        alpha = share(v, z[0], g / sigma_0)
        rate = v - alpha * sigma_0 * v * sign(v, v_eps) * z[0] / g
        return sigma_0 * z[0] + damping(v) * rate + sigma_2 * v, (rate,)

    return rub


def lugre(p: Numbers, _: Forms) -> Rub:
    """`bristle` with alpha = 1."""
    return bristle(p, lambda v: p["sigma_1"])


def lugre_passive(p: Numbers, _: Forms) -> Rub:
    """`bristle` with velocity-dependent damping sigma_1 exp(-(v/v_d)^2)."""
    return bristle(p, lambda v: p["sigma_1"] * decay((v / p["v_d"]) ** 2))


def elasto_plastic(p: Numbers, _: Forms) -> Rub:
    """`bristle` with alpha a smooth step over (z sign(v) - z_ba)/(z_ss - z_ba)."""
    z_ba, v_eps = p["z_ba"], p["v_eps"]

    def alpha(v: float, z: float, z_ss: float) -> float:
        r = clip((z * sign(v, v_eps) - z_ba) / (z_ss - z_ba), 0.0, 1.0)
        if v_eps == 0.0:
            return (1 + sin(pi * (r - 1 / 2))) / 2
        return 10 * r**3 - 15 * r**4 + 6 * r**5

    return bristle(p, lambda v: p["sigma_1"], alpha)


def bouc_wen(p: Numbers, _: Forms) -> Rub:
    """dz/dt = v/x_0 [A - |z|^n (beta sign(v z) + gamma)],   x_0 = mu_d N / sigma_0,   F = mu_d N z.

    The subtracted term is |v| (beta sign(z) + gamma sign(v)) |z|^n with smoothed sign and |z|.
    """
    mu_d, sigma_0, A, beta, gamma, n = (
        p[k] for k in ("mu_d", "sigma_0", "A", "beta", "gamma", "n")
    )

    def rub(v: float, N: float, z: Sequence[float]) -> tuple[float, tuple[float, ...]]:
        t, s = sign(v, p["v_eps"]), sign(z[0], p["z_eps"])
        spent = power(z[0], n, p["z_eps"]) * v * t * (beta * s + gamma * t)
        return mu_d * N * z[0], (sigma_0 / (mu_d * N) * (A * v - spent),)

    return rub


def exact_coulomb(p: Numbers, forms: Forms) -> Rub:
    """F = mu N mode + sigma_2 v in sliding; the scene determines the force at rest.

    mu = mu_d or, with the form "stribeck", mu_d + (mu_s - mu_d) exp(-(v/v_s)^2); `z` is the mode.
    """
    mu_s, mu_d, v_s, sigma_2 = p["mu_s"], p["mu_d"], p["v_s"], p["sigma_2"]
    falls = forms.get("form", "jump") == "stribeck"

    def rub(v: float, N: float, z: Sequence[float]) -> tuple[float, tuple[float, ...]]:
        mu = mu_d + (mu_s - mu_d) * decay((v / v_s) ** 2) if falls else mu_d
        return mu * N * z[0] + sigma_2 * v, (0.0,)

    return rub


LAWS: dict[str, Callable[[Numbers, Forms], Rub]] = {
    "coulomb": coulomb,
    "stribeck": stribeck,
    "brown_mcphee": brown_mcphee,
    "specker": specker,
    "dahl": dahl,
    "lugre": lugre,
    "lugre_passive": lugre_passive,
    "elasto_plastic": elasto_plastic,
    "bouc_wen": bouc_wen,
    "exact_coulomb": exact_coulomb,
}
STATES = {name: 0 for name in LAWS} | {
    name: 1
    for name in ("dahl", "lugre", "lugre_passive", "elasto_plastic", "bouc_wen", "exact_coulomb")
}
