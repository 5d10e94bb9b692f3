"""Functions applied to columns: the same numbers in every batch, engine and order."""

from types import SimpleNamespace

import casadi as ca
import numpy as np
import pytest

from symfric.integrator.compiled import background, columns
from symfric.integrator.compiled.columns import CHAINED, SIDE_BY_SIDE, Columns, Rows

x, u = ca.SX.sym("x", 2), ca.SX.sym("u")

each_engine = pytest.mark.parametrize("backend", ["vm", "compiled", "auto"])


@each_engine
@pytest.mark.parametrize("count", [1, CHAINED - 1, CHAINED, CHAINED + 1, 3 * CHAINED + 5])
def test_chain_carries_its_first_result_along(backend: str, count: int) -> None:
    """x_k+1 = x_k/2 + u_k adds up to a sum of halves."""
    chain = Columns(ca.Function("halves", [x, u], [x / 2 + u, x[0] - x[1]]), chained=True)
    steps = np.arange(count, dtype=float)
    after, difference = chain([steps], np.array([1.0, 3.0]), backend)
    halves = 0.5 ** np.arange(1, count + 1)
    for k in range(count):
        pushed = (steps[: k + 1] * 0.5 ** np.arange(k, -1, -1)).sum()
        assert after[k] == pytest.approx(np.array([1.0, 3.0]) * halves[k] + pushed, rel=1e-13)
    assert difference.ravel() == pytest.approx(-2 * 2 * halves, rel=1e-9)


@each_engine
@pytest.mark.parametrize("count", [0, 1, SIDE_BY_SIDE, SIDE_BY_SIDE + 1])
def test_columns_side_by_side(backend: str, count: int) -> None:
    both = Columns(ca.Function("both", [x, u], [x * u]))
    pairs, factors = np.arange(2.0 * count).reshape(count, 2), np.arange(float(count))
    (found,) = both([pairs, factors], backend=backend)
    np.testing.assert_array_equal(found, pairs * factors[:, None])


@each_engine
def test_rows_of_another_size_are_refused(backend: str) -> None:
    """The loop in C would read beyond their end."""
    both = Columns(ca.Function("both", [x, u], [x * u]))
    with pytest.raises(ValueError, match=r"rows of 2 numbers|cannot reshape"):
        both([np.ones((3, 1)), np.ones(3)], backend=backend)


def test_matrices_are_stored_column_by_column() -> None:
    A = ca.SX.sym("A", 2, 3)
    (found,) = Columns(ca.Function("same", [A], [A]))([np.arange(12.0).reshape(2, 6)])
    np.testing.assert_array_equal(found, np.arange(12.0).reshape(2, 6))


def test_results_with_structural_zeros_are_filled_in() -> None:
    sparse = ca.vertcat(u, ca.SX(1, 1), 2 * u)
    (found,) = Columns(ca.Function("sparse", [u], [sparse]))([np.array([1.0, 2.0])])
    np.testing.assert_array_equal(found, [[1, 0, 2], [2, 0, 4]])


def test_arguments_and_results_may_be_empty() -> None:
    none = ca.SX.sym("none", 0)
    found, empty = Columns(ca.Function("f", [u, none], [2 * u, none]))(
        [np.array([1.0, 2.0]), np.zeros((2, 0))]
    )
    np.testing.assert_array_equal(found, [[2], [4]])
    assert empty.shape == (2, 0)


@each_engine
def test_rows_may_lie_backwards_apart_or_all_in_one_place(backend: str) -> None:
    """As the steps of a run do, swept back with one set of data."""
    table = np.arange(24.0).reshape(4, 6)
    both = Columns(ca.Function("both", [x, u], [x * u]))
    (found,) = both([table[::-1, 2:4], np.broadcast_to(3.0, (4, 1))], backend=backend)
    np.testing.assert_array_equal(found, 3 * table[::-1, 2:4])
    (found,) = both([table[:, ::3], np.asfortranarray(table)[:, 1]], backend=backend)
    np.testing.assert_array_equal(found, table[:, ::3] * table[:, 1:2])


def test_auto_compiles_when_it_is_predicted_to_pay(monkeypatch: pytest.MonkeyPatch) -> None:
    compiled: list[str] = []

    def compile_(function: ca.Function, chained: bool, source: str) -> columns.Rows:
        compiled.append(function.name())
        assert function.name() in source
        return Rows.of(function, chained, source)

    monkeypatch.setattr(columns, "Rows", SimpleNamespace(of=compile_))
    monkeypatch.setattr(background, "processors", lambda: 1)
    double = Columns(ca.Function("twice", [u], [2 * u]))
    double([np.zeros(1)], backend="auto")
    double([np.zeros(1)], backend="vm")
    assert compiled == []
    double.spent = 1.0
    double([np.zeros(1)], backend="vm")
    assert compiled == []
    double([np.zeros(1)], backend="auto")
    double([np.zeros(1)], backend="auto")
    assert len(compiled) == 1


def test_without_a_compiler_auto_stays_in_the_virtual_machine(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(background, "find_compiler", lambda: None)
    double = Columns(ca.Function("twice", [u], [2 * u]), spent=100.0)
    (found,) = double([np.array([3.0])], backend="auto")
    np.testing.assert_array_equal(found, [[6.0]])
