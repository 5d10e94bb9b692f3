"""Covariance of estimates against closed forms and against the scatter over seeds."""

from dataclasses import replace

import numpy as np
import pytest
from linear_fits import ar1, coulomb, fitted
from scipy.stats import t as student

from identification.verdict.covariance import sandwich
from identification.verdict.minimum import places, positions


def test_white_noise_gives_the_textbook_covariance() -> None:
    J = coulomb(400)
    made = fitted(J, ar1(400, 0.0, 3))
    found = sandwich(made)
    s2 = float(made.r @ made.r) / (400 - 4)
    np.testing.assert_allclose(found.white, s2 * np.linalg.inv(J.T @ J), rtol=1e-9)
    np.testing.assert_allclose(found.coloured, found.white, rtol=1e-9)
    np.testing.assert_allclose(found.freedom, 396)


def test_coloured_covariance_is_that_of_its_autocovariance() -> None:
    """B' Sigma B written out."""
    J = coulomb(300)
    found = sandwich(made := fitted(J, ar1(300, 0.9, 3)))
    colour = found.colours[0]
    phi = float(colour.phi[0])
    lag = np.abs(np.subtract.outer(np.arange(300), np.arange(300)))
    sigma = colour.variance / (1 - phi**2) * phi**lag
    B = np.linalg.pinv(J).T
    np.testing.assert_allclose(found.coloured, B.T @ sigma @ B, rtol=1e-6)
    gap = np.delete(np.arange(300), slice(100, 140))  # rows that are missing stay apart
    channel = made.channels[0]
    short = replace(channel, rows=slice(0, 260), t=channel.t[gap])
    again = sandwich(replace(made, channels=(short,), r=made.r[gap], J=J[gap], gain=np.ones(260)))
    phi = float(again.colours[0].phi[0])
    sigma = again.colours[0].variance / (1 - phi**2) * phi ** lag[np.ix_(gap, gap)]
    B = np.linalg.pinv(J[gap]).T
    np.testing.assert_allclose(again.coloured, B.T @ sigma @ B, rtol=1e-6)


@pytest.mark.parametrize("rho", [0.0, 0.9])
def test_values_of_any_size_keep_their_freedom(rho: float) -> None:
    """Squares of their variances would overflow, or vanish."""
    made = fitted(coulomb(300), ar1(300, rho, 3))
    size = np.array([1e90, 1.0, 1e-90, 1e-3])
    found, large = (sandwich(replace(made, slope=k * made.slope)) for k in (1.0, size[:, None]))
    np.testing.assert_allclose(large.freedom, found.freedom, rtol=1e-12)
    np.testing.assert_allclose(large.coloured, np.outer(size, size) * found.coloured, rtol=1e-12)


@pytest.mark.parametrize("rho", [0.0, 0.9])
def test_intervals_cover(rho: float) -> None:
    seeds, J = 100, coulomb(200)
    inside = np.zeros(4)
    for seed in range(seeds):
        made = fitted(J, ar1(200, rho, seed))
        found = sandwich(made)
        reach = student.ppf(0.975, found.freedom) * np.sqrt(np.diag(found.coloured))
        inside += np.abs(made.values) <= reach
    assert ((inside / seeds >= 0.9) & (inside / seeds <= 0.99)).all()


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
    found = sandwich(fitted(np.ones((n, 1)), ar1(n, 0.9, 3)))
    (phi,) = found.colours[0].phi
    assert found.freedom[0] == pytest.approx(n / (1 + 2 * (1 + phi) / (1 - phi)), rel=0.05)


def test_what_a_bound_holds_counts_as_known() -> None:
    J = coulomb(400)
    made = fitted(J, ar1(400, 0.0, 3))
    held = sandwich(replace(made, held=np.array([False, False, False, True])))
    expected = held.colours[0].white * np.linalg.inv(J[:, :3].T @ J[:, :3])
    np.testing.assert_allclose(held.white[:3, :3], expected, rtol=1e-9)
    assert not held.white[3].any()
