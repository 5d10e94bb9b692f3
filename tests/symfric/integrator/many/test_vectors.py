"""Members in vector lanes: the functions of lanes.h, and independence of the neighbouring lanes."""

import ctypes
from collections.abc import Callable
from typing import Any

import casadi as ca
import numpy as np
import pytest
from backends import needs_compiler
from differentiable import oscillator
from ensembles import explosive

from symfric import Ensemble, LuGre, Model, rabinowicz, simulate_many
from symfric.integrator.compiled.compiler import load
from symfric.integrator.many import vectors
from symfric.integrator.many.vectors import lanes_header, vector_source

LOOP = """
void apply(const double *x, const double *y, double *out, long long n)
{
  V a, b, o[ROWS], w[WORK + 1];
  const V *arg[2] = {&a, &b};
  V *res[1] = {o};
  for (long long k = 0; k < n; k += LANES) {
    for (int l = 0; l < LANES; ++l) a[l] = x[k + l], b[l] = y[k + l];
    f(arg, res, w);
    for (int i = 0; i < ROWS; ++i)
      for (int l = 0; l < LANES; ++l) out[i * n + k + l] = o[i][l];
  }
}
"""
ARITHMETIC: dict[str, Callable[[ca.SX, ca.SX], ca.SX]] = {
    "sum": lambda x, y: x + y, "difference": lambda x, y: x - y, "product": lambda x, y: x * y,
    "quotient": lambda x, y: x / y, "square": lambda x, y: x * x, "negative": lambda x, y: -x,
    "inverse": lambda x, y: 1 / x, "root": lambda x, y: ca.sqrt(x), "size": lambda x, y: ca.fabs(x),
    "sign": lambda x, y: ca.sign(x), "smaller": ca.fmin, "larger": ca.fmax,
    "less": lambda x, y: x < y, "at most": lambda x, y: x <= y, "equal": lambda x, y: x == y,
    "other": lambda x, y: x != y, "both": ca.logic_and, "one": ca.logic_or,
    "not": lambda x, y: ca.logic_not(x), "choice": lambda x, y: ca.if_else(x < y, x, y),
    "choice by a number": lambda x, y: ca.if_else(x, y, 2 * x),
    "half a choice": lambda x, y: ca.if_else(y > x, x, 0), "count": lambda x, y: (x < y) + (x > 1),
    "floor": lambda x, y: ca.floor(x), "erf": lambda x, y: ca.erf(x), "constant": lambda x, y: 0.1,
    "sinh": lambda x, y: ca.sinh(x), "fmod": ca.fmod, "sign of": ca.copysign,
}  # fmt: skip
"""Operations that are equal to those of CasADi's virtual machine to the bit."""

UNITS: dict[str, tuple[Callable[..., ca.SX], Callable[..., np.ndarray], float]] = {
    "exp": (ca.exp, np.exp, 1.0), "expm1": (ca.expm1, np.expm1, 2.0), "log": (ca.log, np.log, 1.0),
    "tanh": (ca.tanh, np.tanh, 3.0), "sin": (ca.sin, np.sin, 1.0), "cos": (ca.cos, np.cos, 1.0),
    "tan": (ca.tan, np.tan, 2.5), "atan": (ca.atan, np.arctan, 2.0),
    "asin": (ca.asin, np.arcsin, 3.0), "acos": (ca.acos, np.arccos, 4.0),
}  # fmt: skip
"""Function, the same of NumPy, and how many units of the last place it may be off."""

SPECIAL = np.array([
    0.0, -0.0, np.inf, -np.inf, np.nan, 5e-324, -5e-324, 1e-310, 1e-300, -1e300, 1.0, -1.0, 0.5,
    709.7, 709.79, -708.5, -745.0, -746.5, 1e6, 1.0001e6, 1e22, 20.0, -40.0, np.pi, 1e-9, 1e18,
])  # fmt: skip


def applied(function: ca.Function, x: np.ndarray, y: np.ndarray, lanes: int = 0) -> np.ndarray:
    """Rows of a Function of (x, y), an entry for each pair."""
    rows, pad = function.numel_out(0), -x.size % 8
    x, y = (np.concatenate([a, a[:pad]]) for a in (x, y))
    text, work = vector_source("f", function)
    sizes = f"#define ROWS {rows}\n#define WORK {work}\n"
    library = load(lanes_header(lanes) + text + sizes + LOOP, "apply")
    found = np.empty((rows, x.size))
    library.apply(
        *(ctypes.c_void_p(a.ctypes.data) for a in (x, y, found)), ctypes.c_longlong(x.size)
    )
    return found[:, : x.size - pad]


def together(*expressions: Callable[[ca.SX, ca.SX], ca.SX]) -> ca.Function:
    x, y = ca.SX.sym("x"), ca.SX.sym("y")
    rows = ca.vertcat(*(ca.densify(ca.SX(f(x, y))) for f in expressions))
    return ca.Function("f", [x, y], [rows])


