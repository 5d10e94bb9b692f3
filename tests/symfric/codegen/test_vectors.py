"""Rows of test vectors: every comparison, every parameter, bad inputs; tolerances that mean it."""

import casadi as ca
import numpy as np
import pytest

from symfric import BrownMcPhee, LuGre, Output, Variable
from symfric.codegen import Block, law_block
from symfric.codegen.guards import Status
from symfric.codegen.vectors import BASE, changed_value, excitation, made, vectors
from symfric.emitter.c99 import DOUBLE, FLOAT

LUGRE = law_block(LuGre())


@pytest.mark.parametrize("real", [FLOAT, DOUBLE], ids=["float", "double"])
def test_results_are_what_the_block_makes_of_the_row(real):
    found = vectors(LUGRE, real, guards=False)
    defaults = np.array([float(v.start) for v in LUGRE.parameters])
    defaults = defaults.astype(f"f{real.size}").astype(float)
    for k in range(0, len(found.steps), 7):
        p, i = defaults.copy(), found.steps.changed[k]
        if i >= 0:
            p[i] = found.steps.values[k]
        z, F = LUGRE.step(found.steps.states[k], p, found.steps.inputs[k])
        slid = LUGRE.reset("init_sliding")(0.0, p, found.steps.inputs[k])
        expected = np.concatenate([x.full().ravel() for x in (z, F, slid)])
        assert np.array_equal(found.results[k], expected)


def test_numbers_that_go_in_are_those_of_the_type():
    steps = vectors(LUGRE, FLOAT, guards=False).steps
    for numbers in (steps.states, steps.inputs, steps.values):
        assert np.array_equal(numbers, numbers.astype(np.float32))


def test_rows_rest_creep_slide_and_turn_under_loads_that_jump():
    v, N = vectors(LUGRE, DOUBLE, guards=False).steps.inputs.T
    assert (v == 0).any()
    assert ((v != 0) & (np.abs(v) < 1e-6)).any()
    assert (v > 0.05).any()
    assert (v < -0.05).any()
    assert N.max() > 5 * N.min() > 0


def test_each_outcome_of_a_comparison_is_there():
    """A comparison that comes out otherwise in one step of eight hundred only."""
    x, u = Variable("x", "1"), Variable("u", "1")
    rare = (x.symbol > 399.5) * (x.symbol < 400.5)
    block = Block(
        "rare", states=(x,), inputs=(u,), next=x.symbol + 1,
        outputs={"y": Output(rare * u.symbol, "1")},
    )  # fmt: skip
    steps = vectors(block, DOUBLE, guards=False).steps
    assert 400.0 in steps.states[:, 0]
    assert len(steps) < 60


@pytest.mark.parametrize("law", [LuGre(), BrownMcPhee()], ids=["lugre", "brown_mcphee"])
def test_every_parameter_is_changed_where_it_matters(law):
    block = law_block(law)
    found = vectors(block, FLOAT, guards=False)
    for i, v in enumerate(block.parameters):
        rows = np.flatnonzero(found.steps.changed == i)
        assert len(rows) == 2
        steps = found.steps.chosen(rows)
        steps.changed[:] = -1
        plain, _ = made(block, FLOAT, steps, guards=False)
        effect = (np.abs(found.results[rows] - plain) / found.tolerance).max()
        assert effect > 100 or v.name == "v_eps"  # 1e-15 m/s: nothing but rest is slower


def test_a_changed_value_stays_within_the_bounds():
    assert changed_value(Variable("p", "1", start=2.0)) == 2.5
    assert changed_value(Variable("p", "1", start=2.0, upper=2.1)) == 1.5
    assert changed_value(Variable("p", "1", start=0.0, nominal=4.0)) == 1.0


def test_guards_add_a_row_for_each_number_that_is_bad():
    plain, guarded = (vectors(LUGRE, FLOAT, guards=g) for g in (False, True))
    new = len(guarded.steps) - len(plain.steps)
    assert new == 3 * (len(LUGRE.inputs) + len(LUGRE.states)) + len(LUGRE.parameters)
    assert (guarded.status[:-new] == 0).all()
    assert (guarded.status[-new:] != 0).all()
    said = np.bitwise_or.reduce(guarded.status)
    assert said & Status.NOT_FINITE
    assert said & Status.STATE
    assert said & Status.PARAMETER
    after = guarded.results[:, : len(LUGRE.states) + len(LUGRE.outputs)]
    assert np.isfinite(after).all()


def test_tolerance_is_relative_to_the_peak_or_to_what_rounding_changes():
    found = vectors(LUGRE, FLOAT, guards=False)
    peak = np.abs(found.results).max(axis=0)
    assert (found.tolerance >= 0.1 * BASE[4] * peak).all()
    assert (found.tolerance <= 10 * BASE[4] * peak).all()
    a, c, b = Variable("a", "1", start=1.0), Variable("c", "1", start=1.0), Variable("b", "1")
    difference = Block(
        "difference", inputs=(b,), parameters=(a, c),
        outputs={"y": Output((1e3 * a.symbol + 1e-3 * b.symbol) - 1e3 * c.symbol, "1"),
                 "z": Output(b.symbol, "1")},
    )  # fmt: skip
    tolerance = vectors(difference, FLOAT, guards=False).tolerance
    assert tolerance[1] == pytest.approx(BASE[4] * 2.0, rel=0.5)
    assert 1e-5 < tolerance[0] < 1e-2  # a last digit of 1000, of a number of 2e-3


def test_rows_that_rounding_decides_are_left_out():
    """The input is exactly at the edge in some rows, and a last digit beside it in none."""
    b, edge = Variable("b", "1"), float(np.float32(0.1))
    outputs = {"y": Output(ca.if_else(ca.eq(b.symbol, edge), 1.0, 0.0), "1")}
    assert (FLOAT.rounded(excitation(Block("jump", inputs=(b,), outputs=outputs))) == edge).any()
    found = vectors(Block("jump", inputs=(b,), outputs=outputs), FLOAT, guards=False)
    assert found.tolerance[0] < 0.1
    assert (found.results == 0.0).all()


def test_a_run_that_ends_in_infinity_is_used_as_far_as_it_goes():
    x = Variable("x", "1", start=1.0)
    block = Block("grows", states=(x,), next=x.symbol * 1e3)
    found = vectors(block, DOUBLE, guards=False)
    assert 30 < len(found.steps) < 110
    assert np.isfinite(found.results).all()
