"""Stribeck curve of measured points, and steady parameters of any law from the bins of a curve."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from identification.unknowns.roles import is_scale, parts, velocity
from symfric.foundation import checks
from symfric.foundation.parameters import parameters, symbolise
from symfric.foundation.variable import symbols_of
from symfric.laws.base.law import Law
from symfric.laws.composed.populations import in_steady_sliding

Array = NDArray[np.float64]

BINS = 40
"""Number of bins in each direction, logarithmically spaced in speed."""
SLOWEST = 1e-4
"""Speed relative to the largest one below which samples are at rest."""
SCALES = 24
"""Number of Stribeck velocities tried, logarithmically spaced between slowest and fastest bin."""
EXPONENTS = (0.5, 1.0, 2.0, 4.0)
"""Exponents that are tried by default."""


@final
@dataclass(frozen=True, eq=False)
class BinnedForce:
    """Force as a function of velocity in bins, sorted by velocity.

    Attributes:
        v, F: medians of each bin [m/s], [N], shape (bins,).
        error: standard error of F [N] from the median absolute deviation; 0 for single points.
        count: number of samples in each bin.
    """

    v: Array
    F: Array
    error: Array
    count: Array

    @property
    def both(self) -> bool:
        """True if the motion has both directions, so that an offset is separable from friction."""
        return bool(self.v.min() < 0 < self.v.max())


def samples(where: str, v: object, F: object) -> tuple[Array, Array]:
    """Return velocities and forces as arrays of equal length.

    Raises:
        ValueError: arrays of different lengths.
    """
    speed, force = (checks.array(f"{where}: {n}", x) for n, x in (("v", v), ("F", F)))
    if speed.shape != force.shape:
        raise ValueError(
            f"{where}: expected as many forces as velocities, got {force.size} and {speed.size}"
        )
    return speed, force


def binned(v: Array, F: Array, *, bins: int = BINS, slowest: float = SLOWEST) -> BinnedForce:
    """Return medians over logarithmically spaced bins of speed, separately for each direction.

    Points at few velocities, such as a staircase, are grouped by velocity instead. A median is not
    affected by a few spikes, nor by pre-sliding as long as most samples of a bin slide.

    Args:
        v, F: samples, shape (n,).
        bins: number of bins per direction.
        slowest: speed relative to the largest one below which samples are at rest.

    Raises:
        ValueError: no motion.
    """
    bins = checks.count("binned: bins", bins, least=3)
    speed, force = samples("binned", v, F)
    fastest = float(np.abs(speed).max(initial=0.0))
    moving = np.abs(speed) > slowest * fastest
    if not moving.any():
        raise ValueError("binned: expected samples that move, got velocity 0 everywhere")
    speed, force = speed[moving], force[moving]
    levels = np.unique(speed)
    groups = _by_speed(speed, bins, fastest) if levels.size > 4 * bins else []
    groups = groups or [speed == level for level in levels]
    found = np.array([_median(speed[g], force[g]) for g in groups]).reshape(-1, 4)
    return BinnedForce(*found[np.argsort(found[:, 0], kind="stable")].T)


def _by_speed(v: Array, bins: int, fastest: float) -> list[NDArray[np.bool_]]:
    """Return masks of the bins that contain enough samples."""
    speed, least = np.abs(v), max(3, v.size // 5000)
    edges = np.geomspace(max(np.quantile(speed, 0.005), 1e-12 * fastest), fastest, bins + 1)
    place = np.clip(np.digitize(speed, edges) - 1, 0, bins - 1)
    groups = [(np.sign(v) == side) & (place == k) for side in (-1, 1) for k in range(bins)]
    return [group for group in groups if group.sum() >= least]


def _median(v: Array, F: Array) -> tuple[float, float, float, float]:
    """Return the medians of a bin, the error 1.2533 MAD / .6745 / sqrt(n) of F, and n."""
    middle = float(np.median(F))
    spread = 1.4826 * float(np.median(np.abs(F - middle)))
    return float(np.median(v)), middle, 1.2533 * spread / np.sqrt(F.size), F.size


@final
@dataclass(frozen=True, eq=False)
class StribeckCurve:
    """Curve F = sign(v) [F_C + (F_S - F_C) exp(-|v/v_s|^delta)] + sigma_2 v + offset.

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


