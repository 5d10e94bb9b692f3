"""The C compiler of this machine: finding it, compiling, listing what an object file needs."""

import os
import shlex
import shutil
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

WARNINGS = (
    "-Wall",
    "-Wextra",
    "-Wpedantic",
    "-Wconversion",
    "-Wdouble-promotion",
    "-Wmissing-prototypes",
)

FLAGS = ("-std=c99", "-O2", "-ffp-contract=off")
"""Without contraction to fused multiply-add the C has the bits of CasADi."""


@dataclass(frozen=True)
class Compiler:
    """A command that takes the options of gcc."""

    command: tuple[str, ...]

    def __str__(self) -> str:
        return shlex.join(self.command)

    def object(self, source: Path, target: Path) -> list[str]:
        """Compile `source` to an object file; returns the warnings."""
        done = self._run(*FLAGS, *WARNINGS, "-c", str(source), "-o", str(target))
        return [line for line in done.splitlines() if "warning:" in line]

    def program(self, parts: Sequence[Path], include: Path, target: Path) -> None:
        """Compile and link C and object files."""
        self._run(*FLAGS, f"-I{include}", *map(str, parts), "-o", str(target), "-lm")

    def _run(self, *arguments: str) -> str:
        environment = os.environ | {"LC_ALL": "C"}
        done = subprocess.run(
            [*self.command, *arguments],
            capture_output=True,
            text=True,
            env=environment,
            check=False,
        )
        if done.returncode != 0:
            raise CompileError(f"{self} failed with status {done.returncode}:\n{done.stderr}")
        return done.stderr


class CompileError(RuntimeError):
    """The compiler refused the code; the message holds what it said."""


def find_compiler(compiler: str | None = None) -> Compiler | None:
    """The compiler asked for, or the first found of $CC, gcc and clang; None if there is none.

    Raises:
        ValueError: `compiler` is given and does not exist.
    """
    candidates = (os.environ.get("CC", ""), "gcc", "clang") if compiler is None else (compiler,)
    for candidate in candidates:
        command = tuple(shlex.split(candidate))
        if command and shutil.which(command[0]):
            return Compiler(command)
    if compiler is not None:
        raise ValueError(f"compiler: expected a C compiler, got {compiler!r}, which is not found")
    return None


def needed_symbols(target: Path) -> frozenset[str] | None:
    """Names that an object file takes from elsewhere; None where there is no `nm`."""
    nm = shutil.which("nm")
    if nm is None:
        return None
    done = subprocess.run([nm, "-u", str(target)], capture_output=True, text=True, check=True)
    names = [line.split()[-1] for line in done.stdout.splitlines() if line.split()]
    if sys.platform == "darwin":
        names = [name.removeprefix("_") for name in names]
    return frozenset(names)
