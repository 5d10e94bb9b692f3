"""Large Functions as C functions that call each other: the bits of the virtual machine."""

import ctypes

import casadi as ca
import numpy as np
from backends import needs_compiler

from symfric.integrator.compiled.compiler import load
from symfric.integrator.step.pieces import all_macros, routine

HEADER = "#include <math.h>\n#include <stdbool.h>\n" + all_macros()


def blocks() -> ca.Function:
    """An MX Function that calls two others, one of them twice, with slices and selects between."""
    a = ca.SX.sym("a", 3)
    f = ca.Function("f", [a], [ca.vertcat(ca.sin(a[0]) * a[1], ca.exp(-a[2]))])
    b, h = ca.SX.sym("b", 2), ca.SX.sym("h")
    g = ca.Function("g", [b, h], [b / h, ca.sumsqr(b)])
    x, d = ca.MX.sym("x", 5), ca.MX.sym("d", 2)
    first = f(x[1:4])
    scaled, size = g(first + d, ca.fmax(x[0], 1e-3))
    second = f(ca.vertcat(scaled, size))
    chosen = ca.if_else(size < 1, first, 3 * second)
    ends = ca.vertcat(x[4], chosen, ca.mmax(ca.fabs(scaled)), size)
    return ca.Function("whole", [x, d], [ends, ca.dot(first, second)])


@needs_compiler
def test_calls_have_the_bits_of_the_virtual_machine():
    whole = blocks()
    text = routine(whole, "whole")
    assert text.count("static void") == 3  # f is written once and called twice
    assert text.count("whole_1_f(") == 3
    assert "whole_1_f(a0 + 1, " in text  # a slice is handed over where it stands
    door = (
        "void door(const double *x, const double *d, double *r, double *s);\n"
        "void door(const double *x, const double *d, double *r, double *s)"
        " { whole(x, d, r, s); }\n"
    )
    library = load(HEADER + text + door, "door")
    for x in np.random.default_rng(0).normal(size=(50, 7)):
        place = [np.ascontiguousarray(v) for v in (x[:5], x[5:], np.empty(5), np.empty(1))]
        library.door(*(ctypes.c_void_p(v.ctypes.data) for v in place))
        ends, product = whole(x[:5], x[5:])
        assert (place[2] == ends.full().ravel()).all()
        assert place[3][0] == float(product)


def test_a_function_without_calls_is_one_function():
    x = ca.SX.sym("x", 2)
    text = routine(ca.Function("f", [x, ca.SX.sym("idle")], [ca.sumsqr(x)]), "f")
    assert text.count("static void") == 1
    assert "(void)a1;" in text
