"""Alike elements as arrays: which variables, which laws, equal bits, and what the text costs."""

from collections.abc import Callable
from functools import cache

import casadi as ca
import numpy as np
import pytest

from symfric import Output, Variable
from symfric.codegen import Block, generate
from symfric.codegen.blocks.block import Elements
from symfric.codegen.blocks.from_law import law_block
from symfric.codegen.blocks.variables import arranged, families
from symfric.codegen.layout import members
from symfric.codegen.routines import routines, source
from symfric.codegen.runner import link_program, program, run_c, run_vm
from symfric.emitter.c99 import DOUBLE, FLOAT
from symfric.laws import GMS, Asymmetric, Law, LuGre, MaxwellSlip, Sum, Viscous
from symfric.laws.dynamic.maxwell_slip import Element, Slider


def gms(n: int, share: float = 0.0, **numbers: float) -> GMS:
    elements = (Element(5e4 * 2.0**-i, 0.1 + share * i) for i in range(n))
    return GMS(elements=tuple(elements), form="event", **numbers)


def maxwell(n: int) -> MaxwellSlip:
    return MaxwellSlip(elements=tuple(Slider(5e4 / n, 0.1 / n) for _ in range(n)), form="event")


@cache
def block_of(n: int) -> Block:
    return law_block(gms(n))


def step(block: Block) -> tuple[str, ...]:
    return routines(block, DOUBLE, guards=False)[-1].statements


def loops(block: Block) -> int:
    return sum(line.startswith("for (") for line in step(block))


@pytest.mark.parametrize(
    ("names", "found"),
    [
        ("k_1 k_2 k_3", {"k": (0, 1, 2)}),
        ("k_1 a_1 k_2 a_2 k_3 a_3", {"k": (0, 2, 4), "a": (1, 3, 5)}),
        ("k_1_pos k_2_pos k_3_pos", {"k_pos": (0, 1, 2)}),
        ("k_2 k_1 k_3", {"k": (1, 0, 2)}),
        ("k_1 k_2", {}),
        ("k_0 k_1 k_2", {}),
        ("k_1 k_2 k_4", {}),
        ("k_01 k_02 k_03", {}),
        ("k1 k2 k3", {}),
        ("k k_1 k_2 k_3", {"ks": (1, 2, 3)}),
        ("int_1 int_2 int_3", {"ints": (0, 1, 2)}),
    ],
)
def test_names_that_count_from_one_are_families(names: str, found: dict[str, tuple[int]]) -> None:
    variables = tuple(Variable(name, "N") for name in names.split())
    assert {family.name: family.rows for family in families(variables)} == found


def test_variables_of_two_numbers_belong_to_their_nearest_neighbours() -> None:
    names = [f"k_{i}_{j}" for j in (1, 2, 3) for i in (1, 2, 3)]
    found = families(tuple(Variable(name, "N") for name in names))
    assert [(f.name, f.rows) for f in found] == [
        ("k_1", (0, 1, 2)), ("k_2", (3, 4, 5)), ("k_3", (6, 7, 8))
    ]  # fmt: skip


@pytest.mark.parametrize("odd", [{"unit": "m"}, {"lower": 0.0}, {"upper": 1.0}])
def test_a_family_has_one_unit_and_one_range(odd: dict[str, float]) -> None:
    third = Variable(**({"name": "k_3", "unit": "N"} | odd))
    assert not families((Variable("k_1", "N"), Variable("k_2", "N"), third))


def test_arrays_stand_in_the_structs_in_the_order_of_the_variables() -> None:
    block = block_of(4)
    declared = [m.declared for rows in members(block).values() for m in rows]
    assert declared[:2] == ["F[4]", "p[4]"]
    assert {"k[4]", "alpha[4]"} <= set(declared)
    names = [v.name for v in block.parameters]
    first = names.index("alpha_1")
    assert names[first : first + 4] == ["alpha_1", "alpha_2", "alpha_3", "alpha_4"]
    (param,) = (rows for group, rows in members(block).items() if group == "param")
    assert [m.first for m in param if m.name == "alpha"] == [first]
    assert sum(m.count for m in param) == len(block.parameters)


CASES: dict[str, Callable[[], Law]] = {
    "gms of 1": lambda: gms(1),
    "gms of 2": lambda: gms(2),
    "gms of 4, unequal": lambda: gms(4, share=0.05),
    "gms of 40": lambda: gms(40),
    "maxwell of 4": lambda: maxwell(4),
    "maxwell of 10": lambda: maxwell(10),
    "asymmetric": lambda: Asymmetric(gms(4), gms(4, share=0.1, mu_s=0.2)),
    "gms twice": lambda: Sum((gms(4), gms(4, share=0.1), Viscous())),
    "gms of several sizes": lambda: Sum((gms(3), maxwell(5), LuGre())),
    "alike bristles": lambda: Sum(tuple(LuGre(mu_d=0.05 + 0.01 * i) for i in range(4))),
}


