"""Files, manifest, and the text of header and source.

Invalid arguments of generated C, compensators and embedded runs: one table of calls.

All laws in C: the bits of CasADi, no warnings, no undefined behaviour, valid C++.
"""

import json
import shutil
import subprocess
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from law_cases import CASES, NO_STEP
from one_program import LIMITED, STRICT, OneProgram, block_of, has_bits, is_near
from tables import Names, table

from symfric import BrownMcPhee, LuGre, Model, Output, Variable, Viscous, drive, law_from_text
from symfric.codegen import Block, generate, law_block, plant_block
from symfric.codegen.blocks.block import CBlock, ElementArray
from symfric.codegen.runner import run_vm
from symfric.codegen.source import header, interval, routines, source
from symfric.codegen.verification import excitation
from symfric.compensation import sine
from symfric.emitter.c99 import DOUBLE, FLOAT, REALS
from symfric.foundation.programs import Compiler, find_compiler
from symfric.laws import GMS
from symfric.model import Event
from symfric.scenes import ALL_SCENES, Drive

LUGRE = law_block(LuGre())


@pytest.fixture(scope="module")
def both(tmp_path_factory):
    """The package of LuGre in both types."""
    return generate(LuGre(), tmp_path_factory.mktemp("both") / "new" / "c")


def test_files_are_listed_in_their_order_and_the_same_at_each_call(both, tmp_path):
    names = [path.name for path in both.files]
    assert names == [
        *("lugre_f64.h", "lugre_f64.c", "lugre_f32.h", "lugre_f32.c", "lugre_f64_test.c"),
        *("lugre_f64_vectors.h", "lugre_f64_vectors.csv", "lugre_f32_test.c"),
        *("lugre_f32_vectors.h", "lugre_f32_vectors.csv", "lugre_block.cmake", "CMakeLists.txt"),
        *("lugre_ctypes.py", "lugre_sfun.c", "lugre_manifest.json"),
    ]
    assert sorted(path.name for path in both.folder.iterdir()) == sorted(names)
    again = generate(LuGre(), tmp_path, real="float")
    for name in ("lugre_f32.h", "lugre_f32.c", "lugre_f32_test.c", "lugre_f32_vectors.h"):
        assert (again.folder / name).read_bytes() == (both.folder / name).read_bytes()
    bare = generate(BrownMcPhee(), tmp_path / "bare", real="double", name="seal", kit=False)
    assert [p.name for p in bare.files] == ["seal_f64.h", "seal_f64.c", "seal_manifest.json"]


def test_the_manifest_names_everything_with_its_unit_and_ranges(tmp_path):
    made = generate(LuGre(), tmp_path, h=2e-3, free=("sigma_0", "mu_s"), kit=False)
    manifest = json.loads((tmp_path / "lugre_manifest.json").read_text())
    assert manifest == made.manifest
    assert [(s["name"], s["unit"], s["start"], s["range"]) for s in manifest["states"]] == [
        ("z", "m", 0.0, [None, None])
    ]
    known = {p["name"]: (p["unit"], p["default"]) for p in manifest["parameters"]}
    assert known == {"sigma_0": ("N/m", 1e5), "mu_s": ("1", 0.15)}
    known = {i["name"]: i["range"] for i in manifest["inputs"]}
    assert known == {"v": [-1e6, 1e6], "N": [0.0, 1e7]}
    assert manifest["outputs"][0]["unit"] == "N"
    assert (manifest["constants"]["h"], manifest["sample_time"]) == (2e-3, 2e-3)
    assert manifest["model"] == made.block.fingerprint
    assert manifest["real"]["float"]["bytes"] == {"state": 4, "param": 8, "in": 8, "out": 8}
    assert manifest["real"]["double"]["bytes"]["param"] == 16
    assert manifest["status"]["OUTPUT"]["bit"] == 16
    free = generate(LuGre(), tmp_path, real="float", kit=False, guards=False).manifest
    assert {i["name"]: i["range"] for i in free["inputs"]} == {"v": [None, None], "N": [0.0, None]}
    assert free["status"] == {}


def test_the_manifest_counts_operations_calls_and_bytes(both, tmp_path, monkeypatch):
    step = both.manifest["real"]["float"]["functions"]["lugre_f32_step"]
    assert step["calls"] == {"exp": 1, "expm1": 1, "fabs": 1, "tanh": 1}
    assert 45 <= step["operations"] <= 62
    assert step["prototype"].startswith("unsigned int lugre_f32_step(lugre_f32_state_t *state, ")
    compiler = find_compiler()
    if compiler is not None:
        measured = both.manifest["real"]["float"]["measured"]
        assert measured["compiler"] == str(compiler)
        assert measured["text"] is None or 100 < measured["text"] < 10_000
        assert measured["data"] in (0, None)
        if "gcc" in str(compiler):
            assert set(measured["stack"]) >= {"lugre_f32_step", "lugre_f32_init"}
            assert all(0 <= n < 1000 for n in measured["stack"].values())
    monkeypatch.setenv("PATH", "")
    monkeypatch.delenv("CC", raising=False)
    bare = generate(law_block(BrownMcPhee()), tmp_path, real="float")
    assert "measured" not in bare.manifest["real"]["float"]


