"""Whether residuals depend on what was applied and how it moved: added variables under colour.

Residuals and columns of a family are whitened by the residuals' own autoregressive model, what the
fit could still take up (J) is projected out of both, and the rest is regressed on the columns:

    F = (explained / q) / (rest / (n - k - q))  ~  F(q, n - k - q)     if there is no dependence

For one column this is a cross-correlation with the variance of Bartlett's formula; whitening
makes its distribution right also for coloured residuals and periodic motions, where the usual
limits 1.96/sqrt(n) raise false alarms. The smallest p over families counts against 1 / families
(Bonferroni and Holm).
Sources: Haugh, J. Am. Stat. Assoc. 71, 1976; Godfrey, Econometrica 46(6), 1978 (added variables);
Ljung, System Identification, 1999, section 16.6.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import final

import numpy as np

from identification.residuals.evaluation import Array
from identification.verdict.colour import Colour, span, whitened
from identification.verdict.features import families
from identification.verdict.order import Count


@final
@dataclass(frozen=True, eq=False)
class Dependence:
    """What one family explains of the residuals of one channel.

    Attributes:
        what, hint: see `Family`.
        statistic: F.
        columns: q.
        p: the chance of a larger F without dependence.
        size: root mean square of the part of the residuals that the family explains, in their unit.
        share: its square over that of the residuals.
    """

    what: str
    hint: str
    statistic: float
    columns: int
    p: float
    size: float
    share: float


def dependences(
    r: Array, J: Array, colour: Colour, regressors: Mapping[str, Array], position: Count
) -> Iterator[Dependence]:
    """Test of every family that the regressors of a channel give.

    Args:
        r: residuals, shape (n,).
        J: sensitivities, shape (n, k), of any rank.
        colour: of r.
        regressors: signals by name, shape (n,) each.
        position: neighbours before each row, see `positions`.
    """
    from scipy.special import fdtrc  # noqa: PLC0415  (SciPy is loaded by those who fit)

    if not np.any(r):
        return
    basis = span(J)
    known = span(whitened(basis, colour.partial, position))
    rest = _without(known, whitened(r, colour.partial, position))
    for family in families(regressors, position):
        columns = family.columns - family.columns.mean(axis=0)
        clean = _without(known, whitened(columns, colour.partial, position))
        new = span(clean / np.maximum(np.linalg.norm(columns, axis=0), 1e-300), 1e-6)
        q, free = new.shape[1], r.size - known.shape[1] - new.shape[1]
        if not q or free < 2 * q:
            continue
        weights = new.T @ rest
        explained = float(weights @ weights)
        left = max(float(rest @ rest) - explained, np.finfo(float).tiny)
        statistic = explained / q / (left / free)
        size = _explained(columns, basis, clean, rest)
        yield Dependence(
            family.what,
            family.hint,
            statistic,
            q,
            float(fdtrc(q, free, statistic)),
            size,
            size**2 * r.size / float(r @ r),
        )


def _without(basis: Array, x: Array) -> Array:
    """X less its part in the span of an orthonormal basis."""
    return x - basis @ (basis.T @ x)


def _explained(columns: Array, basis: Array, clean: Array, rest: Array) -> float:
    """Root mean square of what the columns say of the residuals, before whitening."""
    weights, *_ = np.linalg.lstsq(clean, rest, rcond=1e-6)
    part = _without(basis, columns @ weights)
    return float(np.sqrt(np.mean(part**2)))
