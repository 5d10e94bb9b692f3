"""Attempts and Functions as C on arrays: the bits of the virtual machine."""

import ctypes

import casadi as ca
import numpy as np
import pytest
from backends import needs_compiler

from symfric import BrownMcPhee, rabinowicz
from symfric.emitter.c99 import DOUBLE, FLOAT
from symfric.foundation.numeric import Array
from symfric.integrator.compiled.compiler import load
from symfric.integrator.equations.inputs import input_data
from symfric.integrator.equations.system import system
from symfric.integrator.methods.attempt import RRow, SRow, build_step
from symfric.integrator.methods.pieces import Written, all_macros, in_c, macros, routine
from symfric.integrator.methods.tableaux import METHODS


def library(*written: Written) -> ctypes.CDLL:
    text = "#include <math.h>\n#include <stdbool.h>\n" + macros(written)
    return load(text + "".join(w.text for w in written), "made")


def place(array: Array) -> ctypes.c_void_p:
    return ctypes.c_void_p(array.ctypes.data)


@pytest.mark.parametrize("kind", [ca.SX, ca.MX])
def test_an_attempt_has_the_bits_of_the_virtual_machine(kind: object) -> None:
    model = rabinowicz(BrownMcPhee())
    whole = system(model, input_data(model, None, 0.0, 1.0))
    step = build_step(whole, METHODS["rodas5p"], kind)
    made = library(in_c(step, "made", ("S", "R"), ("next", "D"), head=""))
    S = SRow.at(0.0, 1e-3, np.array([0.01, 0.02]))
    R = RRow.of(1.0, 1e-6, np.inf, np.full(2, 1e-7), np.zeros(whole.d.numel()))
    ours, D = np.empty(step.numel_out(0)), np.empty(step.numel_out(1))
    for _ in range(30):
        after, bend = (value.full().ravel() for value in step(S, R))
        made.made(place(S), place(R), place(ours), place(D))
        np.testing.assert_array_equal(ours, after)
        np.testing.assert_array_equal(D, bend)
        S[:] = after
    assert S[SRow.T] > 0.01


def test_a_result_without_a_name_is_left_out_with_all_that_only_it_takes() -> None:
    x = ca.SX.sym("x", 2)
    both = ca.Function("both", [x], [ca.sin(x[0]), ca.exp(x)], ["x"], ["s", "e"])
    whole, first = in_c(both, "whole"), in_c(both, "first", results=("s", ""))
    assert whole.head == "static void whole(const double *x, double *s, double *e)"
    assert first.head == "static void first(const double *x, double *s)"
    assert (whole.operations, first.operations) == (3, 1)
    assert macros([whole]) == "#define SF_EXP exp\n#define SF_SIN sin\n"
    assert macros([first]) == "#define SF_SIN sin\n"


def test_sparse_results_are_dense_and_idle_arguments_make_no_warning() -> None:
    x, idle = ca.SX.sym("x", 3), ca.SX.sym("idle", 2)
    sparse = ca.SX(3, 1)
    sparse[1] = 2 * x[1]
    f = ca.Function("f", [x, idle], [sparse, ca.SX(0, 1)], ["x", "idle"], ["y", "none"])
    written = in_c(f, "made", head="")
    assert written.body[:2] == ("(void)idle;", "(void)none;")
    y = np.full(3, np.nan)
    library(written).made(place(np.array([1.0, 2.0, 3.0])), None, place(y), None)
    assert y.tolist() == [0.0, 4.0, 0.0]


def test_what_vanishes_in_single_precision_keeps_a_divisor_from_zero() -> None:
    x = ca.SX.sym("x")
    f = ca.Function("f", [x], [1 / (x + 1e-300), x < np.inf], ["x"], ["y", "finite"])
    assert "1.0e-300" in in_c(f, "made", real=DOUBLE).text
    text = in_c(f, "made", real=FLOAT).text
    assert "1.1754944e-38f" in text
    assert "HUGE_VALF" in text


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
    outer = (
        "void outer(const double *x, const double *d, double *r, double *s);\n"
        "void outer(const double *x, const double *d, double *r, double *s)"
        " { whole(x, d, r, s); }\n"
    )
    library = load(HEADER + text + outer, "outer")
    for x in np.random.default_rng(0).normal(size=(50, 7)):
        place = [np.ascontiguousarray(v) for v in (x[:5], x[5:], np.empty(5), np.empty(1))]
        library.outer(*(ctypes.c_void_p(v.ctypes.data) for v in place))
        ends, product = whole(x[:5], x[5:])
        assert (place[2] == ends.full().ravel()).all()
        assert place[3][0] == float(product)
