"""Maxwell-slip elements from force and path: a convex problem, then a refinement of the radii.

    F = sum_i k_i e_i + sigma_2 v + offset,   e_i: path x kept within +-r_i by its slider

For given radii r_i (break-away displacements) the e_i are known, and k_i >= 0 is a non-negative
least-squares problem with one minimum. A dense set of radii gives the virgin curve
f(x) = sum k_i min(x, r_i). A few elements are placed where it bends, and then refined together with
their radii, with exact derivatives. They are start values for laws with elements (GMS, Leuven).
Source: Lampaert, Al-Bender, Swevers, Phys. Conf. 2003 (elements from a hysteresis curve);
Rizos and Fassois, Chaos 14(2), 2004 (regression on Maxwell-slip elements).
"""

from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import NDArray

from identification.starts.measured import DEAD, Array, Measured, turning_points
from symfric.foundation import checks

CANDIDATES = 60
"""Number of radii of the dense set, in geometric progression."""
MOST = 6000
"""Default number of samples that are used."""
SHORTEST = 1e-4
"""Smallest radius relative to the travel, unless the steps of the record are larger."""
SPARE = 4
"""Number of additional elements, which are merged with their neighbours later."""
LEAST_EXPLAINED = 0.1
"""Least share of the force that elements must explain."""
STEPS = 40
"""Largest number of evaluations to refine the radii."""


@final
@dataclass(frozen=True, eq=False)
class SlipElements:
    """Maxwell-slip elements in the order in which they slip.

    Attributes:
        k: stiffnesses [N/m], shape (n,), > 0.
        radii: displacements at which the elements slip [m], shape (n,).
        sigma_2: viscous coefficient [N s/m].
        offset: constant force [N].
        loaded: state at the first sample: all elements slipping forwards (1) or backwards (-1), or
            unloaded (0).
        rms: root mean square error [N] over the samples used.
    """

    k: Array
    radii: Array
    sigma_2: float
    offset: float
    loaded: int
    rms: float

    @property
    def levels(self) -> Array:
        """Forces k_i r_i [N] at which the elements slip."""
        return self.k * self.radii

    @property
    def shares(self) -> Array:
        """Shares alpha_i of the elements in the friction, with sum 1."""
        return self.levels / self.levels.sum()

    def force(self, measured: Measured) -> Array:
        """Return the force [N] along records that begin in the state `loaded`."""
        e = _stretches(measured, self.radii, self.loaded)[0]
        return e @ self.k + self.sigma_2 * measured.v + self.offset


def stretches(x: Array, radii: Array, loaded: int = 0) -> tuple[Array, Array]:
    """Return the stretch e of each element along the path `x`, and de/dr, (samples, radii).

    e <- clip(e + dx, -r, r) from e = r `loaded`; exact for any dx in one direction.
    """
    e, slope = np.zeros((x.size, radii.size)), np.zeros((x.size, radii.size))
    e[0], slope[0] = loaded * radii, loaded
    now, moved = e[0].copy(), slope[0].copy()
    for i, dx in enumerate(np.diff(x), start=1):
        free = now + dx
        now = np.clip(free, -radii, radii)
        moved = np.where(now == free, moved, np.sign(free))
        e[i], slope[i] = now, moved
    return e, slope


def fit_elements(
    measured: Measured,
    count: int = 10,
    *,
    viscous: bool = True,
    offset: bool = True,
    most: int = MOST,
) -> SlipElements:
    """Fit `count` elements, or fewer if they explain the data equally well, by least squares.

    Args:
        measured: data with positions or times. The record begins unloaded, or sliding in either
            direction; the best fit of the three is returned.
        count: requested number of elements.
        viscous: also fit sigma_2 >= 0.
        offset: also fit a constant force.
        most: number of samples to use; of more samples, every n-th and all turning points.

    Raises:
        ValueError: no path, no motion, or friction that does not follow the path.
    """
    count = checks.count("fit_elements: count", count)
    used = _thinned(measured, most)
    path, one = _path(used), np.ones(used.v.size)
    travel = max(float(np.ptp(path[r])) for r in used.records)
    if not travel > 0:
        raise ValueError("fit_elements: expected a position that moves, got the same everywhere")
    moves = np.abs(np.diff(path))
    step = float(np.quantile(moves[moves > 0], 0.1))  # shorter elements are not resolved
    shortest = min(max(SHORTEST * travel, step), travel / 4)
    radii = np.geomspace(shortest, travel / 2, CANDIDATES)
    columns = [used.v] * viscous + [one, -one] * offset  # both signs of the offset
    others = np.column_stack([np.zeros((one.size, 0)), *columns])
    trials = [(*_dense(used, others, radii, loaded), loaded) for loaded in (0, 1, -1)]
    w, left, loaded = min(trials, key=lambda trial: trial[1])
    k, explained = w[:CANDIDATES], 1 - left / np.linalg.norm(used.F)
    if not k.any() or explained < LEAST_EXPLAINED:
        raise ValueError(
            "fit_elements: expected a force that increases along the path after each reversal, got "
            f"one that elements explain to {100 * explained:.0f} %; check that its sign is that of "
            "the sliding velocity"
        )

    def improved(start: Array) -> SlipElements:
        return _improved(used, others, start, (viscous, offset, loaded))

    more = improved(_quantiles(radii, k, count + SPARE))
    if more.k.size <= count:
        return more
    both = _merged(more, count), _quantiles(radii, k, count)
    return min(map(improved, both), key=lambda found: found.rms)