def numbers() -> tuple[np.ndarray, np.ndarray]:
    """Pairs of ordinary, large, tiny and special numbers."""
    rng = np.random.default_rng(1)
    x = np.concatenate([
        rng.normal(size=2000), rng.uniform(-700, 700, 2000), np.arange(-2000, 2000) * np.pi / 2,
        rng.normal(size=2000) * 10.0 ** rng.uniform(-12, 5, 2000), rng.uniform(-1e6, 1e6, 2000),
        1 + rng.normal(size=1000) * 1e-4, np.repeat(SPECIAL, SPECIAL.size),
    ])  # fmt: skip
    y = np.concatenate([
        rng.normal(size=x.size - SPECIAL.size**2) * 10.0 ** rng.uniform(-3, 1.0, 1),
        np.tile(SPECIAL, SPECIAL.size),
    ])  # fmt: skip
    return x, y


def units(found: np.ndarray, exact: np.ndarray) -> np.ndarray:
    """Error in units of the last place; 0 where both are the same, not finite numbers included."""
    as_double = exact.astype(float)
    same = (found == as_double) | (np.isnan(found) & np.isnan(as_double))
    finite = np.isfinite(found) & np.isfinite(as_double)
    off = np.abs(found - exact) / np.spacing(np.abs(as_double))
    return np.where(same & ~finite, 0.0, np.where(finite, off, np.inf)).astype(float)


def test_arithmetic_has_the_bits_of_the_virtual_machine(monkeypatch: pytest.MonkeyPatch) -> None:
    """Cut into parts, which pass on their results."""
    x, y = numbers()
    function = together(*ARITHMETIC.values())
    exact = function.map(x.size)(x[None], y[None]).full()
    monkeypatch.setattr(vectors, "PART", 3)
    found = applied(function, x, y)
    for name, one, other in zip(ARITHMETIC, found, exact, strict=True):
        np.testing.assert_array_equal(one, other, name)
        zero = (other == 0) & (name not in ("smaller", "larger"))  # C leaves that open
        np.testing.assert_array_equal(np.signbit(one[zero]), np.signbit(other[zero]), name)


FUNCTIONS = together(
    *(lambda x, y, f=f: f(x) for f, _, _ in UNITS.values()), lambda x, y: x**y, ca.atan2
)


def test_functions_are_right_in_all_but_the_last_digits() -> None:
    """Powers lose a unit for every thirty that their logarithm has."""
    x, y = numbers()
    *found, power, angle = applied(FUNCTIONS, x, y)
    with np.errstate(all="ignore"):
        for got, (name, (_, exact, most)) in zip(found, UNITS.items(), strict=True):
            right = exact(x.astype(np.longdouble))
            off = units(got, right)
            assert off.max() <= most, (name, x[off.argmax()], got[off.argmax()])
            assert off.mean() < 0.5, name
            known = ~np.isnan(got)
            assert (np.signbit(got) == np.signbit(right))[known].all(), name
        right = np.power(x.astype(np.longdouble), y.astype(np.longdouble))
        most = 1 + np.where(np.isfinite(power), np.abs(np.log(np.abs(x)) * y) / 30, 0)
        assert (units(power, right) <= np.where(np.isfinite(most), most, 1)).all()
        assert units(angle, np.arctan2(x.astype(np.longdouble), y.astype(np.longdouble))).max() < 3


def test_an_operation_that_c_lacks_is_refused() -> None:
    with pytest.raises(ValueError, match="expected operations that C has, got CasADi operation"):
        vector_source("f", together(lambda x, y: ca.erfinv(x)))


@pytest.mark.parametrize(
    "lanes", [2, *(pytest.param(n, marks=pytest.mark.slow) for n in (1, 4, 8))]
)
def test_bits_of_functions_do_not_depend_on_the_number_of_lanes(lanes: int) -> None:
    x, y = numbers()
    np.testing.assert_array_equal(applied(FUNCTIONS, x, y, lanes), applied(FUNCTIONS, x, y))


ENDS = np.array([3.0, 1e-4, 0.5, 3.0, 1.0, 2.0, 0.35])
MEMBERS = (
    (explosive(), "p", "p", np.array([0.1, 2.0, 0.5, 7.0, 0.0, 0.4, 1e9])),
    (oscillator(), "p", "k", np.array([1.0, 4.0, 1e10, 2.0, 3.0, 5.0, 1.0])),
    (rabinowicz(LuGre()), "x0", "v", np.linspace(-0.1, 0.1, 7)),
)
"""Runs of 1e-4 to 3 s, one that explodes, one that needs too many steps."""


def picked(model: Model, group: str, name: str, values: np.ndarray, pick: list[int]) -> Ensemble:
    """Members by their number; that of each seventh is the same again."""
    which = np.array(pick) % 7
    given: dict[str, Any] = {group: {name: values[which]}, "t_eval": [0.0, 0.1, 0.35, 1.0, 3.0]}
    return simulate_many(model, ENDS[which], max_steps=3000, backend="compiled", **given)


@needs_compiler
def test_a_member_does_not_depend_on_its_neighbours() -> None:
    for model, *given in MEMBERS:
        whole = picked(model, *given, [*range(35)])  # more than lanes: some take several members
        for m in (0, 1, 25, 34):
            few = picked(model, *given, [3, m])
            for signal in model.signals:
                np.testing.assert_array_equal(whole[signal][m], few[signal][1])
            assert whole.attempts[m] == few.attempts[1]
    assert not whole.failed
    assert np.isfinite(whole["x"]).sum(axis=1).tolist() == [5, 1, 3, 5, 4, 4, 3] * 5
    assert whole.attempts[1] < whole.attempts[0] / 5
