"""The text of header and source: what a user of the C sees, and what every compiler accepts."""

import shutil
import subprocess

import casadi as ca
import pytest
from law_cases import NO_STEP, SYMMETRIC
from symfric.codegen.header import header, interval
from symfric.codegen.routines import routines, source

from symfric import BrownMcPhee, LuGre, Output, Variable, Viscous
from symfric.codegen import Block, generate, law_block
from symfric.codegen.runner import FLAGS, WARNINGS, compile_object
from symfric.emitter.c99 import DOUBLE, FLOAT
from symfric.laws import GMS

STRICT = [*WARNINGS, "-Werror"]
GENERATED = {name: law for name, law in SYMMETRIC.items() if name not in NO_STEP}
FEW = ("brown_mcphee", "self_tuning", "lugre", "maxwell_slip", "lugre+dahl")
"""A function, one with branches, a state, elements that yield, a sum: what every suite compiles."""


def compiled(command, arguments):
    done = subprocess.run([*command, *map(str, arguments)], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""


@pytest.fixture(
    scope="module", params=[FEW, pytest.param(tuple(GENERATED), marks=pytest.mark.slow)],
    ids=["few", "all"],
)  # fmt: skip
def everything(request, tmp_path_factory):
    """Laws in both types in one folder, and a program that includes and calls all of it."""
    folder = tmp_path_factory.mktemp("laws")
    headers, sources, uses = [], [], []
    for i, law in enumerate(GENERATED[name] for name in request.param):
        made = generate(law, folder, name=f"law_{i}", kit=False)
        for real in made.reals:
            headers.append(made.header(real).name)
            sources.append(made.source(real))
        inputs = ", ".join(str(k) for k in range(len(made.block.inputs)))
        call = f"({inputs}, &law_{{0}}_{{1}}_default, &status)"
        suffix = call if made.block.is_function else "_reset(&s_{0}_{1})"
        for kind in ("f32", "f64"):
            state = "" if made.block.is_function else f"law_{i}_{kind}_state_t s_{i}_{kind}; "
            uses.append(state + f"law_{i}_{kind}{suffix.format(i, kind)};")
    includes = "".join(f'#include "{name}"\n' for name in headers)
    main = folder / "main.c"
    body = "\n".join(["unsigned int status = 0u;", *uses, "return status != 0u;"])
    main.write_text(f"{includes}int main(void) {{\n{body}\n}}\n")
    return main, sources


def test_every_law_in_both_types_compiles_strictly_and_lives_in_one_program(
    each_compiler, everything, tmp_path
):
    main, sources = everything
    for i, file in enumerate(sources):
        compiled([each_compiler], [*FLAGS, *STRICT, "-c", file, "-o", tmp_path / f"{i}.o"])
    objects = [tmp_path / f"{i}.o" for i in range(len(sources))]
    compiled([each_compiler], [*FLAGS, main, *objects, "-o", tmp_path / "main", "-lm"])
    compiled([tmp_path / "main"], [])


@pytest.mark.parametrize("cpp", ["g++", "clang++"])
def test_headers_and_sources_are_valid_cpp(cpp, everything, tmp_path):
    if shutil.which(cpp) is None:
        pytest.skip(f"no {cpp} on this machine")
    main, sources = everything
    strict = [flag for flag in STRICT if flag != "-Wmissing-prototypes"]
    (tmp_path / "main.cpp").write_text(main.read_text())
    options = ["-std=c++11", f"-I{main.parent}", "-c", "-o", tmp_path / "out.o"]
    compiled([cpp], [*options, tmp_path / "main.cpp"])
    for file in sources:
        compiled([cpp], [*options, *strict, "-x", "c++", file])


def test_cpp_links_against_the_c_objects(everything, compiler, tmp_path):
    if shutil.which("g++") is None:
        pytest.skip("no g++ on this machine")
    main, sources = everything
    objects = []
    for i, file in enumerate(sources):
        objects.append(tmp_path / f"{i}.o")
        compile_object(compiler, file, objects[-1])
    (tmp_path / "main.cpp").write_text(main.read_text())
    compiled(["g++"], [f"-I{main.parent}", tmp_path / "main.cpp", *objects, "-o", tmp_path / "m"])
    compiled([tmp_path / "m"], [])


def test_a_law_with_states_has_structs_and_a_step():
    text = header(law_block(LuGre()), DOUBLE)
    assert "    double mu_s;    /* static friction coefficient [1], default 0.15, " in text
    assert "    double z; /* mean bristle deflection [m], start 0 */\n" in text
    assert "extern const lugre_f64_state_t lugre_f64_start;" in text
    assert "void lugre_f64_reset(lugre_f64_state_t *state);\n" in text
    assert "extern const lugre_f64_param_t lugre_f64_default;" in text
    assert "dz/dt = v - sigma_0 |v| z / g" in text
    assert "    delta = 2  Stribeck exponent [1]\n" in text
    assert "SPDX-License-Identifier: MIT-0" in text


def test_a_range_is_where_all_numbers_of_a_member_are_valid():
    a, b = Variable("a", "1"), Variable("b", "1", nominal=10.0)
    assert interval([a, b], "param", guards=True) == "+-1e+06"
    assert interval([a, b], "param", guards=False) == ""
    load = Variable("c", "1", lower=0.5)
    assert interval([load], "in", guards=False) == ">= 0.5"
    assert interval([load], "in", guards=True) == "0.5 to 1e+06"
    assert interval([Variable("d", "1", upper=2.0)], "state", guards=True) == "<= 2"
    assert interval([Variable("e", "1", lower=-2.0, upper=2.0)], "in", guards=True) == "+-2"


def test_defaults_of_an_array_that_differ_are_its_ends():
    text = header(law_block(GMS(form="event")), DOUBLE)
    k = GMS(form="event").elements
    assert f"default {k[0].k:g} ... {k[-1].k:g}, " in text


def test_a_static_law_is_a_function_of_scalars():
    block = law_block(BrownMcPhee())
    arguments = "float v, float N, const brown_mcphee_f32_param_t *param"
    assert f"float brown_mcphee_f32({arguments});" in header(block, FLOAT, guards=False)
    text = " ".join(header(block, FLOAT).split())
    assert f"float brown_mcphee_f32({arguments}, unsigned int *status);" in text
    assert "_state_t" not in text
    assert "_in_t" not in text


def test_a_law_without_variable_parameters_has_no_parameter_struct():
    block = law_block(BrownMcPhee(), free=())
    assert "float brown_mcphee_f32(float v, float N);" in header(block, FLOAT, guards=False)
    assert "_default" not in source(block, FLOAT)


def test_an_unused_input_stays_in_the_interface():
    block = law_block(Viscous())
    assert "double viscous_f64(double v, double N, const" in header(block, DOUBLE)
    assert "    (void)N;\n" in source(block, DOUBLE)


def test_header_and_source_name_their_origin():
    block = law_block(LuGre())
    for text in (header(block, FLOAT), source(block, FLOAT)):
        first = " ".join(text.splitlines()[:2])
        assert "symfric 0." in first
        assert f"CasADi {ca.__version__}" in first
        assert block.fingerprint in first


@pytest.mark.parametrize("word", ["malloc", "stdio", "double"])
def test_float_code_holds_none_of(word):
    assert word not in source(law_block(LuGre()), FLOAT)
    assert "static " not in source(law_block(LuGre()), FLOAT, guards=False)


def test_math_functions_can_be_replaced(compiler, tmp_path):
    made = generate(BrownMcPhee(), tmp_path, real="double")
    (tmp_path / "mine.h").write_text("double mine(double x);\n#define SF_TANH mine\n")
    target = tmp_path / "out.o"
    flags = ["-include", tmp_path / "mine.h", "-c", made.source("double"), "-o", target]
    compiled(compiler.command, [*FLAGS, *flags])
    assert b"mine" in target.read_bytes()
    assert b"tanh" not in target.read_bytes()


def test_states_are_read_before_any_is_written():
    x, y = Variable("x", "1", start=1.0), Variable("y", "1", start=2.0)
    block = Block("swap", states=(x, y), next=ca.vertcat(y.symbol, x.symbol))
    step = routines(block, DOUBLE, guards=False)[-1]
    assert {*step.statements[:2]} == {"const double x = state->x;", "const double y = state->y;"}
    assert {*step.statements[2:]} == {"state->x = y;", "state->y = x;"}


def test_text_cannot_end_its_comment():
    x = Variable("x", "N*/m", doc="/* load */")
    block = Block("f", doc="*/ int f; /*", inputs=(x,), outputs={"y": Output(x.symbol, "1")})
    text = header(block, DOUBLE)
    assert text.count("/*") == text.count("*/")


def test_lines_are_short():
    block = law_block(GENERATED["lugre+dahl"])
    for real in (DOUBLE, FLOAT):
        assert max(map(len, source(block, real).splitlines())) <= 100
