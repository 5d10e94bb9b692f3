"""The C compiler and other programs of this machine, run to their end or to a time limit.

Compilers, what they have made, emulators and the tools beside them are run here and nowhere else.
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
"""Seconds that a program may take unless told otherwise: one that waits for something is stopped,
one on a machine under load is not."""
GRACE = 1.0
"""Seconds for a program that was asked to stop."""
KILL = getattr(signal, "SIGKILL", signal.SIGTERM)


class ProgramError(RuntimeError):
    """A program does not start, or comes to no end."""


@final
@dataclass(frozen=True)
class Finished:
    """What is left of a program.

    Attributes:
        status: 0 where it says that all went well.
        output: what it wrote on standard output.
        said: its standard error, as text.
    """

    status: int
    output: bytes
    said: str


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
        variables: of its environment, besides those of this process.
        name: what messages call it; default the command.

    Raises:
        ProgramError: it does not start, or comes to no end.
    """
    pipe = subprocess.PIPE
    process = started(command, stdin=pipe, stdout=pipe, stderr=pipe, variables=variables, name=name)
    try:
        output, said = process.communicate(given, timeout=limit)
    except subprocess.TimeoutExpired:
        raise ProgramError(
            f"{name or called(command)} came to no end within {limit:.0f} s"
        ) from None
    finally:
        end(process)
    return Finished(process.returncode, output, said.decode(errors="replace"))


def started(
    command: Sequence[str],
    *,
    stdin: IO[bytes] | int,
    stdout: int = subprocess.DEVNULL,
    stderr: int = subprocess.DEVNULL,
    variables: Mapping[str, str] | None = None,
    name: str = "",
) -> subprocess.Popen[bytes]:
    """A program's process, which leads a session of its own; `end` stops and closes it.

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
    """A command without the folder of its program."""
    return shlex.join((Path(command[0]).name, *command[1:]))


def end(process: subprocess.Popen[bytes]) -> None:
    """Stop a program that still runs, after an interrupt too, and what it has started.

    It is asked first: then a compiler takes its temporary files away.
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
    """Send a signal to all that a program has started; there may be nobody left."""
    with suppress(ProcessLookupError, PermissionError):
        if hasattr(os, "killpg"):
            os.killpg(process.pid, number)
        else:
            process.send_signal(number)


NAMES = ("gcc", "clang", "cc")
PER_BYTE = 1e-4
"""Seconds that a compiler may take for each byte of C, besides `PATIENCE`: a hundred times the
usual, for machines under load."""


class CompileError(ProgramError):
    """There is no compiler, it refused the code, or what it made cannot be used."""


@dataclass(frozen=True)
class Compiler:
    """A command that takes the options of gcc."""

    command: tuple[str, ...]

    def __str__(self) -> str:
        return called(self.command)

    def run(
        self, *arguments: str, code: str = "", variables: Mapping[str, str] | None = None
    ) -> str:
        """Run it on `code`, its standard input, or on files; returns what it says.

        Raises:
            CompileError: it cannot be started, refuses the code, or does not come to an end.
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
            raise CompileError(f"{self} failed with status {done.status}:\n{done.said}")
        return done.said

    def warnings(self, *arguments: str) -> list[str]:
        """Run it on files; returns the lines in which it warns.

        Raises:
            CompileError: as `run`.
        """
        return [line for line in self.run(*arguments).splitlines() if "warning:" in line]


def is_clang(compiler: Compiler) -> bool:
    """Whether it is a clang, which refuses some options of gcc; `cc` often is a link to one."""
    names = (path.name for path in (Path(compiler.command[0]), Path(compiler.command[0]).resolve()))
    return sys.platform == "darwin" or any("clang" in name for name in names)


def patience(code: str) -> float:
    """Seconds that a compiler may take for `code`."""
    return PATIENCE + PER_BYTE * len(code)


def first_error(text: str) -> str:
    """The head of what a compiler said, and its first error."""
    head, _, said = text.partition("\n")
    lines = said.strip().splitlines()
    error = next((line for line in lines if "error" in line), "".join(lines[:1]))
    return f"{head} {error}".strip()


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


def missing_compiler() -> str:
    """Why `find_compiler` found none, and what to do."""
    asked = os.environ.get("CC", "").strip()
    if asked:
        return f"no C compiler found: $CC is {asked!r}, which is not there; correct it or unset CC"
    return "no C compiler found; install gcc or clang, or set CC"


def needed_compiler() -> Compiler:
    """The compiler of this machine.

    Raises:
        CompileError: there is none.
    """
    found = find_compiler()
    if found is None:
        raise no_compiler()
    return found


def no_compiler() -> CompileError:
    """What to say where there is none."""
    wanted = os.environ.get("CC")
    found = f"$CC is {wanted!r}, which is not found" if wanted else "found none"
    return CompileError(
        f"compile: expected a C compiler ($CC, gcc, clang or cc), {found}; use backend='vm'"
    )
