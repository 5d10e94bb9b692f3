"""Programs of this machine: run to their end within a time limit, or stopped with all they started.

Compilers, what they have made, emulators and the tools beside them are run here and nowhere else.
"""

import os
import shlex
import signal
import subprocess
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
