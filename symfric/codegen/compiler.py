"""Compiling generated C: warnings, C99, what an object file needs, and its sizes."""

import shutil
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, final

from symfric.codegen.blocks.block import Block
from symfric.codegen.layout import prefix
from symfric.emitter.c99 import Real
from symfric.foundation.compiler import CompileError, Compiler
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


@final
@dataclass(frozen=True)
class Footprint:
    """The object file of one source.

    Attributes:
        text: bytes of code and of constants; None where there is no `size`.
        data: bytes of variables, which there are none of.
        stack: function -> bytes of its own frame; functions of libm come on top. Empty where the
            compiler does not tell.
    """

    text: int | None
    data: int | None
    stack: dict[str, int]

    def to_dict(self) -> dict[str, Any]:
        """Everything by name."""
        return {"text": self.text, "data": self.data, "stack": dict(self.stack)}


def footprint(
    block: Block, real: Real, folder: Path, compiler: Compiler, flags: Sequence[str] = ()
) -> Footprint:
    """Compile the source of a block in `folder` and measure the object file.

    Args:
        flags: beside -std=c99 -O2 -ffp-contract=off, such as -mcpu=cortex-m4 of a cross-compiler.

    Raises:
        CompileError: the compiler refuses it.
    """
    stem = prefix(block, real)
    with TemporaryDirectory(prefix="symfric-") as place:
        target = Path(place) / f"{stem}.o"
        command = [*FLAGS, *flags, "-c", str(folder / f"{stem}.c"), "-o", str(target)]
        try:
            compiler.run("-fstack-usage", *command)
        except CompileError:  # clang before 11, and others, do not know the option
            compiler.run(*command)
        said = target.with_suffix(".su")
        stack = _stack(said.read_text(encoding="utf-8")) if said.is_file() else {}
        text, data = _sizes(compiler, target)
    return Footprint(text, data, stack)


def _stack(text: str) -> dict[str, int]:
    """The frames in a file of -fstack-usage: "file:line:column:function", bytes, kind."""
    rows = [line.split("\t") for line in text.splitlines() if line.count("\t") >= 2]
    return {row[0].rpartition(":")[2]: int(row[1]) for row in rows}


def _sizes(compiler: Compiler, target: Path) -> tuple[int | None, int | None]:
    """Bytes of text and of data with bss, by the `size` beside the compiler."""
    program = Path(compiler.command[0])
    beside = program.name.removesuffix("gcc") + "size" if program.name.endswith("gcc") else "size"
    size = shutil.which(str(program.with_name(beside))) or shutil.which(beside)
    if size is None:
        return None, None
    try:
        done = finished((size, str(target)))
    except ProgramError:
        return None, None
    if done.status:
        return None, None
    text, data, bss, *_ = done.output.decode().splitlines()[1].split()
    return int(text), int(data) + int(bss)