def inputs(block: Block, steps: int) -> np.ndarray:
    """Velocities of all magnitudes with stops and reversals, loads that fall and rise."""
    random = np.random.default_rng(5)
    v = random.choice([0.0, -0.0, 1e-300, 1e-7, 1e-3, 0.1, 30.0], steps)
    v *= np.repeat(random.choice([-1.0, 1.0], steps // 10), 10)
    N = np.repeat(random.choice([1e-3, 10.0, 60.0, 1000.0], steps // 20), 20)
    return np.column_stack([v, N])


SLOW = ("gms of 40", "asymmetric", "gms twice")


@pytest.mark.parametrize(
    ("name", "fold"),
    [
        *(pytest.param(n, False, marks=[pytest.mark.slow] * (n in SLOW)) for n in CASES),
        *(
            pytest.param(n, True, marks=[pytest.mark.slow] * (n != "gms of 4, unequal"))
            for n in CASES
        ),
    ],
)
def test_loops_have_the_bits_of_casadi(name: str, fold: bool, compiler, tmp_path) -> None:
    block = law_block(CASES[name](), name="law", free=[] if fold else None)
    made = generate(block, tmp_path, real="double", guards=False, kit=False)
    (tmp_path / "main.c").write_text(program(block, DOUBLE, guards=False))
    link_program(
        compiler, [tmp_path / "main.c", made.source("double")], tmp_path, tmp_path / "main"
    )
    rows = inputs(block, 400)
    c = run_c(block, DOUBLE, tmp_path / "main", rows, guards=False)
    assert np.array_equal(c, run_vm(block, DOUBLE, rows, guards=False), equal_nan=True)


@pytest.mark.parametrize(("n", "expected"), [(1, 0), (2, 0), (3, 1), (4, 1), (10, 2), (25, 2)])
def test_three_elements_and_more_are_loops(n: int, expected: int) -> None:
    assert loops(block_of(n)) == expected


def test_the_text_does_not_grow_with_the_elements() -> None:
    ten, more = block_of(10), block_of(25)
    assert len(step(ten)) == len(step(more))
    assert len(step(ten)) < len(step(block_of(2)))


def test_constants_that_differ_are_a_table_and_equal_ones_are_not() -> None:
    differing = "\n".join(step(law_block(gms(10), free=[])))
    assert differing.count("static const double") == 1
    assert "50000.0, 25000.0" in differing
    equal = "\n".join(step(law_block(maxwell(10), free=[])))
    assert "static const" not in equal


def test_the_sums_of_a_law_are_added_in_its_loop() -> None:
    lines = [line.strip() for line in step(block_of(10))]
    assert sum(line.startswith("for (") for line in lines) == 2
    assert [line.split()[0] for line in lines if "+=" in line].count("sum2") == 3
    assert any(line.startswith("double sum2 = ") for line in lines)


@pytest.mark.parametrize("law", [LuGre(), gms(2), Sum((LuGre(), LuGre()))])
def test_a_law_without_repetition_has_no_arrays(law: Law) -> None:
    block = law_block(law)
    assert block.arrays == ()
    assert arranged(block) is block


def test_a_family_that_no_loop_uses_stays_single_in_its_order() -> None:
    x = [Variable(f"x_{i}", "m") for i in (1, 2, 3)]
    k = [Variable(f"k_{i}", "1", start=float(i)) for i in (1, 2, 3)]
    mixed = (k[0], Variable("h", "s"), k[1], k[2])
    total = x[0].symbol * k[0].symbol - x[1].symbol / k[1].symbol * x[2].symbol ** k[2].symbol
    block = Block(
        "b",
        states=tuple(x),
        next=ca.vertcat(*(s.symbol for s in x)),
        parameters=mixed,
        outputs={"y": Output(total, "m")},
    )
    assert [v.name for v in arranged(block).parameters] == ["k_1", "h", "k_2", "k_3"]
    assert arranged(block).arrays == ()


def test_float_has_no_double_in_its_loops() -> None:
    text = source(law_block(gms(10), free=[]), FLOAT)
    assert "double" not in text
    assert "-0.0f; /* adds nothing" in text or "sum1 = " in text


def test_loops_do_not_read_inputs_past_their_guards() -> None:
    x = tuple(Variable(f"x_{i}", "m") for i in range(1, 9))
    total = sum((v.symbol**2 * ca.sin(v.symbol) for v in x), start=ca.SX(0))
    outputs = {"y": Output(total, "m"), "z": Output(2 * total, "m")}
    block = Block("b", inputs=x, outputs=outputs, arrays=(Elements("in", "x", 0, 8),))
    free, guarded = (routines(block, DOUBLE, guards=g)[-1].statements for g in (False, True))
    assert any("in->x[i]" in line for line in free)
    assert not any("in->x[i]" in line for line in guarded)
