"""Several kits in one folder are one project of CMake, whose tests pass."""

import shutil
import subprocess

import pytest

from symfric import BrownMcPhee, LuGre
from symfric.codegen import generate

pytestmark = pytest.mark.heavy

needs_cmake = pytest.mark.skipif(shutil.which("cmake") is None, reason="needs cmake")


def test_kits_in_one_folder_do_not_overwrite_each_other(tmp_path):
    first = {path: path.read_bytes() for path in generate(LuGre(), tmp_path, real="float").files}
    second = generate(BrownMcPhee(), tmp_path, real="float").files
    assert {path.name for path in first} & {path.name for path in second} == {"CMakeLists.txt"}
    assert all(path.read_bytes() == text for path, text in first.items())


@needs_cmake
def test_cmake_builds_all_kits_and_their_tests_pass(compiler, tmp_path):
    generate(LuGre(), tmp_path / "kit", real="float")
    generate(BrownMcPhee(), tmp_path / "kit", real="double")
    build = tmp_path / "build"
    for command in (
        ["cmake", "-S", str(tmp_path / "kit"), "-B", str(build)],
        ["cmake", "--build", str(build), "--parallel", "2"],
    ):
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stdout + done.stderr
    done = subprocess.run(["ctest"], cwd=build, capture_output=True, text=True, check=False)
    assert "100% tests passed, 0 tests failed out of 2" in done.stdout
    assert any(build.glob("*lugre_shared.*"))


@needs_cmake
def test_a_core_without_a_system_gets_a_library_that_a_program_can_link(compiler, tmp_path):
    generate(LuGre(), tmp_path / "kit with space", real="float")
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
    build = tmp_path / "build"
    said = ""
    for command in (
        ["cmake", "-S", str(tmp_path), "-B", str(build), "-DCMAKE_SYSTEM_NAME=Generic"],
        ["cmake", "--build", str(build)],
    ):
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        said += done.stdout + done.stderr
        assert done.returncode == 0, said
    assert "Warning" not in said
    assert (build / "servo").is_file()
    assert not [*build.rglob("*_test*"), *build.rglob("*shared*.so")]
