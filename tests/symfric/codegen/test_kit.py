"""Packages: unit tests pass on generated C and fail on changed C; wrappers have CasADi's bits."""

import csv
import importlib.util
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from law_cases import CASES, NO_STEP
from one_program import STRICT, block_of
from robots import SMALL

from symfric import BrownMcPhee, LuGre
from symfric.codegen import generate, inverse_dynamics_block, law_block, plant_block
from symfric.codegen.blocks.block import CBlock
from symfric.codegen.kit import kit_files, wrapper
from symfric.codegen.runner import run_vm
from symfric.codegen.source import header, source
from symfric.codegen.vectors import excitation
from symfric.emitter.c99 import DOUBLE, FLOAT
from symfric.foundation.programs import Compiler
from symfric.laws import GMS
from symfric.scenes import ALL_SCENES, Drive

LUGRE = block_of(LuGre())
EVENT = law_block(GMS(form="event"), h=2e-3)


class UnitTests:
    """Unit tests of several C blocks, some with changed sources, in one program."""

    def __init__(self) -> None:
        self.parts, self.calls = list[str](), list[str]()

    def add(self, c: CBlock, *sources: str) -> None:
        """Add a block, once with each of some changed sources if there are any."""
        kit = kit_files([c])
        for text in sources or (source(c),):
            new = f"t{len(self.calls)}"
            self.calls.append(f'printf("{new} %d\\n", {new}_test());')
            vectors, test = kit[f"{c.name}_vectors.h"], kit[f"{c.name}_test.c"]
            no_main = f"#define {new.upper()}_TEST_NO_MAIN\n"
            for part in (header(c), text, vectors, no_main + test):
                alone = re.sub(r'#include "[^"]*"', "", part).replace(c.name.upper(), new.upper())
                self.parts.append(alone.replace(c.name, new))

    def wrong(self, folder: Path, compiler: Compiler, *flags: str) -> list[int]:
        """Compile and run all; return the number of wrong results of each."""
        file, target = folder / "tests.c", folder / "tests"
        main = f"int main(void) {{ {' '.join(self.calls)} }}"
        file.write_text("\n".join(["#include <stdio.h>", *self.parts, main]))
        compiler.run(*STRICT, *(flags or ("-O0",)), str(file), "-o", str(target), "-lm")
        done = subprocess.run([target], capture_output=True, text=True, check=True, timeout=20)
        return [int(line.split()[1]) for line in done.stdout.splitlines() if line[0] == "t"]


def test_unit_tests_of_generated_c_pass(compiler, tmp_path):
    tests = UnitTests()
    for block in (LUGRE, block_of(BrownMcPhee())):
        for real, guards in ((DOUBLE, True), (FLOAT, True), (FLOAT, False)):
            tests.add(CBlock(block, real, guards))
    tests.add(CBlock(EVENT, FLOAT))
    assert not any(tests.wrong(tmp_path, compiler))


@pytest.mark.slow
def test_unit_tests_of_all_laws_and_scenes_pass_also_with_fused_operations(compiler, tmp_path):
    tests = UnitTests()
    laws = [block_of(law) for name, law in CASES.items() if name not in NO_STEP]
    scenes = [scene for name, scene in ALL_SCENES.items() if name != "arm"]
    for block in (*laws, *(plant_block(scene(LuGre())) for scene in scenes)):
        for real in (DOUBLE, FLOAT):
            tests.add(CBlock(block, real))
    assert not any(tests.wrong(tmp_path, compiler))
    flags = ("-ffp-contract=fast", "-march=native") if "gcc" in str(compiler) else ()
    assert not any(tests.wrong(tmp_path, compiler, "-O2", *flags))


def changed_lines(text: str) -> dict[str, str]:
    """Sources in which one line of arithmetic is wrong by a thousandth, by line."""
    found, lines = dict[str, str](), text.splitlines(keepends=True)
    begin = next(i for i, line in enumerate(lines) if line.startswith("{"))
    for i, line in enumerate(lines[begin:], start=begin):
        made = re.match(r"    +(?:(?:const )?double \w+ =|[\w>.\-\[\]]+ =|return) (.*);$", line)
        if made and not re.search(r"->|_start|status|0u|bool", made[1]):
            new = line.replace(f"{made[1]};", f"1.001 * ({made[1]});")
            found[line] = "".join([*lines[:i], new, *lines[i + 1 :]])
    return found


