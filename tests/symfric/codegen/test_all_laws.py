"""All laws in C: the bits of CasADi, no warnings, no undefined behaviour, valid C++."""

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from law_cases import CASES, NO_STEP
from one_program import LIMITED, STRICT, OneProgram, block_of, has_bits, is_near

from symfric.codegen import plant_block
from symfric.codegen.runner import run_vm
from symfric.codegen.verification import excitation
from symfric.foundation.programs import Compiler
from symfric.laws import BrownMcPhee, LuGre
from symfric.scenes import ALL_SCENES, Drive

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
