"""Noise levels of signals from what is left of them, by maximum likelihood.

    sigma_s^2 = sum r^2 / (n_s - d_s),   d_s = tr (J'J)^-1 J_s'J_s

d_s is the share of the parameters that signal s pays for. So a signal weighs as much as it is
exact, whatever its size; one that the model explains badly weighs little.

Source: Y. Bard, Nonlinear Parameter Estimation, 1974, section 4-9.
"""

from math import log

import numpy as np

from identification.residuals.evaluation import Channel
from identification.solving.reduce import square
from identification.solving.task import Point, Task

LEAST = 1e-8
"""Least noise level over the spread of a signal: no simulation is right to more than this."""
NORMAL = 1.4826
"""Standard deviation of normal noise over the median of its magnitude."""


def levels(task: Task, point: Point) -> dict[str, float]:
    """Noise levels [SI] by signal: those given, and those that the residuals at `point` have."""
    found = dict(task.noise)
    shares = _shares(task, point)
    for signal in task.estimated:
        r = np.concatenate([point.evaluation.r[c.rows] for c in _of(task, signal)])
        if task.loss == "squares":
            level = float(np.sqrt(square(r) / max(r.size - shares[signal], 1.0)))
        else:
            level = NORMAL * float(np.median(np.abs(r)))
        found[signal] = max(level, LEAST * task.spread(signal))
    return found


def change(old: dict[str, float], new: dict[str, float]) -> float:
    """Largest change of a noise level, as a logarithm."""
    return max((abs(log(new[s] / old[s])) for s in new), default=0.0)


def objective(task: Task, point: Point) -> float:
    """Minus twice the logarithm of the likelihood, without its constant: lower is likelier."""
    rows = {s: sum(c.t.size for c in _of(task, s)) for s in task.noise}
    return point.cost + sum(2 * n * log(task.noise[s]) for s, n in rows.items())


def _of(task: Task, signal: str) -> list[Channel]:
    return [c for c in task.channels if c.signal == signal]


def _shares(task: Task, point: Point) -> dict[str, float]:
    """Degrees of freedom that the fit takes from each signal."""
    _, J = point.reduced
    _, s, vt = np.linalg.svd(J, full_matrices=False)
    kept = s > 1e-10 * s.max(initial=1e-300)
    directions = vt[kept].T / s[kept]
    whitened = np.einsum("ij,jk->ik", point.J, directions)
    return {
        signal: sum(square(whitened[c.rows]) for c in _of(task, signal)) for signal in task.noise
    }
