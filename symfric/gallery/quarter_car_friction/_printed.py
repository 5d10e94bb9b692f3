"""Numbers that the paper prints of its runs, beside ours."""

import numpy as np

from symfric import Trajectory

RESIDUAL = {"x_rel": (0.006362, 0.006366), "X_b": (0.096267, 0.096386)}
"""Table 1: residuals with Coulomb friction and without [m]."""
RANGE = 0.135
"""Of the body, section 7.4 [m]."""


def residuals(run: Trajectory) -> dict[str, float]:
    """Table 1, and how large the signals themselves are."""
    numbers: dict[str, float] = {}
    for name, (residual, without) in RESIDUAL.items():
        better = 100 * (1 - residual / without)
        numbers[f"residual of {name} in table 1 [m]"] = residual
        numbers[f"what Coulomb friction improves of {name} in table 1 [%]"] = better
        numbers[f"rms of {name} itself [m]"] = float(np.sqrt(np.mean(run[name] ** 2)))
        numbers[f"standard deviation of {name} [m]"] = float(np.std(run[name]))
    numbers["a constant leaves of a body between 0 and 0.135 m, at most [m]"] = RANGE / 2
    return numbers


def start(run: Trajectory) -> dict[str, float]:
    """What figure 7 and sections 5 and 7.2 say of the first ramp."""
    x = np.interp([0.5, 1.5], run.t, run["x_rel"])
    return {
        "the body starts, 0.5 s in figure 7 [s]": float(run.t[np.argmax(run["X_b"] > 1e-4)]),
        "X_w - X_b at 0.5 s, at most 0.0069 m in the paper [m]": float(x[0]),
        "X_w - X_b at 1.5 s, zero or near zero in the paper [m]": float(x[1]),
    }
