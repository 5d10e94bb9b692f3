"""The covariance of least-squares estimates under coloured noise, from residuals and sensitivities.

    C = B' Sigma B,   B = J (J'J)^-1 (dvalues/dw)',   Sigma = autoregressive model of each channel

C is computed in frequencies (Whittle): B on the grid of times, transformed, weighted by the
spectral density; rows that are missing or belong to windows need no special care.
"""

from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import NDArray

from identification.residuals.evaluation import Array
from identification.verdict.colour import Colour, colour
from identification.verdict.minimum import Minimum
from identification.verdict.order import places, positions

RANK = 1e-7
"""Smallest singular value of the scaled sensitivities, over the largest, that counts."""


@final
@dataclass(frozen=True, eq=False)
class Sandwich:
    """Linearised uncertainty of k values that depend on n coordinates.

    What the residuals do not tell is left where it is: it adds nothing here, and `null` says so.

    Attributes:
        coloured: covariance of the values with the colour of each channel, shape (k, k).
        white: the same if residuals were white with the variance of each channel.
        freedom: effective degrees of freedom of the variances on the diagonal (Satterthwaite;
            that the colour is an estimate counts), shape (k,).
        null: directions of the coordinates along which the residuals do not change, orthonormal
            after multiplication by `size`, shape (n, nullity).
        size: norm of the columns of J; one where it is zero, shape (n,).
        colours: of the channels.
    """

    coloured: Array
    white: Array
    freedom: Array
    null: Array
    size: Array
    colours: tuple[Colour, ...]


def sandwich(found: Minimum) -> Sandwich:
    """Uncertainty of a least-squares fit; noise of different channels is taken as independent."""
    free = ~found.held
    size = np.linalg.norm(found.J * free, axis=0)
    size = np.where(size > 0, size, 1.0)
    scaled = found.J / size * free
    _, s, Vt = np.linalg.svd(scaled * np.sqrt(found.gain)[:, None], full_matrices=False)
    kept = s > RANK * max(float(s[0]) if s.size else 0.0, 1e-300)
    inverse = (Vt[kept].T / s[kept] ** 2) @ Vt[kept]
    bread = scaled @ (inverse @ (found.slope / size).T)  # (rows, k)
    reach = np.abs(bread).max(axis=0, initial=0.0)
    reach = np.where(reach > 0, reach, 1.0)  # variances of variances would overflow
    bread = bread / reach
    felt = scaled * found.gain[:, None]
    k = len(found.names)
    coloured, white, spread = np.zeros((k, k)), np.zeros((k, k)), np.zeros(k)
    colours = list[Colour]()
    for channel in found.channels:
        B = bread[channel.rows]
        there = positions(channel, across_windows=True)
        seen = colour(found.r[channel.rows], felt[channel.rows], there)
        C, wide = _meat(seen, B, places(channel))
        coloured, white, spread = coloured + C, white + seen.white * B.T @ B, spread + wide
        colours.append(seen)
    total = np.diag(coloured) ** 2
    freedom = 2 * np.divide(total, spread, where=spread > 0, out=np.ones(k))
    null = _rest(Vt[kept], found.held) / size[:, None]
    back = np.outer(reach, reach)
    coloured, white = back * coloured, back * white
    return Sandwich(coloured, white, np.maximum(freedom, 1.0), null, size, tuple(colours))


def _rest(rows: Array, held: NDArray[np.bool_]) -> Array:
    """Orthonormal basis of what is free and orthogonal to `rows`, shape (n, nullity)."""
    free = np.flatnonzero(~held)
    inside = rows[:, free]
    _, _, Vt = np.linalg.svd(inside, full_matrices=True)
    null = np.zeros((held.size, free.size - inside.shape[0]))
    null[free] = Vt[inside.shape[0] :].T
    return null


def _meat(found: Colour, bread: Array, place: NDArray[np.int64]) -> tuple[Array, Array]:
    """B' Sigma B of one channel, and the variance of the estimates on its diagonal.

    var c_ii = 2 c_ii^2 / freedom + (dc_ii/dphi)' cov(phi) (dc_ii/dphi)
    """
    if not found.order:
        flat = found.variance * bread.T @ bread
        return flat, 2 * np.diag(flat) ** 2 / found.freedom
    on_grid = np.zeros((int(place.max()) + 1, bread.shape[1]))
    np.add.at(on_grid, place, bread)
    points = 1 << (2 * on_grid.shape[0]).bit_length()
    waves = np.fft.fft(on_grid, points, axis=0)
    S, slopes = found.spectrum(points)
    C = np.real(waves.conj().T @ (S[:, None] * waves)) / points
    slope = slopes @ np.abs(waves) ** 2 / points  # (p, k)
    spread = np.einsum("pi,pq,qi->i", slope, found.doubt, slope)
    return C, 2 * np.diag(C) ** 2 / found.freedom + spread
