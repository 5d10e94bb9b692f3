"""Finding a C compiler, and stopping one that does not come to an end."""

import os
import sys
from contextlib import suppress
from pathlib import Path
from re import escape
from time import sleep

import pytest

from symfric.foundation import programs
from symfric.foundation.programs import CompileError, Compiler, find_compiler, needed_compiler

needs_shell = pytest.mark.skipif(sys.platform == "win32", reason="shell scripts as compilers")


def script(path: Path, text: str) -> Compiler:
    path.write_text(f"#!/bin/sh\n{text}\n")
    path.chmod(0o755)
    return Compiler((str(path),))


def test_without_any_there_is_none(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", "")
    monkeypatch.delenv("CC", raising=False)
    assert find_compiler() is None
    with pytest.raises(CompileError, match="found none; install one, or pass backend='vm'"):
        needed_compiler()


def test_cc_comes_first_with_its_options_and_is_looked_at_each_time(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    for module in ("whatever", "other"):
        monkeypatch.setenv("CC", f"{sys.executable} -m {module}")
        assert find_compiler() == Compiler((sys.executable, "-m", module))


@needs_shell
def test_without_cc_the_first_that_is_there_is_taken(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setenv("CC", "  ")
    for name in ("cc", "clang", "gcc"):
        script(tmp_path / name, "")
        assert find_compiler() == Compiler((str(tmp_path / name),))
    monkeypatch.delenv("CC")
    assert find_compiler() == Compiler((str(tmp_path / "gcc"),))


def test_a_compiler_that_is_named_must_exist(monkeypatch: pytest.MonkeyPatch) -> None:
    for wanted in ("no-such-compiler -O3", "/no/such/compiler", "'half a quotation"):
        monkeypatch.setenv("CC", wanted)
        assert find_compiler() is None
        with pytest.raises(CompileError, match=escape(f"$CC is {wanted!r}, which is not found")):
            needed_compiler()
    with pytest.raises(ValueError, match="expected a C compiler, got 'no-such-compiler'"):
        find_compiler("no-such-compiler")


@needs_shell
def test_output_is_returned_and_failure_is_an_error(tmp_path: Path) -> None:
    reported = script(tmp_path / "a", 'echo "$1 $EXTRA $(cat)" >&2').run(
        "-c", code="int x;", variables={"EXTRA": "more"}
    )
    assert reported.strip() == "-c more int x;"
    with pytest.raises(CompileError, match="failed with status 3:\nno licence"):
        script(tmp_path / "b", "echo no licence >&2; exit 3").run()
    broken = script(tmp_path / "c", "")
    (tmp_path / "c").write_bytes(b"\x00")
    with pytest.raises(CompileError, match="does not start: Exec format error"):
        broken.run()


@needs_shell
def test_one_that_hangs_is_stopped_with_what_it_started(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """4f644ad waited for ever, as it did for a child that kept its output open."""
    monkeypatch.setattr(programs, "PATIENCE", 2.0)  # in which a busy machine has started the child
    hanging = script(tmp_path / "hanging", f"sleep 60 & echo $! > {tmp_path / 'child'}; wait")
    with pytest.raises(CompileError, match="hanging did not end within 2 s"):
        hanging.run()
    state = Path(f"/proc/{int((tmp_path / 'child').read_text())}/stat")
    for _ in range(100):  # a signal is sent at once and carried out soon
        if not alive(state):
            break
        sleep(0.05)
    assert not alive(state)


def alive(state: Path) -> bool:
    """Whether a process runs or sleeps, given its file in /proc."""
    with suppress(FileNotFoundError, ProcessLookupError):
        return state.read_text().rpartition(")")[2].split()[0] not in "ZX"
    return False


@needs_shell
def test_an_interrupt_stops_it_too(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    def interrupted(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    waiting = script(tmp_path / "waiting", f"echo $$ > {tmp_path / 'pid'}; exec sleep 60")
    monkeypatch.setattr(programs.subprocess.Popen, "communicate", interrupted)
    started: list[int] = []
    end = programs.end
    monkeypatch.setattr(
        programs, "end", lambda process: (started.append(process.pid), end(process))
    )
    with pytest.raises(KeyboardInterrupt):
        waiting.run()
    with pytest.raises(ProcessLookupError):
        os.kill(started[0], 0)
