"""Symbols stay themselves in copies, pickles and other processes, and are not kept for ever."""

import copy
import gc
import pickle
import subprocess
import sys
from typing import Any

import casadi as ca
import numpy as np
import pytest

from symfric.foundation import identity
from symfric.foundation.parameters import Variable, symbolise
from symfric.laws import LuGre
from symfric.model import Model
from symfric.scenes import rabinowicz


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
