"""Expressions as lists of instructions."""

from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np
import pytest

from symfric.foundation.instructions import BINARY, CODES, DEEPEST, UNARY, Instructions
from symfric.laws import LuGre
from symfric.scenes import PendulumBox

X, Y = ca.SX.sym("x"), ca.SX.sym("y")


def same(one: ca.SX, other: ca.SX) -> bool:
    """Operation by operation; CasADi compares nodes and their operands down to a depth."""
    return one.sparsity() == other.sparsity() and ca.is_equal(one, other, 100)


def test_every_operation_comes_back_as_it_was() -> None:
    whole = [ca.SX.unary(CODES[name], X) for name in UNARY]
    whole += [ca.SX.binary(CODES[name], X, Y) for name in BINARY]
    whole.append(X**2.5)  # is a power of its own kind
    for one, other in zip(whole, Instructions.of(whole).expressions(), strict=True):
        assert same(one, other), str(one)


def test_a_stored_list_is_the_list_of_what_was_made_of_it() -> None:
    model = PendulumBox(LuGre()).model()
    equations = ca.vertcat(model.residual, ca.vec(ca.jacobian(model.residual, model.vector("x"))))
    stored = Instructions.of([equations, model.vector("x")])
    again = Instructions.of(stored.expressions())
    assert (stored.operations, stored.names) == (again.operations, again.names)
    for name in ("code", "constants", "entries", "shapes"):
        np.testing.assert_array_equal(getattr(stored, name), getattr(again, name))


def test_shared_parts_are_stored_once_and_calls_of_functions_refused() -> None:
    part = ca.sin(X) * Y
    stored = Instructions.of([part, part + 1, ca.exp(part)])
    assert (stored.code[:, 0] == stored.operations.index("sin")).sum() == 1
    inner = ca.Function("inner", [X], [X * X], {"never_inline": True})
    with pytest.raises(ValueError, match="expected elementary operations, got"):
        Instructions.of([inner(Y)])


def test_shapes_sparsities_and_bits_of_constants_come_back() -> None:
    numbers = [0.1, -0.0, 5e-324, 1e308, np.inf, -np.inf]
    whole = [ca.SX(ca.DM(numbers)), ca.SX(0, 1), ca.SX(2, 0), ca.SX(3, 2), ca.SX.eye(3) * X]
    whole += [ca.SX(ca.DM(np.eye(2))), ca.horzcat(X, Y, 1), ca.SX(np.nan), ca.SX.sym("m", 2, 3)]
    for one, other in zip(whole, Instructions.of(whole).expressions(), strict=True):
        assert other.sparsity() == one.sparsity()
        if one.is_constant():
            assert ca.DM(one).full().tobytes() == ca.DM(other).full().tobytes()
        else:
            assert same(one, other)


GOOD = Instructions.of([ca.sin(X) * Y + 2.0, ca.SX.eye(2) * X])


def at(name: str, place: Any, value: int) -> Instructions:
    """The good ones with one other number."""
    array = getattr(GOOD, name).copy()
    array[place] = value
    return replace(GOOD, **{name: array})


BAD = [
    at("code", (0, 1), 3),  # operand of itself
    at("code", (0, 2), 3 + len(GOOD.code)),  # operand that follows
    at("code", (1, 1), -1),  # negative operand
    at("code", (0, 0), 9),  # operation
    at("entries", (0, 3), 3 + len(GOOD.code)),  # result
    at("entries", (0, 1), 1),  # row
    at("entries", (1, 2), 7),  # column
    at("entries", (2, 0), 2),  # expression
    replace(GOOD, entries=GOOD.entries[[0, 0, 1]]),  # entry twice
    replace(GOOD, entries=GOOD.entries[[0, 2, 1]]),  # order of entries
    at("shapes", (1, 0), 2**62),  # size
    replace(GOOD, operations=("call", *GOOD.operations[1:])),  # unknown name
    replace(GOOD, names=(GOOD.names[0],) * 2),  # symbol twice
    replace(GOOD, labels=(*GOOD.labels, "z")),  # label too many
    replace(GOOD, code=GOOD.code[:, :2]),  # code of two columns
    replace(GOOD, shapes=GOOD.shapes[0]),  # flat shapes
]


def test_lists_that_are_not_sound_are_refused_before_anything_is_made() -> None:
    for wrong in BAD:
        with pytest.raises((ValueError, IndexError)):
            wrong.expressions()


def test_depth_is_bounded() -> None:
    deep = X
    for _ in range(DEEPEST):
        deep = ca.SX.binary(CODES["mul"], deep, Y)
    back = Instructions.of([deep]).expressions()[0]
    assert float(ca.evalf(ca.substitute(back, ca.vertcat(X, Y), ca.SX([3.0, 1.0])))) == 3.0
    deeper = Instructions.of([deep * Y])
    with pytest.raises(ValueError, match=f"expected at most {DEEPEST} nested operations"):
        deeper.expressions()
    assert deeper.expressions(trusted=True)[0].shape == (1, 1)
