"""Covariance of estimates and autoregressive models against closed forms and scatter over seeds."""

from dataclasses import replace

import numpy as np
import pytest
from linear_fits import ar1, coulomb, fitted
from scipy.stats import t as student
from tables import sampled

from identification.verdict.colour import Colour, colour, places, positions, predictors, whitened


def test_white_noise_gives_the_textbook_covariance() -> None:
    J = coulomb(400)
    made = fitted(J, ar1(400, 0.0, 3))
    found = made.sandwich
    s2 = float(made.r @ made.r) / (400 - 4)
    np.testing.assert_allclose(found.white, s2 * np.linalg.inv(J.T @ J), rtol=1e-9)
    np.testing.assert_allclose(found.coloured, found.white, rtol=1e-9)
    np.testing.assert_allclose(found.freedom, 396)


def test_coloured_covariance_is_that_of_its_autocovariance() -> None:
    """B' Sigma B written out."""
    J = coulomb(300)
    found = (made := fitted(J, ar1(300, 0.9, 3))).sandwich
    colour = found.colours[0]
    phi = float(colour.phi[0])
    lag = np.abs(np.subtract.outer(np.arange(300), np.arange(300)))
    sigma = colour.variance / (1 - phi**2) * phi**lag
    B = np.linalg.pinv(J).T
    np.testing.assert_allclose(found.coloured, B.T @ sigma @ B, rtol=1e-6)
    gap = np.delete(np.arange(300), slice(100, 140))  # rows that are missing stay apart
    channel = made.channels[0]
    short = replace(channel, rows=slice(0, 260), t=channel.t[gap])
    again = replace(made, channels=(short,), r=made.r[gap], J=J[gap], gain=np.ones(260)).sandwich
    phi = float(again.colours[0].phi[0])
    sigma = again.colours[0].variance / (1 - phi**2) * phi ** lag[np.ix_(gap, gap)]
    B = np.linalg.pinv(J[gap]).T
    np.testing.assert_allclose(again.coloured, B.T @ sigma @ B, rtol=1e-6)


@pytest.mark.parametrize("rho", sampled([0.9, 0.0], of=2))
def test_values_of_any_size_keep_their_freedom(rho: float) -> None:
    """Squares of their variances would overflow, or vanish."""
    made = fitted(coulomb(300), ar1(300, rho, 3))
    size = np.array([1e90, 1.0, 1e-90, 1e-3])
    found, large = (replace(made, slope=k * made.slope).sandwich for k in (1.0, size[:, None]))
    np.testing.assert_allclose(large.freedom, found.freedom, rtol=1e-12)
    np.testing.assert_allclose(large.coloured, np.outer(size, size) * found.coloured, rtol=1e-12)


@pytest.mark.parametrize("rho", [0.0, 0.9])
def test_intervals_cover(rho: float) -> None:
    seeds, J = 100, coulomb(200)
    inside = np.zeros(4)
    for seed in range(seeds):
        made = fitted(J, ar1(200, rho, seed))
        found = made.sandwich
        reach = student.ppf(0.975, found.freedom) * np.sqrt(np.diag(found.coloured))
        inside += np.abs(made.values) <= reach
    assert ((inside / seeds >= 0.9) & (inside / seeds <= 0.99)).all()


@pytest.mark.parametrize("rho", [0.0, 0.6])
def test_intervals_cover_a_value_in_rows_with_larger_noise(rho: float) -> None:
    """A peak in 16 of 200 rows, with six times the noise; equal variances cover half as often."""
    seeds, peak = 100, np.zeros(200)
    peak[20::25] = peak[21::25] = np.linspace(0.5, 1.5, 8)
    J, size = np.column_stack([coulomb(200), peak]), np.where(peak > 0, 6.0, 1.0)
    inside, named = np.zeros(2), 0
    for seed in range(seeds):
        made = fitted(J, size * ar1(200, rho, seed))
        found, off = made.sandwich, abs(made.values[-1])
        named += found.uneven[-1]
        for k, (C, freedom) in enumerate([(found.coloured, found.freedom), (found.white, [195.0])]):
            inside[k] += off <= student.ppf(0.975, freedom[-1]) * np.sqrt(C[-1, -1])
    assert 0.9 <= inside[0] / seeds <= 0.99
    assert inside[1] / seeds < 0.7
    assert named > 0.95 * seeds


