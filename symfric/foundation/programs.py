"""Run the C compiler and other programs of this machine, with a time limit.

Compilers, compiled programs, emulators and related tools are run only through this module.
"""

import os
import shlex
import shutil
import signal
import subprocess
import sys
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import IO, final

PATIENCE = 60.0
"""Default time limit of a program [s]: it stops hanging programs, but not slow ones under load."""
GRACE = 1.0
"""Time [s] for a program to stop after a request."""
KILL = getattr(signal, "SIGKILL", signal.SIGTERM)


class ProgramError(RuntimeError):
    """Program that does not start, or exceeds its time limit."""


@final
@dataclass(frozen=True)
class Finished:
    """Result of a finished program.

    Attributes:
        status: 0 for success.
        output: its standard output.
        messages: its standard error, as text.
    """

    status: int
    output: bytes
    messages: str


def finished(
    command: Sequence[str],
    given: bytes = b"",
    *,
    limit: float = PATIENCE,
    variables: Mapping[str, str] | None = None,
    name: str = "",
) -> Finished:
    """Run a program on the standard input `given` to its end, within `limit` [s].

    Its language is English. An interrupt stops it, too.

    Args:
        variables: additional variables of its environment.
        name: in messages; default the command.

    Raises:
        ProgramError: it does not start, or exceeds the limit.
    """
    pipe = subprocess.PIPE
    process = started(command, stdin=pipe, stdout=pipe, stderr=pipe, variables=variables, name=name)
    try:
        output, messages = process.communicate(given, timeout=limit)
    except subprocess.TimeoutExpired:
        raise ProgramError(f"{name or called(command)} did not end within {limit:.0f} s") from None
    finally:
        end(process)
    return Finished(process.returncode, output, messages.decode(errors="replace"))


def started(
    command: Sequence[str],
    *,
    stdin: IO[bytes] | int,
    stdout: int = subprocess.DEVNULL,
    stderr: int = subprocess.DEVNULL,
    variables: Mapping[str, str] | None = None,
    name: str = "",
) -> subprocess.Popen[bytes]:
    """Start a program in its own session; `end` stops and closes it.

    Raises:
        ProgramError: it cannot be started.
    """
    try:
        return subprocess.Popen(
            list(command),
            stdin=stdin,
            stdout=stdout,
            stderr=stderr,
            env={**os.environ, "LC_ALL": "C", **(variables or {})},
            start_new_session=True,
        )
    except OSError as error:
        raise ProgramError(f"{name or called(command)} does not start: {error.strerror}") from None


def called(command: Sequence[str]) -> str:
    """Return a command without the folder of its program."""
    return shlex.join((Path(command[0]).name, *command[1:]))


def end(process: subprocess.Popen[bytes]) -> None:
    """Stop a running program and its children, also after an interrupt.

    SIGTERM comes first, so a compiler can remove its temporary files.
    """
    if process.poll() is None:
        _signal(process, signal.SIGTERM)
        with suppress(subprocess.TimeoutExpired):
            process.wait(GRACE)
        _signal(process, KILL)
        process.wait()
    for stream in (process.stdin, process.stdout, process.stderr):
        if stream is not None:
            stream.close()


def _signal(process: subprocess.Popen[bytes], number: int) -> None:
    """Send a signal to the process group of a program, if it still exists."""
    with suppress(ProcessLookupError, PermissionError):
        if hasattr(os, "killpg"):
            os.killpg(process.pid, number)
        else:
            process.send_signal(number)


NAMES = ("gcc", "clang", "cc")
PER_BYTE = 1e-4
"""Additional time limit of a compiler per byte of C [s], besides `PATIENCE`: a hundred times the
usual, for machines under load.
"""


class CompileError(ProgramError):
    """Missing compiler, rejected code, or an unusable result."""


@dataclass(frozen=True)
class Compiler:
    """Compiler command with gcc-compatible options."""

    command: tuple[str, ...]

    def __str__(self) -> str:
        return called(self.command)

    def run(
        self, *arguments: str, code: str = "", variables: Mapping[str, str] | None = None
    ) -> str:
        """Run it on `code`, its standard input, or on files; return its messages.

        Raises:
            CompileError: it cannot be started, rejects the code, or exceeds the time limit.
        """
        try:
            done = finished(
                (*self.command, *arguments),
                code.encode(),
                limit=patience(code),
                variables=variables,
                name=str(self),
            )
        except ProgramError as error:
            raise CompileError(str(error)) from None
        if done.status:
            raise CompileError(f"{self} failed with status {done.status}:\n{done.messages}")
        return done.messages

    def warnings(self, *arguments: str) -> list[str]:
        """Run it on files; return the lines with warnings.

        Raises:
            CompileError: as `run`.
        """
        return [line for line in self.run(*arguments).splitlines() if "warning:" in line]


def is_clang(compiler: Compiler) -> bool:
    """Return True for clang, which rejects some options of gcc; `cc` often links to it."""
    names = (path.name for path in (Path(compiler.command[0]), Path(compiler.command[0]).resolve()))
    return sys.platform == "darwin" or any("clang" in name for name in names)


def patience(code: str) -> float:
    """Return the time limit of a compiler for `code` [s]."""
    return PATIENCE + PER_BYTE * len(code)


def first_error(text: str) -> str:
    """Return the head of a compiler's messages, and its first error."""
    head, _, messages = text.partition("\n")
    lines = messages.strip().splitlines()
    error = next((line for line in lines if "error" in line), "".join(lines[:1]))
    return f"{head} {error}".strip()


def find_compiler(name: str | None = None) -> Compiler | None:
    """Return the compiler `name`, else `$CC`, else the first of gcc, clang and cc; None if not
    found.

    A `$CC` that does not exist gives None, without trying the others.

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
    """Return `text` as a command with the full path of its program; None if not found."""
    try:
        words = shlex.split(text)
    except ValueError:  # a quotation mark without its partner
        return None
    path = shutil.which(words[0]) if words else None
    return None if path is None else (str(Path(path)), *words[1:])


def missing_compiler() -> str:
    """Return the reason why `find_compiler` found none, with advice."""
    wanted = os.environ.get("CC", "").strip()
    if wanted:
        return f"no C compiler found: $CC is {wanted!r}, which does not exist; fix or unset it"
    return "no C compiler found; install gcc or clang, or set CC"


def needed_compiler() -> Compiler:
    """Return the compiler of this machine.

    Raises:
        CompileError: not found.
    """
    compiler = find_compiler()
    if compiler is None:
        wanted = os.environ.get("CC")
        found = f"$CC is {wanted!r}, which is not found" if wanted else "found none"
        raise CompileError(
            f"compile: expected a C compiler ($CC, gcc, clang or cc), {found}; install one, or "
            "pass backend='vm' to simulations"
        )
    return compiler
