"""Sparse LU factors as expressions: right against NumPy, and no fill that can be avoided."""

import casadi as ca
import numpy as np
import pytest
from numpy.typing import NDArray

from symfric.integrator.equations.matrices import SymbolicLU, factorise

Array = NDArray[np.float64]


def random_sparse(n: int, density: float, seed: int, zero_diagonal: int = 0) -> Array:
    """Structurally nonsingular: a hidden permutation of large entries, the rest at random."""
    rng = np.random.default_rng(seed)
    values = rng.normal(size=(n, n)) * (rng.random((n, n)) < density)
    values[np.arange(n), rng.permutation(n)] += 3.0 * rng.choice([-1, 1], n)
    return values


def symbols(values: Array) -> ca.SX:
    """One symbol for every nonzero."""
    return ca.SX.sym("a", pattern(values))


def pattern(values: Array) -> ca.Sparsity:
    rows, columns = np.nonzero(values)
    return ca.Sparsity.triplet(values.shape[0], values.shape[1], rows.tolist(), columns.tolist())


def solver(values: Array, safe: tuple[int, ...] = ()) -> tuple[SymbolicLU, ca.Function]:
    """The factors of this pattern and (entries, b) -> x."""
    A, b = symbols(values), ca.SX.sym("b", values.shape[0])
    lu = factorise(A, [safe])
    factor = ca.Function("factor", [A], [lu.packed])
    solve = ca.Function("solve", [lu.symbols, b], [lu.solve(b)])
    return lu, ca.Function("both", [A, b], [solve(factor(A), b)])


def sparse(values: Array) -> ca.DM:
    return ca.DM(pattern(values), values.T[values.T != 0])


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize(("n", "density"), [(1, 0.0), (2, 0.5), (5, 0.3), (12, 0.15), (25, 0.08)])
def test_solution_is_that_of_dense_elimination_with_pivoting(
    n: int, density: float, seed: int
) -> None:
    values = random_sparse(n, density, seed)
    b = np.random.default_rng(seed).normal(size=n)
    x = solver(values)[1](sparse(values), b).full().ravel()
    # pivots are chosen for their place, not their size, hence the condition in the tolerance
    bound = 1e-9 * np.linalg.cond(values)
    assert x == pytest.approx(np.linalg.solve(values, b), rel=bound, abs=bound)


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize(("n", "density"), [(5, 0.3), (12, 0.15), (25, 0.08), (6, 1.0)])
def test_factors_hold_at_most_a_full_matrix(n: int, density: float, seed: int) -> None:
    values = random_sparse(n, density, seed)
    lu, _ = solver(values)
    assert np.count_nonzero(values) <= lu.packed.numel() <= n * n
    assert sorted(row for row, _ in lu.order) == list(range(n))
    assert sorted(column for _, column in lu.order) == list(range(n))


@pytest.mark.parametrize("hub", [0, 4, 9])
def test_arrow_matrix_has_no_fill(hub: int) -> None:
    """Whichever row and column the arrow points along; eliminating the hub first would fill all."""
    values = 4.0 * np.eye(10)
    values[hub, :], values[:, hub] = 1.0, 1.0
    values[hub, hub] = 5.0
    lu, solve = solver(values, safe=tuple(range(10)))
    assert lu.packed.numel() == np.count_nonzero(values) == 28
    b = np.arange(10.0)
    assert solve(sparse(values), b).full().ravel() == pytest.approx(np.linalg.solve(values, b))


@pytest.mark.parametrize("bands", [1, 2])
def test_banded_matrix_has_no_fill(bands: int) -> None:
    n = 15
    distance = np.abs(np.subtract.outer(np.arange(n), np.arange(n)))
    values = np.where(distance <= bands, 1.0 / (1 + distance), 0.0) + 3 * np.eye(n)
    lu, _ = solver(values, safe=tuple(range(n)))
    assert lu.packed.numel() == np.count_nonzero(values)


