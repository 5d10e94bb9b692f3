"""Columns of symbols: variables one below the other, and what an expression depends on besides."""

from collections.abc import Iterable, Sequence

import casadi as ca

from symfric.foundation.numeric import Scalar
from symfric.foundation.parameters import Variable


def stacked(rows: Iterable[Scalar]) -> ca.SX:
    """`rows` one below the other, SX (n, 1); no rows where there are none."""
    return ca.vertcat(ca.SX(0, 1), *rows)


def symbols_of(variables: Iterable[Variable]) -> ca.SX:
    """Their symbols, SX (n, 1)."""
    return stacked(v.symbol for v in variables)


def starts_of(variables: Iterable[Variable]) -> ca.SX:
    """Their start values, SX (n, 1); expressions where they depend on other symbols."""
    return stacked(v.start for v in variables)


def at_start(expression: Scalar, variables: Sequence[Variable]) -> ca.DM:
    """Its numbers where `variables`, the only symbols in it, have their start values."""
    starts = ca.SX(starts_of(variables))
    return ca.DM(ca.substitute(ca.SX(expression), symbols_of(variables), starts))


def strays(expression: Scalar, known: ca.SX) -> list[str]:
    """Names of the symbols in `expression` that are not among `known`, each once."""
    declared = {symbol.__hash__() for symbol in ca.symvar(known)}
    found = (str(s) for s in ca.symvar(ca.SX(expression)) if s.__hash__() not in declared)
    return list(dict.fromkeys(found))
