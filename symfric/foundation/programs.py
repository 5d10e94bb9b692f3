"""Execution of the C compiler and other programs, with a time limit.

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
"""Default time limit of a program [s], long enough for slow programs on a machine under load."""
GRACE = 1.0
"""Time [s] between the request to stop a program and its forced end."""
KILL = getattr(signal, "SIGKILL", signal.SIGTERM)


class ProgramError(RuntimeError):
    """Error for a program that does not start or exceeds its time limit."""


@final
@dataclass(frozen=True)
class Finished:
    """Result of a finished program.

    Attributes:
        status: exit status; 0 for success.
        output: standard output.
        messages: standard error, decoded.
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
    """Run a program to its end and return its result.

    The locale of the program is "C". An interrupt also stops the program.

    Args:
        command: program and arguments.
        given: standard input.
        limit: time limit [s].
        variables: additional environment variables.
        name: name in messages; the command by default.

    Raises:
        ProgramError: the program does not start or exceeds the time limit.
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
    """Start a program in a new session; use `end` to stop it and close its streams.

    Raises:
        ProgramError: the program cannot be started.
    """
    env = {**os.environ, "LC_ALL": "C", **(variables or {})}
    try:
        return subprocess.Popen(
            list(command), stdin=stdin, stdout=stdout, stderr=stderr, env=env,
            start_new_session=True,
        )  # fmt: skip
    except OSError as error:
        raise ProgramError(f"{name or called(command)} does not start: {error.strerror}") from None


def called(command: Sequence[str]) -> str:
    """Return a command as one string, without the folder of its program."""
    return shlex.join((Path(command[0]).name, *command[1:]))


def end(process: subprocess.Popen[bytes]) -> None:
    """Stop a program and its children if they still run, and close its streams.

    SIGTERM is sent first, so that a compiler can remove its temporary files.
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
    """Send a signal to the process group of a program, if the group still exists."""
    with suppress(ProcessLookupError, PermissionError):
        if hasattr(os, "killpg"):
            os.killpg(process.pid, number)
        else:
            process.send_signal(number)


NAMES = ("gcc", "clang", "cc")
PER_BYTE = 1e-4
"""Time [s] per byte of C that is added to `PATIENCE` for compilers.

It is a hundred times the usual compilation time, for machines under load.
"""


class CompileError(ProgramError):
    """Error for a missing compiler, rejected code, or an unusable result."""


@dataclass(frozen=True)
class Compiler:
    """Compiler command with gcc-compatible options."""

    command: tuple[str, ...]

    def __str__(self) -> str:
        return called(self.command)

    def run(
        self, *arguments: str, code: str = "", variables: Mapping[str, str] | None = None
    ) -> str:
        """Run the compiler on files, or on `code` as standard input, and return its messages.

        Raises:
            CompileError: the compiler cannot be started, rejects the code, or exceeds the time
                limit.
        """
        command = (*self.command, *arguments)
        try:
            done = finished(
                command, code.encode(), limit=patience(code), variables=variables, name=str(self)
            )
        except ProgramError as error:
            raise CompileError(str(error)) from None
        if done.status:
            raise CompileError(f"{self} failed with status {done.status}:\n{done.messages}")
        return done.messages

    def warnings(self, *arguments: str) -> list[str]:
        """Run the compiler on files and return the lines with warnings.

        Raises:
            CompileError: see `run`.
        """
        return [line for line in self.run(*arguments).splitlines() if "warning:" in line]


def is_clang(compiler: Compiler) -> bool:
    """Return True for clang, also as `cc`; it rejects some options of gcc."""
    names = (path.name for path in (Path(compiler.command[0]), Path(compiler.command[0]).resolve()))
    return sys.platform == "darwin" or any("clang" in name for name in names)


def patience(code: str) -> float:
    """Return the time limit for the compilation of `code` [s]."""
    return PATIENCE + PER_BYTE * len(code)


def first_error(text: str) -> str:
    """Return the first line of compiler messages together with the first error."""
    head, _, messages = text.partition("\n")
    lines = messages.strip().splitlines()
    error = next((line for line in lines if "error" in line), "".join(lines[:1]))
    return f"{head} {error}".strip()


def find_compiler(name: str | None = None) -> Compiler | None:
    """Return the compiler `name`, by default `$CC` or the first of gcc, clang and cc.

    The result is None if no compiler is found. If `$CC` is set, no other compiler is tried.

    Raises:
        ValueError: `name` is given and not found.
    """
    wanted = os.environ.get("CC") if name is None else name
    for candidate in NAMES if wanted is None or not wanted.strip() else (wanted,):
        with suppress(ValueError):  # unbalanced quotation marks
            words = shlex.split(candidate)
            if words and (path := shutil.which(words[0])) is not None:
                return Compiler((str(Path(path)), *words[1:]))
    if name is not None:
        raise ValueError(f"compiler: expected a C compiler, got {name!r}, which is not found")
    return None


def missing_compiler() -> str:
    """Return the reason why `find_compiler` returned None, with advice."""
    wanted = os.environ.get("CC", "").strip()
    if wanted:
        return f"no C compiler found: $CC is {wanted!r}, which does not exist; fix or unset it"
    return "no C compiler found; install gcc or clang, or set CC"


def needed_compiler() -> Compiler:
    """Return the default compiler.

    Raises:
        CompileError: no compiler is found.
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
