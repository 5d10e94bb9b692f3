"""The law by its three factors, which the paper varies one by one, beyond what a law may have."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def force(v: Array, B: float, C: float, E: float) -> Array:
    """F / (mu_s N) at the sliding velocity `v` [mm/s]; B [s/mm], C [1], E [1].

    `SelfTuning` is the same for 1 <= C < 2, where C = 2 - (2/pi) asin(mu_d / mu_s), and E < 1.
    """
    y = B * v
    return np.sin(C * np.arctan((1 - E) * y + E * np.arctan(y)))
