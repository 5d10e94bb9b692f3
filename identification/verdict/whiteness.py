"""Whether residuals look like white noise: autocorrelations over lags, Ljung and Box in one number.

    rho_k = sum e_i e_(i-k) / sum e_i^2,     Q = sum_k (rho_k - E rho_k)^2 / var rho_k  ~  chi2(L)

over pairs inside a run. Mean and variance are those of residuals r = M e of white noise e, with M
the projection that a fit of n unknowns makes: Q keeps its L degrees of freedom when a fit has taken
much of a short record. No degrees are subtracted for the unknowns of the model, which are no
coefficients of a noise model.
Source: Ljung and Box, Biometrika 65(2), 1978; moments of quadratic forms as in Durbin and Watson.
"""

from dataclasses import dataclass
from typing import final

import numpy as np

from identification.residuals.evaluation import Array
from identification.verdict.colour import span
from identification.verdict.order import Count
from symfric.foundation.brief import brief

LAGS = 25
"""Most lags that are looked at."""


@final
@dataclass(frozen=True, eq=False)
class Whiteness:
    """Autocorrelations of one channel.

    Attributes:
        lags: 1 ... L, shape (L,).
        correlation: rho_k, shape (L,).
        low, high: 95 % limits of white residuals of this fit, shape (L,).
        statistic, p: Q and the chance of a larger one; 0 and 1 where nothing can be tested.
    """

    lags: Array
    correlation: Array
    low: Array
    high: Array
    statistic: float
    p: float

    __repr__ = brief


def whiteness(r: Array, J: Array, position: Count) -> Whiteness:
    """Autocorrelations of residuals and their limits.

    Args:
        r: residuals of one channel in the order of time, shape (n,).
        J: sensitivities to what was fitted, shape (n, k), of any rank.
        position: neighbours before each row, see `positions`; 0 everywhere: nothing to test.
    """
    from scipy.special import chdtrc  # noqa: PLC0415  (SciPy is loaded by those who fit)

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
    found, mean, spread = np.zeros(len(lags)), np.zeros(len(lags)), np.zeros(len(lags))
    for i, lag in enumerate(lags):
        pair = np.flatnonzero(position >= lag)
        found[i] = float(r[pair] @ r[pair - lag]) / power
        mean[i], spread[i] = _moments(Q, pair, lag)
    score = (found - mean) / spread
    statistic = float(score @ score)
    return Whiteness(
        np.array(lags, dtype=float),
        found,
        mean - 1.96 * spread,
        mean + 1.96 * spread,
        statistic,
        float(chdtrc(len(lags), statistic)),
    )


def _moments(Q: Array, pair: Count, lag: int) -> tuple[float, float]:
    """Mean and standard deviation of r'S r / r'r for r = M e, S the symmetric shift by `lag`.

    With f = n - k:  E = tr(MS)/f,  var = 2 (f tr(MSMS) - tr(MS)^2) / (f^2 (f + 2)).
    """
    n, k = Q.shape
    SQ = np.zeros_like(Q)
    np.add.at(SQ, pair, Q[pair - lag] / 2)
    np.add.at(SQ, pair - lag, Q[pair] / 2)
    QSQ = Q.T @ SQ
    first = -float(np.trace(QSQ))
    second = pair.size / 2 - 2 * float((SQ**2).sum()) + float((QSQ**2).sum())
    free = n - k
    variance = 2 * (free * second - first**2) / (free**2 * (free + 2))
    return first / free, float(np.sqrt(max(variance, 1e-12)))
