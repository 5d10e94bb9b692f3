"""Compiling once, keeping the result, and what happens where that is impossible."""

import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from symfric import LuGre, Status, rabinowicz, simulate
from symfric.integrator.compiled import compiler
from symfric.integrator.compiled.compiler import cache_folder, find_compiler, library_path, load
from symfric.integrator.equations.inputs import input_data
from symfric.integrator.methods.tableaux import RODAS5P
from symfric.integrator.running.integrator import Integrator

SOURCE = "int answer(void) { return 42; }\n"

needs_compiler = pytest.mark.skipif(find_compiler() is None, reason="no C compiler here")


@pytest.fixture(autouse=True)
def fresh(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Iterator[None]:
    """An empty cache of compiled code, and the environment looked at anew."""
    monkeypatch.setenv("SYMFRIC_CACHE", str(tmp_path / "cache"))
    find_compiler.cache_clear()
    yield
    find_compiler.cache_clear()


@pytest.fixture
def calls(monkeypatch: pytest.MonkeyPatch) -> list[list[str]]:
    """Commands that were run."""
    seen: list[list[str]] = []
    run = subprocess.run

    def counted(command: list[str], **options: object) -> object:
        seen.append(command)
        return run(command, **options)  # type: ignore[call-overload]

    monkeypatch.setattr(compiler.subprocess, "run", counted)
    return seen


def choose_compiler(monkeypatch: pytest.MonkeyPatch, command: str) -> None:
    monkeypatch.setenv("CC", command)
    find_compiler.cache_clear()


def integrator() -> Integrator:
    model = rabinowicz(LuGre())
    return Integrator(model, input_data(model, None, 0.0, 1.0), RODAS5P)


@needs_compiler
def test_second_load_comes_from_the_cache(calls: list[list[str]]) -> None:
    assert load(SOURCE).answer() == 42
    assert load(SOURCE).answer() == 42
    assert len(calls) == 1
    path = library_path(SOURCE)
    assert path is not None
    assert list(cache_folder().iterdir()) == [path]


@needs_compiler
def test_another_source_is_compiled_anew(calls: list[list[str]]) -> None:
    load(SOURCE)
    assert load(SOURCE.replace("42", "43")).answer() == 43
    assert len(calls) == 2


@needs_compiler
def test_other_flags_make_another_library(monkeypatch: pytest.MonkeyPatch) -> None:
    before = library_path(SOURCE)
    monkeypatch.setattr(compiler, "FLAGS", (*compiler.FLAGS, "-g"))
    assert library_path(SOURCE) != before


@pytest.mark.parametrize(
    ("system", "variable", "rest"),
    [("linux", "XDG_CACHE_HOME", "symfric"), ("win32", "LOCALAPPDATA", "symfric")],
)
def test_cache_lies_where_the_system_keeps_caches(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, system: str, variable: str, rest: str
) -> None:
    monkeypatch.delenv("SYMFRIC_CACHE")
    monkeypatch.setattr(compiler.sys, "platform", system)
    monkeypatch.setenv(variable, str(tmp_path))
    assert cache_folder() == tmp_path / rest


def test_cache_may_be_chosen(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("SYMFRIC_CACHE", str(tmp_path / "mine"))
    assert cache_folder() == tmp_path / "mine"


@needs_compiler
def test_damaged_library_is_compiled_again(calls: list[list[str]]) -> None:
    path = library_path(SOURCE)
    assert path is not None
    path.parent.mkdir()
    path.write_bytes(b"half a file, for the disk was full")
    assert load(SOURCE).answer() == 42
    assert len(calls) == 1


@needs_compiler
def test_compiler_may_be_chosen_with_options(
    monkeypatch: pytest.MonkeyPatch, calls: list[list[str]]
) -> None:
    command = find_compiler()
    assert command is not None
    choose_compiler(monkeypatch, f"{command[0]} -DANSWER=7")
    assert load("int answer(void) { return ANSWER; }").answer() == 7
    assert calls[0][:2] == [command[0], "-DANSWER=7"]


@needs_compiler
def test_refused_source_quotes_the_compiler_and_leaves_nothing_behind() -> None:
    with pytest.raises(RuntimeError, match=r"compile: .* failed: .*error: .*nonsense"):
        load("int answer(void) { return nonsense; }")
    assert list(cache_folder().iterdir()) == []


@pytest.mark.parametrize("missing", ["/no/such/compiler", "no-such-compiler -O3"])
def test_without_a_compiler_the_error_says_what_to_do(
    monkeypatch: pytest.MonkeyPatch, missing: str
) -> None:
    choose_compiler(monkeypatch, missing)
    assert find_compiler() is None
    assert library_path(SOURCE) is None
    with pytest.raises(
        RuntimeError, match=r"expected a C compiler .* found none; use backend='vm'"
    ):
        load(SOURCE)
    with pytest.raises(RuntimeError, match=r"expected a C compiler"):
        simulate(rabinowicz(LuGre()), 0.1, backend="compiled")


@needs_compiler
def test_folder_that_cannot_be_written_is_named(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    (tmp_path / "file").write_text("not a folder")
    monkeypatch.setenv("SYMFRIC_CACHE", str(tmp_path / "file" / "cache"))
    with pytest.raises(RuntimeError, match=r"keep compiled code in .*cache .* set SYMFRIC_CACHE"):
        load(SOURCE)


def broken_compilers(tmp_path: Path) -> dict[str, str]:
    refusing = tmp_path / "refusing"
    refusing.write_text("#!/bin/sh\necho 'licence expired' >&2\nexit 1\n")
    silent = tmp_path / "silent"
    silent.write_text("#!/bin/sh\nexit 0\n")
    for script in (refusing, silent):
        script.chmod(0o755)
    return {"refusing": str(refusing), "silent": str(silent), "absent": "/no/such/compiler"}


@pytest.mark.skipif(sys.platform == "win32", reason="shell scripts as compilers")
@pytest.mark.parametrize(
    ("kind", "message"),
    [
        ("refusing", "refusing failed: licence expired"),
        ("silent", "expected to keep compiled code"),
        ("absent", "expected a C compiler"),
    ],
)
def test_broken_compiler_is_an_error_only_where_compiled_code_is_asked_for(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, kind: str, message: str
) -> None:
    choose_compiler(monkeypatch, broken_compilers(tmp_path)[kind])
    chooser = integrator()
    assert chooser.choose("auto", left=1e6).name == "vm"
    assert chooser.choose("auto", left=1e6).name == "vm"
    with pytest.raises(RuntimeError, match=message):
        chooser.choose("compiled", left=0.0)


@needs_compiler
@pytest.mark.parametrize(("left", "name"), [(0.0, "vm"), (1e6, "compiled")])
def test_compiling_begins_where_it_pays(left: float, name: str) -> None:
    assert integrator().choose("auto", left).name == name


@needs_compiler
def test_compiled_code_in_the_cache_is_used_earlier(calls: list[list[str]]) -> None:
    integrator().choose("compiled", 0.0)
    short = 0.1
    assert integrator().choose("auto", short).name == "compiled"
    assert len(calls) == 1


@needs_compiler
def test_same_model_built_again_needs_no_compiler(calls: list[list[str]]) -> None:
    runs = [simulate(rabinowicz(LuGre()), 1.0, backend="compiled") for _ in range(2)]
    assert [run.status for run in runs] == [Status.SUCCESS] * 2
    assert [run.statistics.backend for run in runs] == ["compiled"] * 2
    assert len(calls) == 1


@needs_compiler
def test_processes_may_compile_the_same_at_once(tmp_path: Path) -> None:
    """Each ends with a whole library under the one name."""
    script = (
        f"from symfric.integrator.compiled.compiler import load; print(load({SOURCE!r}).answer())"
    )
    environment = os.environ | {"SYMFRIC_CACHE": str(tmp_path / "shared")}
    workers = [
        subprocess.Popen([sys.executable, "-c", script], env=environment, stdout=subprocess.PIPE)
        for _ in range(3)
    ]
    assert [worker.communicate(timeout=60)[0].strip() for worker in workers] == [b"42"] * 3
    assert len(list((tmp_path / "shared").iterdir())) == 1
