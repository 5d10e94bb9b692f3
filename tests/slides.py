"""Motions of a mass with friction, and runs of estimators on them."""

from functools import cache

import numpy as np
from one_program import along

import symfric as sf
from symfric.codegen import Block
from symfric.compensation import kalman_estimator, recursive_estimator

H = 1e-3
CURVE = {"mu_s": 6.0, "mu_d": 4.0, "v_s": 5e-3, "sigma_2": 20.0}
BRISTLES = sf.LuGre(sigma_0=1e5, sigma_1=300.0, **CURVE)
STATIC = sf.Stribeck(**CURVE)
MAKE = (recursive_estimator, kalman_estimator)
NOISE = 4e-4


def columns(block: Block, rows: np.ndarray, **parameters: float) -> dict[str, np.ndarray]:
    """Outputs and states of a run by name."""
    p = np.array([parameters.get(v.name, float(v.start)) for v in block.parameters])
    states, outputs = along(block, rows, p)
    names = [*block.outputs, *(v.name for v in block.states)]
    return dict(zip(names, np.hstack([outputs, states]).T, strict=True))


def inputs(block: Block, **signals: np.ndarray) -> np.ndarray:
    ones = np.ones_like(next(iter(signals.values())))
    return np.column_stack([signals.get(v.name, ones) for v in block.inputs])


@cache
def slid(law: sf.Law, n: int, mass: float = 1.0, share: float = 1.0) -> dict[str, np.ndarray]:
    """Motion of a mass at the samples, and the force of the last interval, without noise."""
    random = np.random.default_rng(0)
    t = H * np.arange(n + 1)
    v = 0.1 * np.sin(2 * np.pi * 0.7 * t) + 0.06 * np.sin(2 * np.pi * 1.9 * t)
    friction = np.array([share * float(law.sliding(x, 1.0, 1 if x > 0 else -1)) for x in v[1:]])
    force = mass * np.diff(v) / H + friction + 0.05 * random.standard_normal(n)
    return {"v": v[1:], "force": force}
