"""The equations of the paper once more, in plain NumPy and small steps of constant velocity.

What is linear over a step is solved exactly. Nothing of `symfric` is used.
"""

from collections.abc import Callable, Mapping, Sequence
from math import ceil

import numpy as np
from numpy.typing import NDArray

from symfric.gallery.generalized_maxwell_slip import laws as table

Array = NDArray[np.float64]
F_S, F_C, V_S, DELTA = table.F_S, table.F_C, table.V_S, table.DELTA
SIGMA_0, SIGMA_1, Z_BA = table.SIGMA_0, table.SIGMA_1, table.Z_BA
DELTA_L, C = table.DELTA_L, table.C
K, ALPHA = np.array(table.ELEMENTS).T


def stribeck(v: Array) -> Array:
    """s(|v|) [N]."""
    return F_C + (F_S - F_C) * np.exp(-np.power(np.abs(v) / V_S, DELTA))


def rigid(v: np.ndarray) -> np.ndarray:
    """Mean of mu over the life of contacts under half a sine of load, their springs rigid [N]."""
    a = table.LIFE / v
    return F_S - (F_S - F_C) * np.pi**2 / 2 * (1 + np.exp(-a)) / (a**2 + np.pi**2)


def forces(name: str, t: Array, v: Array) -> Array:
    """Force [N] of the law at the times `t` [s] of velocities `v` [m/s], from steady sliding."""
    begin, step = LAWS[name]
    z, F = begin(float(np.sign(v[0])), float(stribeck(v[:1])[0])), np.full(t.size, np.nan)
    middle = (v[1:] + v[:-1]) / 2
    given = zip(middle.tolist(), np.diff(t).tolist(), stribeck(middle).tolist(), strict=True)
    for i, (speed, h, s) in enumerate(given, start=1):
        z, F[i] = step(z, speed, h, s)
    return F


def difference(name: str, curve: Mapping[str, Array], t: Array, v: Array) -> float:
    """Largest difference [N] of a curve from the force at velocities `v` [m/s] at times `t` [s]."""
    F = np.interp(curve["t"], t[1:], forces(name, t, v)[1:])
    return float(np.abs(F - curve["F"])[1:].max())


def dahl(z: Array, v: float, h: float, s: float) -> tuple[Array, float]:
    """dF/dx = sigma_0 (1 - F/F_C sgn v)."""
    z = F_C * np.sign(v) + (z - F_C * np.sign(v)) * np.exp(-SIGMA_0 * abs(v) * h / F_C)
    return z, float(z)


def bristle(z: Array, v: float, h: float, s: float, share: float = 1.0) -> tuple[Array, float]:
    """Equations 1 and 2."""
    rate = share * SIGMA_0 * abs(v) / s
    z = v / rate + (z - v / rate) * np.exp(-rate * h) if rate > 0 else z + v * h
    return z, float(SIGMA_0 * z + SIGMA_1 * (v - rate * z))


def elasto_plastic(z: Array, v: float, h: float, s: float) -> tuple[Array, float]:
    """Section 3.2: alpha is 0 up to z_ba, 1 from z_ss on."""
    r = float(np.clip((z * np.sign(v) - Z_BA) / (s / SIGMA_0 - Z_BA), 0.0, 1.0))
    return bristle(z, v, h, s, (1 + np.sin(np.pi * (r - 0.5))) / 2)


def maxwell(z: Array, v: float, h: float, s: float) -> tuple[Array, float]:
    """Equation 10."""
    z = np.clip(z + K * v * h, -ALPHA * F_S, ALPHA * F_S)
    return z, float(z.sum())


def leuven(
    z: Array, v: float, h: float, s: float, alternative: bool = False, delta: float = DELTA_L
) -> tuple[Array, float]:
    """Equations 3 and 4, with s(v) odd, or the `alternative` state equation of section 4.

    A step is divided where F_h would cross s in it.
    """
    parts = max(1, ceil(8 * delta * K.sum() * abs(v) * h / s))
    rate = v
    for _ in range(parts):
        r = z.sum() / s * np.sign(v)
        rest = np.sign(1 - r) * abs(1 - r) ** delta
        rate = v * (rest if alternative else 1 - np.sign(r) * abs(r) ** delta)
        z, _ = maxwell(z, rate, h / parts, s)
    return z, float(z.sum()) + SIGMA_1 * rate


def gms(z: Array, v: float, h: float, s: float) -> tuple[Array, float]:
    """Section 4.5; the second row of z is the mode, the direction of slip or 0."""
    held, mode = z
    mode = np.where(mode * v > 0, mode, 0.0)
    limit = ALPHA * s * np.sign(v)
    slipped = limit + (held - limit) * np.exp(-C * h / s)
    held = np.where(mode != 0, slipped, held + K * v * h)
    over = (mode == 0) & (np.sign(v) * held > ALPHA * s)
    held, mode = np.where(over, limit, held), np.where(over, np.sign(v), mode)
    return np.stack([held, mode]), float(held.sum())


Begin = Callable[[float, float], Array]
Step = Callable[[Array, float, float, float], tuple[Array, float]]
LAWS: dict[str, tuple[Begin, Step]] = {
    "Dahl": (lambda side, s: np.array(F_C * side), dahl),
    "LuGre": (lambda side, s: np.array(s / SIGMA_0 * side), bristle),
    "elasto-plastic": (lambda side, s: np.array(s / SIGMA_0 * side), elasto_plastic),
    "Maxwell slip": (lambda side, s: ALPHA * F_S * side, maxwell),
    "Leuven": (lambda side, s: ALPHA * s * side, leuven),
    "GMS": (lambda side, s: np.stack([ALPHA * s * side, ALPHA * 0 + side]), gms),
}
"""Law -> initial state in the direction `side`, 0 at rest, and step."""


def opening(path: Sequence[float], t_end: float, step: Step, steps: int = 4000) -> float:
    """By how much elements with this step miss their inner loop on `path`, over the force at 7."""
    t, legs = np.linspace(0.0, t_end, steps + 1), np.diff(path)
    phase = (t[1:] + t[:-1]) / 2 / t_end * legs.size
    v = legs[phase.astype(int)] * np.sin(np.pi * (phase % 1)) * np.pi / 2 * legs.size / t_end
    z, F = 0 * ALPHA, [0.0]
    for speed, s in zip(v.tolist(), stribeck(v).tolist(), strict=True):
        z, force = step(z, speed, t_end / steps, s)
        F.append(force)
    at = F[:: steps // legs.size]
    return abs(at[5] - at[3]) / abs(at[7])
