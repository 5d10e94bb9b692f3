"""Friction of many random contacts: seeded references in NumPy, which no optimiser can use.

Their force depends on a history of contacts made and lost at random. Smooth laws are identified
from, and compared with, what they produce.
"""

from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from symfric.parameters import Parametric, param

Array = NDArray[np.float64]


@final
@dataclass(frozen=True, eq=False)
class GenericAsperity(Parametric):
    """Generic asperity-level friction.

    Each of `count` asperities meets a counterface of period lam at a random phase. Over the share
    duty of each period it is in contact, under a normal force that rises and falls like a half
    sine; the loads of all add up to N. In contact it is a spring of random stiffness (1/2 to 3/2 of
    the mean) that sticks, and slips at

        mu(t_c) = mu_0 + (mu_inf - mu_0) (1 - exp(-t_c/tau_c))

    times its load, with t_c the age of the contact. When contact is lost its energy is.
    Shows hysteresis with memory, velocity weakening, lag and dwell by itself; the scatter of the
    force falls like 1/sqrt(count). A reconstruction from words.
    Source: Al-Bender, Lampaert, Swevers, Tribol. Lett. 16(1-2), 2004.
    """

    k: float = param(1e6, unit="N/m", doc="stiffness of all asperities in contact", lower=1e-12)
    mu_0: float = param(0.05, unit="1", doc="friction coefficient of a new contact", lower=0.0)
    mu_inf: float = param(0.2, unit="1", doc="friction coefficient of an old contact", lower=0.0)
    tau_c: float = param(0.05, unit="s", doc="time in which a contact ages", lower=1e-12)
    lam: float = param(2e-5, unit="m", doc="period of the counterface", lower=1e-15)
    duty: float = param(0.6, unit="1", doc="share of a period in contact", lower=1e-3, upper=1.0)
    count: int = 1000
    seed: int = 0

    def force(self, t: ArrayLike, x: ArrayLike, N: float) -> Array:
        """Friction force [N] along the motion x(t) [m], from unloaded asperities.

        Raises:
            ValueError: t not rising, other lengths, or steps of x above lam/20.
        """
        t, x = np.asarray(t, float), np.asarray(x, float)
        _check_motion("GenericAsperity", t, x, self.lam / 20)
        random = np.random.default_rng(self.seed)
        phase = random.uniform(0.0, self.lam, self.count)
        stiffness = self.k / (self.count * self.duty) * random.uniform(0.5, 1.5, self.count)
        share = N * np.pi / (2 * self.duty * self.count)
        d, age = np.zeros(self.count), np.zeros(self.count)
        F = np.zeros(t.size)
        for i in range(1, t.size):
            place = (x[i] + phase) % self.lam / (self.duty * self.lam)
            touching = place < 1
            age = np.where(touching, age + (t[i] - t[i - 1]), 0.0)
            mu = self.mu_0 + (self.mu_inf - self.mu_0) * -np.expm1(-age / self.tau_c)
            top = mu * share * np.sin(np.pi * np.minimum(place, 1.0)) / stiffness
            d = np.where(touching, np.clip(d + (x[i] - x[i - 1]), -top, top), 0.0)
            F[i] = stiffness @ d
        return F


@final
@dataclass(frozen=True, eq=False)
class RandomBristles(Parametric):
    """Bristle friction of Haessig and Friedland.

        F = sigma_0/count sum (x - b_i)

    A bristle bonded at b_i snaps when it is stretched beyond delta_s, and bonds anew at random
    within delta_s of x, on either side. The mean force in sliding lies between 0 and
    sigma_0 delta_s; it does not depend on the load.
    Source: Haessig and Friedland, ASME J. Dyn. Syst. Meas. Control 113(3), 1991.
    """

    sigma_0: float = param(1e5, unit="N/m", doc="stiffness of all bristles", lower=1e-12)
    delta_s: float = param(1e-5, unit="m", doc="stretch at which a bristle snaps", lower=1e-15)
    count: int = 25
    seed: int = 0

    def force(self, t: ArrayLike, x: ArrayLike) -> Array:
        """Friction force [N] along the motion x(t) [m], from bonds around x(0).

        Raises:
            ValueError: t not rising, other lengths, or steps of x above delta_s/10.
        """
        t, x = np.asarray(t, float), np.asarray(x, float)
        _check_motion("RandomBristles", t, x, self.delta_s / 10)
        random = np.random.default_rng(self.seed)
        bonds = x[0] + random.uniform(-self.delta_s, self.delta_s, self.count)
        F = np.zeros(t.size)
        for i in range(t.size):
            snapped = np.abs(x[i] - bonds) > self.delta_s
            fresh = random.uniform(-self.delta_s, self.delta_s, int(snapped.sum()))
            bonds[snapped] = x[i] + fresh
            F[i] = self.sigma_0 * float(np.mean(x[i] - bonds))
        return F


def _check_motion(where: str, t: Array, x: Array, largest: float) -> None:
    if t.ndim != 1 or t.shape != x.shape or t.size < 2 or not (np.diff(t) > 0).all():
        raise ValueError(
            f"{where}: expected rising times t and as many positions x, got shapes "
            f"{t.shape} and {x.shape}"
        )
    step = float(np.abs(np.diff(x)).max())
    if step > largest:
        raise ValueError(
            f"{where}: expected steps of x up to {largest:g} m, got {step:g} m; "
            "give the motion at more instants"
        )
