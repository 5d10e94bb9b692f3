"""Which orders of pivots are sound for numbers, and which are found where one is not."""

import numpy as np
import pytest
from numpy.typing import NDArray

from symfric.integrator.equations.matrices import SOUND, backward_error, best_order, regular

Array = NDArray[np.float64]
DIAGONAL = ((0, 0), (1, 1))
SWAPPED = ((1, 0), (0, 1))


@pytest.mark.parametrize(
    ("corner", "judged"), [(1.0, True), (1e-4, True), (1e-14, False), (0.0, False)]
)
@pytest.mark.parametrize("units", [1e-9, 1.0, 1e9])
def test_small_pivot_is_judged_by_what_it_spoils_whatever_the_units(
    corner: float, judged: bool, units: float
) -> None:
    A = np.diag([units, 1.0]) @ np.array([[corner, 1.0], [1.0, 1.0 - corner]]) @ np.diag([1.0, 7e5])
    assert regular(A)
    assert (backward_error(A, DIAGONAL) <= SOUND) is judged
    assert backward_error(A, SWAPPED) <= SOUND


def test_growth_that_harms_nothing_is_no_reason() -> None:
    """A stiff oscillator at a long step: the second pivot grows 1e10-fold and is right."""
    A = np.array([[1e-5, -1.0], [1.0, 1e-5]])
    assert backward_error(A, DIAGONAL) < 1e-10


@pytest.mark.parametrize("A", [np.ones((2, 2)), np.diag([1.0, 0.0]), np.diag([1e9, 1e-300, 0.0])])
def test_singular_matrix_is_called_so(A: Array) -> None:
    assert not regular(A)


@pytest.mark.parametrize("size", [1e-200, 1e200])
def test_units_make_no_matrix_singular(size: float) -> None:
    assert regular(np.diag([size, 1.0, 3.0]) @ (np.eye(3) + 0.2))


def test_empty_matrix_is_sound() -> None:
    empty = np.zeros((0, 0))
    assert regular(empty)
    assert backward_error(empty, ()) == 0.0
    assert best_order(empty != 0, empty[None]) == ()


@pytest.mark.parametrize("seed", range(5))
def test_order_found_is_sound_in_all_samples_at_once(seed: int) -> None:
    """Diagonals vanish in one sample each; a hidden permutation is safe in all."""
    rng = np.random.default_rng(seed)
    n, place = 12, rng.permutation(12)
    samples = [np.where(rng.random((n, n)) < 0.2, rng.normal(size=(n, n)), 0.0) for _ in range(4)]
    for k, A in enumerate(samples):
        np.fill_diagonal(A, 0.0 if k % 2 else 1e-13)
        A[np.arange(n), place] = 5.0
        A *= 10.0 ** rng.integers(-6, 6, (n, 1))
    pattern = np.any([A != 0 for A in samples], axis=0) | np.eye(n, dtype=bool)
    order = best_order(pattern, np.stack(samples))
    assert sorted(r for r, _ in order) == sorted(c for _, c in order) == list(range(n))
    assert backward_error(np.stack(samples), order) < 1e-12
    assert max(backward_error(A, tuple((i, i) for i in range(n))) for A in samples) > 1e-9


def test_among_sound_pivots_the_one_that_fills_least_is_taken() -> None:
    """An arrow: its hub comes last, or everything would fill."""
    A = 4.0 * np.eye(6)
    A[0, :] = A[:, 0] = 1.0
    assert {(row, row) for row in range(1, 5)} < set(best_order(A != 0, A[None])[:5])


def test_structurally_singular_pattern_is_refused() -> None:
    A = np.array([[1.0, 1.0], [0.0, 0.0]])
    with pytest.raises(ValueError, match=r"found no pivot for equations \[1\]"):
        best_order(A != 0, A[None])
