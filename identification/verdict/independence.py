"""Whether residuals depend on what was applied and how it moved: added variables under colour.

Residuals and columns of a family are whitened by an autoregressive model, what the fit could still
take up (J) is projected out of both, and the rest is regressed on the columns:

    F = (explained / q) / (rest / (n - k - q))  ~  F(q, n - k - q)     if there is no dependence

For one column this is a cross-correlation with the variance of Bartlett's formula; whitening
makes its distribution right also for coloured residuals and periodic motions, where the usual
limits 1.96/sqrt(n) raise false alarms. The model is first that of the residuals. It takes a missing
harmonic for colour; so unless F is large already, the model is that of what the columns leave of
the residuals, by restricted likelihood where it matters.
Sources: Haugh, J. Am. Stat. Assoc. 71, 1976; Godfrey, Econometrica 46(6), 1978 (added variables);
Ljung, System Identification, 1999, section 16.6.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import final

import numpy as np

from identification.residuals.evaluation import Array
from identification.verdict.colour import Colour, span, whitened
from identification.verdict.colour import colour as autoregressive
from identification.verdict.features import Clue, families
from identification.verdict.order import Count

SURE, UNSURE = 1e-6, 0.02
"""p below which the first test needs no second one, and the second one a better one."""

MANY = 25
"""Rows for each column, from which on a model of what the columns leave can be believed."""


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
        smoothed: see `Family`.
    """

    what: str
    hint: str
    statistic: float
    columns: int
    p: float
    size: float
    share: float
    smoothed: bool


def dependences(
    r: Array, J: Array, colour: Colour, clues: Sequence[Clue], position: Count
) -> Iterator[Dependence]:
    """Test of every family that `clues` give.

    Args:
        r: residuals, shape (n,).
        J: sensitivities, shape (n, k), of any rank.
        colour: of r.
        clues: what it may depend on.
        position: neighbours before each row, see `positions`.
    """
    if not np.any(r):
        return
    basis = span(J)
    power = float(r @ r) / r.size
    for family in families(clues, position):
        columns = family.columns - family.columns.mean(axis=0)
        columns = columns / np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
        found = _added(r, basis, columns, colour.partial, position)
        if found is None:
            continue
        both = span(np.column_stack([basis, columns]), 1e-6)
        if found.p > SURE and r.size >= MANY * both.shape[1]:
            rest = _without(both, r)
            other = autoregressive(rest, both, position, refine=False)
            found = _added(r, basis, columns, other.partial, position) or found
            if found.p < UNSURE and other.order:
                other = autoregressive(rest, both, position)
                found = _added(r, basis, columns, other.partial, position) or found
        share = found.size**2 / power
        yield Dependence(
            what=family.what,
            hint=family.hint,
            statistic=found.statistic,
            columns=found.q,
            p=found.p,
            size=found.size,
            share=share,
            smoothed=family.smoothed,
        )


@final
@dataclass(frozen=True, eq=False)
class _Added:
    """F of added columns, its p, their number, and the size of what they explain."""

    statistic: float
    p: float
    q: int
    size: float


def _added(
    r: Array, basis: Array, columns: Array, partial: Array, position: Count
) -> _Added | None:
    """F of `columns` in r beside `basis` in noise with partial autocorrelations `partial`."""
    from scipy.special import fdtrc  # noqa: PLC0415  (SciPy is loaded by those who fit)

    known = span(whitened(basis, partial, position))
    rest = _without(known, whitened(r, partial, position))
    clean = _without(known, whitened(columns, partial, position))
    new = span(clean, 1e-6)
    q, free = new.shape[1], r.size - known.shape[1] - new.shape[1]
    if not q or free < 2 * q:
        return None
    weights = new.T @ rest
    explained = float(weights @ weights)
    left = max(float(rest @ rest) - explained, np.finfo(float).tiny)
    statistic = explained / q / (left / free)
    size = _explained(columns, basis, clean, rest)
    return _Added(statistic, float(fdtrc(q, free, statistic)), q, size)


def _without(basis: Array, x: Array) -> Array:
    """What is left of x without its part in the span of an orthonormal basis."""
    return x - basis @ (basis.T @ x)


def _explained(columns: Array, basis: Array, clean: Array, rest: Array) -> float:
    """Root mean square of what the columns say of the residuals, before whitening."""
    weights, *_ = np.linalg.lstsq(clean, rest, rcond=1e-6)
    part = _without(basis, columns @ weights)
    return float(np.sqrt(np.mean(part**2)))
