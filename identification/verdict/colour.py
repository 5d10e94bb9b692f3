"""Autocorrelation of residuals: autoregressive model of a channel, and test for white noise.

    e_i = phi_1 e_(i-1) + ... + phi_p e_(i-p) + u_i,     u white with variance s^2
    rho_k = sum e_i e_(i-k) / sum e_i^2,     Q = sum_k (rho_k - E rho_k)^2 / var rho_k  ~  chi2(L)

The order p results from Burg's recursion and BIC. The coefficients maximise the restricted
likelihood, which corrects for the n fitted unknowns; otherwise correlations and therefore all
standard errors are too small (by a quarter for 200 samples of AR(1) 0.9 noise and three unknowns).
Mean and variance of rho_k are those of residuals r = M e of white noise e, with the projection M of
the fit: Q keeps its L degrees of freedom when a fit takes much of a short record. No degrees are
subtracted for the unknowns of the model.

Sources: Burg, thesis, Stanford 1975; Cooper and Thompson, Biometrika 64(3), 1977 (restricted
likelihood of ARMA noise); den Haan and Levin, Handbook of Statistics 15, 1997 (order by BIC); Ljung
and Box, Biometrika 65(2), 1978; moments of quadratic forms as in Durbin and Watson.
"""

from dataclasses import dataclass
from importlib import import_module
from typing import Any, NamedTuple, final

import numpy as np
from numpy.typing import NDArray

from identification.residuals.evaluation import Array, Channel
from symfric.foundation.shown import brief

Count = NDArray[np.int64]

MOST = 30
"""Largest order of an autoregressive model."""
REFINED = 6
"""Largest order whose coefficients are refined; higher orders are chosen for long records only."""
NEAR_ONE = 0.9995
"""Largest partial autocorrelation; at one, noise is a random walk without finite variance."""


class Colour(NamedTuple):
    """Autoregressive model of the residuals of one channel.

    Attributes:
        partial: partial autocorrelations, shape (p,), which determine phi.
        variance: variance s^2 of the innovations.
        freedom: degrees of freedom of s^2.
        rows: number of rows of the channel.
        white: variance per degree of freedom under the assumption of white residuals.
    """

    partial: Array
    variance: float
    freedom: float
    rows: int
    white: float

    @property
    def order(self) -> int:
        """Order p of the autoregression."""
        return self.partial.size

    @property
    def phi(self) -> Array:
        """Coefficients of the autoregression, shape (p,)."""
        return predictors(self.partial)[0][-1]

    @property
    def effective(self) -> float:
        """Effective number of independent samples for the estimate of a mean, at most `rows`.

        n_eff = n gamma(0) / (gamma(0) + 2 gamma(1) + 2 gamma(2) + ...)
        """
        relative = predictors(self.partial)[1][0]  # gamma(0) / s^2
        slow = 1 / (1 - float(self.phi.sum())) ** 2
        return float(np.clip(self.rows * relative / slow, 1.0, self.rows))

    def spectrum(self, places: int) -> tuple[Array, Array]:
        """Return the spectral density at `places` frequencies of [0, 2 pi), and its derivatives.

            S(w) = s^2 / |A(w)|^2,   A(w) = 1 - sum phi_j exp(-i w j),   dS/dphi_j = 2 S Re(e/A)

        The shapes are (places,) and (p, places).
        """
        w = 2 * np.pi * np.arange(places) / places
        waves = np.exp(-1j * np.outer(np.arange(1, self.order + 1), w))
        A = 1 - self.phi @ waves
        S = self.variance / np.abs(A) ** 2
        return S, 2 * S * np.real(waves / A)

    @property
    def doubt(self) -> Array:
        """Covariance of the estimated phi, s^2 Gamma^-1 / n, shape (p, p)."""
        p = self.order
        if not p:
            return np.zeros((0, 0))
        table, spread = predictors(self.partial)
        inverse = np.zeros((p, p))  # from the prediction errors of each order
        for k in range(p):
            row = np.zeros(p)
            row[k] = 1.0
            row[:k] = -table[k, :k][::-1]
            inverse += np.outer(row, row) / spread[k]
        return inverse / max(self.freedom, 1.0)


JITTER = 0.5
"""Relative deviation from the usual step above which consecutive rows are not neighbours."""


def positions(channel: Channel, *, across_windows: bool = False) -> Count:
    """Return the number of consecutive neighbours in time before each row, shape (n,).

    A run starts with 0: at the first row, at a break, where time jumps or repeats, and everywhere
    if the channel is unordered. With `across_windows`, a run continues over the breaks of windows
    if time continues, because the noise of a sensor does not depend on windows.
    """
    n = channel.t.size
    if not channel.ordered:
        return np.zeros(n, dtype=np.int64)
    starts = np.zeros(n, dtype=bool)
    starts[:1] = True
    starts[1:] = ~(np.abs(np.diff(channel.t) / _step(channel.t) - 1) < JITTER)
    if not across_windows:
        starts[[b for b in channel.breaks if 0 < b < n]] = True
    here = np.arange(n, dtype=np.int64)
    return here - np.maximum.accumulate(np.where(starts, here, 0))


