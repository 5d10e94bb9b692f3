"""Compiling once, keeping the result, and what happens where that is impossible."""

import gc
import os
import shutil
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from backends import needs_compiler

from symfric import LuGre, Status, rabinowicz, simulate
from symfric.cli import main
from symfric.foundation import programs as finder
from symfric.foundation.programs import CompileError, Compiler, find_compiler
from symfric.integrator.compiled import background, compiler
from symfric.integrator.compiled.compiler import compiled_before, key_of, library, load
from symfric.integrator.equations.inputs import input_data
from symfric.integrator.methods.tableaux import RODAS5P
from symfric.integrator.running.integrator import Integrator

SOURCE = "int answer(void) { return 42; }\n"

needs_shell = pytest.mark.skipif(sys.platform == "win32", reason="shell scripts as compilers")


@pytest.fixture(autouse=True)
def folder(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """An empty cache of compiled code."""
    monkeypatch.setenv("SYMFRIC_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


@pytest.fixture
def calls(monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, ...]]:
    """Commands that were run."""
    seen: list[tuple[str, ...]] = []
    run = Compiler.run

    def counted(self: Compiler, *arguments: str, **options: object) -> str:
        seen.append((*self.command, *arguments))
        return run(self, *arguments, **options)  # type: ignore[arg-type]

    monkeypatch.setattr(Compiler, "run", counted)
    return seen


def integrator() -> Integrator:
    model = rabinowicz(LuGre())
    return Integrator(model, input_data(model, None, 0.0, 1.0), RODAS5P)


@needs_compiler
def test_second_load_comes_from_the_cache(calls: list[tuple[str, ...]], folder: Path) -> None:
    assert compiled_before(SOURCE) is None
    assert load(SOURCE, "answer").answer() == 42
    assert load(SOURCE, "answer").answer() == 42
    assert len(calls) == 1
    path = compiled_before(SOURCE)
    assert path == library(SOURCE)
    assert list(folder.iterdir()) == [path]


@needs_compiler
def test_another_source_is_compiled_anew(calls: list[tuple[str, ...]]) -> None:
    load(SOURCE)
    assert load(SOURCE.replace("42", "43")).answer() == 43
    assert len(calls) == 2


@needs_compiler
def test_all_that_the_code_depends_on_is_in_its_name(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """Source, compiler and its age, options, flags, machine and processor."""
    program = tmp_path / "cc"
    program.write_bytes(b"one")
    cc, flags = Compiler((str(program),)), compiler.FLAGS
    keys = [key_of(SOURCE, cc, flags), key_of(SOURCE + " ", cc, flags)]
    keys.append(key_of(SOURCE, Compiler((*cc.command, "-O3")), flags))
    other = tmp_path / "other"
    other.write_bytes(b"one")
    keys.append(key_of(SOURCE, Compiler((str(other),)), flags))
    os.utime(program, (1, 1))
    keys.append(key_of(SOURCE, cc, flags))
    program.write_bytes(b"four")
    os.utime(program, (1, 1))
    keys.append(key_of(SOURCE, cc, flags))
    assert keys[-1] == key_of(SOURCE, cc, flags)
    keys.append(key_of(SOURCE, cc, (*flags, "-g")))
    for owner, name, value in (
        (compiler, "processor", lambda: "flags : fpu sse"),
        (compiler.platform, "machine", lambda: "aarch64"),
        (compiler.sys, "platform", "plan9"),
    ):
        monkeypatch.setattr(owner, name, value)
        keys.append(key_of(SOURCE, cc, flags))
    assert len(set(keys)) == len(keys)


@needs_compiler
def test_damaged_library_is_compiled_again(calls: list[tuple[str, ...]]) -> None:
    """Half a library was a SIGBUS in 4f644ad."""
    path = library(SOURCE, "answer")
    whole = path.read_bytes()
    path.unlink()  # it is mapped
    path.write_bytes(whole[: len(whole) // 2])
    assert compiled_before(SOURCE) is None
    assert load(SOURCE, "answer").answer() == 42
    assert len(calls) == 2


@needs_compiler
def test_a_library_of_others_is_not_loaded(monkeypatch: pytest.MonkeyPatch, folder: Path) -> None:
    """Somebody knows the key and may write the folder."""
    made = library("int answer(void) { return 666; }", "answer")
    found = find_compiler()
    assert found is not None
    key = key_of(SOURCE, found, compiler.FLAGS)
    planted = folder / f"{key}-{made.stem.split('-')[1]}.so"
    made.rename(planted)
    assert compiled_before(SOURCE) == planted
    planted.chmod(0o777)
    assert compiled_before(SOURCE) is None
    assert load(SOURCE, "answer").answer() == 42


@needs_compiler
def test_compiler_may_be_chosen_with_options(
    monkeypatch: pytest.MonkeyPatch, calls: list[tuple[str, ...]]
) -> None:
    found = find_compiler()
    assert found is not None
    monkeypatch.setenv("CC", f"{found.command[0]} -DANSWER=7")
    assert load("int answer(void) { return ANSWER; }").answer() == 7
    assert calls[0][:2] == (found.command[0], "-DANSWER=7")


@needs_compiler
def test_refused_source_quotes_the_compiler_and_leaves_nothing_behind(folder: Path) -> None:
    with pytest.raises(CompileError, match=r"compile: .* failed .*error: .*nonsense"):
        load("int answer(void) { return nonsense; }")
    assert list(folder.iterdir()) == []


@needs_compiler
def test_a_missing_function_is_a_sentence_and_is_not_kept(folder: Path) -> None:
    """It was an AttributeError."""
    with pytest.raises(
        CompileError, match="compile: expected a library that defines question, found none"
    ):
        load(SOURCE, "question")
    assert list(folder.iterdir()) == []


@pytest.mark.parametrize("missing", ["/no/such/compiler", "no-such-compiler -O3"])
def test_without_a_compiler_the_error_says_what_to_do(
    monkeypatch: pytest.MonkeyPatch, missing: str
) -> None:
    monkeypatch.setenv("CC", missing)
    message = r"\$CC is .*, which is not found; install one, or pass backend='vm'"
    with pytest.raises(CompileError, match=message):
        load(SOURCE)
    with pytest.raises(CompileError, match=message):
        simulate(rabinowicz(LuGre()), 0.1, backend="compiled")
    assert compiled_before(SOURCE) is None


@needs_compiler
def test_folder_that_cannot_be_written_is_named(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    (tmp_path / "file").write_text("not a folder")
    for place, why in ((tmp_path / "file" / "cache", "Not a directory"), (Path("/proc"), "")):
        monkeypatch.setenv("SYMFRIC_CACHE", str(place))
        with pytest.raises(CompileError, match=rf"tried {place} \({why}.* set SYMFRIC_CACHE"):
            load(SOURCE)


@needs_compiler
def test_a_home_that_cannot_be_written_is_no_obstacle(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.delenv("SYMFRIC_CACHE")
    (tmp_path / "home").write_text("")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "home"))
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    path = library(SOURCE)
    assert path.parent.parent == tmp_path
    assert compiled_before(SOURCE) == path


def broken_compilers(tmp_path: Path) -> dict[str, str]:
    scripts = {
        "refusing": "echo 'licence expired' >&2; exit 1",
        "silent": "exit 0",
        "hanging": "sleep 60",
    }
    for name, text in scripts.items():
        (tmp_path / name).write_text(f"#!/bin/sh\n{text}\n")
        (tmp_path / name).chmod(0o755)
    return {name: str(tmp_path / name) for name in scripts} | {"absent": "/no/such/compiler"}


@needs_shell
@pytest.mark.parametrize(
    ("kind", "message"),
    [
        ("refusing", "refusing failed with status 1: licence expired"),
        ("silent", "expected a folder to store and load compiled code"),
        ("absent", "expected a C compiler"),
        ("hanging", "hanging came to no end within"),
    ],
)
def test_broken_compiler_is_an_error_only_where_compiled_code_is_asked_for(
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    kind: str,
    message: str,
) -> None:
    monkeypatch.setenv("CC", broken_compilers(tmp_path)[kind])
    monkeypatch.setattr(finder, "PATIENCE", 0.2)
    monkeypatch.setattr(finder, "PER_BYTE", 0.0)
    chooser = integrator()
    assert chooser.choose("auto", left=1e6).name == "vm"
    background.wait()
    assert chooser.choose("auto", left=1e6).name == "vm"
    with pytest.raises(CompileError, match=message):
        chooser.choose("compiled", left=0.0)
    assert main(["run", "rabinowicz", "--law", "viscous", "--backend", "compiled"]) == 2
    told = capsys.readouterr().err
    assert "internal error" not in told
    assert message in told


@needs_compiler
@pytest.mark.parametrize(("left", "name"), [(0.0, "vm"), (1e6, "compiled")])
def test_compiling_begins_where_it_pays(left: float, name: str) -> None:
    chooser = integrator()
    chooser.choose("auto", left)
    background.wait()
    assert chooser.choose("auto", left).name == name


@needs_compiler
def test_compiled_code_in_the_cache_is_used_earlier(calls: list[tuple[str, ...]]) -> None:
    integrator().choose("compiled", 0.0)
    short = 0.1
    assert integrator().choose("auto", short).name == "compiled"
    assert len(calls) == 1


@needs_compiler
def test_same_model_built_again_needs_no_compiler(calls: list[tuple[str, ...]]) -> None:
    runs = [simulate(rabinowicz(LuGre()), 1.0, backend="compiled") for _ in range(2)]
    assert [run.status for run in runs] == [Status.SUCCESS] * 2
    assert [run.statistics.backend for run in runs] == ["compiled"] * 2
    assert len(calls) == 1


@needs_compiler
def test_processes_and_threads_may_compile_the_same_at_once(folder: Path) -> None:
    """Each ends with a whole library."""
    script = (
        "from symfric.integrator.compiled.compiler import load; "
        f"print(load({SOURCE!r}, 'answer').answer())"
    )
    workers = [
        subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE) for _ in range(2)
    ]
    with ThreadPoolExecutor(3) as pool:
        assert [found.answer() for found in pool.map(load, [SOURCE] * 3)] == [42] * 3
    assert [worker.communicate(timeout=60)[0].strip() for worker in workers] == [b"42"] * 2
    assert {path.suffix for path in folder.iterdir()} == {".so"}
    assert not [path for path in folder.iterdir() if path.name.startswith(".")]


@needs_compiler
@pytest.mark.skipif(not Path("/proc/self/maps").exists(), reason="needs the maps of Linux")
def test_code_that_nobody_uses_is_not_kept_in_memory(folder: Path) -> None:
    """4f644ad mapped every library for ever; a process has room for some 10,000."""

    def mapped() -> int:
        return Path("/proc/self/maps").read_text().count(str(folder))

    one = load(SOURCE, "answer")
    other = load(SOURCE.replace("42", "43"), "answer")
    answer = one.answer
    both = mapped()
    del one, other
    gc.collect()
    assert both // 2 <= mapped() < both
    assert answer() == 42
    del answer
    gc.collect()
    assert mapped() == 0


@pytest.mark.skipif(shutil.which("clang") is None, reason="needs clang")
def test_clang_gives_the_bits_of_the_virtual_machine(monkeypatch: pytest.MonkeyPatch) -> None:
    """It refuses options of gcc: nothing was compiled with it."""
    monkeypatch.setenv("CC", "clang")
    runs = [simulate(rabinowicz(LuGre()), 5.0, backend=backend) for backend in ("vm", "compiled")]
    assert runs[1].statistics.backend == "compiled"
    assert (runs[0]["x"] == runs[1]["x"]).all()
