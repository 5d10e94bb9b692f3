"""The colour of residuals against closed forms of AR(1) and AR(2) noise."""

import numpy as np
import pytest
from linear_fits import ar1, coulomb

from identification.verdict.colour import Colour, colour, predictors, whitened

NONE = np.zeros((4000, 0))
RUN = np.arange(4000)


def test_white_noise_has_no_order() -> None:
    found = colour(ar1(4000, 0.0, 1), NONE, RUN)
    assert found.order == 0
    assert found.variance == pytest.approx(1.0, rel=0.06)
    assert found.effective == 4000


def test_correlation_and_effective_samples_of_ar1() -> None:
    found = colour(ar1(4000, 0.9, 1), NONE, RUN)
    assert found.phi == pytest.approx([0.9], abs=0.02)
    assert found.variance == pytest.approx(1.0, rel=0.06)
    assert found.effective == pytest.approx(4000 * 0.1 / 1.9, rel=0.3)


def test_restricted_likelihood_gives_back_what_a_fit_took() -> None:
    """Of 150 samples and four unknowns the plain estimate loses .1 of .9."""
    found = list[float]()
    for seed in range(40):
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
    moved = (
        2.0 / np.abs(1 - (found.phi + np.array([0, h])) @ np.exp(-1j * np.outer([1, 2], w))) ** 2
    )
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
