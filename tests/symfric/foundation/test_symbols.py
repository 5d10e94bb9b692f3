"""Columns of variables, and symbols that nobody declared."""

import casadi as ca

from symfric.foundation.parameters import Variable
from symfric.foundation.variable import at_start, stacked, starts_of, strays, symbols_of


def test_no_rows_are_a_column_without_rows() -> None:
    for column in (stacked(()), symbols_of(()), starts_of(())):
        assert column.shape == (0, 1)


def test_variables_are_stacked_in_their_order() -> None:
    a = Variable("a", "m", start=2.0)
    b = Variable("b", "m", start=3.0 * a.symbol)
    column = symbols_of((a, b))
    assert column.shape == (2, 1)
    assert ca.is_equal(column[0], a.symbol)
    assert ca.is_equal(column[1], b.symbol)
    assert strays(starts_of((a, b)), ca.SX(0, 1)) == ["a"]
    assert float(at_start(a.symbol**2 + 1, (a,))) == 5.0


def test_strays_are_told_by_the_symbol_and_not_by_its_name() -> None:
    known, other = ca.SX.sym("x"), ca.SX.sym("x")
    assert strays(ca.vertcat(known, other, other), known) == ["x"]
    assert strays(known * known, known) == []
