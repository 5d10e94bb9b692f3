"""Records of a stage for the bank of scenes: motions, friction in closed form, and errors.

Forces follow from the imposed motion, F_e = m v' + F(v) + offset; bristles take exact steps on a
grid ten times finer than the record. Errors of the record are functions of a generator and of the
exact motion and force that return recorded positions or forces.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.random import Generator

from symfric.foundation.numeric import Array

M, OFFSET = 95.0, -3.0
"""Mass [kg] and constant force [N] of the stage."""
CURVE = {"mu_s": 28.0, "mu_d": 20.0, "v_s": 0.01, "sigma_2": 200.0}
HIDDEN = CURVE | {"v_s": 1e-3}
PLAIN = {"mu_d": 20.0, "sigma_2": 200.0}
STAGE = {"m": M, "offset": OFFSET}
BRISTLE = {"sigma_0": 1e5, "sigma_1": 300.0}
SPEED, SECONDS, RATE, FINE = 0.08, 12.0, 500.0, 10
"""Largest speed [m/s], length [s] and sampling rate [1/s] of a record; fine steps per sample."""
NOISE, FINEST = 0.5, 1e-9
"""Standard deviations of the noise of a force [N] and of a nearly exact position [m]."""


class SampledMotion(NamedTuple):
    """Times, positions, velocities and accelerations, each of shape (n,)."""

    t: Array
    x: Array
    v: Array
    a: Array

    def sampled(self) -> "SampledMotion":
        """Return every sample of the record, without the fine steps between them."""
        return SampledMotion(*(part[::FINE] for part in self))


def motion(
    rng: Generator, top: float = SPEED, least: float = 0.05, one_way: bool = False,
    fast: float = 1.0,
) -> SampledMotion:  # fmt: skip
    """Return strokes of three frequencies with random phases, slow at first and at the end.

    Args:
        rng: generator of the phases.
        top: largest speed [m/s].
        least: share of the speed at first and at the end.
        one_way: motion in one direction.
        fast: factor of the frequencies.
    """
    t = np.arange(round(SECONDS * RATE) * FINE + 1) / (RATE * FINE)
    waves = zip((0.2, 0.45, 0.8), (1.0, 0.6, 0.3), rng.uniform(0, 2 * np.pi, 3), strict=True)
    v = sum((a * np.sin(2 * np.pi * fast * f * t + p) for f, a, p in waves), np.zeros(t.size))
    v = v * (least + (1 - least) * np.sin(np.pi * t / t[-1]) ** 2)
    v = np.abs(v) + 0.02 if one_way else v
    v *= top / np.abs(v).max()
    h = t[1]
    x = np.concatenate([[0.0], np.cumsum(h * (v[1:] + v[:-1]) / 2)])
    return SampledMotion(t, x, v, np.gradient(v, t))


def curve(v: Array, mu_s: float, mu_d: float, v_s: float, sigma_2: float) -> Array:
    """Return friction with a Stribeck peak."""
    return np.sign(v) * (mu_d + (mu_s - mu_d) * np.exp(-((v / v_s) ** 2))) + sigma_2 * v


def plain(v: Array, mu_d: float, sigma_2: float) -> Array:
    """Return Coulomb and viscous friction."""
    return mu_d * np.sign(v) + sigma_2 * v


def bristle(t: Array, v: Array, z: float = 0.0) -> Array:
    """Return the friction of LuGre from the bristle deflection z [m], by exact steps."""
    sigma_0, sigma_1 = BRISTLE.values()
    h, mean = np.diff(t), (v[1:] + v[:-1]) / 2

    def deflection(speed: Array) -> Array:
        peak = (CURVE["mu_s"] - CURVE["mu_d"]) * np.exp(-((speed / CURVE["v_s"]) ** 2))
        return (CURVE["mu_d"] + peak) / sigma_0

    decay = np.exp(-np.abs(mean) / deflection(mean) * h)
    path = [z]
    ends = np.sign(mean) * deflection(mean)
    for keep, end in zip(decay.tolist(), ends.tolist(), strict=True):
        path.append(end + (path[-1] - end) * keep)
    bent = np.array(path)
    rate = v - np.abs(v) / deflection(v) * bent
    return sigma_0 * bent + sigma_1 * rate + CURVE["sigma_2"] * v


def ar(rng: Generator, n: int, rho: float, size: float) -> Array:
    """Return stationary AR(1) noise of standard deviation `size`."""
    e = rng.standard_normal(n)
    for k in range(1, n):
        e[k] = rho * e[k - 1] + np.sqrt(1 - rho**2) * e[k]
    return size * e


Seen = Callable[[Generator, SampledMotion], Array]
"""Function of generator and motion that returns recorded positions."""


def encoder(step: float) -> Seen:
    """Return the rounding of positions to multiples of `step` [m]."""
    return lambda rng, m: step * np.round((m.x + step * rng.uniform()) / step)


def jitter(rng: Generator, m: SampledMotion) -> Array:
    """Return positions at times that scatter by 0.3 ms."""
    return np.interp(m.t + 3e-4 * rng.standard_normal(m.t.size), m.t, m.x)


def with_play(positions: Array, play: float) -> Array:
    """Return positions of an encoder that follows the stage with a `play` [m]."""
    path = [positions[0]]
    for x in positions[1:].tolist():
        path.append(min(max(path[-1], x - play / 2), x + play / 2))
    return np.array(path)


def warm_up(rng: Generator, m: SampledMotion, F: Array) -> Array:
    """Return forces whose viscous part falls by 30 % with the dissipated energy."""
    del rng
    heat = np.cumsum(np.abs(m.v))
    return F - 0.3 * (1 - np.exp(-3 * heat / heat[-1])) * CURVE["sigma_2"] * m.v


FELT: dict[str, Callable[[Generator, SampledMotion, Array], Array]] = {
    "2 ms late": lambda rng, m, F: np.interp(m.t - 2e-3, m.t, F),
    "1 ms late": lambda rng, m, F: np.interp(m.t - 1e-3, m.t, F),
    "gain falls by 10 %": lambda rng, m, F: F * (1 - 0.1 * (F / np.abs(F).max()) ** 2),
    "one-sided gain": lambda rng, m, F: np.where(F > 0, 1.05, 1.0) * F,
    "limited to 80 %": lambda rng, m, F: np.clip(F, *(np.abs(F).max() * np.array([-0.8, 0.8]))),
    "held four times": lambda rng, m, F: F[4 * (np.arange(F.size) // 4)],
    "heavy tails": lambda rng, m, F: F + 0.3 * rng.standard_t(4, F.size),
    "cogging of 2 N": lambda rng, m, F: (
        F + 2.0 * np.sin(2 * np.pi * (m.x / 0.01 + rng.uniform()))
    ),
    "rubs with 5 % of inertia": lambda rng, m, F: F + 0.05 * M * np.abs(m.a) * np.sign(m.v),
    "friction falls": lambda rng, m, F: (
        F - m.t / m.t[-1] * (0.3 * CURVE["sigma_2"] * m.v + 0.1 * CURVE["mu_d"] * np.sign(m.v))
    ),
    "warms up": warm_up,
    "level varies by 6 %": lambda rng, m, F: F + 0.06 * CURVE["mu_d"] * np.sign(m.v) * np.sin(
        2 * np.pi * (m.x / 0.05 + rng.uniform())
    ),
}  # fmt: skip
"""Functions of generator, motion and exact force that return recorded forces."""


def asymmetric(v: Array) -> Array:
    """Return Coulomb and viscous friction, a tenth larger in one direction."""
    return plain(v, **PLAIN) * np.where(v > 0, 1.1, 1.0)


def quadratic(v: Array) -> Array:
    """Return Coulomb and viscous friction with a drag of 10 N at the largest speed."""
    return plain(v, **PLAIN) + 10.0 * v * np.abs(v) / SPEED**2


def root(v: Array) -> Array:
    """Return Coulomb friction and a drag that grows with the square root of the speed."""
    return np.sign(v) * (20.0 + 16.0 * np.sqrt(np.abs(v) / SPEED))
