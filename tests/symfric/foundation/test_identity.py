"""Symbols in copies, pickles and lists of instructions."""

import copy
import gc
import pickle
import subprocess
import sys
from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np
import pytest

from symfric.foundation import identity
from symfric.foundation.instructions import BINARY, CODES, DEEPEST, UNARY, Instructions
from symfric.foundation.parameters import Variable, symbolise
from symfric.laws import LuGre
from symfric.model import Model
from symfric.scenes import PendulumBox, rabinowicz


def same(one: Any, other: Any) -> bool:
    return one.__hash__() == other.__hash__()


def test_a_law_is_that_of_the_model_that_travels_with_it_or_apart() -> None:
    mu = Variable("mu_s", "1", start=0.2)
    law = LuGre(mu_s=mu.symbol)
    x = Variable("x", "m")
    model = Model("decay", x=(x,), p=(mu,), ode=-mu.symbol * x.symbol)
    for pair in (pickle.loads(pickle.dumps((law, model))), copy.deepcopy((law, model)),
                 [pickle.loads(pickle.dumps(one)) for one in (law, model)]):  # fmt: skip
        found, other = pair
        assert same(found.mu_s, other.p[0].symbol)
        slope = ca.jacobian(other.function("ode")(0, 2.0, [], [], found.mu_s), found.mu_s)
        assert float(slope) == -2.0
        assert same(found.mu_s, mu.symbol)  # in the process of the symbol it is that symbol


@pytest.mark.parametrize("kind", [ca.SX, ca.MX])
def test_symbols_and_expressions_alone(kind: Any) -> None:
    x, y, v = kind.sym("x"), kind.sym("x"), kind.sym("v", 2, 2)  # two of one name are two
    X, Y, both, V, three = pickle.loads(pickle.dumps((x, y, ca.sin(x) * y, v, kind(3.0))))
    assert same(X, x)
    assert same(Y, y)
    f = ca.Function("f", [x, y], [both, three])
    assert list(map(float, f(2.0, 3.0))) == pytest.approx([3.0 * np.sin(2.0), 3.0], rel=1e-15)
    assert V.shape == (2, 2)
    assert ca.is_equal(V, v, 2)


def test_names_end_with_what_travelled() -> None:
    gc.collect()
    before = len(identity._by_name), len(identity._by_node)  # pyright: ignore[reportPrivateUsage]
    law = symbolise(LuGre(), "mu_s")[0]
    data = pickle.dumps(law)
    assert len(identity._by_name) > before[0]  # pyright: ignore[reportPrivateUsage]
    del law
    gc.collect()
    assert (len(identity._by_name), len(identity._by_node)) == before  # pyright: ignore[reportPrivateUsage]
    one, other = pickle.loads(data), pickle.loads(data)  # of a symbol that is gone: one, twice
    assert same(one.mu_s, other.mu_s)


def test_a_name_that_another_symbol_has_does_not_make_them_one() -> None:
    """As a file may say that was put together by hand."""
    x, y = ca.SX.sym("x"), ca.SX.sym("y")
    kept = [identity.again(one, [one], ["of both"]) for one in (x, y)]
    assert same(kept[0], x) and same(kept[1], y)


def test_the_context_of_casadi_works_as_before() -> None:
    with ca.global_pickle_context():
        data = pickle.dumps(ca.SX.sym("q"))
    assert b"symfric" not in data
    with ca.global_unpickle_context():
        assert pickle.loads(data).name() == "q"


ELSEWHERE = """
import pickle, sys
law, mu, model = (pickle.loads(part) for part in pickle.load(sys.stdin.buffer))
assert law.mu_s.__hash__() == mu.symbol.__hash__() == model.p[0].symbol.__hash__()
sys.stdout.buffer.write(pickle.dumps((law, model)))
"""


def test_symbols_come_back_from_another_process_as_themselves() -> None:
    model = rabinowicz(LuGre(), free=["mu_s"])
    mu = model.p[0]
    law = LuGre(mu_s=mu.symbol)
    apart = pickle.dumps([pickle.dumps(one) for one in (law, mu, model)])
    there = subprocess.run(
        [sys.executable, "-c", ELSEWHERE], input=apart, capture_output=True, check=True
    )
    back, other = pickle.loads(there.stdout)
    assert same(back.mu_s, mu.symbol)
    assert same(other.p[0].symbol, mu.symbol)


X, Y = ca.SX.sym("x"), ca.SX.sym("y")


def equal(one: ca.SX, other: ca.SX) -> bool:
    """Operation by operation; CasADi compares nodes and their operands down to a depth."""
    return one.sparsity() == other.sparsity() and ca.is_equal(one, other, 100)


def test_every_operation_comes_back_as_it_was() -> None:
    whole = [ca.SX.unary(CODES[name], X) for name in UNARY]
    whole += [ca.SX.binary(CODES[name], X, Y) for name in BINARY]
    whole.append(X**2.5)  # is a power of its own kind
    for one, other in zip(whole, Instructions.of(whole).expressions(), strict=True):
        assert equal(one, other), str(one)


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
            assert equal(one, other)


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
        with pytest.raises(ValueError, match="that symfric wrote"):
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
