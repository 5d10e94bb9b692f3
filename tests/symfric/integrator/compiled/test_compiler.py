"""Compiling once, storing the result, and errors where that is impossible."""

import gc
import os
import shutil
import stat
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from backends import needs_compiler

from symfric import LuGre, rabinowicz, simulate
from symfric.cli import main
from symfric.foundation import programs as finder
from symfric.foundation.programs import CompileError, Compiler, find_compiler
from symfric.integrator.compiled import columns, compiler
from symfric.integrator.compiled.compiler import (
    STALE,
    Cache,
    caches,
    compiled_before,
    key_of,
    library,
    load,
    trusted,
)
from symfric.integrator.equations.inputs import input_data
from symfric.integrator.methods.tableaux import RODAS5P
from symfric.integrator.running.integrator import Integrator

SOURCE = "int answer(void) { return 42; }\n"
pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="owners and modes of POSIX")
Calls = list[tuple[str, ...]]


@pytest.fixture(autouse=True)
def folder(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """An empty cache of compiled code."""
    monkeypatch.setenv("SYMFRIC_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


@pytest.fixture
def place(folder: Path) -> Cache:
    return Cache(folder)


@pytest.fixture
def calls(monkeypatch: pytest.MonkeyPatch) -> Calls:
    """Commands that were run."""
    seen: Calls = []
    run = Compiler.run

    def counted(self: Compiler, *arguments: str, **options: object) -> str:
        seen.append((*self.command, *arguments))
        return run(self, *arguments, **options)  # type: ignore[arg-type]

    monkeypatch.setattr(Compiler, "run", counted)
    return seen


def put(place: Cache, key: str, content: bytes = b"code") -> Path:
    temporary = place.begin(key)
    temporary.write_bytes(content)
    place.keep(key, temporary)
    found = place.find(key)
    assert found is not None
    return found


def test_stored_files_are_found_again_unless_damaged_or_special(place: Cache) -> None:
    """A truncated library is a SIGBUS, a pipe blocks for ever, a link may lead anywhere."""
    path = put(place, "k", b"code")
    assert path.read_bytes() == b"code"
    assert list(place.folder.iterdir()) == [path]
    assert {stat.S_IMODE(one.stat().st_mode) for one in (place.folder, path)} == {0o700}
    assert place.find("other") is None
    assert Cache(place.folder / "none").find("k") is None
    for damage in (b"", b"cod", b"codf", b"code and more"):
        path.write_bytes(damage)
        assert place.find("k") is None
        assert put(place, "k") == path
    (place.folder / "real").write_bytes(b"code")
    for make in (os.mkfifo, Path.mkdir, lambda at: Path(at).symlink_to(place.folder / "real")):
        path.rmdir() if path.is_dir() else path.unlink()
        make(path)
        assert place.find("k") is None


def test_files_that_others_may_write_are_not_found(
    place: Cache, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = put(place, "k")
    for mode in (0o722, 0o702, 0o777):
        path.chmod(mode)
        assert place.find("k") is None
    path.chmod(0o755)
    assert place.find("k") == path
    place.folder.chmod(0o777)
    assert place.find("k") is None
    put(place, "other")
    assert stat.S_IMODE(place.folder.stat().st_mode) == 0o700
    status = {
        (1000, 0o100755): True, (0, 0o100755): True, (1001, 0o100755): False,
        (1000, 0o100775): False, (0, 0o041777): False,
    }  # fmt: skip
    real = os.getuid()
    monkeypatch.setattr(compiler.os, "getuid", lambda: 1000)
    for (owner, mode), good in status.items():
        assert trusted(os.stat_result((mode, 0, 0, 1, owner, 0, 0, 0, 0, 0))) is good
    monkeypatch.setattr(compiler, "trusted", lambda found: found.st_uid != real)
    assert place.find("k") is None
    with pytest.raises(OSError, match="others may write there"):
        place.begin("k")


def test_the_oldest_files_are_removed(place: Cache, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(compiler, "MOST_BYTES", 250)
    paths = [put(place, f"k{i}", bytes([i]) * 100) for i in range(4)]
    for i, path in enumerate(paths):
        os.utime(path, (i, i))
    assert place.find("k0") == paths[0]  # used now
    fresh, stale = place.folder / ".k-a.so", place.folder / ".k-b.so"
    for path in (fresh, stale):
        path.write_bytes(b"half")
    long_ago = time.time() - STALE - 10
    os.utime(stale, (long_ago, long_ago))
    place.evict()
    assert sorted(place.folder.iterdir()) == sorted([paths[0], paths[3], fresh])
    monkeypatch.setattr(compiler, "MOST_BYTES", 10)
    os.utime(fresh, (1, 1))
    fresh.unlink()
    place.evict()
    assert list(place.folder.iterdir()) == [paths[0]]


def test_the_folder_is_in_the_cache_of_the_system(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    assert [found.folder for found in caches()] == [tmp_path / "cache"]
    for system, variable, where in (
        ("linux", "XDG_CACHE_HOME", ""), ("win32", "LOCALAPPDATA", ""),
        ("darwin", "HOME", "Library/Caches"),
    ):  # fmt: skip
        monkeypatch.delenv("SYMFRIC_CACHE", raising=False)
        monkeypatch.setattr(compiler.sys, "platform", system)
        monkeypatch.setenv(variable, str(tmp_path))
        assert next(caches()).folder == tmp_path / where / "symfric"
    monkeypatch.undo()
    for name in ("SYMFRIC_CACHE", "XDG_CACHE_HOME"):
        monkeypatch.delenv(name, raising=False)
    own = Path(tempfile.gettempdir()) / f"symfric-{os.getuid()}"
    assert [found.folder for found in caches()][1:] == [own]

    def homeless() -> Path:
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.setattr(compiler.Path, "home", homeless)
    assert [found.folder for found in caches()] == [own]


@needs_compiler
def test_a_second_load_comes_from_the_cache(calls: Calls, folder: Path) -> None:
    assert compiled_before(SOURCE) is None
    for _ in range(2):
        assert load(SOURCE, "answer").answer() == 42
    assert len(calls) == 1
    path = compiled_before(SOURCE)
    assert path == library(SOURCE)
    assert list(folder.iterdir()) == [path]
    assert load(SOURCE.replace("42", "43")).answer() == 43
    assert len(calls) == 2
    for _ in range(2):
        run = simulate(rabinowicz(LuGre()), 1.0, backend="compiled")
        assert run.statistics.backend == "compiled"
    assert len(calls) == 3
    assert integrator().choose("auto", 0.1).name == "compiled"  # sooner than it would compile


def test_the_key_depends_on_everything_that_the_code_depends_on(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """Source, compiler and its age, options, flags, machine and processor."""
    program, other = tmp_path / "cc", tmp_path / "other"
    program.write_bytes(b"one")
    other.write_bytes(b"one")
    cc, flags = Compiler((str(program),)), compiler.FLAGS
    keys = [key_of(SOURCE, cc, flags), key_of(SOURCE + " ", cc, flags)]
    keys.append(key_of(SOURCE, Compiler((*cc.command, "-O3")), flags))
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
def test_damaged_and_foreign_libraries_are_compiled_again(calls: Calls, folder: Path) -> None:
    path = library(SOURCE, "answer")
    whole = path.read_bytes()
    path.unlink()  # it is mapped
    path.write_bytes(whole[: len(whole) // 2])
    assert compiled_before(SOURCE) is None
    assert load(SOURCE, "answer").answer() == 42
    assert len(calls) == 2
    # another user knows the key and may write the folder
    compiled_before(SOURCE).unlink()
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
def test_refused_code_leaves_no_file(folder: Path) -> None:
    with pytest.raises(CompileError, match=r"compile: .* failed .*error: .*nonsense"):
        load("int answer(void) { return nonsense; }")
    message = "compile: expected a library that defines question, found none"
    with pytest.raises(CompileError, match=message):
        load(SOURCE, "question")
    assert list(folder.iterdir()) == []


@needs_compiler
def test_folders_that_cannot_be_written(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("not a folder")
    for where, why in ((tmp_path / "file" / "cache", "Not a directory"), (Path("/proc"), "")):
        monkeypatch.setenv("SYMFRIC_CACHE", str(where))
        with pytest.raises(CompileError, match=rf"tried {where} \({why}.* set SYMFRIC_CACHE"):
            load(SOURCE)
    monkeypatch.delenv("SYMFRIC_CACHE")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    path = library(SOURCE)
    assert path.parent.parent == tmp_path
    assert compiled_before(SOURCE) == path


def integrator() -> Integrator:
    model = rabinowicz(LuGre())
    return Integrator(model, input_data(model, None, 0.0, 1.0), RODAS5P)


BROKEN = {
    "refusing": ("echo 'licence expired' >&2; exit 1", "failed with status 1: licence expired"),
    "silent": ("exit 0", "expected a folder to store and load compiled code"),
    "absent": ("", "which is not found; install one, or pass backend='vm'"),
    "hanging": ("sleep 60", "hanging did not end within"),
}


@pytest.mark.parametrize("kind", BROKEN)
def test_a_broken_compiler_is_an_error_only_where_compiled_code_is_requested(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str], kind: str
) -> None:
    script, message = BROKEN[kind]
    if script:
        (tmp_path / kind).write_text(f"#!/bin/sh\n{script}\n")
        (tmp_path / kind).chmod(0o755)
    monkeypatch.setenv("CC", str(tmp_path / kind))
    monkeypatch.setattr(finder, "PATIENCE", 0.2)
    monkeypatch.setattr(finder, "PER_BYTE", 0.0)
    chooser = integrator()
    for _ in range(2):
        assert chooser.choose("auto", left=1e6).name == "vm"
        columns.wait()
    with pytest.raises(CompileError, match=message):
        chooser.choose("compiled", left=0.0)
    assert main(["run", "rabinowicz", "--law", "viscous", "--backend", "compiled"]) == 2
    reported = capsys.readouterr().err
    assert "internal error" not in reported
    assert message in reported


@needs_compiler
def test_processes_and_threads_may_compile_the_same_at_once(folder: Path) -> None:
    script = (
        "from symfric.integrator.compiled.compiler import load; "
        f"print(load({SOURCE!r}, 'answer').answer())"
    )
    worker = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE)
    with ThreadPoolExecutor(3) as pool:
        assert [found.answer() for found in pool.map(load, [SOURCE] * 3)] == [42] * 3
    assert worker.communicate(timeout=60)[0].strip() == b"42"
    assert {path.suffix for path in folder.iterdir()} == {".so"}
    assert not [path for path in folder.iterdir() if path.name.startswith(".")]


@needs_compiler
@pytest.mark.skipif(not Path("/proc/self/maps").exists(), reason="needs the maps of Linux")
def test_unreferenced_code_is_unloaded(folder: Path) -> None:
    """A process has room for some 10,000 libraries."""

    def mapped() -> int:
        return Path("/proc/self/maps").read_text().count(str(folder))

    one, other = load(SOURCE, "answer"), load(SOURCE.replace("42", "43"), "answer")
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
    """It refuses options of gcc."""
    monkeypatch.setenv("CC", "clang")
    runs = [simulate(rabinowicz(LuGre()), 5.0, backend=backend) for backend in ("vm", "compiled")]
    assert runs[1].statistics.backend == "compiled"
    assert (runs[0]["x"] == runs[1]["x"]).all()
