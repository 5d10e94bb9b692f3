import numpy as np
import pytest

from ocp.collocation import radau

DEGREES = range(1, 10)


def test_nodes_are_the_zeros_of_legendre_polynomials() -> None:
    """Real numbers whatever the NumPy: its roots of a polynomial are complex from 2.5 on."""
    for degree in DEGREES:
        nodes = radau(degree).nodes
        assert nodes.dtype == np.float64
        assert nodes[-1] == 1.0
        assert np.all(np.diff(nodes) > 0)
        difference = [0.0] * (degree - 1) + [-1.0, 1.0]  # P_d - P_(d-1)
        zeros = np.polynomial.legendre.legval(2 * nodes[1:] - 1, difference)
        np.testing.assert_allclose(zeros, 0.0, atol=1e-13)


@pytest.mark.parametrize(
    ("degree", "A"),
    [
        (1, [[1.0]]),
        (2, [[5 / 12, -1 / 12], [3 / 4, 1 / 4]]),
        (
            3,
            [
                [
                    (88 - 7 * 6**0.5) / 360,
                    (296 - 169 * 6**0.5) / 1800,
                    (-2 + 3 * 6**0.5) / 225,
                ],
                [
                    (296 + 169 * 6**0.5) / 1800,
                    (88 + 7 * 6**0.5) / 360,
                    (-2 - 3 * 6**0.5) / 225,
                ],
                [(16 - 6**0.5) / 36, (16 + 6**0.5) / 36, 1 / 9],
            ],
        ),
    ],
)
def test_slopes_are_the_inverse_of_the_published_runge_kutta_matrix(
    degree: int, A: list[list[float]]
) -> None:
    scheme = radau(degree)
    np.testing.assert_allclose(scheme.slopes[1:].T, np.linalg.inv(A), rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(scheme.weights, A[-1], rtol=1e-13)  # stiffly accurate


@pytest.mark.parametrize("degree", DEGREES)
def test_slopes_differentiate_polynomials_up_to_the_degree(degree: int) -> None:
    scheme = radau(degree)
    k = np.arange(degree + 1)[:, None]
    exact = k * scheme.nodes[1:] ** np.maximum(k - 1, 0)
    np.testing.assert_allclose(scheme.nodes**k @ scheme.slopes, exact, rtol=1e-11, atol=1e-11)


@pytest.mark.parametrize("degree", DEGREES)
def test_weights_integrate_up_to_degree_2d_minus_2_and_no_further(degree: int) -> None:
    scheme = radau(degree)
    errors = [scheme.weights @ scheme.nodes[1:] ** k - 1 / (k + 1) for k in range(2 * degree)]
    np.testing.assert_allclose(errors[:-1], 0.0, atol=1e-14)
    assert abs(errors[-1]) > 1e-12


@pytest.mark.parametrize("degree", [0, -1, 10, 2.5])
def test_impossible_degrees_are_refused(degree: int) -> None:
    with pytest.raises(ValueError, match=r"radau: degree: expected a whole number from 1 to 9"):
        radau(degree)
