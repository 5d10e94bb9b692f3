"""Selects with costly sides are branches: what stands inside, what shares one, what is stored."""

from pathlib import Path

import casadi as ca
import numpy as np
import pytest

from symfric import LuGre, Output, Variable, VelocityBased
from symfric.codegen import Block, generate, law_block
from symfric.codegen.routines import routines
from symfric.codegen.runner import link_program, program, run_c, run_vm
from symfric.emitter.c99 import DOUBLE
from symfric.emitter.emit import Code, emit
from symfric.foundation.graph import graph
from symfric.foundation.programs import Compiler

x, y, z = (ca.SX.sym(name) for name in "xyz")
less = x < y


def code(*results: ca.SX, **options) -> Code:
    """Of functions of x, y, z."""
    source = graph(ca.Function("f", [x, y, z], [*results]))
    targets = [[f"r{k} = {{}};"] for k in range(len(results))]
    return emit(source, [["x"], ["y"], ["z"]], targets, DOUBLE, **options)


def test_only_the_side_that_is_taken_is_computed() -> None:
    found = code(ca.if_else(less, ca.sin(x), ca.exp(y) / z))
    assert found.lines == (
        "if (x < y) {",
        "    r0 = SF_SIN(x);",
        "} else {",
        "    r0 = SF_EXP(y) / z;",
        "}",
    )
    assert found.operations == 5
    assert found.outside == 2
    assert found.calls == {"sin": 1, "exp": 1}


def test_cheap_sides_stay_in_the_formula() -> None:
    assert code(ca.if_else(less, x + 1, y * z)).lines == ("r0 = x < y ? x + 1.0 : y * z;",)
    assert code(ca.if_else(less, x * z + y, 2)).lines == ("r0 = x < y ? x * z + y : 2.0;",)


def test_what_others_take_too_stays_outside() -> None:
    s = ca.sin(x)
    found = code(ca.if_else(less, s * ca.exp(y), 2.0), s)
    assert found.lines[0] == "const double t1 = SF_SIN(x);"
    assert found.lines.index("r1 = t1;") < len(found.lines)
    assert "    r0 = t1 * SF_EXP(y);" in found.lines


def test_selects_with_one_condition_share_a_branch() -> None:
    s = ca.exp(x)
    first, second = ca.if_else(less, s, ca.sin(y)), ca.if_else(less, s * s, z)
    lines = code(first, second).lines
    assert [line for line in lines if "if" in line or "else" in line] == [
        "if (x < y) {",
        "} else {",
    ]
    assert lines.count("    const double t1 = SF_EXP(x);") == 1


def test_a_select_that_needs_another_one_of_the_branch_is_inside_with_it() -> None:
    first = ca.if_else(less, ca.exp(x), ca.sin(y))
    second = ca.if_else(less, first * 3, first + ca.cos(y))
    lines = code(first, second).lines
    assert sum("if (" in line for line in lines) == 1
    assert "    r1 = 3.0 * t1;" in lines


def test_a_condition_that_is_met_again_later_makes_a_second_branch() -> None:
    """The sum between them is needed outside: one branch cannot hold both."""
    first = ca.if_else(less, ca.exp(x), ca.sin(y))
    between = first + z
    second = ca.if_else(less, ca.tan(between), ca.cos(between))
    lines = code(second, between).lines
    assert sum("if (" in line for line in lines) == 2


def test_chains_are_else_if() -> None:
    inner = ca.if_else(y < z, ca.exp(y), ca.cos(z))
    assert code(ca.if_else(less, ca.sin(x), inner)).lines == (
        "if (x < y) {",
        "    r0 = SF_SIN(x);",
        "} else if (y < z) {",
        "    r0 = SF_EXP(y);",
        "} else {",
        "    r0 = SF_COS(z);",
        "}",
    )


def test_a_side_that_others_take_has_a_variable_of_its_own() -> None:
    inner = ca.if_else(y < z, ca.exp(y), ca.cos(z))
    lines = code(ca.if_else(less, ca.sin(x), inner), ca.if_else(less, z, inner * inner)).lines
    assert "    r0 = t1;" in lines
    assert "    r1 = t1 * t1;" in lines


def test_a_guard_that_its_branch_answers_is_gone() -> None:
    near = ca.fabs(x) < 0.1
    found = code(ca.if_else(near, 1 + x / 2, ca.expm1(x) / ca.if_else(near, 1, x)))
    assert "    r0 = SF_EXPM1(x) / x;" in found.lines


def test_nesting_ends_somewhere() -> None:
    value = x
    for k in range(200):
        value = ca.if_else(x < 200 - k, ca.sin(x + k), value)
    lines = code(value).lines
    assert max(len(line) - len(line.lstrip()) for line in lines) <= 4 * 31
    assert sum("if (" in line for line in lines) == 30


