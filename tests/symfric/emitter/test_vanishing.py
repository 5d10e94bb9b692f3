"""Constants below the range of float."""

import casadi as ca

from symfric.emitter.c99 import DOUBLE, FLOAT, SMALLEST_FLOAT, representable
from symfric.foundation.graph import graph


def test_what_vanishes_in_float_is_the_smallest_that_does_not_and_double_is_left_alone() -> None:
    x = ca.SX.sym("x")
    whole = graph(ca.Function("f", [x], [x - 1e-67, x * 2e-45, x + 3.0, x / 1e-30]))
    assert representable(whole, DOUBLE) is whole
    before = sorted(n.value for n in whole.nodes if n.op == ca.OP_CONST)
    after = sorted(n.value for n in representable(whole, FLOAT).nodes if n.op == ca.OP_CONST)
    assert min(map(abs, before)) < 1e-60
    assert min(map(abs, after)) == SMALLEST_FLOAT
    assert {abs(v) for v in after} == {SMALLEST_FLOAT, 1e-30, 3.0}
