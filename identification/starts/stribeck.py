"""The Stribeck curve of measured points: robust bins, then levels, velocity and exponent."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import NDArray

from symfric.foundation import checks

Array = NDArray[np.float64]

BINS = 40
"""Bins of each direction, logarithmically spaced in speed."""
SLOWEST = 1e-4
"""Speeds below this share of the largest one count as rest."""
SCALES = 24
"""Number of Stribeck velocities tried, logarithmically spaced between slowest and fastest bin."""
EXPONENTS = (0.5, 1.0, 2.0, 4.0)
"""Exponents tried by default."""


@final
@dataclass(frozen=True, eq=False)
class Curve:
    """Force against velocity in bins, sorted by velocity.

    Attributes:
        v, F: medians of each bin [m/s], [N], shape (bins,).
        error: standard error of F [N] from the median absolute deviation; 0 for single points.
        count: samples in each bin.
    """

    v: Array
    F: Array
    error: Array
    count: Array

    @property
    def both(self) -> bool:
        """True if the motion has both directions, which separates an offset from friction."""
        return bool(self.v.min() < 0 < self.v.max())


def samples(where: str, v: object, F: object) -> tuple[Array, Array]:
    """Return velocities and forces as columns of one length.

    Raises:
        ValueError: arrays of different lengths.
    """
    speed, force = (checks.array(f"{where}: {n}", x) for n, x in (("v", v), ("F", F)))
    if speed.shape != force.shape:
        raise ValueError(
            f"{where}: expected as many forces as velocities, got {force.size} and {speed.size}"
        )
    return speed, force


def binned(v: Array, F: Array, *, bins: int = BINS, slowest: float = SLOWEST) -> Curve:
    """Return medians over bins of speed, logarithmically spaced, separately for each direction.

    Points at few velocities, such as a staircase, are grouped by velocity instead. A median ignores
    a few spikes, and pre-sliding as long as most samples of a bin slide.

    Args:
        v, F: samples, shape (n,).
        bins: per direction.
        slowest: share of the largest speed below which samples count as rest.

    Raises:
        ValueError: no motion.
    """
    bins = checks.count("binned: bins", bins, least=3)
    speed, force = samples("binned", v, F)
    fastest = float(np.abs(speed).max(initial=0.0))
    moving = np.abs(speed) > slowest * fastest
    if not moving.any():
        raise ValueError("binned: expected samples that move, got velocity 0 everywhere")
    return _binned(speed[moving], force[moving], bins, fastest)


def _binned(v: Array, F: Array, bins: int, fastest: float) -> Curve:
    levels = np.unique(v)
    if levels.size <= 4 * bins:
        return _medians([v == level for level in levels], v, F)
    speed, least = np.abs(v), max(3, v.size // 5000)
    edges = np.geomspace(max(np.quantile(speed, 0.005), 1e-12 * fastest), fastest, bins + 1)
    place = np.clip(np.digitize(speed, edges) - 1, 0, bins - 1)
    groups = [(np.sign(v) == side) & (place == k) for side in (-1, 1) for k in range(bins)]
    kept = [group for group in groups if group.sum() >= least]
    return _medians(kept or [v == level for level in levels], v, F)


def _medians(groups: Sequence[NDArray[np.bool_]], v: Array, F: Array) -> Curve:
    found = np.array([_median(v[g], F[g]) for g in groups]).reshape(-1, 4)
    return Curve(*found[np.argsort(found[:, 0], kind="stable")].T)


def _median(v: Array, F: Array) -> tuple[float, float, float, float]:
    """Return the medians of a bin, the error 1.2533 MAD / .6745 / sqrt(n) of F's median, and n."""
    middle = float(np.median(F))
    spread = 1.4826 * float(np.median(np.abs(F - middle)))
    return float(np.median(v)), middle, 1.2533 * spread / np.sqrt(F.size), F.size


@final
@dataclass(frozen=True, eq=False)
class StribeckCurve:
    """F = sign(v) [F_C + (F_S - F_C) exp(-|v/v_s|^delta)] + sigma_2 v + offset.

    Attributes:
        F_S, F_C: static and dynamic level [N].
        v_s, delta: Stribeck velocity [m/s] and exponent.
        sigma_2: viscous coefficient [N s/m].
        offset: constant force [N]; 0 if the motion has one direction only.
        rms: root mean square error over the bins [N].
    """

    F_S: float
    F_C: float
    v_s: float
    delta: float
    sigma_2: float
    offset: float
    rms: float

    def force(self, v: Array) -> Array:
        """Return the force [N] at velocities [m/s], without the offset."""
        falling = np.exp(-((np.abs(v) / self.v_s) ** self.delta))
        level = self.F_C + (self.F_S - self.F_C) * falling
        return np.sign(v) * level + self.sigma_2 * v


def fit_curve(curve: Curve, *, delta: float | None = None) -> StribeckCurve:
    """Fit a Stribeck curve to the bins by least squares with equal weights.

    For each of 24 Stribeck velocities (and exponents .5, 1, 2, 4 unless `delta` is given) the
    levels F_C, F_S - F_C, sigma_2 >= 0 and the offset come from non-negative least squares, which
    has one minimum; the best is refined in v_s and delta with the levels eliminated. The order
    F_S >= F_C >= 0 holds by construction.

    For a curve that does not fall, F_S = F_C and v_s is meaningless.
    """
    from scipy.optimize import least_squares, nnls  # noqa: PLC0415 (slow to import)

    speed = np.abs(curve.v)
    exponents = EXPONENTS if delta is None else (delta,)
    scales = np.geomspace(speed.min(), max(speed.max(), speed.min() * 1.01), SCALES)
    tried = [(v_s, d, _levels(curve, v_s, d)[1]) for v_s in scales for d in exponents]
    v_s, best, cost = tried[int(np.argmin([cost for *_, cost in tried]))]
    free = 1 if delta is not None else 2
    if curve.v.size > 3 + free and cost > 1e-12 * np.abs(curve.F).max():
        low = np.log([speed.min(), 0.3])[:free]
        high = np.log([speed.max() * 3, 6.0])[:free]

        def residuals(w: Array) -> Array:
            X = _columns(curve, *[*np.exp(w).tolist(), best][:2])
            return X @ nnls(X, curve.F)[0] - curve.F

        start = np.log([v_s, best])[:free]
        found = least_squares(residuals, start, bounds=(low, high), max_nfev=60)
        if np.sqrt(2 * found.cost) < cost:
            v_s, best = [*np.exp(found.x).tolist(), best][:2]
    w, cost = _levels(curve, v_s, best)
    offset = w[3] - w[4] if curve.both else 0.0
    rms = cost / np.sqrt(curve.v.size)
    return StribeckCurve(w[0] + w[1], w[0], float(v_s), float(best), w[2], offset, float(rms))


def _columns(curve: Curve, v_s: float, delta: float) -> Array:
    side, speed = np.sign(curve.v), np.abs(curve.v)
    offset = np.full(speed.size, 1.0 if curve.both else 0.0)
    falling = np.exp(-((speed / v_s) ** delta))
    return np.column_stack([side, side * falling, curve.v / speed.max(), offset, -offset])


def _levels(curve: Curve, v_s: float, delta: float) -> tuple[list[float], float]:
    """Return F_C, F_S - F_C, sigma_2 and both signs of the offset, and the norm of the error."""
    from scipy.optimize import nnls  # noqa: PLC0415 (slow to import)

    w, cost = nnls(_columns(curve, v_s, delta), curve.F)
    w[2] /= np.abs(curve.v).max()
    return w.tolist(), float(cost)
