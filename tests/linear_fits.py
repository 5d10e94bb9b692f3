"""Made-up residuals of linear fits: noise of known colour, and a minimum around it."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from identification.residuals.evaluation import Channel
from identification.unknowns.unknown import Unknown
from identification.verdict.minimum import Minimum

Array = NDArray[np.float64]
STEP = 0.02


def ar1(n: int, rho: float, seed: int) -> Array:
    """Stationary AR(1) noise with unit innovations."""
    w = np.random.default_rng(seed).standard_normal(n)
    w[0] /= np.sqrt(1 - rho**2)
    e = w.copy()
    for k in range(1, n):
        e[k] += rho * e[k - 1]
    return e


def motion(n: int) -> dict[str, Array]:
    """A force and the motion that goes with it."""
    t = STEP * np.arange(n)
    v = np.sin(2 * np.pi * 0.31 * t) * np.sin(2 * np.pi * 0.023 * t + 1)
    return {"v": v, "x": STEP * np.cumsum(v), "force": np.sin(4.4 * t) + np.sin(12 * t + 1) / 2}


def coulomb(n: int) -> Array:
    """Sensitivities of a mass, a Coulomb and a viscous force and an offset, (n, 4)."""
    v = motion(n)["v"]
    return np.column_stack([np.gradient(v, STEP), np.tanh(v / 0.02), v, np.ones(n)])


def fitted(
    J: Array,
    measured: Array,
    unknowns: tuple[Unknown, ...] | None = None,
    regressors: Mapping[str, Array] | None = None,
    noise: Mapping[str, float] | None = None,
) -> Minimum:
    """The minimum of a linear fit J p = measured."""
    n, k = J.shape
    p, *_ = np.linalg.lstsq(J, measured, rcond=None)
    channel = Channel(
        0, "force", "N", slice(0, n), STEP * np.arange(n), measured, regressors or motion(n)
    )
    unknowns = unknowns or tuple(Unknown(f"p{i}", "1", 1.0) for i in range(k))
    r = J @ p - measured
    names, free = tuple(u.name for u in unknowns), np.zeros(k, dtype=bool)
    return Minimum(
        (channel,), unknowns, names, p, np.eye(k), free, r, J, np.ones(n), r, noise or {},
    )  # fmt: skip
