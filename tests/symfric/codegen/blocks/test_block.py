"""Blocks: functions, fingerprint; identical elements as arrays and their loops in C."""

import casadi as ca
import numpy as np
import pytest
from one_program import OneProgram
from tables import table

from symfric import Output, Variable
from symfric.codegen import Block, law_block
from symfric.codegen.blocks.block import Elements
from symfric.codegen.blocks.variables import arranged, families, in_arrays, numbered
from symfric.codegen.layout import CBlock
from symfric.codegen.runner import run_vm
from symfric.codegen.source import routines, source
from symfric.emitter.c99 import DOUBLE, FLOAT
from symfric.laws import GMS, Asymmetric, LuGre, MaxwellSlip, Sum, Viscous
from symfric.laws.dynamic.maxwell_slip import Element, Slider

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


def test_functions_take_states_parameters_inputs_as_dense_columns():
    step = block().step
    assert step.name_in() == ["state", "param", "in"]
    assert step.name_out() == ["state_next", "out"]
    assert [float(v) for v in step(1.0, 0.5, 4.0)] == [3.0, 2.0]
    reset = block(resets={"init_high": (10 * u.symbol + p.symbol, "")}).reset("init_high")
    assert float(reset(99.0, 0.5, 4.0)) == 40.5
    assert block(next=ca.SX(1, 1), outputs={"y": Output(0.0, "m")}).step.nnz_out(0) == 1
    y = Output(u.symbol, "m")
    assert Block("f", inputs=(u,), outputs={"y": y}).is_function
    assert not Block("f", inputs=(u,), outputs={"y": y, "z": y}).is_function
    assert not block().is_function
    assert block().sample_time == 0.5
    fixed = block(parameters=(), next=x.symbol, constants={"h": 4e-3})
    assert fixed.sample_time == 4e-3
    assert Block("none", states=(x,), next=x.symbol).sample_time is None


def test_the_fingerprint_identifies_the_content():
    y = Variable("x", "m")
    again = {"states": (y,), "next": y.symbol + p.symbol * u.symbol,
             "outputs": {"y": Output(2 * y.symbol, "m")}}  # fmt: skip
    assert block(**again).fingerprint == block().fingerprint
    for changes in (
        {"name": "other"},
        {"next": x.symbol - p.symbol * u.symbol},
        {"outputs": {"y": Output(2 * x.symbol, "mm")}},
        {"parameters": (Variable("h", "s", start=0.25, symbol=p.symbol),)},
        {"resets": {"init_u": (u.symbol, "")}},
    ):
        assert block(**changes).fingerprint != block().fingerprint


def test_names_that_count_from_one_are_families_with_one_unit_and_range():
    for names, found in table(__file__)["families"].items():
        variables = tuple(Variable(name, "N") for name in names.split())
        assert {family.name: [*family.rows] for family in families(variables)} == found, names
    for odd in ({"unit": "m"}, {"lower": 0.0}, {"upper": 1.0}):
        third = Variable(**({"name": "k_3", "unit": "N"} | odd))
        assert not families((Variable("k_1", "N"), Variable("k_2", "N"), third))


def test_neighbours_become_arrays_and_joints_are_ordered_by_number_then_as_given():
    a = [Variable(n, "N", symbol=ca.SX.sym(n)) for n in ("F_1", "F_2", "b", "c_1", "G_1", "G_2")]
    outputs = {n: Output(a[0].symbol, "N") for n in ("G", "q_1", "q_2", "q_3")}
    made = in_arrays(Block("b", inputs=tuple(a), outputs=outputs))
    assert [*map(tuple, made.arrays)] == [("in", "F", 0, 2), ("out", "q", 1, 3)]
    z, w = Variable("z", "m"), Variable("w", "N")
    found, order = numbered([(z, w), (z,), (z,)], ["2", "arm", "1"])
    assert [v.name for v in found] == ["z_1", "z_2", "z_arm", "w_2"]
    assert order == [3, 0, 2, 1]


def gms(n: int, share: float = 0.0, **numbers: float) -> GMS:
    elements = (Element(5e4 * 2.0**-i, 0.1 + share * i) for i in range(n))
    return GMS(elements=tuple(elements), form="event", **numbers)


def maxwell(n: int) -> MaxwellSlip:
    return MaxwellSlip(elements=tuple(Slider(5e4 / n, 0.1 / n) for _ in range(n)), form="event")


