"""Compiling the C that is given away: with warnings, in C99, and what an object file needs."""

import shutil
import sys
from collections.abc import Sequence
from pathlib import Path

from symfric.foundation.compiler import Compiler
from symfric.foundation.programs import ProgramError, finished

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


def compile_object(compiler: Compiler, source: Path, target: Path) -> list[str]:
    """Compile `source` to an object file; returns the warnings.

    Raises:
        CompileError: the compiler refuses it.
    """
    return compiler.warnings(*FLAGS, *WARNINGS, "-c", str(source), "-o", str(target))


def link_program(compiler: Compiler, parts: Sequence[Path], include: Path, target: Path) -> None:
    """Compile and link C and object files.

    Raises:
        CompileError: the compiler refuses them.
    """
    compiler.run(*FLAGS, f"-I{include}", *map(str, parts), "-o", str(target), "-lm")


def needed_symbols(target: Path) -> frozenset[str] | None:
    """Names that an object file takes from elsewhere; None where no `nm` says it."""
    nm = shutil.which("nm")
    if nm is None:
        return None
    try:
        listed = finished((nm, "-u", str(target))).output.decode(errors="replace")
    except ProgramError:
        return None
    names = [line.split()[-1] for line in listed.splitlines() if line.split()]
    if sys.platform == "darwin":
        names = [name.removeprefix("_") for name in names]
    return frozenset(names)
