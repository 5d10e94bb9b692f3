"""Blocks: what they refuse, their functions, their fingerprint."""

import casadi as ca
import pytest

from symfric import Output, Variable
from symfric.codegen import Block

x, u, p = Variable("x", "m"), Variable("u", "m/s"), Variable("h", "s", start=0.5)


def block(**changes) -> Block:
    parts = {
        "name": "lag",
        "states": (x,),
        "inputs": (u,),
        "parameters": (p,),
        "next": x.symbol + p.symbol * u.symbol,
        "outputs": {"y": Output(2 * x.symbol, "m")},
    }
    return Block(**parts | changes)


def test_step_takes_states_parameters_inputs():
    step = block().step
    assert step.name_in() == ["state", "param", "in"]
    assert step.name_out() == ["state_next", "out"]
    assert [float(v) for v in step(1.0, 0.5, 4.0)] == [3.0, 2.0]


def test_reset_is_a_function_of_parameters_and_inputs():
    reset = block(resets={"init_high": (10 * u.symbol + p.symbol, "")}).reset("init_high")
    assert float(reset(99.0, 0.5, 4.0)) == 40.5


def test_structural_zeros_become_dense():
    assert block(next=ca.SX(1, 1), outputs={"y": Output(0.0, "m")}).step.nnz_out(0) == 1


def test_only_a_stateless_block_with_one_output_is_a_function():
    y = Output(u.symbol, "m")
    assert Block("f", inputs=(u,), outputs={"y": y}).is_function
    assert not Block("f", inputs=(u,), outputs={"y": y, "z": y}).is_function
    assert not block().is_function


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"name": "2fast"}, "C identifier, got '2fast'"),
        ({"name": "coulomb+viscous"}, "C identifier, got 'coulomb.viscous'"),
        ({"inputs": (Variable("while", "1"), u)}, "C identifier, got 'while'"),
        ({"inputs": (Variable("class", "1"), u)}, "C identifier, got 'class'"),
        ({"inputs": (Variable("expf", "1"), u)}, "C identifier, got 'expf'"),
        ({"inputs": (Variable("state", "1"), u)}, "C identifier, got 'state'"),
        ({"inputs": (Variable("µ", "1"), u)}, "C identifier, got 'µ'"),
        ({"inputs": (Variable("x", "1"), u)}, "every name once, got 'x' twice"),
        ({"next": ca.SX(2, 1)}, r"next: expected 1 rows \(one a state\), got 2"),
        ({"resets": {"init_b": (ca.SX(2, 1), "")}}, "init_b: expected 1 rows"),
        ({"outputs": {"y": Output(ca.SX.sym("q"), "1")}}, "only declared symbols.*q"),
        ({"states": (), "next": ca.SX(0, 1), "outputs": {}}, "expected states or outputs"),
        ({"parameters": (Variable("h", "s", start=2 * u.symbol, symbol=p.symbol),)}, "finite"),
    ],
)
def test_bad_blocks_are_refused(changes, message):
    with pytest.raises(ValueError, match=message):
        block(**changes)


def test_all_problems_are_told_at_once():
    with pytest.raises(ValueError, match=r"2fast.*expected 1 rows"):
        block(name="2fast", next=ca.SX(2, 1))


def test_the_fingerprint_is_that_of_the_content():
    y = Variable("x", "m")
    again = block(
        states=(y,),
        next=y.symbol + p.symbol * u.symbol,
        outputs={"y": Output(2 * y.symbol, "m")},
    )
    assert again.fingerprint == block().fingerprint


@pytest.mark.parametrize(
    "changes",
    [
        {"name": "other"},
        {"next": x.symbol - p.symbol * u.symbol},
        {"outputs": {"y": Output(2 * x.symbol, "mm")}},
        {"outputs": {"y": Output(3 * x.symbol, "m")}},
        {"parameters": (Variable("h", "s", start=0.25, symbol=p.symbol),)},
        {"resets": {"init_u": (u.symbol, "")}},
    ],
)
def test_the_fingerprint_changes_with_the_content(changes):
    assert block(**changes).fingerprint != block().fingerprint