ELEMENTS = [
    gms(1), gms(2), gms(4, share=0.05), maxwell(4), maxwell(10),
    Asymmetric(gms(4), gms(4, share=0.1, mu_s=0.2)),
    Sum((gms(4), gms(4, share=0.1), Viscous())), Sum((gms(3), maxwell(5), LuGre())),
    Sum(tuple(LuGre(mu_d=0.05 + 0.01 * i) for i in range(4))), gms(40),
]  # fmt: skip


@pytest.mark.parametrize("count", [5, pytest.param(len(ELEMENTS), marks=pytest.mark.slow)])
def test_loops_have_the_bits_of_casadi(count, compiler, tmp_path):
    """Velocities of all magnitudes with stops and reversals, loads that fall and rise."""
    blocks = [law_block(law, free=f) for law in ELEMENTS[:count] for f in (None, [])]
    program = OneProgram(blocks, tmp_path, compiler, guards=False)
    random = np.random.default_rng(5)
    v = random.choice([0.0, -0.0, 1e-300, 1e-7, 1e-3, 0.1, 30.0], 400)
    v *= np.repeat(random.choice([-1.0, 1.0], 40), 10)
    N = np.repeat(random.choice([1e-3, 10.0, 60.0, 1000.0], 20), 20)
    inputs = np.column_stack([v, N])
    rows = program.run([(k, inputs) for k in range(len(blocks))])
    for c, found in zip(program.several, rows, strict=True):
        assert np.array_equal(found, run_vm(c, inputs), equal_nan=True)


def step(block: Block) -> tuple[str, ...]:
    return routines(CBlock(block, DOUBLE, guards=False))[-1].statements


def test_arrays_are_struct_members_that_loops_of_three_and_more_elements_index():
    blocks = {n: law_block(gms(n)) for n in (2, 3, 10, 12)}
    loops = {n: [line for line in step(b) if line.startswith("for (")] for n, b in blocks.items()}
    assert [len(found) for found in loops.values()] == [0, 1, 2, 2]
    assert len(step(blocks[10])) == len(step(blocks[12])) < len(step(blocks[2]))
    ten = blocks[10]
    declared = [m.declared for rows in ten.members.values() for m in rows]
    assert declared[:2] == ["F[10]", "p[10]"]
    assert {"k[10]", "alpha[10]"} <= set(declared)
    names = [v.name for v in ten.parameters]
    first = names.index("alpha_1")
    assert names[first : first + 10] == [f"alpha_{i}" for i in range(1, 11)]
    assert [m.first for m in ten.members["param"] if m.name == "alpha"] == [first]
    assert sum(m.length for m in ten.members["param"]) == len(names)
    for law in (LuGre(), gms(2), Sum((LuGre(), LuGre()))):
        plain = law_block(law)
        assert plain.arrays == ()
        assert arranged(plain) is plain


def test_constants_that_differ_are_a_table_of_the_type():
    differing = "\n".join(step(law_block(gms(5), free=[])))
    assert differing.count("static const double") == 1
    assert "50000.0, 25000.0" in differing
    assert "static const" not in "\n".join(step(law_block(maxwell(5), free=[])))
    text = source(CBlock(law_block(gms(5), free=[]), FLOAT))
    assert "double" not in text
    assert "-0.0f; /* adds nothing" in text or "sum1 = " in text


def test_a_family_without_a_loop_stays_single_and_guarded_inputs_are_not_indexed():
    xs = [Variable(f"x_{i}", "m") for i in (1, 2, 3)]
    k = [Variable(f"k_{i}", "1", start=float(i)) for i in (1, 2, 3)]
    total = xs[0].symbol * k[0].symbol - xs[1].symbol / k[1].symbol * xs[2].symbol ** k[2].symbol
    single = arranged(Block(
        "b", states=tuple(xs), next=ca.vertcat(*(s.symbol for s in xs)),
        parameters=(k[0], Variable("h", "s"), k[1], k[2]), outputs={"y": Output(total, "m")},
    ))  # fmt: skip
    assert [v.name for v in single.parameters] == ["k_1", "h", "k_2", "k_3"]
    assert single.arrays == ()
    many = tuple(Variable(f"x_{i}", "m") for i in range(1, 9))
    total = sum((v.symbol**2 * ca.sin(v.symbol) for v in many), start=ca.SX(0))
    outputs = {"y": Output(total, "m"), "z": Output(2 * total, "m")}
    looped = Block("b", inputs=many, outputs=outputs, arrays=(Elements("in", "x", 0, 8),))
    for guards in (False, True):
        lines = routines(CBlock(looped, DOUBLE, guards))[-1].statements
        assert any("in->x[i]" in line for line in lines) is not guards
