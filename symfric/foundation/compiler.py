"""The C compiler of this machine: found in one place, run in one way, within a time limit."""

import os
import shlex
import shutil
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from symfric.foundation.programs import PATIENCE, ProgramError, called, finished

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
