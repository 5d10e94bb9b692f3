"""Modes that tie in float are told from modes that are wrong, by rounding each operation."""

import json

import casadi as ca
import numpy as np
import pytest
from symfric.codegen.rounding import in_type, modes, rounded

from symfric import GMS, LuGre
from symfric.codegen import Block, generate, law_block, verify
from symfric.codegen.runner import signals
from symfric.compensation import compensator, gms_observer
from symfric.foundation.parameters import Variable

SPRINGS = gms_observer(GMS(form="event", mu_s=6.0, mu_d=4.0), 20.0)


def test_chance_takes_the_floats_on_both_sides_and_leaves_what_is_exact() -> None:
    x = ca.SX.sym("x", 2)
    both = ca.Function("f", [x], [ca.vertcat(x[0] * x[1], x[0] + x[1])])
    rows = np.tile(np.array([0.1, 0.125], "f4"), (1000, 1))
    found = in_type(both, [rows], "f4", np.random.default_rng(0))
    exact = rows[0, 0].astype(float) * np.array([0.125]) + 0.0
    assert found is not None
    assert (found[:, 0] == exact).all()  # by a power of two
    total = float(rows[0, 0]) + 0.125
    sides = np.unique(found[:, 1])
    assert sides.size == 2
    assert sides[0] < total < sides[1]
    assert np.nextafter(np.float32(sides[0]), np.float32(1)) == sides[1]
    assert 400 < (found[:, 1] == sides[0]).sum() < 600


@pytest.mark.parametrize(
    ("block", "wanted"),
    [
        (law_block(LuGre()), []),
        (law_block(GMS(form="event")), ["p_1", "p_2", "p_3", "p_4"]),
        (SPRINGS, ["p_1", "p_2", "p_3", "p_4"]),
        (compensator(LuGre(), hold=(1e-5, 1e-3)), ["hold"]),
    ],
)
def test_modes_are_what_only_decisions_choose(block: Block, wanted: list[str]) -> None:
    names = signals(block, guards=False)
    found = [n for n, mode in zip(names, modes(block), strict=True) if mode]
    assert found == wanted + [f"{reset}.{n}" for reset in block.resets for n in wanted]


def test_a_state_that_takes_another_continuous_one_is_no_mode() -> None:
    """q copies r, and r copies the input: neither is, though q has a decision alone."""
    q, r, v = Variable("q", "1"), Variable("r", "1"), Variable("v", "m/s")
    taken = ca.if_else(v.symbol > 0, r.symbol, q.symbol)
    block = Block(
        "copies", states=(q, r), inputs=(v,), next=ca.vertcat(taken, v.symbol), outputs={}
    )
    assert not modes(block).any()


def test_steps_without_rounding_come_out_alike_and_others_do_not() -> None:
    block = law_block(LuGre())
    p = np.array([[v.start for v in block.parameters]] * 3)
    found = rounded(block, np.zeros((3, 1)), p, np.array([[0.0, 1.0], [1e-3, 1.0], [1e-3, 0.0]]))
    assert found is not None
    assert np.ptp(found[:, 0], axis=0).max() == 0.0
    assert 0.0 < np.ptp(found[:, 1], axis=0).max() < 1e-6


@pytest.mark.heavy
def test_a_mode_that_ties_is_counted_and_no_fault(compiler, tmp_path, all_steps_verified) -> None:
    found = verify(generate(SPRINGS, tmp_path, kit=False, real="float"))
    (check,) = found.checks
    assert found.ok, found.table()
    assert 0 < check.ties < 20
    assert check.error < 1e-6
    assert json.loads(json.dumps(found.to_dict()))["checks"][0]["ties"] == check.ties
    head, row = (line.split() for line in found.table().splitlines()[1:])
    assert row[head.index("ties")] == str(check.ties)


@pytest.mark.heavy
@pytest.mark.parametrize(
    ("old", "new", "signal"),
    [
        ("u8 ? p_i : 0.0f", "u8 ? p_i : 1.0f", "p_"),
        ("u8 ? p_i : 0.0f", "u8 ? 0.0f : 0.0f", "p_"),
        ("if (e2 <= u4 * e11)", "if (0.999f * e2 <= u4 * e11)", "p_"),
        ("u8 ? p_i : 0.0f", "u8 ? p_i : (0.9999f * e2 <= u4 * e11 ? 1.0f : 0.0f)", "p_"),
        ("e7 = e6 + e9 * u5", "e7 = e6 + e9", "F_"),
    ],
)
def test_a_wrong_mode_or_force_is_no_tie(compiler, old: str, new: str, signal: str, tmp_path):
    """Of all steps, at rest, and within a ten-thousandth of the limit only."""
    made = generate(SPRINGS, tmp_path, kit=False, real="float")
    text = made.source("float").read_text()
    assert text.count(old) == 1
    made.source("float").write_text(text.replace(old, new))
    found = verify(made)
    assert found.checks[0].worst.startswith(signal)
    assert found.status.startswith("failed in float: ")
    assert "more than rounding explains" in found.status