def test_a_law_with_states_has_a_data_sheet_structs_and_a_step():
    text = header(CBlock(LUGRE, DOUBLE))
    for part in table(__file__)["header"]["parts"]:
        assert part in text
    turning = header(CBlock(law_block(LuGre(), turning=True), DOUBLE))
    assert all(f"[{unit}]" in turning for unit in ("rad/s", "N m", "N m/rad", "N m s/rad", "rad"))
    assert not any(f"[{unit}]" in turning for unit in ("m/s", "N", "N/m", "N s/m"))
    fixed = header(CBlock(law_block(LuGre(), h=2e-3), DOUBLE))
    assert "h = 0.002 s, a constant of this code: call it at exactly this interval." in fixed
    for file in (text, source(CBlock(LUGRE, FLOAT))):
        first = " ".join(file.splitlines()[:2])
        assert "symfric 0." in first
        assert f"CasADi {ca.__version__}" in first
        assert LUGRE.fingerprint in first


def test_a_static_law_is_a_function_of_scalars():
    block = law_block(BrownMcPhee())
    arguments = "float v, float N, const brown_mcphee_f32_param_t *param"
    assert f"float brown_mcphee_f32({arguments});" in header(CBlock(block, FLOAT, False))
    text = " ".join(header(CBlock(block, FLOAT)).split())
    assert f"float brown_mcphee_f32({arguments}, unsigned int *status);" in text
    assert "_state_t" not in text
    assert "_in_t" not in text
    assert "v sliding velocity [m/s], +-1e+06" in text
    constant = law_block(BrownMcPhee(), free=())
    assert "float brown_mcphee_f32(float v, float N);" in header(CBlock(constant, FLOAT, False))
    assert "_default" not in source(CBlock(constant, FLOAT))
    viscous = CBlock(law_block(Viscous()), DOUBLE)
    assert "double viscous_f64(double v, double N, const" in header(viscous)
    assert "    (void)N;\n" in source(viscous)


def test_ranges_of_members_are_common_and_defaults_of_an_array_are_its_ends():
    a, b = Variable("a", "1"), Variable("b", "1", nominal=10.0)
    for variables, group, guards, text in (
        ([a, b], "param", True, "+-1e+06"), ([a, b], "param", False, ""),
        ([Variable("c", "1", lower=0.5)], "in", False, ">= 0.5"),
        ([Variable("c", "1", lower=0.5)], "in", True, "0.5 to 1e+06"),
        ([Variable("d", "1", upper=2.0)], "state", True, "<= 2"),
    ):  # fmt: skip
        assert interval(variables, group, guards) == text
    k = GMS(form="event").elements
    text = header(CBlock(law_block(GMS(form="event")), DOUBLE))
    assert f"default {k[0].k:g} ... {k[-1].k:g}, " in text
    x = [Variable(f"x_{i}", "m", doc="place" if i < 3 else "end") for i in (1, 2, 3)]
    for size, doc in ((2, "place, of each element"), (3, "of each element")):
        y = {n: Output(x[0].symbol, "m") for n in "yz"}
        made = Block("b", inputs=tuple(x), outputs=y, arrays=(ElementArray("in", "x", 0, size),))
        assert made.members["in"][0].doc == doc


def test_float_code_holds_no_double_and_without_guards_no_trace_of_them():
    for word in ("malloc", "stdio", "double"):
        assert word not in source(CBlock(LUGRE, FLOAT))
    for text in (header(CBlock(LUGRE, FLOAT, False)), source(CBlock(LUGRE, FLOAT, False))):
        for word in ("status", "stdint", "string.h", "_lost", "_unfit", "static "):
            assert word not in text.replace("static friction", "")


def test_math_functions_can_be_replaced(compiler: Compiler, tmp_path):
    made = generate(BrownMcPhee(), tmp_path, real="double", kit=False)
    (tmp_path / "mine.h").write_text("double mine(double x);\n#define SF_TANH mine\n")
    target = tmp_path / "out.o"
    flags = ("-include", tmp_path / "mine.h", "-c", made.source("double"), "-o", target)
    compiler.run("-std=c99", *map(str, flags))
    assert b"mine" in target.read_bytes()
    assert b"tanh" not in target.read_bytes()


def test_states_are_read_before_any_is_written_and_texts_cannot_end_their_comment():
    x, y = Variable("x", "1", start=1.0), Variable("y", "1", start=2.0)
    block = Block("swap", states=(x, y), next=ca.vertcat(y.symbol, x.symbol))
    step = routines(CBlock(block, DOUBLE, guards=False))[-1]
    assert {*step.statements[:2]} == {"const double x = state->x;", "const double y = state->y;"}
    assert {*step.statements[2:]} == {"state->x = y;", "state->y = x;"}
    x = Variable("x", "N*/m", doc="/* load */")
    block = Block("f", doc="*/ int f; /*", inputs=(x,), outputs={"y": Output(x.symbol, "1")})
    text = header(CBlock(block, DOUBLE))
    assert text.count("/*") == text.count("*/")
    for real in REALS.values():
        lines = source(CBlock(law_block(law_from_text("lugre+dahl")), real)).splitlines()
        assert max(map(len, lines)) <= 100