def _dense(measured: Measured, others: Array, radii: Array, loaded: int) -> tuple[Array, float]:
    """Return coefficients of a dense set of radii and of the other columns, and the error norm."""
    from scipy.optimize import nnls  # noqa: PLC0415 (slow to import)

    X = np.column_stack([_stretches(measured, radii, loaded)[0], others])
    scale = np.maximum(np.linalg.norm(X, axis=0), 1e-300)
    w, left = nnls(X / scale, measured.F)
    return w / scale, float(left)


def _path(measured: Measured) -> Array:
    if measured.x is None:
        raise ValueError(
            "fit_elements: expected positions or times, got points of velocity and force alone; "
            "pass x= or t="
        )
    return measured.x


def _thinned(measured: Measured, most: int) -> Measured:
    """Return about `most` samples, including the turning points."""
    every = -(-measured.v.size // most)
    if every == 1:
        return measured
    path, kept = _path(measured), list[NDArray[np.intp]]()
    for r in measured.records:
        turns = turning_points(path[r], DEAD * float(np.ptp(path[r])))
        regular = np.arange(0, r.stop - r.start, every)
        kept.append(r.start + np.union1d(regular, np.array(turns, dtype=np.intp)))
    return measured.at(kept)


def _stretches(measured: Measured, radii: Array, loaded: int) -> tuple[Array, Array]:
    path = _path(measured)
    found = zip(*(stretches(path[r], radii, loaded) for r in measured.records), strict=True)
    e, slope = map(np.vstack, found)
    return e, slope


def _quantiles(radii: Array, k: Array, count: int) -> Array:
    """Return radii that divide the force of the dense set evenly."""
    share = np.cumsum(k * radii)
    goals = (np.arange(count) + 0.5) / count * share[-1]
    found = np.interp(goals, np.concatenate([[0.0], share]), np.concatenate([radii[:1], radii]))
    return np.unique(np.maximum.accumulate(found * (1 + 1e-6 * np.arange(count))))


def _merged(elements: SlipElements, count: int) -> Array:
    """Return `count` radii after merging the neighbours that change the virgin curve least."""
    k, levels = elements.k, elements.levels
    while k.size > count:
        pair = np.add(k[:-1], k[1:]), np.add(levels[:-1], levels[1:])
        mean = pair[1] / pair[0]
        first, second = levels[:-1] / k[:-1], levels[1:] / k[1:]
        bend = k[:-1] * (mean - first) * (second - mean)  # lost force times path
        i = int(np.argmin(bend))
        k = np.concatenate([k[:i], pair[0][i : i + 1], k[i + 2 :]])
        levels = np.concatenate([levels[:i], pair[1][i : i + 1], levels[i + 2 :]])
    return levels / k


def _improved(
    measured: Measured, others: Array, radii: Array, kinds: tuple[bool, bool, int]
) -> SlipElements:
    """Refine stiffnesses, log radii and the other coefficients by a trust-region method."""
    from scipy.optimize import least_squares  # noqa: PLC0415 (slow to import)

    viscous, offset, loaded = kinds
    n, size = radii.size, float(np.abs(measured.F).max())
    w = _dense(measured, others, radii, loaded)[0]
    k, rest = w[:n], w[n:]

    def split(w: Array) -> tuple[Array, Array, Array]:
        return np.exp(w[:n]), w[n : 2 * n] * size / np.exp(w[:n]), w[2 * n :]

    def residuals(w: Array) -> Array:
        r, k, rest = split(w)
        return (_stretches(measured, r, loaded)[0] @ k + others @ rest - measured.F) / size

    def slopes(w: Array) -> Array:
        r, k, _ = split(w)
        e, moved = _stretches(measured, r, loaded)
        by_radius = (moved * r - e) * k  # at constant k r
        return np.hstack([by_radius, e / r * size, others]) / size

    start = np.concatenate([np.log(radii), k * radii / size, rest])
    low = np.concatenate([np.log(radii) - 3, np.zeros(n + rest.size)])
    high = np.concatenate([np.log(radii) + 3, np.full(n + rest.size, np.inf)])
    found = least_squares(
        residuals, np.clip(start, low + 1e-9, high - 1e-9),
        jac=slopes,  # pyright: ignore[reportArgumentType]
        bounds=(low, high), x_scale="jac", max_nfev=STEPS,
    )  # fmt: skip
    radii = np.sort(np.exp(found.x[:n]))
    w, left = _dense(measured, others, radii, loaded)
    k, rest = w[:n], w[n:]
    kept = k * radii > 1e-6 * float(k @ radii)
    shift = float(rest[-2] - rest[-1]) if offset else 0.0
    rms = left / float(np.sqrt(measured.F.size))
    return SlipElements(
        k[kept], radii[kept], float(rest[0]) if viscous else 0.0, shift, loaded, rms
    )