def test_unit_tests_fail_if_any_line_is_wrong(compiler, tmp_path):
    tests, what = UnitTests(), list[str]()
    for block, wrong in (
        (LUGRE, {
            "0.15, ": "0.1501, ",
            "status |= LUGRE_F64_STATE": "status |= 0u",
            "const double sigma_1 = param->sigma_1;": "const double sigma_1 = 190.0; (void)param;",
        }),
        (block_of(BrownMcPhee()), {"return F;": "return 0.0 * HUGE_VAL + F;"}),
    ):  # fmt: skip
        c, bare = CBlock(block, DOUBLE), CBlock(block, DOUBLE, guards=False)
        changes = changed_lines(source(bare))
        assert len(changes) >= 4
        assert all(old in source(c) for old in wrong)
        tests.add(bare, *changes.values())
        tests.add(c, *(source(c).replace(old, new) for old, new in wrong.items()))
        what += [*changes, *wrong]
    found = tests.wrong(tmp_path, compiler)
    alive = [line.strip() for line, number in zip(what, found, strict=True) if not number]
    assert alive == ["state->z = 0.0;", "out->F = t1;", "out->F_end = t1;"]  # without load


def test_a_unit_test_prints_what_is_wrong_and_the_table_holds_its_rows(compiler, tmp_path):
    made = generate(LuGre(), tmp_path, real="float")
    file = made.source("float")
    file.write_text(file.read_text().replace("190.0f,", "191.0f,"))
    files = (str(tmp_path / "lugre_f32_test.c"), str(file))
    compiler.run("-DLUGRE_F32_TEST_PRINT", *files, "-o", str(tmp_path / "test"), "-lm")
    done = subprocess.run([tmp_path / "test"], capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert re.match(r"lugre_f32: row \d+: [1-9] wrong\n", done.stdout)
    table = (tmp_path / "lugre_f32_vectors.csv").read_text().splitlines()
    head, tolerance, *rows = csv.reader(table)
    assert head == [
        "z before [m]", "v [m/s]", "N [N]", "changed parameter", "its value",
        "z after [m]", "F [N]", "F_end [N]", "z by init_sliding [m]", "status",
    ]  # fmt: skip
    assert float(tolerance[6]) > 0
    text = (tmp_path / "lugre_f32_vectors.h").read_text()
    assert f"#define LUGRE_F32_VECTORS {len(rows)}\n" in text
    assert any(row[3] == "sigma_1" and float(row[4]) == 237.5 for row in rows)


def done(*command: object, **options: object) -> str:
    """Output of a command that succeeds."""
    ran = subprocess.run(
        [*map(str, command)], capture_output=True, text=True, check=False, **options
    )
    assert ran.returncode == 0, ran.stdout + ran.stderr
    return ran.stdout + ran.stderr


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("cmake") is None, reason="needs cmake")
def test_cmake_builds_packages_in_one_folder_also_for_a_core_without_a_system(compiler, tmp_path):
    kit = tmp_path / "kit with space"
    first = {path: path.read_bytes() for path in generate(LuGre(), kit, real="float").files}
    second = generate(BrownMcPhee(), kit, real="double").files
    assert {path.name for path in first} & {path.name for path in second} == {"CMakeLists.txt"}
    assert all(path.read_bytes() == text for path, text in first.items())
    build, bare = tmp_path / "build", tmp_path / "bare"
    done("cmake", "-S", kit, "-B", build)
    done("cmake", "--build", build, "--parallel", "2")
    assert "100% tests passed, 0 tests failed out of 2" in done("ctest", cwd=build)
    assert any(build.glob("*lugre_shared.*"))
    (tmp_path / "CMakeLists.txt").write_text(
        "cmake_minimum_required(VERSION 3.13)\nproject(servo C)\nenable_testing()\n"
        'add_subdirectory("kit with space")\nadd_executable(servo main.c)\n'
        "target_link_libraries(servo PRIVATE lugre)\n"
    )
    (tmp_path / "main.c").write_text(
        '#include "lugre_f32.h"\nint main(void) { lugre_f32_state_t s; lugre_f32_out_t o;\n'
        "lugre_f32_in_t in = {0.1f, 1.0f}; lugre_f32_reset(&s);\n"
        "return (int)lugre_f32_step(&s, &lugre_f32_default, &in, &o); }\n"
    )
    reported = done("cmake", "-S", tmp_path, "-B", bare, "-DCMAKE_SYSTEM_NAME=Generic")
    assert "Warning" not in reported + done("cmake", "--build", bare)
    assert (bare / "servo").is_file()
    assert not [*bare.rglob("*_test*"), *bare.rglob("*shared*.so")]


