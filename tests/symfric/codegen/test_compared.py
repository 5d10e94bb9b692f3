"""What differences of C and CasADi are measured in: last places, and magnitudes of terms."""

import casadi as ca
import numpy as np
import pytest

from symfric import Output, Variable
from symfric.codegen import Block, generate
from symfric.codegen.compared import Run, magnitudes, terms, ulp
from symfric.codegen.runner import run_vm
from symfric.emitter.c99 import FLOAT
from symfric.model.kinds import CONSTRAINTS

LARGE = 1e6


def test_last_places_are_counted_across_zero() -> None:
    tiny = 5e-324
    for a, b, wanted in (
        (0.0, -0.0, 0),
        (tiny, -tiny, 2),
        (1.0, np.nextafter(1.0, 2.0), 1),
        (-1.0, np.nextafter(-1.0, 0.0), 1),
        (1.0, 2.0, 2**52),
    ):
        assert ulp(np.array([a]), np.array([b])) == wanted
        assert ulp(np.array([b]), np.array([a])) == wanted
    assert ulp(np.array([1.0]), np.array([-1.0])) > 2**62
    assert ulp(np.array([np.inf]), np.array([np.inf])) == np.iinfo(np.int64).max


A, B = Variable("a", "1"), Variable("b", "1")
LEFT = (A.symbol + B.symbol) - LARGE
"""2, of a = 2 and b = 1e6."""


def magnitude(expression: ca.SX, kind: str = "") -> float:
    """Of an output that is this expression."""
    block = Block("b", inputs=(A, B), outputs={"y": Output(expression, "1", kind=kind)})
    none = np.zeros((1, 0))
    return float(magnitudes(terms(block), block, none, none[0], np.array([[2.0, LARGE]]))[0])


@pytest.mark.parametrize(
    ("expression", "wanted"),
    [
        (LEFT, LARGE),
        (-ca.fabs(LEFT), LARGE),
        (LEFT**2, LARGE**2),
        (ca.sqrt(LEFT), LARGE**0.5),
        (ca.sin(LEFT), abs(np.sin(2.0))),
        (3.0 * LEFT, 6.0),
    ],
)
def test_a_difference_has_the_magnitude_of_its_larger_term(expression, wanted) -> None:
    assert magnitude(expression) == pytest.approx(wanted)


@pytest.mark.parametrize("factor", [3.0, 1 / 4.0])
def test_closing_equations_have_that_of_all_that_went_into_them(factor: float) -> None:
    assert magnitude(factor * LEFT, CONSTRAINTS) == pytest.approx(factor * LARGE)
    assert magnitude(LEFT / (1 + A.symbol), CONSTRAINTS) == pytest.approx(LARGE / 3.0)


def test_a_state_has_its_nominal_value_at_least() -> None:
    x = Variable("x", "m", nominal=5.0)
    block = Block("b", states=(x,), next=1e-3 * x.symbol)
    found = magnitudes(terms(block), block, np.ones((3, 1)), np.zeros(0), np.zeros((3, 0)))
    assert found.tolist() == [5.0]


def test_the_worst_signal_is_the_one_that_is_off_by_most_of_its_magnitude(tmp_path) -> None:
    """Not the one with the largest numbers; and rounding is that of its own operations."""
    outputs = {"large": Output(1e3 * A.symbol, "1"), "small": Output(A.symbol**2 - 1.0, "1")}
    block = Block("pair", inputs=(A,), outputs=outputs)
    made = generate(block, tmp_path, real="float", kit=False)
    inputs = np.array([[3.0], [1.1], [2.0]])
    expected = run_vm(block, FLOAT, inputs)
    rows = expected.copy()
    rows[1] += [1e-2, 1e-3, 0.0]
    run = Run(made, FLOAT, inputs, None, rows, expected, lambda: terms(block))
    assert run.worst == "small"
    assert run.error == pytest.approx(1e-3 / 9.0)  # of 3 squared
    assert 0.0 < run.rounding < 1e-7
