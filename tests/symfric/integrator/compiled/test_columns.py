"""Functions applied to columns: the same numbers in every batch, engine and order."""

import casadi as ca
import numpy as np
import pytest

from symfric.integrator.compiled import columns
from symfric.integrator.compiled.columns import CHAINED, SIDE_BY_SIDE, Columns

x, u = ca.SX.sym("x", 2), ca.SX.sym("u")
HALVES = ca.Function("halves", [x, u], [x / 2 + u, x[0] - x[1]])
BOTH = ca.Function("both", [x, u], [x * u])

each_engine = pytest.mark.parametrize("backend", ["vm", "compiled", "auto"])


@each_engine
def test_a_chain_passes_its_first_result_on(backend: str) -> None:
    """x_k+1 = x_k/2 + u_k adds up to a sum of halves."""
    for count in (1, CHAINED - 1, CHAINED, CHAINED + 1, 3 * CHAINED + 5):
        steps = np.arange(count, dtype=float)
        chain = Columns(HALVES, chained=True)
        after, difference = chain([steps], np.array([1.0, 3.0]), backend)
        halves = 0.5 ** np.arange(1, count + 1)
        for k in range(count):
            pushed = (steps[: k + 1] * 0.5 ** np.arange(k, -1, -1)).sum()
            assert after[k] == pytest.approx(np.array([1.0, 3.0]) * halves[k] + pushed, rel=1e-13)
        assert difference.ravel() == pytest.approx(-2 * 2 * halves, rel=1e-9)


@each_engine
def test_columns_in_parallel(backend: str) -> None:
    for count in (0, 1, SIDE_BY_SIDE, SIDE_BY_SIDE + 1):
        pairs, factors = np.arange(2.0 * count).reshape(count, 2), np.arange(float(count))
        (found,) = Columns(BOTH)([pairs, factors], backend=backend)
        np.testing.assert_array_equal(found, pairs * factors[:, None])
    # rows of another size: the loop in C would read beyond their end
    with pytest.raises(ValueError, match=r"rows of 2 numbers|cannot reshape"):
        Columns(BOTH)([np.ones((3, 1)), np.ones(3)], backend=backend)


@each_engine
def test_rows_may_be_reversed_strided_or_picked_from_a_table(backend: str) -> None:
    table, both = np.arange(24.0).reshape(4, 6), Columns(BOTH)
    (found,) = both([table[::-1, 2:4], np.broadcast_to(3.0, (4, 1))], backend=backend)
    np.testing.assert_array_equal(found, 3 * table[::-1, 2:4])
    (found,) = both([table[:, ::3], np.asfortranarray(table)[:, 1]], backend=backend)
    np.testing.assert_array_equal(found, table[:, ::3] * table[:, 1:2])
    which = np.array([3, 0, 0])
    (found,) = both([(table[:, :2], which), np.array([1.0, 2.0, 3.0])], backend=backend)
    np.testing.assert_array_equal(found, table[which, :2] * [[1], [2], [3]])


@each_engine
def test_matrices_zeros_and_empty_arguments(backend: str) -> None:
    A, none = ca.SX.sym("A", 2, 3), ca.SX.sym("none", 0)
    same = Columns(ca.Function("same", [A], [A]))
    (found,) = same([np.arange(12.0).reshape(2, 6)], backend=backend)
    np.testing.assert_array_equal(found, np.arange(12.0).reshape(2, 6))
    sparse = Columns(ca.Function("sparse", [u], [ca.vertcat(u, ca.SX(1, 1), 2 * u)]))
    (found,) = sparse([np.array([1.0, 2.0])], backend=backend)
    np.testing.assert_array_equal(found, [[1, 0, 2], [2, 0, 4]])
    empty = Columns(ca.Function("f", [u, none], [2 * u, none]))
    found, nothing = empty([np.array([1.0, 2.0]), np.zeros((2, 0))], backend=backend)
    np.testing.assert_array_equal(found, [[2], [4]])
    assert nothing.shape == (2, 0)


def test_auto_compiles_when_that_is_expected_to_save_time(monkeypatch: pytest.MonkeyPatch) -> None:
    loaded: list[str] = []

    def load(source: str, name: str) -> object:
        loaded.append(source)
        return columns.__dict__["plain_load"](source, name)

    monkeypatch.setitem(columns.__dict__, "plain_load", columns.load)
    monkeypatch.setattr(columns, "load", load)
    monkeypatch.setattr(columns, "processors", lambda: 1)
    double = Columns(ca.Function("twice", [u], [2 * u]))
    double([np.zeros(1)], backend="auto")
    double.spent = 1.0
    double([np.zeros(1)], backend="vm")
    assert loaded == []
    for _ in range(2):
        double([np.zeros(1)], backend="auto")
    assert ["twice" in source for source in loaded] == [True]
    assert double.spent < 1.1
    monkeypatch.setattr(columns, "find_compiler", lambda: None)
    double = Columns(ca.Function("twice", [u], [2 * u]), spent=100.0)
    (found,) = double([np.array([3.0])], backend="auto")
    np.testing.assert_array_equal(found, [[6.0]])
    assert len(loaded) == 1
