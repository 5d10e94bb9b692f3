"""Rank of constant matrices: independent columns and null spaces, exact where they can be."""

import numpy as np
import pytest
from numpy.typing import NDArray

from symfric.integrator.equations.matrices import echelon, null_space

Array = NDArray[np.float64]
CAPACITORS = np.array([[-1e-6, 1e-6, 0], [1e-6, -1e-6, 0], [0, 0, -2e-6]])


@pytest.mark.parametrize("rank", [0, 1, 3, 5])
@pytest.mark.parametrize("units", [False, True])
def test_columns_span_the_matrix_and_null_space_is_mapped_to_zero(rank: int, units: bool) -> None:
    rng = np.random.default_rng(rank)
    A = rng.normal(size=(7, rank)) @ rng.normal(size=(rank, 5))
    if units:
        A = 10.0 ** rng.integers(-8, 8, (7, 1)) * A * 10.0 ** rng.integers(-8, 8, 5)
    columns, B = echelon(A)
    assert len(columns) == rank
    assert columns == sorted(columns)
    size = np.abs(A).max(axis=1, keepdims=True, initial=0.0) + 1e-300
    np.testing.assert_allclose(A[:, columns] @ B / size, A / size, atol=1e-10)
    K = null_space(A)
    assert K.shape == (5, 5 - rank)
    assert np.linalg.matrix_rank(K) == 5 - rank
    assert (np.abs(A @ K) <= 1e-10 * (np.abs(A) @ np.abs(K)) + 1e-300).all()


def test_coefficients_of_a_circuit_are_exact() -> None:
    columns, B = echelon(CAPACITORS)
    assert (columns, B.tolist()) == ([0, 2], [[1, -1, 0], [0, 0, 1]])
    assert null_space(CAPACITORS).tolist() == [[1], [1], [0]]


def test_unknowns_without_rates_are_unit_vectors() -> None:
    assert null_space(np.diag([2.0, 0.0, 1.0, 0.0])).T.tolist() == [[0, 1, 0, 0], [0, 0, 0, 1]]
    assert null_space(np.array([[0.0, 3.0], [0.0, 0.0]])).tolist() == [[1], [0]]
    assert null_space(np.eye(3)).shape == (3, 0)
    assert null_space(np.zeros((0, 0))).shape == (0, 0)