def fit_curve(curve: BinnedForce, *, delta: float | None = None) -> StribeckCurve:
    """Fit a Stribeck curve to the bins by least squares with equal weights.

    For each of 24 Stribeck velocities (and exponents .5, 1, 2, 4 unless `delta` is given), the
    levels F_C, F_S - F_C, sigma_2 >= 0 and the offset result from non-negative least squares, which
    has one minimum. The best result is refined in v_s and delta with the levels eliminated. The
    order F_S >= F_C >= 0 holds by construction.

    If the curve does not fall, F_S = F_C and v_s is meaningless.
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


def _columns(curve: BinnedForce, v_s: float, delta: float) -> Array:
    side, speed = np.sign(curve.v), np.abs(curve.v)
    offset = np.full(speed.size, 1.0 if curve.both else 0.0)
    falling = np.exp(-((speed / v_s) ** delta))
    return np.column_stack([side, side * falling, curve.v / speed.max(), offset, -offset])


def _levels(curve: BinnedForce, v_s: float, delta: float) -> tuple[list[float], float]:
    """Return F_C, F_S - F_C, sigma_2 and both parts of the offset, and the norm of the error."""
    from scipy.optimize import nnls  # noqa: PLC0415 (slow to import)

    w, cost = nnls(_columns(curve, v_s, delta), curve.F)
    w[2] /= np.abs(curve.v).max()
    return w.tolist(), float(cost)


TRIED = {0: 1, 1: 16, 2: 8}
"""Number of values tried for each velocity scale, by the number of scales; 5 for more scales."""
STEPS = 2
"""Linear least-squares steps at each trial; one is exact if a law is linear in its levels."""
POLISHED = 3
"""Number of best trials that are refined by nonlinear least squares."""
PULL = 1e-3
"""Weight of the guess relative to the points; it determines parameters that the points do not."""
HIGHEST = 3.0
"""Factor by which levels may exceed their guess."""
WIDE = 10.0
"""Factor by which velocity scales may lie outside the range of speeds in the data."""


def fit_law(
    law: Law, names: Sequence[str], points: BinnedForce, N: float, guess: Mapping[str, float]
) -> dict[str, float]:
    """Return the parameters of the steady curve with the smallest sum of squares over the bins.

    At each combination of velocity scales between the slowest and the fastest bin, the levels
    result from linear least squares within their bounds. The best combinations are refined in all
    parameters together. Parameters that the points do not determine stay at `guess`.

    Args:
        law: law with numbers; its further inputs have their steady values.
        names: names of parameters; those without effect on the steady curve are left out.
        points: bins of velocity [m/s] and force [N].
        N: normal force [N].
        guess: name -> value.
    """
    if names:  # keep those on which the steady force depends
        model, variables = symbolise(law, *names)
        p = symbols_of(variables)
        F = ca.SX(in_steady_sliding(model, ca.SX.sym("v"), N))
        found = ca.which_depends(F, p, 1, False)
        names = [name for name, depends in zip(names, found, strict=True) if depends]
    if not names:
        return {}
    at = _LawFit(law, names, points, N, np.array([guess[n] for n in names]))
    tried = [(at.cost(w), number, w) for number, w in enumerate(map(at.levels, at.trials()))]
    tried.sort(key=lambda trial: trial[:2])
    best, _, end = tried[0]
    for _, _, trial in tried[:POLISHED]:
        w = at.polished(trial)
        cost = at.cost(w)
        if cost < best and at.apart(at.p(w)[0]):
            best, end = cost, w
    return dict(zip(names, at.p(end)[0].tolist(), strict=True))


class _LawFit:
    """Least squares of the steady curve of a law in coordinates w of its parameters p.

        p = exp(w) for velocity scales, scale w for others, p_low + scale w for ordered parameters

    Attributes:
        force: function of p that returns forces (points,) and slopes (points, p).
        floors: (high, low, value): p[high] >= p[low], or p[high] >= value if low is -1.
        strict: (high, low): velocities p[high] > p[low].
    """

    def __init__(
        self, law: Law, names: Sequence[str], points: BinnedForce, N: float, p: Array
    ) -> None:
        known, speed = parameters(law), np.abs(points.v)
        self.known, self.start = [known[n] for n in names], p
        self.F, self.size = points.F, float(np.abs(points.F).max()) or 1.0
        self.ends = float(max(speed.min() / 2, 1e-3 * speed.max())), float(speed.max())
        self.pull = PULL * np.sqrt(self.F.size)
        model, variables = symbolise(law, *names)
        self.force = _forces(model, symbols_of(variables), points.v, N)
        self.floors, self.strict = _orders(model, [x.symbol for x in variables])
        self.logarithmic = np.array([is_scale(p) for p in self.known])
        self.scale = np.where(p == 0, 1.0, np.abs(p))
        lower, upper = (np.array([getattr(p, side) for p in self.known]) / self.scale
                        for side in ("lower", "upper"))  # fmt: skip
        for i in np.flatnonzero(self.logarithmic):
            one, (slow, fast) = self.known[i], self.ends
            ends = sorted(velocity(one, s) for s in (slow / WIDE, fast * WIDE))
            lower[i], upper[i] = np.log([max(ends[0], one.lower), min(ends[1], one.upper)])
        for i in np.flatnonzero([p.role == "level" for p in self.known]):
            upper[i] = min(upper[i], HIGHEST)
        for high, _, _ in self.floors:
            if not self.logarithmic[high]:
                lower[high], upper[high] = 0, 1
        self.lower, self.upper = lower, upper

    def p(self, w: Array) -> tuple[Array, Array]:
        """Return the parameters and their derivatives dp/dw."""
        p = np.where(self.logarithmic, np.exp(np.where(self.logarithmic, w, 0)), self.scale * w)
        slope = np.diag(np.where(self.logarithmic, p, self.scale))
        for high, low, value in self.floors:
            p[high] += p[low] if low >= 0 else value
            slope[high] += slope[low] if low >= 0 else 0.0
        return p, slope

    def w(self, p: Array) -> Array:
        """Return the coordinates of parameters, moved inside the bounds."""
        p = p.copy()
        for high, low, value in self.floors:
            p[high] -= p[low] if low >= 0 else value
        safe = np.log(np.where(self.logarithmic, np.maximum(p, 1e-300), 1.0))
        return np.clip(np.where(self.logarithmic, safe, p / self.scale), self.lower, self.upper)

    def at(self, w: Array) -> tuple[Array, Array]:
        """Return relative force errors and their derivatives; not finite where F is undefined."""
        p, slope = self.p(w)
        F, J = self.force(p)
        with np.errstate(invalid="ignore"):  # infinite slopes times zero
            return (F.full().ravel() - self.F) / self.size, J.full() @ slope / self.size

    def cost(self, w: Array) -> float:
        """Return the sum of squared errors; infinite where the law is undefined."""
        error = self.at(w)[0]
        return float(np.sum(error**2)) if np.isfinite(error).all() else np.inf

    def trials(self) -> Iterator[Array]:
        """Yield starts at combinations of velocity scales (one per field), guess and law values."""
        fields = sorted({p.field for p in self.known if is_scale(p)})
        values = np.geomspace(*self.ends, TRIED.get(len(fields), 5))
        starts = [*zip(self.known, self.start, strict=True)]
        trials = list[Array]()
        for chosen in product(values, repeat=len(fields)):
            by = dict(zip(fields, chosen, strict=True))
            trial = [velocity(p, by[p.field]) if is_scale(p) else x for p, x in starts]
            trials.append(np.array(trial))
        trials += [self.start, np.array([float(p.value) for p in self.known])]
        yield from (self.w(p) for p in trials if self.apart(p))

    def apart(self, p: Array) -> bool:
        """Return True if strictly ordered velocities differ by more than a twentieth."""
        return all(p[high] > 1.05 * p[low] for high, low in self.strict)

    def levels(self, w: Array) -> Array:
        """Return the coordinates after linear least squares in all but the velocity scales."""
        from scipy.optimize import lsq_linear  # noqa: PLC0415 (slow to import)

        if not (linear := ~self.logarithmic).any():
            return w
        lower, upper, begin = self.lower[linear], self.upper[linear], w[linear]
        wide = upper > lower
        for _ in range(STEPS):
            error, J = self.at(w)
            X = J[:, linear]
            if not (np.isfinite(X).all() and np.isfinite(error).all()):
                return w
            rows = np.vstack([X, self.pull * np.eye(begin.size)])
            goal = np.concatenate([X @ w[linear] - error, self.pull * begin])
            found = w[linear].copy()
            within, rest = (lower[wide], upper[wide]), goal - rows[:, ~wide] @ found[~wide]
            found[wide] = lsq_linear(rows[:, wide], rest, within, method="bvls").x
            trial = w.copy()
            trial[linear] = found
            if self.cost(trial) > self.cost(w):
                return w
            w = trial
        return w

    def polished(self, w: Array) -> Array:
        """Return all coordinates after trust-region steps."""
        from scipy.optimize import least_squares  # noqa: PLC0415 (slow to import)

        begin = w.copy()

        def residuals(w: Array) -> Array:
            found = np.concatenate([self.at(w)[0], self.pull * (w - begin)])
            return np.where(np.isfinite(found), found, 1e3)

        def slopes(w: Array) -> Array:
            found = np.vstack([self.at(w)[1], self.pull * np.eye(w.size)])
            return np.where(np.isfinite(found), found, 0.0)

        wide = np.maximum(self.upper, self.lower + 1e-6)
        return least_squares(
            residuals, np.clip(w, self.lower + 1e-9, wide - 1e-9),
            jac=slopes,  # pyright: ignore[reportArgumentType]
            bounds=(self.lower, wide), max_nfev=30,
        ).x  # fmt: skip


def _forces(law: Law, p: ca.SX, v: Array, N: float) -> ca.Function:
    """Return a function of the parameters to forces at velocities `v` and their derivatives."""
    speed, at = ca.SX.sym("v"), ca.MX.sym("p", p.numel())
    F = ca.SX(in_steady_sliding(law, speed, N))
    one = ca.Function("curve", [speed, p], [F, ca.jacobian(F, p)])
    forces, slopes = one.map(v.size)(ca.DM(v).T, at)
    return ca.Function("curves", [at], [forces.T, ca.reshape(slopes, p.numel(), v.size).T])


def _orders(
    law: Law, symbols: Sequence[ca.SX]
) -> tuple[list[tuple[int, int, float]], list[tuple[int, int]]]:
    """Return ordered pairs of values (or of a value and a number), and strictly ordered pairs."""

    def place(value: object) -> int:
        return next((i for i, symbol in enumerate(symbols) if symbol is value), -1)

    floors, strict = list[tuple[int, int, float]](), list[tuple[int, int]]()
    for part in parts(law):
        for strictly, pairs in enumerate((type(part).ordered, type(part).strictly_ordered)):
            for low, high in pairs:
                i, j = place(getattr(part, high)), place(getattr(part, low))
                if strictly and min(i, j) >= 0:
                    strict.append((i, j))
                elif not strictly and i >= 0:
                    floors.append((i, j, 0.0 if j >= 0 else float(getattr(part, low))))
    return floors, strict
