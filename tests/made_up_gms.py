"""A record of a drive with generalised Maxwell-slip friction, for fits by other laws."""

import numpy as np

from identification.data.dataset import Dataset
from symfric import GMS, simulate
from symfric.integrator import Linear
from symfric.scenes import Drive

LAW = GMS(mu_s=1.2, mu_d=1.0)
NOISE = 2e-7
"""Standard deviation of the position [m]."""


def gms_data(seed: int = 0, noise: float = NOISE) -> Dataset:
    """Pre-sliding loops within loops, then sliding with reversals; 1 kHz, 0.6 s, mass 1 kg."""
    t = np.arange(0.0, 0.6, 1e-3)
    force = 0.9 * np.sin(2 * np.pi * 8 * t) * np.minimum(1, 0.3 + 2 * t)
    force = force + 0.35 * np.sin(2 * np.pi * 41 * t) + 0.9 * (t > 0.45) * np.sin(60 * (t - 0.45))
    run = simulate(
        Drive(LAW, m=1.0, N=1.0).model(), float(t[-1]), t_eval=t, rtol=1e-8,
        u={"force": Linear(t, force)},
    )  # fmt: skip
    x = run["x"] + noise * np.random.default_rng(seed).standard_normal(t.size)
    return Dataset.of(t=t, x=x, force=force, units={"x": "m", "force": "N"}, name="gms")
