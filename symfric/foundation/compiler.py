"""The C compiler of this machine: found in one place, run within a time limit."""

import os
import shlex
import shutil
import signal
import subprocess
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import IO

NAMES = ("gcc", "clang", "cc")
PATIENCE, PER_BYTE = 60.0, 1e-4
"""Seconds that a compiler may take for nothing, and for each byte of C: a hundred times the usual,
for machines under load; one that waits for something is stopped."""
GRACE = 1.0
"""Seconds for a compiler that was asked to stop."""
KILL = getattr(signal, "SIGKILL", signal.SIGTERM)


class CompileError(RuntimeError):
    """There is no compiler, it refused the code, or what it made cannot be used."""


@dataclass(frozen=True)
class Compiler:
    """A command that takes the options of gcc."""

    command: tuple[str, ...]

    def __str__(self) -> str:
        return shlex.join((Path(self.command[0]).name, *self.command[1:]))

    def run(
        self, *arguments: str, code: str = "", variables: Mapping[str, str] | None = None
    ) -> str:
        """Run it on `code`, its standard input, or on files; returns what it says.

        Raises:
            CompileError: it cannot be started, refuses the code, or does not come to an end.
        """
        process = self.start(*arguments, stdin=subprocess.PIPE, variables=variables)
        limit = patience(code)
        try:
            said = process.communicate(code.encode(), timeout=limit)[1].decode(errors="replace")
        except subprocess.TimeoutExpired:
            raise CompileError(f"{self} came to no end within {limit:.0f} s") from None
        finally:
            end(process)
        if process.returncode:
            raise CompileError(f"{self} failed with status {process.returncode}:\n{said}")
        return said

    def start(
        self,
        *arguments: str,
        stdin: IO[bytes] | int,
        stderr: int = subprocess.PIPE,
        variables: Mapping[str, str] | None = None,
    ) -> subprocess.Popen[bytes]:
        """Its process, which leads a session of its own; `end` stops and closes it.

        Raises:
            CompileError: it cannot be started.
        """
        try:
            return subprocess.Popen(
                [*self.command, *arguments],
                stdin=stdin,
                stdout=subprocess.DEVNULL,
                stderr=stderr,
                env={**os.environ, "LC_ALL": "C", **(variables or {})},
                start_new_session=True,
            )
        except OSError as error:
            raise CompileError(f"{self} does not start: {error.strerror}") from None


def patience(code: str) -> float:
    """Seconds that a compiler may take for `code`."""
    return PATIENCE + PER_BYTE * len(code)


def end(process: subprocess.Popen[bytes]) -> None:
    """Stop a compiler that still runs, after an interrupt too, and what it has started.

    It is asked first: then it takes its temporary files away.
    """
    if process.poll() is None:
        _signal(process, signal.SIGTERM)
        with suppress(subprocess.TimeoutExpired):
            process.wait(GRACE)
        _signal(process, KILL)
        process.wait()
    for stream in (process.stdin, process.stderr):
        if stream is not None:
            stream.close()


def _signal(process: subprocess.Popen[bytes], number: int) -> None:
    """Send a signal to all that a compiler has started; there may be nobody left."""
    with suppress(ProcessLookupError, PermissionError):
        if hasattr(os, "killpg"):
            os.killpg(process.pid, number)
        else:
            process.send_signal(number)


def find_compiler(name: str | None = None) -> Compiler | None:
    """The compiler asked for by `name`, else `$CC`, else the first of gcc, clang and cc.

    A `$CC` that is not there is not passed over: whoever sets it means it. None if there is none.

    Raises:
        ValueError: `name` is given and does not exist.
    """
    wanted = os.environ.get("CC") if name is None else name
    for candidate in NAMES if wanted is None or not wanted.strip() else (wanted,):
        command = _command(candidate)
        if command is not None:
            return Compiler(command)
    if name is not None:
        raise ValueError(f"compiler: expected a C compiler, got {name!r}, which is not found")
    return None


def _command(text: str) -> tuple[str, ...] | None:
    """`text` as a command with the full path of its program; None where there is no such one."""
    try:
        words = shlex.split(text)
    except ValueError:  # a quotation mark without its partner
        return None
    path = shutil.which(words[0]) if words else None
    return None if path is None else (str(Path(path)), *words[1:])


def no_compiler() -> CompileError:
    """What to say where there is none."""
    wanted = os.environ.get("CC")
    found = f"$CC is {wanted!r}, which is not found" if wanted else "found none"
    return CompileError(
        f"compile: expected a C compiler ($CC, gcc, clang or cc), {found}; use backend='vm'"
    )