def saddle_point(n: int, m: int) -> Array:
    """[M G^T; G 0], the matrix of a mechanism with m constraints."""
    rng = np.random.default_rng(3)
    G = rng.normal(size=(m, n))
    return np.block([[np.diag(rng.uniform(1, 2, n)), G.T], [G, np.zeros((m, m))]])


@pytest.mark.parametrize("safe", [(), tuple(range(6))])
def test_saddle_point_with_zero_block_is_solved(safe: tuple[int, ...]) -> None:
    values = saddle_point(6, 3)
    b = np.arange(1.0, 10.0)
    x = solver(values, safe)[1](sparse(values), b).full().ravel()
    assert x == pytest.approx(np.linalg.solve(values, b), rel=1e-9)


def test_differential_rows_pivot_on_their_diagonal_first() -> None:
    lu, _ = solver(saddle_point(6, 3), safe=tuple(range(6)))
    assert sorted(lu.order[:6]) == [(i, i) for i in range(6)]


def test_differential_rows_come_first_even_where_an_algebraic_one_fills_less() -> None:
    values = np.array([[4.0, 1.0, 1.0], [1.0, 4.0, 1.0], [0.0, 0.0, 1.0]])
    lu, _ = solver(values, safe=(0, 1))
    assert sorted(lu.order[:2]) == [(0, 0), (1, 1)]
    assert lu.order[2] == (2, 2)


def test_differential_rows_with_large_diagonal_stay_accurate_for_tiny_steps() -> None:
    """W = M/(gamma h) - J of a DAE whose algebraic row has no entry on the diagonal."""
    values = np.array([[1e12, 0.0, 1.0], [0.0, 1e12, 2.0], [1.0, 3.0, 0.0]])
    b = np.array([1.0, -2.0, 0.5])
    x = solver(values, safe=(0, 1))[1](sparse(values), b).full().ravel()
    assert values @ x == pytest.approx(b, rel=1e-12)


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize(("n", "density"), [(1, 0.0), (3, 0.5), (8, 0.25), (20, 0.1)])
def test_sign_is_that_of_the_determinant(n: int, density: float, seed: int) -> None:
    values = random_sparse(n, density, seed)
    A = symbols(values)
    lu = factorise(A)
    sign = ca.Function("sign", [A], [ca.substitute(lu.sign(), lu.symbols, lu.packed)])
    assert float(sign(sparse(values))) == np.sign(np.linalg.det(values))


def test_empty_matrix_has_an_empty_solution() -> None:
    lu = factorise(ca.SX(0, 0))
    assert lu.solve(ca.SX(0, 1)).shape == (0, 1)


@pytest.mark.parametrize(
    ("entries", "rows"),
    [
        ([[1, 1], [0, 0]], r"\[1\]"),
        ([[1, 0, 0], [1, 1, 0], [0, 1, 0]], r"\[2\]"),
        ([[0, 1, 1], [1, 0, 0], [1, 0, 0]], r"\[\d\]"),
    ],
)
def test_structurally_singular_matrix_is_refused_naming_equations(
    entries: list[list[int]], rows: str
) -> None:
    with pytest.raises(ValueError, match=f"structurally nonsingular matrix, .* equations {rows}"):
        factorise(symbols(np.array(entries, dtype=float)))


def test_singular_numbers_give_infinity_not_a_wrong_answer() -> None:
    """The step rejects what is not finite."""
    values = np.array([[1.0, 2.0], [2.0, 4.0]])
    assert not np.isfinite(solver(values)[1](sparse(values), [1.0, 1.0]).full()).any()


@pytest.mark.parametrize("seed", range(8))
def test_pivots_of_all_rows_multiply_to_the_determinant(seed: int) -> None:
    values = random_sparse(7, 0.4, seed)
    lu = factorise(A := symbols(values))
    pivots = ca.substitute(lu.pivots(range(7)), lu.symbols, lu.packed)
    found = ca.Function("pivots", [A], [pivots])(sparse(values)).full()
    assert abs(np.prod(found)) == pytest.approx(abs(np.linalg.det(values)))
    assert lu.pivots([]).shape == (0, 1)
    assert lu.pivots([lu.order[2][0], lu.order[5][0]]).numel() == 2
