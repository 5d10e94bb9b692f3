"""Symbolic factors, pivot orders and rank, against NumPy."""

import casadi as ca
import numpy as np
import pytest

from symfric.foundation.numeric import Array
from symfric.integrator.equations.matrices import (
    SOUND,
    SymbolicLU,
    backward_error,
    best_order,
    echelon,
    factorise,
    null_space,
    regular,
)

DIAGONAL, SWAPPED = ((0, 0), (1, 1)), ((1, 0), (0, 1))


def random_sparse(n: int, density: float, seed: int) -> Array:
    """Structurally nonsingular: a hidden permutation of large entries, the rest at random."""
    rng = np.random.default_rng(seed)
    values = rng.normal(size=(n, n)) * (rng.random((n, n)) < density)
    values[np.arange(n), rng.permutation(n)] += 3.0 * rng.choice([-1, 1], n)
    return values


def factors(values: Array, safe: tuple[int, ...] = ()) -> tuple[SymbolicLU, ca.Function]:
    """The factors of this pattern, and b -> (x, sign of the determinant, all pivots)."""
    rows, columns = np.nonzero(values)
    pattern = ca.Sparsity.triplet(*values.shape, rows.tolist(), columns.tolist())
    A, b, numbers = ca.SX.sym("a", pattern), ca.SX.sym("b", len(values)), values.T[values.T != 0]
    lu = factorise(A, [safe])
    every = ca.Function("every", [lu.symbols, b], [lu.solve(b), lu.sign(), lu.pivots(range(99))])
    packed = ca.Function("packed", [A], [lu.packed])(ca.DM(pattern, numbers))
    return lu, ca.Function("at", [b], every.call([packed, b]))


def solved(values: Array, safe: tuple[int, ...] = ()) -> tuple[Array, Array]:
    """A solution, and that of dense elimination."""
    b = np.arange(1.0, len(values) + 1)
    x = factors(values, safe)[1](b)[0].full().ravel()
    return x, np.linalg.solve(values, b)


@pytest.mark.parametrize(
    ("n", "density"), [(1, 0.0), (2, 0.5), (5, 0.3), (12, 0.15), (25, 0.08), (6, 1.0)]
)
def test_solution_sign_and_pivots_are_those_of_dense_elimination(n: int, density: float) -> None:
    for seed in range(4):
        values = random_sparse(n, density, seed)
        b = np.random.default_rng(seed).normal(size=n)
        lu, every = factors(values)
        x, sign, pivots = (result.full().ravel() for result in every(b))
        # pivots are chosen for their place, not their size, hence the condition in the tolerance
        bound = 1e-9 * np.linalg.cond(values)
        assert x == pytest.approx(np.linalg.solve(values, b), rel=bound, abs=bound)
        assert sign.item() == np.sign(np.linalg.det(values))
        assert abs(np.prod(pivots)) == pytest.approx(abs(np.linalg.det(values)))
        assert np.count_nonzero(values) <= lu.packed.numel() <= n * n
        for k in (0, 1):
            assert sorted(place[k] for place in lu.order) == list(range(n))
        assert lu.pivots([lu.order[-1][0]]).numel() == 1


def test_arrows_and_bands_have_no_fill() -> None:
    """Whichever row and column an arrow points along; eliminating its hub first would fill all."""
    distance = np.abs(np.subtract.outer(np.arange(15), np.arange(15)))
    cases = [np.where(distance <= bands, 1.0, 0.0) + 3 * np.eye(15) for bands in (1, 2)]
    for hub in (0, 4, 9):
        arrow = 4.0 * np.eye(10)
        arrow[hub, :], arrow[:, hub] = 1.0, 1.0
        cases.append(arrow + np.diag(np.arange(10) == hub))
    for values in cases:
        lu, _ = factors(values, tuple(range(len(values))))
        assert lu.packed.numel() == np.count_nonzero(values)
    arrow = cases[2]
    for size in (4.0, 0.3):  # a tip is a pivot although the hub's entry in its column is larger
        arrow[range(1, 10), range(1, 10)] = size
        assert best_order(arrow != 0, arrow[None])[:4] == tuple((row, row) for row in range(1, 5))


def test_differential_rows_pivot_on_their_diagonal_first() -> None:
    """[M G^T; G 0] of a mechanism; an algebraic row that fills less; tiny steps of a DAE."""
    rng = np.random.default_rng(3)
    G = rng.normal(size=(3, 6))
    saddle = np.block([[np.diag(rng.uniform(1, 2, 6)), G.T], [G, np.zeros((3, 3))]])
    tiny = np.array([[1e12, 0.0, 1.0], [0.0, 1e12, 2.0], [1.0, 3.0, 0.0]])
    easy = np.array([[4.0, 1.0, 1.0], [1.0, 4.0, 1.0], [0.0, 0.0, 1.0]])
    for values, count in ((saddle, 6), (tiny, 2), (easy, 2)):
        safe = tuple(range(count))
        found, expected = solved(values, safe)
        assert found == pytest.approx(expected, rel=1e-9)
        assert sorted(factors(values, safe)[0].order[:count]) == [(i, i) for i in safe]
    found, expected = solved(saddle)
    assert found == pytest.approx(expected, rel=1e-9)