def places(channel: Channel) -> Count:
    """Return the index of each row on the grid of the usual step, shape (n,).

    Rows of equal time have the same index. If the times are not on a grid, rows are counted, with
    one index left out at every gap.
    """
    n = channel.t.size
    if not channel.ordered or n < 2:
        return np.arange(n, dtype=np.int64)
    steps = (channel.t - channel.t[0]) / _step(channel.t)
    grid = np.rint(steps)
    if np.abs(steps - grid).max() < 0.2 and steps.min() >= 0 and grid.max() < 20 * n:
        return grid.astype(np.int64)
    return np.cumsum(1 + (positions(channel, across_windows=True) == 0)).astype(np.int64) - 2


def lagged(signal: Array, position: Count, lag: int) -> Array:
    """Return `signal` delayed by `lag` rows; before the start of a run it has its first value."""
    back = np.minimum(position, lag)
    return signal[np.arange(signal.shape[0]) - back]


def _step(t: Array) -> float:
    """Return the usual step between consecutive rows."""
    steps = np.diff(t)
    steps = steps[steps > 0]
    return float(np.median(steps)) if steps.size else 1.0


def colour(r: Array, J: Array, position: Count, *, refine: bool = True) -> Colour:
    """Fit the autoregressive model to residuals of a fit with sensitivities J.

    Args:
        r: residuals of one channel in order of time, shape (n,).
        J: sensitivities of the residuals to the fitted values, shape (n, k), of any rank.
        position: number of neighbours before each row, see `positions`.
        refine: whether to refine Burg's coefficients by the restricted likelihood.
    """
    basis = span(J)
    n, k = basis.shape
    if n - k < 3 or not np.any(r):
        left = max(1.0, float(n - k))
        found = float(r @ r) / left
        return Colour(np.zeros(0), found, left, n, found)
    white = _likelihood(np.zeros(0), r, basis, position)[1]
    partial = _burg(r, position, most=int(min(MOST, 10 * np.log10(n), (n - k) // 10)))
    if refine and 0 < partial.size <= REFINED and k:
        partial = _refined(partial, r, basis, position)
    variance = _likelihood(partial, r, basis, position)[1]
    return Colour(partial, variance, float(n - k), n, white)


def whitened(x: Array, partial: Array, position: Count) -> Array:
    """Return the prediction errors of each column of x, shape of x, scaled to the variance of u.

    The first rows of a run are predicted from the available rows.
    """
    table, spread = predictors(partial)
    first = np.flatnonzero(position < partial.size)
    out = x.copy()
    for j in range(1, partial.size + 1):
        out[j:] -= table[-1, j - 1] * x[:-j]
    out[first] = x[first]
    wide = (-1,) + (1,) * (x.ndim - 1)
    for j in range(1, partial.size + 1):
        here = first[position[first] >= j]
        out[here] -= table[position[here], j - 1].reshape(wide) * x[here - j]
    out[first] /= np.sqrt(spread[position[first]]).reshape(wide)
    return out


def predictors(partial: Array) -> tuple[Array, Array]:
    """Return the best predictors of order 0 ... p, (p+1, p), and their error variances / s^2.

    They result from the partial autocorrelations by the Levinson-Durbin recursion.
    """
    p = partial.size
    table = np.zeros((p + 1, p))
    for m, c in enumerate(partial):
        table[m + 1, :m] = table[m, :m] - c * table[m, :m][::-1]
        table[m + 1, m] = c
    shrink = np.concatenate([[1.0], np.cumprod(1 - partial**2)])
    return table, shrink / shrink[-1]


def span(J: Array, tolerance: float = 1e-9) -> Array:
    """Return an orthonormal basis of the columns of J, shape (rows, rank)."""
    size = np.linalg.norm(J, axis=0)
    used = J[:, size > 0] / size[size > 0]
    if not used.size:
        return np.zeros((J.shape[0], 0))
    U, s, _ = np.linalg.svd(used, full_matrices=False)
    return U[:, s > tolerance * s[0]]


def deviance(partial: Array, r: Array, basis: Array, position: Count) -> float:
    """Return -2 log of the likelihood up to a constant, plus the penalty of BIC.

        n log(|u|^2 / n) + log |Sigma / s^2| + (k + p) log n

    Args:
        partial: partial autocorrelations, shape (p,).
        r: residuals, shape (n,).
        basis: orthonormal basis of the regressors, shape (n, k).
        position: number of neighbours before each row.
    """
    both = whitened(np.column_stack([basis, r]), partial, position)
    n, k = basis.shape
    R: Array = np.asarray(np.linalg.qr(both, mode="r"))
    left = float(R[k, k]) ** 2
    spread = predictors(partial)[1][np.minimum(position, partial.size)]
    unlikely = n * np.log(max(left, np.finfo(float).tiny) / n) + float(np.log(spread).sum())
    return unlikely + (k + partial.size) * float(np.log(n))


def _burg(r: Array, position: Count, most: int) -> Array:
    """Return the partial autocorrelations up to the order with the smallest BIC."""
    f, b = r.copy(), r.copy()
    partial = list[float]()
    total, best, order = 0.0, 0.0, 0
    for m in range(1, most + 1):
        near = position[1:] >= m
        front, back = f[1:][near], b[:-1][near]
        size = float(front @ front + back @ back)
        if front.size < 2 * m + 2 or not size > 0:
            break
        c = float(np.clip(2 * float(front @ back) / size, -NEAR_ONE, NEAR_ONE))
        b[1:] = np.where(near, b[:-1] - c * f[1:], b[1:])
        f[1:][near] = front - c * back
        partial.append(c)
        total += front.size * np.log(1 - c * c) + np.log(r.size)
        if total < best:
            best, order = total, m
    return np.array(partial[:order])


def _likelihood(partial: Array, r: Array, basis: Array, position: Count) -> tuple[float, float]:
    """Return -2 log of the restricted likelihood up to a constant, and the variance s^2.

    (n - k) log s^2 + log |Sigma / s^2| + log |B' (Sigma / s^2)^-1 B|
    """
    both = whitened(np.column_stack([basis, r]), partial, position)
    k, free = basis.shape[1], r.size - basis.shape[1]
    R: Array = np.asarray(np.linalg.qr(both, mode="r"))
    variance = max(float(R[k, k]) ** 2 / free, np.finfo(float).tiny)
    spread = predictors(partial)[1][np.minimum(position, partial.size)]
    inside = 2 * float(np.log(np.abs(np.diag(R)[:k])).sum())
    return free * np.log(variance) + float(np.log(spread).sum()) + inside, variance


def _refined(partial: Array, r: Array, basis: Array, position: Count) -> Array:
    """Maximise the restricted likelihood over the partial autocorrelations, starting at Burg's."""
    optimize: Any = import_module("scipy.optimize")  # slow to import

    def cost(z: Array) -> float:
        return _likelihood(NEAR_ONE * np.tanh(z), r, basis, position)[0]

    start = np.arctanh(np.clip(partial / NEAR_ONE, -0.999, 0.999))
    found = optimize.minimize(
        cost, start, method="BFGS", options={"gtol": 1e-4 * r.size, "maxiter": 20}
    )
    better = np.isfinite(found.fun) and found.fun <= cost(start)
    return NEAR_ONE * np.tanh(found.x) if better else partial


LAGS = 25
"""Largest number of tested lags."""


@final
@dataclass(frozen=True, eq=False)
class Whiteness:
    """Autocorrelations of one channel with a test for white noise.

    Attributes:
        lags: 1 ... L, shape (L,).
        correlation: rho_k, shape (L,).
        low, high: 95 % limits for white residuals of this fit, shape (L,).
        statistic, p: Q and its p-value; 0 and 1 if no lag can be tested.
    """

    lags: Array
    correlation: Array
    low: Array
    high: Array
    statistic: float
    p: float

    __repr__ = brief


def whiteness(r: Array, J: Array, position: Count) -> Whiteness:
    """Compute the autocorrelations of residuals and their limits.

    Args:
        r: residuals of one channel in order of time, shape (n,).
        J: sensitivities to the fitted values, shape (n, k), of any rank.
        position: number of neighbours before each row, see `positions`; if all are 0, no lag is
            tested.
    """
    from scipy.special import chdtrc  # noqa: PLC0415  (slow to import)

    Q = span(J)
    n, k = Q.shape
    power = float(r @ r)
    lags = [
        lag
        for lag in range(1, min(LAGS, max(1, n // 4)) + 1)
        if (position >= lag).sum() > max(n // 4, 2 * k, 3)
    ]
    if not lags or not power > 0:
        none = np.zeros(0)
        return Whiteness(none, none, none, none, 0.0, 1.0)
    pairs = [np.flatnonzero(position >= lag) for lag in lags]
    each = [*zip(pairs, lags, strict=True)]
    found = np.array([float(r[pair] @ r[pair - lag]) / power for pair, lag in each])
    mean, spread = np.array([_moments(Q, pair, lag) for pair, lag in each]).T
    score = (found - mean) / spread
    statistic = float(score @ score)
    low, high = mean - 1.96 * spread, mean + 1.96 * spread
    p = float(chdtrc(len(lags), statistic))
    return Whiteness(np.array(lags, dtype=float), found, low, high, statistic, p)


def _moments(Q: Array, pair: Count, lag: int) -> tuple[float, float]:
    """Return mean and deviation of r'S r / r'r for r = M e and the symmetric shift S by `lag`.

    With f = n - k:  E = tr(MS)/f,  var = 2 (f tr(MSMS) - tr(MS)^2) / (f^2 (f + 2)).
    """
    n, k = Q.shape
    SQ = np.zeros_like(Q)
    SQ[pair] += Q[pair - lag] / 2
    SQ[pair - lag] += Q[pair] / 2
    QSQ = Q.T @ SQ
    first = -float(np.trace(QSQ))
    second = pair.size / 2 - 2 * float((SQ**2).sum()) + float((QSQ**2).sum())
    free = n - k
    variance = 2 * (free * second - first**2) / (free**2 * (free + 2))
    return first / free, float(np.sqrt(max(variance, 1e-12)))
