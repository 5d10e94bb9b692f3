"""Rows of test vectors: every comparison, every parameter, bad inputs, and their tolerances."""

import casadi as ca
import numpy as np
import pytest
from one_program import block_of

from symfric import BrownMcPhee, LuGre, Output, Variable
from symfric.codegen import Block
from symfric.codegen.blocks.block import CBlock
from symfric.codegen.guards import Status
from symfric.codegen.vectors import BASE, changed_value, excitation, made, vectors
from symfric.emitter.c99 import DOUBLE, FLOAT

LUGRE = block_of(LuGre())
BARE = {real: CBlock(LUGRE, real, guards=False) for real in (FLOAT, DOUBLE)}


@pytest.fixture(scope="module")
def found():
    """Vectors of LuGre without guards, in both types."""
    return {real: vectors(c) for real, c in BARE.items()}


@pytest.mark.parametrize("real", [FLOAT, DOUBLE], ids=["float", "double"])
def test_rows_are_steps_of_the_block_from_numbers_of_the_type(found, real):
    rows = found[real]
    for numbers in (rows.steps.states, rows.steps.inputs, rows.steps.values):
        assert np.array_equal(numbers, numbers.astype(real.kind))
    defaults = real.rounded([float(v.start) for v in LUGRE.parameters])
    for k in range(0, len(rows.results), 7):
        p, i = defaults.copy(), rows.steps.changed[k]
        if i >= 0:
            p[i] = rows.steps.values[k]
        z, F = LUGRE.step(rows.steps.states[k], p, rows.steps.inputs[k])
        slid = LUGRE.reset("init_sliding")(0.0, p, rows.steps.inputs[k])
        expected = np.concatenate([x.full().ravel() for x in (z, F, slid)])
        assert np.array_equal(rows.results[k], expected)
    v, N = rows.steps.inputs.T
    assert {*np.sign(v[np.abs(v) > 0.05])} == {-1.0, 1.0}
    assert ((v != 0) & (np.abs(v) < 1e-6)).any()
    assert (v == 0).any()
    assert N.max() > 5 * N.min() > 0


def test_rows_contain_each_outcome_of_a_comparison():
    """A comparison that is true in one step of 800, and the sign of a difference."""
    x, u = Variable("x", "1"), Variable("u", "1")
    rare = (x.symbol > 399.5) * (x.symbol < 400.5)
    for output in (rare * u.symbol, ca.fmax(400.5 - ca.fabs(x.symbol - 400.0), x.symbol - 799.5)):
        block = Block(
            "rare", states=(x,), inputs=(u,), next=x.symbol + 1, outputs={"y": Output(output, "1")}
        )
        steps = vectors(CBlock(block, DOUBLE, guards=False)).steps
        assert {400.0, 401.0} & set(steps.states[:, 0])
        assert len(steps.changed) < 60


@pytest.mark.parametrize("law", [LuGre(), BrownMcPhee()], ids=["lugre", "brown_mcphee"])
def test_every_parameter_is_changed_where_it_matters(law):
    c = CBlock(block_of(law), FLOAT, guards=False)
    rows = vectors(c)
    for i, v in enumerate(c.block.parameters):
        changed = np.flatnonzero(rows.steps.changed == i)
        assert len(changed) == 2
        steps = rows.steps.chosen(changed)
        steps.changed[:] = -1
        effect = (np.abs(rows.results[changed] - made(c, steps)) / rows.tolerance).max()
        assert effect > 100 or v.name == "v_eps"  # 1e-15 m/s, which only rest is below
    for bounds, changed in (({"start": 2.0}, 2.5), ({"start": 2.0, "upper": 2.1}, 1.5),
                            ({"nominal": 4.0}, 1.0)):  # fmt: skip
        assert changed_value(Variable("p", "1", **bounds)) == changed


def test_guards_add_a_row_for_each_number_that_is_bad(found):
    guarded = vectors(CBlock(LUGRE, FLOAT))
    new = len(guarded.status) - len(found[FLOAT].status)
    assert new == 3 * (len(LUGRE.inputs) + len(LUGRE.states)) + len(LUGRE.parameters)
    assert (guarded.status[:-new] == 0).all()
    assert (guarded.status[-new:] != 0).all()
    reported = np.bitwise_or.reduce(guarded.status)
    assert reported & Status.NOT_FINITE
    assert reported & Status.STATE
    assert reported & Status.PARAMETER
    after = guarded.results[:, : len(LUGRE.states) + len(LUGRE.outputs)]
    assert np.isfinite(after).all()


def test_tolerance_is_relative_to_the_peak_or_to_what_rounding_changes(found):
    peak = np.abs(found[FLOAT].results).max(axis=0)
    assert (found[FLOAT].tolerance >= 0.1 * BASE[4] * peak).all()
    assert (found[FLOAT].tolerance <= 10 * BASE[4] * peak).all()
    a, c, b = Variable("a", "1", start=1.0), Variable("c", "1", start=1.0), Variable("b", "1")
    difference = Block(
        "difference", inputs=(b,), parameters=(a, c),
        outputs={"y": Output((1e3 * a.symbol + 1e-3 * b.symbol) - 1e3 * c.symbol, "1"),
                 "z": Output(b.symbol, "1")},
    )  # fmt: skip
    tolerance = vectors(CBlock(difference, FLOAT, guards=False)).tolerance
    assert tolerance[1] == pytest.approx(BASE[4] * 2.0, rel=0.5)
    assert 1e-5 < tolerance[0] < 1e-2  # the last digit of 1000 relative to 2e-3


def test_rows_that_rounding_decides_or_that_are_not_finite_are_omitted():
    """The input is exactly at the edge in some rows, and one last digit from it in none."""
    b, edge = Variable("b", "1"), float(np.float32(0.1))
    outputs = {"y": Output(ca.if_else(ca.eq(b.symbol, edge), 1.0, 0.0), "1")}
    jump = Block("jump", inputs=(b,), outputs=outputs)
    assert (FLOAT.rounded(excitation(jump)) == edge).any()
    rows = vectors(CBlock(jump, FLOAT, guards=False))
    assert rows.tolerance[0] < 0.1
    assert (rows.results == 0.0).all()
    x = Variable("x", "1", start=1.0)
    rows = vectors(CBlock(Block("grows", states=(x,), next=x.symbol * 1e3), DOUBLE, guards=False))
    assert 30 < len(rows.status) < 110
    assert np.isfinite(rows.results).all()