TABLE = table(__file__, "refusals")
x, z, u, h = (Variable(n, unit) for n, unit in (("x", "m"), ("z", "1"), ("u", "m/s"), ("h", "s")))


def lag(**changes) -> Block:
    parts = {"name": "lag", "states": (x,), "inputs": (u,), "parameters": (h,),
             "next": x.symbol + h.symbol * u.symbol,
             "outputs": {"y": Output(2 * x.symbol, "m")}}  # fmt: skip
    return Block(**parts | changes)


t = ca.SX.sym("t")
NAMES = {
    "ca": ca, "u": u, "h": h, "lag": lag, "plant": drive(LuGre()),
    "wave": sine(0.01, 1.0, 1.0),
    "ball": Model("ball", x=(x,), ode=-x.symbol, events=(Event("hit", x.symbol - 0.5),)),
    "clock": Model("clock", x=(x,), ode=-x.symbol, outputs={"now": Output(t, "s")}, t=t),
    "leak": Model("leak", x=(x,), z=(z,), ode=-z.symbol, alg=z.symbol + z.symbol**3 - x.symbol),
}  # fmt: skip


@pytest.mark.parametrize("group", TABLE)
def test_bad_arguments_are_refused_in_a_sentence_and_write_nothing(group, tmp_path):
    names = Names(NAMES, OUT=tmp_path / "c", FILE=tmp_path / "file")
    names["FILE"].write_text("")
    for call, words in TABLE[group].items():
        with pytest.raises(ValueError) as caught:
            eval(call, {}, names)
        assert words in str(caught.value), call
        assert not names["OUT"].exists()


LAWS = [name for name in CASES if name not in NO_STEP]
STEEP = "lagged(stribeck)"
"""A filtered velocity of 2 m/s in float is known to 1e-7 m/s, 1/1000 of the width of the law."""
FEW = (
    *("stribeck", "brown_mcphee", "self_tuning", "lugre", "dahl, n 0.5", "maxwell_slip"),
    *("bouc_wen", "lagged(stribeck)", "asymmetric(lugre)", "haessig_friedland, event"),
)


@pytest.fixture(scope="module")
def laws(compiler: Compiler, tmp_path_factory) -> OneProgram:
    blocks = [block_of(CASES[name]) for name in LAWS]
    return OneProgram(blocks, tmp_path_factory.mktemp("laws"), compiler, flags=("-O0",))


def test_double_has_the_bits_of_casadi_and_guards_report_every_repair(laws: OneProgram) -> None:
    has_bits(laws, frozenset(map(LAWS.index, LIMITED)))


def test_headers_and_sources_are_valid_cpp(laws: OneProgram) -> None:
    if shutil.which("g++") is None:
        pytest.skip("no g++ on this machine")
    folder = laws.executable.parent
    (folder / "all.cpp").write_text("".join(f'#include "{c.name}.c"\n' for c in laws.several))
    strict = [flag for flag in STRICT if flag not in ("-std=c99", "-Wmissing-prototypes")]
    command = ["g++", "-std=c++11", *strict, "-fsyntax-only", "all.cpp"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.parametrize("names", [FEW, pytest.param(LAWS, marks=pytest.mark.slow)], ids=len)
def test_float_is_near_from_the_same_states(names, compiler: Compiler, tmp_path: Path) -> None:
    program = OneProgram([block_of(CASES[n]) for n in names], tmp_path, compiler, real="float")
    is_near(program, 4e-6, [k for k, name in enumerate(names) if name == STEEP])


@pytest.mark.slow
def test_every_scene_with_two_laws_has_the_bits_of_casadi(compiler: Compiler, tmp_path) -> None:
    scenes = [scene for name, scene in ALL_SCENES.items() if name != "arm"]
    blocks = [plant_block(scene(law)) for scene in scenes for law in (BrownMcPhee(), LuGre())]
    program = OneProgram(blocks, tmp_path, compiler, flags=("-O0",))
    for k, c in enumerate(program.several):
        u = excitation(c.block, 60)
        (rows,) = program.run([(k, u)])
        assert np.array_equal(rows, run_vm(c, u), equal_nan=True)


@pytest.mark.slow
def test_clang_agrees(tmp_path: Path) -> None:
    if shutil.which("clang") is None:
        pytest.skip("no clang on this machine")
    blocks = [*(block_of(CASES[name]) for name in FEW), plant_block(Drive(LuGre()))]
    has_bits(OneProgram(blocks, tmp_path, Compiler(("clang",)), flags=("-O2",)))