@pytest.mark.parametrize("cheap", [1, 12])
def test_many_cheap_selects_are_no_branch(cheap: int) -> None:
    """Their operands would wait for each other."""
    results = [ca.if_else(less, x + k, z) for k in range(cheap)]
    assert not any("if (" in line for line in code(*results).lines)


def test_states_may_be_results() -> None:
    """A place is read before it is written, also in a branch, and not written with its value."""
    loads = {(0, 0): "s->a", (1, 0): "s->b"}
    a = ca.if_else(z > 0, ca.sin(y), x)
    source = graph(ca.Function("f", [x, y, z], [a, x]))
    targets = [["s->a = {};"], ["s->b = {};"]]
    found = emit(source, [["a"], ["b"], ["z"]], targets, DOUBLE, loads=loads)
    lines = [line.strip() for line in found.lines]
    assert "if (z > 0.0) {" in lines
    assert "s->a = a;" not in lines
    assert lines.index("const double a = s->a;") < lines.index("s->a = SF_SIN(b);")
    assert lines.index("const double b = s->b;") < lines.index("s->b = a;")
    assert found.used == {(0, 0), (1, 0), (2, 0)}
    kept = emit(graph(ca.Function("f", [x], [x])), [["a"]], [["s->a = {};"]], DOUBLE, loads=loads)
    assert kept.lines == ()
    assert kept.used == frozenset()


def test_a_side_that_keeps_its_state_is_left_out() -> None:
    loads = {(0, 0): "s->a"}
    for condition, shown in ((z > 0, "!(z > 0.0)"), (z == 0, "z != 0.0")):
        a = ca.if_else(condition, x, ca.sin(y))
        source = graph(ca.Function("f", [x, y, z], [a]))
        found = emit(source, [["a"], ["b"], ["z"]], [["s->a = {};"]], DOUBLE, loads=loads)
        assert found.lines == (f"if ({shown}) {{", "    s->a = SF_SIN(b);", "}")


def test_places_without_a_name_are_written_last() -> None:
    """They may be those of the results."""
    names = [["a[0]"], ["a[1]"], ["a[2]"]]
    source = graph(ca.Function("f", [x, y, z], [y, ca.if_else(less, ca.sin(x), z)]))
    lines = emit(source, names, [["r[0] = {};"], ["r[1] = {};"]], DOUBLE).lines
    assert lines[-2:] == ("r[0] = a[1];", "r[1] = t1;")


def test_a_parameter_of_one_side_is_loaded_there() -> None:
    loads = {(2, 0): "param->c"}
    source = graph(ca.Function("f", [x, y, z], [ca.if_else(less, ca.sin(x) * z, y)]))
    lines = emit(source, [["x"], ["y"], ["c"]], [["r = {};"]], DOUBLE, loads=loads).lines
    assert lines[1] == "    const double c = param->c;"


def test_in_place_steps_with_branches_have_the_bits_of_casadi(
    compiler: Compiler, tmp_path: Path
) -> None:
    """States that change places, in branches that read both."""
    a, b = Variable("a", "1", start=0.3), Variable("b", "1", start=-0.4)
    u = Variable("u", "1")
    p, q = a.symbol, b.symbol
    swapped = ca.if_else(u.symbol > 0, ca.vertcat(q + ca.sin(u.symbol), p), ca.vertcat(p, -q))
    again = ca.if_else(swapped[0] < swapped[1], ca.vertcat(swapped[1], ca.cos(p)), swapped)
    block = Block("places", states=(a, b), inputs=(u,), next=again, outputs={"y": Output(p, "1")})
    inputs = np.random.default_rng(5).standard_normal((500, 1))
    made = generate(block, tmp_path, real="double", guards=False)
    (tmp_path / "main.c").write_text(program(block, DOUBLE, guards=False))
    parts = [tmp_path / "main.c", made.source("double")]
    link_program(compiler, parts, tmp_path, tmp_path / "main")
    found = run_c(block, DOUBLE, tmp_path / "main", inputs, guards=False)
    assert np.array_equal(found, run_vm(block, DOUBLE, inputs, guards=False))


def test_operations_of_laws_outside_of_branches() -> None:
    """Counts: a law that grew dearer, or lost its branches, shows here."""
    step = routines(law_block(LuGre()), DOUBLE, guards=False)[-1]
    assert step.calls == {"exp": 1, "tanh": 1, "expm1": 1, "fabs": 1}
    lines = "\n".join(step.statements)
    assert lines.index("if (fabs(") < lines.index("SF_EXPM1(") < lines.rindex("} else {")
    friction = routines(law_block(VelocityBased()), DOUBLE, guards=False)[0]
    assert friction.calls == {"fabs": 1}
    assert not any("fmin" in line or "fmax" in line for line in friction.statements)
