import numpy as np
import pytest

from identification.old.precision import precision

RNG = np.random.default_rng(0)
J = RNG.standard_normal((4000, 3)) * [1.0, 100.0, 1e-3]
NOISE = RNG.standard_normal(4000)
FREE = np.zeros(3, dtype=bool)


def test_standard_errors_and_correlation_of_least_squares() -> None:
    found = precision(J, NOISE, FREE)
    covariance = np.linalg.inv(J.T @ J) * float(NOISE @ NOISE) / (4000 - 3)
    np.testing.assert_allclose(found.standard_errors, np.sqrt(np.diag(covariance)), rtol=1e-9)
    error = found.standard_errors
    np.testing.assert_allclose(found.correlation, covariance / np.outer(error, error), atol=1e-9)
    assert found.undetermined == ()


def test_block_errors_agree_for_white_residuals() -> None:
    found = precision(J, NOISE, FREE)
    np.testing.assert_allclose(found.block_errors, found.standard_errors, rtol=0.4)


def test_block_errors_see_residuals_that_persist() -> None:
    slow = np.column_stack([np.ones(4000), J])
    drift = np.repeat(RNG.standard_normal(20), 200)
    found = precision(slow, drift, np.zeros(4, dtype=bool))
    assert found.block_errors[0] == pytest.approx(1 / np.sqrt(20), rel=0.4)
    assert found.standard_errors[0] < 0.1 * found.block_errors[0]


@pytest.mark.parametrize(
    ("columns", "groups"),
    [
        ((J[:, 0], J[:, 1], 7 * J[:, 0]), ((0, 2),)),
        ((J[:, 0], 0 * J[:, 0], J[:, 2]), ((1,),)),
        ((J[:, 0], J[:, 0] + 1e3 * J[:, 2], J[:, 2]), ((0, 1, 2),)),
    ],
)
def test_dependent_columns_are_named_and_have_no_errors(
    columns: tuple[np.ndarray, ...], groups: tuple[tuple[int, ...], ...]
) -> None:
    found = precision(np.column_stack(columns), NOISE, FREE)
    assert found.undetermined == groups
    lost = sorted(i for group in groups for i in group)
    assert np.isnan(found.standard_errors).nonzero()[0].tolist() == lost
    assert np.isnan(found.correlation[lost]).all()


def test_determined_parameters_keep_their_error_beside_a_dependent_pair() -> None:
    alone = precision(J[:, :2], NOISE, FREE[:2])
    beside = precision(np.column_stack([J, 3 * J[:, 2]]), NOISE, np.zeros(4, dtype=bool))
    assert beside.undetermined == ((2, 3),)
    np.testing.assert_allclose(beside.standard_errors[:2], alone.standard_errors, rtol=2e-3)


def test_a_parameter_at_its_bound_counts_as_known() -> None:
    held = np.array([False, True, False])
    found = precision(J, NOISE, held)
    without = precision(J[:, [0, 2]], NOISE, FREE[:2])
    assert np.isnan(found.standard_errors[1])
    np.testing.assert_allclose(found.standard_errors[[0, 2]], without.standard_errors, rtol=1e-9)