def test_windows_share_the_noise_of_time() -> None:
    channel = replace(fitted(coulomb(50), ar1(50, 0.0, 1)).channels[0], breaks=(20,))
    assert positions(channel)[20] == 0
    assert positions(channel, across_windows=True)[20] == 20
    jumped = replace(channel, t=np.where(channel.t < 0.5, channel.t, channel.t + 0.2))
    assert positions(jumped, across_windows=True)[25] == 0
    assert places(jumped)[25] == 35


def test_freedom_of_a_mean_is_that_of_its_estimated_correlation() -> None:
    """Var of s^2 / (1 - phi)^2, of which s has n degrees and phi the variance (1 - phi^2) / n."""
    n = 2000
    found = fitted(np.ones((n, 1)), ar1(n, 0.9, 3)).sandwich
    (phi,) = found.colours[0].phi
    assert found.freedom[0] == pytest.approx(n / (1 + 2 * (1 + phi) / (1 - phi)), rel=0.05)


def test_what_a_bound_holds_counts_as_known() -> None:
    J = coulomb(400)
    made = fitted(J, ar1(400, 0.0, 3))
    held = replace(made, held=np.array([False, False, False, True])).sandwich
    expected = held.colours[0].white * np.linalg.inv(J[:, :3].T @ J[:, :3])
    np.testing.assert_allclose(held.white[:3, :3], expected, rtol=1e-9)
    assert not held.white[3].any()


NONE = np.zeros((4000, 0))
RUN = np.arange(4000)


def test_order_correlation_and_effective_samples_of_ar1() -> None:
    white, found = (colour(ar1(4000, rho, 1), NONE, RUN) for rho in (0.0, 0.9))
    assert (white.order, white.effective) == (0, 4000)
    assert found.phi == pytest.approx([0.9], abs=0.02)
    assert (white.variance, found.variance) == pytest.approx((1.0, 1.0), rel=0.06)
    assert found.effective == pytest.approx(4000 * 0.1 / 1.9, rel=0.3)
    assert colour(np.sin(RUN[:19]), NONE[:19], RUN[:19]).order == 1  # a sine has two; ten rows each


def test_restricted_likelihood_gives_back_what_a_fit_took() -> None:
    """Of 150 samples and four unknowns the plain estimate loses .1 of .9."""
    found = list[float]()
    for seed in range(30):
        J = coulomb(150)
        e = ar1(150, 0.9, seed)
        r = e - J @ np.linalg.lstsq(J, e, rcond=None)[0]
        found.append(float(colour(r, J, RUN[:150]).phi.sum()))
    assert np.mean(found) == pytest.approx(0.9, abs=0.03)


def test_prediction_errors_are_exact_from_the_first_row_on() -> None:
    """Whitening is the inverse Cholesky factor of the covariance, breaks included."""
    partial, n = np.array([0.8, -0.4]), 7
    phi = predictors(partial)[0][-1]
    gamma = _autocovariance(phi, n)
    position = np.array([0, 1, 2, 3, 0, 1, 2])
    R = gamma[np.abs(np.subtract.outer(range(n), range(n)))]
    R[:4, 4:] = R[4:, :4] = 0
    expected = np.linalg.inv(np.linalg.cholesky(R))
    np.testing.assert_allclose(whitened(np.eye(n), partial, position), expected, atol=1e-12)


def test_spectrum_is_the_transform_of_the_autocovariance() -> None:
    found = Colour(np.array([0.5, 0.2]), 2.0, 100.0, 100, 1.0)
    S, slopes = found.spectrum(512)
    gamma = np.real(np.fft.ifft(S))
    np.testing.assert_allclose(gamma[:5], 2.0 * _autocovariance(found.phi, 5), rtol=1e-9)
    h = 1e-6
    w = 2 * np.pi * np.arange(512) / 512
    A = 1 - (found.phi + np.array([0, h])) @ np.exp(-1j * np.outer([1, 2], w))
    moved = 2.0 / np.abs(A) ** 2
    np.testing.assert_allclose((moved - S) / h, slopes[1], rtol=1e-4, atol=1e-3)
    inverse = np.linalg.inv(2.0 * _autocovariance(found.phi, 2)[[[0, 1], [1, 0]]])
    np.testing.assert_allclose(found.doubt, 2.0 * inverse / 100, rtol=1e-9)


def _autocovariance(phi: np.ndarray, n: int) -> np.ndarray:
    """By the impulse response, unit innovations."""
    h = np.zeros(3000)
    h[0] = 1.0
    for k in range(1, h.size):
        h[k] = sum(p * h[k - j - 1] for j, p in enumerate(phi) if k > j)
    return np.array([h[: h.size - k] @ h[k:] for k in range(n)])
