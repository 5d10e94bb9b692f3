"""Where the states of a model start: numbers, and expressions in other states and parameters."""

from collections.abc import Sequence

import casadi as ca

from symfric.foundation.parameters import Variable
from symfric.foundation.symbols import stacked, symbols_of


def start_function(x: Sequence[Variable], u: ca.SX, p: ca.SX) -> ca.Function:
    """Start values of the states as a Function of (values known, which are known, u, p)."""
    n, states = len(x), symbols_of(x)
    known, chosen = ca.SX.sym("known", n), ca.SX.sym("chosen", n)
    rows = [ca.if_else(chosen[i], known[i], v.start) for i, v in enumerate(x)]
    values = stacked(rows)
    for _ in range(2):
        values = ca.substitute(values, states, values)
    arguments = [known, chosen, u, p]
    return ca.Function("start", arguments, [values], ["known", "chosen", "u", "p"], ["x"])