def loaded(made):
    path = made.folder / f"{made.block.name}_ctypes.py"
    spec = importlib.util.spec_from_file_location(path.stem, path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.Block


@pytest.fixture(scope="module")
def from_python(compiler, tmp_path_factory):
    """Loader class of LuGre in both types."""
    return loaded(generate(LuGre(), tmp_path_factory.mktemp("python")))


def test_the_loader_has_the_bits_of_casadi_and_names_of_the_block(from_python):
    inputs = excitation(LUGRE)[:200]
    block = from_python()
    found = block.run(v=inputs[:, 0], N=inputs[:, 1])
    expected = run_vm(CBlock(LUGRE, DOUBLE), inputs)
    for i, output in enumerate(LUGRE.outputs, start=1):
        assert np.array_equal(found[output], expected[:, i])
    assert (found["status"] == 0).all()
    assert block.run(v=[0.1, np.nan, 0.1], N=8.0)["status"].tolist() == [0, 2, 0]
    assert block.status == 2
    p = [float(v.start) * (2.0 if v.name == "sigma_0" else 1.0) for v in LUGRE.parameters]
    z, y = LUGRE.step(3e-6, p, [2e-4, 8.0])
    for real, rel in (("double", 1e-15), ("float", 1e-5)):
        one = from_python(real, start={"z": 3e-6}, sigma_0=2e5)
        found = one.step(v=2e-4, N=8.0)
        assert one.state.z == pytest.approx(float(z), rel=rel)
        assert [found["F"], found["F_end"]] == pytest.approx(y.full().ravel(), rel=rel)
        one.param.sigma_0 = 1e5
        one.start_by("init_sliding", v=0.1, N=8.0)
        assert one.state.z == pytest.approx(8e-6, rel=1e-6)
        one.reset()
        assert one.state.z == 0.0
    for call, arguments, message in (
        (from_python, {"real": "half"}, "expected one of double"),
        (from_python, {"mu": 1.0}, "expected one of mu_s"),
        (from_python, {"start": {"y": 1.0}}, "expected one of z"),
        (block.step, {"v": 1.0}, "expected the inputs v, N, got v"),
    ):
        with pytest.raises(ValueError, match=message):
            call(**arguments)


TWO = SMALL.replace(
    "</robot>",
    '<link name="hand"><inertial><mass value="1"/><inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" '
    'ixz="0" iyz="0"/></inertial></link><joint name="elbow" type="continuous"><parent link="arm"/>'
    '<child link="hand"/><origin xyz="0 0 -0.5"/><axis xyz="0 1 0"/></joint></robot>',
)


def test_arrays_of_the_c_are_arrays_of_the_loader(compiler, tmp_path):
    block = inverse_dynamics_block(TWO)
    names = ["q_1", "q_2", "qd_1", "qd_2", "qdd_1", "qdd_2"]
    made = loaded(generate(block, tmp_path / "a", real="double"))()
    rows = np.random.default_rng(0).normal(size=(5, 6))
    single = made.run(**dict(zip(names, rows.T, strict=True)))
    whole = made.run(q=rows[:, :2], qd=rows[:, 2:4], qdd=rows[:, 4:])
    assert np.array_equal(whole["tau"], np.column_stack([single["tau_1"], single["tau_2"]]))
    with pytest.raises(ValueError, match="q: expected 2 numbers"):
        made.step(q=[0, 1, 2], qd=[0, 0], qdd=[0, 0])
    event = loaded(generate(law_block(GMS(form="event")), tmp_path / "b", real="double"))
    assert [*event(k=[1e5, 2e5, 3e5, 4e5]).param.k] == [1e5, 2e5, 3e5, 4e5]
    for value in (3.0, [1e5] * 5):
        with pytest.raises(ValueError, match=r"k: expected 4 number\(s\), got"):
            event(k=value)


def test_the_loader_opens_a_library_in_its_folder_and_needs_nothing_of_symfric(compiler, tmp_path):
    made = generate(BrownMcPhee(), tmp_path, real="double")
    ending = {"darwin": ".dylib", "win32": ".dll"}.get(sys.platform, ".so")
    target = str(tmp_path / f"brown_mcphee{ending}")
    compiler.run("-shared", "-fPIC", "-O2", str(made.source("double")), "-o", target, "-lm")
    code = (
        "import subprocess, sys\n"
        "sys.modules['symfric'] = None; sys.modules['subprocess'].run = None\n"
        "from brown_mcphee_ctypes import Block; print(Block().step(v=1.0, N=10.0)['F'])"
    )
    expected = float(BrownMcPhee().force(1.0, 10.0))
    assert float(done(sys.executable, "-c", code, cwd=tmp_path)) == pytest.approx(
        expected, rel=1e-13
    )


STAND_IN = Path(__file__).with_name("stand_in_for_simulink.h").read_text(encoding="utf-8")


def s_function(made, compiler, folder):
    """Program that steps the S-function of a package in a stand-in for Simulink."""
    simstruc, driver = STAND_IN.split("/* DRIVER */")
    (folder / "simstruc.h").write_text(simstruc)
    (folder / "cg_sfun.h").write_text(driver)
    files = [str(folder / f"{made.block.name}_sfun.c"), str(made.source(made.reals[0]))]
    flags = [*STRICT, "-Wno-unused-value", f"-I{folder}"]  # of its macros
    compiler.run(*flags, *files, "-o", str(folder / "sfun"), "-lm")

    def ran(h, parameters, inputs):
        numbers = np.concatenate([[h, len(parameters)], parameters, inputs.ravel()]).tobytes()
        return subprocess.run([folder / "sfun"], input=numbers, capture_output=True, check=False)

    return ran


@pytest.mark.parametrize(
    ("block", "own"),
    [(LUGRE, True), (block_of(BrownMcPhee()), False), (EVENT, True),
     pytest.param(plant_block(Drive(BrownMcPhee())), False, marks=pytest.mark.slow)],
    ids=lambda value: getattr(value, "name", None),
)  # fmt: skip
def test_the_s_function_steps_like_the_block(block, own, compiler, tmp_path):
    ran = s_function(generate(block, tmp_path, real="double"), compiler, tmp_path)
    inputs, h = excitation(block)[:100], 2e-3
    given = np.array([float(v.start) * (1.25 if own else 1.0) for v in block.parameters])
    rows = [h if v.name == "h" else g for v, g in zip(block.parameters, given, strict=True)]
    found = np.frombuffer(ran(h, given if own else given[:0], inputs).stdout).reshape(100, -1)
    expected = run_vm(CBlock(block, DOUBLE), inputs, parameters=np.tile(rows, (100, 1)))
    first, last = len(block.states), len(block.states) + len(block.outputs)
    assert np.array_equal(found[:, :-1], expected[:, first:last])
    assert np.array_equal(found[:, -1], expected[:, -1])
    if block is LUGRE:
        text = wrapper(CBlock(LUGRE, DOUBLE))
        assert "mex lugre_sfun.c lugre_f64.c" in text
        assert "Outputs: F [N], F_end [N], status." in text
        refused = ran(1e-3, np.ones(3), np.zeros((1, 2)))
        assert refused.returncode == 2
        assert b"lugre: argument 2: expected [] or 8 parameters" in refused.stderr