def test_empty_and_singular_matrices() -> None:
    """The step rejects what is not finite."""
    assert factorise(ca.SX(0, 0)).solve(ca.SX(0, 1)).shape == (0, 1)
    x = factors(np.array([[1.0, 2.0], [2.0, 4.0]]))[1]([1.0, 1.0])[0]
    assert not np.isfinite(x.full()).any()
    for entries, rows in (
        ([[1, 1], [0, 0]], r"\[1\]"), ([[1, 0, 0], [1, 1, 0], [0, 1, 0]], r"\[2\]"),
        ([[0, 1, 1], [1, 0, 0], [1, 0, 0]], r"\[\d\]"),
    ):  # fmt: skip
        A = np.array(entries, dtype=float)
        with pytest.raises(ValueError, match=f"nonsingular matrix, .* equations {rows}; an alg"):
            factors(A)
    with pytest.raises(ValueError, match=r"found no pivot for equations \[1\]"):
        best_order(np.array([[1.0, 1.0], [0.0, 0.0]]) != 0, np.array([[[1.0, 1.0], [0.0, 0.0]]]))


@pytest.mark.parametrize(
    ("corner", "sound"), [(1.0, True), (1e-4, True), (1e-14, False), (0, False)]
)
@pytest.mark.parametrize("units", [1e-9, 1.0, 1e9])
def test_small_pivot_is_judged_by_what_it_spoils(corner: float, sound: bool, units: float) -> None:
    A = np.diag([units, 1.0]) @ np.array([[corner, 1.0], [1.0, 1.0 - corner]]) @ np.diag([1.0, 7e5])
    assert regular(A)
    assert (backward_error(A, DIAGONAL) <= SOUND) is sound
    assert backward_error(A, SWAPPED) <= SOUND


def test_regular_and_singular_matrices_are_distinguished_in_any_units() -> None:
    """A stiff oscillator at a long step: the second pivot grows 1e10-fold and is right."""
    assert backward_error(np.array([[1e-5, -1.0], [1.0, 1e-5]]), DIAGONAL) < 1e-10
    for A in (np.ones((2, 2)), np.diag([1.0, 0.0]), np.diag([1e9, 1e-300, 0.0])):
        assert not regular(A)
    for size in (1e-200, 1e200):
        assert regular(np.diag([size, 1.0, 3.0]) @ (np.eye(3) + 0.2))
    empty = np.zeros((0, 0))
    assert (regular(empty), backward_error(empty, ())) == (True, 0.0)
    assert best_order(empty != 0, empty[None]) == ()


def test_order_found_is_sound_in_all_samples_at_once() -> None:
    """Diagonals vanish in one sample each; a hidden permutation is safe in all."""
    for seed in range(3):
        rng = np.random.default_rng(seed)
        n, place = 12, rng.permutation(12)
        samples = np.where(rng.random((4, n, n)) < 0.2, rng.normal(size=(4, n, n)), 0.0)
        for k, A in enumerate(samples):
            np.fill_diagonal(A, 0.0 if k % 2 else 1e-13)
            A[np.arange(n), place] = 5.0
            A *= 10.0 ** rng.integers(-6, 6, (n, 1))
        order = best_order((samples != 0).any(axis=0) | np.eye(n, dtype=bool), samples)
        assert sorted(r for r, _ in order) == sorted(c for _, c in order) == list(range(n))
        assert backward_error(samples, order) < 1e-12
        assert max(backward_error(A, tuple((i, i) for i in range(n))) for A in samples) > 1e-9


@pytest.mark.parametrize("rank", [0, 1, 3, 5])
def test_columns_span_the_matrix_and_null_space_is_mapped_to_zero(rank: int) -> None:
    rng = np.random.default_rng(rank)
    plain = rng.normal(size=(7, rank)) @ rng.normal(size=(rank, 5))
    units = 10.0 ** rng.integers(-8, 8, (7, 1)) * plain * 10.0 ** rng.integers(-8, 8, 5)
    for A in (plain, units):
        columns, B = echelon(A)
        assert (len(columns), columns) == (rank, sorted(columns))
        size = np.abs(A).max(axis=1, keepdims=True, initial=0.0) + 1e-300
        np.testing.assert_allclose(A[:, columns] @ B / size, A / size, atol=1e-10)
        K = null_space(A)
        assert (K.shape, np.linalg.matrix_rank(K)) == ((5, 5 - rank), 5 - rank)
        assert (np.abs(A @ K) <= 1e-10 * (np.abs(A) @ np.abs(K)) + 1e-300).all()


def test_circuits_and_unknowns_without_rates_are_exact() -> None:
    capacitors = np.array([[-1e-6, 1e-6, 0], [1e-6, -1e-6, 0], [0, 0, -2e-6]])
    columns, B = echelon(capacitors)
    assert (columns, B.tolist()) == ([0, 2], [[1, -1, 0], [0, 0, 1]])
    assert null_space(capacitors).tolist() == [[1], [1], [0]]
    assert null_space(np.diag([2.0, 0.0, 1.0, 0.0])).T.tolist() == [[0, 1, 0, 0], [0, 0, 0, 1]]
    assert null_space(np.array([[0.0, 3.0], [0.0, 0.0]])).tolist() == [[1], [0]]
    assert null_space(np.eye(3)).shape == (3, 0)
    assert null_space(np.zeros((0, 0))).shape == (0, 0)
